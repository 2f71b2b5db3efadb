/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Shape functions of the axes; products of axes give those of a node. `shape` and `dimension` are constants at every
 * call site, and the functions are always inlined: each combination is compiled by itself, from one source.
 *
 * Lengths are in units of the spacing h: u = (x - origin) / h. The support of a point starts at node `base` and has
 * mpm_shape_width() nodes per axis; f = u - base. */
#ifndef DEMPM_MPM_SHAPE_H
#define DEMPM_MPM_SHAPE_H

#include "mpm.h"

#define MPM_INLINE static inline __attribute__((always_inline))

enum { MPM_WIDTH_MAX = 3 };

MPM_INLINE int mpm_shape_width(MpmShape shape) { return shape == MPM_SHAPE_LINEAR ? 2 : 3; }

/* base = floor(anchor). half: half the edge of the point's domain over h, uGIMP only. */
MPM_INLINE double mpm_shape_anchor(MpmShape shape, double u, double half) {
  return shape == MPM_SHAPE_LINEAR ? u : shape == MPM_SHAPE_BSPLINE ? u - 0.5 : u - half;
}

/* Four axes at once; lane 0 has no meaning, lanes 1 to 3 are x, y, z. */
typedef double MpmVec __attribute__((vector_size(32)));
typedef long long MpmMask __attribute__((vector_size(32)));

MPM_INLINE MpmVec mpm_vec_all(double x) { return (MpmVec){x, x, x, x}; }
/* The axes' lanes alone. */
MPM_INLINE int mpm_axes_all(MpmMask mask, int dimension) {
  return (mask[1] & mask[2] & (dimension == 3 ? mask[3] : -1)) != 0;
}
MPM_INLINE int mpm_mask_all(MpmMask mask) { return (mask[0] & mask[1] & mask[2] & mask[3]) != 0; }
/* Four rows of an array, of which `n` (1 to 4) exist: the others repeat the last one and are not written. */
MPM_INLINE MpmVec mpm_vec_load(const double *row, int n) {
  MpmVec result;
  if (n < 4) return (MpmVec){row[0], row[n > 1 ? 1 : 0], row[n > 2 ? 2 : n - 1], row[n - 1]};
  __builtin_memcpy(&result, row, sizeof result);
  return result;
}
MPM_INLINE void mpm_vec_store(MpmVec x, double *row, int n) {
  if (n < 4)
    for (int i = 0; i < n; i++) row[i] = x[i];
  else __builtin_memcpy(row, &x, sizeof x);
}
/* a where the mask is set, else b. */
MPM_INLINE MpmVec mpm_vec_select(MpmMask mask, MpmVec a, MpmVec b) {
  return (MpmVec)(((MpmMask)a & mask) | ((MpmMask)b & ~mask));
}
/* x where x > 0, else 0. */
MPM_INLINE MpmVec mpm_vec_positive(MpmVec x) { return (MpmVec)((MpmMask)x & (x > 0.0)); }

/* value[a] = S at node base + a, slope[a] = dS/du, axis by axis. uGIMP: mean of the hat function over [f - half, f +
 * half], half <= 1/2 (TM-DEMPM eq. 12-13 with the undeformed domain). The middle value closes the partition of unity.
 */
MPM_INLINE void mpm_shape_axes(MpmShape shape, MpmVec f, MpmVec half, MpmVec inverse /* of 2 half */,
                               MpmVec value[MPM_WIDTH_MAX], MpmVec slope[MPM_WIDTH_MAX]) {
  if (shape == MPM_SHAPE_LINEAR) {
    value[0] = 1.0 - f, value[1] = f;
    slope[0] = mpm_vec_all(-1.0), slope[1] = mpm_vec_all(1.0);
  } else if (shape == MPM_SHAPE_BSPLINE) {
    const MpmVec left = 1.5 - f, right = f - 0.5;
    value[0] = 0.5 * left * left, value[2] = 0.5 * right * right;
    slope[0] = -left, slope[2] = right;
    value[1] = 1.0 - value[0] - value[2];
    slope[1] = left - right;
  } else {
    const MpmVec left = 1.0 - (f - half);                        /* from the domain's left end to node 1 */
    const MpmVec rest = mpm_vec_positive(left - 2.0 * half);     /* of it not covered by the domain */
    const MpmVec right = mpm_vec_positive(2.0 * half - left);    /* of the domain beyond node 1 */
    value[0] = 0.5 * inverse * (left - rest) * (left + rest), value[2] = 0.5 * inverse * right * right;
    slope[0] = -inverse * (left - rest), slope[2] = inverse * right;
    value[1] = 1.0 - value[0] - value[2];
    slope[1] = -slope[0] - slope[2];
  }
}

/* One axis alone. */
MPM_INLINE void mpm_shape_axis(MpmShape shape, double f, double half, double value[MPM_WIDTH_MAX],
                               double slope[MPM_WIDTH_MAX]) {
  MpmVec values[MPM_WIDTH_MAX], slopes[MPM_WIDTH_MAX];
  mpm_shape_axes(shape, mpm_vec_all(f), mpm_vec_all(half), mpm_vec_all(0.5 / half), values, slopes);
  for (int a = 0; a < mpm_shape_width(shape); a++) value[a] = values[a][0], slope[a] = slopes[a][0];
}

/* APIC: row[a] such that sum_a row[a] v_a is the slope of v over u around the point: S_a d_a / D with d_a = base + a -
 * u and D = sum S d^2 (B-spline: 1/4). Linear: D = f (1 - f) vanishes at a node and the row would be dS/du there,
 * however little mass the far node has: its velocity (force / mass) then feeds itself and blows up (B7). D is kept
 * above 0.02, so that points within 2 % of a cell from a node lose part of their matrix (0.1 % of the angular momentum
 * of a body in 20 steps). */
MPM_INLINE void mpm_shape_affine(MpmShape shape, double f, const double value[MPM_WIDTH_MAX],
                                 double row[MPM_WIDTH_MAX]) {
  const int width = mpm_shape_width(shape);
  double moment = 0.0;
  for (int a = 0; a < width; a++) row[a] = value[a] * (a - f), moment += row[a] * (a - f);
  const double divisor = shape == MPM_SHAPE_LINEAR && moment < 0.02 ? 0.02 : moment;
  for (int a = 0; a < width; a++) row[a] /= divisor;
}

#endif
