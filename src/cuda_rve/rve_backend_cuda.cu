/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The RVE kernels on a CUDA device: one thread block per RVE, its arena in shared memory for all steps of a call if it
 * fits, else in global memory. The same source as on the CPU (rve_step.h, rve_measure.h), a pack of 32 grains per warp.
 */
#include <cuda_runtime.h>
#include <stdlib.h>

#include "rve_backend.h"
#include "rve_measure.h"
#include "rve_step.h"

enum { WARPS_MAX = 16, VARIANTS = 8 };

/* One RVE's place on the device. */
typedef struct DeviceArena {
  RveCounts counts;
  char *arena;
  size_t bytes, room;
} DeviceArena;

/* What a thread block reads and writes. */
typedef struct DeviceJob {
  RveDeviceJob job;
  RveCounts counts;
  char *arena, *scratch;
  size_t bytes;
} DeviceJob;

struct RveDevice {
  int count;          /* RVEs known */
  DeviceArena *arena; /* host array */
  DeviceJob *host, *device;
  int jobs; /* room in both */
  char *scratch;
  size_t scratch_bytes;
  int shared_limit; /* bytes of shared memory that a block may ask for */
};

/* -------------------------------------------------------------------------------------------------------- kernels */

static __device__ void copy_words(void *to, const void *from, size_t bytes) {
  int4 *target = (int4 *)to;
  const int4 *source = (const int4 *)from;
  for (size_t k = threadIdx.x; k < bytes / sizeof(int4); k += blockDim.x) target[k] = source[k];
}

template <int dimension, int tangential, int viscous, int bonds>
static __global__ void __launch_bounds__(32 * WARPS_MAX, 1) step_rves(DeviceJob *jobs, int in_shared) {
  extern __shared__ __align__(64) char memory[];
  __shared__ RveArrays arrays;
  __shared__ RveScratch scratch;
  __shared__ RveCounts counts;
  __shared__ RveCall call;
  __shared__ double lanes[WARPS_MAX];
  DeviceJob *const mine = &jobs[blockIdx.x];
  const RveFeatures ft = {dimension, tangential, viscous, bonds};
  const RveTeam team = {(int)(threadIdx.x / 32), (int)(blockDim.x / 32), threadIdx.x == 0, lanes};
  char *const arena = in_shared ? memory : mine->arena;
  if (team.leader) {
    counts = mine->counts;
    call = mine->job.call;
    rve_layout(&counts, arena, &arrays);
    rve_scratch_layout(&counts, mine->job.pairs, mine->scratch, &scratch);
  }
  if (in_shared) copy_words(arena, mine->arena, mine->bytes);
  __syncthreads();
  RveHead *const head = rve_head(arena);
  const double friction = head->friction_work, damping = head->damping_work;
  RveOutcome outcome = RVE_DONE;
  __syncthreads();
  if (call.steps > 0 || mine->job.refresh) outcome = rve_run(ft, &team, &call, head, &counts, &arrays, &scratch);
  if (team.leader && mine->job.refresh) head->friction_work = friction, head->damping_work = damping;
  __syncthreads();
  const int failed = head->failed;
  __syncthreads();
  if (outcome == RVE_DONE && !failed)
    rve_measure(ft, &team, &call, head, &counts, &arrays, mine->job.work_before, mine->job.duration, &mine->job.answer);
  if (team.leader) {
    mine->job.outcome = outcome;
    if (head->failed) mine->job.answer.status = BASE_ERROR_UNSTABLE;
  }
  __syncthreads();
  if (in_shared) copy_words(mine->arena, arena, mine->bytes);
}

typedef void StepKernel(DeviceJob *, int);
static StepKernel *const kernels[VARIANTS] = {step_rves<2, 0, 0, 0>, step_rves<2, 1, 0, 0>, step_rves<2, 1, 1, 0>,
                                              step_rves<2, 1, 1, 1>, step_rves<3, 0, 0, 0>, step_rves<3, 1, 0, 0>,
                                              step_rves<3, 1, 1, 0>, step_rves<3, 1, 1, 1>};
static int variant_of(RveFeatures ft) {
  return 4 * (ft.dimension - 2) + (ft.bonds ? 3 : ft.viscous ? 2 : ft.tangential ? 1 : 0);
}

/* ----------------------------------------------------------------------------------------------------------- host */

static BaseStatus checked(cudaError_t error, const char *doing) {
  if (error == cudaSuccess) return BASE_OK;
  const BaseStatus status = error == cudaErrorMemoryAllocation ? BASE_ERROR_MEMORY : BASE_ERROR_DEVICE;
  return base_error(status, "backend cuda: %s: %s", doing, cudaGetErrorString(error));
}

extern "C" {

int rve_device_present(void) {
  int devices = 0;
  const cudaError_t error = cudaGetDeviceCount(&devices);
  if (error != cudaSuccess) (void)cudaGetLastError(); /* no driver is no fault of later calls */
  return error == cudaSuccess && devices > 0;
}

static const RveKernels device_layout = {"cuda", RVE_PACK, {0, 0}, {0, 0}, NULL, NULL};

BaseStatus rve_device_create(const RveKernels **layout, RveDevice **result) {
  RveDevice *device = NULL;
  int id = 0;
  *result = NULL;
  *layout = &device_layout;
  if (!rve_device_present())
    return base_error(BASE_ERROR_DEVICE, "backend cuda: no CUDA device answers (allowed without one: auto, cpu)");
  TRY(BASE_ALLOC(1, &device));
  BaseStatus status = checked(cudaGetDevice(&id), "choosing the device");
  if (status == BASE_OK)
    status = checked(cudaDeviceGetAttribute(&device->shared_limit, cudaDevAttrMaxSharedMemoryPerBlockOptin, id),
                     "asking for shared memory");
  for (int k = 0; k < VARIANTS && status == BASE_OK; k++) {
    cudaFuncAttributes attributes;
    status = checked(cudaFuncGetAttributes(&attributes, (const void *)kernels[k]), "loading a kernel");
    const int room = device->shared_limit - (int)attributes.sharedSizeBytes;
    if (status == BASE_OK)
      status =
          checked(cudaFuncSetAttribute((const void *)kernels[k], cudaFuncAttributeMaxDynamicSharedMemorySize, room),
                  "reserving shared memory");
  }
  device->shared_limit -= 4096; /* what the kernels declare themselves */
  if (status != BASE_OK) base_free(device);
  else *result = device;
  return status;
}

void rve_device_destroy(RveDevice *device) {
  if (!device) return;
  for (int k = 0; k < device->count; k++) cudaFree(device->arena[k].arena);
  cudaFree(device->device);
  cudaFree(device->scratch);
  base_free(device->host);
  base_free(device->arena);
  base_free(device);
}

BaseStatus rve_device_upload(RveDevice *device, int rve, const RveCounts *counts, size_t bytes, const void *arena) {
  if (rve >= device->count) {
    const int count = rve + 1 > 2 * device->count ? rve + 1 : 2 * device->count;
    TRY(BASE_GROW((size_t)device->count, (size_t)count, &device->arena));
    device->count = count;
  }
  DeviceArena *to = &device->arena[rve];
  if (to->room < bytes) {
    cudaFree(to->arena);
    to->arena = NULL, to->room = 0;
    TRY(checked(cudaMalloc((void **)&to->arena, bytes), "memory for an RVE"));
    to->room = bytes;
  }
  to->counts = *counts;
  to->bytes = bytes;
  return checked(cudaMemcpy(to->arena, arena, bytes, cudaMemcpyHostToDevice), "copying an RVE to the device");
}

BaseStatus rve_device_download(RveDevice *device, int rve, void *arena) {
  const DeviceArena *from = &device->arena[rve];
  return checked(cudaMemcpy(arena, from->arena, from->bytes, cudaMemcpyDeviceToHost), "copying an RVE from the device");
}

/* Room for `count` jobs and `scratch` bytes of working memory. */
static BaseStatus reserve(RveDevice *device, int count, size_t scratch) {
  if (count > device->jobs) {
    TRY(BASE_GROW((size_t)device->jobs, (size_t)count, &device->host));
    cudaFree(device->device);
    device->device = NULL, device->jobs = 0;
    TRY(checked(cudaMalloc((void **)&device->device, (size_t)count * sizeof *device->device), "memory for jobs"));
    device->jobs = count;
  }
  if (scratch > device->scratch_bytes) {
    cudaFree(device->scratch);
    device->scratch = NULL, device->scratch_bytes = 0;
    TRY(checked(cudaMalloc((void **)&device->scratch, scratch), "working memory for neighbour lists"));
    device->scratch_bytes = scratch;
  }
  return BASE_OK;
}

static size_t scratch_bytes(const RveDevice *device, const RveDeviceJob *job) {
  RveScratch unused;
  return rve_scratch_layout(&device->arena[job->rve].counts, job->pairs, NULL, &unused);
}

BaseStatus rve_device_run(RveDevice *device, RveFeatures features, RveDeviceJob *jobs, int count) {
  size_t scratch = 0, largest = 0;
  int blocks = 1;
  for (int k = 0; k < count; k++) scratch += scratch_bytes(device, &jobs[k]);
  TRY(reserve(device, count, scratch));
  scratch = 0;
  for (int k = 0; k < count; k++) {
    const DeviceArena *arena = &device->arena[jobs[k].rve];
    DeviceJob *job = &device->host[k];
    job->job = jobs[k];
    job->counts = arena->counts;
    job->arena = arena->arena;
    job->bytes = arena->bytes;
    job->scratch = device->scratch + scratch;
    scratch += scratch_bytes(device, &jobs[k]);
    largest = arena->bytes > largest ? arena->bytes : largest;
    blocks = arena->counts.blocks > blocks ? arena->counts.blocks : blocks;
  }
  const int rounds = (blocks + WARPS_MAX - 1) / WARPS_MAX, warps = (blocks + rounds - 1) / rounds;
  const int in_shared = largest <= (size_t)device->shared_limit;
  const size_t bytes = (size_t)count * sizeof *device->host;
  TRY(checked(cudaMemcpy(device->device, device->host, bytes, cudaMemcpyHostToDevice), "copying jobs to the device"));
  kernels[variant_of(features)]<<<count, 32 * warps, in_shared ? largest : 0>>>(device->device, in_shared);
  TRY(checked(cudaGetLastError(), "starting a kernel"));
  TRY(checked(cudaMemcpy(device->host, device->device, bytes, cudaMemcpyDeviceToHost), "running RVEs"));
  for (int k = 0; k < count; k++) jobs[k] = device->host[k].job;
  return BASE_OK;
}

} /* extern "C" */
