/* SPDX-License-Identifier: GPL-2.0-or-later */
/* See isa.h. Compiled once per instruction set with the flags of rve_backend_cpu.c. */
#include "cuda_rve/rve_isa.h"
#include "isa.h"

#include "cuda_rve/rve_step.h"

/* Keeps the compiler from folding a loop whose result nobody wants. */
#if defined(RVE_ISA_AVX512)
#define KEEP(x) __asm__ volatile("" : "+v"(x))
#elif defined(__x86_64__)
#define KEEP(x) __asm__ volatile("" : "+x"(x))
#else
#define KEEP(x) __asm__ volatile("" : "+w"(x))
#endif

static int only_2d(const RveCall *call, void *arena, const RveCounts *counts, RveScratch *scratch) {
  static const RveTeam alone = {0, 1, 1, 0};
  const RveFeatures ft = {2, 1, 0, 0};
  RveCounts n = *counts;
  RveCall bare = *call;
  RveArrays a;
  n.dimension = 2;
  bare.thermal = bare.turning = 0;
  rve_layout(&n, arena, &a);
  return (int)rve_run(ft, &alone, &bare, rve_head(arena), &n, &a, scratch);
}

/* Twelve independent chains, more than latency times units, under names of their own: an array would go to memory. */
#define EACH(X) X(a) X(b) X(c) X(d) X(e) X(f) X(g) X(h) X(i) X(j) X(k) X(l)
#define START(x) rve_real x = rve_set(1.0);
#define STEP(x) x = x * factor + term;
#define STEP_KEEP(x) KEEP(x);

static double multiply_add(long steps, double *flop) {
  const rve_real factor = rve_set(0.999999), term = rve_set(1e-6);
  EACH(START)
  const double start = base_seconds();
  for (long s = 0; s < steps; s++) {
    EACH(STEP)
    EACH(STEP_KEEP)
  }
  *flop = 2.0 * 12 * RVE_SPAN * (double)steps;
  return base_seconds() - start;
}

static double read_numbers(const double *numbers, long count, long sweeps) {
  rve_real a = rve_set(0.0), b = a, c = a, d = a;
  const double start = base_seconds();
  for (long s = 0; s < sweeps; s++)
    for (int i = 0; i + 4 * RVE_SPAN <= count; i += 4 * RVE_SPAN) {
      a = a + rve_load(numbers, i);
      b = b + rve_load(numbers, i + RVE_SPAN);
      c = c + rve_load(numbers, i + 2 * RVE_SPAN);
      d = d + rve_load(numbers, i + 3 * RVE_SPAN);
      KEEP(a);
      KEEP(b);
      KEEP(c);
      KEEP(d);
    }
  return base_seconds() - start;
}

static double gather(const double *rows, const uint32_t *offset, long count, long sweeps) {
  rve_real a = rve_set(0.0), b = a, c = a, d = a;
  const double start = base_seconds();
  for (long s = 0; s < sweeps; s++)
    for (long i = 0; i < count; i += RVE_SPAN) {
      const RveQuad q = rve_gather(rows, offset, (int)i);
      a = a + q.f[0], b = b + q.f[1], c = c + q.f[2], d = d + q.f[3];
      KEEP(a);
      KEEP(b);
      KEEP(c);
      KEEP(d);
    }
  return base_seconds() - start;
}

const BenchIsa RVE_NAME(bench_isa) = {RVE_TEXT, only_2d, multiply_add, read_numbers, gather};
