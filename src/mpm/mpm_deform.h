/* SPDX-License-Identifier: GPL-2.0-or-later */
/* F <- exp(L dt) F: exact volume change, no drift under rotation (verification A4). Four points at once, one per lane.
 * Increments of the usual size take series without branches, larger ones the general way; which way a point goes
 * depends on its own increment alone. */
#ifndef DEMPM_MPM_DEFORM_H
#define DEMPM_MPM_DEFORM_H

#include "../base/tensor.h"
#include "mpm_shape.h"

/* 1 + x (1 / c[0] + x (1 / c[1] + ...)). */
#define MPM_SERIES(x, ...) \
  mpm_series((x), (const double[]){__VA_ARGS__}, sizeof(double[]){__VA_ARGS__} / sizeof(double))
MPM_INLINE MpmVec mpm_series(MpmVec x, const double *divisor, size_t terms) {
  MpmVec sum = mpm_vec_all(1.0 / divisor[terms - 1]);
#pragma GCC unroll 10
  for (size_t n = terms - 1; n > 0; n--) sum = 1.0 / divisor[n - 1] + x * sum;
  return 1.0 + x * sum;
}

/* exp(x), to round-off for |x| < 1/16. */
MPM_INLINE MpmVec mpm_exp_small(MpmVec x) {
  return MPM_SERIES(x, 1.0, 2.0, 6.0, 24.0, 120.0, 720.0, 5040.0, 40320.0, 362880.0);
}

/* Plane: exp(A) = e^s (C I + S (A - s I)) with s = tr A / 2, (A - s I)^2 = z I, C = cosh sqrt z, S = sinh sqrt z / sqrt
 * z, whose series in z reach round-off for |z| < 1/16. */
MPM_INLINE MpmMask mpm_is_small_plane(const MpmVec l[9], double dt) {
  const MpmVec p = 0.5 * dt * (l[0] - l[4]), s = 0.5 * dt * (l[0] + l[4]), z = p * p + dt * l[1] * (dt * l[3]);
  return (z < 0.0625) & (z > -0.0625) & (s < 0.0625) & (s > -0.0625);
}

MPM_INLINE void mpm_deform_small_plane(const MpmVec l[9], double dt, MpmVec f[9]) {
  const MpmVec a = l[0] * dt, b = l[1] * dt, c = l[3] * dt, d = l[4] * dt;
  const MpmVec s = 0.5 * (a + d), p = 0.5 * (a - d), z = p * p + b * c;
  const MpmVec grow = mpm_exp_small(s), even = MPM_SERIES(z, 2.0, 24.0, 720.0, 40320.0, 3628800.0);
  const MpmVec odd = grow * MPM_SERIES(z, 6.0, 120.0, 5040.0, 362880.0, 39916800.0);
  const MpmVec e0 = grow * even + odd * p, e1 = odd * b, e2 = odd * c, e3 = grow * even - odd * p;
  const MpmVec f0 = f[0], f1 = f[1];
  f[0] = e0 * f0 + e1 * f[3], f[1] = e0 * f1 + e1 * f[4];
  f[3] = e2 * f0 + e3 * f[3], f[4] = e2 * f1 + e3 * f[4];
}

/* Space: A = s I + B, s = tr A / 3. B^3 = p B + q I (Cayley and Hamilton) with p = tr B^2 / 2, q = det B, hence exp(B)
 * = c0 I + c1 B + c2 B^2, series in p and q. Up to B^8, as here, they reach round-off for a norm of B below 0.06. */
MPM_INLINE MpmMask mpm_is_small_space(const MpmVec l[9], double dt) {
  const MpmVec limit = mpm_vec_all(0.01 / dt);
  MpmMask small = (l[0] < limit) & (l[0] > -limit);
#pragma GCC unroll 9
  for (int k = 1; k < 9; k++) small &= (l[k] < limit) & (l[k] > -limit);
  return small;
}

/* Entry k of a b. */
MPM_INLINE MpmVec mpm_product_entry(const MpmVec a[9], const MpmVec b[9], int k) {
  const int i = 3 * (k / 3), j = k % 3;
  return a[i] * b[j] + a[i + 1] * b[3 + j] + a[i + 2] * b[6 + j];
}

MPM_INLINE void mpm_deform_small_space(const MpmVec l[9], double dt, MpmVec f[9]) {
  const MpmVec s = dt * (l[0] + l[4] + l[8]) * (1.0 / 3);
  MpmVec b[9], square[9], e[9], old[9];
#pragma GCC unroll 9
  for (int k = 0; k < 9; k++) b[k] = k % 4 == 0 ? dt * l[k] - s : dt * l[k], old[k] = f[k];
#pragma GCC unroll 9
  for (int k = 0; k < 9; k++) square[k] = mpm_product_entry(b, b, k);
  const MpmVec p = 0.5 * (square[0] + square[4] + square[8]);
  const MpmVec q = b[0] * (b[4] * b[8] - b[5] * b[7]) - b[1] * (b[3] * b[8] - b[5] * b[6]) +
                   b[2] * (b[3] * b[7] - b[4] * b[6]);
  const MpmVec pp = p * p, pq = p * q, qq = q * q, third = qq + pp * p, grow = mpm_exp_small(s);
  const MpmVec c0 = grow + grow * q * (1.0 / 6 + p * (1.0 / 120) + q * (1.0 / 720) + pp * (1.0 / 5040));
  const MpmVec c1 = grow + grow * (p * (1.0 / 6) + q * (1.0 / 24) + pp * (1.0 / 120) + pq * (1.0 / 360) +
                                   third * (1.0 / 5040) + pp * q * (1.0 / 13440));
  const MpmVec c2 = grow * (1.0 / 2 + p * (1.0 / 24) + q * (1.0 / 120) + pp * (1.0 / 720) + pq * (1.0 / 2520) +
                            third * (1.0 / 40320));
#pragma GCC unroll 9
  for (int k = 0; k < 9; k++) {
    const MpmVec rest = c1 * b[k] + c2 * square[k];
    e[k] = k % 4 == 0 ? c0 + rest : rest;
  }
#pragma GCC unroll 9
  for (int k = 0; k < 9; k++) f[k] = mpm_product_entry(e, old, k);
}

/* One point, any increment; in 2D only the components xx, xy, yx, yy (0, 1, 3, 4) count. */
static inline void mpm_deform_large(const double l[9], double dt, int dimension, double f[9]) {
  double e[9], product[9], gradient[9];
  for (int k = 0; k < 9; k++) gradient[k] = dimension == 3 || (k < 5 && k != 2) ? l[k] : 0.0;
  tensor_exponential(gradient, dt, e);
  tensor_multiply(e, f, product);
  memcpy(f, product, sizeof product);
}

/* One point. */
static inline void mpm_deform(const double l[9], double dt, int dimension, double f[9]) {
  MpmVec gradient[9], result[9];
  for (int k = 0; k < 9; k++) gradient[k] = mpm_vec_all(l[k]), result[k] = mpm_vec_all(f[k]);
  if (!(dimension == 2 ? mpm_is_small_plane(gradient, dt) : mpm_is_small_space(gradient, dt))[0]) {
    mpm_deform_large(l, dt, dimension, f);
    return;
  }
  if (dimension == 2) mpm_deform_small_plane(gradient, dt, result);
  else mpm_deform_small_space(gradient, dt, result);
  for (int k = 0; k < 9; k++) f[k] = result[k][0];
}

#endif
