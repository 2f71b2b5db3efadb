/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Batches: the same bits for every thread count, batch size and order; states packed and restored; instruction sets;
 * refusals. */
#include "rve_help.h"

enum { RVES = 7, CALLS = 12 };

static RveScene frictional(int dim) {
  RveScene scene = help_scene(dim);
  help_heat(&scene);
  scene.tangential_stiffness = 8e5;
  scene.critical_damping = 0.1;
  scene.local_damping = 0.2;
  return scene;
}

static RveInput input_of(int rve, int call) {
  uint64_t seed = (uint64_t)(1000 * rve + call);
  RveInput input = {{0.0}, 0.0};
  for (int i = 0; i < 2; i++)
    for (int j = 0; j < 2; j++) input.velocity_gradient[3 * i + j] = help_uniform(&seed, -30.0, 30.0);
  input.temperature = help_uniform(&seed, 0.0, 30.0);
  return input;
}

/* Answers of the last call of RVES RVEs, stepped in chunks of `chunk` in an order turned by `turn`. */
static void run_all(const RvePacking packings[2], int dim, int threads, int chunk, int turn, RveAnswer answers[RVES]) {
  RveScene scene = frictional(dim);
  int which[RVES];
  RveBatch *batch;
  scene.threads = threads;
  for (int k = 0; k < RVES; k++) which[k] = k % 2;
  MUST(rve_batch_create(&scene, packings, 2, which, RVES, help_backend(), &batch));
  for (int call = 0; call < CALLS; call++)
    for (int start = 0; start < RVES; start += chunk) {
      int index[RVES], n = 0;
      RveInput input[RVES];
      RveAnswer answer[RVES];
      for (; n < chunk && start + n < RVES; n++) {
        index[n] = (start + n + turn) % RVES;
        input[n] = input_of(index[n], call);
      }
      MUST(rve_batch_step(batch, n, index, input, 5e-4, answer));
      for (int k = 0; k < n; k++) answers[index[k]] = answer[k];
    }
  rve_batch_destroy(batch);
}

static void answers_do_not_depend_on_threads_batches_or_order(void **state) {
  (void)state;
  for (int dim = 2; dim <= 3; dim++) {
    RvePacking packings[2];
    RveAnswer first[RVES], again[RVES];
    for (int k = 0; k < 2; k++)
      packings[k] = help_random(dim, dim == 2 ? 9 : 5, dim == 2 ? 2e4 : 1e5, 40 + (uint64_t)k);
    run_all(packings, dim, 1, RVES, 0, first);
    const int trials[4][3] = {{2, RVES, 0}, {4, RVES, 3}, {1, 1, 5}, {2, 3, 2}};
    for (int t = 0; t < 4; t++) {
      run_all(packings, dim, trials[t][0], trials[t][1], trials[t][2], again);
      assert_memory_equal(first, again, sizeof first);
    }
    assert_true(first[0].rebuilds > 3 && first[0].stress[0] != first[1].stress[0]);
    for (int k = 0; k < 2; k++) rve_packing_destroy(&packings[k]);
  }
}

/* ------------------------------------------------------------------------------------------------ pack and unpack */

static void *pack(const RveBatch *batch, int rve, size_t *size) {
  void *bytes = malloc(rve_batch_state_bytes(batch, rve));
  MUST(rve_batch_pack(batch, rve, bytes, size));
  assert_true(*size <= rve_batch_state_bytes(batch, rve));
  return bytes;
}

static void a_restored_rve_continues_bit_for_bit(void **state) {
  (void)state;
  for (int dim = 2; dim <= 3; dim++) {
    RvePacking packing = help_random(dim, dim == 2 ? 9 : 5, dim == 2 ? 2e4 : 1e5, 50);
    RveScene scene = frictional(dim);
    scene.bonds = 1;
    scene.bond_strength = 0.035; /* about half of them break on the way */
    RveBatch *batch = help_batch(&scene, &packing), *other;
    const int two = 2;
    RveAnswer answer, again;
    size_t size;
    MUST(rve_batch_install_bonds(batch, 0, NULL));
    for (int call = 0; call < 12; call++) {
      const RveInput input = input_of(0, call);
      MUST(rve_batch_step(batch, 1, NULL, &input, 5e-4, &answer));
    }
    void *bytes = pack(batch, 0, &size);
    MUST(rve_batch_create(&scene, &packing, 1, NULL, 3, help_backend(), &other));
    MUST(rve_batch_unpack(other, two, bytes, size));
    const RveInput still = {{0.0}, 0.0};
    MUST(rve_batch_step(other, 1, &two, &still, 0.0, &again));
    assert_memory_equal(answer.stress, again.stress, sizeof answer.stress);
    for (int call = CALLS; call < 2 * CALLS; call++) {
      const RveInput input = input_of(0, call);
      MUST(rve_batch_step(batch, 1, NULL, &input, 5e-4, &answer));
      MUST(rve_batch_step(other, 1, &two, &input, 5e-4, &again));
      assert_memory_equal(&answer, &again, sizeof answer);
    }
    assert_true(answer.bond_fraction > 0.0 && answer.bond_fraction < 1.0);
    free(bytes);
    rve_batch_destroy(batch);
    rve_batch_destroy(other);
    rve_packing_destroy(&packing);
  }
}

static void altered_truncated_and_foreign_states_are_refused(void **state) {
  (void)state;
  RvePacking packing = help_crystal(HELP_HEXAGONAL, 3, 5e-3, 0.01);
  RveScene scene = frictional(2), denser = scene;
  RveBatch *batch = help_batch(&scene, &packing), *other;
  size_t size;
  unsigned char *bytes = pack(batch, 0, &size), *copy = malloc(size);
  uint64_t seed = 1;
  const RveAnswer before = help_step(batch, NULL, 0.0, 0.0);
  for (int trial = 0; trial < 300; trial++) {
    memcpy(copy, bytes, size);
    copy[(size_t)(base_random(&seed) * (double)size)] ^= (unsigned char)(1u << (int)(base_random(&seed) * 8.0));
    assert_int_equal(rve_batch_unpack(batch, 0, copy, size), BASE_ERROR_FORMAT);
    assert_int_equal(rve_batch_unpack(batch, 0, bytes, (size_t)(base_random(&seed) * (double)size)), BASE_ERROR_FORMAT);
  }
  const RveAnswer after = help_step(batch, NULL, 0.0, 0.0);
  assert_memory_equal(before.stress, after.stress, sizeof before.stress);
  denser.density *= 2.0;
  other = help_batch(&denser, &packing);
  assert_int_equal(rve_batch_unpack(other, 0, bytes, size), BASE_ERROR_FORMAT);
  free(bytes);
  free(copy);
  rve_batch_destroy(batch);
  rve_batch_destroy(other);
  rve_packing_destroy(&packing);
}

/* ------------------------------------------------------------------------------------------------- instruction sets */

static RveBatch *batch_on(const char *isa, const RveScene *scene, const RvePacking *packing, int *there) {
  char name[32];
  RveBatch *batch;
  setenv("DEMPM_ISA", isa, 1);
  MUST(rve_batch_create(scene, packing, 1, NULL, 1, RVE_BACKEND_CPU, &batch));
  unsetenv("DEMPM_ISA");
  snprintf(name, sizeof name, "cpu/%s", isa);
  *there = strcmp(rve_batch_backend_name(batch), name) == 0; /* else the machine lacks it */
  return batch;
}

enum { SMOOTH, ROUGH, VISCOUS, BONDED, VARIANTS };

static RveScene variant(int which, int dim) {
  RveScene scene = frictional(dim);
  if (which == SMOOTH) scene.friction = scene.tangential_stiffness = 0.0;
  if (which <= ROUGH) scene.critical_damping = 0.0;
  scene.bonds = which == BONDED;
  scene.bond_strength = 1e-3;
  return scene;
}

static void bond(const RveScene *scene, RveBatch *batch) {
  if (scene->bonds) MUST(rve_batch_install_bonds(batch, 0, NULL));
}

/* Largest differences between one instruction set and plain code: after a short run, after states moved from that to this. */
static void compare_sets(const char *isa, const RveScene *scene, const RvePacking *packing, double *worst, double *handed) {
  int plain_there, there;
  double gradient[9] = {0.0};
  gradient[1] = 1.0, gradient[0] = -0.5;
  RveBatch *plain = batch_on("plain", scene, packing, &plain_there), *batch = batch_on(isa, scene, packing, &there);
  assert_true(plain_there);
  bond(scene, plain), bond(scene, batch);
  const RveAnswer expected = help_step(plain, gradient, 0.1, 5e-4);
  size_t size;
  void *bytes = pack(plain, 0, &size);
  const RveAnswer next = help_step(plain, gradient, 0.2, 1e-4);
  RveAnswer answer = help_step(batch, gradient, 0.1, 5e-4);
  *worst = fmax(*worst, help_difference(6, answer.stress, expected.stress));
  MUST(rve_batch_unpack(batch, 0, bytes, size));
  answer = help_step(batch, NULL, 0.0, 0.0);
  *handed = fmax(*handed, help_difference(6, answer.stress, expected.stress));
  assert_true(answer.bond_fraction == expected.bond_fraction);
  answer = help_step(batch, gradient, 0.2, 1e-4);
  *handed = fmax(*handed, help_difference(6, answer.stress, next.stress));
  if (!there) print_message("[   INFO   ] not on this machine: %s\n", isa);
  free(bytes);
  rve_batch_destroy(plain);
  rve_batch_destroy(batch);
}

static void instruction_sets_agree_and_take_over_from_each_other(void **state) {
  (void)state;
  const char *const isas[4] = {"plain", "avx2", "avx512", "avx512_whole"};
  double worst = 0.0, handed = 0.0;
  for (int dim = 2; dim <= 3; dim++) {
    RvePacking packing = help_random(dim, dim == 2 ? 9 : 5, dim == 2 ? 2e4 : 1e5, 60);
    for (int which = 0; which < VARIANTS; which++)
      for (int k = 0; k < 4; k++) {
        const RveScene scene = variant(which, dim);
        compare_sets(isas[k], &scene, &packing, &worst, &handed);
      }
    rve_packing_destroy(&packing);
  }
  help_report("difference between instruction sets after a short run", worst);
  help_report("difference after a state moved between them", handed);
  assert_true(worst <= 1e-9); /* round-off of overlaps (1e-13) grown over tens of colliding steps */
  assert_true(handed <= 1e-9);
}

/* A packing that leaves a batch with its history and enters another continues the same way. */
static void packings_carry_history(void **state) {
  (void)state;
  for (int dim = 2; dim <= 3; dim++) {
    RvePacking packing = help_random(dim, dim == 2 ? 9 : 5, dim == 2 ? 2e4 : 1e5, 70), exported;
    RveScene scene = help_scene(dim);
    double gradient[9] = {0.0};
    gradient[1] = 2.0;
    scene.tangential_stiffness = 8e5;
    RveBatch *batch = help_batch(&scene, &packing);
    const RveAnswer answer = help_step(batch, gradient, 0.0, 5e-3);
    MUST(rve_batch_packing(batch, 0, &exported));
    RveBatch *other = help_batch(&scene, &exported);
    const RveAnswer again = help_step(other, NULL, 0.0, 0.0);
    assert_true(help_difference(6, again.stress, answer.stress) < 1e-12); /* positions rounded to 53 bits of a cell */
    assert_true(again.coordination == answer.coordination);
    assert_true(fabs(again.elastic_energy / answer.elastic_energy - 1.0) < 1e-12);
    rve_batch_destroy(batch);
    rve_batch_destroy(other);
    rve_packing_destroy(&packing);
    rve_packing_destroy(&exported);
  }
}

/* ------------------------------------------------------------------------------------------------------- refusals */

static void refuse(RveScene scene, const char *name) {
  assert_int_equal(rve_scene_check(&scene), BASE_ERROR_ARGUMENT);
  if (!strstr(base_error_message(), name)) fail_msg("\"%s\" does not name %s", base_error_message(), name);
}

#define REFUSE(entry, value)                                                                                           \
  do {                                                                                                                 \
    RveScene wrong = good;                                                                                             \
    wrong.entry = (value);                                                                                             \
    refuse(wrong, #entry);                                                                                             \
  } while (0)

static void wrong_scenes_are_refused_by_name(void **state) {
  (void)state;
  RveScene good = frictional(2);
  good.bonds = 1;
  good.bond_strength = 1e-3;
  MUST(rve_scene_check(&good));
  REFUSE(dimension, 1);
  REFUSE(grain, (RveGrain)7);
  REFUSE(thickness, 0.0);
  REFUSE(thickness, NAN);
  REFUSE(density, -1.0);
  REFUSE(normal_stiffness, INFINITY);
  REFUSE(tangential_stiffness, -1.0);
  REFUSE(friction, NAN);
  REFUSE(normal_viscosity, -1.0);
  REFUSE(tangential_viscosity, NAN);
  REFUSE(critical_damping, -0.1);
  REFUSE(local_damping, 1.0);
  REFUSE(rotation, 2);
  REFUSE(thermal, -1);
  REFUSE(expansion, NAN);
  REFUSE(reference_temperature, INFINITY);
  REFUSE(pipe_resistance, 0.0);
  REFUSE(bonds, 3);
  REFUSE(bond_strength, -1.0);
  REFUSE(bond_shear_ratio, NAN);
  REFUSE(bond_melting_temperature, -5.0);
  REFUSE(time_step, -1e-6);
  REFUSE(time_step_fraction, 0.0);
  REFUSE(substeps, -1);
  REFUSE(skin, 2.0);
  REFUSE(threads, -1);
  RveScene solid = help_scene(3);
  solid.grain = RVE_DISK;
  refuse(solid, "grain");
  RveScene none = rve_scene_default();
  refuse(none, "thickness");
}

static void wrong_calls_are_refused(void **state) {
  (void)state;
  RvePacking packing = help_crystal(HELP_SQUARE, 2, 5e-3, 0.01);
  RveScene scene = help_scene(2), other = scene;
  RveBatch *batch = help_batch(&scene, &packing), *none;
  RveInput input = {{0.0}, 0.0};
  RveAnswer answer;
  const int outside = 1, wrong_packing = 1;
  assert_int_equal(rve_batch_step(batch, 2, NULL, &input, 1e-4, &answer), BASE_ERROR_ARGUMENT);
  assert_int_equal(rve_batch_step(batch, 1, &outside, &input, 1e-4, &answer), BASE_ERROR_ARGUMENT);
  assert_int_equal(rve_batch_step(batch, 1, NULL, &input, -1.0, &answer), BASE_ERROR_ARGUMENT);
  assert_int_equal(rve_batch_step(batch, 1, NULL, &input, 1e30, &answer), BASE_ERROR_ARGUMENT);
  input.velocity_gradient[4] = NAN;
  assert_int_equal(rve_batch_step(batch, 1, NULL, &input, 1e-4, &answer), BASE_ERROR_ARGUMENT);
  assert_int_equal(rve_batch_install_bonds(batch, 0, NULL), BASE_ERROR_ARGUMENT);
  other.dimension = 3, other.grain = RVE_SPHERE;
  assert_int_equal(rve_batch_set_scene(batch, &other), BASE_ERROR_ARGUMENT);
  assert_int_equal(rve_batch_create(&other, &packing, 1, NULL, 1, help_backend(), &none), BASE_ERROR_ARGUMENT);
  assert_null(none);
  assert_int_equal(rve_batch_create(&scene, &packing, 1, NULL, 0, help_backend(), &none), BASE_ERROR_ARGUMENT);
  assert_int_equal(rve_batch_create(&scene, &packing, 1, &wrong_packing, 1, help_backend(), &none),
                   BASE_ERROR_ARGUMENT);
  rve_batch_destroy(NULL);
  rve_batch_destroy(batch);
  rve_packing_destroy(&packing);
}

static void wrong_packings_are_refused(void **state) {
  (void)state;
  const RveScene scene = help_scene(2);
  const double wrong[4] = {NAN, 0.0, -5e-3, 9e-3 /* overlaps by 44 % */};
  for (int k = 0; k < 4; k++) {
    RvePacking packing = help_crystal(HELP_SQUARE, 3, 5e-3, 0.01);
    RveBatch *batch;
    packing.radius[4] = wrong[k];
    assert_int_equal(rve_batch_create(&scene, &packing, 1, NULL, 1, help_backend(), &batch), BASE_ERROR_ARGUMENT);
    assert_null(batch);
    rve_packing_destroy(&packing);
  }
  RvePacking packing = help_crystal(HELP_SQUARE, 3, 5e-3, 0.01);
  RveBatch *batch;
  packing.position[3] = NAN;
  assert_int_equal(rve_batch_create(&scene, &packing, 1, NULL, 1, help_backend(), &batch), BASE_ERROR_ARGUMENT);
  packing.position[3] = 0.0;
  packing.cell[0] = 0.0;
  assert_int_equal(rve_batch_create(&scene, &packing, 1, NULL, 1, help_backend(), &batch), BASE_ERROR_ARGUMENT);
  rve_packing_destroy(&packing);
}

static void cuda_is_chosen_or_refused_with_its_name(void **state) {
  (void)state;
  RvePacking packing = help_crystal(HELP_SQUARE, 3, 5e-3, 0.01);
  const RveScene scene = help_scene(2);
  RveBatch *batch;
  MUST(rve_batch_create(&scene, &packing, 1, NULL, 1, RVE_BACKEND_AUTO, &batch));
  const int has_device = strcmp(rve_batch_backend_name(batch), "cuda") == 0;
  rve_batch_destroy(batch);
  const BaseStatus status = rve_batch_create(&scene, &packing, 1, NULL, 1, RVE_BACKEND_CUDA, &batch);
  assert_int_equal(status, has_device ? BASE_OK : BASE_ERROR_DEVICE);
  if (!has_device) assert_non_null(strstr(base_error_message(), "cuda"));
  if (has_device) rve_batch_destroy(batch);
  rve_packing_destroy(&packing);
}

/* Twins are computed once, and it cannot be seen: not in the answers, not in the states, not after they part. */
static void twins_are_computed_once(void **state) {
  (void)state;
  enum { COUNT = 6 };
  RvePacking packings[2] = {help_random(2, 6, 1e5, 4), help_random(2, 7, 1e5, 5)};
  const int packing_of[COUNT] = {0, 1, 0, 0, 1, 0};
  RveBatch *batch[2];
  RveScene scene = help_scene(2);
  scene.tangential_stiffness = 1e6;
  scene.bonds = 1, scene.bond_strength = 1e-4;
  for (int share = 0; share < 2; share++) {
    scene.share = share;
    MUST(rve_batch_create(&scene, packings, 2, packing_of, COUNT, help_backend(), &batch[share]));
  }
  for (int call = 0; call < 12; call++) {
    RveAnswer answer[2][COUNT];
    RveInput input[COUNT];
    const int some[3] = {0, 2, 5}, all = call != 8;
    memset(input, 0, sizeof input);
    for (int k = 0; k < COUNT; k++) {
      input[k].velocity_gradient[0] = -1.0;
      if (call >= 4 && k == 3) input[k].velocity_gradient[1] = 0.5; /* one parts from its twins */
    }
    for (int share = 0; share < 2; share++) {
      if (call == 6) MUST(rve_batch_install_bonds(batch[share], 2, some));
      MUST(rve_batch_step(batch[share], all ? COUNT : 3, all ? NULL : some, input, 1e-4, answer[share]));
    }
    assert_memory_equal(answer[0], answer[1], (all ? COUNT : 3) * sizeof answer[0][0]);
  }
  for (int k = 0; k < COUNT; k++) {
    unsigned char *bytes[2];
    size_t written[2];
    for (int share = 0; share < 2; share++) {
      MUST(BASE_ALLOC(rve_batch_state_bytes(batch[share], k), &bytes[share]));
      MUST(rve_batch_pack(batch[share], k, bytes[share], &written[share]));
    }
    assert_int_equal(written[0], written[1]);
    assert_memory_equal(bytes[0], bytes[1], written[0]);
    for (int share = 0; share < 2; share++) base_free(bytes[share]);
  }
  /* packing 1: always one of two; packing 0: three of four in calls 0-3, two in 4 and 5; then bonds make singles of 0 and 2 */
  assert_int_equal(rve_batch_shared(batch[0]), 0);
  const int copied = 4 * (1 + 3) + 2 * (1 + 2) + 5 * 1;
  assert_int_equal(rve_batch_shared(batch[1]), help_backend() == RVE_BACKEND_CPU ? copied : 0);
  for (int share = 0; share < 2; share++) rve_batch_destroy(batch[share]), rve_packing_destroy(&packings[share]);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(answers_do_not_depend_on_threads_batches_or_order),
      cmocka_unit_test(a_restored_rve_continues_bit_for_bit),
      cmocka_unit_test(altered_truncated_and_foreign_states_are_refused),
      cmocka_unit_test(instruction_sets_agree_and_take_over_from_each_other),
      cmocka_unit_test(packings_carry_history),
      cmocka_unit_test(wrong_scenes_are_refused_by_name),
      cmocka_unit_test(wrong_calls_are_refused),
      cmocka_unit_test(wrong_packings_are_refused),
      cmocka_unit_test(cuda_is_chosen_or_refused_with_its_name),
      cmocka_unit_test(twins_are_computed_once),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
