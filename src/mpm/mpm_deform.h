/* SPDX-License-Identifier: GPL-2.0-or-later */
/* F <- exp(L dt) F: exact volume change, no drift under rotation (verification A4). */
#ifndef DEMPM_MPM_DEFORM_H
#define DEMPM_MPM_DEFORM_H

#include "../base/tensor.h"
#include "mpm_shape.h"

/* In the plane: exp(A) = e^s (C I + S (A - s I)) with s = tr A / 2, (A - s I)^2 = z I, C = cosh sqrt z, S = sinh sqrt z
 * / sqrt z, whose series in z reach round-off for |z| < 1/16; larger steps take the general way. */
MPM_INLINE void mpm_deform_plane(const double l[9], double dt, double f[9]) {
  const double a = l[0] * dt, b = l[1] * dt, c = l[3] * dt, d = l[4] * dt;
  const double s = 0.5 * (a + d), p = 0.5 * (a - d), z = p * p + b * c;
  double e[4];
  if (fabs(z) < 0.0625) {
    const double grow = exp(s);
    const double even = 1.0 + z / 2.0 * (1.0 + z / 12.0 * (1.0 + z / 30.0 * (1.0 + z / 56.0 * (1.0 + z / 90.0))));
    const double odd = 1.0 + z / 6.0 * (1.0 + z / 20.0 * (1.0 + z / 42.0 * (1.0 + z / 72.0 * (1.0 + z / 110.0))));
    e[0] = grow * (even + odd * p), e[1] = grow * odd * b, e[2] = grow * odd * c, e[3] = grow * (even - odd * p);
  } else {
    double full[9];
    tensor_exponential(l, dt, full);
    e[0] = full[0], e[1] = full[1], e[2] = full[3], e[3] = full[4];
  }
  for (int j = 0; j < 2; j++) {
    const double x = f[j], y = f[3 + j];
    f[j] = e[0] * x + e[1] * y, f[3 + j] = e[2] * x + e[3] * y;
  }
}

/* In space: the Taylor series as far as the size of the step needs it (Horner), the general way for large steps. */
MPM_INLINE void mpm_deform_space(const double l[9], double dt, double f[9]) {
  double a[9], e[9], product[9], size = 0.0;
  for (int k = 0; k < 9; k++) a[k] = l[k] * dt, size = fmax(size, fabs(a[k]));
  if (3.0 * size < 0.02) {
    /* The norm is at most 3 size = x; terms end where x^(n+1) / (n+1)! < 1e-17: n = 4 for x < 1e-3, else 8. */
    static const double inverse[9] = {1.0, 1.0, 1.0 / 2, 1.0 / 3, 1.0 / 4, 1.0 / 5, 1.0 / 6, 1.0 / 7, 1.0 / 8};
    const int order = 3.0 * size < 1e-3 ? 4 : 8;
    for (int k = 0; k < 9; k++) e[k] = inverse[order] * a[k] + (k % 4 == 0 ? 1.0 : 0.0);
    for (int n = order - 1; n > 0; n--) {
      tensor_multiply(a, e, product);
      for (int k = 0; k < 9; k++) e[k] = inverse[n] * product[k] + (k % 4 == 0 ? 1.0 : 0.0);
    }
  } else {
    tensor_exponential(l, dt, e);
  }
  tensor_multiply(e, f, product);
  memcpy(f, product, sizeof product);
}

#endif
