/* SPDX-License-Identifier: GPL-2.0-or-later */
/* What the parts of a DEM step cost, and what physics costs that is switched off:
 *
 *   bench_rve_parts PACKING 2|3 [rounds]
 *
 * One line of JSON, times in ns per particle-step:
 *   full       the kernel that the library takes for friction alone
 *   only       the same job in a kernel without heat, bonds, dashpots and 3D (isa.c; 2D only)
 *   viscous, bonded, thermal    the same job with this physics switched on, though nothing comes of it
 *   list_us    one list, microseconds; list_share: of the time of `full` that went into lists
 *   slots, used_slots           slots of the list per grain, and those that hold a pair and do not rest
 *   state_bytes                 of one RVE
 * The variants take turns, so that what else the machine does falls on all alike; medians of the rounds. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "cuda_rve/rve_outcome.h"
#include "cuda_rve/rve_packing.h"
#include "isa.h"
#include "job.h"

enum { FULL, ONLY, VISCOUS, BONDED, THERMAL, CASES, MOST_ROUNDS = 101, STEPS = 2000, LISTS = 20 };
static const char *const case_name[CASES] = {"full", "only", "viscous", "bonded", "thermal"};

typedef struct Bench {
  const RveKernels *kernels;
  const BenchIsa *isa;
  RveScene scene;
  RveRecord record;
  RveScratch scratch;
  void *start; /* a copy of the arena, to which every measurement returns */
} Bench;

static BaseStatus make_call(const Bench *bench, long steps, RveCall *call) {
  RveInput input = {{-0.5, 0.0, 0.0, 0.0, 0.5, 0.0, 0.0, 0.0, 0.0}, 0.0};
  return rve_call_make(&bench->scene, rve_head(bench->record.arena), &input,
                       (double)steps * bench->scene.time_step, call);
}

/* Runs until lists and arena have found their size; the state then is where measurements start. */
static BaseStatus prepare(Bench *bench, const RvePacking *packing) {
  const RveFeatures ft = rve_scene_features(&bench->scene);
  RveRecord *record = &bench->record;
  RveCall call;
  TRY(rve_record_from_packing(bench->kernels, &bench->scene, packing, record));
  TRY(make_call(bench, 8000, &call));
  for (;;) {
    const int need = rve_head(record->arena)->need_pairs, room = 4 * record->counts.slot_rows * record->counts.lanes;
    void *memory;
    const int pairs = need > room ? need : room;
    TRY(base_alloc(rve_scratch_layout(&record->counts, pairs, NULL, &bench->scratch), 1, &memory));
    rve_scratch_layout(&record->counts, pairs, memory, &bench->scratch);
    const int outcome = bench->kernels->run(ft, &call, record->arena, &record->counts, &bench->scratch);
    if (outcome == RVE_UNSTABLE) return base_error(BASE_ERROR_UNSTABLE, "the packing is unstable");
    if (outcome == RVE_DONE) break;
    base_free(memory);
    TRY(rve_record_grow(record));
  }
  TRY(base_alloc(record->bytes, 1, &bench->start));
  memcpy(bench->start, record->arena, record->bytes);
  return BASE_OK;
}

static BaseStatus run_case(Bench *bench, int which, double *seconds) {
  RveFeatures ft = rve_scene_features(&bench->scene);
  RveRecord *record = &bench->record;
  RveCall call;
  memcpy(record->arena, bench->start, record->bytes);
  TRY(make_call(bench, STEPS, &call));
  ft.viscous = which == VISCOUS;
  ft.bonds = which == BONDED;
  call.thermal = which == THERMAL;
  const double start = base_seconds();
  const int outcome = which == ONLY ? bench->isa->only_2d(&call, record->arena, &record->counts, &bench->scratch)
                                    : bench->kernels->run(ft, &call, record->arena, &record->counts, &bench->scratch);
  *seconds = base_seconds() - start;
  return outcome == RVE_DONE ? BASE_OK : base_error(BASE_ERROR_UNSTABLE, "%s: the list outgrew its room", case_name[which]);
}

/* Forces of the present state with and without a new list. */
static BaseStatus run_list(Bench *bench, double *seconds) {
  const RveFeatures ft = rve_scene_features(&bench->scene);
  RveRecord *record = &bench->record;
  RveCall call;
  TRY(make_call(bench, 0, &call));
  *seconds = 0.0;
  for (int k = 0; k < 2 * LISTS; k++) {
    memcpy(record->arena, bench->start, record->bytes);
    if (k % 2) rve_head(record->arena)->list_due = RVE_LIST_ABSENT;
    const double start = base_seconds();
    const int outcome = bench->kernels->run(ft, &call, record->arena, &record->counts, &bench->scratch);
    *seconds += (k % 2 ? 1.0 : -1.0) * (base_seconds() - start) / LISTS;
    if (outcome != RVE_DONE) return base_error(BASE_ERROR_UNSTABLE, "the list outgrew its room");
  }
  return BASE_OK;
}

static int compare(const void *a, const void *b) {
  const double x = *(const double *)a, y = *(const double *)b;
  return (x > y) - (x < y);
}
static double median(double *a, int count) {
  qsort(a, (size_t)count, sizeof *a, compare);
  return count % 2 ? a[count / 2] : 0.5 * (a[count / 2 - 1] + a[count / 2]);
}

static BaseStatus bench_parts(Bench *bench, const RvePacking *packing, int rounds) {
  static double seconds[CASES + 1][MOST_ROUNDS];
  const int flat = bench->scene.dimension == 2;
  long lists = 0;
  TRY(prepare(bench, packing));
  const int64_t before = rve_head(bench->start)->rebuilds;
  for (int r = 0; r < rounds; r++) {
    for (int turn = 0; turn < CASES; turn++) {
      const int c = (turn + r) % CASES; /* or the first would always pay for what ran before the round */
      if (c == ONLY && !flat) continue;
      TRY(run_case(bench, c, &seconds[c][r]));
      if (c == FULL) lists = (long)(rve_head(bench->record.arena)->rebuilds - before);
    }
    TRY(run_list(bench, &seconds[CASES][r]));
  }
  const RveCounts *n = &bench->record.counts;
  const RveArrays *a = &bench->record.arrays;
  const int slots = a->slot_first[n->blocks] * n->lanes;
  int used = 0;
  const double now = rve_head(bench->record.arena)->approach;
  for (int k = 0; k < slots; k++)
    used += !(a->image[k] & RVE_IMAGE_VOID) && !(now < a->idle_until[k / n->lanes]);
  printf("{\"isa\": \"%s\", \"dimension\": %d, \"grains\": %d, \"rounds\": %d", bench->kernels->name, n->dimension,
         n->grains, rounds);
  const double list = median(seconds[CASES], rounds);
  double full = 0.0;
  for (int c = 0; c < CASES; c++) {
    const double time = median(seconds[c], rounds);
    if (c == FULL) full = time;
    if (c != ONLY || flat) printf(", \"%s\": %.4g", case_name[c], 1e9 * time / STEPS / n->grains);
  }
  printf(", \"steps\": %d, \"lists\": %ld, \"list_us\": %.4g, \"list_share\": %.4g", STEPS, lists, 1e6 * list,
         (double)lists * list / full);
  printf(", \"slots\": %.4g, \"used_slots\": %.4g, \"state_bytes\": %zu}\n", (double)slots / n->grains,
         (double)used / n->grains, bench->record.bytes);
  return BASE_OK;
}

int main(int argc, char **argv) {
  static Bench bench;
  RvePacking packing = {0};
  const int dimension = argc > 2 ? atoi(argv[2]) : 0, rounds = argc > 3 ? atoi(argv[3]) : 11;
  if ((dimension != 2 && dimension != 3) || rounds < 1 || rounds > MOST_ROUNDS) {
    fprintf(stderr, "usage: bench_rve_parts PACKING 2|3 [rounds]\n");
    return 2;
  }
  bench.scene = job_scene(dimension);
  bench.isa = bench_isa(&bench.scene, &bench.kernels);
  BaseStatus status = rve_packing_read(argv[1], dimension, &packing);
  packing.contacts = 0;
  if (status == BASE_OK) status = bench_parts(&bench, &packing, rounds);
  if (status != BASE_OK) fprintf(stderr, "bench_rve_parts: %s\n", base_error_message());
  rve_packing_destroy(&packing);
  return status != BASE_OK;
}
