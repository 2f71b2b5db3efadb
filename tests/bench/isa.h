/* SPDX-License-Identifier: GPL-2.0-or-later */
/* What benchmarks need compiled once per instruction set (isa.c), next to the library's kernels of the same set. */
#ifndef DEMPM_BENCH_ISA_H
#define DEMPM_BENCH_ISA_H

#include "cuda_rve/rve_batch_private.h"

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
extern const BenchIsa bench_isa_avx2, bench_isa_avx512, bench_isa_avx512_whole;
#endif

/* What belongs to the kernels that the library chooses. */
static inline const BenchIsa *bench_isa(const RveScene *scene, const RveKernels **kernels) {
  *kernels = rve_batch_host_kernels(scene);
#if defined(__x86_64__)
  if (*kernels == &rve_kernels_avx2) return &bench_isa_avx2;
  if (*kernels == &rve_kernels_avx512) return &bench_isa_avx512;
  if (*kernels == &rve_kernels_avx512_whole) return &bench_isa_avx512_whole;
#endif
  return &bench_isa_plain;
}

#endif
