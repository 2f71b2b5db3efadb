/* SPDX-License-Identifier: GPL-2.0-or-later */
#define _POSIX_C_SOURCE 200809L
#include "rve_law.h"

#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "rank_agree.h"
#include "rank_threads.h"
#include "rve_law_private.h"

/* What travels per point. */
enum {
  INPUT_WIDTH = sizeof(RveInput) / sizeof(double),
  OUT_STRESS = 0,
  OUT_HEAT = 6,
  OUT_CONDUCTIVITY = 7,
  OUT_MODULUS = 13,
  OUT_SCALARS = 14,
  OUTPUT_WIDTH = OUT_SCALARS + MPM_LAW_SCALARS
};
_Static_assert(INPUT_WIDTH == 10, "an RveInput is 9 + 1 doubles without gaps");
_Static_assert((int)OUTPUT_WIDTH <= (int)RVE_FARM_WIDTH, "the answer fits a transfer");

/* -- creation -------------------------------------------------------------------------------------------------- */

static RveScene with_threads(const RveScene *scene, int node_threads) {
  RveScene result = *scene;
  if (scene->threads == 0 && !getenv("OMP_NUM_THREADS")) result.threads = node_threads;
  return result;
}

BaseStatus rve_law_create(MPI_Comm comm, const RveScene *scene, const RvePacking *packings, int packing_count,
                          RveBackend backend, RveLaw **result) {
  int rank;
  RveLaw *law;
  *result = NULL;
  MPI_Comm_rank(comm, &rank);
  BaseStatus status = rank_agree(comm, BASE_ALLOC(1, &law), rank);
  if (status != BASE_OK) {
    base_free(law);
    return status;
  }
  MPI_Comm_dup(comm, &law->comm);
  law->rank = rank;
  MPI_Comm_size(comm, &law->ranks);
  law->node_threads = rank_threads(comm);
  law->backend = backend == RVE_BACKEND_AUTO && !rve_device_present() ? RVE_BACKEND_CPU : backend;
  const RveScene resolved = with_threads(scene, law->node_threads);
  status = rve_store_create(&resolved, packings, packing_count, law->backend, &law->store);
  TRY_GOTO(rank_agree(law->comm, status, rank), status, fail);
  TRY_GOTO(rve_farm_create(law->comm, &law->farm), status, fail);
  *result = law;
  return BASE_OK;

fail:
  rve_law_destroy(law);
  return status;
}

void rve_law_destroy(RveLaw *law) {
  if (!law) return;
  rve_farm_destroy(law->farm);
  rve_store_destroy(law->store);
  base_free(law->point_value);
  base_free(law->request_input);
  base_free(law->run_input);
  base_free(law->run_handle);
  base_free(law->request_value);
  base_free(law->replay_directory);
  MPI_Comm_free(&law->comm);
  base_free(law);
}

/* Where a device is too small for its RVEs, all ranks leave theirs: another backend has other last bits, and an answer must not
 * depend on its rank. Collective. */
BaseStatus rve_law_agree_on_device(RveLaw *law) {
  if (law->backend == RVE_BACKEND_CPU) return BASE_OK;
  int left = rve_store_left_device(law->store), any;
  MPI_Allreduce(&left, &any, 1, MPI_INT, MPI_MAX, law->comm);
  if (!any) return BASE_OK;
  law->backend = RVE_BACKEND_CPU;
  law->left_device = 1;
  return rank_agree(law->comm, rve_store_leave_device(law->store), law->rank);
}

/* After a change of all RVEs. */
static BaseStatus agree(RveLaw *law, BaseStatus status) {
  TRY(rank_agree(law->comm, status, law->rank));
  return rve_law_agree_on_device(law);
}

int rve_law_left_device(const RveLaw *law) { return law->left_device; }

/* -- which RVEs there are -------------------------------------------------------------------------------------- */

static BaseStatus create_missing_here(RveFarm *farm, RveStore *store) {
  const int64_t *tags;
  int *handles, packing_count, missing = 0;
  const int own = rve_farm_own(farm, &tags, &handles);
  for (int k = 0; k < own; k++) missing += handles[k] < 0;
  if (missing == 0) return BASE_OK;
  rve_store_packings(store, &packing_count);

  int64_t *tag = NULL;
  int *packing = NULL, *handle = NULL, n = 0;
  BaseStatus status;
  TRY_GOTO(BASE_ALLOC((size_t)missing, &tag), status, done);
  TRY_GOTO(BASE_ALLOC((size_t)missing, &packing), status, done);
  TRY_GOTO(BASE_ALLOC((size_t)missing, &handle), status, done);
  for (int k = 0; k < own; k++) {
    if (handles[k] >= 0) continue;
    packing[n] = (int)((tags[k] - 1) % packing_count);
    tag[n++] = tags[k];
  }
  TRY_GOTO(rve_store_add(store, missing, tag, packing, handle), status, done);
  n = 0;
  for (int k = 0; k < own; k++)
    if (handles[k] < 0) handles[k] = handle[n++];
done:
  base_free(tag);
  base_free(packing);
  base_free(handle);
  return status;
}

BaseStatus rve_law_create_missing(MPI_Comm comm, RveFarm *farm, RveStore *store) {
  int rank;
  MPI_Comm_rank(comm, &rank);
  return rank_agree(comm, create_missing_here(farm, store), rank);
}

static BaseStatus assign(RveLaw *law, int n, const int64_t *tags, int forget) {
  TRY(rve_farm_assign(law->farm, n, tags, forget));
  for (int h = rve_store_next(law->store, -1); h >= 0; h = rve_store_next(law->store, h))
    if (rve_farm_handle(law->farm, rve_store_item(law->store, h)->tag) != h) rve_store_release(law->store, h);
  TRY(rve_law_create_missing(law->comm, law->farm, law->store));
  return rve_law_agree_on_device(law);
}

BaseStatus rve_law_assign(RveLaw *law, int n, const int64_t *tags) { return assign(law, n, tags, 1); }

/* -- exchange -------------------------------------------------------------------------------------------------- */

static BaseStatus reserve(RveLaw *law, int points, int requests) {
  TRY(rve_store_reserve(law->store, requests));
  if (points > law->point_room) {
    TRY(BASE_GROW(0, (size_t)points * RVE_FARM_WIDTH, &law->point_value));
    law->point_room = points;
  }
  if (requests > law->request_room) {
    TRY(BASE_GROW(0, (size_t)requests, &law->request_input));
    TRY(BASE_GROW(0, (size_t)requests, &law->run_input));
    TRY(BASE_GROW(0, (size_t)requests, &law->run_handle));
    TRY(BASE_GROW(0, (size_t)requests * RVE_FARM_WIDTH, &law->request_value));
    law->request_room = requests;
  }
  return BASE_OK;
}

/* A plan for these points; RVEs for tags that have none. */
static BaseStatus plan(RveLaw *law, int n, const int64_t *tags) {
  RveFarmNews news;
  TRY(rve_farm_plan(law->farm, n, tags, &news));
  if (news == RVE_FARM_UNKNOWN) {
    TRY(assign(law, n, tags, 0));
    TRY(rve_farm_plan(law->farm, n, tags, &news));
  }
  if (news == RVE_FARM_SAME) return BASE_OK;
  const int64_t *asked;
  const int *handles;
  const int requests = rve_farm_requests(law->farm, &asked, &handles);
  BaseStatus status = rank_agree(law->comm, reserve(law, n, requests), law->rank);
  if (status != BASE_OK) rve_farm_drop_plan(law->farm); /* there is no room for what it wants */
  return status;
}

BaseStatus rve_law_set_volumes(RveLaw *law, int n, const int64_t *tags, const double *volumes) {
  const int64_t *asked;
  const int *handles;
  BaseStatus status = BASE_OK;
  for (int p = 0; p < n && status == BASE_OK; p++)
    if (!(volumes[p] > 0.0 && isfinite(volumes[p])))
      status = base_error(BASE_ERROR_ARGUMENT, "material point %" PRId64 " has the volume %g, must be > 0", tags[p],
                          volumes[p]);
  TRY(rank_agree(law->comm, status, law->rank));
  TRY(plan(law, n, tags));
  rve_farm_send(law->farm, 1, volumes, law->request_value);
  const int requests = rve_farm_requests(law->farm, &asked, &handles);
  for (int q = 0; q < requests; q++) {
    RveStoreItem *item = rve_store_item(law->store, handles[q]);
    item->scale = law->request_value[q] / item->answer.volume;
  }
  return BASE_OK;
}

static void pack_input(const MpmLawBatch *batch, double *value) {
  for (int p = 0; p < batch->n; p++) {
    memcpy(value + (size_t)p * INPUT_WIDTH, batch->velocity_gradient + 9 * (size_t)p, 9 * sizeof *value);
    value[(size_t)p * INPUT_WIDTH + 9] = batch->temperature ? batch->temperature[p] : 0.0;
  }
}

static void pack_answer(const RveStoreItem *item, double *value) {
  const RveAnswer *answer = &item->answer;
  const int is_resting = item->rest.skipped > 0;
  double *scalars = value + OUT_SCALARS;
  memcpy(value + OUT_STRESS, is_resting ? item->rest.stress : answer->stress, sizeof answer->stress);
  memcpy(value + OUT_CONDUCTIVITY, answer->conductivity, sizeof answer->conductivity);
  value[OUT_HEAT] = is_resting ? 0.0 : answer->heat;
  value[OUT_MODULUS] = answer->modulus;
  scalars[MPM_LAW_SOLID_FRACTION] = answer->solid_fraction;
  scalars[MPM_LAW_COORDINATION] = answer->coordination;
  scalars[MPM_LAW_BOND_FRACTION] = answer->bond_fraction;
  scalars[MPM_LAW_UNBALANCED] = answer->unbalanced;
  scalars[MPM_LAW_ENERGY_DENSITY] = (answer->elastic_energy + answer->kinetic_energy) / answer->volume;
  scalars[MPM_LAW_DISSIPATION] = is_resting ? 0.0 : item->dissipation;
}

static void unpack_answers(const double *value, MpmLawBatch *batch) {
  for (int p = 0; p < batch->n; p++, value += OUTPUT_WIDTH) {
    memcpy(batch->stress + 6 * (size_t)p, value + OUT_STRESS, 6 * sizeof *value);
    if (batch->conductivity) memcpy(batch->conductivity + 6 * (size_t)p, value + OUT_CONDUCTIVITY, 6 * sizeof *value);
    memcpy(batch->scalars + MPM_LAW_SCALARS * (size_t)p, value + OUT_SCALARS, MPM_LAW_SCALARS * sizeof *value);
    if (batch->heat) batch->heat[p] = value[OUT_HEAT];
    batch->modulus[p] = value[OUT_MODULUS];
  }
}

/* The lowest tag among the requests whose input is not finite, 0 if all are. */
static int64_t bad_request(const RveLaw *law, int requests, const int64_t *tags) {
  int64_t lowest = 0;
  for (int q = 0; q < requests; q++) {
    const RveInput *input = &law->request_input[q];
    int finite = isfinite(input->temperature);
    for (int k = 0; k < 9; k++) finite = finite && isfinite(input->velocity_gradient[k]);
    if (!finite && (lowest == 0 || tags[q] < lowest)) lowest = tags[q];
  }
  return lowest;
}

BaseStatus rve_law_set_replay(RveLaw *law, const char *directory) {
  base_free(law->replay_directory);
  law->replay_directory = NULL;
  if (!directory) return BASE_OK;
  const size_t bytes = strlen(directory) + 1;
  TRY(base_alloc(bytes, 1, (void **)&law->replay_directory));
  memcpy(law->replay_directory, directory, bytes);
  rve_store_keep_states(law->store);
  return BASE_OK;
}

/* The error for a failed RVE; writes its replay. */
static BaseStatus report_failure(const RveLaw *law, int handle, int64_t tag) {
  RveFailure failure;
  char file[512], note[768] = "";
  TRY(rve_store_failure(law->store, handle, &failure));
  if (law->replay_directory) {
    snprintf(file, sizeof file, "%s/rve_%" PRId64 ".replay", law->replay_directory, tag);
    if (rve_store_write_replay(law->store, handle, file) == BASE_OK)
      snprintf(note, sizeof note, ". Repeat it with: dempm-rve replay %s", file);
    else snprintf(note, sizeof note, ". No replay file: %.200s", base_error_message());
  }
  return base_error(BASE_ERROR_UNSTABLE,
                    "the RVE of material point %" PRId64 " is unstable at DEM step %" PRId64 " (%" PRId64 " of %" PRId64
                    " of its call): %s%s",
                    tag, failure.step, failure.call_step, failure.call_steps, failure.cause, note);
}

void rve_law_set_rest(RveLaw *law, double error) { law->rest_error = error; }

/* run_handle, run_input: the RVEs that have to be run; returns their number. */
static int leave_resting(RveLaw *law, int requests, const int *handles, double dt) {
  const RveScene *scene = rve_store_scene(law->store);
  int run = 0;
  for (int q = 0; q < requests; q++) {
    RveStoreItem *item = rve_store_item(law->store, handles[q]);
    law->run_input[run] = law->request_input[q];
    law->run_handle[run] = handles[q];
    run += !rve_rest_skips(&item->rest, scene, &item->answer, law->rest_error, dt, &law->run_input[run]);
  }
  law->rested += requests - run;
  return run;
}

/* An answer without a step (dt = 0) leaves RVEs that rest as they are. */
static void judge_rest(RveLaw *law, int run, double dt) {
  const RveScene *scene = rve_store_scene(law->store);
  for (int q = 0; q < run; q++) {
    RveStoreItem *item = rve_store_item(law->store, law->run_handle[q]);
    const double temperature = law->run_input[q].temperature;
    if (dt > 0.0 && law->rest_error > 0.0)
      rve_rest_judge(&item->rest, scene, &item->answer, law->rest_error, temperature);
    else if (dt > 0.0 || item->rest.skipped == 0) rve_rest_wake(&item->rest, scene, &item->answer, temperature);
  }
}

/* This rank's RVEs; the error of the lowest tag on any rank is everybody's. */
static BaseStatus step_requests(RveLaw *law, double dt) {
  const int64_t *asked;
  const int *handles;
  int unstable = -1;
  const int requests = rve_farm_requests(law->farm, &asked, &handles);
  int64_t key = bad_request(law, requests, asked);
  int run = 0;
  BaseStatus status;
  if (key > 0)
    status = base_error(BASE_ERROR_UNSTABLE, "material point %" PRId64
                        ": its velocity gradient or temperature is not finite", key);
  else {
    run = leave_resting(law, requests, handles, dt);
    status = rve_store_step(law->store, run, law->run_handle, law->run_input, dt, &unstable);
  }
  if (unstable >= 0) {
    key = rve_store_item(law->store, unstable)->tag;
    status = report_failure(law, unstable, key);
  }
  TRY(rank_agree(law->comm, status, key));
  TRY(rve_law_agree_on_device(law));

  judge_rest(law, run, dt);
  law->worst_unbalanced = 0.0;
  for (int q = 0; q < requests; q++) {
    const RveStoreItem *item = rve_store_item(law->store, handles[q]);
    law->worst_unbalanced = fmax(law->worst_unbalanced, item->answer.unbalanced);
    pack_answer(item, law->request_value + (size_t)q * OUTPUT_WIDTH);
  }
  if (dt > 0.0) law->rves_run = run;
  return BASE_OK;
}

static BaseStatus update(void *content, MpmLawBatch *batch) {
  RveLaw *law = content;
  TRY(plan(law, batch->n, batch->tag));
  pack_input(batch, law->point_value);
  rve_farm_send(law->farm, INPUT_WIDTH, law->point_value, (double *)law->request_input);
  TRY(step_requests(law, batch->dt));
  rve_farm_reply(law->farm, OUTPUT_WIDTH, law->request_value, law->point_value);
  unpack_answers(law->point_value, batch);
  return BASE_OK;
}

static void destroy(void *content) { rve_law_destroy(content); }

void rve_law_as_mpm_law(RveLaw *law, MpmLaw *mpm_law) {
  *mpm_law = (MpmLaw){"rve", law, rve_store_scene(law->store)->thermal, update, destroy, NULL, NULL};
}

/* -- all RVEs at once ------------------------------------------------------------------------------------------ */

BaseStatus rve_law_set_scene(RveLaw *law, const RveScene *scene) {
  const RveScene resolved = with_threads(scene, law->node_threads);
  return agree(law, rve_store_set_scene(law->store, &resolved));
}

BaseStatus rve_law_install_bonds(RveLaw *law) {
  return agree(law, rve_store_install_bonds(law->store));
}

BaseStatus rve_law_rest(RveLaw *law) { return agree(law, rve_store_rest(law->store)); }

int rve_law_threads(const RveLaw *law) { return rve_store_scene(law->store)->threads; }

const char *rve_law_backend_name(const RveLaw *law) { return rve_store_backend_name(law->store); }

double rve_law_bulk_density(const RveLaw *law) {
  const RveScene *scene = rve_store_scene(law->store);
  const double pi = 3.14159265358979323846;
  int count;
  const RvePacking *packing = rve_store_packings(law->store, &count);
  double sum = 0.0;
  for (int k = 0; k < count; k++) {
    const double *h = packing[k].cell;
    double solid = 0.0, volume = fabs(h[0] * (h[4] * h[8] - h[5] * h[7]) - h[1] * (h[3] * h[8] - h[5] * h[6]) +
                                      h[2] * (h[3] * h[7] - h[4] * h[6]));
    if (scene->dimension == 2) volume *= scene->thickness; /* cell[8] = 1 */
    for (int g = 0; g < packing[k].grains; g++) {
      const double r = packing[k].radius[g];
      solid += scene->grain == RVE_DISK ? pi * r * r * scene->thickness : 4.0 / 3.0 * pi * r * r * r;
    }
    sum += scene->density * solid / volume;
  }
  return sum / count;
}
