/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Creation and the order of a step.
 *
 * Collective calls (halo, law) are made the same number of times on every rank. An error found on one rank alone (a
 * point that is not finite) is remembered; the rank goes on with no points and reports at the end of the step. Errors
 * of the callbacks themselves are the same on all ranks by contract and end the step at once; so does lack of memory,
 * which a caller must treat as fatal. */
#include <math.h>
#include <omp.h>
#include <stdio.h>
#include <string.h>

#include "mpm_core.h"

BaseStatus mpm_create(const MpmScene *scene, const MpmLaw *law, const MpmHalo *halo, Mpm **result) {
  *result = NULL;
  TRY(mpm_scene_check(scene));
  for (int i = 0; i < scene->dimension; i++)
    if (scene->periodic[i] && !halo)
      return base_error(BASE_ERROR_ARGUMENT, "scene: periodic[%d] is set; a periodic scene needs a halo", i);
  Mpm *mpm;
  TRY(BASE_ALLOC(1, &mpm));
  mpm->scene = *scene;
  mpm->law = law;
  mpm->halo = halo;
  mpm->inverse_spacing = 1.0 / scene->spacing;
  mpm->threads = scene->threads > 0 ? scene->threads : omp_get_max_threads();
  *result = mpm;
  return BASE_OK;
}

void mpm_destroy(Mpm *mpm) {
  if (!mpm) return;
  mpm_points_free(mpm);
  mpm_grid_free(&mpm->grid);
  mpm_wall_free(mpm);
  base_free(mpm->tractions);
  base_free(mpm);
}

const MpmScene *mpm_scene(const Mpm *mpm) { return &mpm->scene; }

BaseStatus mpm_set_walls(Mpm *mpm, MpmWall *walls, int count) {
  if (count < 0) return base_error(BASE_ERROR_ARGUMENT, "walls: count is %d; allowed: >= 0", count);
  for (int w = 0; w < count; w++) {
    const BaseStatus status = mpm_wall_check(&walls[w], mpm->scene.dimension, mpm->scene.thermal);
    if (status != BASE_OK) return base_error_context(status, "wall %d of %d: ", w + 1, count);
  }
  mpm->walls = walls;
  mpm->wall_count = count;
  return BASE_OK;
}

BaseStatus mpm_set_tractions(Mpm *mpm, const MpmTraction *tractions, int count) {
  if (count < 0) return base_error(BASE_ERROR_ARGUMENT, "tractions: count is %d; allowed: >= 0", count);
  for (int t = 0; t < count; t++) {
    const MpmTraction *traction = &tractions[t];
    if (traction->axis < 0 || traction->axis >= mpm->scene.dimension)
      return base_error(BASE_ERROR_ARGUMENT, "traction: axis is %d; allowed: 0 to %d", traction->axis,
                        mpm->scene.dimension - 1);
    if (traction->side != 1 && traction->side != -1)
      return base_error(BASE_ERROR_ARGUMENT, "traction: side is %d; allowed: -1 and 1", traction->side);
    for (int i = 0; i < mpm->scene.dimension; i++)
      if (!isfinite(traction->traction[i]))
        return base_error(BASE_ERROR_ARGUMENT, "traction: component %d is %g; it must be finite", i,
                          traction->traction[i]);
  }
  MpmTraction *copy = NULL;
  TRY(BASE_ALLOC((size_t)count, &copy));
  if (count > 0) memcpy(copy, tractions, (size_t)count * sizeof *copy);
  base_free(mpm->tractions);
  mpm->tractions = copy;
  mpm->traction_count = count;
  return BASE_OK;
}

/* ------------------------------------------------------------------------------------------------------ errors */

void mpm_note_error(Mpm *mpm, BaseStatus status) {
  if (status == BASE_OK || mpm->status != BASE_OK) return;
  mpm->status = status;
  snprintf(mpm->message, sizeof mpm->message, "%s", base_error_message());
}

void mpm_note_point(Mpm *mpm, BaseStatus status, int64_t tag, const char *fault) {
#pragma omp critical(mpm_note_point)
  if (tag < mpm->point_tag) {
    mpm->point_tag = tag;
    mpm->point_status = status;
    mpm->point_fault = fault;
  }
}

static int has_failed(const Mpm *mpm) { return mpm->status != BASE_OK || mpm->point_tag != INT64_MAX; }

/* From now on this rank has no points; the collective calls go on. */
static void drop_points_if_failed(Mpm *mpm) {
  if (!has_failed(mpm)) return;
  mpm->points.live = mpm->points.count = 0;
  mpm->grid.cells = mpm->grid.nodes = mpm->grid.slabs[0] = mpm->grid.slabs[1] = 0;
  mpm->contact_count = 0;
}

static BaseStatus report(Mpm *mpm) {
  if (mpm->point_tag != INT64_MAX)
    return base_error(mpm->point_status, "point %lld: %s", (long long)mpm->point_tag, mpm->point_fault);
  if (mpm->status != BASE_OK) return base_error(mpm->status, "%s", mpm->message);
  return BASE_OK;
}

static void forget_errors(Mpm *mpm) {
  mpm->status = BASE_OK;
  mpm->point_tag = INT64_MAX;
}

/* --------------------------------------------------------------------------------------------- parts of a step */

/* Points within this distance may share a node with an own point, whatever their place in their cells. */
static double halo_reach(const MpmScene *scene) {
  const double cells = scene->shape == MPM_SHAPE_LINEAR ? 2.0 : scene->shape == MPM_SHAPE_GIMP ? 3.5 : 3.0;
  return scene->spacing * (cells + 1e-6);
}

/* Foreign points, order, active grid. */
static BaseStatus gather_points(Mpm *mpm, const MpmPoint *points, int count) {
  MpmPoints *p = &mpm->points;
  p->own = p->live = count;
  p->foreign = 0;
  if (mpm->halo) {
    TRY(mpm->halo->begin(mpm->halo->content, points, count, halo_reach(&mpm->scene), &mpm->foreign_points,
                         &p->foreign));
    if (p->foreign > INT32_MAX - count)
      return base_error(BASE_ERROR_MEMORY, "more than %d points on a rank", INT32_MAX);
  }
  TRY(mpm_points_reserve(mpm, count + p->foreign));
  p->count = count + p->foreign;
  mpm_note_error(mpm, mpm_points_sort(mpm, points));
  drop_points_if_failed(mpm);
  mpm_points_load(mpm, points);
  TRY(mpm_grid_build(mpm));
  return BASE_OK;
}

/* state = {0, v_I}, v_I = momentum / mass. */
static void find_node_velocity(Mpm *mpm) {
  MpmGrid *grid = &mpm->grid;
  for (int n = 0; n < grid->nodes; n++) {
    const double mass = grid->sum[n][0], inverse = mass > 0.0 ? 1.0 / mass : 0.0;
    grid->state[n] = inverse * grid->sum[n];
    grid->state[n][0] = 0.0;
  }
}

/* Nodes of almost no mass move with the points' field and carry no force: their acceleration would be noise (B7). */
static void find_node_acceleration(Mpm *mpm) {
  MpmGrid *grid = &mpm->grid;
  for (int n = 0; n < grid->nodes; n++) {
    const double mass = grid->sum[n][0], heat = grid->rate[n][0];
    const double inverse = mass > mpm->scene.mass_cutoff * grid->scale[n] ? 1.0 / mass : 0.0;
    grid->rate[n] = inverse * grid->rate[n];
    grid->rate[n][0] = heat;
  }
}

static BaseStatus start_grid(Mpm *mpm) {
  mpm_p2g_momentum(mpm, mpm->scene.thermal, mpm->scene.transfer == MPM_TRANSFER_APIC);
  find_node_velocity(mpm);
  TRY(mpm_wall_find(mpm));
  if (mpm->scene.thermal) mpm_heat_start(mpm);
  if (mpm->scene.mechanical) mpm_wall_start(mpm);
  return BASE_OK;
}

/* Forces and heat at the points -> rates at the nodes -> points. */
static BaseStatus advance(Mpm *mpm, MpmPoint *points) {
  TRY(mpm_load_finish(mpm, points));
  mpm_p2g_load(mpm);
  find_node_acceleration(mpm);
  if (mpm->scene.thermal) mpm_heat_update(mpm);
  if (mpm->scene.mechanical) {
    mpm_wall_update(mpm);
    if (mpm->scene.transfer == MPM_TRANSFER_XPIC) TRY(mpm_extended_velocity(mpm));
  }
  mpm_g2p_update(mpm, points);
  if (mpm->scene.mechanical) mpm_wall_guard(mpm, points);
  return BASE_OK;
}

/* state = updated field; MUSL: the velocity of the updated points instead, at the nodes where they were. */
static BaseStatus renew_state(Mpm *mpm, const MpmPoint *points) {
  MpmPoints *p = &mpm->points;
  MpmGrid *grid = &mpm->grid;
  for (int n = 0; n < grid->nodes; n++) grid->state[n] += mpm->dt * grid->rate[n];
  mpm->state_is_new = 1;
  if (mpm->scene.order != MPM_ORDER_MUSL) return BASE_OK;

  const int is_affine = mpm->scene.transfer == MPM_TRANSFER_APIC, width = is_affine ? 12 : 3;
  for (int s = 0; s < p->live; s++) {
    memcpy(p->carry + (size_t)width * (size_t)s, points[s].velocity, sizeof points[s].velocity);
    if (is_affine) memcpy(p->carry + 12 * (size_t)s + 3, points[s].affine, sizeof points[s].affine);
  }
  if (mpm->halo)
    TRY(mpm->halo->forward(mpm->halo->content, width, p->carry, p->carry + (size_t)width * (size_t)p->own));
  for (int k = 0; k < p->count; k++) {
    const double *v = p->carry + (size_t)width * (size_t)p->item[k].slot;
    p->motion[k] = (MpmVec){1.0, v[0], v[1], mpm->scene.dimension == 3 ? v[2] : 0.0};
    if (is_affine) memcpy(p->affine[k], v + 3, sizeof p->affine[k]);
  }
  mpm_p2g_momentum(mpm, 0, is_affine);
  for (int n = 0; n < grid->nodes; n++) {
    const double temperature = grid->state[n][0], mass = grid->sum[n][0];
    grid->state[n] = (mass > 0.0 ? 1.0 / mass : 0.0) * grid->sum[n];
    grid->state[n][0] = temperature;
  }
  mpm_wall_start(mpm);
  return BASE_OK;
}

/* ---------------------------------------------------------------------------------------------------- the step */

/* USF (TM-DEMPM fig. 3): the law first, with the velocity of the incoming points. */
static BaseStatus step_law_first(Mpm *mpm, MpmPoint *points) {
  const int what =
      (mpm->scene.mechanical ? MPM_GRADIENT_VELOCITY : 0) | (mpm->scene.thermal ? MPM_GRADIENT_TEMPERATURE : 0);
  mpm_g2p_gradient(mpm, points, what);
  TRY(mpm_law_run(mpm, points, mpm->dt, 1));
  drop_points_if_failed(mpm); /* before one bad stress reaches its neighbours, and the message names them */
  return advance(mpm, points);
}

/* USL, MUSL: the law last, with the updated velocity. */
static BaseStatus step_law_last(Mpm *mpm, MpmPoint *points) {
  if (mpm->scene.thermal) mpm_g2p_gradient(mpm, points, MPM_GRADIENT_TEMPERATURE);
  mpm_load_fill(mpm, points);
  TRY(advance(mpm, points));
  if (mpm->scene.mechanical) {
    TRY(renew_state(mpm, points));
    mpm_g2p_gradient(mpm, points, MPM_GRADIENT_VELOCITY);
  }
  return mpm_law_run(mpm, points, mpm->dt, 0);
}

BaseStatus mpm_step(Mpm *mpm, MpmPoint *points, int count, double dt) {
  if (!(dt > 0.0 && isfinite(dt)))
    return base_error(BASE_ERROR_ARGUMENT, "time step is %g; allowed: finite and > 0", dt);
  if (count < 0) return base_error(BASE_ERROR_ARGUMENT, "number of points is %d; allowed: >= 0", count);
  forget_errors(mpm);
  mpm->dt = dt;
  mpm->state_is_new = 0;
  TRY(gather_points(mpm, points, count));
  TRY(start_grid(mpm));
  TRY(mpm->scene.order == MPM_ORDER_USF ? step_law_first(mpm, points) : step_law_last(mpm, points));
  return report(mpm);
}

BaseStatus mpm_initialise(Mpm *mpm, MpmPoint *points, int count) {
  if (count < 0) return base_error(BASE_ERROR_ARGUMENT, "number of points is %d; allowed: >= 0", count);
  forget_errors(mpm);
  TRY(mpm_points_reserve(mpm, count));
  mpm->points.own = mpm->points.live = count;
  for (int s = 0; s < count; s++) points[s].temperature_mapped = points[s].temperature_law = points[s].temperature;
  TRY(mpm_law_run(mpm, points, 0.0, 0));
  return report(mpm);
}

void mpm_grid_view(const Mpm *mpm, MpmGridView *view) {
  const MpmGrid *grid = &mpm->grid;
  const double step = mpm->state_is_new ? 0.0 : mpm->dt;
  for (int n = 0; n < grid->nodes; n++) {
    const MpmVec state = grid->state[n] + step * grid->rate[n];
    grid->view_mass[n] = grid->sum[n][0];
    for (int i = 0; i < 3; i++) grid->view_velocity[3 * n + i] = state[1 + i];
    if (mpm->scene.thermal) grid->view_temperature[n] = state[0];
  }
  *view = (MpmGridView){.nodes = grid->nodes,
                        .index = (const int *)grid->index,
                        .mass = grid->view_mass,
                        .velocity = grid->view_velocity,
                        .temperature = mpm->scene.thermal ? grid->view_temperature : NULL,
                        .owned = grid->owned};
}
