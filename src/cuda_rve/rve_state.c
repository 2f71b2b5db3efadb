/* SPDX-License-Identifier: GPL-2.0-or-later */
/* An RVE's arena on the host: made from a packing, grown, changed from outside. */
#include "rve_state.h"

#include <math.h>
#include <string.h>

#include "../base/tensor.h"
#include "rve_backend.h"
#include "rve_contacts.h"

static const double pi = 3.14159265358979323846;

RveCounts rve_counts_for(const RveKernels *kernels, int dimension, int grains) {
  RveCounts n;
  memset(&n, 0, sizeof n);
  n.dimension = dimension;
  n.grains = grains;
  n.lanes = kernels->lanes;
  n.blocks = (grains + kernels->lanes - 1) / kernels->lanes;
  /* A dense packing needs 2.6 and 3.2 rows per block of 32 in 2D, 3.9 and 7.0 in 3D. Little more, or 400 disks could not share a GPU's
   * multiprocessor with 400 others. */
  n.slot_rows = dimension == 2 ? 3 * n.blocks + 2 : 4 * n.blocks + n.blocks / 2 + 4;
  n.incoming_rows = dimension == 2 ? 4 * n.blocks + 2 : 8 * n.blocks + 4;
  n.row = kernels->row[dimension - 2];
  n.reaction = kernels->reaction[dimension - 2];
  return n;
}

BaseStatus rve_record_alloc(const RveCounts *n, RveRecord *record) {
  memset(record, 0, sizeof *record);
  record->counts = *n;
  record->bytes = rve_layout(n, NULL, &record->arrays);
  TRY(base_alloc(record->bytes, 1, &record->arena));
  rve_layout(n, record->arena, &record->arrays);
  return BASE_OK;
}

void rve_record_destroy(RveRecord *record) {
  if (!record) return;
  base_free(record->arena);
  memset(record, 0, sizeof *record);
}

/* ------------------------------------------------------------------------------------------------ from a packing */

static double inverse_inertia(const RveScene *scene, double mass, double r) {
  return scene->rotation ? 1.0 / ((scene->grain == RVE_DISK ? 0.5 : 0.4) * mass * r * r) : 0.0;
}

static void set_grain(const RveScene *scene, const RvePacking *packing, int i, const RveArrays *a) {
  const double r = packing->radius[i];
  const double volume = scene->grain == RVE_DISK ? pi * r * r * scene->thickness : 4.0 / 3.0 * pi * r * r * r;
  const double mass = scene->density * volume;
  a->id[i] = i;
  a->radius[i] = a->reference_radius[i] = r;
  a->mass[i] = mass;
  a->inverse_mass[i] = 1.0 / mass;
  a->inverse_inertia[i] = inverse_inertia(scene, mass, r);
  for (int k = 0; k < scene->dimension; k++) {
    const double s = packing->position[3 * i + k];
    a->position[k][i] = (int64_t)llrint((s - floor(s + 0.5)) * (double)RVE_ONE);
    a->velocity[k][i] = packing->velocity ? packing->velocity[3 * i + k] : 0.0;
  }
  if (!packing->spin) return;
  if (scene->dimension == 2) a->spin[0][i] = packing->spin[3 * i + 2];
  else
    for (int k = 0; k < 3; k++) a->spin[k][i] = packing->spin[3 * i + k];
}

/* The packing's contacts with P in wrapped coordinates, as the list keeps them. */
static BaseStatus packing_contacts(const RveScene *scene, const RvePacking *packing, const RveHead *head,
                                   RveContacts *contacts) {
  TRY(rve_contacts_create(packing->contacts, contacts));
  for (int c = 0; c < packing->contacts; c++) {
    const int i = packing->contact_pair[2 * c], j = packing->contact_pair[2 * c + 1];
    RveContact *contact = &contacts->contact[contacts->count];
    double d[3] = {0.0, 0.0, 0.0};
    memset(contact, 0, sizeof *contact);
    contact->pair[0] = i, contact->pair[1] = j;
    for (int k = 0; k < scene->dimension; k++) {
      const double si = packing->position[3 * i + k], sj = packing->position[3 * j + k];
      const double image = packing->contact_image[3 * c + k] + floor(sj + 0.5) - floor(si + 0.5);
      for (int m = 0; m < 3; m++) d[m] += head->cell[3 * m + k] * (sj - si + packing->contact_image[3 * c + k]);
      contact->image[k] = fabs(image) <= RVE_IMAGE_MAX ? (int)image : RVE_IMAGE_EMPTY;
    }
    if (!rve_image_fits(contact->image)) continue; /* farther than any contact can be */
    const double *f = packing->contact_shear + 3 * c, length = sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
    if (!(length > 0.0)) continue;
    if (scene->dimension == 2) contact->shear[0] = (d[0] * f[1] - d[1] * f[0]) / length;
    else memcpy(contact->shear, f, 3 * sizeof *f);
    contacts->count++;
  }
  return BASE_OK;
}

static BaseStatus fill_record(const RveScene *scene, const RvePacking *packing, const RveContacts *contacts,
                              RveRecord *record) {
  RveHead *head = rve_head(record->arena);
  const RveArrays *a = &record->arrays;
  for (int i = 0; i < packing->grains; i++) {
    set_grain(scene, packing, i, a);
    head->radius_max = fmax(head->radius_max, packing->radius[i]);
    head->radius_min = i == 0 ? packing->radius[i] : fmin(head->radius_min, packing->radius[i]);
  }
  for (int i = packing->grains; i < record->counts.blocks * record->counts.lanes; i++) a->id[i] = -1;
  return rve_contacts_place(contacts, NULL, record);
}

BaseStatus rve_record_from_packing(const RveKernels *kernels, const RveScene *scene, const RvePacking *packing,
                                   RveRecord *record) {
  RveCounts n = rve_counts_for(kernels, scene->dimension, packing->grains);
  RveHead head;
  RveContacts contacts = {0, NULL};
  memset(&head, 0, sizeof head);
  memset(record, 0, sizeof *record);
  memcpy(head.cell, packing->cell, sizeof head.cell);
  tensor_inverse(head.cell, head.inverse);
  head.temperature = scene->thermal ? scene->reference_temperature : 0.0;
  head.scale = head.scale_at_list = head.stretch = 1.0;
  head.list_due = RVE_LIST_ABSENT;
  head.critical_time_step = rve_critical_time_step(scene, packing);
  BaseStatus status;
  int rows = 0;
  TRY_GOTO(packing_contacts(scene, packing, &head, &contacts), status, done);
  TRY_GOTO(rve_contacts_rows(&contacts, NULL, &n, &rows), status, done);
  if (rows > n.slot_rows) n.slot_rows = rows;
  TRY_GOTO(rve_record_alloc(&n, record), status, done);
  *rve_head(record->arena) = head;
  status = fill_record(scene, packing, &contacts, record);
done:
  rve_contacts_destroy(&contacts);
  return status;
}

/* -------------------------------------------------------------------------------------------------------- changes */

/* Copies grains and list from one layout to another with at least as many rows. */
static void copy_arena(const RveRecord *from, RveRecord *to) {
  const RveArrays *a = &from->arrays, *b = &to->arrays;
  const RveCounts *n = &from->counts;
  const size_t grains = (size_t)n->blocks * (size_t)n->lanes, slots = (size_t)n->slot_rows * (size_t)n->lanes;
  const int spins = n->dimension == 2 ? 1 : 3;
  *rve_head(to->arena) = *rve_head(from->arena);
  for (int k = 0; k < n->dimension; k++) {
    memcpy(b->position[k], a->position[k], grains * 8);
    memcpy(b->position_at_list[k], a->position_at_list[k], grains * 8);
    memcpy(b->velocity[k], a->velocity[k], grains * 8);
    memcpy(b->force[k], a->force[k], grains * 8);
  }
  for (int k = 0; k < spins; k++) {
    memcpy(b->spin[k], a->spin[k], grains * 8);
    memcpy(b->torque[k], a->torque[k], grains * 8);
    memcpy(b->shear[k], a->shear[k], slots * 8);
  }
  const double *const from_grain[] = {a->radius, a->reference_radius, a->mass, a->inverse_mass, a->inverse_inertia};
  double *const to_grain[] = {b->radius, b->reference_radius, b->mass, b->inverse_mass, b->inverse_inertia};
  for (int k = 0; k < 5; k++) memcpy(to_grain[k], from_grain[k], grains * 8);
  memcpy(b->id, a->id, grains * sizeof *a->id);
  memcpy(b->row, a->row, grains * (size_t)n->row * 8);
  memcpy(b->neighbour, a->neighbour, slots * sizeof *a->neighbour);
  memcpy(b->image, a->image, slots * sizeof *a->image);
  memcpy(b->slot_first, a->slot_first, ((size_t)n->blocks + 1) * sizeof *a->slot_first);
  /* Reactions and incoming lists are written anew: a larger arena is wanted only by a list under construction. */
}

BaseStatus rve_record_grow(RveRecord *record) {
  const RveHead *head = rve_head(record->arena);
  RveCounts n = record->counts;
  RveRecord larger;
  if (head->need_slot_rows > n.slot_rows) n.slot_rows = head->need_slot_rows;
  if (head->need_incoming_rows > n.incoming_rows) n.incoming_rows = head->need_incoming_rows;
  if (n.slot_rows == record->counts.slot_rows && n.incoming_rows == record->counts.incoming_rows) return BASE_OK;
  TRY(rve_record_alloc(&n, &larger));
  larger.last = record->last;
  larger.conduction = record->conduction;
  copy_arena(record, &larger);
  rve_record_destroy(record);
  *record = larger;
  return BASE_OK;
}

void rve_record_install_bonds(RveRecord *record) {
  RveHead *head = rve_head(record->arena);
  RveSlot slot;
  head->bonds_installed = 0;
  for (rve_slot_start(record, &slot); rve_slot_next(&slot);)
    if (slot.overlap > 0.0 || (*slot.image_word & RVE_IMAGE_BOND)) {
      *slot.image_word |= RVE_IMAGE_BOND;
      head->bonds_installed++;
    }
}

void rve_record_rest(RveRecord *record) {
  const RveCounts *n = &record->counts;
  const RveArrays *a = &record->arrays;
  const size_t bytes = (size_t)n->blocks * (size_t)n->lanes * 8;
  memset(rve_head(record->arena)->rate, 0, sizeof rve_head(record->arena)->rate);
  for (int k = 0; k < n->dimension; k++) memset(a->velocity[k], 0, bytes);
  for (int k = 0; k < (n->dimension == 2 ? 1 : 3); k++) memset(a->spin[k], 0, bytes);
}

void rve_record_set_rotation(RveRecord *record, const RveScene *scene) {
  const RveArrays *a = &record->arrays;
  for (int q = 0; q < record->counts.grains; q++)
    a->inverse_inertia[q] = inverse_inertia(scene, a->mass[q], a->reference_radius[q]);
}
