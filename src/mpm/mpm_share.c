/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Which thread does which part of a pass. */
#include <omp.h>

#include "mpm_core.h"

static int count_pieces(const MpmGrid *grid, int kind) {
  return kind == MPM_SHARE_CHUNKS ? (grid->cells + MPM_CHUNK - 1) / MPM_CHUNK : grid->slabs[kind];
}

static int count_rows(const MpmGrid *grid, int kind, int piece) {
  int first = piece * MPM_CHUNK, end = first + MPM_CHUNK < grid->cells ? first + MPM_CHUNK : grid->cells;
  if (kind != MPM_SHARE_CHUNKS) first = grid->slab[kind][2 * piece], end = grid->slab[kind][2 * piece + 1];
  return grid->cell_first[end] - grid->cell_first[first];
}

void mpm_share_set(Mpm *mpm) {
  const MpmGrid *grid = &mpm->grid;
  for (int kind = 0; kind < MPM_SHARES; kind++) {
    MpmQueue *queue = mpm->queue + kind * mpm->threads;
    const int pieces = count_pieces(grid, kind);
    int64_t total = 0, done = 0; /* half rows, of whole pieces */
    for (int n = 0; n < pieces; n++) total += 2 * count_rows(grid, kind, n);
    for (int t = 0, n = 0; t < mpm->threads; t++) {
      queue[t].first = n;
      for (; n < pieces; n++) {
        const int rows = count_rows(grid, kind, n);
        if (t + 1 < mpm->threads && (done + rows) * mpm->threads > total * (t + 1)) break;
        done += 2 * rows;
      }
      queue[t].end = n;
    }
  }
}

void mpm_share_start(Mpm *mpm) {
  for (int q = 0; q < MPM_SHARES * mpm->threads; q++) mpm->queue[q].next = mpm->queue[q].first;
}

int mpm_share_next(Mpm *mpm, int kind) {
  const int self = omp_get_thread_num();
  for (int t = 0; t < mpm->threads; t++) {
    MpmQueue *queue = &mpm->queue[kind * mpm->threads + (self + t) % mpm->threads];
    int piece;
#pragma omp atomic capture
    piece = queue->next++;
    if (piece < queue->end) return piece;
  }
  return -1;
}
