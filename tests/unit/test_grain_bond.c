/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The law of a bond: strength over temperature, ends, forces seen from both grains, force as the slope of the energy.
 */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "grain_bond/grain_bond.h"

static const GrainBondLaw law = {0.1, 0.5, 400.0, 300.0};
static const GrainBondSprings springs = {1e5, 8e4, 20.0, 10.0};

static GrainMotion pair(double distance) {
  return (GrainMotion){{0.005, 0.004},
                       {0.6 * distance, 0.0, 0.8 * distance},
                       {{0.1, -0.2, 0.3}, {-0.4, 0.2, 0.1}},
                       {{7.0, 1.0, -2.0}, {3.0, -4.0, 5.0}}};
}

static GrainMotion reversed(GrainMotion m) {
  GrainMotion other = m;
  for (int g = 0; g < 2; g++) {
    other.radius[g] = m.radius[1 - g];
    for (int a = 0; a < 3; a++) other.velocity[g][a] = m.velocity[1 - g][a], other.spin[g][a] = m.spin[1 - g][a];
  }
  for (int a = 0; a < 3; a++) other.branch[a] = -m.branch[a];
  return other;
}

static void strength_falls_between_reference_and_melting(void **state) {
  (void)state;
  const double at[][2] = {{-1e3, 0.1}, {300.0, 0.1}, {325.0, 0.075}, {400.0, 0.0}, {1e9, 0.0}};
  for (size_t k = 0; k < sizeof at / sizeof *at; k++)
    assert_float_equal(grain_bond_strength(&law, at[k][0]), at[k][1], 1e-16);
  const GrainBondLaw solid = {0.1, 0.5, INFINITY, 0.0};
  assert_float_equal(grain_bond_strength(&solid, 1e9), 0.1, 0.0);
}

static void bonds_end_by_tension_shear_and_melting(void **state) {
  (void)state;
  GrainMotion motion = {{0.005, 0.004}, {0.009, 0.0, 0.0}, {{0}}, {{0}}};
  const double stretch = 0.1 * 0.0045, shear = 0.5 * 1e5 * stretch / 8e4;
  const struct {
    double gap, along, across, temperature;
    GrainBondEnd end;
  } cases[] = {{0.0, 0.999 * stretch, 0.0, 300.0, GRAIN_BOND_HOLDS},
               {0.0, 1.001 * stretch, 0.0, 300.0, GRAIN_BOND_PULLED},
               {0.0, -10.0 * stretch, 0.0, 300.0, GRAIN_BOND_HOLDS},
               {1e-4, 0.999 * stretch + 1e-4, 0.0, 300.0, GRAIN_BOND_HOLDS},
               {1e-4, 1.001 * stretch + 1e-4, 0.0, 300.0, GRAIN_BOND_PULLED},
               {0.0, 0.0, 0.999 * shear, 300.0, GRAIN_BOND_HOLDS},
               {0.0, 0.0, 1.001 * shear, 300.0, GRAIN_BOND_SHEARED},
               {0.0, 0.499 * stretch, 0.0, 350.0, GRAIN_BOND_HOLDS},
               {0.0, 0.501 * stretch, 0.0, 350.0, GRAIN_BOND_PULLED},
               {0.0, 0.501 * stretch, 0.501 * shear, 350.0, GRAIN_BOND_PULLED},
               {0.0, 0.0, 0.0, 400.0, GRAIN_BOND_HOLDS},
               {0.0, -stretch, 0.0, 500.0, GRAIN_BOND_HOLDS},
               {0.0, 1e-9, 0.0, 400.0, GRAIN_BOND_MELTED},
               {0.0, -stretch, 1e-9, 400.0, GRAIN_BOND_MELTED}};
  for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
    motion.branch[0] = 0.009 + cases[k].along;
    const GrainBond bond = {cases[k].gap, {0.0, cases[k].across, 0.0}};
    GrainBondState now;
    assert_int_equal(grain_bond_advance(&law, &springs, &motion, &bond, cases[k].temperature, 1e-6, &now),
                     cases[k].end);
  }
}

static void both_grains_see_the_same_bond(void **state) {
  (void)state;
  for (int shared = 0; shared < 2; shared++) {
    const GrainMotion one = pair(shared ? 0.00895 : 0.00905), other = reversed(one);
    const GrainBond bond = {2e-5, {8e-6, 1e-6, -6e-6}}, back = {2e-5, {-8e-6, -1e-6, 6e-6}};
    GrainBondState a, b;
    double force[2][3], torque[2][3], sum[3];
    grain_bond_advance(&law, &springs, &one, &bond, 300.0, 1e-5, &a);
    grain_bond_advance(&law, &springs, &other, &back, 300.0, 1e-5, &b);
    grain_bond_force(&springs, &bond, &a, shared, force[0], torque[0]);
    grain_bond_force(&springs, &back, &b, shared, force[1], torque[1]);
    for (int k = 0; k < 3; k++) assert_true(force[0][k] == -force[1][k] && a.spring[k] == -b.spring[k]);
    /* angular momentum: torques and the moment of the forces about the centre of grain 1 */
    for (int k = 0; k < 3; k++) {
      const int l = (k + 1) % 3, m = (k + 2) % 3;
      sum[k] = torque[0][k] + torque[1][k] + one.branch[l] * force[0][m] - one.branch[m] * force[0][l];
      assert_float_equal(sum[k], 0.0, 1e-15);
    }
  }
}

/* Along the normal, and across it. */
/* Of a bond made in contact: as of a contact that does not slip. */
static void dashpots_work_as_those_of_a_contact(void **state) {
  (void)state;
  const GrainMotion motion = pair(0.0089);
  GrainBond bond = {0.0, {3e-6, 1e-6, -2e-6}};
  GrainBondState now;
  const double step = 1e-5, mass = 1e-3;
  grain_bond_advance(&law, &springs, &motion, &bond, 300.0, step, &now);
  const GrainContact contact = {{1e5, 8e4}, {20.0, 10.0}, mass};
  const double expected = grain_damping_work(&motion, &contact, step, bond.spring, now.spring);
  assert_true(expected > 0.0);
  assert_float_equal(grain_bond_damping_work(&springs, &now, mass, step), expected, 1e-12 * expected);
  /* A gap shortens the bond further: the push along it rises by kn gap, and with it the mean speed. */
  const double before = grain_bond_damping_work(&springs, &now, mass, step);
  bond.gap = 1e-5;
  grain_bond_advance(&law, &springs, &motion, &bond, 300.0, step, &now);
  const double more = 20.0 * now.separation * 0.5 * step / mass * 1e5 * 1e-5 * step;
  assert_float_equal(grain_bond_damping_work(&springs, &now, mass, step), before + more, 1e-12 * expected);
}

static void force_is_the_slope_of_the_energy(void **state) {
  (void)state;
  const GrainBondSprings elastic = {1e5, 8e4, 0.0, 0.0};
  const double h = 1e-8;
  for (int shared = 0; shared < 2; shared++)
    for (int across = 0; across < 2; across++) {
      double energy[2], force[3], torque[3];
      for (int k = 0; k < 3; k++) {
        const double shift = k == 2 ? 0.0 : k == 0 ? h : -h;
        GrainMotion motion = {
            {0.005, 0.004}, {(shared ? 0.00897 : 0.00903) + (across ? 0.0 : shift), 0.0, 0.0}, {{0}}, {{0}}};
        const GrainBond bond = {2e-5, {0.0, 4e-6 + (across ? shift : 0.0), 0.0}};
        GrainBondState now;
        grain_bond_advance(&law, &elastic, &motion, &bond, 300.0, 0.0, &now);
        if (k < 2) energy[k] = grain_bond_energy(&elastic, &bond, &now, shared);
        else grain_bond_force(&elastic, &bond, &now, shared, force, torque);
      }
      assert_float_equal((energy[0] - energy[1]) / (2.0 * h), -force[across], 1e-6);
      assert_true(fabs(force[across]) > 0.1);
    }
}

int main(void) {
  const struct CMUnitTest tests[] = {cmocka_unit_test(strength_falls_between_reference_and_melting),
                                     cmocka_unit_test(bonds_end_by_tension_shear_and_melting),
                                     cmocka_unit_test(both_grains_see_the_same_bond),
                                     cmocka_unit_test(dashpots_work_as_those_of_a_contact),
                                     cmocka_unit_test(force_is_the_slope_of_the_energy)};
  return cmocka_run_group_tests(tests, NULL, NULL);
}
