/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Between points and constitutive law, and the loads that its answers put on the grid. A local law works on the rows where
 * they lie; others get a batch in the caller's order. */
#include <math.h>
#include <string.h>

#include "../base/tensor.h"
#include "mpm_deform.h"
#include "mpm_kernel.h"

/* -------------------------------------------------------------------------------------------- deformation, rows */

MPM_INLINE void get_row(double *const *component, int k, int dimension, double a[9]) {
#pragma GCC unroll 9
  for (int n = 0; n < dimension * dimension; n++)
    a[mpm_component(dimension, n)] = component[mpm_component(dimension, n)][k];
}

/* Without a large increment the loop has no branch and runs in vectors. */
MPM_INLINE void deform_body(Mpm *mpm, int first, int end, double dt, int dimension) {
  double *const *gradient = mpm->points.velocity_gradient, *const *deformation = mpm->points.deformation_gradient;
  double *lp[9], *fp[9];
  for (int n = 0; n < dimension * dimension; n++) {
    const int c = mpm_component(dimension, n);
    lp[c] = gradient[c], fp[c] = deformation[c];
  }
  double large = 0.0;
#pragma omp simd reduction(+ : large)
  for (int k = first; k < end; k++) {
    double l[9];
    get_row(lp, k, dimension, l);
    large += (dimension == 2 ? mpm_is_small_plane(l, dt) : mpm_is_small_space(l, dt)) ? 0.0 : 1.0;
  }
  if (large == 0.0) {
#pragma omp simd
    for (int k = first; k < end; k++) {
      double l[9], f[9];
      get_row(lp, k, dimension, l), get_row(fp, k, dimension, f);
      if (dimension == 2) mpm_deform_small_plane(l, dt, f);
      else mpm_deform_small_space(l, dt, f);
#pragma GCC unroll 9
      for (int n = 0; n < dimension * dimension; n++) fp[mpm_component(dimension, n)][k] = f[mpm_component(dimension, n)];
    }
    return;
  }
  for (int k = first; k < end; k++) {
    double l[9], f[9];
    get_row(lp, k, dimension, l), get_row(fp, k, dimension, f);
    if (dimension == 2) mpm_deform_plane(l, dt, f);
    else mpm_deform_space(l, dt, f);
    for (int n = 0; n < dimension * dimension; n++) fp[mpm_component(dimension, n)][k] = f[mpm_component(dimension, n)];
  }
}

MPM_CLONES static void deform_rows(Mpm *mpm, int first, int end, double dt) {
  if (mpm->scene.dimension == 2) deform_body(mpm, first, end, dt, 2);
  else deform_body(mpm, first, end, dt, 3);
}

MPM_CLONES static void check_rows(Mpm *mpm, int first, int end) {
  double *const *s = mpm->points.stress;
  double fault = 0.0;
#pragma omp simd reduction(+ : fault)
  for (int k = first; k < end; k++) {
    const double sum = s[0][k] + s[1][k] + s[2][k] + s[3][k] + s[4][k] + s[5][k];
    fault += sum - sum; /* 0, or NaN */
  }
  if (fault == 0.0) return;
  for (int k = first; k < end; k++)
    if (!isfinite(s[0][k] + s[1][k] + s[2][k] + s[3][k] + s[4][k] + s[5][k]))
      mpm_note_point(mpm, BASE_ERROR_UNSTABLE, mpm->points.tag[k], "stress is not finite");
}

void mpm_law_rows(Mpm *mpm, int first, int end) {
  const MpmPoints *p = &mpm->points;
  MpmLawRows rows = {.n = end - first, .dimension = mpm->scene.dimension, .dt = mpm->dt};
  for (int n = 0; n < 9; n++) rows.velocity_gradient[n] = p->velocity_gradient[n] ? p->velocity_gradient[n] + first : NULL;
  for (int n = 0; n < 6; n++) rows.stress[n] = p->stress[n] + first;
  mpm->law->advance(mpm->law->content, &rows);
  deform_rows(mpm, first, end, mpm->dt);
  check_rows(mpm, first, end);
}

/* ------------------------------------------------------------------------------------------------------- batch */

static void fill_row(Mpm *mpm, int k, double dt) {
  MpmPoints *p = &mpm->points;
  const int s = p->slot[k], dimension = mpm->scene.dimension;
  const MpmPoint *point = &p->home[s];
  double *gradient = p->law_velocity_gradient + 9 * (size_t)s;
  p->law_tag[s] = point->tag;
  memset(gradient, 0, 9 * sizeof *gradient);
  if (mpm->scene.mechanical && dt > 0.0) get_row(p->velocity_gradient, k, dimension, gradient);
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
  enum { CHUNK = 128 };
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
  const double volume = mpm_row_volume(mpm, k), factor = volume * mpm->inverse_spacing;
  load[0][0] = volume * point->heat + point->heat_external;
  for (int j = 0; j < dimension; j++) {
    double flux = 0.0;
    for (int l = 0; l < dimension; l++) flux -= point->conductivity[voigt[j][l]] * point->temperature_gradient[l];
    load[1 + j][0] = factor * flux;
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
    if (mpm->scene.thermal) add_heat(mpm, k, load);
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
  if (p->live > 0 && mpm->scene.mechanical) mpm_traction_add(mpm, p->load);
  if (p->live > 0 && mpm->scene.thermal) mpm_heat_walls(mpm, p->load);
  return mpm->halo ? forward_loads(mpm) : BASE_OK;
}
