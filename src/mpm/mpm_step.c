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

static void set_spacing(Mpm *mpm, const double stretch[3]) {
  const double h = mpm->scene.spacing;
  mpm->per_length = mpm_vec_all(1.0 / h);
  for (int i = 0; i < 3; i++) {
    mpm->spacing[i] = i < mpm->scene.dimension ? h * stretch[i] : h;
    mpm->per_length[1 + i] = 1.0 / mpm->spacing[i];
  }
}

double mpm_smallest_spacing(const Mpm *mpm) {
  return fmin(mpm->spacing[0], fmin(mpm->spacing[1], mpm->spacing[2]));
}

BaseStatus mpm_set_stretch(Mpm *mpm, const double stretch[3]) {
  for (int i = 0; i < mpm->scene.dimension; i++) {
    if (!(stretch[i] > 0.0 && isfinite(stretch[i])))
      return base_error(BASE_ERROR_ARGUMENT, "stretch of the grid along axis %d is %g; allowed: finite and > 0", i, stretch[i]);
    if (mpm->scene.periodic[i] && stretch[i] != 1.0)
      return base_error(BASE_ERROR_ARGUMENT, "the grid cannot be stretched along axis %d, which is periodic", i);
  }
  set_spacing(mpm, stretch);
  mpm_points_forget_movers(mpm);
  return BASE_OK;
}

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
  const double unstretched[3] = {1.0, 1.0, 1.0};
  set_spacing(mpm, unstretched);
  mpm->threads = scene->threads > 0 ? scene->threads : omp_get_max_threads();
  mpm->heat_duration = -1.0;
  *result = mpm;
  return BASE_ALLOC((size_t)(MPM_SHARES * mpm->threads), &mpm->queue);
}

void mpm_destroy(Mpm *mpm) {
  if (!mpm) return;
  mpm_points_free(mpm);
  mpm_grid_free(&mpm->grid);
  mpm_wall_free(mpm);
  base_free(mpm->tractions);
  base_free(mpm->queue);
  base_free(mpm);
}

const MpmScene *mpm_scene(const Mpm *mpm) { return &mpm->scene; }

void mpm_set_heat_duration(Mpm *mpm, double duration) { mpm->heat_duration = duration; }

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
    if (traction->surface) {
      if (isfinite(traction->pressure)) continue;
      return base_error(BASE_ERROR_ARGUMENT, "traction: pressure is %g; it must be finite", traction->pressure);
    }
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
  mpm->points.has_order = mpm->grid.is_current = 0;
  mpm->grid.cells = mpm->grid.nodes = mpm->grid.slabs[0] = mpm->grid.slabs[1] = 0;
  mpm_share_set(mpm);
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
static double halo_reach(const Mpm *mpm) {
  const MpmScene *scene = &mpm->scene;
  const double cells = scene->shape == MPM_SHAPE_LINEAR ? 2.0 : scene->shape == MPM_SHAPE_GIMP ? 3.5 : 3.0;
  return mpm_largest_spacing(mpm) * (cells + 1e-6);
}

/* Copies of foreign points. Collective. */
static BaseStatus gather_foreign(Mpm *mpm, const MpmPoint **foreign) {
  MpmPoints *p = &mpm->points;
  mpm_points_write(mpm, MPM_WRITE_MOTION | (mpm->scene.gimp_stretch ? MPM_WRITE_SHAPE : 0));
  TRY(mpm->halo->begin(mpm->halo->content, p->home, p->own, halo_reach(mpm), foreign, &p->foreign));
  if (p->foreign > INT32_MAX - p->own) return base_error(BASE_ERROR_MEMORY, "more than %d points on a rank", INT32_MAX);
  return mpm_points_reserve(mpm, p->own + p->foreign);
}

/* Foreign points, order, active grid. */
static BaseStatus gather_points(Mpm *mpm) {
  MpmPoints *p = &mpm->points;
  const MpmPoint *foreign = NULL;
  if (mpm->halo) TRY(gather_foreign(mpm, &foreign));
  p->place = p->position;
  if (!has_failed(mpm) && mpm->grid.is_current) mpm_note_error(mpm, mpm_points_order(mpm));
  p->place = p->position;
  p->count = p->own + p->foreign;
  if (!has_failed(mpm)) mpm_points_load_foreign(mpm, foreign);
  drop_points_if_failed(mpm);
  if (mpm->heats) mpm_points_load_heat(mpm, foreign);
  const BaseStatus status = mpm_grid_build(mpm);
  if (status == BASE_ERROR_MEMORY) return status;
  mpm_note_error(mpm, status);
  drop_points_if_failed(mpm);
  return BASE_OK;
}

/* Values of foreign rows from their owners: vectors (lanes 1 to 3), and tensors unless NULL. Collective. */
BaseStatus mpm_forward_rows(Mpm *mpm, MpmVec *vector, double (*tensor)[9]) {
  MpmPoints *p = &mpm->points;
  const size_t width = tensor ? 12 : 3;
  for (int k = 0; k < p->live; k++) {
    double *value = p->carry + width * (size_t)p->slot[k];
    for (int i = 0; i < 3; i++) value[i] = vector[k][1 + i];
    if (tensor) memcpy(value + 3, tensor[k], sizeof *tensor);
  }
  double *foreign = p->carry + width * (size_t)p->own;
  TRY(mpm->halo->forward(mpm->halo->content, (int)width, p->carry, foreign));
  for (int s = 0; s < p->count - p->own; s++) {
    const double *value = foreign + width * (size_t)p->foreign_slot[s];
    vector[p->own + s] = (MpmVec){1.0, value[0], value[1], value[2]};
    if (tensor) memcpy(tensor[p->own + s], value + 3, sizeof *tensor);
  }
  return BASE_OK;
}

/* Sweeps over the nodes. */
#define FOR_NODES(mpm, n) \
  _Pragma("omp parallel for num_threads((mpm)->threads) if (mpm_is_parallel(mpm))") \
  for (int n = 0; n < (mpm)->grid.nodes; n++)

/* state = {0, v_I}, v_I = momentum / mass. */
static void find_node_velocity(Mpm *mpm) {
  MpmGrid *grid = &mpm->grid;
  FOR_NODES(mpm, n) {
    const double mass = grid->sum[n][0], inverse = mass > 0.0 ? 1.0 / mass : 0.0;
    grid->state[n] = inverse * grid->sum[n];
    grid->state[n][0] = 0.0;
  }
}

/* Nodes of almost no mass move with the points' field and carry no force: their acceleration would be noise (B7). */
static void find_node_acceleration(Mpm *mpm) {
  MpmGrid *grid = &mpm->grid;
  FOR_NODES(mpm, n) {
    const double mass = grid->sum[n][0], heat = grid->rate[n][0];
    const double inverse = mass > mpm->scene.mass_cutoff * grid->scale[n] ? 1.0 / mass : 0.0;
    grid->rate[n] = inverse * grid->rate[n];
    grid->rate[n][0] = heat;
  }
}

static BaseStatus start_grid(Mpm *mpm) {
  mpm_p2g_momentum(mpm, mpm->points.motion, mpm->heats, mpm->scene.transfer == MPM_TRANSFER_APIC);
  find_node_velocity(mpm);
  mpm->contact_count = mpm->has_corners = 0;
  if (mpm->wall_count > 0) {
    mpm_grid_find_index(mpm);
    TRY(mpm_wall_find(mpm));
  }
  if (mpm->heats) mpm_heat_start(mpm);
  if (mpm->scene.mechanical) mpm_wall_start(mpm);
  return BASE_OK;
}

/* Rates at the nodes -> points. */
static BaseStatus advance(Mpm *mpm) {
  find_node_acceleration(mpm);
  if (mpm->heats) mpm_heat_update(mpm);
  if (mpm->scene.mechanical) {
    mpm_wall_update(mpm);
    if (mpm->scene.transfer == MPM_TRANSFER_XPIC) TRY(mpm_extended_velocity(mpm));
  }
  mpm_g2p_update(mpm);
  if (mpm->scene.thermal && mpm->heat_duration >= 0.0) mpm_heat_carry(mpm);
  if (mpm->scene.mechanical && mpm->wall_scratch.nears > 0) {
    mpm_wall_guard(mpm);
    mpm_points_forget_movers(mpm);
  }
  return BASE_OK;
}

/* Forces and heat at the points -> rates at the nodes. */
static BaseStatus find_rates(Mpm *mpm) {
  if (mpm->scene.thermal && mpm->heat_duration >= 0.0) mpm_heat_collect(mpm);
  TRY(mpm_load_fill(mpm));
  mpm_p2g_load(mpm);
  return BASE_OK;
}

/* state = updated field; MUSL: the velocity of the updated points instead, at the nodes where they were. */
static BaseStatus renew_state(Mpm *mpm) {
  MpmPoints *p = &mpm->points;
  MpmGrid *grid = &mpm->grid;
  FOR_NODES(mpm, n) grid->state[n] += mpm->dt * grid->rate[n];
  mpm->state_is_new = 1;
  p->place = p->old_position;
  if (mpm->scene.order != MPM_ORDER_MUSL) return BASE_OK;

  if (mpm->halo) TRY(mpm_forward_rows(mpm, p->motion, p->affine));
  mpm_p2g_momentum(mpm, p->motion, 0, mpm->scene.transfer == MPM_TRANSFER_APIC);
  FOR_NODES(mpm, n) {
    const double temperature = grid->state[n][0], mass = grid->sum[n][0];
    grid->state[n] = (mass > 0.0 ? 1.0 / mass : 0.0) * grid->sum[n];
    grid->state[n][0] = temperature;
  }
  mpm_wall_start(mpm);
  return BASE_OK;
}

/* ---------------------------------------------------------------------------------------------------- the step */

/* Velocity gradient and law; is_fused: and its load on the nodes. */
static BaseStatus find_stress(Mpm *mpm, int is_fused) {
  const int is_local = mpm_law_is_local(mpm), averages = mpm_averages(mpm);
  if (is_local && !averages) {
    mpm_stress(mpm, is_fused);
    return BASE_OK;
  }
  mpm_g2p_velocity_gradient(mpm);
  if (averages) TRY(mpm_volumetric_gradient(mpm));
  if (!is_local) return mpm_law_run(mpm, mpm->dt);
  mpm_law_all_rows(mpm);
  return BASE_OK;
}

/* USF (TM-DEMPM fig. 3): the law first, with the velocity of the incoming points. */
static BaseStatus step_law_first(Mpm *mpm) {
  const int is_fused = mpm_law_is_local(mpm) && !mpm_uses_load(mpm);
  if (mpm->heats) mpm_g2p_temperature_gradient(mpm);
  if (mpm->scene.mechanical) TRY(find_stress(mpm, is_fused)); /* at rest conductivities stay what they were */
  drop_points_if_failed(mpm); /* before one bad stress reaches its neighbours, and the message names them */
  if (!is_fused) TRY(find_rates(mpm));
  return advance(mpm);
}

/* USL, MUSL: the law last, with the updated velocity. */
static BaseStatus step_law_last(Mpm *mpm) {
  if (mpm->heats) mpm_g2p_temperature_gradient(mpm);
  TRY(find_rates(mpm));
  TRY(advance(mpm));
  if (mpm->scene.mechanical) {
    TRY(renew_state(mpm));
    TRY(find_stress(mpm, 0));
  }
  return BASE_OK;
}

static BaseStatus check_time_step(double dt) {
  if (!(dt > 0.0 && isfinite(dt)))
    return base_error(BASE_ERROR_ARGUMENT, "time step is %g; allowed: finite and > 0", dt);
  return BASE_OK;
}

static BaseStatus check_count(int count) {
  if (count < 0) return base_error(BASE_ERROR_ARGUMENT, "number of points is %d; allowed: >= 0", count);
  return BASE_OK;
}

/* The rows are there, and local errors noted. */
static BaseStatus step_rows(Mpm *mpm, double dt) {
  mpm->dt = dt;
  mpm->state_is_new = 0;
  mpm->heats = mpm->scene.thermal && mpm->heat_duration != 0.0;
  TRY(gather_points(mpm));
  TRY(start_grid(mpm));
  TRY(mpm->scene.order == MPM_ORDER_USF ? step_law_first(mpm) : step_law_last(mpm));
  mpm->points.has_stepped = 1;
  mpm->points.fastest = INFINITY;
  mpm->points.sound_age++;
  return report(mpm);
}

BaseStatus mpm_attach(Mpm *mpm, MpmPoint *points, int count) {
  TRY(check_count(count));
  forget_errors(mpm);
  return mpm_points_attach(mpm, points, count);
}

BaseStatus mpm_advance(Mpm *mpm, double dt) {
  TRY(check_time_step(dt));
  const BaseStatus status = step_rows(mpm, dt);
  if (status != BASE_OK) mpm->points.has_order = 0;
  return status;
}

void mpm_write(const Mpm *mpm) { mpm_points_write(mpm, MPM_WRITE_ALL); }

BaseStatus mpm_step(Mpm *mpm, MpmPoint *points, int count, double dt) {
  TRY(check_time_step(dt));
  TRY(mpm_attach(mpm, points, count));
  TRY(mpm_advance(mpm, dt));
  mpm_write(mpm);
  return BASE_OK;
}

BaseStatus mpm_initialise(Mpm *mpm, MpmPoint *points, int count) {
  TRY(check_count(count));
  for (int s = 0; s < count; s++) points[s].temperature_mapped = points[s].temperature_law = points[s].temperature;
  TRY(mpm_attach(mpm, points, count));
  drop_points_if_failed(mpm);
  TRY(mpm_law_run(mpm, 0.0));
  mpm_points_write(mpm, MPM_WRITE_LAW);
  return report(mpm);
}

void mpm_grid_view(Mpm *mpm, MpmGridView *view) {
  const MpmGrid *grid = &mpm->grid;
  const double step = mpm->state_is_new ? 0.0 : mpm->dt;
  mpm_grid_find_index(mpm);
  for (int n = 0; n < grid->nodes; n++) {
    const MpmVec state = grid->state[n] + step * grid->rate[n];
    grid->view_mass[n] = grid->sum[n][0];
    for (int i = 0; i < 3; i++) grid->view_velocity[3 * n + i] = state[1 + i];
    if (mpm->heats) grid->view_temperature[n] = state[0];
  }
  *view = (MpmGridView){.nodes = grid->nodes,
                        .spacing = {mpm->spacing[0], mpm->spacing[1], mpm->spacing[2]},
                        .index = (const int *)grid->index,
                        .mass = grid->view_mass,
                        .velocity = grid->view_velocity,
                        .temperature = mpm->heats ? grid->view_temperature : NULL,
                        .owned = grid->owned};
}
