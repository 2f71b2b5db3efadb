/* SPDX-License-Identifier: GPL-2.0-or-later */
/* P2G and G2P. Each body is written once and compiled for two dimensions x three shapes (see mpm_shape.h).
 *
 * P2G: the points of a cell share their nodes, so a cell is summed in registers and then added to the nodes. Cells go
 * slab by slab, first the slabs of even global index, then the odd ones: the order of the sums at a node is that of
 * (slab colour, cell, tag), for every number of threads and ranks. */
#include <math.h>
#include <string.h>

#include "mpm_core.h"

#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_ADDRESS__)
#define MPM_CLONES __attribute__((target_clones("avx2", "default"))) /* same bits: no contraction */
#else
#define MPM_CLONES
#endif

/* Calls body(..., dimension, shape) with constants. */
#define MPM_SPECIALISE(mpm, body, ...)                                                         \
  switch (((mpm)->scene.dimension - 2) * 3 + (int)(mpm)->scene.shape) {                        \
    case 0: body(__VA_ARGS__, 2, MPM_SHAPE_LINEAR); break;                                     \
    case 1: body(__VA_ARGS__, 2, MPM_SHAPE_GIMP); break;                                       \
    case 2: body(__VA_ARGS__, 2, MPM_SHAPE_BSPLINE); break;                                    \
    case 3: body(__VA_ARGS__, 3, MPM_SHAPE_LINEAR); break;                                     \
    case 4: body(__VA_ARGS__, 3, MPM_SHAPE_GIMP); break;                                       \
    default: body(__VA_ARGS__, 3, MPM_SHAPE_BSPLINE); break;                                   \
  }

enum { NODES_MAX = 27 };
enum { AHEAD = 8 /* points ahead in the sorted order that are fetched: the caller's order may be any */ };

typedef struct Weights {
  double f[3]; /* point - first node of its support, over h */
  double value[3][MPM_WIDTH_MAX], slope[3][MPM_WIDTH_MAX];
} Weights;

MPM_INLINE void find_base(uint64_t key, int dimension, double base[3]) {
  for (int i = 0; i < dimension; i++)
    base[i] = (double)((int)(key >> (i * MPM_KEY_BITS) & MPM_KEY_MASK) - MPM_KEY_BIAS);
}

MPM_INLINE void find_weights(const MpmPoints *points, int k, const double base[3], int dimension, MpmShape shape,
                             Weights *w) {
  for (int i = 0; i < dimension; i++) {
    w->f[i] = points->place[k][i] - base[i];
    mpm_shape_axis(shape, w->f[i], shape == MPM_SHAPE_GIMP ? points->half[k][i] : 0.0, w->value[i], w->slope[i]);
  }
}

/* ----------------------------------------------------------------------------------------------- P2G, momentum */

MPM_INLINE void add_affine(const Mpm *mpm, int k, const Weights *w, int dimension, int width, MpmVec *sum) {
  const double *affine = mpm->points.affine[k], factor = mpm->points.place[k][3] * mpm->scene.spacing;
  MpmVec column[3];
  for (int j = 0; j < dimension; j++)
    column[j] = factor * (MpmVec){0.0, affine[j], affine[3 + j], dimension == 3 ? affine[6 + j] : 0.0};
  for (int c = 0; c < (dimension == 3 ? width : 1); c++)
    for (int b = 0; b < width; b++) {
      const double weight = dimension == 3 ? w->value[1][b] * w->value[2][c] : w->value[1][b];
      MpmVec row = (b - w->f[1]) * column[1];
      if (dimension == 3) row += (c - w->f[2]) * column[2];
      for (int a = 0; a < width; a++)
        sum[(c * width + b) * width + a] += (w->value[0][a] * weight) * (row + (a - w->f[0]) * column[0]);
    }
}

MPM_INLINE void add_heat(const double content[2], const Weights *w, int dimension, int width, double (*heat)[2]) {
  for (int c = 0; c < (dimension == 3 ? width : 1); c++)
    for (int b = 0; b < width; b++) {
      const double weight = dimension == 3 ? w->value[1][b] * w->value[2][c] : w->value[1][b];
      for (int a = 0; a < width; a++)
        for (int q = 0; q < 2; q++) heat[(c * width + b) * width + a][q] += w->value[0][a] * weight * content[q];
    }
}

MPM_INLINE void momentum_body(Mpm *mpm, const int range[2], int with_heat, int with_affine, int dimension,
                              MpmShape shape) {
  const MpmPoints *points = &mpm->points;
  MpmGrid *grid = &mpm->grid;
  const int width = mpm_shape_width(shape), rows = dimension == 3 ? width * width : width;
  for (int cell = range[0]; cell < range[1]; cell++) {
    MpmVec sum[NODES_MAX];
    double heat[NODES_MAX][2], base[3], scale = 0.0;
    for (int n = 0; n < rows * width; n++) sum[n] = (MpmVec){0.0, 0.0, 0.0, 0.0};
    if (with_heat) memset(heat, 0, sizeof heat);
    find_base(grid->cell_key[cell], dimension, base);
    for (int k = grid->cell_first[cell]; k < grid->cell_first[cell + 1]; k++) {
      Weights w;
      find_weights(points, k, base, dimension, shape, &w);
      const double mass = points->place[k][3];
      const MpmVec value = mass * points->motion[k];
      scale = mass > scale ? mass : scale;
      for (int r = 0; r < rows; r++) {
        const MpmVec row = (dimension == 3 ? w.value[1][r % width] * w.value[2][r / width] : w.value[1][r]) * value;
        for (int a = 0; a < width; a++) sum[r * width + a] += w.value[0][a] * row;
      }
      if (with_affine) add_affine(mpm, k, &w, dimension, width, sum);
      if (with_heat) add_heat(points->heat[k], &w, dimension, width, heat);
    }
    const MpmItem *lowest = &points->item[grid->cell_first[cell]];
    for (int r = 0; r < rows; r++)
      for (int a = 0; a < width; a++) {
        const int n = grid->cell_row[cell][r] + a;
        grid->sum[n] += sum[r * width + a];
        grid->scale[n] = scale > grid->scale[n] ? scale : grid->scale[n];
        if (lowest->tag < grid->lowest_tag[n]) {
          grid->lowest_tag[n] = lowest->tag;
          grid->owned[n] = lowest->slot < points->own;
        }
        if (with_heat)
          for (int q = 0; q < 2; q++) grid->heat[n][q] += heat[r * width + a][q];
      }
  }
}

MPM_CLONES static void momentum_slab(Mpm *mpm, const int range[2], int with_heat, int with_affine) {
  MPM_SPECIALISE(mpm, momentum_body, mpm, range, with_heat, with_affine)
}

static int is_parallel(const Mpm *mpm) { return mpm->threads > 1 && mpm->points.count > MPM_PARALLEL_POINTS; }

void mpm_p2g_momentum(Mpm *mpm, int with_heat, int with_affine) {
  MpmGrid *grid = &mpm->grid;
#pragma omp parallel num_threads(mpm->threads) if (is_parallel(mpm))
  {
#pragma omp for
    for (int n = 0; n < grid->nodes; n++) {
      grid->sum[n] = (MpmVec){0.0, 0.0, 0.0, 0.0};
      grid->scale[n] = 0.0;
      grid->lowest_tag[n] = INT64_MAX;
      if (with_heat) grid->heat[n][0] = grid->heat[n][1] = 0.0;
    }
    for (int colour = 0; colour < 2; colour++)
#pragma omp for schedule(dynamic, 1)
      for (int s = 0; s < grid->slabs[colour]; s++)
        momentum_slab(mpm, grid->slab[colour] + 2 * s, with_heat, with_affine);
  }
}

/* --------------------------------------------------------------------------------------------------- P2G, load */

MPM_INLINE void load_body(Mpm *mpm, const int range[2], int dimension, MpmShape shape) {
  const MpmPoints *points = &mpm->points;
  MpmGrid *grid = &mpm->grid;
  const int width = mpm_shape_width(shape), rows = dimension == 3 ? width * width : width;
  for (int cell = range[0]; cell < range[1]; cell++) {
    MpmVec sum[NODES_MAX];
    double base[3];
    for (int n = 0; n < rows * width; n++) sum[n] = (MpmVec){0.0, 0.0, 0.0, 0.0};
    find_base(grid->cell_key[cell], dimension, base);
    for (int k = grid->cell_first[cell]; k < grid->cell_first[cell + 1]; k++) {
      Weights w;
      find_weights(points, k, base, dimension, shape, &w);
      const MpmVec *load = points->load + (size_t)points->item[k].slot * (size_t)(1 + dimension);
      if (k + AHEAD < points->count) {
        const MpmVec *next = points->load + (size_t)points->item[k + AHEAD].slot * (size_t)(1 + dimension);
        __builtin_prefetch(next);
        __builtin_prefetch(next + 2);
      }
      for (int r = 0; r < rows; r++) {
        const int b = r % width, c = r / width;
        const double weight = dimension == 3 ? w.value[1][b] * w.value[2][c] : w.value[1][b];
        const double slope_y = dimension == 3 ? w.slope[1][b] * w.value[2][c] : w.slope[1][b];
        MpmVec even = weight * load[0] + slope_y * load[2];
        if (dimension == 3) even += (w.value[1][b] * w.slope[2][c]) * load[3];
        const MpmVec odd = weight * load[1];
        for (int a = 0; a < width; a++) sum[r * width + a] += w.value[0][a] * even + w.slope[0][a] * odd;
      }
    }
    for (int r = 0; r < rows; r++)
      for (int a = 0; a < width; a++) grid->rate[grid->cell_row[cell][r] + a] += sum[r * width + a];
  }
}

MPM_CLONES static void load_slab(Mpm *mpm, const int range[2]) { MPM_SPECIALISE(mpm, load_body, mpm, range) }

void mpm_p2g_load(Mpm *mpm) {
  MpmGrid *grid = &mpm->grid;
#pragma omp parallel num_threads(mpm->threads) if (is_parallel(mpm))
  {
#pragma omp for
    for (int n = 0; n < grid->nodes; n++) grid->rate[n] = (MpmVec){0.0, 0.0, 0.0, 0.0};
    for (int colour = 0; colour < 2; colour++)
#pragma omp for schedule(dynamic, 1)
      for (int s = 0; s < grid->slabs[colour]; s++) load_slab(mpm, grid->slab[colour] + 2 * s);
  }
}

/* ----------------------------------------------------------------------------------------------------- gathers */

MPM_INLINE void gather_value(const MpmVec *field, const int *row, const Weights *w, int dimension, int width,
                             MpmVec *result) {
  MpmVec value = {0.0, 0.0, 0.0, 0.0};
  for (int r = 0; r < (dimension == 3 ? width * width : width); r++) {
    MpmVec along = {0.0, 0.0, 0.0, 0.0};
    for (int a = 0; a < width; a++) along += w->value[0][a] * field[row[r] + a];
    value += (dimension == 3 ? w->value[1][r % width] * w->value[2][r / width] : w->value[1][r]) * along;
  }
  *result = value;
}

/* gradient[j] = sum over nodes of field times slope along axis j, values along the others; `slope` per unit of u. */
MPM_INLINE void gather_gradient(const MpmVec *field, const int *row, const Weights *w,
                                double (*slope)[MPM_WIDTH_MAX], int dimension, int width, MpmVec gradient[3]) {
  for (int j = 0; j < 3; j++) gradient[j] = (MpmVec){0.0, 0.0, 0.0, 0.0};
  for (int r = 0; r < (dimension == 3 ? width * width : width); r++) {
    const int b = r % width, c = r / width;
    MpmVec along = {0.0, 0.0, 0.0, 0.0}, across = {0.0, 0.0, 0.0, 0.0};
    for (int a = 0; a < width; a++) {
      along += w->value[0][a] * field[row[r] + a];
      across += slope[0][a] * field[row[r] + a];
    }
    gradient[0] += (dimension == 3 ? w->value[1][b] * w->value[2][c] : w->value[1][b]) * across;
    gradient[1] += (dimension == 3 ? slope[1][b] * w->value[2][c] : slope[1][b]) * along;
    if (dimension == 3) gradient[2] += (w->value[1][b] * slope[2][c]) * along;
  }
}

MPM_INLINE void gradient_body(Mpm *mpm, MpmPoint *out, int what, const int range[2], int dimension, MpmShape shape) {
  MpmPoints *points = &mpm->points;
  const MpmGrid *grid = &mpm->grid;
  const int width = mpm_shape_width(shape);
  for (int cell = range[0]; cell < range[1]; cell++) {
    double base[3];
    find_base(grid->cell_key[cell], dimension, base);
    for (int k = grid->cell_first[cell]; k < grid->cell_first[cell + 1]; k++) {
      const int slot = points->item[k].slot;
      if (slot >= points->own) continue;
      Weights w;
      MpmVec gradient[3];
      find_weights(points, k, base, dimension, shape, &w);
      gather_gradient(grid->state, grid->cell_row[cell], &w, w.slope, dimension, width, gradient);
      if (what & MPM_GRADIENT_VELOCITY) {
        double *velocity_gradient = points->law_velocity_gradient + 9 * (size_t)slot;
        for (int i = 0; i < 3; i++)
          for (int j = 0; j < 3; j++)
            velocity_gradient[3 * i + j] =
                i < dimension && j < dimension ? mpm->inverse_spacing * gradient[j][1 + i] : 0.0;
      }
      if (what & MPM_GRADIENT_TEMPERATURE)
        for (int j = 0; j < 3; j++)
          out[slot].temperature_gradient[j] = j < dimension ? mpm->inverse_spacing * gradient[j][0] : 0.0;
    }
  }
}

MPM_CLONES static void gradient_range(Mpm *mpm, MpmPoint *points, int what, const int range[2]) {
  MPM_SPECIALISE(mpm, gradient_body, mpm, points, what, range)
}

/* Cells in chunks: each point is written by one thread only, in any order. */
enum { CHUNK = 64 };
static int chunks(const Mpm *mpm) { return (mpm->grid.cells + CHUNK - 1) / CHUNK; }
static void chunk_range(const Mpm *mpm, int chunk, int range[2]) {
  range[0] = chunk * CHUNK;
  range[1] = range[0] + CHUNK < mpm->grid.cells ? range[0] + CHUNK : mpm->grid.cells;
}

void mpm_g2p_gradient(Mpm *mpm, MpmPoint *points, int what) {
#pragma omp parallel for schedule(dynamic, 1) num_threads(mpm->threads) if (is_parallel(mpm))
  for (int q = 0; q < chunks(mpm); q++) {
    int range[2];
    chunk_range(mpm, q, range);
    gradient_range(mpm, points, what, range);
  }
}

MPM_INLINE void velocity_body(Mpm *mpm, const MpmVec *field, const int range[2], int dimension, MpmShape shape) {
  const MpmGrid *grid = &mpm->grid;
  for (int cell = range[0]; cell < range[1]; cell++) {
    double base[3];
    find_base(grid->cell_key[cell], dimension, base);
    for (int k = grid->cell_first[cell]; k < grid->cell_first[cell + 1]; k++) {
      Weights w;
      find_weights(&mpm->points, k, base, dimension, shape, &w);
      gather_value(field, grid->cell_row[cell], &w, dimension, mpm_shape_width(shape), &mpm->points.gathered[k]);
    }
  }
}

MPM_CLONES static void velocity_range(Mpm *mpm, const MpmVec *field, const int range[2]) {
  MPM_SPECIALISE(mpm, velocity_body, mpm, field, range)
}

void mpm_g2p_velocity(Mpm *mpm, const MpmVec *field) {
#pragma omp parallel for schedule(dynamic, 1) num_threads(mpm->threads) if (is_parallel(mpm))
  for (int q = 0; q < chunks(mpm); q++) {
    int range[2];
    chunk_range(mpm, q, range);
    velocity_range(mpm, field, range);
  }
}

/* ------------------------------------------------------------------------------------------------- G2P, update */

/* Velocity and position from Sv = sum S v_I, Sa = sum S a_I, and for XPIC Sv* (TM-DEMPM eq. 26-27 corrected: damping
 * rates in 1/s; the position moves by dt Sv + dt/2 times the change of the point's velocity, so uniform motion is
 * exact). APIC moves with the updated grid velocity. */
MPM_INLINE void update_motion(const Mpm *mpm, MpmPoint *point, const MpmVec *value, const MpmVec *rate,
                              const MpmVec *extended) {
  const MpmScene *scene = &mpm->scene;
  const double dt = mpm->dt, alpha = scene->pic_fraction;
  for (int i = 0; i < scene->dimension; i++) {
    const double old = point->velocity[i], sv = (*value)[1 + i], sa = (*rate)[1 + i];
    const double damping = dt * (scene->point_damping * old + scene->grid_damping * sv);
    double velocity;
    if (scene->transfer == MPM_TRANSFER_FLIP) velocity = old + dt * sa - alpha * (old - sv) - damping;
    else if (scene->transfer == MPM_TRANSFER_APIC) velocity = sv + dt * sa - damping;
    else velocity = (*extended)[1 + i] + dt * sa - damping;
    point->velocity[i] = velocity;
    if (scene->transfer == MPM_TRANSFER_APIC) point->position[i] += dt * (sv + dt * sa);
    else point->position[i] += dt * sv + 0.5 * dt * (velocity - old);
  }
}

MPM_INLINE void update_affine(const Mpm *mpm, MpmPoint *point, const int *row, const Weights *w, int dimension,
                              MpmShape shape) {
  const int width = mpm_shape_width(shape);
  double slope[3][MPM_WIDTH_MAX];
  MpmVec before[3], change[3];
  for (int i = 0; i < dimension; i++) mpm_shape_affine(shape, w->f[i], w->value[i], slope[i]);
  gather_gradient(mpm->grid.state, row, w, slope, dimension, width, before);
  gather_gradient(mpm->grid.rate, row, w, slope, dimension, width, change);
  for (int i = 0; i < dimension; i++)
    for (int j = 0; j < dimension; j++)
      point->affine[3 * i + j] = mpm->inverse_spacing * (before[j][1 + i] + mpm->dt * change[j][1 + i]);
}

static void check_point(Mpm *mpm, const MpmPoint *point) {
  double velocity = 0.0, position = 0.0;
  for (int i = 0; i < mpm->scene.dimension; i++) velocity += point->velocity[i], position += point->position[i];
  if (isfinite(velocity + position) && !(mpm->scene.thermal && !isfinite(point->temperature))) return;
  mpm_note_point(mpm, BASE_ERROR_UNSTABLE, point->tag,
                 !isfinite(velocity)   ? "velocity is not finite"
                 : !isfinite(position) ? "position is not finite"
                                       : "temperature is not finite");
}

/* The lines with position and velocity. */
MPM_INLINE void prefetch_point(const MpmPoints *points, const MpmPoint *own, int k) {
  if (k + AHEAD >= points->count || points->item[k + AHEAD].slot >= points->own) return;
  const char *point = (const char *)(own + points->item[k + AHEAD].slot);
  __builtin_prefetch(point, 1);
  __builtin_prefetch(point + 64, 1);
}

MPM_INLINE void update_body(Mpm *mpm, MpmPoint *out, const int range[2], int dimension, MpmShape shape) {
  const MpmPoints *points = &mpm->points;
  const MpmGrid *grid = &mpm->grid;
  const MpmScene *scene = &mpm->scene;
  const int width = mpm_shape_width(shape);
  for (int cell = range[0]; cell < range[1]; cell++) {
    double base[3];
    const int *row = grid->cell_row[cell];
    find_base(grid->cell_key[cell], dimension, base);
    for (int k = grid->cell_first[cell]; k < grid->cell_first[cell + 1]; k++) {
      prefetch_point(points, out, k);
      if (points->item[k].slot >= points->own) continue;
      MpmPoint *point = out + points->item[k].slot;
      Weights w;
      find_weights(points, k, base, dimension, shape, &w);
      MpmVec value, rate, extended = {0.0, 0.0, 0.0, 0.0};
      gather_value(grid->state, row, &w, dimension, width, &value);
      gather_value(grid->rate, row, &w, dimension, width, &rate);
      if (scene->thermal) { /* eq. 28 and 29 */
        point->temperature += mpm->dt * rate[0];
        point->temperature_mapped = value[0] + mpm->dt * rate[0];
      }
      if (scene->mechanical) {
        if (scene->transfer == MPM_TRANSFER_XPIC) gather_value(grid->extended, row, &w, dimension, width, &extended);
        update_motion(mpm, point, &value, &rate, &extended);
        if (scene->transfer == MPM_TRANSFER_APIC) update_affine(mpm, point, row, &w, dimension, shape);
      }
      check_point(mpm, point);
    }
  }
}

MPM_CLONES static void update_range(Mpm *mpm, MpmPoint *points, const int range[2]) {
  MPM_SPECIALISE(mpm, update_body, mpm, points, range)
}

void mpm_g2p_update(Mpm *mpm, MpmPoint *points) {
#pragma omp parallel for schedule(dynamic, 1) num_threads(mpm->threads) if (is_parallel(mpm))
  for (int q = 0; q < chunks(mpm); q++) {
    int range[2];
    chunk_range(mpm, q, range);
    update_range(mpm, points, range);
  }
}
