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
  rve_near h[9 * RVE_PARTS]; /* H times RVE_UNIT; in FP32 also what its rounding left */
  rve_near rate[9]; /* D */
  rve_near turn[9];
  rve_near kn, kt_dt, kt, mu, dt, gn, gt, gc, bond, bond_ratio;
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

RVE_FN RveContactPass rve_contact_pass_of(const RveCall *call, const RveHead *head, double dt) {
  RveContactPass c;
  for (int k = 0; k < 9; k++) {
    const double h = head->cell[k] * RVE_UNIT;
    c.h[k] = near_set(h);
    if (RVE_PARTS == 2) c.h[9 + k] = near_set(h - (float)h);
    c.rate[k] = near_set(call->rate[k]);
    c.turn[k] = near_set(call->turn[k]);
  }
  c.turning = call->turning;
  c.kn = near_set(call->normal_stiffness);
  c.kt = near_set(call->tangential_stiffness);
  c.kt_dt = near_set(call->tangential_stiffness * dt);
  c.mu = near_set(call->friction);
  c.dt = near_set(dt);
  c.gn = near_set(call->normal_viscosity);
  c.gt = near_set(call->tangential_viscosity);
  c.gc = near_set(call->critical_viscosity);
  c.bond = near_set(rve_bond_force_factor(call, head->temperature));
  c.bond_ratio = near_set(call->bond_shear_ratio);
  return c;
}

/* Coulomb's cap, mu |fn|. Springs alone push wherever grains touch; what other lanes get is dropped later. */
RVE_FN rve_near rve_cap(RveFeatures ft, const RveContactPass *c, rve_near fn) {
  return c->mu * (ft.viscous || ft.bonds ? near_abs(fn) : fn);
}

/* Tangential part: history, Coulomb's cap (or the bond), dashpot. stick: lanes that an intact bond exempts from the
 * cap. Follows LIGGGHTS' `tangential history`: the dashpot acts on contacts that do not slide and is outside the cap.
 */
RVE_FN void rve_tangential_2d(RveFeatures ft, const RveContactPass *c, near_mask touch, near_mask bonded, rve_near trial,
                              rve_near vt, rve_near fn, rve_near gt, rve_near *spring, rve_near *total, rve_near *slip,
                              rve_near *loss) {
  const rve_near zero = near_set(0.0), cap = rve_cap(ft, c, fn);
  rve_near f = near_min(near_max(trial, zero - cap), cap);
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

RVE_FN void rve_tangential_3d(RveFeatures ft, const RveContactPass *c, near_mask touch, near_mask bonded,
                              const rve_near trial[3], rve_near size2, const rve_near vt[3], rve_near fn, rve_near gt,
                              rve_near spring[3], rve_near total[3], rve_near *slip, rve_near *loss) {
  const rve_near one = near_set(1.0), cap = rve_cap(ft, c, fn);
  rve_near factor = near_min(one, cap * near_inverse_sqrt(size2 + near_set(NEAR_TINY)));
  if (ft.bonds) factor = near_select(bonded, one, factor);
  factor = near_keep(touch, factor);
  *slip = *slip + (one - factor) * factor * size2;
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

/* Tangential force if nothing slid: history turned with the flow, plus the step's relative motion, in the tangent
 * plane. In: u, relative velocity of the centres; out: u, of the surfaces and tangential (2D: u[0]; 3D: only if a
 * dashpot asks). Returns |trial|^2. */
RVE_FN rve_near rve_trial(RveFeatures ft, const RveContactPass *c, const RveArrays *a, const RveNearBody *own,
                          const RveNearBody *other, int lane0, rve_near lever, rve_near other_lever, const rve_near n[3],
                          rve_near u[3], rve_near trial[3]) {
  rve_near w[3], old[3];
  for (int k = 0; k < rve_spins(ft); k++) {
    w[k] = lever * own->w[k] + other_lever * other->w[k];
    old[k] = near_load(a->shear[k], lane0);
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
  const rve_near cross[3] = {w[1] * n[2] - w[2] * n[1], w[2] * n[0] - w[0] * n[2], w[0] * n[1] - w[1] * n[0]};
  for (int k = 0; k < 3; k++) u[k] = u[k] - cross[k], trial[k] = trial[k] + c->kt_dt * u[k];
  const rve_near along = near_dot(3, trial, n);
  for (int k = 0; k < 3; k++) trial[k] = trial[k] - along * n[k];
  if (ft.viscous) {
    const rve_near normal = near_dot(3, u, n);
    for (int k = 0; k < 3; k++) u[k] = u[k] - normal * n[k];
  }
  return near_dot(3, trial, trial);
}

/* Bonds of one row: which lanes are still bonded. Broken ones are forgotten at once. */
RVE_FN near_mask rve_test_bonds(const RveContactPass *c, const RveArrays *a, int lane0, near_image image, near_mask bonded,
                               rve_near overlap, rve_near radii, rve_near trial2) {
  const near_mask broken = rve_breaking(c, bonded, overlap, radii, trial2);
  if (near_any(broken)) near_store_image(a->image, lane0, near_image_clear(broken, image, RVE_IMAGE_BOND));
  return near_and_not(bonded, broken);
}

/* One row of slots: forces, history, work. */
RVE_FN RvePair rve_contact(RveFeatures ft, const RveContactPass *c, const RveArrays *a, const RveNearBody *own, int lane0,
                           rve_near *slip, rve_near *loss) {
  const int dim = ft.dimension;
  const RveNearBody other = near_neighbour_body(ft, a, lane0);
  const near_image image = near_load_image(a->image, lane0);
  const rve_near zero = near_set(0.0), half = near_set(0.5);
  rve_near d[3], n[3], u[3];
  near_branch(dim, c->h, own->s, other.s, image, d);
  const rve_near square = near_dot(dim, d, d), inverse = near_inverse_sqrt(square), distance = square * inverse;
  const rve_near radii = own->r + other.r, overlap = radii - distance;
  for (int k = 0; k < dim; k++) n[k] = d[k] * inverse;
  near_mask touch = near_less(zero, overlap), bonded = touch;
  if (ft.bonds) bonded = near_image_any(image, RVE_IMAGE_BOND);
  rve_near fn = c->kn * overlap, gt = zero;
  if (ft.tangential || ft.viscous)
    for (int k = 0; k < dim; k++) {
      u[k] = other.v[k] - own->v[k] + c->rate[3 * k] * d[0] + c->rate[3 * k + 1] * d[1];
      if (dim == 3) u[k] = u[k] + c->rate[3 * k + 2] * d[2];
    }
  if (ft.viscous) {
    const rve_near effective = own->m * other.m / (own->m + other.m);
    const rve_near opening = near_dot(dim, u, n), gn = c->gn * effective + c->gc * near_sqrt(effective);
    fn = fn - gn * opening;
    *loss = *loss + near_keep(ft.bonds ? near_or(touch, bonded) : touch, gn * opening * opening);
    gt = c->gt * effective;
  }
  RvePair p;
  rve_near total[3];
  if (ft.tangential) {
    const rve_near lever = own->r - half * overlap, other_lever = other.r - half * overlap;
    rve_near trial[3], spring[3];
    const rve_near trial2 = rve_trial(ft, c, a, own, &other, lane0, lever, other_lever, n, u, trial);
    if (ft.bonds) {
      bonded = rve_test_bonds(c, a, lane0, image, bonded, overlap, radii, trial2);
      touch = near_or(touch, bonded);
    }
    if (dim == 2) {
      rve_tangential_2d(ft, c, touch, bonded, trial[0], u[0], fn, gt, spring, total, slip, loss);
      p.torque[0] = lever * total[0];
      p.other_torque[0] = other_lever * total[0];
    } else {
      rve_tangential_3d(ft, c, touch, bonded, trial, trial2, u, fn, gt, spring, total, slip, loss);
      const rve_near cross[3] = {n[1] * total[2] - n[2] * total[1], n[2] * total[0] - n[0] * total[2],
                                 n[0] * total[1] - n[1] * total[0]};
      for (int k = 0; k < 3; k++) p.torque[k] = lever * cross[k], p.other_torque[k] = other_lever * cross[k];
    }
    for (int k = 0; k < rve_spins(ft); k++) near_store(a->shear[k], lane0, spring[k]);
  } else if (ft.bonds) {
    touch = near_or(touch, rve_test_bonds(c, a, lane0, image, bonded, overlap, radii, zero));
  }
  fn = near_keep(touch, fn);
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

/* All contacts. dt = 0: forces of the present state, histories do not grow. slip: J times kt; loss: W of the dashpots.
 */
RVE_FN void rve_contact_pass(RveFeatures ft, const RveTeam *team, const RveCall *call, const RveHead *head, double dt,
                             const RveCounts *n, const RveArrays *a, rve_real *slip, rve_real *loss) {
  const RveContactPass c = rve_contact_pass_of(call, head, dt);
  rve_near slid = near_set(0.0), lost = near_set(0.0);
  for (int block = team->pack; block < n->blocks; block += team->packs) {
    const int lane0 = block * RVE_PACK, last = a->slot_first[block + 1];
    const RveNearBody own = near_own_body(ft, a, lane0);
    const int spins = ft.tangential ? rve_spins(ft) : 0;
    rve_near force[3], torque[3];
    for (int k = 0; k < 3; k++) force[k] = torque[k] = near_set(0.0);
    for (int row = a->slot_first[block]; row < last; row++) {
      const RvePair p = rve_contact(ft, &c, a, &own, row * RVE_PACK, &slid, &lost);
      near_write_reaction(ft, n, a, row * RVE_PACK, &p);
      for (int k = 0; k < ft.dimension; k++) force[k] = force[k] + p.force[k];
      for (int k = 0; k < spins; k++) torque[k] = torque[k] + p.torque[k];
    }
    for (int k = 0; k < ft.dimension; k++) near_store(a->force[k], lane0, force[k]);
    for (int k = 0; k < spins; k++) near_store(a->torque[k], lane0, torque[k]);
  }
  *slip = *slip + near_sum_wide(slid);
  *loss = *loss + near_sum_wide(lost);
}

/* ------------------------------------------------------------------------------------------------------ move pass */

RVE_FN rve_real rve_sign_like(rve_real magnitude, rve_real power) { /* +magnitude where power >= 0 */
  return rve_select(rve_less(power, rve_set(0.0)), rve_set(0.0) - magnitude, magnitude);
}

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
  for (int span = team->pack; span < n->blocks * RVE_PARTS; span += team->packs) {
    const int lane0 = span * RVE_SPAN;
    rve_real f[3], t[3];
    RveBody b, old;
    rve_sum_reactions(ft, n, a, lane0, f, t);
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
