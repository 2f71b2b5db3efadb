/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Batches of RVEs: creation, stepping over threads or on the device. */
#include <math.h>
#include <omp.h>
#include <stdlib.h>
#include <string.h>

#include "rve_batch_private.h"
#include "rve_outcome.h"

/* -------------------------------------------------------------------------------------------------- which kernels */

static const RveKernels *choose_kernels(const RveScene *scene) {
  const RveKernels *best = &rve_kernels_plain;
#if defined(__x86_64__)
  const char *wanted = getenv("DEMPM_ISA");
  const int has2 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
  const int has512 = has2 && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
                     __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512bw");
  if (has2) best = &rve_kernels_avx2;
  if (has512) best = scene->mixed ? &rve_kernels_avx512_mixed : &rve_kernels_avx512;
  if (wanted && strcmp(wanted, "plain") == 0) best = &rve_kernels_plain;
  if (wanted && strcmp(wanted, "avx2") == 0 && has2) best = &rve_kernels_avx2;
#endif
  return best;
}

/* ----------------------------------------------------------------------------------------------------- one record */

static BaseStatus reserve(RveWorkspace *workspace, const RveCounts *counts, int pairs, RveScratch *scratch) {
  const size_t bytes = rve_scratch_layout(counts, pairs, NULL, scratch);
  if (bytes > workspace->bytes) {
    base_free(workspace->memory);
    workspace->memory = NULL, workspace->bytes = 0;
    TRY(base_alloc(bytes, 1, &workspace->memory));
    workspace->bytes = bytes;
  }
  rve_scratch_layout(counts, pairs, workspace->memory, scratch);
  return BASE_OK;
}

static int pairs_for(const RveRecord *record) {
  const int slots = record->counts.slot_rows * record->counts.lanes, need = rve_head(record->arena)->need_pairs;
  return need > slots ? need : slots;
}

/* Two packings that fit a core's own cache (L2, 1 MB and more) with room to spare; larger ones would drive each other out. */
enum { AHEAD_MOST = 512 << 10 };

/* Runs a call on the host; grows the arena as often as a list needs it. */
static BaseStatus run_record(const RveBatch *batch, RveRecord *record, const RveCall *call, RveWorkspace *workspace) {
  for (;;) {
    RveScratch scratch;
    TRY(reserve(workspace, &record->counts, pairs_for(record), &scratch));
    if (workspace->ahead && workspace->ahead->bytes + record->bytes <= AHEAD_MOST)
      scratch.ahead = workspace->ahead->arena, scratch.ahead_bytes = workspace->ahead->bytes;
    const int outcome = batch->kernels->run(batch->features, call, record->arena, &record->counts, &scratch);
    if (outcome != RVE_TOO_SMALL) return BASE_OK;
    TRY(rve_record_grow(record));
  }
}

static const RveInput nothing = {{0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0}, 0.0};

/* After the kernels' measure. A network without solution fails the RVE, as every answer that is not a number. */
static BaseStatus answer_conduction(const RveBatch *batch, RveRecord *record, const RveInput *input, double duration,
                                    RveWorkspace *workspace) {
  const BaseStatus status =
      rve_conduction_answer(record, &batch->scene, input, duration, &workspace->conduction);
  if (status != BASE_ERROR_UNSTABLE) return status;
  rve_head(record->arena)->failed = record->last.status = BASE_ERROR_UNSTABLE;
  return BASE_OK;
}

static BaseStatus measure_record(const RveBatch *batch, RveRecord *record, const RveCall *call, double work_before,
                                 const RveInput *input, double duration, RveWorkspace *workspace) {
  RveHead *head = rve_head(record->arena);
  if (!head->failed)
    batch->kernels->measure(batch->features, call, record->arena, &record->counts, work_before, duration,
                            &record->last);
  if (!head->failed) TRY(answer_conduction(batch, record, input, duration, workspace));
  if (head->failed) record->last.status = BASE_ERROR_UNSTABLE;
  return BASE_OK;
}

/* Lists and forces of the present state, without time passing and without work done; then the answer. */
static BaseStatus refresh_record(const RveBatch *batch, RveRecord *record, RveWorkspace *workspace) {
  RveHead *head = rve_head(record->arena);
  RveCall call;
  const double friction = head->friction_work, damping = head->damping_work;
  TRY(rve_call_make(&batch->scene, head, &nothing, 0.0, &call));
  TRY(run_record(batch, record, &call, workspace));
  head = rve_head(record->arena);
  head->friction_work = friction, head->damping_work = damping;
  return measure_record(batch, record, &call, friction, &nothing, 0.0, workspace);
}

static BaseStatus step_record(RveBatch *batch, int rve, const RveInput *input, double duration,
                              RveWorkspace *workspace) {
  RveRecord *record = &batch->record[rve];
  RveCall call;
  const double work_before = rve_head(record->arena)->friction_work;
  TRY(rve_call_make(&batch->scene, rve_head(record->arena), input, duration, &call));
  if (rve_head(record->arena)->failed) {
    record->last.status = BASE_ERROR_UNSTABLE;
    return BASE_OK;
  }
  workspace->kept = batch->keep && rve_may_fail(batch, record, &call);
  if (workspace->kept) TRY(rve_keep_before(record, workspace));
  if (call.steps > 0) TRY(run_record(batch, record, &call, workspace));
  TRY(measure_record(batch, record, &call, work_before, input, duration, workspace));
  return rve_head(record->arena)->failed ? rve_note_failure(batch, rve, &call, input, duration, workspace) : BASE_OK;
}

/* ------------------------------------------------------------------------------------------------------- creation */

static BaseStatus check_arguments(const RveScene *scene, const RvePacking *packings, int packing_count,
                                  const int *packing_of_rve, int count) {
  TRY(rve_scene_check(scene));
  if (count < 1) return base_error(BASE_ERROR_ARGUMENT, "a batch of %d RVEs (allowed: at least 1)", count);
  if (packing_count < 1)
    return base_error(BASE_ERROR_ARGUMENT, "a batch from %d packings (allowed: at least 1)", packing_count);
  for (int k = 0; k < packing_count; k++) {
    BaseStatus status = rve_packing_check(&packings[k]);
    if (status != BASE_OK) return base_error_context(status, "packing %d: ", k);
    if (packings[k].dimension != scene->dimension)
      return base_error(BASE_ERROR_ARGUMENT, "packing %d: dimension = %d (allowed: the scene's, %d)", k,
                        packings[k].dimension, scene->dimension);
  }
  for (int k = 0; packing_of_rve && k < count; k++)
    if (packing_of_rve[k] < 0 || packing_of_rve[k] >= packing_count)
      return base_error(BASE_ERROR_ARGUMENT, "RVE %d has packing %d (allowed: 0 to %d)", k, packing_of_rve[k],
                        packing_count - 1);
  return BASE_OK;
}

static BaseStatus set_threads(RveBatch *batch) {
  const int threads = batch->scene.threads > 0 ? batch->scene.threads : omp_get_max_threads();
  if (threads > batch->threads) {
    TRY(BASE_GROW((size_t)batch->threads, (size_t)threads, &batch->workspace));
    batch->threads = threads;
  }
  return BASE_OK;
}
static int threads_of(const RveBatch *batch) {
  const int threads = batch->scene.threads > 0 ? batch->scene.threads : omp_get_max_threads();
  return threads < batch->threads ? threads : batch->threads;
}

static BaseStatus choose_backend(RveBatch *batch, RveBackend backend) {
  batch->kernels = choose_kernels(&batch->scene);
  strcpy(batch->name, "cpu/");
  strcat(batch->name, batch->kernels->name);
  if (backend == RVE_BACKEND_CPU || (backend == RVE_BACKEND_AUTO && !rve_device_present())) return BASE_OK;
  const RveKernels *layout;
  BaseStatus status = rve_device_create(&layout, &batch->device);
  if (status != BASE_OK && backend == RVE_BACKEND_AUTO) return BASE_OK;
  TRY(status);
  batch->kernels = layout;
  strcpy(batch->name, "cuda");
  return BASE_ALLOC((size_t)batch->count, &batch->job);
}

BaseStatus rve_batch_upload(RveBatch *batch, int k) {
  const RveRecord *record = &batch->record[k];
  return batch->device ? rve_device_upload(batch->device, k, &record->counts, record->bytes, record->arena) : BASE_OK;
}
BaseStatus rve_batch_download(const RveBatch *batch, int k) {
  return batch->device ? rve_device_download(batch->device, k, batch->record[k].arena) : BASE_OK;
}

static BaseStatus device_refresh(RveBatch *batch, int n, const int *index);

BaseStatus rve_batch_refresh(RveBatch *batch, int n, const int *index) {
  BaseStatus first = BASE_OK;
  if (batch->device) return device_refresh(batch, n, index);
#pragma omp parallel for schedule(dynamic, 1) num_threads(threads_of(batch))
  for (int k = 0; k < n; k++) {
    BaseStatus status =
        refresh_record(batch, &batch->record[index ? index[k] : k], &batch->workspace[omp_get_thread_num()]);
    if (status != BASE_OK) {
#pragma omp critical(rve_refresh)
      first = status;
    }
  }
  return first == BASE_ERROR_MEMORY ? base_error(first, "not enough memory for the neighbour lists of %d RVEs", n)
                                    : first;
}

BaseStatus rve_batch_create(const RveScene *scene, const RvePacking *packings, int packing_count,
                            const int *packing_of_rve, int count, RveBackend backend, RveBatch **result) {
  RveBatch *batch = NULL;
  RveRecord *model = NULL;
  BaseStatus status;
  *result = NULL;
  TRY(check_arguments(scene, packings, packing_count, packing_of_rve, count));
  TRY(BASE_ALLOC(1, &batch));
  batch->scene = *scene;
  batch->features = rve_scene_features(scene);
  batch->count = count;
  TRY_GOTO(choose_backend(batch, backend), status, failed);
  TRY_GOTO(set_threads(batch), status, failed);
  TRY_GOTO(BASE_ALLOC((size_t)count, &batch->record), status, failed);
  TRY_GOTO(BASE_ALLOC((size_t)count, &batch->failed), status, failed);
  TRY_GOTO(BASE_ALLOC((size_t)count, &batch->history), status, failed);
  TRY_GOTO(BASE_ALLOC((size_t)count, &batch->twin), status, failed);
  for (int k = 0; k < count; k++) batch->history[k] = packing_of_rve ? (uint64_t)packing_of_rve[k] : 0;
  batch->histories = (uint64_t)packing_count;
  TRY_GOTO(BASE_ALLOC((size_t)packing_count, &model), status, failed);
  for (int k = 0; k < packing_count; k++)
    TRY_GOTO(rve_record_from_packing(batch->kernels, scene, &packings[k], &model[k]), status, failed);
  for (int k = 0; k < count; k++) {
    const RveRecord *from = &model[packing_of_rve ? packing_of_rve[k] : 0];
    RveRecord *to = &batch->record[k];
    TRY_GOTO(base_alloc(from->bytes, 1, &to->arena), status, failed);
    memcpy(to->arena, from->arena, from->bytes);
    to->counts = from->counts;
    to->bytes = from->bytes;
    rve_conduction_forget(&to->conduction);
    rve_layout(&to->counts, to->arena, &to->arrays);
  }
  TRY_GOTO(rve_batch_refresh(batch, count, NULL), status, failed);
  for (int k = 0; k < count; k++)
    if (rve_head(batch->record[k].arena)->failed) {
      const RveCall still = {.steps = 0};
      TRY_GOTO(rve_note_failure(batch, k, &still, &nothing, 0.0, NULL), status, failed);
      status = base_error(BASE_ERROR_ARGUMENT, "RVE %d: %s", k, batch->failed[k]->failure.cause);
      goto failed;
    }
  *result = batch;
  batch = NULL;
failed:
  for (int k = 0; model && k < packing_count; k++) rve_record_destroy(&model[k]);
  base_free(model);
  rve_batch_destroy(batch);
  return status;
}

void rve_batch_destroy(RveBatch *batch) {
  if (!batch) return;
  for (int k = 0; batch->record && k < batch->count; k++) rve_record_destroy(&batch->record[k]);
  for (int k = 0; batch->failed && k < batch->count; k++) rve_forget_failure(batch, k);
  for (int k = 0; k < batch->threads; k++) {
    base_free(batch->workspace[k].memory);
    base_free(batch->workspace[k].before.arena);
    rve_network_destroy(&batch->workspace[k].conduction.network);
  }
  rve_device_destroy(batch->device);
  base_free(batch->workspace);
  base_free(batch->job);
  base_free(batch->record);
  base_free(batch->failed);
  base_free(batch->history);
  base_free(batch->twin);
  base_free(batch);
}

int rve_batch_count(const RveBatch *batch) { return batch->count; }
const char *rve_batch_backend_name(const RveBatch *batch) { return batch->name; }
const RveScene *rve_batch_scene(const RveBatch *batch) { return &batch->scene; }

/* ------------------------------------------------------------------------------------------------------- stepping */

BaseStatus rve_batch_check_index(const RveBatch *batch, int n, const int *index) {
  if (n < 0 || (!index && n > batch->count) || (index && n > batch->count))
    return base_error(BASE_ERROR_ARGUMENT, "%d RVEs (allowed: 0 to %d)", n, batch->count);
  for (int k = 0; index && k < n; k++)
    if (index[k] < 0 || index[k] >= batch->count)
      return base_error(BASE_ERROR_ARGUMENT, "index[%d] = %d (allowed: 0 to %d)", k, index[k], batch->count - 1);
  return BASE_OK;
}

static BaseStatus check_input(const RveBatch *batch, int n, const RveInput *input, double duration) {
  if (!(duration >= 0.0 && isfinite(duration)))
    return base_error(BASE_ERROR_ARGUMENT, "duration = %g (allowed: >= 0)", duration);
  for (int k = 0; k < n; k++) {
    double sum = batch->scene.thermal ? input[k].temperature : 0.0;
    for (int m = 0; m < 9; m++) sum += input[k].velocity_gradient[m];
    if (!isfinite(sum))
      return base_error(BASE_ERROR_ARGUMENT, "input %d: velocity gradient or temperature is not finite", k);
  }
  return BASE_OK;
}

/* Conductivities that the kernels do not know are the host's: the state comes back for them. */
static BaseStatus device_conduction(RveBatch *batch, int rve, const RveInput *input, double duration) {
  RveRecord *record = &batch->record[rve];
  if (record->last.status != BASE_OK) return BASE_OK;
  if (rve_conduction_is_own(&batch->scene)) TRY(rve_batch_download(batch, rve));
  return answer_conduction(batch, record, input, duration, &batch->workspace[0]);
}

static BaseStatus add_job(RveBatch *batch, int rve, const RveInput *input, double duration, int *count) {
  RveDeviceJob *job = &batch->job[*count];
  const RveHead *head = rve_head(batch->record[rve].arena);
  if (head->failed) return BASE_OK;
  memset(job, 0, sizeof *job);
  TRY(rve_call_make(&batch->scene, head, input ? input : &nothing, duration, &job->call));
  job->rve = rve;
  if (input) job->input = *input;
  job->refresh = input == NULL;
  job->pairs = pairs_for(&batch->record[rve]);
  job->work_before = batch->record[rve].last.friction_work;
  job->duration = duration;
  job->answer = batch->record[rve].last;
  ++*count;
  return BASE_OK;
}

static BaseStatus grow_on_device(RveBatch *batch, RveDeviceJob *job) {
  TRY(rve_batch_download(batch, job->rve));
  TRY(rve_record_grow(&batch->record[job->rve]));
  TRY(rve_batch_upload(batch, job->rve));
  job->pairs = pairs_for(&batch->record[job->rve]);
  return BASE_OK;
}

static BaseStatus take_answer(RveBatch *batch, const RveDeviceJob *job) {
  RveRecord *record = &batch->record[job->rve];
  record->last = job->answer;
  batch->flown += job->duration > 0.0 && job->answer.flew;
  rve_head(record->arena)->failed = record->last.status;
  rve_head(record->arena)->temperature = job->call.temperature;
  TRY(device_conduction(batch, job->rve, job->refresh ? &nothing : &job->input, job->duration));
  if (!record->last.status || job->refresh) return BASE_OK;
  TRY(rve_batch_download(batch, job->rve));
  rve_head(record->arena)->failed = record->last.status;
  return rve_note_failure(batch, job->rve, &job->call, &nothing, job->duration, NULL);
}

/* All jobs at once; those whose arena was too small grow on the host and go on. */
static BaseStatus run_jobs(RveBatch *batch, int count) {
  for (int pending = count; pending > 0;) {
    TRY(rve_device_run(batch->device, batch->features, batch->job, pending));
    int left = 0;
    for (int k = 0; k < pending; k++) {
      RveDeviceJob *job = &batch->job[k];
      if (job->outcome == RVE_TOO_SMALL) {
        TRY(grow_on_device(batch, job));
        batch->job[left++] = *job;
      } else {
        TRY(take_answer(batch, job));
      }
    }
    pending = left;
  }
  return BASE_OK;
}

static BaseStatus device_refresh(RveBatch *batch, int n, const int *index) {
  int count = 0;
  for (int k = 0; k < n; k++) {
    TRY(rve_batch_upload(batch, index ? index[k] : k));
    TRY(add_job(batch, index ? index[k] : k, NULL, 0.0, &count));
  }
  return run_jobs(batch, count);
}

/* Twins are not copied there: a copy's own call takes longer than a device takes for the steps. */
static BaseStatus device_step(RveBatch *batch, int n, const int *index, const RveInput *input, double duration) {
  int count = 0;
  for (int k = 0; k < n; k++) TRY(add_job(batch, index ? index[k] : k, &input[k], duration, &count));
  return run_jobs(batch, count);
}

/* Threads take the RVEs in turns, more or less. */
static const RveTwin *ahead_of(const RveBatch *batch, int n, int k) {
  const int next = k + omp_get_num_threads();
  return next < n && batch->twin[next].leader == batch->twin[next].rve ? &batch->twin[next] : NULL;
}

/* Steps the first of each set of twins, then copies it. A twin of one that failed fails by itself. */
static BaseStatus host_step(RveBatch *batch, int n, const int *index, const RveInput *input, double duration) {
  BaseStatus first = BASE_OK;
  int64_t copied = 0, flown = 0;
  rve_twins_sort(batch, n, index, input);
  for (int followers = 0; followers < 2; followers++) {
    const int good = first == BASE_OK;
#pragma omp parallel for schedule(dynamic, 1) num_threads(threads_of(batch)) reduction(+ : copied, flown)
    for (int k = 0; k < n; k++) {
      const RveTwin *twin = &batch->twin[k];
      const int follows = twin->leader != twin->rve;
      BaseStatus status;
      if (follows != followers) continue;
      if (follows && batch->record[twin->leader].last.status == BASE_OK && good) {
        status = rve_twins_copy(batch, twin->leader, twin->rve);
        copied++;
      } else {
        RveWorkspace *workspace = &batch->workspace[omp_get_thread_num()];
        workspace->ahead = ahead_of(batch, n, k);
        status = step_record(batch, twin->rve, twin->input, duration, workspace);
        workspace->ahead = NULL;
        flown += batch->record[twin->rve].last.flew;
      }
      if (status != BASE_OK) {
#pragma omp critical(rve_step)
        first = status;
      }
    }
  }
  rve_twins_renew(batch, n);
  if (duration > 0.0) batch->shared += copied, batch->flown += flown;
  return first;
}

void rve_batch_network_counts(const RveBatch *batch, int64_t *solved, int64_t *kept) {
  *solved = *kept = 0;
  for (int k = 0; k < batch->threads; k++) {
    *solved += batch->workspace[k].conduction.solved;
    *kept += batch->workspace[k].conduction.kept;
  }
}

int64_t rve_batch_shared(const RveBatch *batch) { return batch->shared; }
int64_t rve_batch_flown(const RveBatch *batch) { return batch->flown; }

BaseStatus rve_batch_step(RveBatch *batch, int n, const int *index, const RveInput *input, double duration,
                          RveAnswer *answer) {
  TRY(rve_batch_check_index(batch, n, index));
  TRY(check_input(batch, n, input, duration));
  TRY(set_threads(batch));
  BaseStatus first = BASE_OK;
  if (batch->device) {
    TRY(device_step(batch, n, index, input, duration));
  } else {
    first = host_step(batch, n, index, input, duration);
  }
  if (first == BASE_ERROR_MEMORY) return base_error(first, "not enough memory for a larger neighbour list");
  if (first != BASE_OK)
    return base_error(first, "a step of %g s takes more DEM steps than are allowed (time step %g s)", duration,
                      batch->scene.time_step);
  int unstable = -1;
  for (int k = n - 1; k >= 0; k--) {
    answer[k] = batch->record[index ? index[k] : k].last;
    if (answer[k].status != BASE_OK) unstable = index ? index[k] : k;
  }
  return unstable >= 0 ? rve_failure_error(batch, unstable) : BASE_OK;
}

/* -------------------------------------------------------------------------------------------------------- changes */

BaseStatus rve_batch_set_scene(RveBatch *batch, const RveScene *scene) {
  const RveScene *old = &batch->scene;
  TRY(rve_scene_check(scene));
  if (rve_scene_hash(scene) != rve_scene_hash(old) || scene->mixed != old->mixed)
    return base_error(BASE_ERROR_ARGUMENT,
                      "dimension, grain, thickness, density, thermal, bonds, mixed and whether tangential_stiffness "
                      "is 0 cannot change after creation");
  const int stiffer =
      scene->normal_stiffness != old->normal_stiffness || scene->tangential_stiffness != old->tangential_stiffness ||
      scene->normal_viscosity != old->normal_viscosity || scene->rotation != old->rotation ||
      scene->tangential_viscosity != old->tangential_viscosity || scene->critical_damping != old->critical_damping;
  for (int k = 0; stiffer && k < batch->count; k++) {
    RvePacking packing;
    TRY(rve_batch_packing(batch, k, &packing));
    rve_head(batch->record[k].arena)->critical_time_step = rve_critical_time_step(scene, &packing);
    rve_record_set_rotation(&batch->record[k], scene);
    rve_packing_destroy(&packing);
    TRY(rve_batch_upload(batch, k));
  }
  if (!rve_conduction_is_same(scene, old))
    for (int k = 0; k < batch->count; k++) rve_conduction_forget(&batch->record[k].conduction);
  batch->scene = *scene;
  batch->features = rve_scene_features(scene);
  TRY(set_threads(batch));
  /* Rows hold masses only in viscous variants; forces follow the new stiffness. */
  return stiffer ? rve_batch_refresh(batch, batch->count, NULL) : BASE_OK;
}
