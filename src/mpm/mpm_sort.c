/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Sorting by (cell, tag), and cells of points. */
#include <math.h>
#include <string.h>

#include "mpm_kernel.h"

static int precedes(const MpmItem *a, const MpmItem *b) {
  if (a->cell != b->cell) return a->cell < b->cell;
  if (a->tag != b->tag) return a->tag < b->tag;
  return a->index < b->index;
}

static void insertion_sort(MpmItem *item, int n) {
  for (int i = 1; i < n; i++) {
    const MpmItem moving = item[i];
    int j = i;
    for (; j > 0 && precedes(&moving, &item[j - 1]); j--) item[j] = item[j - 1];
    item[j] = moving;
  }
}

/* Merges sorted a [na] and b [nb] into out [na + nb]. */
static void merge(const MpmItem *a, int na, const MpmItem *b, int nb, MpmItem *out) {
  int i = 0, j = 0;
  if (na > 0 && nb > 0 && !precedes(&b[0], &a[na - 1])) { /* they follow each other: points often move in groups */
    memcpy(out, a, (size_t)na * sizeof *a);
    memcpy(out + na, b, (size_t)nb * sizeof *b);
    return;
  }
  while (i < na && j < nb) *out++ = precedes(&b[j], &a[i]) ? b[j++] : a[i++];
  while (i < na) *out++ = a[i++];
  while (j < nb) *out++ = b[j++];
}

void mpm_sort_items(MpmItem **item, MpmItem **spare, int n) {
  enum { RUN = 16 };
  for (int i = 0; i < n; i += RUN) insertion_sort(*item + i, n - i < RUN ? n - i : RUN);
  for (int64_t run = RUN; run < n; run *= 2) {
    for (int64_t i = 0; i < n; i += 2 * run) {
      const int na = (int)(n - i < run ? n - i : run);
      const int nb = (int)(n - i - na < run ? n - i - na : run);
      merge(*item + i, na, *item + i + na, nb, *spare + i);
    }
    MpmItem *swap = *item;
    *item = *spare, *spare = swap;
  }
}

/* ------------------------------------------------------------------------------------------------------- cells */

uint64_t mpm_find_cell(Mpm *mpm, MpmVec position, MpmVec half, int64_t tag) {
  const double *o = mpm->scene.origin;
  const MpmVec anchor = mpm_anchor(mpm, mpm->scene.shape, (MpmVec){0.0, o[0], o[1], o[2]}, position, half);
  uint64_t key = 0;
  for (int i = mpm->scene.dimension - 1; i >= 0; i--) {
    const double base = floor(anchor[1 + i]);
    if (!(fabs(base) < MPM_KEY_BIAS - 8)) {
      mpm_note_point(mpm, BASE_ERROR_UNSTABLE, tag,
                     "position is more than 1,000,000 cells away from the grid's origin");
      return 0;
    }
    key = key << MPM_KEY_BITS | (uint64_t)((int)base + MPM_KEY_BIAS);
  }
  return key;
}
