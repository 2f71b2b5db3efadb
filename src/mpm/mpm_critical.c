/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Critical time steps (TM-DEMPM eq. 30-31 corrected). */
#include <math.h>

#include "../base/tensor.h"
#include "mpm_core.h"

static const double MECHANICAL_FACTOR = 0.5;
static const double THERMAL_B = 2.0;

/* Largest eigenvalue of a symmetric tensor [6], by the trigonometric form of the cubic's roots. */
static double largest_eigenvalue(const double a[6]) {
  const double mean = (a[TENSOR_XX] + a[TENSOR_YY] + a[TENSOR_ZZ]) / 3.0;
  const double x = a[TENSOR_XX] - mean, y = a[TENSOR_YY] - mean, z = a[TENSOR_ZZ] - mean;
  const double xy = a[TENSOR_XY], xz = a[TENSOR_XZ], yz = a[TENSOR_YZ];
  const double size = sqrt((x * x + y * y + z * z + 2.0 * (xy * xy + xz * xz + yz * yz)) / 6.0);
  if (!(size > 0.0)) return mean;
  const double third = x * (y * z - yz * yz) - xy * (xy * z - yz * xz) + xz * (xy * yz - y * xz);
  const double cosine = fmax(-1.0, fmin(1.0, 0.5 * third / (size * size * size)));
  return mean + 2.0 * size * cos(acos(cosine) / 3.0);
}

void mpm_critical_time_steps(const Mpm *mpm, const MpmPoint *points, int count, double *mechanical, double *thermal) {
  const MpmScene *scene = &mpm->scene;
  *mechanical = *thermal = INFINITY;
  for (int p = 0; p < count; p++) {
    const MpmPoint *point = &points[p];
    const double volume = point->volume0 * tensor_determinant(point->deformation_gradient);
    if (scene->mechanical) {
      double square = 0.0;
      for (int i = 0; i < scene->dimension; i++) square += point->velocity[i] * point->velocity[i];
      const double speed = sqrt(fmax(point->modulus, 0.0) * volume / point->mass) + sqrt(square);
      if (speed > 0.0) *mechanical = fmin(*mechanical, MECHANICAL_FACTOR * scene->spacing / speed);
    }
    if (scene->thermal) {
      const double conductivity = largest_eigenvalue(point->conductivity);
      const double capacity = point->mass * point->heat_capacity / volume;
      if (conductivity > 0.0)
        *thermal = fmin(*thermal, capacity * scene->spacing * scene->spacing / (THERMAL_B * conductivity));
    }
  }
}
