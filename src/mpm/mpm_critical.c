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

/* Limit times (c + |v|), m. */
static double mechanical_reach(const Mpm *mpm) {
  const int is_usl = mpm->scene.order == MPM_ORDER_USL, is_apic = mpm->scene.transfer == MPM_TRANSFER_APIC;
  return SAFETY * LIMIT[is_usl][is_apic][mpm->scene.shape] * mpm_smallest_spacing(mpm);
}

static double sound_speed(double modulus, double volume, double mass) { return sqrt(fmax(modulus, 0.0) * volume / mass); }

static double thermal_limit(const Mpm *mpm, const MpmPoint *point, double volume) {
  const double conductivity = largest_eigenvalue(point->conductivity), smallest = mpm_smallest_spacing(mpm);
  const double capacity = point->mass * point->heat_capacity / volume;
  return conductivity > 0.0 ? capacity * smallest * smallest / (THERMAL_B[mpm->scene.shape] * conductivity) : INFINITY;
}

void mpm_critical_time_steps(const Mpm *mpm, const MpmPoint *points, int count, double *mechanical, double *thermal) {
  const MpmScene *scene = &mpm->scene;
  const double reach = mechanical_reach(mpm);
  *mechanical = *thermal = INFINITY;
  for (int p = 0; p < count; p++) {
    const MpmPoint *point = &points[p];
    const double volume = point->volume0 * tensor_determinant(point->deformation_gradient);
    if (scene->mechanical) {
      double square = 0.0;
      for (int i = 0; i < scene->dimension; i++) square += point->velocity[i] * point->velocity[i];
      const double speed = sound_speed(point->modulus, volume, point->mass) + sqrt(square);
      if (speed > 0.0) *mechanical = fmin(*mechanical, reach / speed);
    }
    if (scene->thermal) *thermal = fmin(*thermal, thermal_limit(mpm, point, volume));
  }
}

/* Only laws that act on rows have their moduli there. */
static double row_modulus(const Mpm *mpm, int k) {
  const MpmPoints *p = &mpm->points;
  if (!mpm_law_is_local(mpm)) return p->home[p->slot[k]].modulus;
  double stress[6], modulus, scalars[MPM_LAW_SCALARS];
  for (int n = 0; n < 6; n++) stress[n] = p->stress[n][k];
  mpm->law->describe(mpm->law->content, stress, &modulus, scalars);
  return modulus;
}

void mpm_critical_attached(Mpm *mpm, double *mechanical, double *thermal) {
  MpmPoints *p = &mpm->points;
  const double reach = mechanical_reach(mpm);
  double fastest = 0.0, least = INFINITY, sound = 0.0;
#pragma omp parallel for num_threads(mpm->threads) if (mpm_is_parallel(mpm)) reduction(max : fastest, sound) \
    reduction(min : least)
  for (int k = 0; k < p->live; k++) {
    const double volume = mpm_row_volume(mpm, k);
    if (mpm->scene.mechanical) {
      const MpmVec v = p->motion[k];
      const double c = sound_speed(row_modulus(mpm, k), volume, p->position[k][0]);
      sound = fmax(sound, c);
      fastest = fmax(fastest, c + sqrt(v[1] * v[1] + v[2] * v[2] + v[3] * v[3]));
    }
    if (mpm->scene.thermal) least = fmin(least, thermal_limit(mpm, &p->home[p->slot[k]], volume));
  }
  *mechanical = fastest > 0.0 ? reach / fastest : INFINITY;
  *thermal = least;
  p->sound = sound, p->sound_age = 0;
}

int mpm_is_below_critical(const Mpm *mpm, double dt) {
  const MpmPoints *p = &mpm->points;
  if (!mpm_law_is_local(mpm) || !mpm->scene.mechanical) return 0;
  return dt * (p->sound * pow(1.01, p->sound_age) + p->fastest) < mechanical_reach(mpm);
}
