/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The device beside the CPU: same packings, same calls. Without a device (a real one, or its source on the host:
 * tests/cuda_host) there is nothing to compare, and the tests say so. */
#include "rve_help.h"

#include "device_help.h"

enum { SIZES = 3, RVES = 5, CALLS = 3 };
typedef enum Physics { FRICTIONLESS, FRICTION, DASHPOTS, BONDS, PHYSICS } Physics;

static RveScene scene_of(int dimension, Physics physics) {
  RveScene scene = help_scene(dimension);
  help_heat(&scene);
  if (physics >= FRICTION) scene.tangential_stiffness = 8e5;
  if (physics == FRICTION) scene.local_damping = 0.2;
  if (physics == DASHPOTS) scene.critical_damping = 0.2;
  if (physics == BONDS) scene.bonds = 1, scene.bond_strength = 1e-2, scene.bond_shear_ratio = 0.5, scene.bond_melting_temperature = 200.0;
  return scene;
}

/* Packings of several sizes, so that RVEs have one to three warps. */
static void make_packings(int dimension, RvePacking packing[SIZES]) {
  const int per_side[2][SIZES] = {{5, 7, 9}, {3, 4, 4}};
  for (int k = 0; k < SIZES; k++)
    packing[k] = help_random(dimension, per_side[dimension - 2][k], dimension == 2 ? 2e4 : 1e5, 70 + (uint64_t)k);
}

static RveBatch *make_batch(const RveScene *scene, const RvePacking packing[SIZES], RveBackend backend) {
  const int which[RVES] = {2, 0, 1, 0, 2};
  RveBatch *batch;
  MUST(rve_batch_create(scene, packing, SIZES, which, RVES, backend, &batch));
  if (scene->bonds) MUST(rve_batch_install_bonds(batch, 0, NULL));
  return batch;
}

/* A shear that turns round, with compression and heating; every RVE another. */
static void run_calls(RveBatch *batch, const RveScene *scene, int first, int calls, RveAnswer answer[RVES]) {
  for (int call = first; call < first + calls; call++) {
    RveInput input[RVES];
    memset(input, 0, sizeof input);
    for (int k = 0; k < RVES; k++) {
      double *rate = input[k].velocity_gradient;
      rate[1] = (call % 2 ? -30.0 : 60.0) + k, rate[0] = -5.0 * k, rate[3] = 4.0;
      if (scene->dimension == 3) rate[5] = 20.0, rate[8] = -3.0;
      input[k].temperature = 25.0 * call + k;
    }
    MUST(rve_batch_step(batch, RVES, NULL, input, 4e-4, answer));
  }
}

/* Largest deviation of the answers, over the largest entry of their kind. */
static double deviation(const double *a, const double *b, int n) {
  double size = 0.0, apart = 0.0;
  for (int m = 0; m < n; m++) size = fmax(size, fabs(b[m])), apart = fmax(apart, fabs(a[m] - b[m]));
  return size > 0.0 ? apart / size : apart;
}

static double difference(const RveAnswer *a, const RveAnswer *b) {
  double worst = 0.0;
  worst = fmax(worst, deviation(a->stress, b->stress, 6));
  worst = fmax(worst, deviation(a->conductivity, b->conductivity, 6));
  worst = fmax(worst, deviation(a->fabric, b->fabric, 6));
  worst = fmax(worst, deviation(&a->friction_work, &b->friction_work, 1));
  worst = fmax(worst, deviation(&a->damping_work, &b->damping_work, 1));
  worst = fmax(worst, deviation(&a->kinetic_energy, &b->kinetic_energy, 1));
  worst = fmax(worst, deviation(&a->elastic_energy, &b->elastic_energy, 1));
  worst = fmax(worst, deviation(&a->modulus, &b->modulus, 1));
  worst = fmax(worst, deviation(&a->solid_fraction, &b->solid_fraction, 1));
  assert_float_equal(a->coordination, b->coordination, 1e-12);
  assert_float_equal(a->bond_fraction, b->bond_fraction, 1e-12);
  assert_true(a->steps == b->steps && a->status == b->status);
  return worst;
}

static void the_device_answers_as_the_cpu_does(void **state) {
  (void)state;
  NEED_A_DEVICE();
  for (int dimension = 2; dimension <= 3; dimension++) {
    RvePacking packing[SIZES];
    make_packings(dimension, packing);
    for (Physics physics = FRICTIONLESS; physics < PHYSICS; physics++) {
      const RveScene scene = scene_of(dimension, physics);
      RveBatch *here = make_batch(&scene, packing, RVE_BACKEND_CPU), *there = make_batch(&scene, packing, RVE_BACKEND_CUDA);
      RveAnswer expected[RVES], found[RVES];
      double worst = 0.0;
      run_calls(here, &scene, 0, CALLS, expected);
      run_calls(there, &scene, 0, CALLS, found);
      for (int k = 0; k < RVES; k++) worst = fmax(worst, difference(&found[k], &expected[k]));
      print_message("           %dD, physics %d: %d steps, largest deviation %.1e, bonds %.2f\n", dimension, (int)physics,
                    (int)found[0].steps, worst, found[0].bond_fraction);
      assert_true(found[0].steps > 20 && expected[0].stress[0] < 0.0);
      assert_true(physics == FRICTIONLESS || expected[0].friction_work > 0.0);
      assert_true(worst < 1e-9); /* sums in another order; collisions make more of it with every step */
      rve_batch_destroy(here);
      rve_batch_destroy(there);
    }
    for (int k = 0; k < SIZES; k++) rve_packing_destroy(&packing[k]);
  }
}

/* FNV-1a of all answers, so that two runs of this program can be compared. */
static uint64_t digest(const RveAnswer answer[RVES]) {
  uint64_t sum = 14695981039346656037u;
  for (size_t m = 0; m < RVES * sizeof *answer; m++) sum = (sum ^ ((const unsigned char *)answer)[m]) * 1099511628211u;
  return sum;
}

static uint64_t digest_of_run(int dimension, Physics physics, const RvePacking packing[SIZES], RveAnswer answer[RVES]) {
  const RveScene scene = scene_of(dimension, physics);
  RveBatch *batch = make_batch(&scene, packing, RVE_BACKEND_CUDA);
  memset(answer, 0, RVES * sizeof *answer);
  run_calls(batch, &scene, 0, CALLS, answer);
  rve_batch_destroy(batch);
  return digest(answer);
}

/* On the host settings of the stand-in can be asked for: little shared memory, little memory for lists, two devices. A device ignores
 * them. */
static void answers_do_not_depend_on_where_states_lie(void **state) {
  (void)state;
  NEED_A_DEVICE();
  for (int dimension = 2; dimension <= 3; dimension++) {
    const Physics physics = dimension == 2 ? BONDS : FRICTION;
    RveAnswer answer[RVES], by_one_warp[RVES];
    RvePacking packing[SIZES];
    make_packings(dimension, packing); /* once: with DEMPM_BACKEND=cuda the device makes them, and settings would change them */
    const uint64_t first = digest_of_run(dimension, physics, packing, answer), again = digest_of_run(dimension, physics, packing, answer);
    setenv("DEMPM_CUDA_WARPS", "1", 1); /* one for all grains of a packing; energies are summed in another order */
    digest_of_run(dimension, physics, packing, by_one_warp);
    unsetenv("DEMPM_CUDA_WARPS");
    for (int k = 0; k < RVES; k++) assert_true(difference(&by_one_warp[k], &answer[k]) < 1e-12);
    setenv("DEMPM_CUDA_HOST_SHARED", "16000", 1); /* the smallest packing fits, the others do not */
    const uint64_t outside = digest_of_run(dimension, physics, packing, answer);
    unsetenv("DEMPM_CUDA_HOST_SHARED");
    setenv("DEMPM_CUDA_HOST_MEMORY", "100000", 1); /* not enough for the lists of all RVEs at once */
    const uint64_t parts = digest_of_run(dimension, physics, packing, answer);
    unsetenv("DEMPM_CUDA_HOST_MEMORY");
    setenv("DEMPM_CUDA_HOST_DEVICES", "2", 1);
    rve_device_share(3); /* the second of two */
    const uint64_t second = digest_of_run(dimension, physics, packing, answer);
    rve_device_share(0);
    unsetenv("DEMPM_CUDA_HOST_DEVICES");
    print_message("           %dD: answers %016llx\n", dimension, (unsigned long long)first);
    assert_true(again == first);
    assert_true(outside == first);
    assert_true(parts == first);
    assert_true(second == first);
    for (int k = 0; k < SIZES; k++) rve_packing_destroy(&packing[k]);
  }
}

static void states_move_between_device_and_cpu(void **state) {
  (void)state;
  NEED_A_DEVICE();
  RvePacking packing[SIZES];
  RveAnswer stayed[RVES], moved[RVES];
  const RveScene scene = scene_of(2, DASHPOTS);
  make_packings(2, packing);
  RveBatch *here = make_batch(&scene, packing, RVE_BACKEND_CPU), *there = make_batch(&scene, packing, RVE_BACKEND_CUDA);
  run_calls(there, &scene, 0, CALLS, stayed);
  for (int k = 0; k < RVES; k++) {
    void *bytes;
    size_t written;
    MUST(base_alloc(rve_batch_state_bytes(there, k), 1, &bytes));
    MUST(rve_batch_pack(there, k, bytes, &written));
    MUST(rve_batch_unpack(here, k, bytes, written));
    base_free(bytes);
  }
  run_calls(there, &scene, CALLS, 1, stayed);
  run_calls(here, &scene, CALLS, 1, moved);
  for (int k = 0; k < RVES; k++) assert_true(difference(&moved[k], &stayed[k]) < 1e-9);
  rve_batch_destroy(here);
  rve_batch_destroy(there);
  for (int k = 0; k < SIZES; k++) rve_packing_destroy(&packing[k]);
}

/* 2D: a large grain in a ring of small ones that move slowly, and all touch it when the cell has shrunk a little. Its row of the list
 * is then longer than the room that a packing begins with. */
static RvePacking make_ring(void) {
  enum { SMALL = 24 };
  RvePacking ring = help_packing(2, SMALL + 1);
  uint64_t seed = 5;
  MUST(BASE_ALLOC(3 * (size_t)ring.grains, &ring.velocity));
  for (int k = 0; k < 2; k++) ring.cell[4 * k] = 54e-3;
  ring.radius[0] = 12e-3;
  for (int g = 1; g <= SMALL; g++) {
    const double angle = 2.0 * 3.14159265358979323846 * g / SMALL;
    ring.radius[g] = 2.155e-3;
    ring.position[3 * g] = 16.5e-3 * cos(angle) / ring.cell[0];
    ring.position[3 * g + 1] = 16.5e-3 * sin(angle) / ring.cell[4];
    for (int k = 0; k < 2; k++) ring.velocity[3 * g + k] = help_uniform(&seed, -1e-2, 1e-2);
  }
  return ring;
}

/* All RVEs alike, whatever was before. */
static void compress(RveBatch *batch, double rate, double duration, RveAnswer answer[RVES]) {
  RveInput input[RVES];
  memset(input, 0, sizeof input);
  for (int k = 0; k < RVES; k++) input[k].velocity_gradient[0] = input[k].velocity_gradient[4] = -rate;
  MUST(rve_batch_step(batch, RVES, NULL, input, duration, answer));
}

/* 2D: grains of three warps that do not touch and fly apart slowly. */
static RvePacking make_cloud(void) {
  RvePacking cloud = help_random(2, 9, 2e4, 72);
  uint64_t seed = 7;
  for (int g = 0; g < cloud.grains; g++) {
    cloud.radius[g] *= 0.9;
    for (int k = 0; k < 2; k++) cloud.velocity[3 * g + k] = help_uniform(&seed, -2e-3, 2e-3);
  }
  return cloud;
}

/* Largest distance of a grain in one batch from that in the other, in cell edges: answers do not tell places before grains meet. */
static double displacement(const RveBatch *a, const RveBatch *b, int rve) {
  RvePacking here, there;
  double worst = 0.0;
  MUST(rve_batch_packing(a, rve, &here));
  MUST(rve_batch_packing(b, rve, &there));
  for (int m = 0; m < 3 * here.grains; m++) worst = fmax(worst, fabs(here.position[m] - there.position[m]));
  rve_packing_destroy(&here);
  rve_packing_destroy(&there);
  return worst;
}

static void flights_are_those_of_the_cpu(void **state) {
  (void)state;
  NEED_A_DEVICE();
  const int which[RVES] = {0, 0, 1, 0, 1};
  RvePacking packing[2] = {make_cloud(), help_random(2, 7, 2e4, 70)};
  const RveScene scene = scene_of(2, FRICTION);
  RveBatch *here, *there;
  RveAnswer expected[RVES], found[RVES];
  MUST(rve_batch_create(&scene, packing, 2, which, RVES, RVE_BACKEND_CPU, &here));
  MUST(rve_batch_create(&scene, packing, 2, which, RVES, RVE_BACKEND_CUDA, &there));
  for (int call = 0; call < 3; call++) {
    compress(here, -5.0 * call, 1e-3, expected);
    compress(there, -5.0 * call, 1e-3, found);
    for (int k = 0; k < RVES; k++) {
      assert_true(found[k].flew == (which[k] == 0) && expected[k].flew == found[k].flew);
      assert_true(difference(&found[k], &expected[k]) < 1e-9 && displacement(here, there, k) < 1e-12);
    }
    assert_true(found[0].kinetic_energy > 0.0);
  }
  assert_true(rve_batch_flown(there) == 9);
  rve_batch_destroy(here);
  rve_batch_destroy(there);
  for (int k = 0; k < 2; k++) rve_packing_destroy(&packing[k]);
}

/* The stand-in for a device refuses every piece of memory from now on. */
static void refuse_memory(int from_now_on) {
  if (from_now_on) setenv("DEMPM_CUDA_HOST_MEMORY", "1", 1);
  else unsetenv("DEMPM_CUDA_HOST_MEMORY");
}

static void a_device_without_room_hands_a_new_batch_to_the_cpu(void **state) {
  (void)state;
  NEED_A_DEVICE_THAT_REFUSES();
  RvePacking packing[SIZES];
  RveAnswer expected[RVES], found[RVES];
  const RveScene scene = scene_of(2, BONDS);
  make_packings(2, packing);
  RveBatch *here = make_batch(&scene, packing, RVE_BACKEND_CPU);
  refuse_memory(1);
  RveBatch *there = make_batch(&scene, packing, RVE_BACKEND_CUDA);
  refuse_memory(0);
  assert_false(rve_batch_is_on_device(there));
  assert_string_equal(rve_batch_backend_name(there), rve_batch_backend_name(here));
  run_calls(here, &scene, 0, CALLS, expected);
  run_calls(there, &scene, 0, CALLS, found);
  for (int k = 0; k < RVES; k++) assert_true(difference(&found[k], &expected[k]) < 1e-9);
  rve_batch_destroy(here);
  rve_batch_destroy(there);
  for (int k = 0; k < SIZES; k++) rve_packing_destroy(&packing[k]);
}

/* In the middle of a call, when a list has outgrown its room: that of the ring, which bonds hold together while it is squeezed; the
 * other packings have finished the call then. Afterwards those of one packing get the same input, and must not be taken for twins. */
static void a_device_that_becomes_too_small_hands_over_to_the_cpu(void **state) {
  (void)state;
  NEED_A_DEVICE_THAT_REFUSES();
  const int which[RVES] = {0, 1, 0, 0, 1};
  RvePacking packing[2] = {make_ring(), help_random(2, 7, 2e4, 70)};
  RveBatch *here, *there;
  RveScene scene = scene_of(2, BONDS);
  scene.bond_strength = 1.0;
  RveAnswer expected[RVES], found[RVES];
  MUST(rve_batch_create(&scene, packing, 2, which, RVES, RVE_BACKEND_CPU, &here));
  MUST(rve_batch_create(&scene, packing, 2, which, RVES, RVE_BACKEND_CUDA, &there));
  MUST(rve_batch_install_bonds(here, 0, NULL));
  MUST(rve_batch_install_bonds(there, 0, NULL));
  run_calls(here, &scene, 0, 1, expected);
  run_calls(there, &scene, 0, 1, found);
  assert_true(rve_batch_is_on_device(there));
  refuse_memory(1);
  compress(here, 40.0, 5e-3, expected);
  compress(there, 40.0, 5e-3, found);
  refuse_memory(0);
  assert_false(rve_batch_is_on_device(there));
  for (int k = 0; k < RVES; k++) {
    assert_true(difference(&found[k], &expected[k]) < 1e-9);
    assert_true(expected[k].coordination > 1.5 && expected[k].bond_fraction > 0.0);
  }
  compress(here, 1.0, 1e-4, expected);
  compress(there, 1.0, 1e-4, found);
  for (int k = 0; k < RVES; k++) assert_true(difference(&found[k], &expected[k]) < 1e-9);
  assert_true(difference(&found[1], &found[4]) > 1e-3);
  rve_batch_destroy(here);
  rve_batch_destroy(there);
  for (int k = 0; k < 2; k++) rve_packing_destroy(&packing[k]);
}

/* With bonds and heat, as the states lie on the device between two calls. */
static void a_batch_can_leave_the_device(void **state) {
  (void)state;
  NEED_A_DEVICE();
  for (int dimension = 2; dimension <= 3; dimension++) {
    RvePacking packing[SIZES];
    RveAnswer stayed[RVES], left[RVES];
    const RveScene scene = scene_of(dimension, BONDS);
    make_packings(dimension, packing);
    RveBatch *batch[2] = {make_batch(&scene, packing, RVE_BACKEND_CUDA), make_batch(&scene, packing, RVE_BACKEND_CUDA)};
    run_calls(batch[0], &scene, 0, CALLS, stayed);
    run_calls(batch[1], &scene, 0, CALLS, left);
    MUST(rve_batch_leave_device(batch[1]));
    run_calls(batch[0], &scene, CALLS, 1, stayed);
    run_calls(batch[1], &scene, CALLS, 1, left);
    assert_true(rve_batch_is_on_device(batch[0]) && !rve_batch_is_on_device(batch[1]));
    for (int k = 0; k < RVES; k++) assert_true(difference(&left[k], &stayed[k]) < 1e-9);
    for (int b = 0; b < 2; b++) rve_batch_destroy(batch[b]);
    for (int k = 0; k < SIZES; k++) rve_packing_destroy(&packing[k]);
  }
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(the_device_answers_as_the_cpu_does),
      cmocka_unit_test(answers_do_not_depend_on_where_states_lie),
      cmocka_unit_test(states_move_between_device_and_cpu),
      cmocka_unit_test(flights_are_those_of_the_cpu),
      cmocka_unit_test(a_device_without_room_hands_a_new_batch_to_the_cpu),
      cmocka_unit_test(a_device_that_becomes_too_small_hands_over_to_the_cpu),
      cmocka_unit_test(a_batch_can_leave_the_device),
  };
  return cmocka_run_group_tests_name("device", tests, NULL, NULL);
}
