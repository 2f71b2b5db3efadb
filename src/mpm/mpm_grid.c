/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The background grid: active cells, the nodes of their supports, slabs for threads. Everything is found by linear
 * merges of sorted keys, so that time and memory follow the active nodes. */
#include <string.h>

#include "mpm_core.h"

enum { MPM_SLAB = 2 /* layers of cells; >= support width - 1, so that slabs of one colour share no node */ };

BaseStatus mpm_grid_reserve_cells(MpmGrid *grid, int cells) {
  if (cells <= grid->cell_room && grid->cell_room > 0) return BASE_OK; /* without points the end mark needs room, too */
  const size_t room = (size_t)cells + (size_t)cells / 4 + 16, kept = (size_t)grid->cell_room;
  TRY(BASE_GROW(kept, room + 1, &grid->cell_key));
  TRY(BASE_GROW(kept + 1, room + 1, &grid->cell_first));
  TRY(BASE_GROW(0, room + 1, &grid->next_key));
  TRY(BASE_GROW(0, room + 1, &grid->next_first));
  TRY(BASE_GROW(kept, room, &grid->cell_row));
  TRY(BASE_GROW(kept, room + 1, &grid->run_first));
  for (int colour = 0; colour < 2; colour++) TRY(BASE_GROW(2 * kept, 2 * room, &grid->slab[colour]));
  grid->cell_room = (int)room;
  return BASE_OK;
}

static BaseStatus reserve_nodes(MpmGrid *grid, int nodes, const MpmScene *scene) {
  if (nodes <= grid->node_room) return BASE_OK;
  const size_t room = (size_t)nodes + (size_t)nodes / 4 + 16;
  TRY(BASE_GROW(0, room, &grid->index));
  TRY(BASE_GROW(0, room, &grid->sum));
  TRY(BASE_GROW(0, room, &grid->scale));
  TRY(BASE_GROW(0, room, &grid->lowest_tag));
  TRY(BASE_GROW(0, room, &grid->state));
  TRY(BASE_GROW(0, room, &grid->rate));
  if (scene->transfer == MPM_TRANSFER_XPIC) {
    TRY(BASE_GROW(0, room, &grid->extended));
    TRY(BASE_GROW(0, room, &grid->term));
  }
  if (scene->volumetric == MPM_VOLUMETRIC_CELL) TRY(BASE_GROW(0, room, &grid->cell_sum));
  TRY(BASE_GROW(0, room, &grid->contact_of));
  TRY(BASE_GROW(0, room, &grid->view_mass));
  TRY(BASE_GROW(0, 3 * room, &grid->view_velocity));
  TRY(BASE_GROW(0, room, &grid->owned));
  if (scene->thermal) {
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
      grid->owned,    grid->dilated[0], grid->dilated[1], grid->run,        grid->run_first,     grid->next_key,
      grid->next_first, grid->cell_sum};
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
  TRY(reserve_nodes(grid, grid->nodes, &mpm->scene));
  grid->node_key = grid->dilated[dimension == 3 ? 0 : 1];
  grid->has_index = 0;
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

void mpm_grid_find_index(Mpm *mpm) {
  MpmGrid *grid = &mpm->grid;
  if (grid->has_index) return;
  for (int n = 0; n < grid->nodes; n++)
    for (int i = 0; i < 3; i++) grid->index[n][i] = i < mpm->scene.dimension ? unpack(grid->node_key[n], i) : 0;
  grid->has_index = 1;
}

/* ------------------------------------------------------------------------------------------------------- cells */

static BaseStatus add_run(MpmGrid *grid, int first, int end) {
  if (grid->runs == grid->run_room) {
    const size_t room = 2 * (size_t)grid->run_room + 256;
    TRY(BASE_GROW((size_t)grid->runs, room, &grid->run));
    grid->run_room = (int)room;
  }
  grid->run[grid->runs][0] = first, grid->run[grid->runs++][1] = end;
  return BASE_OK;
}

/* The stretches of rows of one cell, own and foreign merged by tag. */
static BaseStatus add_runs(MpmGrid *grid, const MpmPoints *p, const int own[2], const int foreign[2]) {
  int i = own[0], j = foreign[0];
  while (i < own[1] || j < foreign[1]) {
    int *row = j == foreign[1] || (i < own[1] && p->tag[i] <= p->tag[j]) ? &i : &j;
    const int is_own = row == &i, end = is_own ? own[1] : foreign[1], other = is_own ? j : i;
    const int is_last = is_own ? j == foreign[1] : i == own[1], first = *row;
    if (!is_last && p->tag[i] == p->tag[j])
      return base_error(BASE_ERROR_ARGUMENT, "point %lld: its tag occurs twice; tags must be unique",
                        (long long)p->tag[i]);
    while (*row < end && (is_last || p->tag[*row] < p->tag[other])) ++*row;
    TRY(add_run(grid, first, *row));
  }
  return BASE_OK;
}

static int cell_end(const MpmPoints *p, int row, int end, uint64_t key) {
  int k = row;
  while (k < end && p->key[k] == key) k++;
  return k;
}

/* Cells of own and foreign points. */
static BaseStatus list_cells(Mpm *mpm) {
  MpmGrid *grid = &mpm->grid;
  const MpmPoints *p = &mpm->points;
  const int own_end = p->count ? p->own : 0, end = p->count;
  int cells = 0, own = 0, foreign = own_end;
  grid->runs = 0;
  while (own < own_end || foreign < end) {
    const int own_first = foreign == end || (own < own_end && p->key[own] <= p->key[foreign]);
    const uint64_t key = p->key[own_first ? own : foreign];
    if (cells == grid->cell_room) TRY(mpm_grid_reserve_cells(grid, cells + 1));
    const int own_range[2] = {own, cell_end(p, own, own_end, key)};
    const int foreign_range[2] = {foreign, cell_end(p, foreign, end, key)};
    grid->has_changed |= cells >= grid->cells || grid->cell_key[cells] != key;
    grid->cell_key[cells] = key;
    grid->cell_first[cells] = own;
    grid->run_first[cells++] = grid->runs;
    if (p->foreign > 0) TRY(add_runs(grid, p, own_range, foreign_range));
    own = own_range[1], foreign = foreign_range[1];
  }
  TRY(mpm_grid_reserve_cells(grid, cells));
  grid->has_changed |= cells != grid->cells;
  grid->cells = cells;
  grid->cell_first[cells] = own;
  grid->run_first[cells] = grid->runs;
  return BASE_OK;
}

/* -------------------------------------------------------------------------------- what follows from the cells */

/* The row of a cell's lowest tag. */
static int first_row(const MpmGrid *grid, const MpmPoints *p, int cell) {
  return p->foreign > 0 ? grid->run[grid->run_first[cell]][0] : grid->cell_first[cell];
}

static double largest_mass(const MpmGrid *grid, const MpmPoints *p, int cell) {
  double mass = 0.0;
  for (int k = grid->cell_first[cell]; k < grid->cell_first[cell + 1]; k++)
    mass = p->position[k][0] > mass ? p->position[k][0] : mass;
  for (int r = grid->run_first[cell]; p->foreign > 0 && r < grid->run_first[cell + 1]; r++)
    for (int k = grid->run[r][0]; k < grid->run[r][1]; k++) mass = p->position[k][0] > mass ? p->position[k][0] : mass;
  return mass;
}

/* Whose a node is, and the largest mass around it. Without foreign points, and with equal masses, it is known. */
static void describe_nodes(Mpm *mpm) {
  MpmGrid *grid = &mpm->grid;
  const MpmPoints *p = &mpm->points;
  const int width = mpm_width(mpm), rows = mpm->scene.dimension == 3 ? width * width : width;
  const int with_mass = p->mass_low != p->mass_high, with_owner = p->foreign > 0;
  const double uniform = with_mass || with_owner ? 0.0 : p->mass_low;
  if (!grid->has_changed && uniform > 0.0 && grid->uniform_scale == uniform) return;
  grid->uniform_scale = uniform;
  for (int n = 0; n < grid->nodes; n++) {
    grid->scale[n] = with_mass ? 0.0 : p->mass_low;
    grid->owned[n] = 1;
    if (with_owner) grid->lowest_tag[n] = INT64_MAX;
  }
  if (!with_mass && !with_owner) return;
  for (int cell = 0; cell < grid->cells; cell++) {
    const int lowest = first_row(grid, p, cell);
    const double mass = with_mass ? largest_mass(grid, p, cell) : p->mass_low;
    for (int r = 0; r < rows; r++)
      for (int a = 0; a < width; a++) {
        const int n = grid->cell_row[cell][r] + a;
        grid->scale[n] = mass > grid->scale[n] ? mass : grid->scale[n];
        if (!with_owner || p->tag[lowest] >= grid->lowest_tag[n]) continue;
        grid->lowest_tag[n] = p->tag[lowest];
        grid->owned[n] = lowest < p->own;
      }
  }
}

BaseStatus mpm_grid_build(Mpm *mpm) {
  MpmGrid *grid = &mpm->grid;
  if (grid->is_current && !mpm->points.has_moved && !mpm->halo) return BASE_OK;
  const int is_listed = grid->is_current && !mpm->halo; /* by mpm_points_order() */
  grid->has_changed |= !grid->is_current;
  grid->is_current = 0; /* no half-built grid that looks current */
  if (!is_listed) TRY(list_cells(mpm));
  if (grid->has_changed) {
    TRY(build_nodes(mpm));
    build_slabs(mpm);
  }
  describe_nodes(mpm);
  mpm_share_set(mpm);
  grid->is_current = 1;
  grid->has_changed = 0;
  mpm->points.has_moved = 0;
  return BASE_OK;
}
