/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Grains as their neighbours see them, branches, and the reactions that contacts leave for the other grain: how they are
 * stored, read and summed. Two forms: FP64, and FP32 for mixed precision (rve_near.h). CPUs keep what neighbours want of a
 * grain in one row: 2D v w r, 3D v r | w m. Positions are seldom wanted, and masses in 2D: these come from the arrays. */
#ifndef DEMPM_RVE_BODY_H
#define DEMPM_RVE_BODY_H

#include "rve_near.h"

/* A pack of grains. */
typedef struct RveBody {
  int lane0; /* of grains that stand side by side: the first */
  rve_int s[3];
  rve_real v[3], w[3], r, m;
} RveBody;

/* What a contact does to the neighbour, and to its owner, whose force is -push. */
typedef struct RvePair {
  rve_near push[3], torque[3], other_torque[3];
} RvePair;

RVE_FN int rve_spins(RveFeatures ft) { return ft.dimension == 2 ? 1 : 3; }

RVE_FN rve_real rve_dot(int dim, const rve_real a[3], const rve_real b[3]) {
  rve_real c = a[0] * b[0] + a[1] * b[1];
  if (dim == 3) c = c + a[2] * b[2];
  return c;
}

RVE_FN RveBody rve_own_body(RveFeatures ft, const RveArrays *a, int lane0) {
  RveBody own;
  own.lane0 = lane0;
  for (int k = 0; k < ft.dimension; k++) {
    own.s[k] = rve_load_int(a->position[k], lane0);
    own.v[k] = rve_load(a->velocity[k], lane0);
  }
  if (ft.tangential)
    for (int k = 0; k < rve_spins(ft); k++) own.w[k] = rve_load(a->spin[k], lane0);
  own.r = rve_load(a->radius, lane0);
  if (ft.viscous) own.m = rve_load(a->mass, lane0);
  return own;
}

/* Fractional branch s_j - s_i + P along cell edge k, in units. */
RVE_FN rve_int rve_fraction(rve_int si, rve_int sj, rve_int image, int k) {
  const rve_int top = rve_set_int((int64_t)((uint64_t)15 << 60));
  const rve_int shift =
      k == 0 ? rve_int_shift_left(image, 60)
             : rve_int_and(k == 1 ? rve_int_shift_left(image, 56) : rve_int_shift_left(image, 52), top);
  return rve_int_add(rve_int_subtract(sj, si), shift);
}

/* x_j - x_i; h: H times the unit. */
RVE_FN void rve_branch(int dim, const rve_real h[9], const rve_int si[3], const rve_int sj[3], rve_int image, rve_real d[3]) {
  rve_real x[3];
  for (int k = 0; k < dim; k++) x[k] = rve_real_from_int(rve_fraction(si[k], sj[k], image, k));
  for (int k = 0; k < dim; k++) {
    d[k] = h[3 * k] * x[0] + h[3 * k + 1] * x[1];
    if (dim == 3) d[k] = d[k] + h[3 * k + 2] * x[2];
  }
}

/* How branches follow the flow from one step to the next: d <- exp(L dt) (d + u dt). With s += H^-1 v dt and H <- exp(L dt) H that is what
 * positions give but for round-off, without reading these or looking up images. */
typedef struct RveCarry {
  rve_near map[9], dt; /* exp(L dt) - 1; s */
  int fresh;           /* 1: in this pass positions give all branches */
} RveCarry;

/* 1 if positions have to give a row's branches, which from now on are carried. A row in which nothing touched the step before has none,
 * it may have rested since. */
RVE_FN int rve_branch_is_due(const RveCarry *carry, const RveArrays *a, int lane0) {
  double *const idle = &a->idle_until[lane0 / RVE_PACK];
  int64_t rested; /* compared as an integer: it is 0 or not */
  memcpy(&rested, idle, sizeof rested);
  if (__builtin_expect(!(carry->fresh || rested), 1)) return 0;
  *idle = 0.0;
  return 1;
}

/* Where the neighbours are. */
RVE_FN void rve_neighbour_position(int dim, const RveArrays *a, int lane0, RveBody *other) {
  for (int k = 0; k < dim; k++)
    other->s[k] =
        rve_int_from_bits(rve_pick((const double *)(const void *)a->position[k], a->neighbour, lane0, rve_row_doubles(dim)));
}

/* All of the neighbours, in FP64. */
RVE_FN RveBody rve_neighbour_body(RveFeatures ft, const RveArrays *a, int lane0) {
  const int row = rve_row_doubles(ft.dimension);
  RveBody other;
  rve_neighbour_position(ft.dimension, a, lane0, &other);
  for (int k = 0; k < ft.dimension; k++) other.v[k] = rve_pick(a->velocity[k], a->neighbour, lane0, row);
  for (int k = 0; ft.tangential && k < rve_spins(ft); k++) other.w[k] = rve_pick(a->spin[k], a->neighbour, lane0, row);
  other.r = rve_pick(a->radius, a->neighbour, lane0, row);
  if (ft.viscous) other.m = rve_pick(a->mass, a->neighbour, lane0, row);
  return other;
}

/* Branches from positions. The owners' are read again: kept for this seldom use, they would take room from what each row wants (4 % in
 * 2D). */
RVE_FN void rve_branch_of_positions(int dim, const rve_real h[9], const RveArrays *a, int own0, int lane0, rve_int image,
                                    rve_real d[3]) {
  RveBody i, j;
  for (int k = 0; k < dim; k++) i.s[k] = rve_load_int(a->position[k], own0);
  rve_neighbour_position(dim, a, lane0, &j);
  rve_branch(dim, h, i.s, j.s, image, d);
}

/* ----------------------------------------------------------------------------------- grains as contacts want them */

#ifdef RVE_MIXED
typedef struct RveNearBody {
  int lane0;
  rve_near v[3], w[3], r, m;
} RveNearBody;

RVE_FN rve_near near_dot(int dim, const rve_near a[3], const rve_near b[3]) {
  rve_near c = a[0] * b[0] + a[1] * b[1];
  if (dim == 3) c = c + a[2] * b[2];
  return c;
}
#else
typedef RveBody RveNearBody;
#define near_dot rve_dot
#endif

#if !RVE_CARRIES /* CUDA and plain code: arrays are read, positions give all branches */
#define near_own_body rve_own_body
/* Places and radii of neighbours; then the rest. */
RVE_FN void near_neighbour_place(RveFeatures ft, const RveArrays *a, int lane0, RveBody *other) {
  rve_neighbour_position(ft.dimension, a, lane0, other);
  other->r = rve_pick(a->radius, a->neighbour, lane0, 0);
}
RVE_FN void near_neighbour_motion(RveFeatures ft, const RveArrays *a, int lane0, RveBody *other) {
  for (int k = 0; k < ft.dimension; k++) other->v[k] = rve_pick(a->velocity[k], a->neighbour, lane0, 0);
  for (int k = 0; ft.tangential && k < rve_spins(ft); k++) other->w[k] = rve_pick(a->spin[k], a->neighbour, lane0, 0);
  if (ft.viscous) other->m = rve_pick(a->mass, a->neighbour, lane0, 0);
}
RVE_FN void near_keep_place(RveFeatures ft, const RveBody *other, RveBody *kept) {
  (void)ft;
  kept->r = other->r;
}
RVE_FN void rve_write_rows(int dimension, const RveArrays *a, int lane0, const RveBody *b) {
  (void)dimension, (void)a, (void)lane0, (void)b; /* arrays are read */
}

RVE_FN void near_find_branch(RveFeatures ft, const RveCarry *carry, const rve_real h[9], const RveArrays *a, const RveBody *own,
                             const RveBody *other, int lane0, rve_real u[3], rve_real d[3]) {
  (void)carry, (void)u;
  rve_branch(ft.dimension, h, own->s, other->s, rve_load_short(a->image, lane0), d);
}

#else
RVE_FN RveNearBody near_own_body(RveFeatures ft, const RveArrays *a, int lane0) {
  RveNearBody own;
  own.lane0 = lane0;
  for (int k = 0; k < ft.dimension; k++) own.v[k] = near_load(a->velocity[k], lane0);
  for (int k = 0; ft.tangential && k < rve_spins(ft); k++) own.w[k] = near_load(a->spin[k], lane0);
  own.r = near_load(a->radius, lane0);
  if (ft.viscous) own.m = near_load(a->mass, lane0);
  return own;
}

/* Velocities and radii of neighbours (2D: and all else); then the rest. */
RVE_FN void near_neighbour_place(RveFeatures ft, const RveArrays *a, int lane0, RveNearBody *other) {
  const NearQuad q = near_gather(a->row, a->neighbour, lane0);
  for (int k = 0; k < ft.dimension; k++) other->v[k] = q.f[k];
  if (ft.dimension == 2) other->w[0] = q.f[2];
  other->r = q.f[3];
  if (ft.dimension == 2 && ft.viscous) other->m = near_pick(a->mass, a->neighbour, lane0, rve_row_doubles(2));
}
RVE_FN void near_neighbour_motion(RveFeatures ft, const RveArrays *a, int lane0, RveNearBody *other) {
  if (ft.dimension == 2) return;
  const NearQuad q = near_gather(a->row + rve_row_doubles(3) / 2, a->neighbour, lane0);
  for (int k = 0; k < 3; k++) other->w[k] = q.f[k];
  other->m = q.f[3];
}

/* Of what near_neighbour_place has read, what is still needed once the branch is known. */
RVE_FN void near_keep_place(RveFeatures ft, const RveNearBody *other, RveNearBody *kept) {
  kept->r = other->r;
  if (ft.dimension == 3) return;
  kept->w[0] = other->w[0];
  if (ft.viscous) kept->m = other->m;
}

/* Writes the rows of the span at lane0. */
RVE_FN void rve_write_rows(int dimension, const RveArrays *a, int lane0, const RveBody *b) {
  const int stride = rve_row_doubles(dimension);
  double *const row = a->row + (size_t)lane0 * (size_t)stride;
  if (dimension == 2) {
    const RveQuad q = {{b->v[0], b->v[1], b->w[0], b->r}};
    near_scatter(row, stride, q);
    return;
  }
  const RveQuad q = {{b->v[0], b->v[1], b->v[2], b->r}}, p = {{b->w[0], b->w[1], b->w[2], b->m}};
  near_scatter(row, stride, q);
  near_scatter(row + stride / 2, stride, p);
}
#endif

#ifndef RVE_MIXED
/* ------------------------------------------------------------------------------------------------------------- FP64 */

#if RVE_CARRIES
/* Branches d, and the relative velocities u of the fluctuations. */
RVE_FN void near_find_branch(RveFeatures ft, const RveCarry *carry, const rve_real h[9], const RveArrays *a, const RveBody *own,
                             const RveBody *other, int lane0, rve_real u[3], rve_real d[3]) {
  const int dim = ft.dimension;
  for (int k = 0; k < dim; k++) u[k] = other->v[k] - own->v[k];
  if (rve_branch_is_due(carry, a, lane0)) {
    rve_branch_of_positions(dim, h, a, own->lane0, lane0, rve_load_short(a->image, lane0), d);
  } else {
    rve_real e[3];
    for (int k = 0; k < dim; k++) e[k] = rve_load(a->branch[k], lane0) + carry->dt * u[k];
    for (int k = 0; k < dim; k++) {
      d[k] = rve_fma(carry->map[3 * k], e[0], rve_fma(carry->map[3 * k + 1], e[1], e[k]));
      if (dim == 3) d[k] = rve_fma(carry->map[3 * k + 2], e[2], d[k]);
    }
  }
  for (int k = 0; k < dim; k++) rve_store(a->branch[k], lane0, d[k]);
}
#endif

#if defined(RVE_WHOLE_REACTIONS)
/* 3D reactions are whole, so that one addition takes all of one: f t_x | t_y t_z, and two numbers that nobody reads. */
RVE_FN void rve_write_reaction_3d(RveFeatures ft, const RveArrays *a, int lane0, const RvePair *p) {
  double *const none[4] = {0, 0, 0, 0};
  const RveQuad q = {{p->push[0], p->push[1], p->push[2], ft.tangential ? p->other_torque[0] : rve_set(0.0)}};
  rve_scatter(a->reaction, RVE_WHOLE, none, lane0, q);
  if (ft.tangential) rve_scatter_two(a->reaction + 4, RVE_WHOLE, lane0, p->other_torque[1], p->other_torque[2]);
}
RVE_FN RveQuad rve_read_reaction_3d(const RveArrays *a, int lane0) {
  RveFour row[RVE_SPAN];
  for (int l = 0; l < RVE_SPAN; l++) row[l] = rve_four(a->reaction + (size_t)(lane0 + l) * RVE_WHOLE);
  return rve_transpose(row);
}

#else
RVE_FN void rve_write_reaction_3d(RveFeatures ft, const RveArrays *a, int lane0, const RvePair *p) {
  double *const *const field = a->reaction_field;
  double *const f[4] = {field[0], field[1], field[2], ft.tangential ? field[3] : 0};
  const RveQuad q = {{p->push[0], p->push[1], p->push[2], ft.tangential ? p->other_torque[0] : rve_set(0.0)}};
  rve_scatter_placed(a->reaction, f, lane0, q);
  if (ft.tangential) rve_scatter_pairs(a->reaction_more, field + 4, lane0, p->other_torque[1], p->other_torque[2]);
}
RVE_FN RveQuad rve_read_reaction_3d(const RveArrays *a, int lane0) {
  const double *const field[4] = {a->reaction_field[0], a->reaction_field[1], a->reaction_field[2], 0};
  return rve_read_placed(a->reaction, field, lane0);
}

#endif

RVE_FN void near_write_reaction(RveFeatures ft, const RveArrays *a, int lane0, const RvePair *p) {
  if (ft.dimension == 3) {
    rve_write_reaction_3d(ft, a, lane0, p);
    return;
  }
  const rve_real zero = rve_set(0.0);
  double *const f[4] = {a->reaction_field[0], a->reaction_field[1], ft.tangential ? a->reaction_field[2] : 0, 0};
  const RveQuad q = {{p->push[0], p->push[1], ft.tangential ? p->other_torque[0] : zero, zero}};
  rve_scatter_placed(a->reaction, f, lane0, q);
}

/* Force on the neighbours of the slots at lane0. */
RVE_FN void rve_read_reaction(int dim, const RveArrays *a, int lane0, rve_real force[3]) {
  const double *const field[4] = {a->reaction_field[0], a->reaction_field[1], 0, 0};
  const RveQuad q = dim == 3 ? rve_read_reaction_3d(a, lane0) : rve_read_placed(a->reaction, field, lane0);
  for (int k = 0; k < dim; k++) force[k] = q.f[k];
}

#else
/* ------------------------------------------------------------------------------------------------------------- FP32 */

/* Branches and relative velocities. A branch is the sum of two FP32 numbers: what it changes by in a step may be less than the last digit
 * of the first, which alone enters the contact. */
RVE_FN void near_find_branch(RveFeatures ft, const RveCarry *carry, const rve_real h[9], const RveArrays *a,
                             const RveNearBody *own, const RveNearBody *other, int lane0, rve_near u[3], rve_near d[3]) {
  const int dim = ft.dimension;
  rve_near rest[3];
  for (int k = 0; k < dim; k++) u[k] = other->v[k] - own->v[k];
  if (rve_branch_is_due(carry, a, lane0)) {
    const near_image image = near_load_image(a->image, lane0);
    rve_real low[3], high[3];
    rve_branch_of_positions(dim, h, a, own->lane0, lane0, near_image_half(image, 0), low);
    rve_branch_of_positions(dim, h, a, own->lane0 + RVE_SPAN, lane0 + RVE_SPAN, near_image_half(image, 1), high);
    for (int k = 0; k < dim; k++) near_split(low[k], high[k], &d[k], &rest[k]);
  } else {
    rve_near old[3], e[3];
    for (int k = 0; k < dim; k++) {
      near_load_sum(a->branch[k], lane0, &old[k], &rest[k]);
      e[k] = near_fma(carry->dt, u[k], old[k]);
    }
    for (int k = 0; k < dim; k++) {
      rest[k] = near_fma(carry->map[3 * k], e[0], near_fma(carry->map[3 * k + 1], e[1], near_fma(carry->dt, u[k], rest[k])));
      if (dim == 3) rest[k] = near_fma(carry->map[3 * k + 2], e[2], rest[k]);
      d[k] = old[k] + rest[k];
      rest[k] = rest[k] - (d[k] - old[k]);
    }
  }
  for (int k = 0; k < dim; k++) near_store_sum(a->branch[k], lane0, d[k], rest[k]);
}

RVE_FN void near_write_reaction(RveFeatures ft, const RveArrays *a, int lane0, const RvePair *p) {
  const rve_near zero = near_set(0.0);
  if (ft.dimension == 2) {
    const rve_near q[4] = {p->push[0], p->push[1], ft.tangential ? p->other_torque[0] : zero, zero};
    near_scatter_placed(a->reaction, lane0, q);
    return;
  }
  const rve_near q[4] = {p->push[0], p->push[1], p->push[2], ft.tangential ? p->other_torque[0] : zero};
  near_scatter_placed(a->reaction, lane0, q);
  if (!ft.tangential) return;
  near_scatter_pairs(a->reaction_more, lane0, p->other_torque[1], p->other_torque[2]);
}

RVE_FN void rve_read_reaction(int dim, const RveArrays *a, int lane0, rve_real force[3]) {
  NearFour row[RVE_SPAN];
  for (int l = 0; l < RVE_SPAN; l++) row[l] = near_four(a->reaction + (size_t)rve_place(RVE_PACK, lane0 + l) * 2);
  const RveQuad q = near_transpose(row);
  for (int k = 0; k < dim; k++) force[k] = q.f[k];
}

#endif

/* ----------------------------------------------------------------------------------------------------- both forms */

/* 1 if all slots that a row of the incoming list names rest; then their reactions are 0. Asked in every fourth step: a row that does
 * not rest yet can be added, too. */
RVE_FN int rve_incoming_rests(const RveHead *head, const RveArrays *a, int row) {
  if (head->approach < a->incoming_idle[row]) return 1;
  if (head->steps % 4 != 0) return 0;
  rve_real until = rve_pick_idle(a->idle_until, a->incoming, row * RVE_PACK);
  if (RVE_PARTS == 2) until = rve_min(until, rve_pick_idle(a->idle_until, a->incoming, row * RVE_PACK + RVE_SPAN));
  return head->approach < (a->incoming_idle[row] = 0.0 - rve_largest(0.0 - until));
}

/* What the slots of one row of the incoming list did to a span of grains. CPUs keep it as it is stored, of each lane a reaction's first
 * plane, its second, or the whole of it; a sum is transposed once. */
typedef struct RveIncoming {
#if defined(__CUDACC__)
  rve_real force[3], torque[3];
#else
  NearFour four[RVE_SPAN];
  NearTwo two[RVE_SPAN];
#endif
#if defined(RVE_WHOLE_REACTIONS)
  rve_real whole[RVE_SPAN];
#endif
} RveIncoming;

#if defined(__CUDACC__)
RVE_FN void rve_read_incoming(RveFeatures ft, const RveArrays *a, const uint32_t *at, RveIncoming *in) {
  for (int k = 0; k < ft.dimension; k++) in->force[k] = a->reaction_field[k][at[RVE_LANE]];
  for (int k = 0; ft.tangential && k < rve_spins(ft); k++) in->torque[k] = a->reaction_field[ft.dimension + k][at[RVE_LANE]];
}
RVE_FN void rve_add_incoming(RveFeatures ft, const RveIncoming *in, RveIncoming *sum) {
  for (int k = 0; k < ft.dimension; k++) sum->force[k] += in->force[k];
  for (int k = 0; ft.tangential && k < rve_spins(ft); k++) sum->torque[k] += in->torque[k];
}
RVE_FN void rve_split_incoming(RveFeatures ft, const RveIncoming *sum, rve_real force[3], rve_real torque[3]) {
  for (int k = 0; k < ft.dimension; k++) force[k] = sum->force[k];
  for (int k = 0; ft.tangential && k < rve_spins(ft); k++) torque[k] = sum->torque[k];
}
#else

enum { RVE_FOUR = 1, RVE_TWO = 2, RVE_ALL = 4 }; /* parts of RveIncoming */

RVE_FN int rve_incoming_parts(RveFeatures ft) {
  if (ft.dimension == 2 || !ft.tangential) return RVE_FOUR;
#if defined(RVE_WHOLE_REACTIONS)
  return RVE_ALL;
#else
  return RVE_FOUR | RVE_TWO;
#endif
}
RVE_FN void rve_read_incoming(RveFeatures ft, const RveArrays *a, const uint32_t *at, RveIncoming *in) {
  const int parts = rve_incoming_parts(ft);
  for (int l = 0; l < RVE_SPAN; l++) {
    if (parts & RVE_FOUR) in->four[l] = near_four(a->reaction + at[l]);
    if (parts & RVE_TWO) in->two[l] = near_two(a->reaction_more + at[l] / 2);
#if defined(RVE_WHOLE_REACTIONS)
    if (parts & RVE_ALL) in->whole[l] = rve_load(a->reaction + at[l], 0);
#endif
  }
}
RVE_FN void rve_add_incoming(RveFeatures ft, const RveIncoming *in, RveIncoming *sum) {
  const int parts = rve_incoming_parts(ft);
  for (int l = 0; l < RVE_SPAN; l++) {
    if (parts & RVE_FOUR) sum->four[l] = near_four_add(sum->four[l], in->four[l]);
    if (parts & RVE_TWO) sum->two[l] = near_two_add(sum->two[l], in->two[l]);
#if defined(RVE_WHOLE_REACTIONS)
    if (parts & RVE_ALL) sum->whole[l] = sum->whole[l] + in->whole[l];
#endif
  }
}
RVE_FN void rve_split_incoming(RveFeatures ft, const RveIncoming *sum, rve_real force[3], rve_real torque[3]) {
  const int parts = rve_incoming_parts(ft);
#if defined(RVE_WHOLE_REACTIONS)
  if (parts & RVE_ALL) {
    rve_real field[6];
    rve_transpose_six(sum->whole, field);
    for (int k = 0; k < 3; k++) force[k] = field[k], torque[k] = field[3 + k];
    return;
  }
#endif
  const RveQuad q = near_transpose(sum->four);
  for (int k = 0; k < ft.dimension; k++) force[k] = q.f[k];
  torque[0] = q.f[ft.dimension];
  if (parts & RVE_TWO) near_unpair(sum->two, torque + 1);
}
#endif

/* Force and torque that a span of grains gets from the slots of others, summed in the order of the incoming list. The first row is
 * taken as it is, whether it rests or not: each block has one, and what rests is 0. */
RVE_FN void rve_sum_reactions(RveFeatures ft, const RveHead *head, const RveArrays *a, int lane0,
                              rve_real force[3], rve_real torque[3]) {
  const int block = lane0 / RVE_PACK, first = a->incoming_first[block];
  const uint32_t *const at = a->incoming + lane0 % RVE_PACK;
  RveIncoming sum;
  rve_read_incoming(ft, a, at + first * RVE_PACK, &sum);
  for (int row = first + 1; row < a->incoming_first[block + 1]; row++) {
    RveIncoming more;
    if (ft.dimension == 3 && row >= a->incoming_far[block] && rve_incoming_rests(head, a, row)) continue;
    rve_read_incoming(ft, a, at + row * RVE_PACK, &more);
    rve_add_incoming(ft, &more, &sum);
  }
  rve_split_incoming(ft, &sum, force, torque);
}

#endif
