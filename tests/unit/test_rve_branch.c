/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Branches that CPUs carry along from step to step are those that positions give, whatever moves the grains: flow, heat, bonds,
 * lists that are built anew, flights in closed form. And each list leaves a row behind it, which the contact pass reads. */
#include "rve_help.h"

#include "cuda_rve/rve_batch_private.h"
#include "cuda_rve/rve_contacts.h"

enum { CALLS = 60 };

/* The contact pass reads one row behind the last: there must be one, and it must name grains. */
static void assert_row_behind(const RveRecord *record) {
  const RveCounts *n = &record->counts;
  const int rows = record->arrays.slot_first[n->blocks];
  assert_true(rows > 0 && rows < n->slot_rows);
  for (int lane = 0; lane < n->lanes; lane++)
    assert_true(record->arrays.neighbour[rows * n->lanes + lane] < (uint32_t)(n->blocks * n->lanes * (n->row ? n->row : 1)));
}

/* Small packings, whose lists come to fill their arenas to the last row. */
static void a_row_is_left_behind_the_list(void **state) {
  (void)state;
  const double motion[9] = {0, 40, 0, 0, 0, 0, 0, 0, 0};
  int lists = 0;
  for (uint64_t seed = 1; seed <= 8; seed++)
    for (int side = 2; side <= 6; side++) {
      RvePacking packing = help_random(2, side, 2e4, seed);
      RveScene scene = help_scene(2);
      scene.tangential_stiffness = 1e6, scene.local_damping = 0.2;
      RveBatch *batch;
      MUST(rve_batch_create(&scene, &packing, 1, NULL, 1, RVE_BACKEND_CPU, &batch));
      for (int call = 0; call < 20; call++) {
        help_step(batch, motion, 0.0, 5e-3);
        assert_row_behind(&batch->record[0]);
      }
      lists += (int)rve_head(batch->record[0].arena)->rebuilds;
      rve_batch_destroy(batch);
      rve_packing_destroy(&packing);
    }
  printf("%d lists\n", lists);
}

/* Component k of a slot's carried branch. In mixed precision a row has 16 first, then 16 second numbers. */
static double carried_branch(const RveRecord *record, int k, int slot) {
  const double *const branch = record->arrays.branch[k];
  float part[2];
  if (record->counts.reaction >= 4) return branch[slot];
  const char *const row = (const char *)(branch + slot / 16 * 16);
  for (int p = 0; p < 2; p++) memcpy(&part[p], row + 4 * (16 * p + slot % 16), sizeof part[p]);
  return (double)part[0] + part[1];
}

/* Largest difference between a carried branch and that of the positions, over the latter's length. */
static double drift(const RveRecord *record, int *carried, int *rested) {
  const RveArrays *a = &record->arrays;
  double worst = 0.0;
  RveSlot slot;
  if (!rve_head(record->arena)->carried) return 0.0;
  for (rve_slot_start(record, &slot); rve_slot_next(&slot);) {
    double square = 0.0;
    if (a->idle_until[slot.slot / record->counts.lanes] != 0.0) {
      *rested += 1;
      continue;
    }
    for (int k = 0; k < record->counts.dimension; k++) square += pow(carried_branch(record, k, slot.slot) - slot.branch[k], 2);
    worst = fmax(worst, sqrt(square) / slot.length);
    *carried += 1;
  }
  return worst;
}

typedef struct Motion {
  const char *name;
  double gradient[9];
  double duration; /* s, of a call */
  int bonds, flights;
} Motion;

static double follow(const char *isa, int dim, const Motion *m, int mixed) {
  RvePacking packing = help_random(dim, dim == 2 ? 12 : 6, dim == 2 ? 2e4 : 1e5, 7);
  RveScene scene = help_scene(dim);
  RveBatch *batch;
  int carried = 0, rested = 0, flights = 0;
  double worst = 0.0;
  help_heat(&scene);
  scene.expansion = 1e-4;
  scene.tangential_stiffness = 1e6, scene.local_damping = 0.2;
  scene.mixed = mixed;
  scene.bonds = m->bonds, scene.bond_strength = 0.01, scene.critical_damping = m->bonds ? 0.1 : 0.0;
  setenv("DEMPM_ISA", isa, 1); /* or the machine's best, if it has none */
  MUST(rve_batch_create(&scene, &packing, 1, NULL, 1, RVE_BACKEND_CPU, &batch));
  unsetenv("DEMPM_ISA");
  const int carries = rve_carries(&batch->record[0].counts); /* plain code does not */
  if (m->bonds) MUST(rve_batch_install_bonds(batch, 1, NULL));
  for (int call = 0; call < CALLS; call++) {
    double gradient[9];
    for (int k = 0; k < 9; k++) gradient[k] = m->flights && call >= CALLS / 2 ? -m->gradient[k] : m->gradient[k];
    flights += help_step(batch, gradient, 0.1 * call, m->duration).flew;
    worst = fmax(worst, drift(&batch->record[0], &carried, &rested));
  }
  const int lists = (int)rve_head(batch->record[0].arena)->rebuilds;
  printf("%dD, %s, %s: %d branches, %d resting, %d lists, %d flights, drift %.1e\n", dim, m->name, rve_batch_backend_name(batch),
         carried, rested, lists, flights, worst);
  if (carries) assert_true(carried > 100 && rested > 100 && lists > 1);
  else assert_int_equal(carried, 0);
  if (m->flights && dim == 2) assert_true(flights > 0 && flights < CALLS); /* in 3D grains meet sooner */
  rve_batch_destroy(batch);
  rve_packing_destroy(&packing);
  return worst;
}

static void carried_branches_are_those_of_positions(void **state) {
  (void)state;
  const char *const isas[4] = {"plain", "avx2", "avx512", "avx512_whole"};
  const Motion motion[] = {{"sheared", {0, 40, 0, 0, 0, 0, 0, 0, 0}, 5e-3, 0, 0},
                           {"turned and squeezed", {-2, 15, 0, -15, 1, 3, 0, -3, 1}, 1.1e-3, 0, 0},
                           {"bonds", {3, 1, 0, 0, -3, 0, 0, 0, 0}, 1.3e-3, 1, 0},
                           {"apart and back", {20, 0, 0, 0, 20, 0, 0, 0, 20}, 1e-3, 0, 1}};
  double worst = 0.0, worst_mixed = 0.0;
  for (int dim = 2; dim <= 3; dim++)
    for (size_t k = 0; k < sizeof motion / sizeof motion[0]; k++)
      for (int i = 0; i < 5; i++) {
        Motion here = motion[k];
        for (int c = 0; dim == 2 && c < 9; c++)
          if (c / 3 == 2 || c % 3 == 2) here.gradient[c] = 0.0;
        if (i < 4) worst = fmax(worst, follow(isas[i], dim, &here, 0));
        else worst_mixed = fmax(worst_mixed, follow("", dim, &here, 1));
      }
  help_report("carried branch against positions, of its length", worst);
  help_report("the same in mixed precision", worst_mixed);
  assert_true(worst <= 1e-14);      /* 64 steps, each a few roundings */
  assert_true(worst_mixed <= 1e-8); /* 64 changes, each of 24 bits: below the 6e-8 of the first number, which enters contacts */
}

int main(void) {
  const struct CMUnitTest tests[] = {cmocka_unit_test(carried_branches_are_those_of_positions),
                                     cmocka_unit_test(a_row_is_left_behind_the_list)};
  return cmocka_run_group_tests(tests, NULL, NULL);
}
