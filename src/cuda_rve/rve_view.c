/* SPDX-License-Identifier: GPL-2.0-or-later */
/* An RVE's grains and contacts for writers, tests and other batches. */
#include <string.h>

#include "rve_backend.h"
#include "rve_contacts.h"

/* Force of the slot's contact on its owner, from the reaction it stored. */
static void slot_force(const RveRecord *record, int slot, double f[3]) {
  const RveArrays *a = &record->arrays;
  const int width = rve_reaction_width(&record->counts); /* doubles, or pairs of FP32 */
  const double *at = a->reaction + (width == 0 ? 0 : rve_reaction_at(&record->counts, slot));
  float half[4] = {0};
  if (width == 2) memcpy(half, at, sizeof half);
  f[2] = 0.0;
  for (int k = 0; k < record->counts.dimension; k++)
    f[k] = width == 0 ? -a->reaction_field[k][slot] : width == 2 ? -(double)half[k] : -at[k];
}

static int is_contact(const RveSlot *slot) { return slot->overlap > 0.0 || (*slot->image_word & RVE_IMAGE_BOND); }

static int count_contacts(const RveRecord *record) {
  RveSlot slot;
  int count = 0;
  for (rve_slot_start(record, &slot); rve_slot_next(&slot);) count += is_contact(&slot);
  return count;
}

static void fractional(const RveRecord *record, int q, double s[3]) {
  s[2] = 0.0;
  for (int k = 0; k < record->counts.dimension; k++) {
    const int64_t p = record->arrays.position[k][q];
    s[k] = (double)(p - ((p + RVE_ONE / 2) >> 60) * RVE_ONE) * RVE_UNIT;
    if (s[k] >= 0.5) s[k] = -0.5; /* rounding of the last half unit */
  }
}

/* P between wrapped positions. */
static void wrapped_image(const RveSlot *slot, int image[3]) {
  const RveArrays *a = &slot->record->arrays;
  image[2] = 0;
  for (int k = 0; k < slot->record->counts.dimension; k++) {
    image[k] = slot->image[k] + (int)((a->position[k][slot->j] + RVE_ONE / 2) >> 60) -
               (int)((a->position[k][slot->i] + RVE_ONE / 2) >> 60);
  }
}

static void spin_of(const RveRecord *record, int q, double w[3]) {
  const RveArrays *a = &record->arrays;
  if (record->counts.dimension == 2) w[0] = w[1] = 0.0, w[2] = a->spin[0][q];
  else
    for (int k = 0; k < 3; k++) w[k] = a->spin[k][q];
}

/* ----------------------------------------------------------------------------------------------------------- view */

void rve_view_destroy(RveView *view) {
  if (!view) return;
  base_free(view->position), base_free(view->radius), base_free(view->velocity), base_free(view->spin);
  base_free(view->pair), base_free(view->image), base_free(view->branch);
  base_free(view->force_normal), base_free(view->force_shear), base_free(view->bond);
  memset(view, 0, sizeof *view);
}

static BaseStatus alloc_view(int grains, int contacts, RveView *view) {
  const size_t n = (size_t)grains, c = (size_t)contacts;
  TRY(BASE_ALLOC(3 * n, &view->position));
  TRY(BASE_ALLOC(n, &view->radius));
  TRY(BASE_ALLOC(3 * n, &view->velocity));
  TRY(BASE_ALLOC(3 * n, &view->spin));
  TRY(BASE_ALLOC(2 * c, &view->pair));
  TRY(BASE_ALLOC(3 * c, &view->image));
  TRY(BASE_ALLOC(3 * c, &view->branch));
  TRY(BASE_ALLOC(c, &view->force_normal));
  TRY(BASE_ALLOC(3 * c, &view->force_shear));
  return BASE_ALLOC(c, &view->bond);
}

static void view_contact(const RveSlot *slot, int c, RveView *view) {
  double f[3], normal = 0.0;
  slot_force(slot->record, slot->slot, f);
  view->pair[2 * c] = slot->record->arrays.id[slot->i];
  view->pair[2 * c + 1] = slot->record->arrays.id[slot->j];
  wrapped_image(slot, view->image + 3 * c);
  for (int k = 0; k < 3; k++) normal -= f[k] * slot->branch[k] / slot->length;
  view->force_normal[c] = normal;
  for (int k = 0; k < 3; k++) {
    view->branch[3 * c + k] = slot->branch[k];
    view->force_shear[3 * c + k] = f[k] + normal * slot->branch[k] / slot->length;
  }
  view->bond[c] = (*slot->image_word & RVE_IMAGE_BOND) != 0;
}

BaseStatus rve_record_view(const RveRecord *record, RveView *view) {
  const RveArrays *a = &record->arrays;
  const RveHead *head = rve_head(record->arena);
  const int grains = record->counts.grains, contacts = count_contacts(record);
  memset(view, 0, sizeof *view);
  BaseStatus status = alloc_view(grains, contacts, view);
  if (status != BASE_OK) {
    rve_view_destroy(view);
    return status;
  }
  view->grains = grains, view->contacts = contacts;
  memcpy(view->cell, head->cell, sizeof view->cell);
  for (int q = 0; q < grains; q++) {
    const int i = a->id[q];
    double s[3];
    fractional(record, q, s);
    for (int k = 0; k < 3; k++)
      view->position[3 * i + k] =
          head->cell[3 * k] * s[0] + head->cell[3 * k + 1] * s[1] + head->cell[3 * k + 2] * s[2];
    view->radius[i] = a->radius[q];
    for (int k = 0; k < record->counts.dimension; k++) view->velocity[3 * i + k] = a->velocity[k][q];
    spin_of(record, q, view->spin + 3 * i);
  }
  RveSlot slot;
  int c = 0;
  for (rve_slot_start(record, &slot); rve_slot_next(&slot);)
    if (is_contact(&slot)) view_contact(&slot, c++, view);
  return BASE_OK;
}

/* -------------------------------------------------------------------------------------------------------- packing */

static BaseStatus alloc_packing(int grains, int contacts, RvePacking *packing) {
  const size_t n = (size_t)grains, c = (size_t)contacts;
  TRY(BASE_ALLOC(3 * n, &packing->position));
  TRY(BASE_ALLOC(n, &packing->radius));
  TRY(BASE_ALLOC(3 * n, &packing->velocity));
  TRY(BASE_ALLOC(3 * n, &packing->spin));
  TRY(BASE_ALLOC(2 * c, &packing->contact_pair));
  TRY(BASE_ALLOC(3 * c, &packing->contact_image));
  return BASE_ALLOC(3 * c, &packing->contact_shear);
}

static void packing_contact(const RveSlot *slot, int c, RvePacking *packing) {
  const RveArrays *a = &slot->record->arrays;
  const double *d = slot->branch, l = slot->length;
  packing->contact_pair[2 * c] = a->id[slot->i];
  packing->contact_pair[2 * c + 1] = a->id[slot->j];
  wrapped_image(slot, packing->contact_image + 3 * c);
  double *f = packing->contact_shear + 3 * c;
  if (slot->record->counts.dimension == 2) {
    f[0] = -a->shear[0][slot->slot] * d[1] / l;
    f[1] = a->shear[0][slot->slot] * d[0] / l;
  } else
    for (int k = 0; k < 3; k++) f[k] = a->shear[k][slot->slot];
}

BaseStatus rve_record_packing(const RveRecord *record, RvePacking *packing) {
  const RveArrays *a = &record->arrays;
  const int grains = record->counts.grains, contacts = count_contacts(record);
  memset(packing, 0, sizeof *packing);
  BaseStatus status = alloc_packing(grains, contacts, packing);
  if (status != BASE_OK) {
    rve_packing_destroy(packing);
    return status;
  }
  packing->dimension = record->counts.dimension;
  packing->grains = grains, packing->contacts = contacts;
  memcpy(packing->cell, rve_head(record->arena)->cell, sizeof packing->cell);
  for (int q = 0; q < grains; q++) {
    const int i = a->id[q];
    fractional(record, q, packing->position + 3 * i);
    packing->radius[i] = a->reference_radius[q];
    for (int k = 0; k < record->counts.dimension; k++) packing->velocity[3 * i + k] = a->velocity[k][q];
    spin_of(record, q, packing->spin + 3 * i);
  }
  RveSlot slot;
  int c = 0;
  for (rve_slot_start(record, &slot); rve_slot_next(&slot);)
    if (is_contact(&slot)) packing_contact(&slot, c++, packing);
  return BASE_OK;
}
