/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The background grid: active cells, the nodes of their supports, slabs for threads. Everything is found by linear
 * merges of sorted keys, so that time and memory follow the active nodes. */
#include <string.h>

#include "mpm_core.h"

enum { MPM_SLAB = 4 /* layers of cells; >= support width - 1, so that slabs of one colour share no node */ };

static BaseStatus reserve_cells(MpmGrid *grid, int cells) {
  if (cells <= grid->cell_room && grid->cell_room > 0) return BASE_OK; /* without points the end mark needs room, too */
  const size_t room = (size_t)cells + (size_t)cells / 4 + 16, kept = (size_t)grid->cell_room;
  TRY(BASE_GROW(kept, room + 1, &grid->cell_key));
  TRY(BASE_GROW(kept, room + 1, &grid->cell_first));
  TRY(BASE_GROW(kept, room, &grid->cell_row));
  for (int colour = 0; colour < 2; colour++) TRY(BASE_GROW(0, 2 * room, &grid->slab[colour]));
  grid->cell_room = (int)room;
  return BASE_OK;
}

static BaseStatus reserve_nodes(MpmGrid *grid, int nodes, int thermal, int extended) {
  if (nodes <= grid->node_room) return BASE_OK;
  const size_t room = (size_t)nodes + (size_t)nodes / 4 + 16;
  TRY(BASE_GROW(0, room, &grid->index));
  TRY(BASE_GROW(0, room, &grid->sum));
  TRY(BASE_GROW(0, room, &grid->scale));
  TRY(BASE_GROW(0, room, &grid->lowest_tag));
  TRY(BASE_GROW(0, room, &grid->state));
  TRY(BASE_GROW(0, room, &grid->rate));
  if (extended) TRY(BASE_GROW(0, room, &grid->extended));
  if (extended) TRY(BASE_GROW(0, room, &grid->term));
  TRY(BASE_GROW(0, room, &grid->contact_of));
  TRY(BASE_GROW(0, room, &grid->view_mass));
  TRY(BASE_GROW(0, 3 * room, &grid->view_velocity));
  TRY(BASE_GROW(0, room, &grid->owned));
  if (thermal) {
    TRY(BASE_GROW(0, room, &grid->heat));
    TRY(BASE_GROW(0, room, &grid->view_temperature));
  }
  grid->node_room = (int)room;
  return BASE_OK;
}

void mpm_grid_free(MpmGrid *grid) {
  void *const memory[] = {
      grid->cell_key, grid->cell_first, grid->cell_row,   grid->index,      grid->slab[0],       grid->slab[1],
      grid->sum,      grid->heat,       grid->scale,      grid->lowest_tag, grid->state,         grid->rate,
      grid->extended, grid->term,       grid->contact_of, grid->view_mass,  grid->view_velocity, grid->view_temperature,
      grid->owned,    grid->dilated[0], grid->dilated[1]};
  for (size_t k = 0; k < sizeof memory / sizeof *memory; k++) base_free(memory[k]);
  for (int axis = 0; axis < 3; axis++)
    for (int w = 0; w < MPM_WIDTH_MAX; w++) base_free(grid->position[axis][w]);
  memset(grid, 0, sizeof *grid);
}

/* dilated[out] = sorted union of key[i] + w * stride, w < width; position[axis][w][i]: the place of each in it. */
static BaseStatus dilate(MpmGrid *grid, const uint64_t *key, int n, int axis, int width, int out, int *count) {
  const uint64_t stride = UINT64_C(1) << (axis * MPM_KEY_BITS);
  if (n > grid->position_room[axis]) {
    const size_t room = (size_t)n + (size_t)n / 4 + 16;
    for (int w = 0; w < width; w++) TRY(BASE_GROW(0, room, &grid->position[axis][w]));
    grid->position_room[axis] = (int)room;
  }
  if ((int64_t)n * width > INT32_MAX) return base_error(BASE_ERROR_MEMORY, "more than %d nodes", INT32_MAX);
  if (n * width > grid->dilated_room[out]) {
    const size_t room = (size_t)(n * width) + (size_t)n;
    TRY(BASE_GROW(0, room, &grid->dilated[out]));
    grid->dilated_room[out] = (int)room;
  }
  uint64_t *result = grid->dilated[out];
  int head[MPM_WIDTH_MAX] = {0, 0, 0}, m = 0;
  while (head[width - 1] < n) { /* the most shifted copy is the last to end */
    uint64_t least = UINT64_MAX;
    for (int w = 0; w < width; w++) {
      const uint64_t next = head[w] < n ? key[head[w]] + (uint64_t)w * stride : UINT64_MAX;
      least = next < least ? next : least;
    }
    for (int w = 0; w < width; w++)
      if (head[w] < n && key[head[w]] + (uint64_t)w * stride == least) grid->position[axis][w][head[w]++] = m;
    result[m++] = least;
  }
  *count = m;
  return BASE_OK;
}

static int unpack(uint64_t key, int axis) {
  return (int)(key >> (axis * MPM_KEY_BITS) & MPM_KEY_MASK) - MPM_KEY_BIAS;
}

/* Nodes = cells dilated along x, then y, then z. The nodes of a row of a support are neighbours in the sorted list. */
static BaseStatus build_nodes(Mpm *mpm) {
  MpmGrid *grid = &mpm->grid;
  const int width = mpm_width(mpm), dimension = mpm->scene.dimension, depth = dimension == 3 ? width : 1;
  int count[3];
  TRY(dilate(grid, grid->cell_key, grid->cells, 0, width, 0, &count[0]));
  TRY(dilate(grid, grid->dilated[0], count[0], 1, width, 1, &count[1]));
  if (dimension == 3) TRY(dilate(grid, grid->dilated[1], count[1], 2, width, 0, &count[2]));
  grid->nodes = count[dimension - 1];
  TRY(reserve_nodes(grid, grid->nodes, mpm->scene.thermal, mpm->scene.transfer == MPM_TRANSFER_XPIC));
  grid->node_key = grid->dilated[dimension == 3 ? 0 : 1];
  for (int n = 0; n < grid->nodes; n++)
    for (int i = 0; i < 3; i++) grid->index[n][i] = i < dimension ? unpack(grid->node_key[n], i) : 0;
  for (int cell = 0; cell < grid->cells; cell++)
    for (int c = 0; c < depth; c++)
      for (int b = 0; b < width; b++) {
        const int node = grid->position[1][b][grid->position[0][0][cell]];
        grid->cell_row[cell][b + width * c] = dimension == 3 ? grid->position[2][c][node] : node;
      }
  return BASE_OK;
}

/* Slabs by global index: which points share a slab does not depend on the rank. */
static void build_slabs(Mpm *mpm) {
  MpmGrid *grid = &mpm->grid;
  const int shift = MPM_KEY_BITS * (mpm->scene.dimension - 1);
  grid->slabs[0] = grid->slabs[1] = 0;
  for (int cell = 0; cell < grid->cells;) {
    const uint64_t slab = (grid->cell_key[cell] >> shift) / MPM_SLAB;
    const int colour = (int)(slab & 1), first = cell;
    while (cell < grid->cells && (grid->cell_key[cell] >> shift) / MPM_SLAB == slab) cell++;
    int *range = grid->slab[colour] + 2 * grid->slabs[colour]++;
    range[0] = first, range[1] = cell;
  }
}

BaseStatus mpm_grid_build(Mpm *mpm) {
  MpmGrid *grid = &mpm->grid;
  const MpmPoints *points = &mpm->points;
  int cells = 0;
  for (int k = 0; k < points->count; k++) cells += k == 0 || points->item[k].cell != points->item[k - 1].cell;
  TRY(reserve_cells(grid, cells));

  int changed = cells != grid->cells, cell = 0;
  for (int k = 0; k < points->count; k++) {
    const uint64_t key = points->item[k].cell;
    if (k > 0 && key == points->item[k - 1].cell) continue;
    changed |= grid->cell_key[cell] != key;
    grid->cell_key[cell] = key;
    grid->cell_first[cell++] = k;
  }
  grid->cell_first[cells] = points->count;
  grid->cells = cells;
  if (!changed) return BASE_OK;
  const BaseStatus status = build_nodes(mpm);
  if (status != BASE_OK) {
    grid->cells = grid->nodes = 0; /* no half-built grid that looks current */
    return status;
  }
  build_slabs(mpm);
  return BASE_OK;
}
