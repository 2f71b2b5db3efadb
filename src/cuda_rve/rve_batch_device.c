/* SPDX-License-Identifier: GPL-2.0-or-later */
/* RVEs of a batch on a device, and their way to the CPU when its memory does not suffice. */
#include <omp.h>
#include <string.h>

#include "rve_batch_private.h"
#include "rve_outcome.h"

/* ----------------------------------------------------------------------------------------------------- there and back */

static void use_host(RveBatch *batch) {
  batch->kernels = rve_batch_host_kernels(&batch->scene);
  strcpy(batch->name, "cpu/");
  strcat(batch->name, batch->kernels->name);
}

BaseStatus rve_batch_choose_backend(RveBatch *batch, RveBackend backend) {
  use_host(batch);
  if (backend == RVE_BACKEND_CPU || (backend == RVE_BACKEND_AUTO && !rve_device_present())) return BASE_OK;
  const RveKernels *layout;
  const BaseStatus status = rve_device_create(&layout, &batch->device);
  if (status == BASE_ERROR_MEMORY || (status != BASE_OK && backend == RVE_BACKEND_AUTO)) return BASE_OK;
  TRY(status);
  batch->kernels = layout;
  strcpy(batch->name, "cuda");
  return BASE_ALLOC((size_t)batch->count, &batch->job);
}

int rve_batch_is_on_device(const RveBatch *batch) { return batch->device != NULL; }

BaseStatus rve_batch_download(const RveBatch *batch, int k) {
  return batch->device ? rve_device_download(batch->device, k, batch->record[k].arena) : BASE_OK;
}

BaseStatus rve_batch_upload(RveBatch *batch, int k) {
  const RveRecord *record = &batch->record[k];
  if (!batch->device) return BASE_OK;
  const BaseStatus status = rve_device_upload(batch->device, k, &record->counts, record->bytes, record->arena);
  return status == BASE_ERROR_MEMORY ? rve_batch_leave_device(batch) : status;
}

/* What the device does not hold is newer on the host, or was never there. */
static BaseStatus convert_all(const RveBatch *batch, const RveKernels *kernels, RveRecord *converted) {
  for (int k = 0; k < batch->count; k++) {
    if (rve_device_holds(batch->device, k)) TRY(rve_batch_download(batch, k));
    TRY(rve_record_convert(kernels, &batch->record[k], &converted[k]));
  }
  return BASE_OK;
}

/* Those that stand in the middle of a call must not: their call makes up for it when it goes on. */
static BaseStatus refresh_converted(RveBatch *batch) {
  BaseStatus first = BASE_OK;
#pragma omp parallel for schedule(dynamic, 1) num_threads(rve_batch_threads(batch))
  for (int k = 0; k < batch->count; k++) {
    const RveHead *head = rve_head(batch->record[k].arena);
    if (head->failed || head->done > 0) continue;
    const BaseStatus status = rve_batch_refresh_one(batch, &batch->record[k], &batch->workspace[omp_get_thread_num()]);
    if (status != BASE_OK) {
#pragma omp critical(rve_converted)
      first = status;
    }
  }
  return first;
}

BaseStatus rve_batch_leave_device(RveBatch *batch) {
  RveRecord *converted = NULL;
  if (!batch->device) return BASE_OK;
  TRY(BASE_ALLOC((size_t)batch->count, &converted));
  const BaseStatus status = convert_all(batch, rve_batch_host_kernels(&batch->scene), converted);
  for (int k = 0; k < batch->count; k++) {
    rve_record_destroy(status == BASE_OK ? &batch->record[k] : &converted[k]);
    if (status == BASE_OK) batch->record[k] = converted[k];
  }
  base_free(converted);
  TRY(status);
  rve_device_destroy(batch->device);
  batch->device = NULL;
  use_host(batch);
  for (int k = 0; batch->apart && k < batch->count; k++) rve_twins_leave(batch, k);
  return refresh_converted(batch);
}

/* --------------------------------------------------------------------------------------------------------------- jobs */

/* Conductivities that the kernels do not know are the host's: the state comes back for them. */
static BaseStatus answer_conduction(RveBatch *batch, int rve, const RveInput *input, double duration) {
  RveRecord *record = &batch->record[rve];
  if (record->last.status != BASE_OK) return BASE_OK;
  if (rve_conduction_is_own(&batch->scene)) TRY(rve_batch_download(batch, rve));
  return rve_batch_conduction(batch, record, input, duration, &batch->workspace[0]);
}

static BaseStatus add_job(RveBatch *batch, int rve, const RveInput *input, double duration, int *count) {
  RveDeviceJob *job = &batch->job[*count];
  const RveHead *head = rve_head(batch->record[rve].arena);
  if (head->failed) return BASE_OK;
  memset(job, 0, sizeof *job);
  TRY(rve_call_make(&batch->scene, head, input ? input : &rve_no_input, duration, &job->call));
  job->rve = rve;
  if (input) job->input = *input;
  job->refresh = input == NULL;
  job->pairs = rve_record_pairs(&batch->record[rve]);
  job->work_before = batch->record[rve].last.friction_work;
  job->duration = duration;
  job->answer = batch->record[rve].last;
  ++*count;
  return BASE_OK;
}

static BaseStatus take_answer(RveBatch *batch, const RveDeviceJob *job) {
  RveRecord *record = &batch->record[job->rve];
  record->last = job->answer;
  batch->flown += job->duration > 0.0 && job->answer.flew;
  rve_head(record->arena)->failed = record->last.status;
  rve_head(record->arena)->temperature = job->call.temperature;
  TRY(answer_conduction(batch, job->rve, job->refresh ? &rve_no_input : &job->input, job->duration));
  if (!record->last.status || job->refresh) return BASE_OK;
  TRY(rve_batch_download(batch, job->rve));
  rve_head(record->arena)->failed = record->last.status;
  return rve_note_failure(batch, job->rve, &job->call, &rve_no_input, job->duration, NULL);
}

/* The jobs whose arena was too small come first then; returns their number. */
static BaseStatus take_finished(RveBatch *batch, int count, int *left) {
  *left = 0;
  for (int k = 0; k < count; k++)
    if (batch->job[k].outcome == RVE_TOO_SMALL) batch->job[(*left)++] = batch->job[k];
    else TRY(take_answer(batch, &batch->job[k]));
  return BASE_OK;
}

static BaseStatus grow_there(RveBatch *batch, RveDeviceJob *job) {
  TRY(rve_batch_download(batch, job->rve));
  TRY(rve_record_grow(&batch->record[job->rve]));
  TRY(rve_batch_upload(batch, job->rve));
  job->pairs = rve_record_pairs(&batch->record[job->rve]);
  return BASE_OK;
}

static BaseStatus run_job_here(RveBatch *batch, const RveDeviceJob *job, RveWorkspace *workspace) {
  RveRecord *record = &batch->record[job->rve];
  if (job->refresh) return rve_batch_refresh_one(batch, record, workspace);
  workspace->kept = 0;
  return rve_batch_run_call(batch, job->rve, &job->call, job->work_before, &job->input, job->duration, workspace);
}

/* Jobs that the device has not finished; some stand in the middle of their calls. */
static BaseStatus run_jobs_here(RveBatch *batch, int count) {
  BaseStatus first = BASE_OK;
  int64_t flown = 0;
#pragma omp parallel for schedule(dynamic, 1) num_threads(rve_batch_threads(batch)) reduction(+ : flown)
  for (int k = 0; k < count; k++) {
    const RveDeviceJob *job = &batch->job[k];
    const BaseStatus status = run_job_here(batch, job, &batch->workspace[omp_get_thread_num()]);
    flown += job->duration > 0.0 && batch->record[job->rve].last.flew;
    if (status != BASE_OK) {
#pragma omp critical(rve_jobs_here)
      first = status;
    }
  }
  batch->flown += flown;
  return first;
}

/* All jobs at once; those whose arena was too small grow on the host and go on. */
static BaseStatus run_jobs(RveBatch *batch, int count) {
  while (count > 0) {
    if (!batch->device) return run_jobs_here(batch, count);
    const BaseStatus status = rve_device_run(batch->device, batch->features, batch->job, count);
    if (status == BASE_ERROR_MEMORY) {
      TRY(rve_batch_leave_device(batch));
      continue;
    }
    TRY(status);
    TRY(take_finished(batch, count, &count));
    for (int k = 0; k < count && batch->device; k++) TRY(grow_there(batch, &batch->job[k]));
  }
  return BASE_OK;
}

BaseStatus rve_batch_refresh_there(RveBatch *batch, int n, const int *index) {
  int count = 0;
  for (int k = 0; k < n; k++) {
    TRY(rve_batch_upload(batch, index ? index[k] : k));
    TRY(add_job(batch, index ? index[k] : k, NULL, 0.0, &count));
  }
  return run_jobs(batch, count);
}

/* Twins are not copied there: a copy's own call takes longer than a device takes for the steps. */
BaseStatus rve_batch_step_there(RveBatch *batch, int n, const int *index, const RveInput *input, double duration) {
  int count = 0;
  for (int k = 0; k < n; k++) TRY(add_job(batch, index ? index[k] : k, &input[k], duration, &count));
  batch->apart = 1;
  return run_jobs(batch, count);
}
