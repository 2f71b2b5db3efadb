/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The order of own points by (cell, tag). Few points change their cell in a step: only those are sorted, and rows move
 * only in such steps. */
#include <math.h>
#include <string.h>

#include "mpm_core.h"

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

/* What is floored to find the cell, over h. */
MPM_INLINE MpmVec find_anchor(const Mpm *mpm, MpmVec origin, MpmVec position, MpmVec half) {
  const MpmVec u = (position - origin) * mpm->per_length;
  return mpm->scene.shape == MPM_SHAPE_LINEAR ? u : mpm->scene.shape == MPM_SHAPE_BSPLINE ? u - 0.5 : u - half;
}

MPM_INLINE MpmVec origin_of(const Mpm *mpm) {
  const double *o = mpm->scene.origin;
  return (MpmVec){0.0, o[0], o[1], o[2]};
}

uint64_t mpm_find_cell(Mpm *mpm, MpmVec position, MpmVec half, int64_t tag) {
  const MpmVec anchor = find_anchor(mpm, origin_of(mpm), position, half);
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

/* ------------------------------------------------------------------------------------------------------ movers */

/* Lanes that are all ones where the row is finite and still in the cell that starts at `base`. */
MPM_INLINE MpmMask stays(const Mpm *mpm, int k, MpmVec origin, MpmVec base, MpmMask ignore) {
  const MpmPoints *p = &mpm->points;
  const MpmVec half = p->half ? p->half[k] : mpm_vec_all(0.5), sum = p->position[k] + p->motion[k] + p->force[k];
  const MpmVec anchor = find_anchor(mpm, origin, p->position[k], half);
  return (((anchor >= base) & (anchor < base + 1.0)) | ignore) & (sum - sum == 0.0);
}

/* Marks the rows of some cells that leave. Returns how many. */
MPM_CLONES static int mark_movers(Mpm *mpm, int first, int end) {
  MpmPoints *p = &mpm->points;
  const MpmGrid *grid = &mpm->grid;
  const MpmVec origin = origin_of(mpm);
  const MpmMask ignore = {-1, 0, 0, mpm->scene.dimension == 3 ? 0 : -1}, none = {-1, -1, -1, -1};
  int movers = 0;
  for (int cell = first; cell < end; cell++) {
    const uint64_t key = grid->cell_key[cell];
    MpmVec base = {0.0, 0.0, 0.0, 0.0};
    for (int i = 0; i < mpm->scene.dimension; i++)
      base[1 + i] = (double)((int)(key >> (i * MPM_KEY_BITS) & MPM_KEY_MASK) - MPM_KEY_BIAS);
    MpmMask stay = none;
    for (int k = grid->cell_first[cell]; k < grid->cell_first[cell + 1]; k++)
      stay &= stays(mpm, k, origin, base, ignore);
    if (mpm_mask_all(stay)) continue;
    for (int k = grid->cell_first[cell]; k < grid->cell_first[cell + 1]; k++) {
      p->moves[k] = !mpm_mask_all(stays(mpm, k, origin, base, ignore));
      movers += p->moves[k];
    }
  }
  return movers;
}

/* gimp_stretch: the domains follow F. */
static void stretch_domains(Mpm *mpm) {
  MpmPoints *p = &mpm->points;
#pragma omp parallel for num_threads(mpm->threads) if (mpm_is_parallel(mpm))
  for (int k = 0; k < p->own; k++) {
    double f[9];
    mpm_row_deformation(mpm, k, f);
    p->half[k] = mpm_half_edges(mpm, p->home[p->slot[k]].size0, f);
  }
}

static int find_movers(Mpm *mpm) {
  enum { CHUNK = 256 };
  int movers = 0;
#pragma omp parallel for schedule(static) reduction(+ : movers) num_threads(mpm->threads) if (mpm_is_parallel(mpm))
  for (int first = 0; first < mpm->grid.cells; first += CHUNK)
    movers += mark_movers(mpm, first, first + CHUNK < mpm->grid.cells ? first + CHUNK : mpm->grid.cells);
  return movers;
}

static void note_fault(Mpm *mpm, int k) {
  const MpmPoints *p = &mpm->points;
  double velocity = 0.0, position = 0.0, force = 0.0;
  for (int i = 0; i < 4; i++) velocity += p->motion[k][i], position += p->position[k][i], force += p->force[k][i];
  if (isfinite(position) && isfinite(velocity) && isfinite(force)) return;
  mpm_note_point(mpm, BASE_ERROR_UNSTABLE, p->tag[k], !isfinite(position)   ? "position is not finite"
                                                      : !isfinite(velocity) ? "velocity is not finite"
                                                                            : "force is not finite");
}

/* ------------------------------------------------------------------------------------------------------- order */

/* First row whose (cell, tag) is not before the item's. Rows that leave still count. */
static int find_row(const MpmGrid *grid, const MpmPoints *p, const MpmItem *item) {
  int low = 0, high = grid->cells;
  while (low < high) {
    const int middle = low + (high - low) / 2;
    if (grid->cell_key[middle] < item->cell) low = middle + 1;
    else high = middle;
  }
  if (low == grid->cells || grid->cell_key[low] != item->cell) return grid->cell_first[low];
  high = grid->cell_first[low + 1], low = grid->cell_first[low];
  while (low < high) {
    const int middle = low + (high - low) / 2;
    if (p->tag[middle] < item->tag) low = middle + 1;
    else high = middle;
  }
  return low;
}

/* Rows `from`, from + 1 ... become rows `to`, to + 1 ...; rows that stay where they are need no stretch. */
static void add_stretch(MpmPoints *p, int to, int from, int count) {
  if (to != from && count > 0) p->stretch[p->stretches++] = (MpmStretch){to, from, count};
}

/* mover: leaving rows, upwards; items: the same, by (cell, tag). target[m]: new row of item m. */
static void find_stretches(Mpm *mpm, int movers) {
  MpmPoints *p = &mpm->points;
  int row = 0, next = 0, left = 0;
  p->stretches = 0;
  for (int m = 0; m <= movers; m++) {
    const int stop = m < movers ? find_row(&mpm->grid, p, &p->item[m]) : p->own;
    for (; left < movers && p->mover[left] < stop; left++) {
      add_stretch(p, next, row, p->mover[left] - row);
      next += p->mover[left] - row, row = p->mover[left] + 1;
    }
    add_stretch(p, next, row, stop - row);
    next += stop - row, row = stop;
    if (m < movers) p->target[m] = next++;
  }
}

MPM_INLINE void move_stretch(char *rows, size_t width, MpmStretch s) {
  if (s.count == 1) memcpy(rows + (size_t)s.to * width, rows + (size_t)s.from * width, width);
  else memmove(rows + (size_t)s.to * width, rows + (size_t)s.from * width, (size_t)s.count * width);
}

/* Stretches keep their order, so that none overwrites what another still needs if those that go down are moved upwards
 * and then those that go up downwards; only the movers, which cross them, need memory of their own. */
MPM_INLINE void move_plane(const MpmPoints *p, const MpmPlane *plane, size_t width, int movers) {
  char *rows, *spare; /* of several types */
  memcpy(&rows, plane->rows, sizeof rows), memcpy(&spare, plane->spare, sizeof spare);
  for (int m = 0; m < movers; m++)
    memcpy(spare + (size_t)m * width, rows + (size_t)p->item[m].index * width, width);
  for (int s = 0; s < p->stretches; s++)
    if (p->stretch[s].to < p->stretch[s].from) move_stretch(rows, width, p->stretch[s]);
  for (int s = p->stretches - 1; s >= 0; s--)
    if (p->stretch[s].to > p->stretch[s].from) move_stretch(rows, width, p->stretch[s]);
  for (int m = 0; m < movers; m++)
    memcpy(rows + (size_t)p->target[m] * width, spare + (size_t)m * width, width);
}

static void move_rows(Mpm *mpm, int movers) {
  const MpmPoints *p = &mpm->points;
#pragma omp parallel for schedule(dynamic, 1) num_threads(mpm->threads) if (mpm_is_parallel(mpm))
  for (int n = 0; n < p->planes; n++) {
    const MpmPlane *plane = &p->plane[n];
    if (plane->width == 8) move_plane(p, plane, 8, movers);
    else if (plane->width == 32) move_plane(p, plane, 32, movers);
    else move_plane(p, plane, plane->width, movers);
  }
}

/* Lists the rows that leave, upwards. */
static int list_movers(MpmPoints *p, int *mover) {
  int n = 0;
  for (int k = 0; k < p->own; k++) {
    uint64_t eight;
    if (k % 8 == 0 && k + 8 <= p->own) {
      memcpy(&eight, p->moves + k, sizeof eight);
      if (eight == 0) {
        k += 7;
        continue;
      }
    }
    if (p->moves[k]) mover[n++] = k;
    p->moves[k] = 0;
  }
  return n;
}

BaseStatus mpm_points_order(Mpm *mpm) {
  MpmPoints *p = &mpm->points;
  if (mpm->scene.gimp_stretch) stretch_domains(mpm);
  if (find_movers(mpm) == 0) return BASE_OK;
  const int movers = list_movers(p, p->mover);
  for (int m = 0; m < movers; m++) {
    const int k = p->mover[m];
    note_fault(mpm, k);
    p->key[k] = mpm_find_cell(mpm, p->position[k], p->half ? p->half[k] : mpm_vec_all(0.5), p->tag[k]);
    p->item[m] = (MpmItem){p->key[k], p->tag[k], k};
  }
  mpm_sort_items(&p->item, &p->spare_item, movers);
  find_stretches(mpm, movers);
  move_rows(mpm, movers);
  p->has_moved = 1;
  for (int k = 1; k < p->own; k++) /* the order of sums would be ambiguous */
    if (p->tag[k] == p->tag[k - 1] && p->key[k] == p->key[k - 1])
      return base_error(BASE_ERROR_ARGUMENT, "point %lld: its tag occurs twice; tags must be unique",
                        (long long)p->tag[k]);
  return BASE_OK;
}
