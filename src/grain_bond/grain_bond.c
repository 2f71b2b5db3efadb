/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "grain_bond.h"

#include <math.h>

static double dot(const double a[3], const double b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

double grain_bond_strength(const GrainBondLaw *law, double temperature) {
  if (isinf(law->melting)) return law->strength;
  return law->strength * fmin(fmax((law->melting - temperature) / (law->melting - law->reference), 0.0), 1.0);
}

static GrainBondEnd find_end(const GrainBondLaw *law, const GrainBondSprings *springs, const GrainMotion *motion,
                             double temperature, const GrainBondState *state) {
  const double strength = grain_bond_strength(law, temperature);
  const double tension = strength * springs->normal * 0.5 * (motion->radius[0] + motion->radius[1]);
  const double shear = springs->tangential * sqrt(dot(state->spring, state->spring));
  const int pulled = -springs->normal * state->approach > tension, sheared = shear > law->shear_ratio * tension;
  if (!pulled && !sheared) return GRAIN_BOND_HOLDS;
  return strength == 0.0 ? GRAIN_BOND_MELTED : pulled ? GRAIN_BOND_PULLED : GRAIN_BOND_SHEARED;
}

GrainBondEnd grain_bond_advance(const GrainBondLaw *law, const GrainBondSprings *springs, const GrainMotion *motion,
                                const GrainBond *bond, double temperature, double step, GrainBondState *state) {
  const double distance = sqrt(dot(motion->branch, motion->branch));
  state->separation = grain_tangential_velocity(motion, distance, state->normal, state->velocity);
  state->overlap = motion->radius[0] + motion->radius[1] - distance;
  state->approach = bond->gap + state->overlap;
  state->arm = motion->radius[0] - 0.5 * state->overlap;
  for (int a = 0; a < 3; a++) state->spring[a] = bond->spring[a] + state->velocity[a] * step;
  if (step > 0.0) {
    const double along = dot(state->spring, state->normal);
    for (int a = 0; a < 3; a++) state->spring[a] -= along * state->normal[a];
  }
  return find_end(law, springs, motion, temperature, state);
}

void grain_bond_force(const GrainBondSprings *springs, const GrainBond *bond, const GrainBondState *state, int shared,
                      double force[3], double torque[3]) {
  double along = springs->normal * bond->gap, tangential[3];
  if (!shared) along = springs->normal * state->approach - springs->normal_damping * state->separation;
  const double dashpot = shared ? 0.0 : springs->tangential_damping;
  const double *n = state->normal;
  for (int a = 0; a < 3; a++) {
    tangential[a] = -springs->tangential * state->spring[a] - dashpot * state->velocity[a];
    force[a] = along * n[a] + tangential[a];
  }
  for (int a = 0; a < 3; a++) {
    const int b = (a + 1) % 3, c = (a + 2) % 3;
    torque[a] = -state->arm * (n[b] * tangential[c] - n[c] * tangential[b]);
  }
}

double grain_bond_damping_work(const GrainBondSprings *springs, const GrainBondState *state, double mass, double step) {
  const double half = 0.5 * step / mass, force = springs->normal * state->approach;
  const double parting = state->separation, across = springs->tangential_damping;
  double power =
      springs->normal_damping * parting * (parting + half * (force - springs->normal_damping * parting));
  for (int a = 0; a < 3; a++) {
    const double back = -springs->tangential * state->spring[a] - across * state->velocity[a];
    power += across * state->velocity[a] * (state->velocity[a] + 3.5 * half * back);
  }
  return power * step;
}

double grain_bond_energy(const GrainBondSprings *springs, const GrainBond *bond, const GrainBondState *state,
                         int shared) {
  double square = state->approach * state->approach;
  if (shared) square = bond->gap * (bond->gap + 2.0 * state->overlap);
  return 0.5 * (springs->normal * square + springs->tangential * dot(state->spring, state->spring));
}
