/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Batches of RVEs: creation, stepping over threads. */
#if defined(__x86_64__)
#include <cpuid.h>
#endif
#include <math.h>
#include <omp.h>
#include <stdlib.h>
#include <string.h>

#include "rve_batch_private.h"
#include "rve_outcome.h"

/* -------------------------------------------------------------------------------------------------- which kernels */

#if defined(__x86_64__)
/* Intel's processors from Sapphire Rapids on, the first with AVX512-FP16. One of them was measured; on others two planes are the known good. */
static int whole_lines_are_fast(void) {
  unsigned a, b, c, d;
  return __builtin_cpu_is("intel") && __get_cpuid_count(7, 0, &a, &b, &c, &d) && (d >> 23 & 1);
}

/* What the variable asks for, or the best. */
static const RveKernels *avx512_kernels(const char *wanted, int mixed) {
  if (mixed) return &rve_kernels_avx512_mixed;
  if (wanted && strcmp(wanted, "avx512") == 0) return &rve_kernels_avx512;
  if (wanted && strcmp(wanted, "avx512_whole") == 0) return &rve_kernels_avx512_whole;
  return whole_lines_are_fast() ? &rve_kernels_avx512_whole : &rve_kernels_avx512;
}
#endif

const RveKernels *rve_batch_host_kernels(const RveScene *scene) {
  const RveKernels *best = &rve_kernels_plain;
#if defined(__x86_64__)
  const char *wanted = getenv("DEMPM_ISA");
  const int has2 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
  const int has512 = has2 && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
                     __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512bw");
  if (has2) best = &rve_kernels_avx2;
  if (has512) best = avx512_kernels(wanted, scene->mixed);
  if (wanted && strcmp(wanted, "plain") == 0) best = &rve_kernels_plain;
  if (wanted && strcmp(wanted, "avx2") == 0 && has2) best = &rve_kernels_avx2;
#else
  (void)scene;
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

int rve_record_pairs(const RveRecord *record) {
  const int slots = record->counts.slot_rows * record->counts.lanes, need = rve_head(record->arena)->need_pairs;
  return need > slots ? need : slots;
}

/* Two packings that fit a core's own cache (L2, 1 MB and more) with room to spare; larger ones would drive each other out. */
enum { AHEAD_MOST = 512 << 10 };

/* Runs a call on the host; grows the arena as often as a list needs it. */
static BaseStatus run_record(const RveBatch *batch, RveRecord *record, const RveCall *call, RveWorkspace *workspace) {
  for (;;) {
    RveScratch scratch;
    TRY(reserve(workspace, &record->counts, rve_record_pairs(record), &scratch));
    if (workspace->ahead && workspace->ahead->bytes + record->bytes <= AHEAD_MOST)
      scratch.ahead = workspace->ahead->arena, scratch.ahead_bytes = workspace->ahead->bytes;
    const int outcome = batch->kernels->run(batch->features, call, record->arena, &record->counts, &scratch);
    if (outcome != RVE_TOO_SMALL) return BASE_OK;
    TRY(rve_record_grow(record));
  }
}

const RveInput rve_no_input = {{0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0}, 0.0};

/* After the kernels' measure. A network without solution fails the RVE, as every answer that is not a number. */
BaseStatus rve_batch_conduction(const RveBatch *batch, RveRecord *record, const RveInput *input, double duration,
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
  if (!head->failed) TRY(rve_batch_conduction(batch, record, input, duration, workspace));
  if (head->failed) record->last.status = BASE_ERROR_UNSTABLE;
  return BASE_OK;
}

BaseStatus rve_batch_refresh_one(const RveBatch *batch, RveRecord *record, RveWorkspace *workspace) {
  RveHead *head = rve_head(record->arena);
  RveCall call;
  const double friction = head->friction_work, damping = head->damping_work;
  TRY(rve_call_make(&batch->scene, head, &rve_no_input, 0.0, &call));
  TRY(run_record(batch, record, &call, workspace));
  head = rve_head(record->arena);
  head->friction_work = friction, head->damping_work = damping;
  return measure_record(batch, record, &call, friction, &rve_no_input, 0.0, workspace);
}

BaseStatus rve_batch_run_call(RveBatch *batch, int rve, const RveCall *call, double work_before, const RveInput *input,
                              double duration, RveWorkspace *workspace) {
  RveRecord *record = &batch->record[rve];
  if (call->steps > 0) TRY(run_record(batch, record, call, workspace));
  TRY(measure_record(batch, record, call, work_before, input, duration, workspace));
  return rve_head(record->arena)->failed ? rve_note_failure(batch, rve, call, input, duration, workspace) : BASE_OK;
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
  return rve_batch_run_call(batch, rve, &call, work_before, input, duration, workspace);
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
int rve_batch_threads(const RveBatch *batch) {
  const int threads = batch->scene.threads > 0 ? batch->scene.threads : omp_get_max_threads();
  return threads < batch->threads ? threads : batch->threads;
}

BaseStatus rve_batch_refresh(RveBatch *batch, int n, const int *index) {
  BaseStatus first = BASE_OK;
  if (batch->device) return rve_batch_refresh_there(batch, n, index);
#pragma omp parallel for schedule(dynamic, 1) num_threads(rve_batch_threads(batch))
  for (int k = 0; k < n; k++) {
    BaseStatus status =
        rve_batch_refresh_one(batch, &batch->record[index ? index[k] : k], &batch->workspace[omp_get_thread_num()]);
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
  TRY_GOTO(rve_batch_choose_backend(batch, backend), status, failed);
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
      TRY_GOTO(rve_note_failure(batch, k, &still, &rve_no_input, 0.0, NULL), status, failed);
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
#pragma omp parallel for schedule(dynamic, 1) num_threads(rve_batch_threads(batch)) reduction(+ : copied, flown)
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
    TRY(rve_batch_step_there(batch, n, index, input, duration));
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
