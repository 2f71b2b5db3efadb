/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "point_output.h"

#include <cmath>
#include <cstring>

#include "../base/tensor.h"

using namespace LAMMPS_NS;

/* Sum of squares of the deviator. */
static double deviator_squared(const double a[9]) {
  const double mean = (a[0] + a[4] + a[8]) / 3.0;
  double sum = 0.0;
  for (int k = 0; k < 9; k++) {
    const double e = a[k] - (k % 4 == 0 ? mean : 0.0);
    sum += e * e;
  }
  return sum;
}

/* Difference of the principal values in the plane. */
static double principal_difference(const double a[9]) { return hypot(a[0] - a[4], a[1] + a[3]); }

double LAMMPS_NS::deviatoric_strain(const double strain[9], int dimension) {
  return dimension == 2 ? principal_difference(strain) : sqrt(2.0 / 3.0 * deviator_squared(strain));
}

/* One Jacobi rotation in the plane (p, q): a = R^T a R without its entry pq, v = v R. */
static void jacobi_rotate(double a[9], double v[9], int p, int q) {
  if (fabs(a[3 * p + q]) <= 1e-17 * (fabs(a[4 * p]) + fabs(a[4 * q]))) return; /* round-off */
  const double theta = 0.5 * (a[4 * q] - a[4 * p]) / a[3 * p + q];
  const double t = (theta < 0.0 ? -1.0 : 1.0) / (fabs(theta) + hypot(theta, 1.0));
  const double c = 1.0 / hypot(t, 1.0), s = t * c;
  for (int k = 0; k < 3; k++) {
    const double kp = a[3 * k + p], kq = a[3 * k + q];
    a[3 * k + p] = c * kp - s * kq, a[3 * k + q] = s * kp + c * kq;
  }
  for (int k = 0; k < 3; k++) {
    const double pk = a[3 * p + k], qk = a[3 * q + k];
    a[3 * p + k] = c * pk - s * qk, a[3 * q + k] = s * pk + c * qk;
  }
  for (int k = 0; k < 3; k++) {
    const double kp = v[3 * k + p], kq = v[3 * k + q];
    v[3 * k + p] = c * kp - s * kq, v[3 * k + q] = s * kp + c * kq;
  }
}

void LAMMPS_NS::logarithmic_strain(const double f[9], double strain[9]) {
  double b[9], v[9];
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++)
      b[3 * i + j] = f[3 * i] * f[3 * j] + f[3 * i + 1] * f[3 * j + 1] + f[3 * i + 2] * f[3 * j + 2];
  tensor_identity(v);
  for (int sweep = 0; sweep < 10; sweep++) /* quadratic: 5 sweeps reach round-off, further ones cost nothing */
    jacobi_rotate(b, v, 0, 1), jacobi_rotate(b, v, 0, 2), jacobi_rotate(b, v, 1, 2);
  memset(strain, 0, 9 * sizeof *strain);
  for (int n = 0; n < 3; n++)
    for (int i = 0; i < 3; i++)
      for (int j = 0; j < 3; j++) strain[3 * i + j] += 0.5 * log(b[4 * n]) * v[3 * i + n] * v[3 * j + n];
}

static void stress_output(const double s[6], int dimension, double *column) {
  const double full[9] = {s[0], s[3], s[4], s[3], s[1], s[5], s[4], s[5], s[2]};
  memcpy(column + OUTPUT_STRESS, s, 6 * sizeof *s);
  column[OUTPUT_PRESSURE] = dimension == 2 ? -0.5 * (s[0] + s[1]) : -(s[0] + s[1] + s[2]) / 3.0;
  column[OUTPUT_DEVIATORIC_STRESS] = dimension == 2 ? principal_difference(full) : sqrt(1.5 * deviator_squared(full));
}

void LAMMPS_NS::point_output(const MpmPoint &point, int dimension, double column[OUTPUT_COLUMNS]) {
  const double *f = point.deformation_gradient;
  double strain[9];
  stress_output(point.stress, dimension, column);
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) strain[3 * i + j] = 0.5 * (f[3 * i + j] + f[3 * j + i]) - (i == j);
  column[OUTPUT_DEVIATORIC_STRAIN] = deviatoric_strain(strain, dimension);
  logarithmic_strain(f, strain);
  column[OUTPUT_DEVIATORIC_LOG_STRAIN] = deviatoric_strain(strain, dimension);
  column[OUTPUT_VOLUME_RATIO] = tensor_determinant(f);
  column[OUTPUT_VOLUME] = point.volume0 * column[OUTPUT_VOLUME_RATIO];
  column[OUTPUT_TEMPERATURE] = point.temperature_mapped;
  column[OUTPUT_HEAT] = point.heat;
  column[OUTPUT_SOLID_FRACTION] = point.scalars[MPM_LAW_SOLID_FRACTION];
  column[OUTPUT_COORDINATION] = point.scalars[MPM_LAW_COORDINATION];
  column[OUTPUT_BOND_FRACTION] = point.scalars[MPM_LAW_BOND_FRACTION];
  column[OUTPUT_UNBALANCED] = point.scalars[MPM_LAW_UNBALANCED];
  column[OUTPUT_ENERGY_DENSITY] = point.scalars[MPM_LAW_ENERGY_DENSITY];
  column[OUTPUT_DISSIPATION] = point.scalars[MPM_LAW_DISSIPATION];
  memcpy(column + OUTPUT_DEFORMATION_GRADIENT, f, 9 * sizeof *f);
  column[OUTPUT_NUMBER] = (double)point.tag;
}
