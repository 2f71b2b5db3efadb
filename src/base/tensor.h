/* SPDX-License-Identifier: GPL-2.0-or-later */
/* 3 x 3 tensors as double[9], row-major: a[3*i+j] = a_ij. In 2D the third row and column are those of the unit
 * tensor (deformation) or zero (rates). Symmetric tensors as double[6] in LIGGGHTS' order xx yy zz xy xz yz;
 * shear entries are tensor components (not doubled). */
#ifndef DEMPM_TENSOR_H
#define DEMPM_TENSOR_H

#include <math.h>
#include <string.h>

enum { TENSOR_XX = 0, TENSOR_YY, TENSOR_ZZ, TENSOR_XY, TENSOR_XZ, TENSOR_YZ };

static inline void tensor_identity(double a[9]) {
  memset(a, 0, 9 * sizeof *a);
  a[0] = a[4] = a[8] = 1.0;
}

/* c = a b; c may not alias a or b. */
static inline void tensor_multiply(const double a[9], const double b[9], double c[9]) {
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) c[3 * i + j] = a[3 * i] * b[j] + a[3 * i + 1] * b[3 + j] + a[3 * i + 2] * b[6 + j];
}

static inline double tensor_determinant(const double a[9]) {
  return a[0] * (a[4] * a[8] - a[5] * a[7]) - a[1] * (a[3] * a[8] - a[5] * a[6]) + a[2] * (a[3] * a[7] - a[4] * a[6]);
}

/* b = inverse of a, which must not be singular; b may not alias a. */
static inline void tensor_inverse(const double a[9], double b[9]) {
  const double s = 1.0 / tensor_determinant(a);
  b[0] = s * (a[4] * a[8] - a[5] * a[7]);
  b[1] = s * (a[2] * a[7] - a[1] * a[8]);
  b[2] = s * (a[1] * a[5] - a[2] * a[4]);
  b[3] = s * (a[5] * a[6] - a[3] * a[8]);
  b[4] = s * (a[0] * a[8] - a[2] * a[6]);
  b[5] = s * (a[2] * a[3] - a[0] * a[5]);
  b[6] = s * (a[3] * a[7] - a[4] * a[6]);
  b[7] = s * (a[1] * a[6] - a[0] * a[7]);
  b[8] = s * (a[0] * a[4] - a[1] * a[3]);
}

/* e = exp(factor * a): exact volume change and no drift under rotation (verification A4), unlike I + a dt.
 * Scaling and squaring of the Taylor series to round-off. */
static inline void tensor_exponential(const double a[9], double factor, double e[9]) {
  double norm = 0.0, scaled[9], term[9], product[9];
  for (int k = 0; k < 9; k++) norm = fmax(norm, fabs(a[k] * factor));
  int halvings = 0;
  while (norm > 0.05 && halvings < 60) norm *= 0.5, halvings++;
  const double scale = ldexp(factor, -halvings);
  for (int k = 0; k < 9; k++) scaled[k] = a[k] * scale;
  tensor_identity(e);
  tensor_identity(term);
  for (int order = 1; order <= 10; order++) {
    tensor_multiply(term, scaled, product);
    for (int k = 0; k < 9; k++) term[k] = product[k] / order, e[k] += term[k];
  }
  for (; halvings > 0; halvings--) {
    tensor_multiply(e, e, product);
    memcpy(e, product, sizeof product);
  }
}

#endif
