// SPDX-License-Identifier: GPL-2.0-or-later
// Per-particle output of fix mpm/couple: strain measures against closed forms.
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

extern "C" {
#include <cmocka.h>
}

#include "base/tensor.h"
#include "fix_mpm_couple/point_output.h"

using namespace LAMMPS_NS;

#define assert_near(a, b, tolerance) assert_true(fabs((a) - (b)) <= (tolerance))

static void rotation_about_z(double angle, double r[9]) {
  tensor_identity(r);
  r[0] = r[4] = cos(angle);
  r[1] = -(r[3] = sin(angle));
}

// A stretch R diag R^T has the logarithms of its diagonal as principal strains.
static void logarithmic_strain_of_a_stretch_is_its_logarithm(void **) {
  const double stretch[9] = {1.5, 0, 0, 0, 0.5, 0, 0, 0, 2.0};
  double r[9], rd[9], rt[9], f[9], strain[9], expected[9], product[9];
  rotation_about_z(0.7, r);
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) rt[3 * i + j] = r[3 * j + i];
  tensor_multiply(r, stretch, rd);
  tensor_multiply(rd, rt, f);
  logarithmic_strain(f, strain);
  const double logarithm[9] = {log(1.5), 0, 0, 0, log(0.5), 0, 0, 0, log(2.0)};
  tensor_multiply(r, logarithm, product);
  tensor_multiply(product, rt, expected);
  for (int k = 0; k < 9; k++) assert_near(strain[k], expected[k], 1e-14);  // round-off of the eigenvalues
}

// F R for any rotation R gives the same strain; the printed measure (eq. 47) does not have this.
static void logarithmic_strain_does_not_see_rotation(void **) {
  const double shear[9] = {1, 0.8, 0.1, 0, 1.1, 0.3, 0.2, 0, 0.9};
  double r[9], f[9], one[9], other[9];
  rotation_about_z(1.2, r);
  tensor_multiply(shear, r, f);
  logarithmic_strain(shear, one);
  logarithmic_strain(f, other);
  for (int k = 0; k < 9; k++) assert_near(one[k], other[k], 1e-14);
}

// Simple shear g: F F^T has the eigenvalues exp(+-2 asinh(g/2)), hence |e_1 - e_2| = 2 asinh(g/2). Eq. 47 gives g.
static void deviatoric_strain_of_simple_shear(void **) {
  MpmPoint point;
  memset(&point, 0, sizeof point);
  double column[OUTPUT_COLUMNS];
  for (double g = -3.0; g <= 3.0; g += 0.25) {
    tensor_identity(point.deformation_gradient);
    point.deformation_gradient[1] = g;
    point_output(point, 2, column);
    assert_near(column[OUTPUT_DEVIATORIC_STRAIN], fabs(g), 1e-14);
    assert_near(column[OUTPUT_DEVIATORIC_LOG_STRAIN], 2.0 * asinh(fabs(g) / 2.0), 1e-13);
    assert_near(column[OUTPUT_VOLUME_RATIO], 1.0, 1e-15);
  }
}

// Uniaxial strain e in 3D: sqrt(2/3 e:e) of the deviator is 2/3 e (eq. 48, n = 3); of an isotropic strain nothing.
static void deviatoric_strain_in_space(void **) {
  const double uniaxial[9] = {0.03, 0, 0, 0, 0, 0, 0, 0, 0}, isotropic[9] = {0.03, 0, 0, 0, 0.03, 0, 0, 0, 0.03};
  assert_near(deviatoric_strain(uniaxial, 3), 0.02, 1e-16);
  assert_near(deviatoric_strain(isotropic, 3), 0.0, 1e-16);
  assert_near(deviatoric_strain(uniaxial, 2), 0.03, 1e-16);
}

static void stress_measures(void **) {
  MpmPoint point;
  memset(&point, 0, sizeof point);
  tensor_identity(point.deformation_gradient);
  point.volume0 = 2.0;
  point.deformation_gradient[0] = 1.5;
  const double stress[6] = {-3.0, -1.0, -2.0, 1.0, 0.0, 0.0};
  memcpy(point.stress, stress, sizeof stress);
  double column[OUTPUT_COLUMNS];
  point_output(point, 2, column);
  assert_near(column[OUTPUT_PRESSURE], 2.0, 1e-15);
  assert_near(column[OUTPUT_DEVIATORIC_STRESS], sqrt(8.0), 1e-15);  // sqrt((-3 + 1)^2 + (2 * 1)^2)
  assert_near(column[OUTPUT_VOLUME], 3.0, 1e-15);
  point_output(point, 3, column);
  assert_near(column[OUTPUT_PRESSURE], 2.0, 1e-15);
  assert_near(column[OUTPUT_DEVIATORIC_STRESS], sqrt(1.5 * (1 + 1 + 2)), 1e-15);
}

int main() {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(logarithmic_strain_of_a_stretch_is_its_logarithm),
      cmocka_unit_test(logarithmic_strain_does_not_see_rotation),
      cmocka_unit_test(deviatoric_strain_of_simple_shear),
      cmocka_unit_test(deviatoric_strain_in_space),
      cmocka_unit_test(stress_measures),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
