/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Between points and constitutive law: the batch, and the loads that its answers put on the grid. The batch follows the
 * caller's order. */
#include <math.h>
#include <string.h>

#include "mpm_core.h"
#include "mpm_deform.h"

/* The velocity gradients are already there (G2P). */
static void fill_batch(Mpm *mpm, const MpmPoint *points, double dt) {
  MpmPoints *p = &mpm->points;
  MpmLawBatch *batch = &p->batch;
  const int has_heat = mpm->scene.thermal || mpm->law->thermal;
#pragma omp parallel for num_threads(mpm->threads) if (p->live > MPM_PARALLEL_POINTS)
  for (int s = 0; s < p->live; s++) {
    const MpmPoint *point = &points[s];
    p->law_tag[s] = point->tag;
    memcpy(p->law_deformation_gradient + 9 * (size_t)s, point->deformation_gradient,
           sizeof point->deformation_gradient);
    memcpy(batch->stress + 6 * (size_t)s, point->stress, sizeof point->stress);
    if (!has_heat) continue;
    p->law_temperature[s] = point->temperature_mapped;
    p->law_temperature_rate[s] = dt > 0.0 ? (point->temperature_mapped - point->temperature_law) / dt : 0.0;
    batch->heat[s] = point->heat;
    memcpy(batch->conductivity + 6 * (size_t)s, point->conductivity, sizeof point->conductivity);
  }
  batch->n = p->live;
  batch->dt = dt;
}

static void take_answer(Mpm *mpm, MpmPoint *point, int s, double dt) {
  const MpmPoints *p = &mpm->points;
  const MpmLawBatch *batch = &p->batch;
  const double *velocity_gradient = p->law_velocity_gradient + 9 * (size_t)s;
  double sum = 0.0;
  memcpy(point->velocity_gradient, velocity_gradient, sizeof point->velocity_gradient);
  if (dt > 0.0 && mpm->scene.mechanical) {
    if (mpm->scene.dimension == 2) mpm_deform_plane(velocity_gradient, dt, point->deformation_gradient);
    else mpm_deform_space(velocity_gradient, dt, point->deformation_gradient);
  }
  memcpy(point->stress, batch->stress + 6 * (size_t)s, sizeof point->stress);
  for (int k = 0; k < 6; k++) sum += point->stress[k];
  if (!isfinite(sum)) mpm_note_point(mpm, BASE_ERROR_UNSTABLE, point->tag, "stress is not finite");
  memcpy(point->scalars, batch->scalars + MPM_LAW_SCALARS * (size_t)s, sizeof point->scalars);
  point->modulus = batch->modulus[s];
  if (!mpm->scene.thermal && !mpm->law->thermal) return;
  point->temperature_law = point->temperature_mapped;
  point->heat = batch->heat[s];
  memcpy(point->conductivity, batch->conductivity + 6 * (size_t)s, sizeof point->conductivity);
  sum = point->heat;
  for (int k = 0; k < 6; k++) sum += point->conductivity[k];
  if (!isfinite(sum)) mpm_note_point(mpm, BASE_ERROR_UNSTABLE, point->tag, "heat source or conductivity is not finite");
}

/* load[0]: {W, N} on the point; load[1 + j]: what meets the slope of S along j, {V q_j, -V sigma_ij} (TM-DEMPM eq. 17
 * corrected, 18), with q = -k grad T; slopes are per unit of x / h, hence 1 / h. */
static void fill_load(const Mpm *mpm, const MpmPoint *point, MpmVec *load) {
  static const int voigt[3][3] = {{0, 3, 4}, {3, 1, 5}, {4, 5, 2}};
  const int dimension = mpm->scene.dimension;
  const double volume = point->volume0 * tensor_determinant(point->deformation_gradient);
  const double factor = volume * mpm->inverse_spacing;
  for (int j = 0; j <= dimension; j++) load[j] = (MpmVec){0.0, 0.0, 0.0, 0.0};
  if (mpm->scene.mechanical)
    for (int i = 0; i < dimension; i++) {
      load[0][1 + i] = point->force[i];
      for (int j = 0; j < dimension; j++) load[1 + j][1 + i] = -factor * point->stress[voigt[i][j]];
    }
  if (!mpm->scene.thermal) return;
  load[0][0] = volume * point->heat + point->heat_external;
  for (int j = 0; j < dimension; j++) {
    double flux = 0.0;
    for (int l = 0; l < dimension; l++) flux -= point->conductivity[voigt[j][l]] * point->temperature_gradient[l];
    load[1 + j][0] = factor * flux;
  }
}

BaseStatus mpm_law_run(Mpm *mpm, MpmPoint *points, double dt, int with_load) {
  MpmPoints *p = &mpm->points;
  const size_t width = (size_t)mpm_load_width(mpm);
  if (!mpm->scene.mechanical || dt == 0.0)
    memset(p->law_velocity_gradient, 0, 9 * (size_t)p->live * sizeof *p->law_velocity_gradient);
  fill_batch(mpm, points, dt);
  TRY(mpm->law->update(mpm->law->content, &p->batch));
#pragma omp parallel for num_threads(mpm->threads) if (p->live > MPM_PARALLEL_POINTS)
  for (int s = 0; s < p->live; s++) {
    take_answer(mpm, &points[s], s, dt);
    if (with_load) fill_load(mpm, &points[s], p->load + width * (size_t)s);
  }
  return BASE_OK;
}

void mpm_load_fill(Mpm *mpm, const MpmPoint *points) {
  MpmPoints *p = &mpm->points;
  const size_t width = (size_t)mpm_load_width(mpm);
#pragma omp parallel for num_threads(mpm->threads) if (p->live > MPM_PARALLEL_POINTS)
  for (int s = 0; s < p->live; s++) fill_load(mpm, &points[s], p->load + width * (size_t)s);
}

BaseStatus mpm_load_finish(Mpm *mpm, const MpmPoint *points) {
  MpmPoints *p = &mpm->points;
  const size_t width = (size_t)mpm_load_width(mpm);
  if (p->live > 0 && mpm->scene.mechanical) mpm_traction_add(mpm, points, p->load);
  if (p->live > 0 && mpm->scene.thermal) mpm_heat_walls(mpm, points, p->load);
  if (!mpm->halo) return BASE_OK;
  return mpm->halo->forward(mpm->halo->content, (int)(4 * width), (const double *)p->load,
                            (double *)(p->load + width * (size_t)p->own));
}
