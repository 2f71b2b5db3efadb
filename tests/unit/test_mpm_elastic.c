/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The thermo-elastic law and the update of the deformation gradient. */
#include "mpm_help.h"

#include "base/tensor.h"
#include "mpm/mpm_deform.h"

/* One update of one point; stress in and out. */
static void update(const MpmElastic *elastic, const double l[9], double dt, double heating, double stress[6],
                   double *modulus, double *energy) {
  MpmLaw law;
  OK(mpm_elastic_create(elastic, &law));
  const int64_t tag = 1;
  const double temperature = 0.0, rate = heating / dt;
  double f[9], heat = 0.0, conductivity[6], scalars[MPM_LAW_SCALARS];
  tensor_identity(f);
  MpmLawBatch batch = {1, dt, &tag, l, f, &temperature, &rate, stress, &heat, conductivity, modulus, scalars};
  OK(law.update(law.content, &batch));
  *energy = scalars[MPM_LAW_ENERGY_DENSITY];
  law.destroy(law.content);
}

static void each_mode_has_its_moduli_and_thermal_stress(void **state) {
  (void)state;
  const double young = 3.0, nu = 0.2, beta = 1e-2, strain[9] = {1e-3, 0, 0, 0, 0, 0, 0, 0, 0};
  const double lambda = young * nu / ((1 + nu) * (1 - 2 * nu)), mu = young / (2 * (1 + nu));
  /* xx, yy, zz of a unit strain xx, and the thermal stress per K (errata A.4, A.5). */
  const double stiffness[4][3] = {{lambda + 2 * mu, lambda, lambda}, {lambda + 2 * mu, lambda, lambda},
                                  {young / (1 - nu * nu), young * nu / (1 - nu * nu), 0}, {young, 0, 0}};
  const double gamma = young * beta / (1 - 2 * nu), plane = young * beta / (1 - nu), bar = young * beta;
  const double thermal[4][3] = {{gamma, gamma, gamma}, {gamma, gamma, gamma}, {plane, plane, 0}, {bar, 0, 0}};
  for (int mode = 0; mode < 4; mode++) {
    const MpmElastic elastic = {
        .mode = (MpmElasticMode)mode, .young = young, .poisson = mode == 3 ? 0.0 : nu, .expansion = beta, .thermal = 1};
    double stress[6] = {0}, modulus, energy;
    update(&elastic, strain, 1.0, 0.0, stress, &modulus, &energy);
    for (int i = 0; i < 3; i++) AT_MOST(fabs(stress[i] - stiffness[mode][i] * 1e-3), 1e-17);
    AT_MOST(fabs(modulus - stiffness[mode][0]), 1e-15);
    AT_MOST(fabs(energy - 0.5 * stress[0] * 1e-3), 1e-19); /* W = 1/2 sigma : eps */
    memset(stress, 0, sizeof stress);
    const double rest[9] = {0};
    update(&elastic, rest, 1.0, 2.0, stress, &modulus, &energy);
    for (int i = 0; i < 3; i++) AT_MOST(fabs(stress[i] + 2.0 * thermal[mode][i]), 1e-15);
  }
}

/* One turn in 1,000 steps: the stress comes back, its principal values never change (a first-order spin term gains 2
 * %). */
static void stress_turns_with_the_body(void **state) {
  (void)state;
  const MpmElastic elastic = {.mode = MPM_ELASTIC_3D, .young = 1.0, .poisson = 0.3};
  const double axis[3] = {0.6, 0.0, 0.8}, rate = 2.0 * PI / 1000;
  const double spin[9] = {
      0, -rate * axis[2], rate * axis[1], rate * axis[2], 0, -rate * axis[0], -rate * axis[1], rate * axis[0], 0};
  const double start[6] = {1, -2, 3, 0.5, -0.25, 0.125};
  double stress[6], modulus, energy, first_energy = 0.0;
  memcpy(stress, start, sizeof start);
  for (int s = 0; s < 1000; s++) {
    update(&elastic, spin, 1.0, 0.0, stress, &modulus, &energy);
    if (s == 0) first_energy = energy;
  }
  AT_MOST(fabs(energy / first_energy - 1.0), 1e-12); /* round-off of 1,000 products */
  /* The Cayley angle per step lacks rate^3 / 12: 1.3e-4 rad... of a turn in all 2e-5. */
  for (int k = 0; k < 6; k++) AT_MOST(fabs(stress[k] - start[k]), 4.0 * 1000 * rate * rate * rate / 12);
}

/* The direction of rotation: a bar under sigma_xx that turns counterclockwise by a quarter carries it as sigma_yy; on
 * the way sigma_xy > 0. */
static void the_jaumann_rate_has_the_right_sense(void **state) {
  (void)state;
  const MpmElastic elastic = {.mode = MPM_ELASTIC_PLANE_STRESS, .young = 1.0, .poisson = 0.3};
  const double angle = PI / 4, counterclockwise[9] = {0, -angle / 100, 0, angle / 100, 0, 0, 0, 0, 0};
  double stress[6] = {1, 0, 0, 0, 0, 0}, modulus, energy;
  for (int s = 0; s < 100; s++) update(&elastic, counterclockwise, 1.0, 0.0, stress, &modulus, &energy);
  AT_MOST(fabs(stress[0] - 0.5), 1e-5);
  AT_MOST(fabs(stress[1] - 0.5), 1e-5);
  AT_MOST(fabs(stress[3] - 0.5), 1e-5);
}

static void deformation_equals_the_exponential_and_does_not_drift(void **state) {
  (void)state;
  uint64_t seed = 9;
  for (int n = 0; n < 3000; n++) {
    const double size = pow(10.0, -6.0 + 6.5 * base_random(&seed));
    double l[9], plane[9], f[9], g[9], e[9], expected[9];
    for (int k = 0; k < 9; k++) l[k] = size * (2.0 * base_random(&seed) - 1.0);
    tensor_identity(f);
    mpm_deform(l, 1.0, 3, f);
    tensor_exponential(l, 1.0, e);
    for (int k = 0; k < 9; k++) AT_MOST(fabs(f[k] - e[k]), 1e-14 * fmax(1.0, e[0] + e[4] + e[8] + 10.0 * size));
    memcpy(plane, l, sizeof l);
    plane[2] = plane[5] = plane[6] = plane[7] = plane[8] = 0.0;
    for (int k = 0; k < 9; k++) g[k] = k < 6 ? l[k] + (k % 4 == 0) : (k == 8);
    g[2] = g[5] = 0.0;
    tensor_exponential(plane, 1.0, e);
    tensor_multiply(e, g, expected);
    mpm_deform(plane, 1.0, 2, g);
    for (int k = 0; k < 9; k++)
      AT_MOST(fabs(g[k] - expected[k]),
              3e-14 * fmax(1.0, expected[0] * expected[0] + expected[4] * expected[4] + size * 10.0));
  }
  double f[9], h[9];
  tensor_identity(f), tensor_identity(h);
  const double turn = 2.0 * PI / 1000, spin[9] = {0, -turn, 0, turn, 0, 0, 0, 0, 0};
  const double solid[9] = {0, -0.6 * turn, 0.64 * turn, 0.6 * turn, 0, -0.48 * turn, -0.64 * turn, 0.48 * turn, 0};
  for (int s = 0; s < 1000; s++) mpm_deform(spin, 1.0, 2, f), mpm_deform(solid, 1.0, 3, h);
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) AT_MOST(fabs(f[3 * i + j] - (i == j)), 1e-12); /* A4 */
  AT_MOST(fabs(tensor_determinant(f) - 1.0), 1e-12);
  AT_MOST(fabs(tensor_determinant(h) - 1.0), 1e-12);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(each_mode_has_its_moduli_and_thermal_stress),
      cmocka_unit_test(stress_turns_with_the_body),
      cmocka_unit_test(the_jaumann_rate_has_the_right_sense),
      cmocka_unit_test(deformation_equals_the_exponential_and_does_not_drift),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
