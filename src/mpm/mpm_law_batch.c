/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Between points and constitutive law, and the loads that its answers put on the grid. A local law works on the rows
 * where they lie; others get a batch in the caller's order. */
#include <math.h>
#include <string.h>

#include "mpm_deform.h"
#include "mpm_kernel.h"

enum { CHUNK = 128 /* rows */ };

/* -------------------------------------------------------------------------------------------- deformation, rows */

/* Calls body(arguments, n) for four rows at a time from k on, n of them; the usual n is a constant. */
#define BY_FOUR(k, first, end, body, ...)                                       \
  do {                                                                          \
    int k = (first);                                                            \
    for (; k + 4 <= (end); k += 4) body(__VA_ARGS__, 4);                        \
    if (k < (end)) body(__VA_ARGS__, (end) - k);                                \
  } while (0)

MPM_INLINE void get_rows(double *const *component, int k, int dimension, MpmVec a[9], int n) {
#pragma GCC unroll 9
  for (int c = 0; c < 9; c++)
    if (dimension == 3 || (c < 5 && c != 2)) a[c] = mpm_vec_load(component[c] + k, n);
}

/* The lanes with large increments, one by one. By address: registers of vectors are another matter for the clones that call
 * this than for this. */
static void deform_large(Mpm *mpm, int k, double dt, const MpmMask *small, int n) {
  MpmPoints *p = &mpm->points;
  const int dimension = mpm->scene.dimension;
  for (int i = 0; i < n; i++) {
    double l[9] = {0.0}, f[9] = {0.0};
    if ((*small)[i]) continue;
    for (int q = 0; q < dimension * dimension; q++) {
      const int c = mpm_component(dimension, q);
      l[c] = p->velocity_gradient[c][k + i], f[c] = p->deformation_gradient[c][k + i];
    }
    mpm_deform_large(l, dt, dimension, f);
    for (int q = 0; q < dimension * dimension; q++)
      p->deformation_gradient[mpm_component(dimension, q)][k + i] = f[mpm_component(dimension, q)];
  }
}

MPM_INLINE void deform_four(Mpm *mpm, int k, double dt, int dimension, int n) {
  double *const *deformation = mpm->points.deformation_gradient;
  MpmVec l[9], f[9], old[9];
  get_rows(mpm->points.velocity_gradient, k, dimension, l, n);
  get_rows(deformation, k, dimension, f, n);
  const MpmMask small = dimension == 2 ? mpm_is_small_plane(l, dt) : mpm_is_small_space(l, dt);
  const int all_small = mpm_mask_all(small);
#pragma GCC unroll 9
  for (int c = 0; c < 9; c++)
    if (dimension == 3 || (c < 5 && c != 2)) old[c] = f[c];
  if (dimension == 2) mpm_deform_small_plane(l, dt, f);
  else mpm_deform_small_space(l, dt, f);
#pragma GCC unroll 9
  for (int c = 0; c < 9; c++) {
    if (!(dimension == 3 || (c < 5 && c != 2))) continue;
    if (!all_small) f[c] = (MpmVec)(((MpmMask)f[c] & small) | ((MpmMask)old[c] & ~small));
    mpm_vec_store(f[c], deformation[c] + k, n);
  }
  if (!all_small) deform_large(mpm, k, dt, &small, n);
}

MPM_CLONES static void deform_rows(Mpm *mpm, int first, int end, double dt) {
  if (mpm->scene.dimension == 2) BY_FOUR(k, first, end, deform_four, mpm, k, dt, 2);
  else BY_FOUR(k, first, end, deform_four, mpm, k, dt, 3);
}

MPM_INLINE void check_four(double *const *s, int k, MpmVec *fault, int components, int n) {
  MpmVec sum = mpm_vec_load(s[0] + k, n);
  for (int c = 1; c < components; c++) sum += mpm_vec_load(s[c] + k, n);
  *fault += sum - sum; /* 0, or NaN */
}

/* xz and yz are no results in the plane, where the law is local. */
MPM_CLONES static void check_rows(Mpm *mpm, int first, int end) {
  double *const *s = mpm->points.stress;
  MpmVec fault = {0.0, 0.0, 0.0, 0.0};
  if (mpm->scene.dimension == 2 && mpm_law_is_local(mpm)) BY_FOUR(k, first, end, check_four, s, k, &fault, 4);
  else BY_FOUR(k, first, end, check_four, s, k, &fault, 6);
  if (mpm_mask_all(fault == 0.0)) return;
  for (int k = first; k < end; k++)
    if (!isfinite(s[0][k] + s[1][k] + s[2][k] + s[3][k] + s[4][k] + s[5][k]))
      mpm_note_point(mpm, BASE_ERROR_UNSTABLE, mpm->points.tag[k], "stress is not finite");
}

void mpm_law_rows(Mpm *mpm, int first, int end) {
  const MpmPoints *p = &mpm->points;
  MpmLawRows rows = {.n = end - first, .dimension = mpm->scene.dimension, .dt = mpm->dt};
  for (int n = 0; n < 9; n++)
    if (p->velocity_gradient[n]) rows.velocity_gradient[n] = p->velocity_gradient[n] + first;
  for (int n = 0; n < 6; n++) rows.stress[n] = p->stress[n] + first;
  mpm->law->advance(mpm->law->content, &rows);
  deform_rows(mpm, first, end, mpm->dt);
  check_rows(mpm, first, end);
}

void mpm_law_all_rows(Mpm *mpm) {
  const int rows = mpm->points.live;
#pragma omp parallel for num_threads(mpm->threads) if (mpm_is_parallel(mpm))
  for (int first = 0; first < rows; first += CHUNK) mpm_law_rows(mpm, first, first + CHUNK < rows ? first + CHUNK : rows);
}

/* ------------------------------------------------------------------------------------------------------- batch */

static void fill_row(Mpm *mpm, int k, double dt) {
  MpmPoints *p = &mpm->points;
  const int s = p->slot[k], dimension = mpm->scene.dimension;
  const MpmPoint *point = &p->home[s];
  double *gradient = p->law_velocity_gradient + 9 * (size_t)s;
  p->law_tag[s] = point->tag;
  memset(gradient, 0, 9 * sizeof *gradient);
  for (int n = 0; n < dimension * dimension && mpm->scene.mechanical && dt > 0.0; n++)
    gradient[mpm_component(dimension, n)] = p->velocity_gradient[mpm_component(dimension, n)][k];
  mpm_row_deformation(mpm, k, p->law_deformation_gradient + 9 * (size_t)s);
  for (int n = 0; n < 6; n++) p->batch.stress[6 * (size_t)s + (size_t)n] = p->stress[n][k];
  if (!mpm->scene.thermal && !mpm->law->thermal) return;
  p->law_temperature[s] = point->temperature_mapped;
  p->law_temperature_rate[s] = dt > 0.0 ? (point->temperature_mapped - point->temperature_law) / dt : 0.0;
  p->batch.heat[s] = point->heat;
  memcpy(p->batch.conductivity + 6 * (size_t)s, point->conductivity, sizeof point->conductivity);
}

/* All but stress and F, which are rows. */
static void take_answer(Mpm *mpm, int k) {
  MpmPoints *p = &mpm->points;
  const MpmLawBatch *batch = &p->batch;
  const int s = p->slot[k];
  MpmPoint *point = &p->home[s];
  for (int n = 0; n < 6; n++) p->stress[n][k] = batch->stress[6 * (size_t)s + (size_t)n];
  memcpy(point->scalars, batch->scalars + MPM_LAW_SCALARS * (size_t)s, sizeof point->scalars);
  point->modulus = batch->modulus[s];
  if (!mpm->scene.thermal && !mpm->law->thermal) return;
  point->temperature_law = point->temperature_mapped;
  point->heat = batch->heat[s];
  memcpy(point->conductivity, batch->conductivity + 6 * (size_t)s, sizeof point->conductivity);
  double sum = point->heat;
  for (int n = 0; n < 6; n++) sum += point->conductivity[n];
  if (!isfinite(sum)) mpm_note_point(mpm, BASE_ERROR_UNSTABLE, point->tag, "heat source or conductivity is not finite");
}

BaseStatus mpm_law_run(Mpm *mpm, double dt) {
  MpmPoints *p = &mpm->points;
  TRY(mpm_batch_reserve(mpm, p->own));
  const int is_parallel = mpm->threads > 1 && p->live > MPM_PARALLEL_POINTS;
#pragma omp parallel for num_threads(mpm->threads) if (is_parallel)
  for (int k = 0; k < p->live; k++) fill_row(mpm, k, dt);
  p->batch.n = p->live;
  p->batch.dt = dt;
  TRY(mpm->law->update(mpm->law->content, &p->batch));
#pragma omp parallel for num_threads(mpm->threads) if (is_parallel)
  for (int first = 0; first < p->live; first += CHUNK) {
    const int end = first + CHUNK < p->live ? first + CHUNK : p->live;
    for (int k = first; k < end; k++) take_answer(mpm, k);
    if (dt > 0.0 && mpm->scene.mechanical) deform_rows(mpm, first, end, dt);
    check_rows(mpm, first, end);
  }
  return BASE_OK;
}

/* ------------------------------------------------------------------------------------------------------- loads */

/* {V q_j} joins what meets the slope of S along j, q = -k grad T (TM-DEMPM eq. 17 corrected), {W} the point's own. */
static void add_heat(const Mpm *mpm, int k, MpmVec *load) {
  static const int voigt[3][3] = {{0, 3, 4}, {3, 1, 5}, {4, 5, 2}};
  const MpmPoint *point = &mpm->points.home[mpm->points.slot[k]];
  const int dimension = mpm->scene.dimension;
  const double volume = mpm_row_volume(mpm, k);
  load[0][0] = mpm->heat_duration < 0.0 ? mpm_heat_source(mpm, k) : point->heat_power;
  for (int j = 0; j < dimension; j++) {
    double flux = 0.0;
    for (int l = 0; l < dimension; l++) flux -= point->conductivity[voigt[j][l]] * point->temperature_gradient[l];
    load[1 + j][0] = volume * mpm->per_length[1 + j] * flux;
  }
}

static void fill_own_loads(Mpm *mpm) {
  MpmPoints *p = &mpm->points;
  const int width = mpm_load_width(mpm);
#pragma omp parallel for num_threads(mpm->threads) if (mpm_is_parallel(mpm))
  for (int k = 0; k < p->live; k++) {
    MpmVec *load = p->load + (size_t)k * (size_t)width;
    for (int n = 0; n < width; n++) load[n] = (MpmVec){0.0, 0.0, 0.0, 0.0};
    if (mpm->scene.mechanical) {
      if (width == 3) mpm_row_load(mpm, k, 2, load);
      else mpm_row_load(mpm, k, 3, load);
    }
    if (mpm->heats) add_heat(mpm, k, load);
  }
}

/* Rows are sent in the caller's order. */
static BaseStatus forward_loads(Mpm *mpm) {
  MpmPoints *p = &mpm->points;
  const size_t width = (size_t)mpm_load_width(mpm), bytes = width * sizeof *p->load;
  MpmVec *carry = (MpmVec *)p->carry;
  for (int k = 0; k < p->live; k++) memcpy(carry + (size_t)p->slot[k] * width, p->load + (size_t)k * width, bytes);
  MpmVec *foreign = carry + (size_t)p->own * width;
  TRY(mpm->halo->forward(mpm->halo->content, (int)(4 * width), (const double *)carry, (double *)foreign));
  for (int s = 0; s < p->count - p->own; s++)
    memcpy(p->load + (size_t)(p->own + s) * width, foreign + (size_t)p->foreign_slot[s] * width, bytes);
  return BASE_OK;
}

BaseStatus mpm_load_fill(Mpm *mpm) {
  MpmPoints *p = &mpm->points;
  if (!mpm_uses_load(mpm)) return BASE_OK;
  if (p->load_room < p->room) {
    TRY(BASE_GROW(0, (size_t)p->room * (size_t)mpm_load_width(mpm), &p->load));
    p->load_room = p->room;
  }
  fill_own_loads(mpm);
  if (mpm_averages(mpm)) TRY(mpm_volumetric_load(mpm));
  if (p->live > 0 && mpm->scene.mechanical) mpm_traction_add(mpm, p->load);
  if (p->live > 0 && mpm->heats) mpm_heat_walls(mpm, p->load);
  return mpm->halo ? forward_loads(mpm) : BASE_OK;
}
