/* SPDX-License-Identifier: GPL-2.0-or-later */
/* P2G: the points of a cell share their nodes, so a cell is summed in registers and then added to the nodes. Cells go
 * slab by slab, first the slabs of even global index, then the odd ones: the order of the sums at a node is that of
 * (slab colour, cell, tag), for every number of threads and ranks. */
#include <string.h>

#include "mpm_kernel.h"

/* --------------------------------------------------------------------------------------------------- momentum */

/* What momentum_body adds for row k besides mass and momentum. */
typedef struct Extras {
  int with_heat, with_affine;
} Extras;

MPM_INLINE void add_affine(const Mpm *mpm, int k, const MpmWeights *w, int dimension, int width, MpmVec *sum) {
  const double *affine = mpm->points.affine[k], mass = mpm->points.position[k][0];
  MpmVec column[3];
  for (int j = 0; j < dimension; j++)
    column[j] = (mass * mpm->spacing[j]) * (MpmVec){0.0, affine[j], affine[3 + j], dimension == 3 ? affine[6 + j] : 0.0};
  const int rows = dimension == 3 ? width * width : width;
#pragma GCC unroll 9
  for (int r = 0; r < rows; r++) {
    const double weight = mpm_across(w->value, w->value, r, dimension, width);
    MpmVec row = (r % width - w->f[2]) * column[1];
    if (dimension == 3) row += (r / width - w->f[3]) * column[2];
#pragma GCC unroll 3
    for (int a = 0; a < width; a++) sum[r * width + a] += (w->value[a][1] * weight) * (row + (a - w->f[1]) * column[0]);
  }
}

MPM_INLINE void add_heat(const double content[2], const MpmWeights *w, int dimension, int width, double (*heat)[2]) {
  const int rows = dimension == 3 ? width * width : width;
#pragma GCC unroll 9
  for (int r = 0; r < rows; r++) {
    const double weight = mpm_across(w->value, w->value, r, dimension, width);
#pragma GCC unroll 3
    for (int a = 0; a < width; a++)
      for (int q = 0; q < 2; q++) heat[r * width + a][q] += w->value[a][1] * weight * content[q];
  }
}

MPM_INLINE void momentum_row(const Mpm *mpm, const MpmVec *motion, int k, const MpmCellBase *base, Extras extras,
                             int dimension, MpmShape shape, MpmVec *sum, double (*heat)[2]) {
  const int width = mpm_shape_width(shape), rows = dimension == 3 ? width * width : width;
  MpmWeights w;
  mpm_find_weights(mpm, k, base, shape, &w);
  const MpmVec value = mpm->points.position[k][0] * motion[k];
#pragma GCC unroll 9
  for (int r = 0; r < rows; r++) {
    const MpmVec row = mpm_across(w.value, w.value, r, dimension, width) * value;
#pragma GCC unroll 3
    for (int a = 0; a < width; a++) sum[r * width + a] += w.value[a][1] * row;
  }
  if (extras.with_affine) add_affine(mpm, k, &w, dimension, width, sum);
  if (extras.with_heat) add_heat(mpm->points.heat[k], &w, dimension, width, heat);
}

MPM_INLINE void momentum_body(Mpm *mpm, const MpmVec *motion, const int range[2], Extras extras, int dimension,
                              MpmShape shape) {
  MpmGrid *grid = &mpm->grid;
  const int width = mpm_shape_width(shape), rows = dimension == 3 ? width * width : width;
  const int nodes = rows * width;
  for (int cell = range[0]; cell < range[1]; cell++) {
    MpmVec sum[MPM_NODES_MAX];
    double heat[MPM_NODES_MAX][2];
#pragma GCC unroll 27
    for (int n = 0; n < nodes; n++) sum[n] = (MpmVec){0.0, 0.0, 0.0, 0.0};
    if (extras.with_heat) memset(heat, 0, sizeof heat);
    const MpmCellBase base = mpm_cell_base(mpm, cell, dimension);
    const MpmRuns runs = mpm_cell_runs(mpm, cell);
    for (int r = 0; r < runs.count; r++) {
      const int *run = runs.run ? runs.run[r] : runs.own;
      for (int k = run[0]; k < run[1]; k++) momentum_row(mpm, motion, k, &base, extras, dimension, shape, sum, heat);
    }
#pragma GCC unroll 9
    for (int r = 0; r < rows; r++)
#pragma GCC unroll 3
      for (int a = 0; a < width; a++) {
        const int n = grid->cell_row[cell][r] + a;
        grid->sum[n] += sum[r * width + a];
        if (extras.with_heat)
          for (int q = 0; q < 2; q++) grid->heat[n][q] += heat[r * width + a][q];
      }
  }
}

/* Heat and affine matrix only where they are: what is absent is a constant. */
MPM_CLONES static void momentum_plain(Mpm *mpm, const MpmVec *motion, const int range[2]) {
  MPM_SPECIALISE(mpm, momentum_body, mpm, motion, range, ((Extras){0, 0}))
}
MPM_CLONES static void momentum_extra(Mpm *mpm, const MpmVec *motion, const int range[2], Extras extras) {
  MPM_SPECIALISE(mpm, momentum_body, mpm, motion, range, extras)
}

void mpm_p2g_momentum(Mpm *mpm, const MpmVec *motion, int with_heat, int with_affine) {
  MpmGrid *grid = &mpm->grid;
  mpm_share_start(mpm);
#pragma omp parallel num_threads(mpm->threads) if (mpm_is_parallel(mpm))
  {
#pragma omp for
    for (int n = 0; n < grid->nodes; n++) {
      grid->sum[n] = (MpmVec){0.0, 0.0, 0.0, 0.0};
      if (with_heat) grid->heat[n][0] = grid->heat[n][1] = 0.0;
    }
    for (int colour = 0; colour < 2; colour++) {
      for (int s; (s = mpm_share_next(mpm, colour)) >= 0;) {
        const int *range = grid->slab[colour] + 2 * s;
        if (with_heat || with_affine) momentum_extra(mpm, motion, range, (Extras){with_heat, with_affine});
        else momentum_plain(mpm, motion, range);
      }
#pragma omp barrier
    }
  }
}

/* ------------------------------------------------------------------------------------------------------- load */

MPM_INLINE void load_row(const Mpm *mpm, int k, const MpmVec *load, const MpmCellBase *base, int dimension,
                         MpmShape shape, MpmVec *sum) {
  const int width = mpm_shape_width(shape), rows = dimension == 3 ? width * width : width;
  MpmWeights w;
  mpm_find_weights(mpm, k, base, shape, &w);
#pragma GCC unroll 9
  for (int r = 0; r < rows; r++) {
    const double weight = mpm_across(w.value, w.value, r, dimension, width);
    MpmVec even = weight * load[0] + mpm_across(w.slope, w.value, r, dimension, width) * load[2];
    if (dimension == 3) even += mpm_across(w.value, w.slope, r, dimension, width) * load[3];
    const MpmVec odd = weight * load[1];
#pragma GCC unroll 3
    for (int a = 0; a < width; a++) sum[r * width + a] += w.value[a][1] * even + w.slope[a][1] * odd;
  }
}

MPM_INLINE void load_body(Mpm *mpm, int first, int end, const MpmVec *given, int dimension, MpmShape shape) {
  MpmGrid *grid = &mpm->grid;
  const int width = mpm_shape_width(shape), rows = dimension == 3 ? width * width : width;
  const int nodes = rows * width;
  for (int cell = first; cell < end; cell++) {
    MpmVec sum[MPM_NODES_MAX];
#pragma GCC unroll 27
    for (int n = 0; n < nodes; n++) sum[n] = (MpmVec){0.0, 0.0, 0.0, 0.0};
    const MpmCellBase base = mpm_cell_base(mpm, cell, dimension);
    const MpmRuns runs = mpm_cell_runs(mpm, cell);
    for (int r = 0; r < runs.count; r++) {
      const int *run = runs.run ? runs.run[r] : runs.own;
      for (int k = run[0]; k < run[1]; k++) {
        MpmVec load[4];
        if (!given) mpm_row_load(mpm, k, dimension, load);
        load_row(mpm, k, given ? given + (size_t)k * (size_t)(1 + dimension) : load, &base, dimension, shape, sum);
      }
    }
#pragma GCC unroll 9
    for (int r = 0; r < rows; r++)
#pragma GCC unroll 3
      for (int a = 0; a < width; a++) grid->rate[grid->cell_row[cell][r] + a] += sum[r * width + a];
  }
}

MPM_CLONES static void load_given(Mpm *mpm, int first, int end) {
  MPM_SPECIALISE(mpm, load_body, mpm, first, end, mpm->points.load)
}
MPM_CLONES void mpm_p2g_load_cells(Mpm *mpm, int first, int end) {
  MPM_SPECIALISE(mpm, load_body, mpm, first, end, NULL)
}

void mpm_p2g_load(Mpm *mpm) {
  MpmGrid *grid = &mpm->grid;
  const int is_given = mpm_uses_load(mpm);
  mpm_share_start(mpm);
#pragma omp parallel num_threads(mpm->threads) if (mpm_is_parallel(mpm))
  {
#pragma omp for
    for (int n = 0; n < grid->nodes; n++) grid->rate[n] = (MpmVec){0.0, 0.0, 0.0, 0.0};
    for (int colour = 0; colour < 2; colour++) {
      for (int s; (s = mpm_share_next(mpm, colour)) >= 0;) {
        const int *range = grid->slab[colour] + 2 * s;
        if (is_given) load_given(mpm, range[0], range[1]);
        else mpm_p2g_load_cells(mpm, range[0], range[1]);
      }
#pragma omp barrier
    }
  }
}
