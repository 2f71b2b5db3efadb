/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Means over the cells of the grid against volumetric locking ("B-bar", Hughes 1980, by cells). A cell with several points has
 * too few nodal freedoms to keep the volume (or the dilatancy) of each of them while it shears. Here it has one to keep: the
 * law sees the cell's mean of tr L, and the nodes get the force of the cell's mean of tr sigma; deviators are the points' own.
 *
 * Means are weighted by the points' present volumes V. That is a projection P, the same in both places and orthogonal in the
 * product weighted by V, so that the internal forces do the work that the law sees: sum_I f_I v_I = -sum_p V (P sigma) : L =
 * -sum_p V sigma : (P L), to round-off. With USF the V of the gradient is that before and the V of the force that after the law;
 * both weigh alike, as all points of a cell have grown by the same factor exp(dt mean tr L) in between.
 *
 * Plane: traces are those of xx and yy, and the difference goes to these two alone (d = 2). L_zz is and stays 0 in plane strain, a
 * third of the difference there would strain across the plane. So the in-plane deviator stays, and what is isotropic in the plane
 * remains so.
 *
 * The cell of a point is the one between nodes that it lies in, not the "cell" by which rows are sorted, which is the first node
 * of its support. Its lowest corner is a node of the support with every shape: sums go to that node, in the order of P2G. A rank
 * has all points of the cells of its own ones. */
#include "mpm_kernel.h"

/* A point on the border is in the upper cell despite round-off, so that its periodic images agree. */
static const double TOLERANCE = 1e-9; /* cells */

static double trace_of(double *const diagonal[3], int k, int dimension) {
  const double plane = diagonal[0][k] + diagonal[1][k];
  return dimension == 3 ? plane + diagonal[2][k] : plane;
}

/* Foreign rows' {V, V x}. Collective. */
static BaseStatus forward_values(Mpm *mpm) {
  MpmPoints *p = &mpm->points;
  for (int k = 0; k < p->live; k++)
    for (int q = 0; q < 2; q++) p->carry[2 * (size_t)p->slot[k] + (size_t)q] = p->cell_value[k][q];
  double *foreign = p->carry + 2 * (size_t)p->own;
  TRY(mpm->halo->forward(mpm->halo->content, 2, p->carry, foreign));
  for (int s = 0; s < p->count - p->own; s++) {
    const double *value = foreign + 2 * (size_t)p->foreign_slot[s];
    p->cell_value[p->own + s] = (MpmVec){value[0], value[1], 1.0, 0.0};
  }
  return BASE_OK;
}

static void sum_cells(Mpm *mpm, const int range[2]) {
  MpmPoints *p = &mpm->points;
  MpmGrid *grid = &mpm->grid;
  const int width = mpm_width(mpm), dimension = mpm->scene.dimension;
  for (int cell = range[0]; cell < range[1]; cell++) {
    const MpmCellBase base = mpm_cell_base(mpm, cell, dimension);
    const MpmRuns runs = mpm_cell_runs(mpm, cell);
    for (int r = 0; r < runs.count; r++) {
      const int *run = runs.run ? runs.run[r] : runs.own;
      for (int k = run[0]; k < run[1]; k++) {
        const MpmVec from_base = (p->place[k] - base.origin) * mpm->per_length - base.base;
        const MpmMask beyond = from_base >= 1.0 - TOLERANCE; /* lanes: -1 or 0 */
        const int row = (beyond[2] ? 1 : 0) + (dimension == 3 && beyond[3] ? width : 0);
        const int node = grid->cell_row[cell][row] + (beyond[1] ? 1 : 0);
        grid->cell_sum[node] += p->cell_value[k];
        p->cell_node[k] = node;
      }
    }
  }
}

/* Sums of V and of V times the trace over each cell. Collective. */
static BaseStatus find_sums(Mpm *mpm, double *const diagonal[3]) {
  MpmPoints *p = &mpm->points;
  MpmGrid *grid = &mpm->grid;
  const int dimension = mpm->scene.dimension;
#pragma omp parallel for num_threads(mpm->threads) if (mpm_is_parallel(mpm))
  for (int k = 0; k < p->live; k++) {
    const double volume = mpm_row_volume(mpm, k);
    p->cell_value[k] = (MpmVec){volume, volume * trace_of(diagonal, k, dimension), 1.0, 0.0};
  }
  if (mpm->halo) TRY(forward_values(mpm));
  mpm_share_start(mpm);
#pragma omp parallel num_threads(mpm->threads) if (mpm_is_parallel(mpm))
  {
#pragma omp for
    for (int n = 0; n < grid->nodes; n++) grid->cell_sum[n] = mpm_vec_all(0.0);
    for (int colour = 0; colour < 2; colour++) {
      for (int s; (s = mpm_share_next(mpm, colour)) >= 0;) sum_cells(mpm, grid->slab[colour] + 2 * s);
#pragma omp barrier
    }
  }
  return BASE_OK;
}

/* What the diagonal entries of row k lack of the mean; nothing for a point that is alone, or in a cell of no volume. */
static double find_lack(const Mpm *mpm, int k, double *const diagonal[3]) {
  const int dimension = mpm->scene.dimension;
  const MpmVec sum = mpm->grid.cell_sum[mpm->points.cell_node[k]];
  if (!(sum[2] > 1.0 && sum[0] > 0.0)) return 0.0;
  return (sum[1] / sum[0] - trace_of(diagonal, k, dimension)) / dimension;
}

BaseStatus mpm_volumetric_gradient(Mpm *mpm) {
  MpmPoints *p = &mpm->points;
  double *const diagonal[3] = {p->velocity_gradient[0], p->velocity_gradient[4], p->velocity_gradient[8]};
  TRY(find_sums(mpm, diagonal));
#pragma omp parallel for num_threads(mpm->threads) if (mpm_is_parallel(mpm))
  for (int k = 0; k < p->live; k++) {
    const double lack = find_lack(mpm, k, diagonal);
    for (int i = 0; i < mpm->scene.dimension; i++) diagonal[i][k] += lack;
  }
  return BASE_OK;
}

BaseStatus mpm_volumetric_load(Mpm *mpm) {
  MpmPoints *p = &mpm->points;
  double *const diagonal[3] = {p->stress[0], p->stress[1], p->stress[2]};
  const int width = mpm_load_width(mpm);
  TRY(find_sums(mpm, diagonal));
#pragma omp parallel for num_threads(mpm->threads) if (mpm_is_parallel(mpm))
  for (int k = 0; k < p->live; k++) {
    const double lack = p->cell_value[k][0] * find_lack(mpm, k, diagonal);
    MpmVec *load = p->load + (size_t)k * (size_t)width;
    for (int i = 1; i < width; i++) load[i][i] -= mpm->per_length[i] * lack;
  }
  return BASE_OK;
}
