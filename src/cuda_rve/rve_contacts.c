/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "rve_contacts.h"

#include <math.h>
#include <string.h>

BaseStatus rve_contacts_create(int capacity, RveContacts *contacts) {
  contacts->count = 0;
  return BASE_ALLOC((size_t)capacity, &contacts->contact);
}

void rve_contacts_destroy(RveContacts *contacts) {
  base_free(contacts->contact);
  contacts->contact = NULL;
  contacts->count = 0;
}

static int place_of(const int32_t *place_of_id, int id) { return place_of_id ? place_of_id[id] : id; }

/* first [blocks + 1]: rows of each block, as many as its busiest grain has contacts. degree [N]: working memory. */
static void deal(const RveContacts *contacts, const int32_t *place_of_id, const RveCounts *n, int32_t *degree,
                 int32_t *first) {
  memset(degree, 0, (size_t)n->blocks * (size_t)n->lanes * sizeof *degree);
  memset(first, 0, ((size_t)n->blocks + 1) * sizeof *first);
  for (int c = 0; c < contacts->count; c++) {
    const int i = place_of(place_of_id, contacts->contact[c].pair[0]), block = i / n->lanes;
    degree[i]++;
    first[block + 1] = degree[i] > first[block + 1] ? degree[i] : first[block + 1];
  }
  for (int block = 0; block < n->blocks; block++) first[block + 1] += first[block];
}

BaseStatus rve_contacts_rows(const RveContacts *contacts, const int32_t *place_of_id, const RveCounts *n, int *rows) {
  int32_t *degree = NULL, *first = NULL;
  BaseStatus status;
  TRY_GOTO(BASE_ALLOC((size_t)n->blocks * (size_t)n->lanes, &degree), status, done);
  TRY_GOTO(BASE_ALLOC((size_t)n->blocks + 1, &first), status, done);
  deal(contacts, place_of_id, n, degree, first);
  *rows = first[n->blocks];
done:
  base_free(degree);
  base_free(first);
  return status;
}

BaseStatus rve_contacts_place(const RveContacts *contacts, const int32_t *place_of_id, RveRecord *record) {
  const RveCounts *n = &record->counts;
  const RveArrays *a = &record->arrays;
  const int stride = n->row ? n->row : 1;
  int32_t *degree;
  TRY(BASE_ALLOC((size_t)n->blocks * (size_t)n->lanes, &degree));
  deal(contacts, place_of_id, n, degree, a->slot_first);
  memset(degree, 0, (size_t)n->blocks * (size_t)n->lanes * sizeof *degree);
  for (int block = 0; block < n->blocks; block++)
    for (int row = a->slot_first[block]; row < a->slot_first[block + 1]; row++)
      for (int lane = 0; lane < n->lanes; lane++) {
        a->neighbour[row * n->lanes + lane] = (uint32_t)((block * n->lanes + lane) * stride);
        a->image[row * n->lanes + lane] = RVE_IMAGE_EMPTY | RVE_IMAGE_VOID;
      }
  for (int c = 0; c < contacts->count; c++) {
    const RveContact *contact = &contacts->contact[c];
    const int i = place_of(place_of_id, contact->pair[0]), j = place_of(place_of_id, contact->pair[1]);
    const int slot = (a->slot_first[i / n->lanes] + degree[i]++) * n->lanes + i % n->lanes;
    a->neighbour[slot] = (uint32_t)(j * stride);
    a->image[slot] = (uint16_t)(rve_image_pack(contact->image) | (contact->bond ? RVE_IMAGE_BOND : 0));
    for (int k = 0; k < (n->dimension == 2 ? 1 : 3); k++) a->shear[k][slot] = contact->shear[k];
  }
  base_free(degree);
  return BASE_OK;
}

void rve_slot_start(const RveRecord *record, RveSlot *slot) {
  memset(slot, 0, sizeof *slot);
  slot->record = record;
  slot->slot = -1;
}

static void slot_geometry(RveSlot *slot) {
  const RveArrays *a = &slot->record->arrays;
  const double *h = rve_head(slot->record->arena)->cell;
  double x[3] = {0.0, 0.0, 0.0}, square = 0.0;
  for (int k = 0; k < slot->record->counts.dimension; k++) {
    /* unsigned: a grain that ran away may be anywhere */
    const uint64_t apart = (uint64_t)a->position[k][slot->j] - (uint64_t)a->position[k][slot->i];
    x[k] = (double)(int64_t)(apart + (uint64_t)(slot->image[k] * RVE_ONE)) * RVE_UNIT;
  }
  for (int k = 0; k < 3; k++) {
    slot->branch[k] = h[3 * k] * x[0] + h[3 * k + 1] * x[1] + h[3 * k + 2] * x[2];
    square += slot->branch[k] * slot->branch[k];
  }
  if (slot->record->counts.dimension == 2) square -= slot->branch[2] * slot->branch[2], slot->branch[2] = 0.0;
  slot->length = sqrt(square);
  slot->overlap = a->radius[slot->i] + a->radius[slot->j] - slot->length;
}

int rve_slot_next(RveSlot *slot) {
  const RveCounts *n = &slot->record->counts;
  const RveArrays *a = &slot->record->arrays;
  for (slot->slot++; slot->block < n->blocks; slot->slot++) {
    while (slot->block < n->blocks && slot->slot >= a->slot_first[slot->block + 1] * n->lanes) slot->block++;
    if (slot->block == n->blocks) return 0;
    slot->image_word = &a->image[slot->slot];
    if (*slot->image_word & RVE_IMAGE_VOID) continue;
    slot->i = slot->block * n->lanes + slot->slot % n->lanes;
    slot->j = (int)a->neighbour[slot->slot] / (n->row ? n->row : 1);
    rve_image_unpack(*slot->image_word, slot->image);
    slot_geometry(slot);
    return 1;
  }
  return 0;
}
