/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The order of own points by (cell, tag), from step to step. Few points change their cell in a step: only those are
 * sorted, and rows move only in such steps, in place. */
#include <math.h>
#include <string.h>

#include "mpm_kernel.h"

/* ------------------------------------------------------------------------------------------------------ movers */

MPM_INLINE MpmVec half_of(const MpmPoints *p, int k) { return p->half ? p->half[k] : mpm_vec_all(0.5); }

void mpm_mark_cell(Mpm *mpm, int cell) {
  MpmPoints *p = &mpm->points;
  const MpmGrid *grid = &mpm->grid;
  const int dimension = mpm->scene.dimension;
  const MpmCellBase base = mpm_cell_base(mpm, cell, dimension);
  for (int k = grid->cell_first[cell]; k < grid->cell_first[cell + 1]; k++)
    p->moves[k] = !mpm_axes_all(mpm_is_in_cell(mpm, mpm->scene.shape, p->position[k], half_of(p, k), &base), dimension);
}

void mpm_points_forget_movers(Mpm *mpm) {
  MpmPoints *p = &mpm->points;
  if (p->movers_known) memset(p->moves, 0, (size_t)p->own);
  p->movers_known = 0;
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

/* Marks the rows of some cells that leave, as G2P does where nothing changes positions afterwards. */
MPM_CLONES static void mark_cells(Mpm *mpm, int first, int end) {
  const MpmPoints *p = &mpm->points;
  const MpmGrid *grid = &mpm->grid;
  const int dimension = mpm->scene.dimension;
  for (int cell = first; cell < end; cell++) {
    const MpmCellBase base = mpm_cell_base(mpm, cell, dimension);
    MpmMask stay = {-1, -1, -1, -1}, finite = stay;
    for (int k = grid->cell_first[cell]; k < grid->cell_first[cell + 1]; k++) {
      const MpmVec sum = p->position[k] + p->motion[k] + p->force[k];
      stay &= mpm_is_in_cell(mpm, mpm->scene.shape, p->position[k], half_of(p, k), &base);
      finite &= sum - sum == 0.0;
    }
    if (!mpm_axes_all(stay, dimension)) mpm_mark_cell(mpm, cell);
    if (!mpm_mask_all(finite))
      for (int k = grid->cell_first[cell]; k < grid->cell_first[cell + 1]; k++) note_fault(mpm, k);
  }
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

static void find_movers(Mpm *mpm) {
#pragma omp parallel for schedule(static) num_threads(mpm->threads) if (mpm_is_parallel(mpm))
  for (int first = 0; first < mpm->grid.cells; first += MPM_CHUNK)
    mark_cells(mpm, first, first + MPM_CHUNK < mpm->grid.cells ? first + MPM_CHUNK : mpm->grid.cells);
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

static int list_items(Mpm *mpm) {
  MpmPoints *p = &mpm->points;
  const int movers = list_movers(p, p->mover);
#pragma omp parallel for num_threads(mpm->threads) if (mpm_is_parallel(mpm) && movers > 200)
  for (int m = 0; m < movers; m++) {
    const int k = p->mover[m];
    p->key[k] = mpm_find_cell(mpm, p->position[k], half_of(p, k), p->tag[k]);
    p->item[m] = (MpmItem){p->key[k], p->tag[k], k};
  }
  mpm_sort_items(&p->item, &p->spare_item, movers);
  return movers;
}

/* ---------------------------------------------------------------------------------------------------- new places */

/* One sweep over the old cells: rows before `row` have got places, those before `next`. */
typedef struct Sweep {
  MpmPoints *points;
  MpmGrid *grid;
  int movers, left, item; /* next row that leaves, next that arrives */
  int row, next, cells;
  int shift;              /* sign of row - next in the open region */
  int has_changed;        /* cells appeared or vanished */
  int64_t twice;          /* tag of two points of one cell, or 0 */
} Sweep;

static void close_region(Sweep *s, int shift) {
  MpmPoints *p = s->points;
  if (s->shift != 0) p->region[p->regions - 1].end = s->next;
  if (shift != 0) p->region[p->regions++] = (MpmRegion){s->next, 0, shift > 0};
  s->shift = shift;
}

/* The next `count` rows stay in their order. */
static void keep_stretch(Sweep *s, int count) {
  const int by = s->row - s->next, shift = (by > 0) - (by < 0);
  if (count <= 0) return;
  if (shift != s->shift) close_region(s, shift);
  if (shift != 0)
    for (int k = s->next; k < s->next + count; k++) s->points->source[k] = k + by;
  s->row += count, s->next += count;
}

/* The same for rows up to `stop`, but for those that leave. */
static void keep_rows(Sweep *s, int stop) {
  const MpmPoints *p = s->points;
  for (; s->left < s->movers && p->mover[s->left] < stop; s->left++) {
    keep_stretch(s, p->mover[s->left] - s->row);
    s->row++;
  }
  keep_stretch(s, stop - s->row);
}

static void place_item(Sweep *s) {
  MpmPoints *p = s->points;
  p->source[s->next] = s->next;
  p->fetch[p->fetches++] = (MpmFetch){s->next++, p->item[s->item++].index};
}

static void add_cell(Sweep *s, uint64_t key, int first) {
  s->grid->next_key[s->cells] = key;
  s->grid->next_first[s->cells++] = first;
}

/* Cells before `key` that had no rows. */
static void add_new_cells(Sweep *s, uint64_t key) {
  const MpmPoints *p = s->points;
  while (s->item < s->movers && p->item[s->item].cell < key) {
    const uint64_t cell = p->item[s->item].cell;
    add_cell(s, cell, s->next);
    s->has_changed = 1;
    for (place_item(s); s->item < s->movers && p->item[s->item].cell == cell; place_item(s))
      if (p->item[s->item].tag == p->item[s->item - 1].tag) s->twice = p->item[s->item].tag;
  }
}

static void sweep_cell(Sweep *s, int cell) {
  const MpmPoints *p = s->points;
  const uint64_t key = s->grid->cell_key[cell];
  const int first = s->grid->cell_first[cell], end = s->grid->cell_first[cell + 1];
  if ((s->item == s->movers || p->item[s->item].cell > key) && (s->left == s->movers || p->mover[s->left] >= end)) {
    add_cell(s, key, s->next + (first - s->row));
    return;
  }
  keep_rows(s, first);
  add_new_cells(s, key);
  const int start = s->next;
  for (int row = first; s->item < s->movers && p->item[s->item].cell == key; place_item(s)) {
    const int64_t tag = p->item[s->item].tag;
    while (row < end && p->tag[row] < tag) row++;
    if ((row < end && p->tag[row] == tag) || (s->next > start && s->item > 0 && p->item[s->item - 1].cell == key &&
                                              p->item[s->item - 1].tag == tag))
      s->twice = tag;
    keep_rows(s, row);
  }
  keep_rows(s, end);
  if (s->next > start) add_cell(s, key, start);
  else s->has_changed = 1;
}

/* mover: rows that leave, upwards; items: the same, by (cell, tag). Finds every row's new place and the new cells. */
static BaseStatus find_places(Mpm *mpm, int movers) {
  MpmPoints *p = &mpm->points;
  MpmGrid *grid = &mpm->grid;
  Sweep s = {.points = p, .grid = grid, .movers = movers};
  p->regions = p->fetches = 0;
  TRY(mpm_grid_reserve_cells(grid, grid->cells + movers));
  for (int cell = 0; cell < grid->cells; cell++) sweep_cell(&s, cell);
  keep_rows(&s, p->own);
  add_new_cells(&s, UINT64_MAX);
  close_region(&s, 0);
  if (s.twice) /* the order of sums would be ambiguous */
    return base_error(BASE_ERROR_ARGUMENT, "point %lld: its tag occurs twice; tags must be unique", (long long)s.twice);
  if (mpm->halo) return BASE_OK; /* cells are found anew, with those of foreign points */
  uint64_t *key = grid->cell_key;
  int *first = grid->cell_first;
  grid->cell_key = grid->next_key, grid->next_key = key;
  grid->cell_first = grid->next_first, grid->next_first = first;
  grid->cells = s.cells;
  grid->cell_first[s.cells] = p->own;
  grid->has_changed |= s.has_changed;
  return BASE_OK;
}

/* ------------------------------------------------------------------------------------------------------ moving */

/* A part of the rows is filled by one thread. What comes from other parts is fetched, as rows that cross others are,
 * before anything moves. */
static int part_first(const MpmPoints *p, int part, int parts) { return (int)((int64_t)p->own * part / parts); }

static void fetch_row(MpmPoints *p, int row) {
  if (p->source[row] == row) return;
  p->fetch[p->fetches++] = (MpmFetch){row, p->source[row]};
  p->source[row] = row;
}

/* The rows of a region that come from beyond `border`. Their old places follow each other as the new ones do. */
static void fetch_across(MpmPoints *p, const MpmRegion *region, int border) {
  if (region->down) {
    for (int k = (region->end < border ? region->end : border) - 1; k >= region->first; k--) {
      if (p->source[k] != k && p->source[k] < border) return;
      fetch_row(p, k);
    }
  } else {
    for (int k = region->first > border ? region->first : border; k < region->end; k++) {
      if (p->source[k] != k && p->source[k] >= border) return;
      fetch_row(p, k);
    }
  }
}

MPM_INLINE void copy_row(char *rows, size_t width, int to, const char *other, int from) {
  uint64_t word[4];
  const size_t bytes = width < sizeof word ? width : sizeof word;
  for (size_t done = 0; done < width; done += bytes) { /* affine: 32, 32 and 8 bytes */
    const size_t now = width - done < bytes ? width - done : bytes;
    memcpy(word, other + (size_t)from * width + done, now);
    memcpy(rows + (size_t)to * width + done, word, now);
  }
}

MPM_INLINE MpmRegion clip(MpmRegion region, int low, int high) {
  return (MpmRegion){region.first > low ? region.first : low, region.end < high ? region.end : high, region.down};
}

/* Rows keep their order, so that none overwrites what another still needs if those that go down are moved upwards and
 * then those that go up downwards. */
MPM_INLINE void move_part(const MpmPoints *p, const MpmPlane *plane, size_t width, int low, int high) {
  char *rows;
  memcpy(&rows, plane->rows, sizeof rows);
  const int *const source = p->source;
  for (int n = 0; n < p->regions; n++) {
    const MpmRegion r = clip(p->region[n], low, high);
    for (int k = r.first; r.down && k < r.end; k++) copy_row(rows, width, k, rows, source[k]);
  }
  for (int n = p->regions - 1; n >= 0; n--) {
    const MpmRegion r = clip(p->region[n], low, high);
    for (int k = r.end - 1; !r.down && k >= r.first; k--) copy_row(rows, width, k, rows, source[k]);
  }
}

MPM_INLINE void fetch_part(const MpmPoints *p, const MpmPlane *plane, size_t width, int first, int end) {
  char *rows, *spare = plane->spare;
  const MpmFetch *const fetch = p->fetch;
  memcpy(&rows, plane->rows, sizeof rows);
  for (int n = first; n < end; n++) copy_row(spare, width, n, rows, fetch[n].from);
}

MPM_INLINE void put_part(const MpmPoints *p, const MpmPlane *plane, size_t width, int first, int end) {
  char *rows, *spare = plane->spare;
  const MpmFetch *const fetch = p->fetch;
  memcpy(&rows, plane->rows, sizeof rows);
  for (int n = first; n < end; n++) copy_row(rows, width, fetch[n].to, spare, n);
}

/* Calls body(p, plane, width, first, end); the usual widths are constants. */
#define BY_WIDTH(body, first, end)                                    \
  for (int n = 0; n < p->planes; n++) {                               \
    const MpmPlane *plane = &p->plane[n];                             \
    if (!plane->moves || plane->is_uniform) continue;                 \
    if (plane->width == 4) body(p, plane, 4, first, end);             \
    else if (plane->width == 8) body(p, plane, 8, first, end);        \
    else if (plane->width == 32) body(p, plane, 32, first, end);      \
    else body(p, plane, plane->width, first, end);                    \
  }
MPM_CLONES static void fetch_rows(const MpmPoints *p, int first, int end) { BY_WIDTH(fetch_part, first, end) }
MPM_CLONES static void move_rows(const MpmPoints *p, int low, int high) { BY_WIDTH(move_part, low, high) }
MPM_CLONES static void put_rows(const MpmPoints *p, int first, int end) { BY_WIDTH(put_part, first, end) }

/* Equal rows of what no step changes need not move. */
static void find_uniform(MpmPoints *p) {
  for (int n = 0; n < p->planes && !p->uniform_known; n++) {
    MpmPlane *plane = &p->plane[n];
    const char *rows;
    memcpy(&rows, plane->rows, sizeof rows);
    plane->is_uniform = plane->is_constant;
    for (int k = 1; k < p->own && plane->is_uniform; k++)
      plane->is_uniform = memcmp(rows, rows + (size_t)k * plane->width, plane->width) == 0;
  }
  p->uniform_known = 1;
}

static void move_all(Mpm *mpm) {
  MpmPoints *p = &mpm->points;
  const int parts = mpm_is_parallel(mpm) ? mpm->threads : 1;
  for (int part = 1; part < parts; part++)
    for (int n = 0; n < p->regions; n++) fetch_across(p, &p->region[n], part_first(p, part, parts));
#pragma omp parallel num_threads(mpm->threads) if (parts > 1)
  {
    const int64_t fetches = p->fetches;
#pragma omp for schedule(static, 1)
    for (int t = 0; t < parts; t++) fetch_rows(p, (int)(fetches * t / parts), (int)(fetches * (t + 1) / parts));
#pragma omp for schedule(static, 1)
    for (int t = 0; t < parts; t++) move_rows(p, part_first(p, t, parts), part_first(p, t + 1, parts));
#pragma omp for schedule(static, 1)
    for (int t = 0; t < parts; t++) put_rows(p, (int)(fetches * t / parts), (int)(fetches * (t + 1) / parts));
  }
}

BaseStatus mpm_points_order(Mpm *mpm) {
  MpmPoints *p = &mpm->points;
  if (mpm->scene.gimp_stretch) {
    mpm_points_forget_movers(mpm);
    stretch_domains(mpm);
  }
  if (!p->movers_known) find_movers(mpm);
  p->movers_known = 0;
  const int movers = list_items(mpm);
  if (movers == 0 || mpm->point_tag != INT64_MAX) return BASE_OK;
  TRY(find_places(mpm, movers));
  find_uniform(p);
  move_all(mpm);
  p->has_moved = 1;
  return BASE_OK;
}
