/* SPDX-License-Identifier: GPL-2.0-or-later */
/* One DEM step of one RVE: move pass (sum of reactions, kick, drift) - cell - contact pass. Written once for all
 * backends and both dimensions; see rve_team.h for the lanes.
 *
 * Leapfrog. v lives half a step behind s: v += dt (f/m - L v), s += H^-1 v dt, H <- exp(L dt) H, then contacts at the
 * new places. v is the fluctuation about the affine flow, hence the term L v. Spins are relative to the flow's
 * vorticity W, so that the velocity of a contact contains D = sym L only, and a rigid rotation strains nothing. */
#ifndef DEMPM_RVE_KERNEL_H
#define DEMPM_RVE_KERNEL_H

#include "rve_state.h"

/* A pack of grains as neighbours see them. */
typedef struct RveBody {
  rve_int s[3];
  rve_real v[3], w[3], r, m;
} RveBody;

RVE_FN int rve_spins(RveFeatures ft) { return ft.dimension == 2 ? 1 : 3; }
RVE_FN rve_real rve_sign_like(rve_real magnitude, rve_real power) { /* +magnitude where power >= 0 */
  return rve_select(rve_less(power, rve_set(0.0)), rve_set(0.0) - magnitude, magnitude);
}

RVE_FN RveBody rve_own_body(RveFeatures ft, const RveArrays *a, int lane0) {
  RveBody own;
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

RVE_FN RveBody rve_neighbour_body(RveFeatures ft, const RveArrays *a, int lane0) {
  RveBody other;
  if (ft.dimension == 2) {
    const double *const f0[4] = {(const double *)a->position[0], (const double *)a->position[1], a->velocity[0],
                                 a->velocity[1]};
    const double *const f1[4] = {a->spin[0], a->radius, ft.viscous ? a->mass : 0, 0};
    const RveQuad q = rve_gather(a->row, f0, a->neighbour, lane0), p = rve_gather(a->row + 4, f1, a->neighbour, lane0);
    for (int k = 0; k < 2; k++) other.s[k] = rve_int_from_bits(q.f[k]), other.v[k] = q.f[k + 2];
    other.w[0] = p.f[0], other.r = p.f[1], other.m = p.f[2];
  } else {
    const double *const f0[4] = {(const double *)a->position[0], (const double *)a->position[1],
                                 (const double *)a->position[2], a->radius};
    const double *const f1[4] = {a->velocity[0], a->velocity[1], a->velocity[2], ft.viscous ? a->mass : 0};
    const double *const f2[4] = {a->spin[0], a->spin[1], a->spin[2], 0};
    const RveQuad q = rve_gather(a->row, f0, a->neighbour, lane0);
    for (int k = 0; k < 3; k++) other.s[k] = rve_int_from_bits(q.f[k]);
    other.r = q.f[3];
    if (ft.tangential || ft.viscous) {
      const RveQuad p = rve_gather(a->row + 4, f1, a->neighbour, lane0);
      for (int k = 0; k < 3; k++) other.v[k] = p.f[k];
      other.m = p.f[3];
    }
    if (ft.tangential) {
      const RveQuad t = rve_gather(a->row + 8, f2, a->neighbour, lane0);
      for (int k = 0; k < 3; k++) other.w[k] = t.f[k];
    }
  }
  return other;
}

/* Writes the rows (or nothing, where arrays are read directly) of the pack at lane0. */
RVE_FN void rve_write_rows(int dimension, const RveCounts *n, const RveArrays *a, int lane0, const RveBody *b) {
  if (!RVE_ROWS) return;
  double *const none[4] = {0, 0, 0, 0};
  double *const rows = a->row;
  const rve_real zero = rve_set(0.0);
  if (dimension == 2) {
    const RveQuad q = {{rve_bits_from_int(b->s[0]), rve_bits_from_int(b->s[1]), b->v[0], b->v[1]}};
    const RveQuad p = {{b->w[0], b->r, b->m, zero}};
    rve_scatter(rows, n->row, none, lane0, q);
    rve_scatter(rows + 4, n->row, none, lane0, p);
  } else {
    const RveQuad q = {{rve_bits_from_int(b->s[0]), rve_bits_from_int(b->s[1]), rve_bits_from_int(b->s[2]), b->r}};
    const RveQuad p = {{b->v[0], b->v[1], b->v[2], b->m}}, t = {{b->w[0], b->w[1], b->w[2], zero}};
    rve_scatter(rows, n->row, none, lane0, q);
    rve_scatter(rows + 4, n->row, none, lane0, p);
    rve_scatter(rows + 8, n->row, none, lane0, t);
  }
}

/* --------------------------------------------------------------------------------------------------- contact pass */

typedef struct RveContactPass {
  rve_real h[9];    /* H times RVE_UNIT */
  rve_real rate[9]; /* D */
  rve_real turn[9];
  rve_real kn, kt_dt, kt, mu, dt, gn, gt, gc, bond, bond_ratio;
  int turning;
} RveContactPass;

/* What a contact does to its owner; the neighbour gets -force, and other_torque. */
typedef struct RvePair {
  rve_real force[3], torque[3], other_torque[3];
} RvePair;

RVE_FN double rve_bond_force_factor(const RveCall *call, double temperature) {
  /* TM-DEMPM eq. 40, corrected for reference temperatures other than 0. */
  double left = 1.0;
  const double melting = call->bond_melting_temperature;
  if (call->thermal && melting < 1e300) left = (melting - temperature) / (melting - call->reference_temperature);
  left = left < 0.0 ? 0.0 : left > 1.0 ? 1.0 : left;
  return call->bond_strength * left * call->normal_stiffness;
}

RVE_FN RveContactPass rve_contact_pass_of(const RveCall *call, const RveHead *head, double dt) {
  RveContactPass c;
  for (int k = 0; k < 9; k++) {
    c.h[k] = rve_set(head->cell[k] * RVE_UNIT);
    c.rate[k] = rve_set(call->rate[k]);
    c.turn[k] = rve_set(call->turn[k]);
  }
  c.turning = call->turning;
  c.kn = rve_set(call->normal_stiffness);
  c.kt = rve_set(call->tangential_stiffness);
  c.kt_dt = rve_set(call->tangential_stiffness * dt);
  c.mu = rve_set(call->friction);
  c.dt = rve_set(dt);
  c.gn = rve_set(call->normal_viscosity);
  c.gt = rve_set(call->tangential_viscosity);
  c.gc = rve_set(call->critical_viscosity);
  c.bond = rve_set(rve_bond_force_factor(call, head->temperature));
  c.bond_ratio = rve_set(call->bond_shear_ratio);
  return c;
}

/* x_j - x_i of the slots at lane0. */
RVE_FN void rve_branch(int dim, const rve_real h[9], const rve_int si[3], const rve_int sj[3], rve_int image,
                       rve_real d[3]) {
  const rve_int top = rve_set_int((int64_t)((uint64_t)15 << 60));
  rve_real x[3];
  for (int k = 0; k < dim; k++) {
    rve_int shift = k == 0 ? rve_int_shift_left(image, 60)
                           : rve_int_and(k == 1 ? rve_int_shift_left(image, 56) : rve_int_shift_left(image, 52), top);
    x[k] = rve_real_from_int(rve_int_add(rve_int_subtract(sj[k], si[k]), shift));
  }
  for (int k = 0; k < dim; k++) {
    d[k] = h[3 * k] * x[0] + h[3 * k + 1] * x[1];
    if (dim == 3) d[k] = d[k] + h[3 * k + 2] * x[2];
  }
}

RVE_FN rve_real rve_dot(int dim, const rve_real a[3], const rve_real b[3]) {
  rve_real c = a[0] * b[0] + a[1] * b[1];
  if (dim == 3) c = c + a[2] * b[2];
  return c;
}

/* Coulomb's cap, mu |fn|. Springs alone push wherever grains touch; what other lanes get is dropped later. */
RVE_FN rve_real rve_cap(RveFeatures ft, const RveContactPass *c, rve_real fn) {
  return c->mu * (ft.viscous || ft.bonds ? rve_abs(fn) : fn);
}

/* Tangential part: history, Coulomb's cap (or the bond), dashpot. stick: lanes that an intact bond exempts from the
 * cap. Follows LIGGGHTS' `tangential history`: the dashpot acts on contacts that do not slide and is outside the cap.
 */
RVE_FN void rve_tangential_2d(RveFeatures ft, const RveContactPass *c, rve_mask touch, rve_mask bonded, rve_real trial,
                              rve_real vt, rve_real fn, rve_real gt, rve_real *spring, rve_real *total, rve_real *slip,
                              rve_real *loss) {
  const rve_real zero = rve_set(0.0), cap = rve_cap(ft, c, fn);
  rve_real f = rve_min(rve_max(trial, zero - cap), cap);
  if (ft.bonds) f = rve_select(bonded, trial, f);
  f = rve_keep(touch, f);
  *slip = *slip + (trial - f) * f; /* times 1/kt: |f| times the slip distance; same sign, so no modulus */
  *spring = *total = f;
  if (ft.viscous) {
    const rve_mask stuck = rve_and_not(touch, rve_or(rve_less(f, trial), rve_less(trial, f)));
    const rve_real dash = rve_keep(stuck, gt * vt);
    *total = f + dash;
    *loss = *loss + dash * vt;
  }
}

RVE_FN void rve_tangential_3d(RveFeatures ft, const RveContactPass *c, rve_mask touch, rve_mask bonded,
                              const rve_real trial[3], rve_real size2, const rve_real vt[3], rve_real fn, rve_real gt,
                              rve_real spring[3], rve_real total[3], rve_real *slip, rve_real *loss) {
  const rve_real one = rve_set(1.0), cap = rve_cap(ft, c, fn);
  rve_real factor = rve_min(one, cap * rve_inverse_sqrt(size2 + rve_set(1e-300)));
  if (ft.bonds) factor = rve_select(bonded, one, factor);
  factor = rve_keep(touch, factor);
  *slip = *slip + (one - factor) * factor * size2;
  for (int k = 0; k < 3; k++) spring[k] = total[k] = factor * trial[k];
  if (ft.viscous) {
    const rve_mask stuck = rve_and_not(touch, rve_less(factor, one));
    for (int k = 0; k < 3; k++) {
      const rve_real dash = rve_keep(stuck, gt * vt[k]);
      total[k] = total[k] + dash;
      *loss = *loss + dash * vt[k];
    }
  }
}

/* Lanes whose intact bond breaks now: tension above F_nb, or tangential force above mu_b F_nb (eq. 38-39, tension
 * positive). */
RVE_FN rve_mask rve_breaking(const RveContactPass *c, rve_mask bonded, rve_real overlap, rve_real radii,
                             rve_real trial2) {
  const rve_real strength = c->bond * rve_set(0.5) * radii, shear = c->bond_ratio * strength;
  const rve_mask pulled = rve_less(strength, rve_set(0.0) - c->kn * overlap);
  return rve_and(bonded, rve_or(pulled, rve_less(shear * shear, trial2)));
}

/* Tangential force if nothing slid: history turned with the flow, plus the step's relative motion, in the tangent
 * plane. In: u, relative velocity of the centres; out: u, of the surfaces and tangential (2D: u[0]; 3D: only if a
 * dashpot asks). Returns |trial|^2. */
RVE_FN rve_real rve_trial(RveFeatures ft, const RveContactPass *c, const RveArrays *a, const RveBody *own,
                          const RveBody *other, int lane0, rve_real lever, rve_real other_lever, const rve_real n[3],
                          rve_real u[3], rve_real trial[3]) {
  rve_real w[3], old[3];
  for (int k = 0; k < rve_spins(ft); k++) {
    w[k] = lever * own->w[k] + other_lever * other->w[k];
    old[k] = rve_load(a->shear[k], lane0);
  }
  if (ft.dimension == 2) {
    u[0] = n[0] * u[1] - n[1] * u[0] - w[0];
    trial[0] = old[0] + c->kt_dt * u[0];
    return trial[0] * trial[0];
  }
  for (int k = 0; k < 3; k++) {
    trial[k] = old[k];
    if (c->turning) trial[k] = c->turn[3 * k] * old[0] + c->turn[3 * k + 1] * old[1] + c->turn[3 * k + 2] * old[2];
  }
  const rve_real cross[3] = {w[1] * n[2] - w[2] * n[1], w[2] * n[0] - w[0] * n[2], w[0] * n[1] - w[1] * n[0]};
  for (int k = 0; k < 3; k++) u[k] = u[k] - cross[k], trial[k] = trial[k] + c->kt_dt * u[k];
  const rve_real along = rve_dot(3, trial, n);
  for (int k = 0; k < 3; k++) trial[k] = trial[k] - along * n[k];
  if (ft.viscous) {
    const rve_real normal = rve_dot(3, u, n);
    for (int k = 0; k < 3; k++) u[k] = u[k] - normal * n[k];
  }
  return rve_dot(3, trial, trial);
}

/* Bonds of one row: which lanes are still bonded. Broken ones are forgotten at once. */
RVE_FN rve_mask rve_test_bonds(const RveContactPass *c, const RveArrays *a, int lane0, rve_int image, rve_mask bonded,
                               rve_real overlap, rve_real radii, rve_real trial2) {
  const rve_mask broken = rve_breaking(c, bonded, overlap, radii, trial2);
  if (rve_any(broken)) rve_store_short(a->image, lane0, rve_int_clear(broken, image, rve_set_int(RVE_IMAGE_BOND)));
  return rve_and_not(bonded, broken);
}

/* One row of slots: forces, history, work. */
RVE_FN RvePair rve_contact(RveFeatures ft, const RveContactPass *c, const RveArrays *a, const RveBody *own, int lane0,
                           rve_real *slip, rve_real *loss) {
  const int dim = ft.dimension;
  const RveBody other = rve_neighbour_body(ft, a, lane0);
  const rve_int image = rve_load_short(a->image, lane0);
  const rve_real zero = rve_set(0.0), half = rve_set(0.5);
  rve_real d[3], n[3], u[3];
  rve_branch(dim, c->h, own->s, other.s, image, d);
  const rve_real square = rve_dot(dim, d, d), inverse = rve_inverse_sqrt(square), distance = square * inverse;
  const rve_real radii = own->r + other.r, overlap = radii - distance;
  for (int k = 0; k < dim; k++) n[k] = d[k] * inverse;
  rve_mask touch = rve_less(zero, overlap), bonded = touch;
  if (ft.bonds) bonded = rve_int_any_bit(image, rve_set_int(RVE_IMAGE_BOND));
  rve_real fn = c->kn * overlap, gt = zero;
  if (ft.tangential || ft.viscous)
    for (int k = 0; k < dim; k++) {
      u[k] = other.v[k] - own->v[k] + c->rate[3 * k] * d[0] + c->rate[3 * k + 1] * d[1];
      if (dim == 3) u[k] = u[k] + c->rate[3 * k + 2] * d[2];
    }
  if (ft.viscous) {
    const rve_real effective = own->m * other.m / (own->m + other.m);
    const rve_real opening = rve_dot(dim, u, n), gn = c->gn * effective + c->gc * rve_sqrt(effective);
    fn = fn - gn * opening;
    *loss = *loss + rve_keep(ft.bonds ? rve_or(touch, bonded) : touch, gn * opening * opening);
    gt = c->gt * effective;
  }
  RvePair p;
  rve_real total[3];
  if (ft.tangential) {
    const rve_real lever = own->r - half * overlap, other_lever = other.r - half * overlap;
    rve_real trial[3], spring[3];
    const rve_real trial2 = rve_trial(ft, c, a, own, &other, lane0, lever, other_lever, n, u, trial);
    if (ft.bonds) {
      bonded = rve_test_bonds(c, a, lane0, image, bonded, overlap, radii, trial2);
      touch = rve_or(touch, bonded);
    }
    if (dim == 2) {
      rve_tangential_2d(ft, c, touch, bonded, trial[0], u[0], fn, gt, spring, total, slip, loss);
      p.torque[0] = lever * total[0];
      p.other_torque[0] = other_lever * total[0];
    } else {
      rve_tangential_3d(ft, c, touch, bonded, trial, trial2, u, fn, gt, spring, total, slip, loss);
      const rve_real cross[3] = {n[1] * total[2] - n[2] * total[1], n[2] * total[0] - n[0] * total[2],
                                 n[0] * total[1] - n[1] * total[0]};
      for (int k = 0; k < 3; k++) p.torque[k] = lever * cross[k], p.other_torque[k] = other_lever * cross[k];
    }
    for (int k = 0; k < rve_spins(ft); k++) rve_store(a->shear[k], lane0, spring[k]);
  } else if (ft.bonds) {
    touch = rve_or(touch, rve_test_bonds(c, a, lane0, image, bonded, overlap, radii, zero));
  }
  fn = rve_keep(touch, fn);
  for (int k = 0; k < dim; k++) p.force[k] = zero - fn * n[k];
  if (ft.tangential) {
    if (dim == 2) {
      p.force[0] = p.force[0] - total[0] * n[1];
      p.force[1] = p.force[1] + total[0] * n[0];
    } else
      for (int k = 0; k < 3; k++) p.force[k] = p.force[k] + total[k];
  }
  return p;
}

RVE_FN void rve_write_reaction(RveFeatures ft, const RveCounts *n, const RveArrays *a, int lane0, const RvePair *p) {
  const rve_real zero = rve_set(0.0);
  double *const *const field = a->reaction_field;
  if (ft.dimension == 2) {
    double *const f[4] = {field[0], field[1], ft.tangential ? field[2] : 0, 0};
    const RveQuad q = {{zero - p->force[0], zero - p->force[1], ft.tangential ? p->other_torque[0] : zero, zero}};
    rve_scatter(a->reaction, n->reaction, f, lane0, q);
  } else {
    double *const f[4] = {field[0], field[1], field[2], ft.tangential ? field[3] : 0};
    double *const g[4] = {field[4], field[5], 0, 0};
    const RveQuad q = {
        {zero - p->force[0], zero - p->force[1], zero - p->force[2], ft.tangential ? p->other_torque[0] : zero}};
    rve_scatter(a->reaction, n->reaction, f, lane0, q);
    if (ft.tangential) {
      const RveQuad t = {{p->other_torque[1], p->other_torque[2], zero, zero}};
      rve_scatter(a->reaction + 4, n->reaction, g, lane0, t);
    }
  }
}

/* Force and torque that a pack of grains gets from the slots of others. */
RVE_FN void rve_sum_reactions(RveFeatures ft, const RveArrays *a, int block, rve_real force[3], rve_real torque[3]) {
  const int first = a->incoming_first[block], last = a->incoming_first[block + 1];
  double *const *const field = a->reaction_field;
  const double *const f[4] = {field[0], field[1], field[2], ft.dimension == 3 && ft.tangential ? field[3] : 0};
  const RveQuad q = rve_sum_rows(a->reaction, f, a->incoming, first, last);
  force[0] = q.f[0], force[1] = q.f[1];
  if (ft.dimension == 2) {
    torque[0] = q.f[2];
  } else {
    force[2] = q.f[2], torque[0] = q.f[3];
    if (ft.tangential) {
      const double *const g[4] = {field[4], field[5], 0, 0};
      const RveQuad t = rve_sum_rows(a->reaction + 4, g, a->incoming, first, last);
      torque[1] = t.f[0], torque[2] = t.f[1];
    }
  }
}

/* All contacts. dt = 0: forces of the present state, histories do not grow. slip: J times kt; loss: W of the dashpots.
 */
RVE_FN void rve_contact_pass(RveFeatures ft, const RveTeam *team, const RveCall *call, const RveHead *head, double dt,
                             const RveCounts *n, const RveArrays *a, rve_real *slip, rve_real *loss) {
  const RveContactPass c = rve_contact_pass_of(call, head, dt);
  for (int block = team->pack; block < n->blocks; block += team->packs) {
    const int lane0 = block * RVE_PACK, last = a->slot_first[block + 1];
    const RveBody own = rve_own_body(ft, a, lane0);
    const int spins = ft.tangential ? rve_spins(ft) : 0;
    rve_real force[3], torque[3];
    for (int k = 0; k < 3; k++) force[k] = torque[k] = rve_set(0.0);
    for (int row = a->slot_first[block]; row < last; row++) {
      const RvePair p = rve_contact(ft, &c, a, &own, row * RVE_PACK, slip, loss);
      rve_write_reaction(ft, n, a, row * RVE_PACK, &p);
      for (int k = 0; k < ft.dimension; k++) force[k] = force[k] + p.force[k];
      for (int k = 0; k < spins; k++) torque[k] = torque[k] + p.torque[k];
    }
    for (int k = 0; k < ft.dimension; k++) rve_store(a->force[k], lane0, force[k]);
    for (int k = 0; k < spins; k++) rve_store(a->torque[k], lane0, torque[k]);
  }
}

/* ------------------------------------------------------------------------------------------------------ move pass */

/* Cundall's damping of one component; adds the power it takes. */
RVE_FN rve_real rve_damp(rve_real alpha, rve_real f, rve_real v) { return f - rve_sign_like(alpha, f * v) * f; }

/* Sums forces, kicks, drifts. fastest: largest v^2; loss: work of local damping, J. */
RVE_FN void rve_move_pass(RveFeatures ft, const RveTeam *team, const RveCall *call, const RveHead *head, double scale,
                          const RveCounts *n, const RveArrays *a, rve_real *fastest, rve_real *loss) {
  const int dim = ft.dimension, spins = ft.tangential ? rve_spins(ft) : 0, damped = call->local_damping > 0.0;
  const rve_real dt = rve_set(call->dt), half_dt = rve_set(0.5 * call->dt), alpha = rve_set(call->local_damping);
  rve_real drift[9], lag[9];
  for (int k = 0; k < 9; k++) {
    drift[k] = rve_set(head->inverse[k] * call->dt * (double)RVE_ONE);
    lag[k] = rve_set(call->gradient[k] * call->dt);
  }
  for (int block = team->pack; block < n->blocks; block += team->packs) {
    const int lane0 = block * RVE_PACK;
    rve_real f[3], t[3];
    RveBody b, old;
    rve_sum_reactions(ft, a, block, f, t);
    for (int k = 0; k < dim; k++)
      f[k] = f[k] + rve_load(a->force[k], lane0), old.v[k] = rve_load(a->velocity[k], lane0);
    const rve_real per_mass = rve_load(a->inverse_mass, lane0) * dt;
    for (int k = 0; k < dim; k++) {
      const rve_real used = damped ? rve_damp(alpha, f[k], old.v[k]) : f[k];
      b.v[k] = old.v[k] + used * per_mass - lag[3 * k] * old.v[0] - lag[3 * k + 1] * old.v[1];
      if (dim == 3) b.v[k] = b.v[k] - lag[3 * k + 2] * old.v[2];
      rve_store(a->velocity[k], lane0, b.v[k]);
      if (damped) *loss = *loss + (f[k] - used) * (old.v[k] + b.v[k]) * half_dt;
    }
    for (int k = 0; k < spins; k++) {
      const rve_real torque = t[k] + rve_load(a->torque[k], lane0), w = rve_load(a->spin[k], lane0);
      const rve_real used = damped ? rve_damp(alpha, torque, w) : torque;
      b.w[k] = w + used * rve_load(a->inverse_inertia, lane0) * dt;
      rve_store(a->spin[k], lane0, b.w[k]);
      if (damped) *loss = *loss + (torque - used) * (w + b.w[k]) * half_dt;
    }
    if (!ft.tangential)
      for (int k = 0; k < rve_spins(ft); k++) b.w[k] = rve_load(a->spin[k], lane0);
    *fastest = rve_max(*fastest, rve_dot(dim, b.v, b.v));
    for (int k = 0; k < dim; k++) {
      rve_real step = drift[3 * k] * b.v[0] + drift[3 * k + 1] * b.v[1];
      if (dim == 3) step = step + drift[3 * k + 2] * b.v[2];
      b.s[k] = rve_int_add(rve_load_int(a->position[k], lane0), rve_int_from_real(step));
      rve_store_int(a->position[k], lane0, b.s[k]);
    }
    if (call->thermal) {
      b.r = rve_load(a->reference_radius, lane0) * rve_set(scale);
      rve_store(a->radius, lane0, b.r);
    } else {
      b.r = rve_load(a->radius, lane0);
    }
    b.m = ft.viscous ? rve_load(a->mass, lane0) : rve_set(0.0);
    rve_write_rows(dim, n, a, lane0, &b);
  }
}

#endif
