/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Surfaces: which nodes they hold, and which points are near them.
 *
 * A surface is thin, and the grid has one velocity per node. So the points near a surface are told apart first: in
 * front of it or behind it, by the facet nearest to them; points whose nearest is the rim (the outlet edge of a hopper)
 * belong to neither. A node receives mass from points in front, from points behind, or from both. For each side that it has
 * mass of, it is held as by a plane if
 *   - it projects into a facet and is closer to it than half a cell, or
 *   - it lies further behind the surface, seen from that side, and most of the mass of both sides is of that side.
 * A node held for both sides has no normal motion. Behind the surface only the nearest facet acts (all that share the
 * nearest edge or corner); where the surface is convex, seen from the points, one facet acts as for a box. A plane on
 * grid nodes and a flat surface there hold the same nodes: the next layer is a whole cell away.
 *
 * Sums run over the sorted points, so they are the same on all ranks; so is the order of contacts. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "mpm_facet.h"
#include "mpm_kernel.h"

static const double ROUND_OFF = 1e-8; /* of the spacing */
static const double BAND = 0.5;       /* of the spacing */
static const double LEAST_SHARE = 0.01; /* of a node's mass near the surface: less does not hold it for that side */
static const double NEAR = 1.5;       /* of the spacing: points in reach of flux and guard */

/* Rows of a cell, own and foreign, in the order of tags. */
#define FOR_ROWS(mpm, cell, k)                                                                                \
  for (MpmRuns runs_ = mpm_cell_runs(mpm, cell), *all_ = &runs_; all_; all_ = NULL)                            \
    for (int run_ = 0; run_ < runs_.count; run_++)                                                             \
      for (int k = runs_.run ? runs_.run[run_][0] : runs_.own[0], end_ = runs_.run ? runs_.run[run_][1] : runs_.own[1]; \
           k < end_; k++)

typedef struct MpmNearest {
  MpmFacetNearest at; /* distance INFINITY: no facet in reach */
  double normal[3];
} MpmNearest;

/* A facet in reach of a node. */
typedef struct MpmCandidate {
  int node, order;
  MpmFacetNearest at;
  double normal[3], centre[3];
} MpmCandidate;

/* Half the width of the neighbourhood of a surface: nodes in the band and all points that may give them mass. */
static double reach_of(const Mpm *mpm) { return mpm_largest_spacing(mpm) * (BAND + 1.5 * sqrt(mpm->scene.dimension)); }

/* -------------------------------------------------------------------- cells and nodes in a box, by their sorted keys */

typedef struct Sweep {
  const uint64_t *key;
  int count, low[3], high[3];
  int row[2]; /* y, z */
  int at;     /* next index in this row; -1: row to be found */
} Sweep;

static uint64_t pack(int x, int y, int z, int dimension) {
  uint64_t key = (uint64_t)(x + MPM_KEY_BIAS) | (uint64_t)(y + MPM_KEY_BIAS) << MPM_KEY_BITS;
  return dimension == 3 ? key | (uint64_t)(z + MPM_KEY_BIAS) << (2 * MPM_KEY_BITS) : key;
}

static int first_not_below(const uint64_t *key, int count, uint64_t value) {
  int low = 0, high = count;
  while (low < high) {
    const int middle = low + (high - low) / 2;
    if (key[middle] < value) low = middle + 1;
    else high = middle;
  }
  return low;
}

/* Index of the next key in the box, or -1. */
static int next_in(Sweep *sweep, int dimension) {
  for (; sweep->row[1] <= sweep->high[2]; sweep->row[1]++, sweep->row[0] = sweep->low[1])
    for (; sweep->row[0] <= sweep->high[1]; sweep->row[0]++, sweep->at = -1) {
      if (sweep->at < 0)
        sweep->at = first_not_below(sweep->key, sweep->count,
                                    pack(sweep->low[0], sweep->row[0], sweep->row[1], dimension));
      if (sweep->at < sweep->count && sweep->low[0] <= sweep->high[0] &&
          sweep->key[sweep->at] <= pack(sweep->high[0], sweep->row[0], sweep->row[1], dimension))
        return sweep->at++;
    }
  return -1;
}

/* Keys of the part of the active grid within `reach` of the facet; `before`: cells before it that count, too. */
static Sweep sweep_around(const Mpm *mpm, const MpmFacet *facet, int bounds[2][3], double reach, double before) {
  const MpmScene *scene = &mpm->scene;
  Sweep sweep = {.at = -1};
  for (int i = 0; i < scene->dimension; i++) {
    double low = INFINITY, high = -INFINITY;
    for (int n = 0; n < scene->dimension; n++) {
      low = fmin(low, facet->node[n][i]);
      high = fmax(high, facet->node[n][i]);
    }
    low = floor((low - reach - scene->origin[i]) * mpm->per_length[1 + i] - before);
    high = ceil((high + reach - scene->origin[i]) * mpm->per_length[1 + i]);
    sweep.low[i] = (int)fmin(fmax(low, bounds[0][i]), bounds[1][i] + 1.0); /* beyond the grid: empty */
    sweep.high[i] = (int)fmax(fmin(high, bounds[1][i]), bounds[0][i] - 1.0);
  }
  sweep.row[0] = sweep.low[1], sweep.row[1] = sweep.low[2];
  return sweep;
}

static void find_bounds(const MpmGrid *grid, int bounds[2][3]) {
  for (int i = 0; i < 3; i++) bounds[0][i] = bounds[1][i] = grid->nodes > 0 ? grid->index[0][i] : 0;
  for (int n = 0; n < grid->nodes; n++)
    for (int i = 0; i < 3; i++) {
      if (grid->index[n][i] < bounds[0][i]) bounds[0][i] = grid->index[n][i];
      if (grid->index[n][i] > bounds[1][i]) bounds[1][i] = grid->index[n][i];
    }
}

/* ----------------------------------------------------------------------------------------------------------- points */

/* The nearest facet of each point; among facets equally near, which share an edge, the one that sees the point most
 * from above: its sign is the right one. */
static void meet_points(Mpm *mpm, const MpmFacet *facet, int bounds[2][3]) {
  const MpmScene *scene = &mpm->scene;
  const double reach = reach_of(mpm), tolerance = ROUND_OFF * scene->spacing;
  Sweep sweep = sweep_around(mpm, facet, bounds, reach, 1.5);
  sweep.key = mpm->grid.cell_key, sweep.count = mpm->grid.cells;
  for (int cell; (cell = next_in(&sweep, scene->dimension)) >= 0;)
    FOR_ROWS(mpm, cell, k) {
      const MpmVec place = mpm->points.position[k];
      const double x[3] = {place[1], place[2], place[3]};
      MpmNearest *best = &mpm->wall_scratch.nearest[k], trial;
      mpm_facet_nearest(facet, scene->dimension, x, tolerance, &trial.at);
      if (trial.at.distance > reach) continue;
      const double closer = best->at.distance - trial.at.distance;
      if (!(closer > tolerance || (closer >= -tolerance && fabs(trial.at.height) > fabs(best->at.height)))) continue;
      memcpy(trial.normal, facet->normal, sizeof trial.normal);
      *best = trial;
    }
}

/* 0: in front, 1: behind. A surface of one side has all points on it. */
static int side_of(const MpmWall *wall, double height) {
  return wall->sides == MPM_SIDE_FRONT ? 0 : wall->sides == MPM_SIDE_BACK ? 1 : height < 0.0;
}

static void add_side_mass(Mpm *mpm, const MpmCellBase *base, int cell, int k, int side) {
  const MpmShape shape = mpm->scene.shape;
  const int dimension = mpm->scene.dimension, width = mpm_shape_width(shape), rows = dimension == 3 ? width * width : width;
  MpmWeights w;
  mpm_find_weights(mpm, k, base, shape, &w);
  for (int r = 0; r < rows; r++)
    for (int a = 0; a < width; a++)
      mpm->wall_scratch.side_mass[mpm->grid.cell_row[cell][r] + a][side] +=
          mpm->points.position[k][0] * w.value[a][1] * mpm_across(w.value, w.value, r, dimension, width);
}

static BaseStatus add_near(Mpm *mpm, int w, int k, int side) {
  MpmWallScratch *scratch = &mpm->wall_scratch;
  const MpmScene *scene = &mpm->scene;
  const MpmNearest *nearest = &scratch->nearest[k];
  if (scratch->nears == scratch->near_room) {
    const size_t room = 2 * (size_t)scratch->near_room + 256;
    TRY(BASE_GROW((size_t)scratch->nears, room, &scratch->near));
    scratch->near_room = (int)room;
  }
  const double sign = side == 0 ? 1.0 : -1.0, height = sign * nearest->at.height;
  const int is_flat = nearest->at.is_inside || height <= 0.0;
  MpmNear near = {.row = k, .wall = w, .distance = is_flat ? height : nearest->at.distance};
  for (int i = 0; i < scene->dimension; i++) {
    near.place[i] = mpm->points.position[k][1 + i];
    near.velocity[i] = nearest->at.velocity[i];
    near.normal[i] = is_flat ? sign * nearest->normal[i] : (near.place[i] - nearest->at.point[i]) / near.distance;
  }
  if (mpm_wall_in_range(&mpm->walls[w], scene->dimension, near.place, 0.0)) scratch->near[scratch->nears++] = near;
  return BASE_OK;
}

static BaseStatus sort_points_by_side(Mpm *mpm, int w) {
  const MpmWall *wall = &mpm->walls[w];
  for (int n = 0; n < mpm->grid.nodes; n++)
    mpm->wall_scratch.side_mass[n][0] = mpm->wall_scratch.side_mass[n][1] = 0.0;
  for (int cell = 0; cell < mpm->grid.cells; cell++)
    FOR_ROWS(mpm, cell, k) {
      const MpmFacetNearest *at = &mpm->wall_scratch.nearest[k].at;
      if (at->distance == INFINITY || at->is_rim) continue;
      const int side = side_of(wall, at->height);
      const MpmCellBase base = mpm_cell_base(mpm, cell, mpm->scene.dimension);
      add_side_mass(mpm, &base, cell, k, side);
      if (k < mpm->points.own && at->distance <= NEAR * mpm_largest_spacing(mpm))
        TRY(add_near(mpm, w, k, side));
    }
  return BASE_OK;
}

/* ------------------------------------------------------------------------------------------------------------ nodes */

static BaseStatus meet_nodes(Mpm *mpm, const MpmWall *wall, const MpmFacet *facet, int order, int bounds[2][3]) {
  const MpmScene *scene = &mpm->scene;
  MpmWallScratch *scratch = &mpm->wall_scratch;
  const double reach = reach_of(mpm), tolerance = ROUND_OFF * scene->spacing;
  Sweep sweep = sweep_around(mpm, facet, bounds, reach, 0.0);
  sweep.key = mpm->grid.node_key, sweep.count = mpm->grid.nodes;
  for (int n; (n = next_in(&sweep, scene->dimension)) >= 0;) {
    if (scratch->side_mass[n][0] == 0.0 && scratch->side_mass[n][1] == 0.0) continue;
    double x[3];
    mpm_node_place(mpm, n, x);
    MpmCandidate candidate = {.node = n, .order = order};
    mpm_facet_nearest(facet, scene->dimension, x, tolerance, &candidate.at);
    if (candidate.at.distance > reach || !mpm_wall_in_range(wall, scene->dimension, x, tolerance)) continue;
    for (int i = 0; i < 3; i++) {
      candidate.normal[i] = facet->normal[i];
      for (int m = 0; m < scene->dimension; m++) candidate.centre[i] += facet->node[m][i] / scene->dimension;
    }
    if (scratch->candidates == scratch->candidate_room) {
      const size_t room = 2 * (size_t)scratch->candidate_room + 256;
      TRY(BASE_GROW((size_t)scratch->candidates, room, &scratch->candidate));
      scratch->candidate_room = (int)room;
    }
    scratch->candidate[scratch->candidates++] = candidate;
  }
  return BASE_OK;
}

static int compare_candidates(const void *a, const void *b) {
  const MpmCandidate *left = a, *right = b;
  return left->node != right->node ? left->node - right->node : left->order - right->order;
}

/* Heights and normals below are those seen from the side with `sign`. */
static int holds(const Mpm *mpm, const MpmCandidate *c, int side, double least, int is_behind_all) {
  const double *mass = mpm->wall_scratch.side_mass[c->node], tolerance = ROUND_OFF * mpm->scene.spacing;
  const double height = (side == 0 ? 1.0 : -1.0) * c->at.height, band = BAND * mpm_largest_spacing(mpm) - tolerance;
  if (!(mass[side] > 0.0)) return 0;
  if (fabs(height) <= band ? mass[side] < LEAST_SHARE * (mass[0] + mass[1]) : mass[side] <= mass[1 - side]) return 0;
  if (c->at.is_inside && fabs(height) <= band) return 1;
  if (c->at.distance > least + tolerance) return 0;
  return c->at.is_inside ? height <= tolerance : !c->at.is_rim && is_behind_all;
}

static double height_over(const MpmCandidate *c, const double x[3], double sign) {
  double height = 0.0;
  for (int i = 0; i < 3; i++) height += sign * (x[i] - c->at.point[i]) * c->normal[i];
  return height;
}

/* How fast the node runs into the facet. */
static double approach(const Mpm *mpm, const MpmCandidate *c, double sign) {
  double speed = 0.0;
  for (int i = 0; i < mpm->scene.dimension; i++)
    speed -= sign * (mpm->grid.state[c->node][1 + i] - c->at.velocity[i]) * c->normal[i];
  return speed;
}

/* Of two facets that both hold a node: -1 or 1 if only the first or second shall, 0 if both. */
static int choose(const Mpm *mpm, const MpmCandidate *a, const MpmCandidate *b, double sign) {
  const double tolerance = ROUND_OFF * mpm->scene.spacing;
  double cosine = 0.0;
  for (int i = 0; i < 3; i++) cosine += a->normal[i] * b->normal[i];
  if (cosine > 1.0 - 1e-9) return a->at.distance <= b->at.distance ? -1 : 1;
  const int is_convex =
      height_over(a, b->centre, sign) < -tolerance && height_over(b, a->centre, sign) < -tolerance;
  if (!is_convex) return 0;
  const double higher = sign * (a->at.height - b->at.height);
  if (fabs(higher) > tolerance) return higher > 0.0 ? -1 : 1;
  return approach(mpm, a, sign) >= approach(mpm, b, sign) ? -1 : 1;
}

/* The candidates of one node, for one side. */
static BaseStatus hold_node(Mpm *mpm, int w, const MpmCandidate *candidate, int count, int side) {
  const double sign = side == 0 ? 1.0 : -1.0, tolerance = ROUND_OFF * mpm->scene.spacing;
  double least = INFINITY;
  int is_behind_all = 1;
  for (int c = 0; c < count; c++) least = fmin(least, candidate[c].at.distance);
  for (int c = 0; c < count; c++)
    if (candidate[c].at.distance <= least + tolerance && sign * candidate[c].at.height > tolerance) is_behind_all = 0;
  for (int c = 0; c < count; c++) {
    if (!holds(mpm, &candidate[c], side, least, is_behind_all)) continue;
    int stays = 1;
    for (int d = 0; d < count && stays; d++)
      if (d != c && holds(mpm, &candidate[d], side, least, is_behind_all))
        stays = d < c ? choose(mpm, &candidate[d], &candidate[c], sign) >= 0
                      : choose(mpm, &candidate[c], &candidate[d], sign) <= 0;
    if (!stays) continue;
    double normal[3];
    for (int i = 0; i < 3; i++) normal[i] = sign * candidate[c].normal[i];
    TRY(mpm_wall_add(mpm, candidate[c].node, w, normal, candidate[c].at.velocity));
  }
  return BASE_OK;
}

static BaseStatus hold_nodes(Mpm *mpm, int w) {
  MpmWallScratch *scratch = &mpm->wall_scratch;
  if (scratch->candidates == 0) return BASE_OK;
  qsort(scratch->candidate, (size_t)scratch->candidates, sizeof *scratch->candidate, compare_candidates);
  for (int first = 0, end; first < scratch->candidates; first = end) {
    const int node = scratch->candidate[first].node;
    for (end = first; end < scratch->candidates && scratch->candidate[end].node == node;) end++;
    for (int side = 0; side < 2; side++)
      TRY(hold_node(mpm, w, scratch->candidate + first, end - first, side));
  }
  return BASE_OK;
}

/* -------------------------------------------------------------------------------------------------------------- all */

static BaseStatus reserve(Mpm *mpm) {
  MpmWallScratch *scratch = &mpm->wall_scratch;
  if (mpm->points.count > scratch->nearest_room) {
    const size_t room = (size_t)mpm->points.count + (size_t)mpm->points.count / 4;
    TRY(BASE_GROW(0, room, &scratch->nearest));
    scratch->nearest_room = (int)room;
  }
  if (mpm->grid.nodes > scratch->node_room) {
    const size_t room = (size_t)mpm->grid.nodes + (size_t)mpm->grid.nodes / 4;
    TRY(BASE_GROW(0, room, &scratch->side_mass));
    scratch->node_room = (int)room;
  }
  return BASE_OK;
}

enum { IMAGES = 27 };

/* The facet's image number `image`, 0: itself. A surface repeats with a periodic scene. Returns 0 if there is none. */
static int shift(const MpmScene *scene, int image, MpmFacet *facet) {
  for (int i = 0, rest = image; i < 3; i++, rest /= 3) {
    const int step = (rest + 1) % 3 - 1; /* 0, 1, -1 */
    if (step == 0) continue;
    if (i >= scene->dimension || !scene->periodic[i]) return 0;
    for (int n = 0; n < scene->dimension; n++) facet->node[n][i] += step * scene->period[i];
  }
  return 1;
}

BaseStatus mpm_surface_find(Mpm *mpm, int w) {
  const MpmWall *wall = &mpm->walls[w];
  const int *periodic = mpm->scene.periodic, images = periodic[0] || periodic[1] || periodic[2] ? IMAGES : 1;
  TRY(reserve(mpm));
  int bounds[2][3];
  find_bounds(&mpm->grid, bounds);
  for (int k = 0; k < mpm->points.count; k++) mpm->wall_scratch.nearest[k].at = (MpmFacetNearest){.distance = INFINITY};
  for (int f = 0; f < wall->facet_count; f++)
    for (int image = 0; image < images; image++) {
      MpmFacet facet = wall->facets[f];
      if (shift(&mpm->scene, image, &facet)) meet_points(mpm, &facet, bounds);
    }
  TRY(sort_points_by_side(mpm, w));
  mpm->wall_scratch.candidates = 0;
  if (wall->contact == MPM_WALL_NO_CONTACT && wall->heat != MPM_WALL_TEMPERATURE) return BASE_OK;
  for (int f = 0; f < wall->facet_count; f++)
    for (int image = 0; image < images; image++) {
      MpmFacet facet = wall->facets[f];
      if (shift(&mpm->scene, image, &facet)) TRY(meet_nodes(mpm, wall, &facet, IMAGES * f + image, bounds));
    }
  return hold_nodes(mpm, w);
}
