/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The RVE kernels for one CPU instruction set. Compiled once per set, chosen at run time:
 *
 *   gcc -std=c17 -O3 -fno-math-errno -fno-trapping-math -ffp-contract=fast -DRVE_ISA=plain  -c rve_backend_cpu.c
 *   gcc ... -mavx2 -mfma                                                   -DRVE_ISA=avx2   -c rve_backend_cpu.c
 *   gcc ... -mavx512f -mavx512dq -mavx512vl -mavx512bw -mfma -mprefer-vector-width=512 -DRVE_ISA=avx512 -c
 * rve_backend_cpu.c
 *
 * Contraction of a * b + c is wanted here: all lanes run the same vector code, so it cannot make lanes differ. */
#include "rve_isa.h"

#include "rve_backend.h"
#include "rve_measure.h"
#include "rve_step.h"

typedef int RunFunction(const RveCall *, void *, const RveCounts *, RveScratch *);
typedef void MeasureFunction(const RveCall *, void *, const RveCounts *, double, double, RveAnswer *);
static const RveTeam alone = {0, 1, 1, 0};

/* Stamps out one variant: the features are constants in it. */
#define VARIANT(name, dimension, tangential, viscous, bonds)                                                           \
  static int run_##name(const RveCall *call, void *arena, const RveCounts *n, RveScratch *s) {                         \
    const RveFeatures ft = {dimension, tangential, viscous, bonds};                                                    \
    RveArrays a;                                                                                                       \
    rve_layout(n, arena, &a);                                                                                          \
    return (int)rve_run(ft, &alone, call, rve_head(arena), n, &a, s);                                                  \
  }                                                                                                                    \
  static void measure_##name(const RveCall *call, void *arena, const RveCounts *n, double work, double duration,       \
                             RveAnswer *answer) {                                                                      \
    const RveFeatures ft = {dimension, tangential, viscous, bonds};                                                    \
    RveArrays a;                                                                                                       \
    rve_layout(n, arena, &a);                                                                                          \
    rve_measure(ft, &alone, call, rve_head(arena), n, &a, work, duration, answer);                                     \
  }

VARIANT(smooth_2d, 2, 0, 0, 0)
VARIANT(rough_2d, 2, 1, 0, 0)
VARIANT(viscous_2d, 2, 1, 1, 0)
VARIANT(bonded_2d, 2, 1, 1, 1)
VARIANT(smooth_3d, 3, 0, 0, 0)
VARIANT(rough_3d, 3, 1, 0, 0)
VARIANT(viscous_3d, 3, 1, 1, 0)
VARIANT(bonded_3d, 3, 1, 1, 1)

static RunFunction *const run_table[2][4] = {{run_smooth_2d, run_rough_2d, run_viscous_2d, run_bonded_2d},
                                             {run_smooth_3d, run_rough_3d, run_viscous_3d, run_bonded_3d}};
static MeasureFunction *const measure_table[2][4] = {
    {measure_smooth_2d, measure_rough_2d, measure_viscous_2d, measure_bonded_2d},
    {measure_smooth_3d, measure_rough_3d, measure_viscous_3d, measure_bonded_3d}};

/* The least variant that has all that is asked for. */
static int variant_of(RveFeatures ft) { return ft.bonds ? 3 : ft.viscous ? 2 : ft.tangential ? 1 : 0; }

static int run(RveFeatures ft, const RveCall *call, void *arena, const RveCounts *n, RveScratch *s) {
  return run_table[ft.dimension - 2][variant_of(ft)](call, arena, n, s);
}
static void measure(RveFeatures ft, const RveCall *call, void *arena, const RveCounts *n, double work, double duration,
                    RveAnswer *answer) {
  measure_table[ft.dimension - 2][variant_of(ft)](call, arena, n, work, duration, answer);
}

#ifdef RVE_MIXED
#define ROWS {4, 8}, {2, 3} /* rve_row_doubles() */
#else
#define ROWS {8, 12}, {4, 6}
#endif
const RveKernels RVE_NAME(rve_kernels) = {RVE_TEXT, RVE_PACK, ROWS, run, measure};
