/* SPDX-License-Identifier: GPL-2.0-or-later */
/* What benchmarks need compiled once per instruction set (isa.c), next to the library's kernels of the same set. */
#ifndef DEMPM_BENCH_ISA_H
#define DEMPM_BENCH_ISA_H

#include "cuda_rve/rve_backend.h"

typedef struct BenchIsa {
  const char *name;
  /* rve_run() for friction in 2D, all other physics left out when it was compiled. */
  int (*only_2d)(const RveCall *call, void *arena, const RveCounts *counts, RveScratch *scratch);
  /* Seconds of `steps` rounds of independent multiply-adds; *flop: how many operations they are. */
  double (*multiply_add)(long steps, double *flop);
  /* Seconds of reading numbers[0..count) `sweeps` times. */
  double (*read)(const double *numbers, long count, long sweeps);
  /* Seconds of rve_gather() of the rows at offset[0..count), `sweeps` times. */
  double (*gather)(const double *rows, const uint32_t *offset, long count, long sweeps);
} BenchIsa;

extern const BenchIsa bench_isa_plain;
#if defined(__x86_64__)
extern const BenchIsa bench_isa_avx2, bench_isa_avx512;
#endif

/* The best that this machine has, as the library chooses it. */
static inline const BenchIsa *bench_isa(const RveKernels **kernels) {
  const BenchIsa *best = &bench_isa_plain;
  *kernels = &rve_kernels_plain;
#if defined(__x86_64__)
  const int has2 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
  if (has2) best = &bench_isa_avx2, *kernels = &rve_kernels_avx2;
  if (has2 && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
      __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512bw"))
    best = &bench_isa_avx512, *kernels = &rve_kernels_avx512;
#endif
  return best;
}

#endif
