/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Rows of pairs that cannot touch rest: every answer has the same bits as with all pairs computed in every step. */
#include "rve_help.h"

#if defined(__SANITIZE_ADDRESS__)
enum { CALLS = 15, MIXED = 0 };
#else
enum { CALLS = 90, MIXED = 1 };
#endif

typedef struct Motion {
  const char *name;
  double kick;             /* m/s, of the grains' first velocities */
  double rate[3];          /* 1/s: stretch of all axes in the first third of the calls, shear in the second, squeeze in the last */
  double warming;          /* K per call */
  double damping, dashpot;
  int tangential, bonds;
} Motion;

/* How many numbers of two answers differ; zeros of either sign are the same. */
static int differences(const RveAnswer *a, const RveAnswer *b) {
  int differ = a->steps != b->steps || a->status != b->status;
  for (int k = 0; k < 6; k++)
    differ += a->stress[k] != b->stress[k] || a->conductivity[k] != b->conductivity[k] || a->fabric[k] != b->fabric[k];
  differ += a->kinetic_energy != b->kinetic_energy || a->elastic_energy != b->elastic_energy;
  differ += a->coordination != b->coordination || a->unbalanced != b->unbalanced || a->volume != b->volume;
  return differ;
}

static void compare(int dim, const Motion *m, int mixed) {
  RvePacking packing = help_random(dim, dim == 2 ? 12 : 6, dim == 2 ? 2e4 : 1e5, 11);
  RveScene scene = help_scene(dim);
  RveBatch *batch[2];
  double out[9] = {0.0}, in[9] = {0.0}, shear[9] = {0.0};
  uint64_t seed = 5;
  int touched = 0, apart = 0;
  for (int g = 0; g < packing.grains; g++)
    for (int k = 0; k < dim; k++) packing.velocity[3 * g + k] = m->kick * (base_random(&seed) - 0.5);
  for (int k = 0; k < dim; k++) out[4 * k] = m->rate[0], in[4 * k] = -m->rate[2];
  shear[1] = m->rate[1];
  help_heat(&scene);
  scene.expansion = 1e-4;
  scene.tangential_stiffness = m->tangential ? 8e5 : 0.0;
  scene.local_damping = m->damping, scene.critical_damping = m->dashpot;
  scene.bonds = m->bonds, scene.bond_strength = 0.01;
  scene.mixed = mixed;
  for (int b = 0; b < 2; b++) {
    scene.resting = b;
    batch[b] = help_batch(&scene, &packing);
    if (m->bonds) MUST(rve_batch_install_bonds(batch[b], 1, NULL));
  }
  for (int call = 0; call < CALLS; call++) {
    const double *gradient = call < CALLS / 3 ? out : call < 2 * CALLS / 3 ? shear : in;
    RveAnswer answer[2];
    for (int b = 0; b < 2; b++) answer[b] = help_step(batch[b], gradient, m->warming * call, 5e-4);
    if (differences(&answer[0], &answer[1])) fail_msg("%dD, %s%s: call %d differs", dim, m->name, mixed ? ", mixed" : "", call);
    if (answer[0].coordination > 0.0) touched++;
    else apart++;
  }
  printf("%dD, %s%s: packing touches in %d calls, apart in %d\n", dim, m->name, mixed ? ", mixed" : "", touched, apart);
  assert_true(touched > 0);
  for (int b = 0; b < 2; b++) rve_batch_destroy(batch[b]);
  rve_packing_destroy(&packing);
}

static void resting_rows_change_no_bit(void **state) {
  (void)state;
  const Motion motion[] = {{"sheared", 0.0, {0.2, 10.0, 1.0}, 0.0, 0.3, 0.0, 1, 0},
                           {"fast grains", 2.0, {2.0, 5.0, 3.0}, 0.0, 0.0, 0.3, 1, 0},
                           {"apart and back", 0.5, {20.0, 0.0, 21.0}, 0.0, 0.5, 0.1, 1, 0},
                           {"warming, no friction", 0.0, {2.0, 0.0, 0.0}, 10.0, 0.9, 0.0, 0, 0},
                           {"bonds that break", 0.2, {3.0, 3.0, 3.0}, 1.0, 0.3, 0.1, 1, 1}};
  for (int dim = 2; dim <= 3; dim++)
    for (size_t k = 0; k < sizeof motion / sizeof motion[0]; k++)
      for (int mixed = 0; mixed <= MIXED; mixed++) compare(dim, &motion[k], mixed);
}

int main(void) {
  const struct CMUnitTest tests[] = {cmocka_unit_test(resting_rows_change_no_bit)};
  return cmocka_run_group_tests(tests, NULL, NULL);
}
