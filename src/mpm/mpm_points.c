/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The core's own arrays of points: growth, filling from and writing to the attached array. */
#include <math.h>
#include <string.h>

#include "../base/tensor.h"
#include "mpm_core.h"

/* ------------------------------------------------------------------------------------------------------ memory */

enum { PLANE_MOVES, PLANE_CONSTANT, PLANE_STAYS };
#define ADD_PLANE(p, member, kind) add_plane(p, (void **)&(p)->member, sizeof *(p)->member, kind)
static void add_plane(MpmPoints *p, void **rows, size_t width, int kind) {
  MpmPlane *plane = &p->plane[p->planes++];
  plane->rows = rows, plane->width = width;
  plane->is_constant = kind == PLANE_CONSTANT;
  plane->moves = kind != PLANE_STAYS;
}

/* velocity_gradient is found anew before it is read. Of the stress a local law leaves xz and yz alone in the plane. */
static void list_planes(Mpm *mpm) {
  MpmPoints *p = &mpm->points;
  const int dimension = mpm->scene.dimension;
  p->planes = 0;
  ADD_PLANE(p, slot, PLANE_MOVES);
  ADD_PLANE(p, key, PLANE_MOVES);
  ADD_PLANE(p, tag, PLANE_MOVES);
  ADD_PLANE(p, position, PLANE_MOVES);
  ADD_PLANE(p, motion, PLANE_MOVES);
  ADD_PLANE(p, force, PLANE_CONSTANT);
  ADD_PLANE(p, volume0, PLANE_CONSTANT);
  if (mpm->scene.shape == MPM_SHAPE_GIMP) ADD_PLANE(p, half, mpm->scene.gimp_stretch ? PLANE_MOVES : PLANE_CONSTANT);
  if (mpm->scene.transfer == MPM_TRANSFER_APIC) ADD_PLANE(p, affine, PLANE_MOVES);
  for (int n = 0; n < dimension * dimension; n++) {
    ADD_PLANE(p, deformation_gradient[mpm_component(dimension, n)], PLANE_MOVES);
    ADD_PLANE(p, velocity_gradient[mpm_component(dimension, n)], PLANE_STAYS);
  }
  for (int n = 0; n < 6; n++)
    ADD_PLANE(p, stress[n], dimension == 2 && n > 3 && mpm_law_is_local(mpm) ? PLANE_CONSTANT : PLANE_MOVES);
}

/* All planes in one block. Loops read a dozen arrays at the same row: if these began at the same place of a page, as
 * large blocks from malloc do, their rows would compete for the same few lines of the first-level cache. */
static BaseStatus grow_planes(MpmPoints *p, size_t room) {
  enum { LINE = 64, PAGE = 4096, APART = 13 * LINE };
  size_t bytes = 0, offset[MPM_PLANES_MAX];
  for (int n = 0; n < p->planes; n++) {
    const size_t place = (size_t)n * APART % PAGE;
    offset[n] = bytes + (place + PAGE - bytes % PAGE) % PAGE;
    bytes = (offset[n] + room * p->plane[n].width + LINE - 1) / LINE * LINE;
  }
  char *block;
  TRY(BASE_ALLOC(bytes, &block));
  for (int n = 0; n < p->planes; n++) {
    MpmPlane *plane = &p->plane[n];
    char *rows = block + offset[n];
    if (p->room > 0) {
      const char *old; /* of several types */
      memcpy(&old, plane->rows, sizeof old);
      memcpy(rows, old, (size_t)p->room * plane->width);
    }
    memcpy(plane->rows, &rows, sizeof rows);
    if (plane->moves) TRY(base_grow(0, room, plane->width, &plane->spare));
  }
  base_free(p->block);
  p->block = block;
  return BASE_OK;
}

BaseStatus mpm_points_reserve(Mpm *mpm, int count) {
  MpmPoints *p = &mpm->points;
  const MpmScene *scene = &mpm->scene;
  if (count <= p->room) return BASE_OK;
  const size_t room = (size_t)count + (size_t)count / 4 + 16;
  list_planes(mpm);
  TRY(grow_planes(p, room));
  if (scene->order != MPM_ORDER_USF) TRY(BASE_GROW(0, room, &p->old_position));
  if (scene->thermal) TRY(BASE_GROW(0, room, &p->heat));
  if (scene->transfer == MPM_TRANSFER_XPIC) TRY(BASE_GROW(0, room, &p->gathered));
  if (scene->volumetric == MPM_VOLUMETRIC_CELL) {
    TRY(BASE_GROW(0, room, &p->cell_value));
    TRY(BASE_GROW(0, room, &p->cell_node));
  }
  if (mpm->halo) {
    TRY(BASE_GROW(0, 16 * room, &p->carry));
    TRY(BASE_GROW(0, room, &p->foreign_slot));
  }
  TRY(BASE_GROW(0, room, &p->moves));
  TRY(BASE_GROW(0, room, &p->mover));
  TRY(BASE_GROW(0, room, &p->source));
  TRY(BASE_GROW(0, room + 1, &p->region));
  TRY(BASE_GROW(0, room, &p->fetch));
  TRY(BASE_GROW(0, room, &p->item));
  TRY(BASE_GROW(0, room, &p->spare_item));
  p->room = (int)room;
  return BASE_OK;
}

BaseStatus mpm_batch_reserve(Mpm *mpm, int count) {
  MpmPoints *p = &mpm->points;
  MpmLawBatch *batch = &p->batch;
  if (count <= p->batch_room) return BASE_OK;
  const size_t room = (size_t)count + (size_t)count / 4 + 16;
  TRY(BASE_GROW(0, room, &p->law_tag));
  TRY(BASE_GROW(0, 9 * room, &p->law_velocity_gradient));
  TRY(BASE_GROW(0, 9 * room, &p->law_deformation_gradient));
  TRY(BASE_GROW(0, 6 * room, &batch->stress));
  TRY(BASE_GROW(0, room, &batch->modulus));
  TRY(BASE_GROW(0, MPM_LAW_SCALARS * room, &batch->scalars));
  if (mpm->scene.thermal || mpm->law->thermal) {
    TRY(BASE_GROW(0, room, &p->law_temperature));
    TRY(BASE_GROW(0, room, &p->law_temperature_rate));
    TRY(BASE_GROW(0, room, &batch->heat));
    TRY(BASE_GROW(0, 6 * room, &batch->conductivity));
  }
  batch->tag = p->law_tag;
  batch->velocity_gradient = p->law_velocity_gradient;
  batch->deformation_gradient = p->law_deformation_gradient;
  batch->temperature = p->law_temperature;
  batch->temperature_rate = p->law_temperature_rate;
  p->batch_room = (int)room;
  return BASE_OK;
}

void mpm_points_free(Mpm *mpm) {
  MpmPoints *p = &mpm->points;
  for (int n = 0; n < p->planes; n++) base_free(p->plane[n].spare);
  void *const memory[] = {p->block, p->old_position, p->heat, p->load, p->gathered, p->carry, p->moves, p->mover,
                          p->cell_value, p->cell_node, p->source, p->region, p->fetch, p->foreign_slot,
                          p->item, p->spare_item, p->law_tag,
                          p->law_velocity_gradient, p->law_deformation_gradient, p->law_temperature,
                          p->law_temperature_rate, p->batch.stress, p->batch.heat, p->batch.conductivity,
                          p->batch.modulus, p->batch.scalars};
  for (size_t k = 0; k < sizeof memory / sizeof *memory; k++) base_free(memory[k]);
  memset(p, 0, sizeof *p);
}

/* ------------------------------------------------------------------------------------------------------ checks */

/* What is wrong with the constants of a point, or NULL. */
static const char *find_argument_fault(const Mpm *mpm, const MpmPoint *point) {
  if (point->tag <= 0) return "tag must be > 0";
  if (!(point->mass > 0.0 && point->mass < INFINITY)) return "mass must be finite and > 0";
  if (!(point->volume0 > 0.0 && point->volume0 < INFINITY)) return "volume0 must be finite and > 0";
  if (mpm->scene.thermal && !(point->heat_capacity > 0.0 && point->heat_capacity < INFINITY))
    return "heat_capacity must be finite and > 0";
  for (int i = 0; i < mpm->scene.dimension; i++)
    if (mpm->scene.shape == MPM_SHAPE_GIMP &&
        !(point->size0[i] > 0.0 && point->size0[i] * mpm->per_length[1 + i] <= 1.0 + 1e-9))
      return "size0 must be > 0 and at most the grid's spacing, also when that has shrunk with followed walls (uGIMP; bspline "
             "has no such limit)";
  return NULL;
}

/* What is not finite in the state of a point, or NULL. */
static const char *find_state_fault(const Mpm *mpm, const MpmPoint *point) {
  for (int i = 0; i < mpm->scene.dimension; i++) {
    if (!isfinite(point->position[i])) return "position is not finite";
    if (!isfinite(point->velocity[i])) return "velocity is not finite";
    if (!isfinite(point->force[i])) return "force is not finite";
  }
  if (!mpm->scene.thermal) return NULL;
  if (!isfinite(point->temperature)) return "temperature is not finite";
  if (!isfinite(point->heat_external)) return "external heat is not finite";
  return NULL;
}

const char *mpm_find_fault(const Mpm *mpm, const MpmPoint *point, BaseStatus *status) {
  const char *fault = find_argument_fault(mpm, point);
  *status = fault ? BASE_ERROR_ARGUMENT : BASE_ERROR_UNSTABLE;
  return fault ? fault : find_state_fault(mpm, point);
}

/* Clamped: size0 may exceed the spacing by round-off. A domain that follows the stretch has the length of F's row,
 * weighted by the edges: right for any stretch along the axes, and the same after a rotation. */
MpmVec mpm_half_edges(const Mpm *mpm, const double size0[3], const double f[9]) {
  MpmVec result = mpm_vec_all(0.5);
  for (int i = 0; i < mpm->scene.dimension; i++) {
    double half = 0.5 * size0[i] * mpm->per_length[1 + i];
    if (mpm->scene.gimp_stretch) {
      double square = 0.0;
      for (int j = 0; j < mpm->scene.dimension; j++) {
        const double edge = f[3 * i + j] * size0[j];
        square += edge * edge;
      }
      half = fmax(0.5 * sqrt(square) * mpm->per_length[1 + i], 1e-6);
    }
    result[1 + i] = half < 0.5 ? half : 0.5;
  }
  return result;
}

/* ----------------------------------------------------------------------------------------------------- filling */

/* What P2G and G2P need, own or foreign. */
static void load_common(Mpm *mpm, int k, const MpmPoint *point) {
  MpmPoints *p = &mpm->points;
  const int dimension = mpm->scene.dimension;
  p->tag[k] = point->tag;
  p->position[k] = mpm_vector_of(dimension, point->mass, point->position);
  p->motion[k] = mpm_vector_of(dimension, 1.0, point->velocity);
  if (p->half) p->half[k] = mpm_half_edges(mpm, point->size0, point->deformation_gradient);
  if (p->affine) memcpy(p->affine[k], point->affine, sizeof point->affine);
}

static void load_own(Mpm *mpm, int k, const MpmPoint *point) {
  MpmPoints *p = &mpm->points;
  const int dimension = mpm->scene.dimension;
  load_common(mpm, k, point);
  p->force[k] = mpm_vector_of(dimension, 0.0, point->force);
  p->volume0[k] = dimension == 3 ? point->volume0 : point->volume0 * point->deformation_gradient[8];
  for (int n = 0; n < dimension * dimension; n++) {
    const int c = mpm_component(dimension, n);
    p->deformation_gradient[c][k] = point->deformation_gradient[c];
  }
  for (int n = 0; n < 6; n++) p->stress[n][k] = point->stress[n];
}

enum { AHEAD = 4 /* points ahead in the rows' order that are fetched */ };

MPM_INLINE void prefetch_point(const MpmPoints *p, int k) {
  if (k + AHEAD >= p->own) return;
  const char *next = (const char *)(p->home + p->slot[k + AHEAD]);
  for (size_t line = 0; line < sizeof(MpmPoint); line += 64) __builtin_prefetch(next + line);
}

static int is_equal(MpmVec a, MpmVec b) { return mpm_mask_all(a == b); }

/* 1 if the rows hold these points in this order already. */
static int is_known(const MpmPoints *p, const MpmPoint *points, int count) {
  if (!p->has_order || count != p->own) return 0;
  for (int k = 0; k < count; k++)
    if (points[p->slot[k]].tag != p->tag[k]) return 0;
  return 1;
}

static void find_order(Mpm *mpm, const MpmPoint *points, int count) {
  MpmPoints *p = &mpm->points;
  for (int s = 0; s < count; s++) {
    const MpmPoint *point = &points[s];
    const MpmVec half = mpm->scene.shape == MPM_SHAPE_GIMP
                            ? mpm_half_edges(mpm, point->size0, point->deformation_gradient) : mpm_vec_all(0.5);
    const MpmVec position = mpm_vector_of(mpm->scene.dimension, 0.0, point->position);
    p->item[s] = (MpmItem){mpm_find_cell(mpm, position, half, point->tag), point->tag, s};
  }
  mpm_sort_items(&p->item, &p->spare_item, count);
  for (int k = 0; k < count; k++) p->slot[k] = p->item[k].index, p->key[k] = p->item[k].cell;
  for (int k = 1; k < count; k++)
    if (p->item[k].cell == p->item[k - 1].cell && p->item[k].tag == p->item[k - 1].tag) {
      mpm_note_error(mpm, base_error(BASE_ERROR_ARGUMENT, "point %lld: its tag occurs twice; tags must be unique",
                                     (long long)p->item[k].tag));
      return;
    }
}

BaseStatus mpm_points_attach(Mpm *mpm, MpmPoint *points, int count) {
  MpmPoints *p = &mpm->points;
  mpm_points_forget_movers(mpm);
  p->uniform_known = 0;
  TRY(mpm_points_reserve(mpm, count));
  /* Without a grid for this order nobody could tell which points have left their cells since: they are sorted anew. */
  const int known = mpm->grid.is_current && is_known(p, points, count);
  p->home = points;
  p->own = p->live = p->count = count;
  p->foreign = 0;
  p->has_stepped = 0;
  p->fastest = p->sound = INFINITY;
#pragma omp parallel for num_threads(mpm->threads) if (count > MPM_PARALLEL_POINTS)
  for (int s = 0; s < count; s++) {
    BaseStatus status;
    const char *fault = mpm_find_fault(mpm, &points[s], &status);
    if (fault) mpm_note_point(mpm, status, points[s].tag, fault);
  }
  p->has_order = mpm->point_tag == INT64_MAX;
  if (!p->has_order) return BASE_OK;
  if (!known) {
    find_order(mpm, points, count);
    mpm->grid.is_current = 0;
    p->has_moved = 1;
  }
#pragma omp parallel for num_threads(mpm->threads) if (count > MPM_PARALLEL_POINTS)
  for (int k = 0; k < count; k++) {
    prefetch_point(p, k);
    load_own(mpm, k, &points[p->slot[k]]);
  }
  p->equal_domains = count > 0 && p->half && !mpm->scene.gimp_stretch;
  for (int k = 1; k < count && p->equal_domains; k++) p->equal_domains = is_equal(p->half[k], p->half[0]);
  double low = INFINITY, high = 0.0;
  for (int k = 0; k < count; k++) low = fmin(low, p->position[k][0]), high = fmax(high, p->position[k][0]);
  p->mass_low = low, p->mass_high = high;
  return BASE_OK;
}

void mpm_points_load_foreign(Mpm *mpm, const MpmPoint *foreign) {
  MpmPoints *p = &mpm->points;
  const double none[3] = {0.0, 0.0, 0.0};
  for (int s = 0; s < p->foreign; s++) {
    const MpmPoint *point = &foreign[s];
    BaseStatus status;
    const char *fault = mpm_find_fault(mpm, point, &status);
    if (fault) mpm_note_point(mpm, status, point->tag, fault);
    const MpmVec half = p->half ? mpm_half_edges(mpm, point->size0, point->deformation_gradient) : mpm_vec_all(0.5);
    const MpmVec position = mpm_vector_of(mpm->scene.dimension, 0.0, point->position);
    p->item[s] = (MpmItem){fault ? 0 : mpm_find_cell(mpm, position, half, point->tag), point->tag, s};
  }
  mpm_sort_items(&p->item, &p->spare_item, p->foreign);
  for (int s = 0; s < p->foreign; s++) {
    const int k = p->own + s;
    const MpmPoint *point = &foreign[p->item[s].index];
    p->foreign_slot[s] = p->item[s].index;
    p->key[k] = p->item[s].cell;
    load_common(mpm, k, point);
    p->equal_domains = p->equal_domains && is_equal(p->half[k], p->half[0]);
    p->force[k] = mpm_vector_of(3, 0.0, none);
    if (p->old_position) p->old_position[k] = p->position[k]; /* nobody here moves them */
    p->mass_low = fmin(p->mass_low, point->mass), p->mass_high = fmax(p->mass_high, point->mass);
  }
}

void mpm_points_load_heat(Mpm *mpm, const MpmPoint *foreign) {
  MpmPoints *p = &mpm->points;
#pragma omp parallel for num_threads(mpm->threads) if (mpm_is_parallel(mpm))
  for (int k = 0; k < p->count; k++) {
    const MpmPoint *point = k < p->own ? &p->home[p->slot[k]] : &foreign[p->foreign_slot[k - p->own]];
    p->heat[k][0] = point->mass * point->heat_capacity;
    p->heat[k][1] = p->heat[k][0] * point->temperature;
  }
}

/* ----------------------------------------------------------------------------------------------------- reading */

void mpm_row_deformation(const Mpm *mpm, int row, double f[9]) {
  const MpmPoints *p = &mpm->points;
  const int dimension = mpm->scene.dimension;
  if (dimension == 2) memcpy(f, p->home[p->slot[row]].deformation_gradient, 9 * sizeof *f);
  for (int n = 0; n < dimension * dimension; n++) {
    const int c = mpm_component(dimension, n);
    f[c] = p->deformation_gradient[c][row];
  }
}

double mpm_row_volume(const Mpm *mpm, int row) {
  const MpmPoints *p = &mpm->points;
  double *const *f = p->deformation_gradient;
  if (mpm->scene.dimension == 2) return p->volume0[row] * (f[0][row] * f[4][row] - f[1][row] * f[3][row]);
  double full[9];
  for (int n = 0; n < 9; n++) full[n] = f[n][row];
  return p->volume0[row] * tensor_determinant(full);
}

static void write_point(const Mpm *mpm, int k, int what) {
  const MpmPoints *p = &mpm->points;
  MpmPoint *point = &p->home[p->slot[k]];
  const int dimension = mpm->scene.dimension;
  if (what & MPM_WRITE_MOTION) {
    for (int i = 0; i < dimension; i++) {
      point->position[i] = p->position[k][1 + i];
      point->velocity[i] = p->motion[k][1 + i];
    }
    if (p->affine) memcpy(point->affine, p->affine[k], sizeof point->affine);
  }
  if (what & MPM_WRITE_SHAPE) mpm_row_deformation(mpm, k, point->deformation_gradient);
  if (!(what & MPM_WRITE_LAW)) return;
  for (int n = 0; n < 6; n++) point->stress[n] = p->stress[n][k];
  if (!p->has_stepped) return;
  memset(point->velocity_gradient, 0, sizeof point->velocity_gradient);
  for (int n = 0; n < dimension * dimension && mpm->scene.mechanical; n++) {
    const int c = mpm_component(dimension, n);
    point->velocity_gradient[c] = p->velocity_gradient[c][k];
  }
  if (mpm_law_is_local(mpm))
    mpm->law->describe(mpm->law->content, point->stress, &point->modulus, point->scalars);
}

void mpm_points_write(const Mpm *mpm, int what) {
  const MpmPoints *p = &mpm->points;
  if (!p->has_order) return; /* rows were never filled */
#pragma omp parallel for num_threads(mpm->threads) if (p->own > MPM_PARALLEL_POINTS)
  for (int k = 0; k < p->own; k++) {
    prefetch_point(p, k);
    write_point(mpm, k, what);
  }
}
