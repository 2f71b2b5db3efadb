/* SPDX-License-Identifier: GPL-2.0-or-later */
/* F <- exp(L dt) F: exact volume change, no drift under rotation (verification A4). Increments of the usual size take
 * series without branches, so that a loop over points runs in vectors; larger ones the general way. Which way a point
 * goes depends on its own increment alone. */
#ifndef DEMPM_MPM_DEFORM_H
#define DEMPM_MPM_DEFORM_H

#include "../base/tensor.h"
#include "mpm_shape.h"

/* exp(x) - its series reaches round-off for |x| < 1/16. */
MPM_INLINE double mpm_exp_small(double x) {
  return 1.0 + x * (1.0 + x * (1.0 / 2 + x * (1.0 / 6 + x * (1.0 / 24 + x * (1.0 / 120 + x * (1.0 / 720 + x *
         (1.0 / 5040 + x * (1.0 / 40320 + x * (1.0 / 362880)))))))));
}

/* Plane: exp(A) = e^s (C I + S (A - s I)) with s = tr A / 2, (A - s I)^2 = z I, C = cosh sqrt z, S = sinh sqrt z / sqrt
 * z, whose series in z reach round-off for |z| < 1/16. */
MPM_INLINE int mpm_is_small_plane(const double l[9], double dt) {
  const double p = 0.5 * dt * (l[0] - l[4]), s = 0.5 * dt * (l[0] + l[4]);
  return (fabs(p * p + dt * l[1] * (dt * l[3])) < 0.0625) & (fabs(s) < 0.0625);
}

MPM_INLINE void mpm_deform_small_plane(const double l[9], double dt, double f[9]) {
  const double a = l[0] * dt, b = l[1] * dt, c = l[3] * dt, d = l[4] * dt;
  const double s = 0.5 * (a + d), p = 0.5 * (a - d), z = p * p + b * c;
  const double grow = mpm_exp_small(s);
  const double even = 1.0 + z * (1.0 / 2 + z * (1.0 / 24 + z * (1.0 / 720 + z * (1.0 / 40320 + z * (1.0 / 3628800)))));
  const double odd = 1.0 + z * (1.0 / 6 + z * (1.0 / 120 + z * (1.0 / 5040 + z * (1.0 / 362880 + z / 39916800))));
  const double e0 = grow * (even + odd * p), e1 = grow * odd * b, e2 = grow * odd * c, e3 = grow * (even - odd * p);
  const double f0 = f[0], f1 = f[1];
  f[0] = e0 * f0 + e1 * f[3], f[1] = e0 * f1 + e1 * f[4];
  f[3] = e2 * f0 + e3 * f[3], f[4] = e2 * f1 + e3 * f[4];
}

/* In the plane only the components xx, xy, yx, yy (0, 1, 3, 4) of L are read and only those of F are changed. */
MPM_INLINE void mpm_deform_plane(const double l[9], double dt, double f[9]) {
  if (mpm_is_small_plane(l, dt)) {
    mpm_deform_small_plane(l, dt, f);
    return;
  }
  const double flat[9] = {l[0], l[1], 0.0, l[3], l[4], 0.0, 0.0, 0.0, 0.0};
  double e[9];
  tensor_exponential(flat, dt, e);
  for (int j = 0; j < 2; j++) {
    const double x = f[j], y = f[3 + j];
    f[j] = e[0] * x + e[1] * y, f[3 + j] = e[3] * x + e[4] * y;
  }
}

/* Space: A = s I + B, s = tr A / 3. B^3 = p B + q I (Cayley and Hamilton) with p = tr B^2 / 2, q = det B, hence exp(B) =
 * c0 I + c1 B + c2 B^2, series in p and q. Up to B^8, as here, they reach round-off for a norm of B below 0.06. */
MPM_INLINE int mpm_is_small_space(const double l[9], double dt) {
  double size = fabs(l[0]);
#pragma GCC unroll 9
  for (int k = 1; k < 9; k++) size = fabs(l[k]) > size ? fabs(l[k]) : size;
  return dt * size < 0.01;
}

MPM_INLINE void mpm_deform_small_space(const double l[9], double dt, double f[9]) {
  const double s = dt * (l[0] + l[4] + l[8]) * (1.0 / 3);
  double b[9], square[9], e[9], old[9];
#pragma GCC unroll 9
  for (int k = 0; k < 9; k++) b[k] = dt * l[k] - (k % 4 == 0 ? s : 0.0), old[k] = f[k];
#pragma GCC unroll 9
  for (int k = 0; k < 9; k++) {
    const int i = 3 * (k / 3), j = k % 3;
    square[k] = b[i] * b[j] + b[i + 1] * b[3 + j] + b[i + 2] * b[6 + j];
  }
  const double p = 0.5 * (square[0] + square[4] + square[8]), q = tensor_determinant(b);
  const double third = q * q + p * p * p;
  const double grow = mpm_exp_small(s);
  const double c0 = grow * (1.0 + q * (1.0 / 6 + p * (1.0 / 120) + q * (1.0 / 720) + p * p * (1.0 / 5040)));
  const double c1 = grow * (1.0 + p * (1.0 / 6) + q * (1.0 / 24) + p * p * (1.0 / 120) + p * q * (1.0 / 360) +
                            third * (1.0 / 5040) + p * p * q * (1.0 / 13440));
  const double c2 = grow * (1.0 / 2 + p * (1.0 / 24) + q * (1.0 / 120) + p * p * (1.0 / 720) + p * q * (1.0 / 2520) +
                            third * (1.0 / 40320));
#pragma GCC unroll 9
  for (int k = 0; k < 9; k++) e[k] = (k % 4 == 0 ? c0 : 0.0) + c1 * b[k] + c2 * square[k];
#pragma GCC unroll 9
  for (int k = 0; k < 9; k++) {
    const int i = 3 * (k / 3), j = k % 3;
    f[k] = e[i] * old[j] + e[i + 1] * old[3 + j] + e[i + 2] * old[6 + j];
  }
}

MPM_INLINE void mpm_deform_space(const double l[9], double dt, double f[9]) {
  if (mpm_is_small_space(l, dt)) {
    mpm_deform_small_space(l, dt, f);
    return;
  }
  double e[9], product[9];
  tensor_exponential(l, dt, e);
  tensor_multiply(e, f, product);
  memcpy(f, product, sizeof product);
}

#endif
