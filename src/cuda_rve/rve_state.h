/* SPDX-License-Identifier: GPL-2.0-or-later */
/* One RVE's state: a head and arrays in one contiguous block of memory ("arena"), the same for all backends.
 *
 * Positions are fractional and fixed-point: int64 in units of 2^-60 cell edges, so that differences are exact. They are
 * not wrapped between neighbour lists; every slot of the list carries its integer image shift P instead: branch = H
 * (s_j - s_i + P).
 *
 * The list. Grains are sorted by degree and dealt in blocks of `lanes`; grain i of block b owns the slots (row, i mod
 * lanes) of the rows slot_first[b] .. slot_first[b+1]. Each contact has exactly one slot, at the grain that "owns" it
 * (degrees are balanced); the other grain finds it in its incoming list. A slot without contact names its own grain,
 * many cells away.
 *
 * Pairs that touch or nearly do come first in a block's rows, the others have rows of their own. A row of which no pair
 * touches rests until its nearest pair may: idle_until says when, on the clock of RveHead.approach. */
#ifndef DEMPM_RVE_STATE_H
#define DEMPM_RVE_STATE_H

#include "rve.h"
#include "rve_team.h"

#define RVE_UNIT 0x1p-60           /* of a cell edge */
#define RVE_ONE (INT64_C(1) << 60) /* a cell edge in units */

enum {
  RVE_IMAGE_MAX = 5,        /* |P| of a contact in a reduced cell; more means the cell is too narrow */
  RVE_IMAGE_EMPTY = 6,      /* P_x of an empty slot */
  RVE_IMAGE_BOND = 1 << 12, /* intact bond */
  RVE_IMAGE_VOID = 1 << 13, /* empty slot */
  RVE_IMAGE_FAR = 1 << 14   /* only while a list is built: no contact for some time to come */
};

enum { RVE_LIST_GOOD, RVE_LIST_CHECK /* its running bound is spent */, RVE_LIST_ABSENT /* must be built */ };

typedef struct RveCounts {
  int32_t dimension, grains, lanes, blocks;
  int32_t slot_rows, incoming_rows; /* capacity, in rows of `lanes` */
  int32_t row;                      /* doubles per grain's row; 0: no rows */
  int32_t reaction; /* doubles per slot's reaction: 4 in FP64, 2 in FP32, half as many more in 3D or RVE_WHOLE; 0: arrays */
} RveCounts;

/* Everything about an RVE that is not an array. Plain values only: it is copied and stored raw. */
typedef struct RveHead {
  double cell[9], inverse[9]; /* H, m, and its inverse, 1/m */
  double cell_at_list[9];
  double rate[9];            /* D of the last step, 1/s: the present forces of dashpots depend on it */
  double temperature, scale; /* radius = scale * reference radius */
  double scale_at_list;
  double reach;                       /* m: no grain's fluctuation has moved further since the list was built */
  double stretch;                     /* the affine flow has shortened no length by more than this factor since then */
  double skin;                        /* m: pairs within (R_i + R_j) scale_at_list + skin are in the list */
  double radius_max, radius_min;      /* m, reference */
  double friction_work, damping_work; /* J since creation */
  double critical_time_step;          /* s */
  int64_t steps, rebuilds, steps_at_list;
  int64_t done;     /* steps of the present call; not 0 only while waiting for a larger arena */
  int32_t list_due; /* RVE_LIST_*: what must happen before the next contact pass */
  int32_t failed;   /* BASE_ERROR_UNSTABLE after the watchdog spoke, for ever */
  int32_t bonds_installed;
  int32_t need_slot_rows, need_incoming_rows, need_pairs; /* set when an arena is too small */
  int16_t apart;    /* no grains touch, no bond holds and no force is left: the next call may be a free flight */
  int16_t carried;  /* RveArrays.branch is that of the last contact pass; 0: positions have to give it */
  int32_t flew;     /* the last call was one */
  double approach;   /* m: no gap between two grains has shrunk by more since the list was built; never falls */
} RveHead;

/* Arrays of an arena. N = blocks * lanes grains (the last ones are massless padding). [k] counts components. */
typedef struct RveArrays {
  int64_t *position[3]; /* [N] */
  int64_t *position_at_list[3];
  double *velocity[3];          /* [N] m/s, fluctuation, half a step behind the position */
  double *spin[3];              /* [N] rad/s relative to the affine flow's vorticity; 2D: [0] is about z */
  double *force[3], *torque[3]; /* [N] of own slots only; 2D: torque[0] */
  double *radius, *reference_radius, *mass, *inverse_mass, *inverse_inertia; /* [N] */
  int32_t *id;         /* [N] index of the grain in its packing; -1 padding */
  double *row;         /* [N][counts.row] what neighbours read, see rve_body.h */
  uint32_t *neighbour; /* [slot] j (times counts.row if rows exist); one row more than the list has */
  uint16_t *image;     /* [slot] P, 4 bits per direction, and RVE_IMAGE flags */
  double *shear[3];    /* [slot] tangential spring force on the owner, N; 2D: [0], along (-n_y, n_x) */
  double *branch[3];   /* [slot] x_j - x_i, m, if rve_carries(); of rows that did not rest in the last contact pass. Mixed precision: as
                          sums of two FP32 numbers, of each row all first and then all second ones */
  double *reaction;    /* [slot + lanes] force and torque on the neighbour, at rve_reaction_at() of the slot: a plane of four
                          numbers each (2D f t, 3D f t_x), in 3D one of two (t_y t_z), or both together (RVE_WHOLE); the
                          last slots stay zero */
  double *reaction_more;                /* its second plane, if there is one */
  double *reaction_field[6];            /* the same as arrays, if counts.reaction = 0 */
  uint32_t *incoming;                   /* [incoming] slot (its place in doubles, if counts.reaction > 0) */
  int32_t *slot_first, *incoming_first; /* [blocks + 1] rows */
  int32_t *incoming_far; /* [blocks] first row that names far pairs only */
  double *idle_until;    /* [row of slots, one more] m: no contact, forces, histories are 0 while approach is below */
  double *incoming_idle; /* [row of incoming] the same for all its slots; may lag behind */
} RveArrays;

/* What all steps of one call share. Deformation is given per DEM step: gradient * dt may differ from L * duration /
 * steps. */
typedef struct RveCall {
  int64_t steps;
  double dt;
  double gradient[9], rate[9]; /* L of the DEM step and its symmetric part, 1/s */
  double step_map[9];          /* exp(L dt) - 1 */
  double turn[9];              /* exp(W dt): rotates the 3D tangential history */
  double shorten;              /* exp(|D| dt) */
  int32_t moving, turning;     /* L != 0; W != 0 in 3D */
  double temperature;          /* at the end */
  /* material */
  double normal_stiffness, tangential_stiffness, friction;
  double normal_viscosity, tangential_viscosity, critical_viscosity; /* per m_eff; per sqrt(m_eff) */
  double local_damping;
  int32_t thermal, rotation, flight, resting;
  double expansion, reference_temperature, pipe_resistance;
  double bond_strength, bond_shear_ratio, bond_melting_temperature;
  double skin_fraction; /* of the largest radius; 0: found from the time that lists last */
  double thickness;     /* 1 in 3D */
} RveCall;

/* Which parts of the kernel a scene needs; constants in the stamped-out variants. */
typedef struct RveFeatures {
  int dimension, tangential, viscous, bonds;
} RveFeatures;

/* Working memory of a list's construction, for n grains and `pairs` candidate pairs. */
typedef struct RveScratch {
  int32_t pairs;
  int32_t *first, *second, *history; /* [pairs] grains, index of saved history or -1 */
  uint16_t *image;                   /* [pairs] */
  int32_t *old_second, *old_next;    /* [pairs] saved contacts, chained by first grain */
  uint16_t *old_image;
  double *old_shear[3];
  int32_t *chain, *order, *bucket, *rank, *place; /* [N + 2] */
  int32_t *out, *in, *out_far, *in_far;           /* [N + 2] pairs of a grain, near and far */
  int32_t *out_rows, *in_rows;                    /* [N + 2] a block's rows of near pairs */
  double *sorted[4]; /* [2 N + 64] fractional coordinates and radius, sorted along the first */
  double *swap;      /* [N] */
  /* The arena that this thread works on next, which it fetches into its cache a few lines at a time; NULL: none */
  const char *ahead;
  size_t ahead_bytes;
  int32_t ahead_lines; /* for each block of grains */
} RveScratch;

RVE_ANY void *rve_carve(void *base, size_t *used, size_t bytes) {
  void *at = base ? (void *)((char *)base + *used) : (void *)0;
  *used += (bytes + 63) / 64 * 64;
  return at;
}

/* 1 if kernels of these counts carry branches along: vector instructions of CPUs. (Rows were longer before they did.) */
RVE_ANY int rve_carries(const RveCounts *n) { return n->row > 0 && n->row == (n->reaction < 4 ? 2 : 4) * (n->dimension - 1); }

/* Doubles of a slot in the first plane of reactions; half as many in the second, if there is one. */
RVE_ANY int rve_reaction_width(const RveCounts *n) {
  return n->dimension == 2 || n->reaction == RVE_WHOLE ? n->reaction : n->reaction / 3 * 2;
}
/* A slot's place there, in doubles; the slot itself if reactions are arrays. */
RVE_ANY int rve_reaction_at(const RveCounts *n, int slot) {
  if (n->reaction == 0) return slot;
  return (n->reaction == RVE_WHOLE ? slot : rve_place(n->lanes, slot)) * rve_reaction_width(n);
}

/* Lays the arrays behind the head at `base` (NULL: only counts); returns the arena's bytes. */
RVE_ANY size_t rve_layout(const RveCounts *n, void *base, RveArrays *a) {
  const size_t grains = (size_t)n->blocks * (size_t)n->lanes, spins = n->dimension == 2 ? 1 : 3;
  const size_t slots = (size_t)n->slot_rows * (size_t)n->lanes, pad = (size_t)n->lanes;
  size_t used = (sizeof(RveHead) + 63) / 64 * 64;
  double **const per_grain[] = {&a->radius, &a->reference_radius, &a->mass, &a->inverse_mass, &a->inverse_inertia};
  for (int k = 0; k < 3; k++) {
    const int in_plane = k < n->dimension, has_spin = (size_t)k < spins;
    a->position[k] = (int64_t *)rve_carve(base, &used, in_plane ? grains * 8 : 0);
    a->position_at_list[k] = (int64_t *)rve_carve(base, &used, in_plane ? grains * 8 : 0);
    a->velocity[k] = (double *)rve_carve(base, &used, in_plane ? grains * 8 : 0);
    a->force[k] = (double *)rve_carve(base, &used, in_plane ? grains * 8 : 0);
    a->spin[k] = (double *)rve_carve(base, &used, has_spin ? grains * 8 : 0);
    a->torque[k] = (double *)rve_carve(base, &used, has_spin ? grains * 8 : 0);
    a->shear[k] = (double *)rve_carve(base, &used, has_spin ? slots * 8 : 0);
    a->branch[k] = (double *)rve_carve(base, &used, in_plane && rve_carries(n) ? slots * 8 : 0);
  }
  for (int k = 0; k < 5; k++) *per_grain[k] = (double *)rve_carve(base, &used, grains * 8);
  a->id = (int32_t *)rve_carve(base, &used, grains * 4);
  a->row = (double *)rve_carve(base, &used, grains * (size_t)n->row * 8);
  a->neighbour = (uint32_t *)rve_carve(base, &used, slots * 4);
  a->image = (uint16_t *)rve_carve(base, &used, slots * 2);
  a->reaction = (double *)rve_carve(base, &used, (slots + pad) * (size_t)n->reaction * 8);
  a->reaction_more = a->reaction ? a->reaction + (slots + pad) * (size_t)rve_reaction_width(n) : (double *)0;
  for (int k = 0; k < 6; k++) {
    const int present = n->reaction == 0 && k < (n->dimension == 2 ? 3 : 6);
    a->reaction_field[k] = (double *)rve_carve(base, &used, present ? (slots + pad) * 8 : 0);
    if (!present) a->reaction_field[k] = (double *)0;
  }
  a->incoming = (uint32_t *)rve_carve(base, &used, (size_t)n->incoming_rows * (size_t)n->lanes * 4);
  a->slot_first = (int32_t *)rve_carve(base, &used, ((size_t)n->blocks + 1) * 4);
  a->incoming_first = (int32_t *)rve_carve(base, &used, ((size_t)n->blocks + 1) * 4);
  a->incoming_far = (int32_t *)rve_carve(base, &used, (size_t)n->blocks * 4);
  a->idle_until = (double *)rve_carve(base, &used, ((size_t)n->slot_rows + 1) * 8);
  a->incoming_idle = (double *)rve_carve(base, &used, (size_t)n->incoming_rows * 8);
  return used;
}

RVE_ANY size_t rve_scratch_layout(const RveCounts *n, int32_t pairs, void *base, RveScratch *s) {
  const size_t grains = (size_t)n->blocks * (size_t)n->lanes, p = (size_t)pairs;
  int32_t **const per_pair[] = {&s->first, &s->second, &s->history, &s->old_second, &s->old_next};
  int32_t **const per_grain[] = {&s->chain, &s->order,   &s->bucket, &s->rank,     &s->place,  &s->out,
                                 &s->in,    &s->out_far, &s->in_far, &s->out_rows, &s->in_rows};
  size_t used = 0;
  s->pairs = pairs;
  for (int k = 0; k < 5; k++) *per_pair[k] = (int32_t *)rve_carve(base, &used, p * 4);
  s->image = (uint16_t *)rve_carve(base, &used, p * 2);
  s->old_image = (uint16_t *)rve_carve(base, &used, p * 2);
  for (int k = 0; k < 3; k++) s->old_shear[k] = (double *)rve_carve(base, &used, p * 8);
  for (int k = 0; k < 11; k++) *per_grain[k] = (int32_t *)rve_carve(base, &used, (grains + 2) * 4);
  for (int k = 0; k < 4; k++) s->sorted[k] = (double *)rve_carve(base, &used, (2 * grains + 64) * 8);
  s->swap = (double *)rve_carve(base, &used, grains * 8);
  s->ahead = NULL, s->ahead_bytes = 0, s->ahead_lines = 0;
  return used;
}

RVE_ANY uint16_t rve_image_pack(const int p[3]) {
  return (uint16_t)((p[0] & 15) | (p[1] & 15) << 4 | (p[2] & 15) << 8);
}
RVE_ANY void rve_image_unpack(uint16_t image, int p[3]) {
  for (int k = 0; k < 3; k++) p[k] = ((image >> 4 * k & 15) ^ 8) - 8;
}
RVE_ANY int rve_image_fits(const int p[3]) {
  for (int k = 0; k < 3; k++)
    if (p[k] < -RVE_IMAGE_MAX || p[k] > RVE_IMAGE_MAX) return 0;
  return 1;
}
RVE_ANY RveHead *rve_head(void *arena) { return (RveHead *)arena; }

#endif
