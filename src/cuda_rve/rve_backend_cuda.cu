/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The RVE kernels on a CUDA device: one thread block per RVE, its arena in shared memory for all steps of a call if it
 * fits, else in global memory. The same source as on the CPU (rve_step.h, rve_measure.h), a pack of 32 grains per warp.
 */
#include <cuda_runtime.h>
#include <stdlib.h>

#include "rve_backend.h"
#include "rve_measure.h"
#include "rve_step.h"

enum { WARPS_MAX = 16, VARIANTS = 8, STREAMS = 2, PART = 2048 /* jobs of one launch, at most */ };

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
  int place; /* in the caller's list */
} DeviceJob;

struct RveDevice {
  int id;             /* of CUDA */
  int count;          /* RVEs known */
  DeviceArena *arena; /* host array */
  cudaStream_t stream[STREAMS];
  DeviceJob *host, *device; /* host: pinned, so that copies run beside kernels */
  int jobs; /* room in both */
  int part; /* jobs of one launch, at most */
  int warps; /* of a block, at most */
  char *scratch[STREAMS];
  size_t scratch_bytes[STREAMS];
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
static int process_of_machine; /* which of those that share the machine's devices this one is */

void rve_device_share(int process) { process_of_machine = process; }

static BaseStatus choose_device(int *id) {
  int devices = 0;
  TRY(checked(cudaGetDeviceCount(&devices), "counting devices"));
  *id = process_of_machine % devices;
  return checked(cudaSetDevice(*id), "choosing the device");
}

/* All that a kernel may have is asked for once. */
static BaseStatus reserve_shared(RveDevice *device) {
  TRY(checked(cudaDeviceGetAttribute(&device->shared_limit, cudaDevAttrMaxSharedMemoryPerBlockOptin, device->id),
              "asking for shared memory"));
  int own = 0; /* what kernels declare themselves */
  for (int k = 0; k < VARIANTS; k++) {
    cudaFuncAttributes attributes;
    TRY(checked(cudaFuncGetAttributes(&attributes, (const void *)kernels[k]), "loading a kernel"));
    own = (int)attributes.sharedSizeBytes > own ? (int)attributes.sharedSizeBytes : own;
  }
  device->shared_limit -= own;
  for (int k = 0; k < VARIANTS; k++) {
    const void *const kernel = (const void *)kernels[k];
    TRY(checked(cudaFuncSetAttribute(kernel, cudaFuncAttributeMaxDynamicSharedMemorySize, device->shared_limit),
                "reserving shared memory"));
    /* or the driver may leave too little for a second block */
    TRY(checked(cudaFuncSetAttribute(kernel, cudaFuncAttributePreferredSharedMemoryCarveout, cudaSharedmemCarveoutMaxShared),
                "reserving shared memory"));
  }
  return BASE_OK;
}

/* Fewer warps, of several packs of grains each, leave registers for other blocks on a multiprocessor: for experiments, DEMPM_CUDA_WARPS. */
static int most_warps(void) {
  const char *const wanted = getenv("DEMPM_CUDA_WARPS");
  const int warps = wanted ? atoi(wanted) : WARPS_MAX;
  return warps < 1 || warps > WARPS_MAX ? WARPS_MAX : warps;
}

static BaseStatus open_device(RveDevice *device) {
  device->part = PART;
  device->warps = most_warps();
  TRY(choose_device(&device->id));
  TRY(reserve_shared(device));
  for (int k = 0; k < STREAMS; k++) TRY(checked(cudaStreamCreate(&device->stream[k]), "opening a stream"));
  return BASE_OK;
}

BaseStatus rve_device_create(const RveKernels **layout, RveDevice **result) {
  RveDevice *device = NULL;
  *result = NULL;
  *layout = &device_layout;
  if (!rve_device_present())
    return base_error(BASE_ERROR_DEVICE, "backend cuda: no CUDA device answers (allowed without one: auto, cpu)");
  TRY(BASE_ALLOC(1, &device));
  const BaseStatus status = open_device(device);
  if (status != BASE_OK) rve_device_destroy(device);
  else *result = device;
  return status;
}

void rve_device_destroy(RveDevice *device) {
  if (!device) return;
  for (int k = 0; k < device->count; k++) cudaFree(device->arena[k].arena);
  for (int k = 0; k < STREAMS; k++) {
    cudaFree(device->scratch[k]);
    if (device->stream[k]) cudaStreamDestroy(device->stream[k]);
  }
  cudaFree(device->device);
  cudaFreeHost(device->host);
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

int rve_device_holds(const RveDevice *device, int rve) { return rve < device->count && device->arena[rve].arena; }

BaseStatus rve_device_download(RveDevice *device, int rve, void *arena) {
  const DeviceArena *from = &device->arena[rve];
  return checked(cudaMemcpy(arena, from->arena, from->bytes, cudaMemcpyDeviceToHost), "copying an RVE from the device");
}

static BaseStatus reserve_jobs(RveDevice *device, int count) {
  if (count <= device->jobs) return BASE_OK;
  const size_t bytes = (size_t)count * sizeof *device->host;
  cudaFreeHost(device->host);
  cudaFree(device->device);
  device->host = device->device = NULL, device->jobs = 0;
  TRY(checked(cudaMallocHost((void **)&device->host, bytes), "memory for jobs"));
  TRY(checked(cudaMalloc((void **)&device->device, bytes), "memory for jobs"));
  device->jobs = count;
  return BASE_OK;
}

static BaseStatus reserve_scratch(RveDevice *device, int stream, size_t bytes) {
  if (bytes <= device->scratch_bytes[stream]) return BASE_OK;
  TRY(checked(cudaStreamSynchronize(device->stream[stream]), "running RVEs"));
  cudaFree(device->scratch[stream]);
  device->scratch[stream] = NULL, device->scratch_bytes[stream] = 0;
  TRY(checked(cudaMalloc((void **)&device->scratch[stream], bytes), "working memory for neighbour lists"));
  device->scratch_bytes[stream] = bytes;
  return BASE_OK;
}

static size_t scratch_bytes(const DeviceJob *job) {
  RveScratch unused;
  return rve_scratch_layout(&job->counts, job->job.pairs, NULL, &unused);
}

/* Small packings first: those of one launch have the same number of warps, and all or none of them fit in shared memory. */
static int compare_jobs(const void *a, const void *b) {
  const DeviceJob *x = (const DeviceJob *)a, *y = (const DeviceJob *)b;
  if (x->bytes != y->bytes) return x->bytes < y->bytes ? -1 : 1;
  return (x->place > y->place) - (x->place < y->place);
}

static void fill_jobs(RveDevice *device, const RveDeviceJob *jobs, int count) {
  for (int k = 0; k < count; k++) {
    const DeviceArena *arena = &device->arena[jobs[k].rve];
    DeviceJob *job = &device->host[k];
    job->job = jobs[k];
    job->counts = arena->counts;
    job->arena = arena->arena;
    job->bytes = arena->bytes;
    job->place = k;
  }
  qsort(device->host, (size_t)count, sizeof *device->host, compare_jobs);
}

static int fits(const RveDevice *device, const DeviceJob *job) { return job->bytes <= (size_t)device->shared_limit; }

/* The end of the launch that begins with job `first`. */
static int find_end(const RveDevice *device, int first, int count) {
  int end = first + 1;
  while (end < count && end - first < device->part && fits(device, &device->host[end]) == fits(device, &device->host[first])) end++;
  return end;
}

static size_t part_bytes(const RveDevice *device, int first, int end) {
  size_t bytes = 0;
  for (int k = first; k < end; k++) bytes += scratch_bytes(&device->host[k]);
  return bytes;
}

/* For the largest part of each stream. */
static BaseStatus reserve_parts(RveDevice *device, int count) {
  for (int first = 0, end, stream = 0; first < count; first = end, stream = (stream + 1) % STREAMS) {
    end = find_end(device, first, count);
    TRY(reserve_scratch(device, stream, part_bytes(device, first, end)));
  }
  return BASE_OK;
}

static void place_part(RveDevice *device, int stream, int first, int end) {
  size_t bytes = 0;
  for (int k = first; k < end; k++) {
    device->host[k].scratch = device->scratch[stream] + bytes;
    bytes += scratch_bytes(&device->host[k]);
  }
}

/* To the device, through the kernel and back, while the other stream does the same with other jobs. */
static BaseStatus launch_part(RveDevice *device, RveFeatures features, int stream, int first, int end) {
  const cudaStream_t way = device->stream[stream];
  DeviceJob *const host = device->host + first;
  DeviceJob *there = device->device + first;
  const size_t bytes = (size_t)(end - first) * sizeof *host;
  int blocks = 1, in_shared = fits(device, host);
  for (int k = first; k < end; k++) blocks = device->host[k].counts.blocks > blocks ? device->host[k].counts.blocks : blocks;
  const int rounds = (blocks + device->warps - 1) / device->warps, warps = (blocks + rounds - 1) / rounds;
  void *arguments[] = {&there, &in_shared};
  TRY(checked(cudaMemcpyAsync(there, host, bytes, cudaMemcpyHostToDevice, way), "copying jobs to the device"));
  TRY(checked(cudaLaunchKernel((const void *)kernels[variant_of(features)], dim3((unsigned)(end - first)), dim3(32u * (unsigned)warps),
                               arguments, in_shared ? device->host[end - 1].bytes : 0, way),
              "starting a kernel"));
  return checked(cudaMemcpyAsync(host, there, bytes, cudaMemcpyDeviceToHost, way), "running RVEs");
}

static BaseStatus launch_all(RveDevice *device, RveFeatures features, int count) {
  for (int first = 0, end, stream = 0; first < count; first = end, stream = (stream + 1) % STREAMS) {
    end = find_end(device, first, count);
    place_part(device, stream, first, end);
    TRY(launch_part(device, features, stream, first, end));
  }
  return BASE_OK;
}

BaseStatus rve_device_run(RveDevice *device, RveFeatures features, RveDeviceJob *jobs, int count) {
  TRY(checked(cudaSetDevice(device->id), "choosing the device"));
  TRY(reserve_jobs(device, count));
  fill_jobs(device, jobs, count);
  BaseStatus status;
  while ((status = reserve_parts(device, count)) == BASE_ERROR_MEMORY && device->part > 1) /* fewer at a time, from now on */
    device->part = (device->part < count ? device->part : count) / 2;
  TRY(status);
  status = launch_all(device, features, count);
  for (int k = 0; k < STREAMS; k++) TRY(checked(cudaStreamSynchronize(device->stream[k]), "running RVEs"));
  TRY(status);
  for (int k = 0; k < count; k++) jobs[device->host[k].place] = device->host[k].job;
  return BASE_OK;
}

} /* extern "C" */
