/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The RVE kernels for one CPU instruction set and dimension. Compiled once per set and dimension, chosen at run time:
 *
 *   gcc -std=c17 -O3 -fno-math-errno -fno-trapping-math -ffp-contract=fast -DRVE_ISA=plain -DRVE_DIMENSION=2 -c rve_backend_cpu.c
 *   gcc ... -mavx2 -mfma                                                   -DRVE_ISA=avx2  -DRVE_DIMENSION=3 -c ...
 *   gcc ... -mavx512f -mavx512dq -mavx512vl -mavx512bw -mfma -mprefer-vector-width=512 -DRVE_ISA=avx512 ...
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
#define VARIANT(name, tangential, viscous, bonds)                                                                      \
  static int run_##name(const RveCall *call, void *arena, const RveCounts *n, RveScratch *s) {                         \
    const RveFeatures ft = {RVE_DIMENSION, tangential, viscous, bonds};                                                \
    RveArrays a;                                                                                                       \
    rve_layout(n, arena, &a);                                                                                          \
    return (int)rve_run(ft, &alone, call, rve_head(arena), n, &a, s);                                                  \
  }                                                                                                                    \
  static void measure_##name(const RveCall *call, void *arena, const RveCounts *n, double work, double duration,       \
                             RveAnswer *answer) {                                                                      \
    const RveFeatures ft = {RVE_DIMENSION, tangential, viscous, bonds};                                                \
    RveArrays a;                                                                                                       \
    rve_layout(n, arena, &a);                                                                                          \
    rve_measure(ft, &alone, call, rve_head(arena), n, &a, work, duration, answer);                                     \
  }

VARIANT(smooth, 0, 0, 0)
VARIANT(rough, 1, 0, 0)
VARIANT(viscous, 1, 1, 0)
VARIANT(bonded, 1, 1, 1)

static RunFunction *const run_table[4] = {run_smooth, run_rough, run_viscous, run_bonded};
static MeasureFunction *const measure_table[4] = {measure_smooth, measure_rough, measure_viscous, measure_bonded};

/* The least variant that has all that is asked for. */
static int variant_of(RveFeatures ft) { return ft.bonds ? 3 : ft.viscous ? 2 : ft.tangential ? 1 : 0; }

static int run(RveFeatures ft, const RveCall *call, void *arena, const RveCounts *n, RveScratch *s) {
  return run_table[variant_of(ft)](call, arena, n, s);
}
static void measure(RveFeatures ft, const RveCall *call, void *arena, const RveCounts *n, double work, double duration,
                    RveAnswer *answer) {
  measure_table[variant_of(ft)](call, arena, n, work, duration, answer);
}

/* rve_row_doubles(), and the same of reactions. */
#if defined(RVE_MIXED)
#define ROWS {2, 4}, {2, 3}
#elif defined(RVE_WHOLE_REACTIONS)
#define ROWS {4, 8}, {4, RVE_WHOLE}
#elif RVE_CARRIES
#define ROWS {4, 8}, {4, 6}
#else
#define ROWS {0, 0}, {4, 6}
#endif
#if RVE_DIMENSION == 3
const RveKernels RVE_NAME(rve_kernels_3d) = {RVE_TEXT, RVE_PACK, ROWS, run, measure};
#else
extern const RveKernels RVE_NAME(rve_kernels_3d);

static int run_any(RveFeatures ft, const RveCall *call, void *arena, const RveCounts *n, RveScratch *s) {
  return (ft.dimension == 2 ? run : RVE_NAME(rve_kernels_3d).run)(ft, call, arena, n, s);
}
static void measure_any(RveFeatures ft, const RveCall *call, void *arena, const RveCounts *n, double work,
                        double duration, RveAnswer *answer) {
  (ft.dimension == 2 ? measure : RVE_NAME(rve_kernels_3d).measure)(ft, call, arena, n, work, duration, answer);
}
const RveKernels RVE_NAME(rve_kernels) = {RVE_TEXT, RVE_PACK, ROWS, run_any, measure_any};
#endif
