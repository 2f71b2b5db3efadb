/* SPDX-License-Identifier: GPL-2.0-or-later */
/* One DEM step of one RVE: move pass (sum of reactions, kick, drift) - cell - contact pass. Written once for all
 * backends and both dimensions; see rve_team.h for the lanes.
 *
 * Leapfrog. v lives half a step behind s: v += dt (f/m - L v), s += H^-1 v dt, H <- exp(L dt) H, then contacts at the
 * new places. v is the fluctuation about the affine flow, hence the term L v. Spins are relative to the flow's
 * vorticity W, so that the velocity of a contact contains D = sym L only, and a rigid rotation strains nothing. */
#ifndef DEMPM_RVE_KERNEL_H
#define DEMPM_RVE_KERNEL_H

#include "rve_body.h"

/* --------------------------------------------------------------------------------------------------- contact pass */

typedef struct RveContactPass {
  rve_real h[9];             /* H times RVE_UNIT */
  rve_near rate[9]; /* D; without dashpots less D_xx on the diagonal: sliding does not see what is along the branch */
  rve_near turn[9];
  rve_near kn, kt_dt, kt, mu, mu_kn, dt, gn, gt, gc, bond, bond_ratio;
  RveCarry carry;
  int turning;
} RveContactPass;

RVE_FN double rve_bond_force_factor(const RveCall *call, double temperature) {
  /* TM-DEMPM eq. 40, corrected for reference temperatures other than 0. */
  double left = 1.0;
  const double melting = call->bond_melting_temperature;
  if (call->thermal && melting < 1e300) left = (melting - temperature) / (melting - call->reference_temperature);
  left = left < 0.0 ? 0.0 : left > 1.0 ? 1.0 : left;
  return call->bond_strength * left * call->normal_stiffness;
}

RVE_FN RveContactPass rve_contact_pass_of(RveFeatures ft, const RveCall *call, const RveHead *head, double dt) {
  RveContactPass c;
  for (int k = 0; k < 9; k++) {
    c.h[k] = rve_set(head->cell[k] * RVE_UNIT);
    c.rate[k] = near_set(call->rate[k] - (!ft.viscous && k % 4 == 0 ? call->rate[0] : 0.0));
    c.turn[k] = near_set(call->turn[k]);
  }
  c.turning = call->turning;
  for (int k = 0; k < 9; k++) c.carry.map[k] = near_set(call->step_map[k]);
  c.carry.dt = near_set(dt);
  c.carry.fresh = !head->carried || dt == 0.0 || head->steps % RVE_FRESH == 0;
  c.kn = near_set(call->normal_stiffness);
  c.kt = near_set(call->tangential_stiffness);
  c.kt_dt = near_set(call->tangential_stiffness * dt);
  c.mu = near_set(call->friction);
  c.mu_kn = near_set(call->friction * call->normal_stiffness);
  c.dt = near_set(dt);
  c.gn = near_set(call->normal_viscosity);
  c.gt = near_set(call->tangential_viscosity);
  c.gc = near_set(call->critical_viscosity);
  c.bond = near_set(rve_bond_force_factor(call, head->temperature));
  c.bond_ratio = near_set(call->bond_shear_ratio);
  return c;
}

/* Coulomb's cap, mu |fn|. Springs alone only push: straight from the overlap, so that nobody waits for fn to be masked (any
 * number where nothing touches). */
RVE_FN rve_near rve_cap(RveFeatures ft, const RveContactPass *c, rve_near fn, rve_near overlap) {
  if (ft.viscous || ft.bonds) return c->mu * near_abs(fn);
  return c->mu_kn * overlap;
}

/* Tangential part: history, Coulomb's cap (or the bond), dashpot. stick: lanes that an intact bond exempts from the
 * cap. Follows LIGGGHTS' `tangential history`: the dashpot acts on contacts that do not slide and is outside the cap.
 */
RVE_FN void rve_tangential_2d(RveFeatures ft, near_mask touch, near_mask bonded, rve_near trial,
                              rve_near vt, rve_near cap, rve_near gt, rve_near *spring, rve_near *total, rve_near *slip,
                              rve_near *loss) {
  rve_near f = near_limit(trial, cap);
  if (ft.bonds) f = near_select(bonded, trial, f);
  f = near_keep(touch, f);
  *slip = *slip + (trial - f) * f; /* times 1/kt: |f| times the slip distance; same sign, so no modulus */
  *spring = *total = f;
  if (ft.viscous) {
    const near_mask stuck = near_and_not(touch, near_or(near_less(f, trial), near_less(trial, f)));
    const rve_near dash = near_keep(stuck, gt * vt);
    *total = f + dash;
    *loss = *loss + dash * vt;
  }
}

RVE_FN void rve_tangential_3d(RveFeatures ft, near_mask touch, near_mask bonded, const rve_near trial[3],
                              rve_near size2, const rve_near vt[3], rve_near cap, rve_near gt,
                              rve_near spring[3], rve_near total[3], rve_near *slip, rve_near *loss) {
  const rve_near one = near_set(1.0);
  rve_near factor = near_min(cap * near_inverse_sqrt(size2), one); /* 1 also where the root of 0 gives no number */
  if (ft.bonds) factor = near_select(bonded, one, factor);
  factor = near_keep(touch, factor);
  *slip = *slip + (factor - factor * factor) * size2;
  for (int k = 0; k < 3; k++) spring[k] = total[k] = factor * trial[k];
  if (ft.viscous) {
    const near_mask stuck = near_and_not(touch, near_less(factor, one));
    for (int k = 0; k < 3; k++) {
      const rve_near dash = near_keep(stuck, gt * vt[k]);
      total[k] = total[k] + dash;
      *loss = *loss + dash * vt[k];
    }
  }
}

/* Lanes whose intact bond breaks now: tension above F_nb, or tangential force above mu_b F_nb (eq. 38-39, tension
 * positive). */
RVE_FN near_mask rve_breaking(const RveContactPass *c, near_mask bonded, rve_near overlap, rve_near radii,
                             rve_near trial2) {
  const rve_near strength = c->bond * near_set(0.5) * radii, shear = c->bond_ratio * strength;
  const near_mask pulled = near_less(strength, near_set(0.0) - c->kn * overlap);
  return near_and(bonded, near_or(pulled, near_less(shear * shear, trial2)));
}

/* What a row of slots hands from one part of its computation to the next. In 3D the parts are loops of their own: a
 * processor that looks a hundred instructions ahead then finds several rows to work on, and not one long chain. */
typedef struct RveRow {
  int lane0;
  near_image image;
  near_mask touch, bonded; /* touch: or bonded; with bonds only */
  rve_near u[3];           /* relative velocity, if RVE_CARRIES */
  RveNearBody other;
  rve_near d[2], inverse, n[3], overlap, opening, slide[3], trial[3]; /* d, the branch, and 1/|d|: 2D */
} RveRow;

/* First part: where the neighbours are, and whether any touches. */
RVE_FN int rve_meet(RveFeatures ft, const RveContactPass *c, const RveArrays *a, const RveNearBody *own,
                    const RveNearBody *other, int lane0, RveRow *row) {
  rve_near d[3];
  near_find_branch(ft, &c->carry, c->h, a, own, other, lane0, row->u, d);
  const rve_near square = near_dot(ft.dimension, d, d), inverse = near_inverse_sqrt(square);
  const rve_near overlap = own->r + other->r - square * inverse;
  near_mask touch = near_less(near_set(0.0), overlap);
  row->lane0 = lane0;
  if (ft.bonds) {
    const near_image image = row->image = near_load_image(a->image, lane0);
    row->bonded = near_image_any(image, RVE_IMAGE_BOND);
    row->touch = touch = near_or(touch, row->bonded);
  }
  near_keep_place(ft, other, &row->other);
  for (int k = 0; k < ft.dimension; k++) row->n[k] = d[k] * inverse;
  for (int k = 0; ft.dimension == 2 && k < 2; k++) row->d[k] = d[k];
  if (ft.dimension == 2) row->inverse = inverse;
  row->overlap = overlap;
  return near_any(touch);
}

/* Nothing touches in this row, and what it left is 0. The margin covers the rounding of FP32. */
RVE_FN void rve_rest(const RveHead *head, const RveArrays *a, const RveRow *row) {
  const double cap = head->radius_max * head->scale, gap = 0.0 - near_largest(row->overlap);
  a->idle_until[row->lane0 / RVE_PACK] = head->approach + (gap < cap ? gap : cap) - 1e-6 * cap;
}

RVE_FN void rve_clear(RveFeatures ft, const RveArrays *a, const RveRow *row) {
  RvePair none;
  for (int k = 0; k < 3; k++) none.push[k] = none.torque[k] = none.other_torque[k] = near_set(0.0);
  near_write_reaction(ft, a, row->lane0, &none);
  for (int k = 0; ft.tangential && k < rve_spins(ft); k++) near_store(a->shear[k], row->lane0, near_set(0.0));
}

/* n x u - (lever w_i + other_lever w_j), but with 1/|d| and the overlap, which come late, in the last two operations: the levers
 * are R - overlap / 2. */
RVE_FN rve_near rve_slide_2d(const RveNearBody *own, const RveNearBody *other, const RveRow *row, const rve_near u[2]) {
  const rve_near half = near_set(0.5), across = row->d[0] * u[1] - row->d[1] * u[0];
  const rve_near rims = own->r * own->w[0] + row->other.r * other->w[0];
  const rve_near mean = near_fma(half, other->w[0], half * own->w[0]);
  return near_fma(row->overlap, mean, near_fms(across, row->inverse, rims));
}

/* Second part: relative motion, and the tangential force if nothing slid: history turned with the flow, plus the step's
 * relative motion, in the tangent plane. slide: of the surfaces, tangential (3D: only if a dashpot asks); without
 * friction, of the centres. */
RVE_FN void rve_slide(RveFeatures ft, const RveContactPass *c, const RveArrays *a, const RveNearBody *own,
                      RveRow *row) {
  const int dim = ft.dimension;
  const rve_near half = near_set(0.5), *const n = row->n;
  const rve_near lever = own->r - half * row->overlap, other_lever = row->other.r - half * row->overlap;
  rve_near u[3], w[3], old[3], trial[3];
  RveNearBody other; /* of its own: what is not wanted later need not go to memory */
  near_keep_place(ft, &row->other, &other);
  near_neighbour_motion(ft, a, row->lane0, &other);
  if (ft.viscous) row->other.m = other.m;
  for (int k = 0; k < dim; k++) {
    const int all = k > 0 || ft.viscous; /* else c->rate[0] = 0 */
    if (RVE_CARRIES) u[k] = row->u[k];
    else u[k] = other.v[k] - own->v[k];
    if (dim == 2 && all) u[k] = u[k] + c->rate[3 * k] * row->d[0];
    if (dim == 2) u[k] = u[k] + c->rate[3 * k + 1] * row->d[1];
    else if (all) u[k] = u[k] + (lever + other_lever) * near_dot(3, c->rate + 3 * k, n); /* keeping d, too, takes longer */
    else u[k] = u[k] + (lever + other_lever) * (c->rate[1] * n[1] + c->rate[2] * n[2]);
  }
  if (ft.viscous) row->opening = near_dot(dim, u, n);
  if (!ft.tangential) return;
  for (int k = 0; k < rve_spins(ft); k++) old[k] = near_load(a->shear[k], row->lane0);
  if (dim == 2) {
    row->slide[0] = rve_slide_2d(own, &other, row, u);
    row->trial[0] = old[0] + c->kt_dt * row->slide[0];
    return;
  }
  for (int k = 0; k < 3; k++) w[k] = lever * own->w[k] + other_lever * other.w[k];
  for (int k = 0; k < 3; k++) {
    trial[k] = old[k];
    if (c->turning) trial[k] = c->turn[3 * k] * old[0] + c->turn[3 * k + 1] * old[1] + c->turn[3 * k + 2] * old[2];
  }
  for (int k = 0; k < 3; k++) {
    const int l = (k + 1) % 3, m = (k + 2) % 3; /* u - w x n */
    u[k] = u[k] - w[l] * n[m] + w[m] * n[l];
    trial[k] = trial[k] + c->kt_dt * u[k];
  }
  const rve_near along = near_dot(3, trial, n);
  for (int k = 0; k < 3; k++) row->trial[k] = trial[k] - along * n[k];
  for (int k = 0; ft.viscous && k < 3; k++) row->slide[k] = u[k] - row->opening * n[k];
}

/* Bonds of one row: which lanes are still bonded. Broken ones are forgotten at once. */
RVE_FN near_mask rve_test_bonds(const RveContactPass *c, const RveArrays *a, const RveNearBody *own, const RveRow *row,
                               rve_near trial2) {
  const near_mask broken = rve_breaking(c, row->bonded, row->overlap, own->r + row->other.r, trial2);
  if (near_any(broken)) near_store_image(a->image, row->lane0, near_image_clear(broken, row->image, RVE_IMAGE_BOND));
  return near_and_not(row->bonded, broken);
}

/* Last part: forces, history, work. */
RVE_FN RvePair rve_contact(RveFeatures ft, const RveContactPass *c, const RveArrays *a, const RveNearBody *own,
                           const RveRow *row, rve_near *slip, rve_near *loss) {
  const int dim = ft.dimension;
  const rve_near zero = near_set(0.0), half = near_set(0.5), overlap = row->overlap, *const n = row->n;
  near_mask touch = near_less(zero, overlap), bonded = touch;
  rve_near fn = c->kn * overlap, gt = zero, trial2 = zero, total[3];
  if (ft.bonds) touch = row->touch, bonded = row->bonded;
  if (ft.viscous) {
    const rve_near effective = own->m * row->other.m / (own->m + row->other.m);
    const rve_near opening = row->opening, gn = c->gn * effective + c->gc * near_sqrt(effective);
    fn = fn - gn * opening;
    *loss = *loss + near_keep(touch, gn * opening * opening);
    gt = c->gt * effective;
  }
  const int springs = !ft.viscous && !ft.bonds; /* push only where grains touch */
  if (springs) fn = near_keep(touch, fn);
  RvePair p;
  if (ft.tangential && dim == 2) trial2 = row->trial[0] * row->trial[0];
  else if (ft.tangential) trial2 = near_dot(3, row->trial, row->trial);
  if (ft.bonds) {
    bonded = rve_test_bonds(c, a, own, row, trial2);
    touch = near_or(near_less(zero, overlap), bonded);
  }
  if (ft.tangential) {
    const rve_near lever = own->r - half * overlap, other_lever = row->other.r - half * overlap;
    const rve_near cap = rve_cap(ft, c, fn, overlap);
    rve_near spring[3];
    if (dim == 2) {
      rve_tangential_2d(ft, touch, bonded, row->trial[0], row->slide[0], cap, gt, spring, total, slip, loss);
      p.torque[0] = lever * total[0];
      p.other_torque[0] = other_lever * total[0];
    } else {
      rve_tangential_3d(ft, touch, bonded, row->trial, trial2, row->slide, cap, gt, spring, total, slip, loss);
      const rve_near cross[3] = {n[1] * total[2] - n[2] * total[1], n[2] * total[0] - n[0] * total[2],
                                 n[0] * total[1] - n[1] * total[0]};
      for (int k = 0; k < 3; k++) p.torque[k] = lever * cross[k], p.other_torque[k] = other_lever * cross[k];
    }
    for (int k = 0; k < rve_spins(ft); k++) near_store(a->shear[k], row->lane0, spring[k]);
  }
  if (!springs) fn = near_keep(touch, fn);
  for (int k = 0; k < dim; k++) p.push[k] = fn * n[k];
  if (ft.tangential) {
    if (dim == 2) {
      p.push[0] = near_fma(total[0], n[1], p.push[0]); /* the tangential part last: it is the later one */
      p.push[1] = near_fnma(total[0], n[0], p.push[1]);
    } else
      for (int k = 0; k < 3; k++) p.push[k] = p.push[k] - total[k];
  }
  return p;
}

/* What a pass over contacts carries along. */
typedef struct RveContactSums {
  rve_near slid, lost;          /* of all contacts */
  rve_near force[3], torque[3]; /* of one block's own slots */
} RveContactSums;

RVE_FN void rve_add_contact(RveFeatures ft, const RveContactPass *c, const RveArrays *a,
                            const RveNearBody *own, const RveRow *row, RveContactSums *sum) {
  const RvePair p = rve_contact(ft, c, a, own, row, &sum->slid, &sum->lost);
  near_write_reaction(ft, a, row->lane0, &p);
  for (int k = 0; k < ft.dimension; k++) sum->force[k] = sum->force[k] - p.push[k];
  for (int k = 0; ft.tangential && k < rve_spins(ft); k++) sum->torque[k] = sum->torque[k] + p.torque[k];
}

/* A block's own grains for one more loop: read again, as operands from memory, that take no registers. FP32 is made of them once. */
RVE_FN RveNearBody rve_own_again(RveFeatures ft, const RveArrays *a, const RveNearBody *own) {
  return RVE_PARTS > 1 ? *own : near_own_body(ft, a, own->lane0);
}

/* The rows of one block, each part of the computation for up to RVE_CHUNK of them in turn. */
RVE_FN void rve_contact_chunks(RveFeatures ft, const RveContactPass *c, const RveHead *head, const RveArrays *a, int block,
                               const RveNearBody *first, RveContactSums *sum) {
  for (int at = a->slot_first[block]; at < a->slot_first[block + 1];) {
    RveRow row[RVE_CHUNK];
    int rows = 0;
    for (; at < a->slot_first[block + 1] && rows < RVE_CHUNK; at++) {
      if (head->approach < a->idle_until[at]) continue;
      const RveNearBody own = rve_own_again(ft, a, first);
      RveNearBody other;
      near_neighbour_place(ft, a, at * RVE_PACK, &other);
      if (rve_meet(ft, c, a, &own, &other, at * RVE_PACK, &row[rows])) rows++;
      else rve_clear(ft, a, &row[rows]), rve_rest(head, a, &row[rows]);
    }
    if (ft.tangential || ft.viscous)
      for (int r = 0; r < rows; r++) {
        const RveNearBody own = rve_own_again(ft, a, first);
        rve_slide(ft, c, a, &own, &row[r]);
      }
    for (int r = 0; r < rows; r++) {
      const RveNearBody own = rve_own_again(ft, a, first);
      rve_add_contact(ft, c, a, &own, &row[r], sum);
    }
  }
}

/* The rows of a pass that do not rest, one after the other. CPUs read a row's neighbours while they work on the row before:
 * their schedulers are too small to find that work by themselves behind the chain of a row. */
typedef struct RveRows {
  int row, end;
  RveNearBody other; /* of this row; CUDA, whose threads hide latency: unused */
} RveRows;

RVE_FN void rve_find_row(RveFeatures ft, const RveHead *head, const RveArrays *a, int from, RveRows *rows) {
  rows->row = from;
  while (rows->row < rows->end && head->approach < a->idle_until[rows->row]) rows->row++;
  /* Behind the last row, too, some neighbours are named: a condition would cost more than they do. */
  if (RVE_AHEAD) near_neighbour_place(ft, a, rows->row * RVE_PACK, &rows->other);
}

RVE_FN RveNearBody rve_take_row(RveFeatures ft, const RveHead *head, const RveArrays *a, RveRows *rows) {
  RveNearBody other;
  if (RVE_AHEAD) other = rows->other;
  else near_neighbour_place(ft, a, rows->row * RVE_PACK, &other);
  rve_find_row(ft, head, a, rows->row + 1, rows);
  return other;
}

/* The same where a row's numbers fit the registers: 2D, and a thread of CUDA. */
RVE_FN void rve_contact_rows(RveFeatures ft, const RveContactPass *c, const RveHead *head, const RveArrays *a, int block,
                             const RveNearBody *own, RveRows *rows, RveContactSums *sum) {
  const int stop = a->slot_first[block + 1];
  if (!RVE_AHEAD) rows->end = stop, rve_find_row(ft, head, a, a->slot_first[block], rows);
  while (rows->row < stop) {
    RveRow row;
    const int at = rows->row;
    const RveNearBody other = rve_take_row(ft, head, a, rows);
    const int touching = rve_meet(ft, c, a, own, &other, at * RVE_PACK, &row);
    if (ft.tangential || ft.viscous) rve_slide(ft, c, a, own, &row);
    rve_add_contact(ft, c, a, own, &row, sum);
    if (!touching) rve_rest(head, a, &row); /* asked last: the compiler may not mix what stands before and behind */
  }
}

/* In coupled runs a packing comes from memory for a few steps at a time. Fetched while the thread works on another it need
 * not be waited for, if only few lines are asked for at once. */
enum { RVE_LINE = 64 };
RVE_FN void rve_spread_ahead(RveScratch *s, int64_t blocks) {
#if defined(__CUDACC__)
  (void)s, (void)blocks;
#else
  const int64_t lines = (int64_t)(s->ahead_bytes / RVE_LINE);
  s->ahead_lines = s->ahead && blocks > 0 ? (int32_t)((lines + blocks - 1) / blocks) : 0;
#endif
}
RVE_FN void rve_fetch_ahead(RveScratch *s) {
#if defined(__CUDACC__)
  (void)s;
#else
  if (__builtin_expect(s->ahead_lines == 0, 1)) return;
  const size_t part = (size_t)s->ahead_lines * RVE_LINE, many = part < s->ahead_bytes ? part : s->ahead_bytes;
  for (size_t at = 0; at < many; at += RVE_LINE) __builtin_prefetch(s->ahead + at, 0, 2);
  s->ahead += many, s->ahead_bytes -= many;
  if (s->ahead_bytes == 0) s->ahead_lines = 0;
#endif
}

/* All contacts. dt = 0: forces of the present state, histories do not grow. slip: J times kt; loss: W of the dashpots.
 */
RVE_FN void rve_contact_pass(RveFeatures ft, const RveTeam *team, const RveCall *call, const RveHead *head, double dt,
                             const RveCounts *n, const RveArrays *a, RveScratch *s, rve_real *slip, rve_real *loss) {
  const RveContactPass c = rve_contact_pass_of(ft, call, head, dt);
  const int chunks = RVE_CHUNK > 1 && ft.dimension == 3;
  RveContactSums sum;
  RveRows rows;
  rows.row = 0, rows.end = a->slot_first[n->blocks];
  if (RVE_AHEAD && !chunks && rows.end > 0) rve_find_row(ft, head, a, 0, &rows);
  sum.slid = sum.lost = near_set(0.0);
  for (int block = team->pack; block < n->blocks; block += team->packs) {
    const int lane0 = block * RVE_PACK;
    const RveNearBody own = near_own_body(ft, a, lane0);
    rve_fetch_ahead(s);
    for (int k = 0; k < 3; k++) sum.force[k] = sum.torque[k] = near_set(0.0);
    if (chunks) rve_contact_chunks(ft, &c, head, a, block, &own, &sum);
    else rve_contact_rows(ft, &c, head, a, block, &own, &rows, &sum);
    for (int k = 0; k < ft.dimension; k++) near_store(a->force[k], lane0, sum.force[k]);
    for (int k = 0; ft.tangential && k < rve_spins(ft); k++) near_store(a->torque[k], lane0, sum.torque[k]);
  }
  *slip = *slip + near_sum_wide(sum.slid);
  *loss = *loss + near_sum_wide(sum.lost);
}

/* ------------------------------------------------------------------------------------------------------ move pass */

/* Cundall's damping of one component: alpha |f| against the power f v, along f where that is 0 (+ 0.0: also where it is
 * -0). */
RVE_FN rve_real rve_damp(rve_real alpha, rve_real f, rve_real v) {
  return f - rve_copy_sign(alpha, f * v + rve_set(0.0)) * f;
}

/* What a span of grains has in the move pass. */
typedef struct RveSpanForce {
  rve_real force[3], torque[3];
} RveSpanForce;

typedef struct RveMove {
  rve_real drift[9], lag[9], dt, alpha, scale;
} RveMove;

/* Kicks and drifts one span of grains. fastest: largest v^2; loss: twice the power of local damping, W. */
RVE_FN void rve_move(RveFeatures ft, const RveMove *m, int damped, int thermal, const RveArrays *a, int lane0,
                     const RveSpanForce *sum, rve_real *fastest, rve_real *loss) {
  const int dim = ft.dimension, spins = ft.tangential ? rve_spins(ft) : 0;
  RveBody b, old;
  for (int k = 0; k < dim; k++) old.v[k] = rve_load(a->velocity[k], lane0);
  const rve_real per_mass = rve_load(a->inverse_mass, lane0) * m->dt;
  for (int k = 0; k < dim; k++) {
    const rve_real f = sum->force[k] + rve_load(a->force[k], lane0);
    const rve_real used = damped ? rve_damp(m->alpha, f, old.v[k]) : f;
    b.v[k] = old.v[k] + used * per_mass - m->lag[3 * k] * old.v[0] - m->lag[3 * k + 1] * old.v[1];
    if (dim == 3) b.v[k] = b.v[k] - m->lag[3 * k + 2] * old.v[2];
    rve_store(a->velocity[k], lane0, b.v[k]);
    if (damped) *loss = *loss + (f - used) * (old.v[k] + b.v[k]);
  }
  for (int k = 0; k < spins; k++) {
    const rve_real torque = sum->torque[k] + rve_load(a->torque[k], lane0), w = rve_load(a->spin[k], lane0);
    const rve_real used = damped ? rve_damp(m->alpha, torque, w) : torque;
    b.w[k] = w + used * rve_load(a->inverse_inertia, lane0) * m->dt;
    rve_store(a->spin[k], lane0, b.w[k]);
    if (damped) *loss = *loss + (torque - used) * (w + b.w[k]);
  }
  if (!ft.tangential)
    for (int k = 0; k < rve_spins(ft); k++) b.w[k] = rve_load(a->spin[k], lane0);
  *fastest = rve_max(*fastest, rve_dot(dim, b.v, b.v));
  for (int k = 0; k < dim; k++) {
    rve_real step = m->drift[3 * k] * b.v[0] + m->drift[3 * k + 1] * b.v[1];
    if (dim == 3) step = step + m->drift[3 * k + 2] * b.v[2];
    b.s[k] = rve_int_add(rve_load_int(a->position[k], lane0), rve_int_from_real(step));
    rve_store_int(a->position[k], lane0, b.s[k]);
  }
  if (thermal) {
    b.r = rve_load(a->reference_radius, lane0) * m->scale;
    rve_store(a->radius, lane0, b.r);
  } else {
    b.r = rve_load(a->radius, lane0);
  }
  b.m = ft.viscous ? rve_load(a->mass, lane0) : rve_set(0.0);
  rve_write_rows(dim, a, lane0, &b);
}

/* Sums forces, kicks, drifts; as with contacts, the first part may run ahead for several spans. */
RVE_FN void rve_move_spans(RveFeatures ft, const RveMove *m, int damped, int thermal, const RveTeam *team, const RveHead *head,
                           const RveCounts *n, const RveArrays *a, rve_real *fastest, rve_real *loss) {
  const int spans = n->blocks * RVE_PARTS, chunk = ft.dimension == 2 ? RVE_SUM_AHEAD : 1;
  for (int first = team->pack; first < spans; first += chunk * team->packs) {
    const int left = (spans - first + team->packs - 1) / team->packs, many = left < chunk ? left : chunk;
    RveSpanForce sum[RVE_SUM_AHEAD];
    for (int q = 0; q < many; q++)
      rve_sum_reactions(ft, head, a, (first + q * team->packs) * RVE_SPAN, sum[q].force, sum[q].torque);
    for (int q = 0; q < many; q++)
      rve_move(ft, m, damped, thermal, a, (first + q * team->packs) * RVE_SPAN, &sum[q], fastest, loss);
  }
}

RVE_FN void rve_move_pass(RveFeatures ft, const RveTeam *team, const RveCall *call, const RveHead *head, double scale,
                          const RveCounts *n, const RveArrays *a, rve_real *fastest, rve_real *loss) {
  RveMove m;
  m.dt = rve_set(call->dt), m.scale = rve_set(scale), m.alpha = rve_set(call->local_damping);
  for (int k = 0; k < 9; k++) {
    m.drift[k] = rve_set(head->inverse[k] * call->dt * (double)RVE_ONE);
    m.lag[k] = rve_set(call->gradient[k] * call->dt);
  }
  /* Asked once, not for each span: a condition would keep the compiler from fusing products and sums across it. */
  if (call->local_damping > 0.0) rve_move_spans(ft, &m, 1, call->thermal, team, head, n, a, fastest, loss);
  else rve_move_spans(ft, &m, 0, call->thermal, team, head, n, a, fastest, loss);
}

#endif
