/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Gradient, local law and load on the nodes in one sweep: some cells at a time, so that their points are read once. The
 * parts and their order are those of separate sweeps, and so are the bits. */
#include "mpm_core.h"

enum { ROWS = 96 /* at least, of one piece: what fits the first-level cache */ };

/* End of the piece that starts with cell `first`. */
static int piece_end(const MpmGrid *grid, int first, int end) {
  int cell = first;
  while (cell < end && grid->cell_first[cell] - grid->cell_first[first] < ROWS) cell++;
  return cell;
}

static void stress_cells(Mpm *mpm, const int range[2], int with_load) {
  const MpmGrid *grid = &mpm->grid;
  for (int cell = range[0]; cell < range[1];) {
    const int end = piece_end(grid, cell, range[1]);
    mpm_g2p_velocity_gradient_cells(mpm, cell, end);
    mpm_law_rows(mpm, grid->cell_first[cell], grid->cell_first[end]);
    if (with_load) mpm_p2g_load_cells(mpm, cell, end);
    cell = end;
  }
}

void mpm_stress(Mpm *mpm, int with_load) {
  MpmGrid *grid = &mpm->grid;
  mpm_share_start(mpm);
#pragma omp parallel num_threads(mpm->threads) if (mpm_is_parallel(mpm))
  {
    if (with_load) {
#pragma omp for
      for (int n = 0; n < grid->nodes; n++) grid->rate[n] = (MpmVec){0.0, 0.0, 0.0, 0.0};
    }
    for (int colour = 0; colour < 2; colour++) {
      for (int s; (s = mpm_share_next(mpm, colour)) >= 0;) stress_cells(mpm, grid->slab[colour] + 2 * s, with_load);
#pragma omp barrier
    }
  }
}
