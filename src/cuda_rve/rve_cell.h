/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The periodic cell: its geometry, and changes of it that leave every branch as it is. */
#ifndef DEMPM_RVE_CELL_H
#define DEMPM_RVE_CELL_H

#include "rve_state.h"

RVE_FN double rve_row_norm(const double m[9], int row) {
  return sqrt(m[3 * row] * m[3 * row] + m[3 * row + 1] * m[3 * row + 1] + m[3 * row + 2] * m[3 * row + 2]);
}

RVE_FN void rve_invert(const double a[9], double b[9]) {
  const double c0 = a[4] * a[8] - a[5] * a[7], c1 = a[5] * a[6] - a[3] * a[8], c2 = a[3] * a[7] - a[4] * a[6];
  const double s = 1.0 / (a[0] * c0 + a[1] * c1 + a[2] * c2);
  b[0] = s * c0;
  b[1] = s * (a[2] * a[7] - a[1] * a[8]);
  b[2] = s * (a[1] * a[5] - a[2] * a[4]);
  b[3] = s * c1;
  b[4] = s * (a[0] * a[8] - a[2] * a[6]);
  b[5] = s * (a[2] * a[3] - a[0] * a[5]);
  b[6] = s * c2;
  b[7] = s * (a[1] * a[6] - a[0] * a[7]);
  b[8] = s * (a[0] * a[4] - a[1] * a[3]);
}

/* Least stretch of the affine flow since the list: F = H H_list^-1, smallest singular value >= sqrt(1 - |F'F - 1|). */
RVE_FN double rve_least_stretch(const RveHead *head) {
  double inverse[9], f[9], sum = 0.0;
  rve_invert(head->cell_at_list, inverse);
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) {
      f[3 * i + j] = 0.0;
      for (int k = 0; k < 3; k++) f[3 * i + j] += head->cell[3 * i + k] * inverse[3 * k + j];
    }
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) {
      double c = i == j ? -1.0 : 0.0;
      for (int k = 0; k < 3; k++) c += f[3 * k + i] * f[3 * k + j];
      sum += c * c;
    }
  sum = sqrt(sum);
  return sum < 1.0 ? sqrt(1.0 - sum) : 0.0;
}

/* Wraps positions into [-1/2, 1/2) and moves the shifts of all slots along, so that no branch changes. 0 if a shift
 * does not fit. */
RVE_FN int rve_wrap(const RveCounts *n, const RveArrays *a) {
  const int stride = n->row ? n->row : 1;
  int fits = 1;
  for (int block = 0; block < n->blocks; block++)
    for (int row = a->slot_first[block]; row < a->slot_first[block + 1]; row++)
      for (int lane = 0; lane < RVE_PACK; lane++) {
        const int slot = row * RVE_PACK + lane, i = block * RVE_PACK + lane;
        const uint16_t image = a->image[slot];
        if (image & RVE_IMAGE_VOID) continue;
        const int j = (int)a->neighbour[slot] / stride;
        int p[3];
        rve_image_unpack(image, p);
        for (int k = 0; k < n->dimension; k++)
          p[k] += (int)((a->position[k][j] + RVE_ONE / 2) >> 60) - (int)((a->position[k][i] + RVE_ONE / 2) >> 60);
        fits &= rve_image_fits(p);
        a->image[slot] = (uint16_t)(rve_image_pack(p) | (image & 0xf000));
      }
  for (int k = 0; k < n->dimension; k++)
    for (int i = 0; i < n->blocks * RVE_PACK; i++)
      a->position[k][i] -= ((a->position[k][i] + RVE_ONE / 2) >> 60) * RVE_ONE;
  return fits;
}

/* H' = H M, s' = M^-1 s, P' = M^-1 P with integer M = "column a minus t times column b". */
RVE_FN int rve_shear_cell(int ca, int cb, int t, RveHead *head, const RveCounts *n, const RveArrays *a) {
  int fits = 1;
  for (int k = 0; k < 3; k++) head->cell[3 * k + ca] -= t * head->cell[3 * k + cb];
  for (int i = 0; i < n->blocks * RVE_PACK; i++) a->position[cb][i] += t * a->position[ca][i];
  for (int slot = 0; slot < a->slot_first[n->blocks] * RVE_PACK; slot++) {
    const uint16_t image = a->image[slot];
    int p[3];
    if (image & RVE_IMAGE_VOID) continue;
    rve_image_unpack(image, p);
    p[cb] += t * p[ca];
    fits &= p[cb] >= -7 && p[cb] <= 7; /* large only until the wrap that follows */
    a->image[slot] = (uint16_t)(rve_image_pack(p) | (image & 0xf000));
  }
  return fits;
}

/* Reduces a cell that large shear has skewed: no cell vector's projection on another exceeds half of that. Exact for
 * positions, contacts and histories. 0 if a shift does not fit (the cell is too narrow). */
RVE_FN int rve_reduce_cell(RveHead *head, const RveCounts *n, const RveArrays *a) {
  int fits = rve_wrap(n, a), changed = 1;
  double *h = head->cell;
  for (int sweep = 0; sweep < 200 && changed && fits; sweep++) {
    changed = 0;
    for (int ca = 0; ca < n->dimension; ca++)
      for (int cb = 0; cb < n->dimension; cb++) {
        if (ca == cb) continue;
        double ab = 0.0, bb = 0.0;
        for (int k = 0; k < 3; k++) ab += h[3 * k + ca] * h[3 * k + cb], bb += h[3 * k + cb] * h[3 * k + cb];
        const double t = ab / bb;
        if (!(fabs(t) > 0.5 + 1e-9)) continue; /* also for NaN */
        const int whole = t > 1.5 ? 2 : t < -1.5 ? -2 : t > 0.0 ? 1 : -1;
        fits &= rve_shear_cell(ca, cb, whole, head, n, a) && rve_wrap(n, a);
        changed = 1;
      }
  }
  rve_invert(h, head->inverse);
  return fits;
}

#endif
