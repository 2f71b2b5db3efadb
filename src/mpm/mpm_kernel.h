/* SPDX-License-Identifier: GPL-2.0-or-later */
/* What P2G and G2P share: weights of a row, stretches of rows, sums over the nodes of a support. Each body is written
 * once and compiled for two dimensions x three shapes (see mpm_shape.h). */
#ifndef DEMPM_MPM_KERNEL_H
#define DEMPM_MPM_KERNEL_H

#include "mpm_core.h"

/* Calls body(..., dimension, shape) with constants. */
#define MPM_SPECIALISE(mpm, body, ...)                                                         \
  switch (((mpm)->scene.dimension - 2) * 3 + (int)(mpm)->scene.shape) {                        \
    case 0: body(__VA_ARGS__, 2, MPM_SHAPE_LINEAR); break;                                     \
    case 1: body(__VA_ARGS__, 2, MPM_SHAPE_GIMP); break;                                       \
    case 2: body(__VA_ARGS__, 2, MPM_SHAPE_BSPLINE); break;                                    \
    case 3: body(__VA_ARGS__, 3, MPM_SHAPE_LINEAR); break;                                     \
    case 4: body(__VA_ARGS__, 3, MPM_SHAPE_GIMP); break;                                       \
    default: body(__VA_ARGS__, 3, MPM_SHAPE_BSPLINE); break;                                   \
  }

enum { MPM_NODES_MAX = 27 };

/* Lane 1 + i: axis i. */
typedef struct MpmWeights {
  MpmVec f; /* point - first node of its support, over h */
  MpmVec value[MPM_WIDTH_MAX], slope[MPM_WIDTH_MAX];
} MpmWeights;

/* What all rows of a cell share. */
typedef struct MpmCellBase {
  MpmVec origin, base;
  MpmVec half, inverse; /* uGIMP, where all domains are equal: half edges over h, and over them 1/2 */
} MpmCellBase;

MPM_INLINE MpmCellBase mpm_cell_base(const Mpm *mpm, int cell, int dimension) {
  const double *o = mpm->scene.origin;
  const uint64_t key = mpm->grid.cell_key[cell];
  MpmCellBase result = {{0.0, o[0], o[1], o[2]}, {0.0, 0.0, 0.0, 0.0}, {0.0, 0.0, 0.0, 0.0}, {0.0, 0.0, 0.0, 0.0}};
  if (mpm->points.equal_domains) result.half = mpm->points.half[0], result.inverse = 0.5 / result.half;
  for (int i = 0; i < dimension; i++)
    result.base[1 + i] = (double)((int)(key >> (i * MPM_KEY_BITS) & MPM_KEY_MASK) - MPM_KEY_BIAS);
  return result;
}

MPM_INLINE void mpm_find_weights(const Mpm *mpm, int k, const MpmCellBase *cell, MpmShape shape, MpmWeights *w) {
  const MpmPoints *p = &mpm->points;
  MpmVec half = cell->half, inverse = cell->inverse;
  if (shape == MPM_SHAPE_GIMP && !p->equal_domains) half = p->half[k], inverse = 0.5 / half;
  w->f = (p->place[k] - cell->origin) * mpm->per_length - cell->base;
  mpm_shape_axes(shape, w->f, half, inverse, w->value, w->slope);
}

/* What is floored to find the cell, over h. */
MPM_INLINE MpmVec mpm_anchor(const Mpm *mpm, MpmShape shape, MpmVec origin, MpmVec position, MpmVec half) {
  const MpmVec u = (position - origin) * mpm->per_length;
  return shape == MPM_SHAPE_LINEAR ? u : shape == MPM_SHAPE_BSPLINE ? u - 0.5 : u - half;
}
/* Lanes of axes along which a point is still in the cell. */
MPM_INLINE MpmMask mpm_is_in_cell(const Mpm *mpm, MpmShape shape, MpmVec position, MpmVec half, const MpmCellBase *cell) {
  const MpmVec anchor = mpm_anchor(mpm, shape, cell->origin, position, half);
  return (anchor >= cell->base) & (anchor < cell->base + 1.0);
}

/* Rows of a cell in the order of tags: `count` stretches. */
typedef struct MpmRuns {
  int count, own[2];
  const int (*run)[2]; /* NULL: the one stretch of own rows */
} MpmRuns;

MPM_INLINE MpmRuns mpm_cell_runs(const Mpm *mpm, int cell) {
  const MpmGrid *grid = &mpm->grid;
  MpmRuns runs = {1, {grid->cell_first[cell], grid->cell_first[cell + 1]}, NULL};
  if (mpm->points.foreign == 0) return runs;
  runs.count = grid->run_first[cell + 1] - grid->run_first[cell];
  runs.run = (const int(*)[2])(grid->run + grid->run_first[cell]);
  return runs;
}

/* Product of the values (or, along one axis, slopes) across the x axis; row r of the support = (b, c) = (r % width, r /
 * width). */
MPM_INLINE double mpm_across(const MpmVec *y, const MpmVec *z, int r, int dimension, int width) {
  return dimension == 3 ? y[r % width][2] * z[r / width][3] : y[r][2];
}

MPM_INLINE MpmVec mpm_gather_value(const MpmVec *field, const int *row, const MpmWeights *w, int dimension, int width) {
  MpmVec value = mpm_vec_all(0.0); /* sums begin with their first term: the compiler must not drop 0.0 + x */
  const int rows = dimension == 3 ? width * width : width;
#pragma GCC unroll 9
  for (int r = 0; r < rows; r++) {
    const MpmVec *node = field + row[r];
    MpmVec along = w->value[0][1] * node[0];
#pragma GCC unroll 3
    for (int a = 1; a < width; a++) along += w->value[a][1] * node[a];
    along *= mpm_across(w->value, w->value, r, dimension, width);
    value = r == 0 ? along : value + along;
  }
  return value;
}

/* gradient[j] = sum over nodes of field times slope along axis j, values along the others; `slope` per unit of u. */
MPM_INLINE void mpm_gather_gradient(const MpmVec *field, const int *row, const MpmWeights *w, const MpmVec *slope,
                                    int dimension, int width, MpmVec gradient[3]) {
  const int rows = dimension == 3 ? width * width : width;
#pragma GCC unroll 9
  for (int r = 0; r < rows; r++) {
    const MpmVec *node = field + row[r];
    MpmVec along = w->value[0][1] * node[0], across = slope[0][1] * node[0];
#pragma GCC unroll 3
    for (int a = 1; a < width; a++) along += w->value[a][1] * node[a], across += slope[a][1] * node[a];
    const MpmVec term[3] = {mpm_across(w->value, w->value, r, dimension, width) * across,
                            mpm_across(slope, w->value, r, dimension, width) * along,
                            mpm_across(w->value, slope, r, dimension, width) * along};
#pragma GCC unroll 3
    for (int j = 0; j < dimension; j++) gradient[j] = r == 0 ? term[j] : gradient[j] + term[j];
  }
}

/* In the plane the gradients of the x and y components fill four lanes: {d_x v_x, d_x v_y, d_y v_x, d_y v_y}. The same sums
 * as above. Shuffles by name: from initialisers gcc makes twice as many. */
MPM_INLINE MpmVec mpm_gather_plane(const MpmVec *field, const int *row, const MpmWeights *w, int width) {
  typedef double Pair __attribute__((vector_size(16)));
  MpmVec along[MPM_WIDTH_MAX], across[MPM_WIDTH_MAX], result = mpm_vec_all(0.0);
#pragma GCC unroll 3
  for (int a = 0; a < width; a++) {
    along[a] = __builtin_shufflevector(w->slope[a], w->value[a], 1, 1, 5, 5);
    across[a] = __builtin_shufflevector(w->value[a], w->slope[a], 2, 2, 6, 6);
  }
#pragma GCC unroll 3
  for (int r = 0; r < width; r++) {
    MpmVec sum = mpm_vec_all(0.0);
#pragma GCC unroll 3
    for (int a = 0; a < width; a++) {
      Pair node;
      __builtin_memcpy(&node, (const double *)(field + row[r] + a) + 1, sizeof node);
      const MpmVec term = along[a] * __builtin_shufflevector(node, node, 0, 1, 0, 1);
      sum = a == 0 ? term : sum + term;
    }
    result = r == 0 ? across[r] * sum : result + across[r] * sum;
  }
  return result;
}

/* The load of one own row: load[0] = {0, N}, load[1 + j] = what meets the slope of S along j, -V sigma_ij (TM-DEMPM eq.
 * 18); slopes are per unit of x / h, hence 1 / h. */
MPM_INLINE void mpm_row_load(const Mpm *mpm, int k, int dimension, MpmVec *load) {
  const MpmPoints *p = &mpm->points;
  double *const *f = p->deformation_gradient, *const *s = p->stress;
  double ratio;
  if (dimension == 2) ratio = f[0][k] * f[4][k] - f[1][k] * f[3][k];
  else
    ratio = f[0][k] * (f[4][k] * f[8][k] - f[5][k] * f[7][k]) - f[1][k] * (f[3][k] * f[8][k] - f[5][k] * f[6][k]) +
            f[2][k] * (f[3][k] * f[7][k] - f[4][k] * f[6][k]);
  const double volume = -(p->volume0[k] * ratio);
  load[0] = p->force[k];
  load[1] = (volume * mpm->per_length[1]) * (MpmVec){0.0, s[0][k], s[3][k], dimension == 3 ? s[4][k] : 0.0};
  load[2] = (volume * mpm->per_length[2]) * (MpmVec){0.0, s[3][k], s[1][k], dimension == 3 ? s[5][k] : 0.0};
  if (dimension == 3) load[3] = (volume * mpm->per_length[3]) * (MpmVec){0.0, s[4][k], s[5][k], s[2][k]};
}

#endif
