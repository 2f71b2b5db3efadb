/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The part of the CUDA runtime that the RVE kernels use, on the host: `make CUDA_HOST=yes`. A thread of a block is a fiber that
 * runs until the block's or its warp's next common operation. So the source of the device runs, with its layout, lists,
 * reductions and barriers, where no device is; its speed and the memory model of a GPU are not shown.
 *
 * DEMPM_CUDA_HOST_ORDER=forward|reverse|shuffle: who runs first between two barriers. What depends on it is a race.
 * DEMPM_CUDA_HOST_SHARED: bytes of shared memory that a block may have (232448).
 * DEMPM_CUDA_HOST_DEVICES: number of devices (1).
 * DEMPM_CUDA_HOST_MEMORY: the largest piece of memory that is given, in bytes (any). */
#ifndef DEMPM_CUDA_HOST_H
#define DEMPM_CUDA_HOST_H

#include <math.h>
#include <setjmp.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <ucontext.h>

#define __global__
#define __device__
#define __host__
#define __forceinline__ inline __attribute__((always_inline, unused))
#define __noinline__ __attribute__((noinline))
#define __launch_bounds__(threads, blocks)
#define __shared__ thread_local /* all fibers of a block are one thread of the host */
#define __align__(bytes) __attribute__((aligned(bytes)))

struct uint3 {
  unsigned x, y, z;
};
struct dim3 {
  unsigned x, y, z;
  dim3(unsigned a = 1, unsigned b = 1, unsigned c = 1) : x(a), y(b), z(c) {}
};
struct int4 {
  int x, y, z, w;
};

static inline long long __double2ll_rn(double a) { return fabs(a) < 0x1p63 ? llrint(a) : INT64_MIN; }
static inline long long __double_as_longlong(double a) {
  long long b;
  memcpy(&b, &a, sizeof b);
  return b;
}
static inline double __longlong_as_double(long long a) {
  double b;
  memcpy(&b, &a, sizeof b);
  return b;
}

/* ------------------------------------------------------------------------------------------------------- fibers */

namespace cuda_host {

enum { WARP = 32, THREADS = 1024, STACK = 256 << 10, SHARED = 232448 };
enum State { READY, AT_WARP, AT_BLOCK, ENDED };

struct Fiber {
  ucontext_t start; /* a first entry asks the kernel, later ones do not */
  jmp_buf place;
  State state;
  int has_begun;
  int operations;   /* of its warp so far */
  double value[2];  /* what it gives to the present and the last of them */
};

static Fiber fiber[THREADS];
static jmp_buf scheduler;
static int threads, now;
static char *stacks;
static int turn[THREADS];
static uint64_t chance = 88172645463325252u;

[[noreturn]] static inline void stop(const char *what) {
  fprintf(stderr, "cuda_host: thread %d: %s\n", now, what);
  exit(99);
}

static inline void wait_as(State state) {
  fiber[now].state = state;
  if (_setjmp(fiber[now].place) == 0) _longjmp(scheduler, 1);
}

__attribute__((noinline)) static void go_on(Fiber *f) {
  if (_setjmp(scheduler) != 0) return;
  if (f->has_begun) _longjmp(f->place, 1);
  f->has_begun = 1;
  setcontext(&f->start);
}

/* Every lane gives a number and sees those of all. */
static inline const double *exchange(double mine, double all[WARP]) {
  Fiber *const self = &fiber[now];
  const int side = self->operations++ & 1, first = now / WARP * WARP;
  self->value[side] = mine;
  wait_as(AT_WARP);
  for (int lane = 0; lane < WARP; lane++) all[lane] = fiber[first + lane].value[side];
  return all;
}

static inline int at(State state, int first, int count) {
  int many = 0;
  for (int t = first; t < first + count; t++) many += fiber[t].state == state;
  return many;
}

/* Threads that all wait for the same thing go on. */
static inline void release(void) {
  int any = 0;
  for (int first = 0; first < threads; first += WARP) {
    if (at(AT_WARP, first, WARP) != WARP) continue;
    for (int t = first; t < first + WARP; t++) fiber[t].state = READY;
    any = 1;
  }
  if (any || at(ENDED, 0, threads) == threads) return;
  if (at(AT_BLOCK, 0, threads) != threads) stop("a barrier or an operation of a warp that not all its threads come to");
  for (int t = 0; t < threads; t++) fiber[t].state = READY;
}

/* Between two barriers each thread runs once, in an order that must not matter. */
static inline void choose_turns(void) {
  static const char *const order = getenv("DEMPM_CUDA_HOST_ORDER");
  for (int k = 0; order && *order == 'r' && k < threads; k++) turn[k] = threads - 1 - k;
  for (int k = threads - 1; order && *order == 's' && k > 0; k--) {
    chance ^= chance << 13, chance ^= chance >> 7, chance ^= chance << 17;
    const int other = (int)(chance % (uint64_t)(k + 1)), last = turn[k];
    turn[k] = turn[other], turn[other] = last;
  }
}

static void (*body)(void *, int);
static void *body_jobs;
static int body_flag;

static void begin(void) {
  body(body_jobs, body_flag);
  wait_as(ENDED);
}

}  // namespace cuda_host

static uint3 threadIdx, blockIdx, blockDim;
__shared__ __align__(64) char memory[cuda_host::SHARED]; /* a kernel's extern __shared__ array */


static inline void __syncthreads(void) { cuda_host::wait_as(cuda_host::AT_BLOCK); }
static inline int __any_sync(unsigned, int a) {
  double all[cuda_host::WARP];
  int any = 0;
  cuda_host::exchange(a != 0, all);
  for (double b : all) any |= b != 0;
  return any;
}
static inline double __shfl_xor_sync(unsigned, double a, int mask) {
  double all[cuda_host::WARP];
  return cuda_host::exchange(a, all)[(threadIdx.x ^ (unsigned)mask) % cuda_host::WARP];
}

namespace cuda_host {

static inline void run_block(unsigned block, int count) {
  threads = count, blockIdx.x = block;
  memset(memory, 0xa5, sizeof memory); /* nothing may be read that was not written */
  for (int t = 0; t < threads; t++) {
    Fiber *const f = &fiber[t];
    if (getcontext(&f->start) != 0) stop("no context");
    f->start.uc_stack.ss_sp = stacks + (size_t)t * STACK;
    f->start.uc_stack.ss_size = STACK;
    f->start.uc_link = NULL;
    f->state = READY, f->operations = f->has_begun = 0;
    makecontext(&f->start, begin, 0);
  }
  for (int k = 0; k < threads; k++) turn[k] = k;
  while (at(ENDED, 0, threads) != threads) {
    choose_turns();
    for (int k = 0; k < threads; k++) {
      now = turn[k], threadIdx.x = (unsigned)now;
      if (fiber[now].state == READY) go_on(&fiber[now]);
    }
    release();
  }
}

static inline int number_from(const char *name, int otherwise) {
  const char *const text = getenv(name);
  return text ? atoi(text) : otherwise;
}

static int device;

}  // namespace cuda_host

/* -------------------------------------------------------------------------------------------------- runtime, host */

typedef enum cudaError_t { cudaSuccess, cudaErrorInvalidValue, cudaErrorMemoryAllocation } cudaError_t;
enum { cudaMemcpyHostToDevice = 1, cudaMemcpyDeviceToHost };
enum { cudaDevAttrMaxSharedMemoryPerBlockOptin };
enum { cudaFuncAttributeMaxDynamicSharedMemorySize, cudaFuncAttributePreferredSharedMemoryCarveout };
enum { cudaSharedmemCarveoutMaxShared = 100 };
struct cudaFuncAttributes {
  size_t sharedSizeBytes;
};

static inline cudaError_t cudaGetDeviceCount(int *count) {
  *count = cuda_host::number_from("DEMPM_CUDA_HOST_DEVICES", 1);
  return cudaSuccess;
}
static inline cudaError_t cudaGetDevice(int *id) { return *id = cuda_host::device, cudaSuccess; }
static inline cudaError_t cudaSetDevice(int id) {
  int count;
  cudaGetDeviceCount(&count);
  if (id < 0 || id >= count) return cudaErrorInvalidValue;
  return cuda_host::device = id, cudaSuccess;
}
static inline cudaError_t cudaGetLastError(void) { return cudaSuccess; }
static inline const char *cudaGetErrorString(cudaError_t error) {
  return error == cudaSuccess ? "no error" : error == cudaErrorInvalidValue ? "invalid argument" : "out of memory";
}
static inline cudaError_t cudaDeviceGetAttribute(int *value, int, int) {
  *value = cuda_host::number_from("DEMPM_CUDA_HOST_SHARED", cuda_host::SHARED);
  return cudaSuccess;
}
static inline cudaError_t cudaFuncGetAttributes(cudaFuncAttributes *attributes, const void *) {
  attributes->sharedSizeBytes = 2048;
  return cudaSuccess;
}
static inline cudaError_t cudaFuncSetAttribute(const void *, int, int) { return cudaSuccess; }
static inline cudaError_t cudaMalloc(void **memory_of, size_t bytes) {
  *memory_of = NULL;
  const int most = cuda_host::number_from("DEMPM_CUDA_HOST_MEMORY", 0);
  if (most > 0 && bytes > (size_t)most) return cudaErrorMemoryAllocation;
  *memory_of = aligned_alloc(256, (bytes + 255) / 256 * 256);
  if (*memory_of) memset(*memory_of, 0xa5, bytes);
  return *memory_of ? cudaSuccess : cudaErrorMemoryAllocation;
}
static inline cudaError_t cudaFree(void *old) { return free(old), cudaSuccess; }
static inline cudaError_t cudaMemcpy(void *to, const void *from, size_t bytes, int) {
  return memcpy(to, from, bytes), cudaSuccess;
}
static inline cudaError_t cudaMallocHost(void **memory_of, size_t bytes) { return cudaMalloc(memory_of, bytes); }
static inline cudaError_t cudaFreeHost(void *old) { return cudaFree(old); }

typedef struct CudaHostStream *cudaStream_t;
static inline cudaError_t cudaStreamCreate(cudaStream_t *stream) { return *stream = NULL, cudaSuccess; }
static inline cudaError_t cudaStreamDestroy(cudaStream_t) { return cudaSuccess; }
static inline cudaError_t cudaStreamSynchronize(cudaStream_t) { return cudaSuccess; }
static inline cudaError_t cudaMemcpyAsync(void *to, const void *from, size_t bytes, int way, cudaStream_t) {
  return cudaMemcpy(to, from, bytes, way);
}

/* Blocks one after the other. Kernels take a pointer and a number. */
static inline cudaError_t cudaLaunchKernel(const void *kernel, dim3 blocks, dim3 block, void **arguments, size_t shared, cudaStream_t) {
  if (block.x % cuda_host::WARP || block.x > cuda_host::THREADS || shared > cuda_host::SHARED) return cudaErrorInvalidValue;
  if (!cuda_host::stacks) cuda_host::stacks = (char *)malloc((size_t)cuda_host::THREADS * cuda_host::STACK);
  if (!cuda_host::stacks) return cudaErrorMemoryAllocation;
  memcpy(&cuda_host::body, &kernel, sizeof kernel);
  memcpy(&cuda_host::body_jobs, arguments[0], sizeof cuda_host::body_jobs);
  memcpy(&cuda_host::body_flag, arguments[1], sizeof cuda_host::body_flag);
  blockDim.x = block.x;
  for (unsigned b = 0; b < blocks.x; b++) cuda_host::run_block(b, (int)block.x);
  return cudaSuccess;
}

#endif
