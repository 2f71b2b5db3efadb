/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Critical time steps (TM-DEMPM eq. 30-31 corrected). */
#include <math.h>

#include "../base/tensor.h"
#include "mpm_core.h"

/* Limit of dt (c + |v|) / h, c = sqrt(M / rho), by shape (linear, uGIMP, B-spline): the smallest over 20 positions of a
 * lattice of points in its cells, with 1 and 2 points per cell and axis, in 2D and 3D, Poisson's ratio 0.2 to 0.45,
 * random velocities, 100 to 1,500 steps without growth of the energy (verification B9). FLIP before or after PIC and
 * XPIC: measured 0.9, 1.6, 1.8, held at 1 so that no wave outruns a cell; APIC 0.2 (its matrix near nodes), 0.7, 0.7;
 * USL: 0.1 (it answers tiny nodal masses with large velocity gradients), 0.5, 0.6. */
static const double LIMIT[2][2][3] = {{{0.9, 1.0, 1.0}, {0.2, 0.7, 0.7}}, {{0.1, 0.5, 0.6}, {0.1, 0.5, 0.6}}};
static const double SAFETY = 0.5;

/* dt < rho c h^2 / (b k): measured b = 0.4 to 0.7 with uGIMP and B-spline in 2D and 3D, 2 is given; linear shape
 * functions need 0.9 to 1.3 with 2 or 3 points per cell and axis, but up to 10 with one, where surface nodes hold
 * little capacity. */
static const double THERMAL_B[3] = {10.0, 2.0, 2.0};

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
  const int is_usl = scene->order == MPM_ORDER_USL, is_apic = scene->transfer == MPM_TRANSFER_APIC;
  const double factor = SAFETY * LIMIT[is_usl][is_apic][scene->shape];
  const double smallest = mpm_smallest_spacing(mpm);
  *mechanical = *thermal = INFINITY;
  for (int p = 0; p < count; p++) {
    const MpmPoint *point = &points[p];
    const double volume = point->volume0 * tensor_determinant(point->deformation_gradient);
    if (scene->mechanical) {
      double square = 0.0;
      for (int i = 0; i < scene->dimension; i++) square += point->velocity[i] * point->velocity[i];
      const double speed = sqrt(fmax(point->modulus, 0.0) * volume / point->mass) + sqrt(square);
      if (speed > 0.0) *mechanical = fmin(*mechanical, factor * smallest / speed);
    }
    if (scene->thermal) {
      const double conductivity = largest_eigenvalue(point->conductivity);
      const double capacity = point->mass * point->heat_capacity / volume;
      if (conductivity > 0.0)
        *thermal =
            fmin(*thermal, capacity * smallest * smallest / (THERMAL_B[scene->shape] * conductivity));
    }
  }
}
