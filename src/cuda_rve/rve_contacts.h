/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Contacts of an RVE outside the kernels: walking over the slots of a list, and contacts named by the grains' ids. */
#ifndef DEMPM_RVE_CONTACTS_H
#define DEMPM_RVE_CONTACTS_H

#include "rve_backend.h"

/* One contact by ids: of two grains and the shift P of the second one's image. */
typedef struct RveContact {
  int pair[2];
  int image[3];
  int bond;
  double shear[3]; /* tangential force on the first grain, N; 2D: [0], along (-n_y, n_x) */
} RveContact;
typedef struct RveContacts {
  int count;
  RveContact *contact;
} RveContacts;

BaseStatus rve_contacts_create(int capacity, RveContacts *contacts); /* count = 0 */
void rve_contacts_destroy(RveContacts *contacts);
/* Slot rows that rve_contacts_place needs. place_of_id NULL: grain i is at i. */
BaseStatus rve_contacts_rows(const RveContacts *contacts, const int32_t *place_of_id, const RveCounts *n, int *rows);
/* Makes the contacts the record's list, to be carried over when the next list is built (incoming lists stay empty). */
BaseStatus rve_contacts_place(const RveContacts *contacts, const int32_t *place_of_id, RveRecord *record);

/* Walks over occupied slots: for (rve_slot_start(r, &s); rve_slot_next(&s);). */
typedef struct RveSlot {
  const RveRecord *record;
  int block, slot; /* present place */
  int i, j;        /* places of the grains */
  int image[3];
  uint16_t *image_word;
  double branch[3], length, overlap; /* m */
} RveSlot;
void rve_slot_start(const RveRecord *record, RveSlot *slot);
int rve_slot_next(RveSlot *slot);

#endif
