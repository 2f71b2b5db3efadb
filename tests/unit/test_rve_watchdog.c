/* SPDX-License-Identifier: GPL-2.0-or-later */
/* What the watchdog says of a failed RVE, and replays: the failing step comes again, bit for bit. */
#include "rve_help.h"

#include <unistd.h>

#include "cuda_rve/rve_batch_private.h"

static const char *const file = "test_watchdog.replay";

/* A crystal with one moving grain and a time step thrice the critical one. */
static RvePacking shaken(RveScene *scene) {
  RvePacking packing = help_crystal(HELP_SQUARE, 4, 5e-3, 0.01);
  MUST(BASE_ALLOC(3 * (size_t)packing.grains, &packing.velocity));
  packing.velocity[0] = packing.velocity[4] = 0.1;
  *scene = help_scene(2);
  scene->time_step = 3.0 * rve_critical_time_step(scene, &packing);
  return packing;
}

static RveBatch *batch_of(const RveScene *scene, const RvePacking *packing, int count) {
  RveBatch *batch;
  MUST(rve_batch_create(scene, packing, 1, NULL, count, help_backend(), &batch));
  return batch;
}

/* Steps RVE `rve` alone in calls of `steps` DEM steps until it fails; returns the number of calls. */
static int run_until_failure(RveBatch *batch, int rve, int steps) {
  RveInput input;
  RveAnswer answer;
  memset(&input, 0, sizeof input);
  input.velocity_gradient[0] = -0.1;
  for (int calls = 1; calls < 1000; calls++) {
    const BaseStatus status = rve_batch_step(batch, 1, &rve, &input, steps * rve_batch_scene(batch)->time_step, &answer);
    if (status == BASE_ERROR_UNSTABLE) return calls;
    MUST(status);
  }
  fail_msg("it does not fail");
  return 0;
}

static void a_runaway_grain_is_named_with_step_and_cause(void **state) {
  (void)state;
  RveScene scene;
  RveFailure failure;
  char text[96];
  RvePacking packing = shaken(&scene);
  RveBatch *batch = batch_of(&scene, &packing, 3);
  assert_int_equal(rve_batch_failure(batch, 1, &failure), BASE_ERROR_ARGUMENT);
  assert_int_equal(rve_batch_failure(batch, 3, &failure), BASE_ERROR_ARGUMENT);
  const int calls = run_until_failure(batch, 1, 7);
  MUST(rve_batch_failure(batch, 1, &failure));
  assert_true(failure.step > 7 * (calls - 1) && failure.step <= 7 * calls);
  assert_true(failure.call_steps == 7 && failure.step == 7 * (calls - 1) + failure.call_step);
  assert_non_null(strstr(failure.cause, "moves"));
  assert_non_null(strstr(failure.cause, "kinetic energy"));
  run_until_failure(batch, 1, 7); /* says it again */
  snprintf(text, sizeof text, "RVE 1 is unstable at DEM step %lld (%lld of 7 of its call): grain ",
           (long long)failure.step, (long long)failure.call_step);
  assert_non_null(strstr(base_error_message(), text));
  assert_int_equal(rve_batch_failure(batch, 0, &failure), BASE_ERROR_ARGUMENT);
  assert_int_equal(rve_batch_write_replay(batch, 1, NULL, file), BASE_ERROR_ARGUMENT); /* nobody asked for states */
  assert_non_null(strstr(base_error_message(), "no state was kept"));
  assert_true(access(file, F_OK) != 0);
  rve_batch_destroy(batch);
  rve_packing_destroy(&packing);
}

static void a_velocity_that_is_not_finite_is_named(void **state) {
  (void)state;
  RveScene scene;
  RveBatch *batch;
  RvePacking packing = shaken(&scene);
  packing.velocity[3 * 5] = 1e200; /* its square is infinite */
  assert_int_equal(rve_batch_create(&scene, &packing, 1, NULL, 2, help_backend(), &batch), BASE_ERROR_ARGUMENT);
  assert_non_null(strstr(base_error_message(), "RVE 0: the velocity or spin of grain 6 is not finite"));
  rve_packing_destroy(&packing);
}

static void a_cell_that_closes_is_named(void **state) {
  (void)state;
  RvePacking packing = help_crystal(HELP_SQUARE, 4, 5e-3, 0.01);
  RveScene scene = help_scene(2);
  RveInput input = {{-3000.0}, 0.0};
  RveAnswer answer;
  RveBatch *batch = batch_of(&scene, &packing, 1);
  assert_int_equal(rve_batch_step(batch, 1, NULL, &input, 0.01, &answer), BASE_ERROR_UNSTABLE);
  assert_non_null(strstr(base_error_message(), "the cell is too narrow for its grains"));
  rve_batch_destroy(batch);
  rve_packing_destroy(&packing);
}

/* steps per call: states of short calls are kept because of the time step, those of long ones always. */
static void replay_repeats(int steps) {
  RveScene scene;
  RveFailure failure, again;
  RveReplay replay;
  RveAnswer answer;
  RvePacking packing = shaken(&scene);
  if (steps > 50) scene.time_step *= 1.001 / 3.0, scene.time_step *= 1.2;
  scene.tangential_stiffness = 5e5;
  RveBatch *batch = batch_of(&scene, &packing, 2), *fresh;
  rve_batch_keep_states(batch, 1);
  run_until_failure(batch, 1, steps);
  MUST(rve_batch_failure(batch, 1, &failure));
  MUST(rve_batch_write_replay(batch, 1, "the second", file));
  MUST(rve_replay_read(file, &replay));
  assert_string_equal(replay.name, "the second");
  assert_string_equal(replay.failure.cause, failure.cause);
  MUST(rve_replay_start(&replay, &replay.scene, &fresh));
  assert_int_equal(rve_batch_step(fresh, 1, NULL, &replay.input, replay.duration, &answer), BASE_ERROR_UNSTABLE);
  MUST(rve_batch_failure(fresh, 0, &again));
  assert_memory_equal(&again, &failure, sizeof again); /* figures of the cause included */
  /* The failed states are the same bytes. */
  const size_t bytes = rve_batch_state_bytes(batch, 1);
  size_t one, two;
  char *a, *b;
  assert_true(bytes == rve_batch_state_bytes(fresh, 0));
  MUST(base_alloc(bytes, 1, (void **)&a));
  MUST(base_alloc(bytes, 1, (void **)&b));
  MUST(rve_batch_pack(batch, 1, a, &one));
  MUST(rve_batch_pack(fresh, 0, b, &two));
  assert_true(one == two && memcmp(a, b, one) == 0);
  base_free(a), base_free(b);
  rve_batch_destroy(fresh);
  rve_replay_destroy(&replay);
  rve_batch_destroy(batch);
  rve_packing_destroy(&packing);
  unlink(file);
}

static void a_replay_repeats_the_failure_bit_for_bit(void **state) {
  (void)state;
  if (help_backend() != RVE_BACKEND_CPU) skip(); /* a device keeps no states from before failures */
  replay_repeats(5);
  replay_repeats(400);
}

/* Is the state kept before a call of so many steps of so much of the critical step, in which a crystal's grain moves by `moved` of its
 * radius per step, the cell strains by `strain`, and temperature changes by `heat`? */
static int is_kept(int steps, double share, double moved, double strain, double heat) {
  RvePacking packing = help_crystal(HELP_SQUARE, 4, 5e-3, 0.01);
  RveScene scene = help_scene(2);
  RveInput input;
  RveCall call;
  help_heat(&scene);
  scene.expansion = 1e-4;
  scene.time_step = share * rve_critical_time_step(&scene, &packing);
  MUST(BASE_ALLOC(3 * (size_t)packing.grains, &packing.velocity));
  packing.velocity[0] = moved * packing.radius[0] / scene.time_step;
  RveBatch *batch;
  MUST(rve_batch_create(&scene, &packing, 1, NULL, 1, RVE_BACKEND_CPU, &batch));
  const double duration = steps * scene.time_step;
  memset(&input, 0, sizeof input);
  input.velocity_gradient[0] = strain / duration;
  input.temperature = rve_head(batch->record[0].arena)->temperature + heat;
  MUST(rve_call_make(&scene, rve_head(batch->record[0].arena), &input, duration, &call));
  assert_int_equal(call.steps, steps);
  const int kept = rve_may_fail(batch, &batch->record[0], &call);
  rve_batch_destroy(batch);
  rve_packing_destroy(&packing);
  return kept;
}

static void states_are_kept_before_calls_that_may_fail(void **state) {
  (void)state;
  assert_false(is_kept(10, 0.5, 0.008, 5e-4, 5.0));
  assert_true(is_kept(10, 0.5, 0.012, 5e-4, 5.0));
  assert_true(is_kept(10, 0.5, 0.008, 2e-3, 5.0));
  assert_true(is_kept(10, 0.5, 0.008, 5e-4, 20.0));
  assert_true(is_kept(10, 0.95, 0.0, 0.0, 0.0));
  assert_true(is_kept(100, 0.5, 0.0, 0.0, 0.0));
}

static void keeping_states_changes_no_answer(void **state) {
  (void)state;
  RvePacking packing = help_random(2, 8, 2e4, 3);
  RveScene scene = help_scene(2);
  scene.tangential_stiffness = 8e5;
  const double shear[9] = {0.0, 2.0};
  RveBatch *plain = batch_of(&scene, &packing, 1), *kept = batch_of(&scene, &packing, 1);
  rve_batch_keep_states(kept, 1);
  for (int k = 0; k < 20; k++) {
    const RveAnswer a = help_step(plain, shear, 0.0, 1e-3), b = help_step(kept, shear, 0.0, 1e-3);
    assert_memory_equal(&a, &b, sizeof a);
  }
  rve_batch_destroy(plain);
  rve_batch_destroy(kept);
  rve_packing_destroy(&packing);
}

static void an_unpacked_state_forgets_the_failure(void **state) {
  (void)state;
  RveScene scene;
  RveFailure failure;
  RvePacking packing = shaken(&scene);
  RveBatch *batch = batch_of(&scene, &packing, 1);
  char *bytes;
  size_t size;
  MUST(base_alloc(rve_batch_state_bytes(batch, 0), 1, (void **)&bytes));
  MUST(rve_batch_pack(batch, 0, bytes, &size));
  const int calls = run_until_failure(batch, 0, 3);
  MUST(rve_batch_unpack(batch, 0, bytes, size));
  assert_int_equal(rve_batch_failure(batch, 0, &failure), BASE_ERROR_ARGUMENT);
  assert_int_equal(run_until_failure(batch, 0, 3), calls);
  base_free(bytes);
  rve_batch_destroy(batch);
  rve_packing_destroy(&packing);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(a_runaway_grain_is_named_with_step_and_cause),
      cmocka_unit_test(a_velocity_that_is_not_finite_is_named),
      cmocka_unit_test(a_cell_that_closes_is_named),
      cmocka_unit_test(a_replay_repeats_the_failure_bit_for_bit),
      cmocka_unit_test(states_are_kept_before_calls_that_may_fail),
      cmocka_unit_test(keeping_states_changes_no_answer),
      cmocka_unit_test(an_unpacked_state_forgets_the_failure),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
