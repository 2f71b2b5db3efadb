/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The RVE farm: whatever the ranks, the ownership of points and the history of RVEs coming and going, answers are
 * those of one serial RveBatch, bit for bit. */
#include "farm_help.h"

static void answers_are_those_of_one_serial_batch_while_points_migrate(void **state) {
  (void)state;
  const RveScene scene = make_scene();
  static double expected[TAGS * ANSWER], found[TAGS * ANSWER];
  int alive[TAGS];
  Truth truth;
  RveLaw *law;
  RveScene threaded = scene;
  threaded.threads = 2;
  all_alive(alive);
  CHECK_ALL(truth_create(&scene, &truth) == BASE_OK);
  CHECK_ALL(rve_law_create(MPI_COMM_WORLD, &threaded, packing, PACKINGS, help_backend(), &law) == BASE_OK);
  CHECK_ALL(rve_law_threads(law) == 2 && assign_alive(law, alive) == BASE_OK);
  for (int step = 0; step < 10; step++) {
    const double dt = step % 4 == 0 ? 0.0 : time_step; /* 0: the present state is asked */
    CHECK_ALL(truth_step(&truth, alive, step, dt, expected) == BASE_OK);
    CHECK_ALL(law_step(law, MPI_COMM_WORLD, alive, step, dt, 0, found) == BASE_OK);
    CHECK_ALL(same_answers(expected, found, alive));
  }
  /* The packing is loaded and slides, or the comparison would be an empty one. */
  CHECK_ALL(expected[0] < 0 && expected[14 + MPM_LAW_DISSIPATION] > 0 && expected[13] > 0);
  rve_law_destroy(law);
  rve_batch_destroy(truth.batch);
}

static void new_tags_and_gone_tags_leave_the_others_alone(void **state) {
  (void)state;
  const RveScene scene = make_scene();
  static double expected[TAGS * ANSWER], found[TAGS * ANSWER];
  int alive[TAGS] = {0}, next = 4;
  Truth truth;
  RveLaw *law;
  RveLawTotals totals;
  CHECK_ALL(truth_create(&scene, &truth) == BASE_OK);
  CHECK_ALL(rve_law_create(MPI_COMM_WORLD, &scene, packing, PACKINGS, help_backend(), &law) == BASE_OK);
  for (int k = 0; k < next; k++) alive[k] = 1;
  /* One tag more per step, which nobody announces, often enough that batches must be merged; every third step one
   * goes. */
  for (int step = 0; next < TAGS; step++) {
    int living = 0;
    alive[next++] = 1;
    if (step % 3 == 2) {
      alive[step] = 0;
      CHECK_ALL(assign_alive(law, alive) == BASE_OK);
    }
    CHECK_ALL(truth_step(&truth, alive, step, time_step, expected) == BASE_OK);
    CHECK_ALL(law_step(law, MPI_COMM_WORLD, alive, step, time_step, 0, found) == BASE_OK);
    CHECK_ALL(same_answers(expected, found, alive));
    CHECK_ALL(rve_law_totals(law, &totals) == BASE_OK);
    for (int k = 0; k < TAGS; k++) living += alive[k];
    CHECK_ALL(totals.rves == living && totals.rves_run == living);
  }
  rve_law_destroy(law);
  rve_batch_destroy(truth.batch);
}

static void a_tag_that_comes_back_starts_from_its_packing(void **state) {
  (void)state;
  const RveScene scene = make_scene();
  static double first[TAGS * ANSWER], again[TAGS * ANSWER];
  int alive[TAGS];
  RveLaw *law;
  all_alive(alive);
  CHECK_ALL(rve_law_create(MPI_COMM_WORLD, &scene, packing, PACKINGS, help_backend(), &law) == BASE_OK);
  CHECK_ALL(law_step(law, MPI_COMM_WORLD, alive, 1, time_step, 0, first) == BASE_OK);
  CHECK_ALL(rve_law_assign(law, 0, NULL) == BASE_OK);
  CHECK_ALL(law_step(law, MPI_COMM_WORLD, alive, 1, time_step, 0, again) == BASE_OK);
  CHECK_ALL(same_answers(first, again, alive));
  rve_law_destroy(law);
}

static void an_unstable_rve_is_reported_alike_on_all_ranks(void **state) {
  (void)state;
  static double answers[TAGS * ANSWER];
  int alive[TAGS];
  RveLaw *law;
  all_alive(alive);
  for (int64_t spoil = 1; spoil <= TAGS; spoil += 9) {
    char text[64];
    CHECK_ALL(run_law(MPI_COMM_WORLD, 1, &law, answers) == BASE_OK);
    /* Once the input is bad, once it is only far too large: the RVE itself gives up. */
    spoilt = spoil % 2 ? NAN : 1e12;
    CHECK_ALL(law_step(law, MPI_COMM_WORLD, alive, 1, time_step, spoil, answers) == BASE_ERROR_UNSTABLE);
    const char *what = spoil % 2 ? ": its velocity gradient" : " is unstable";
    snprintf(text, sizeof text, "material point %d%s", (int)spoil, what);
    CHECK_ALL(strstr(base_error_message(), text) != NULL);
    CHECK_ALL(mpi_test_same(base_hash(base_error_message(), strlen(base_error_message()), BASE_HASH_SEED)));
    rve_law_destroy(law);
  }
}

static void wrong_tags_and_volumes_are_refused_on_all_ranks(void **state) {
  (void)state;
  static double answers[TAGS * ANSWER];
  const int last = mpi_test_rank() == mpi_test_ranks() - 1;
  const int64_t zero = 0, twice[2] = {5, 5};
  const double volume = -1;
  int alive[TAGS];
  RveLaw *law;
  RveView view;
  all_alive(alive);
  CHECK_ALL(run_law(MPI_COMM_WORLD, 1, &law, answers) == BASE_OK);
  CHECK_ALL(rve_law_assign(law, last, &zero) == BASE_ERROR_ARGUMENT);
  CHECK_ALL(strstr(base_error_message(), "tag 0") != NULL);
  CHECK_ALL(rve_law_assign(law, last ? 2 : 0, twice) == BASE_ERROR_ARGUMENT);
  CHECK_ALL(strstr(base_error_message(), "two material points have the tag 5") != NULL);
  CHECK_ALL(rve_law_set_volumes(law, last, twice, &volume) == BASE_ERROR_ARGUMENT);
  CHECK_ALL(strstr(base_error_message(), "material point 5 has the volume -1") != NULL);
  CHECK_ALL(rve_law_set_volumes(law, last ? 2 : 0, twice, (double[2]){1, 1}) == BASE_ERROR_ARGUMENT);
  CHECK_ALL(rve_law_view(law, TAGS + 1, &view) == BASE_ERROR_ARGUMENT);
  CHECK_ALL(law_step(law, MPI_COMM_WORLD, alive, 1, time_step, 0, answers) == BASE_OK); /* nothing was harmed */
  rve_law_destroy(law);
}

static void bad_scenes_and_packings_are_refused_on_all_ranks(void **state) {
  (void)state;
  RveScene scene = make_scene();
  RveLaw *law;
  CHECK_ALL(rve_law_create(MPI_COMM_WORLD, &scene, packing, 0, help_backend(), &law) == BASE_ERROR_ARGUMENT && !law);
  scene.dimension = 5;
  CHECK_ALL(rve_law_create(MPI_COMM_WORLD, &scene, packing, 1, help_backend(), &law) == BASE_ERROR_ARGUMENT && !law);
}

static void a_view_reaches_rank_0_from_any_owner(void **state) {
  (void)state;
  static double answers[TAGS * ANSWER];
  int alive[TAGS];
  RveLaw *law;
  Truth truth;
  const RveScene scene = make_scene();
  all_alive(alive);
  CHECK_ALL(truth_create(&scene, &truth) == BASE_OK);
  CHECK_ALL(run_law(MPI_COMM_WORLD, 2, &law, answers) == BASE_OK);
  CHECK_ALL(truth_step(&truth, alive, 0, time_step, answers) == BASE_OK);
  CHECK_ALL(truth_step(&truth, alive, 1, time_step, answers) == BASE_OK);
  for (int64_t tag = 1; tag <= TAGS; tag += 5) {
    RveView found, expected;
    int good = 1;
    memset(&found, 0, sizeof found);
    CHECK_ALL(rve_law_view(law, tag, &found) == BASE_OK);
    if (mpi_test_rank() == 0) {
      const size_t real = sizeof(double);
      good = rve_batch_view(truth.batch, (int)tag - 1, &expected) == BASE_OK;
      const size_t g = (size_t)expected.grains, c = (size_t)expected.contacts;
      good = good && found.grains == expected.grains && found.contacts == expected.contacts && c > 0;
      good = good && memcmp(found.cell, expected.cell, sizeof found.cell) == 0;
      good = good && memcmp(found.position, expected.position, 3 * g * real) == 0;
      good = good && memcmp(found.radius, expected.radius, g * real) == 0;
      good = good && memcmp(found.velocity, expected.velocity, 3 * g * real) == 0;
      good = good && memcmp(found.spin, expected.spin, 3 * g * real) == 0;
      good = good && memcmp(found.pair, expected.pair, 2 * c * sizeof(int)) == 0;
      good = good && memcmp(found.image, expected.image, 3 * c * sizeof(int)) == 0;
      good = good && memcmp(found.branch, expected.branch, 3 * c * real) == 0;
      good = good && memcmp(found.force_normal, expected.force_normal, c * real) == 0;
      good = good && memcmp(found.force_shear, expected.force_shear, 3 * c * real) == 0;
      good = good && memcmp(found.bond, expected.bond, c * sizeof(int)) == 0;
      rve_view_destroy(&expected);
      rve_view_destroy(&found);
    }
    CHECK_ALL(good);
  }
  rve_law_destroy(law);
  rve_batch_destroy(truth.batch);
}

static int tags_are_shared_evenly(const RveFarm *farm, int most_apart) {
  const int64_t *tags;
  int *handles, least, most;
  const int own = rve_farm_own(farm, &tags, &handles);
  MPI_Allreduce(&own, &least, 1, MPI_INT, MPI_MIN, MPI_COMM_WORLD);
  MPI_Allreduce(&own, &most, 1, MPI_INT, MPI_MAX, MPI_COMM_WORLD);
  return most - least <= most_apart;
}

static void rves_are_spread_evenly_and_stay_where_they_are(void **state) {
  (void)state;
  enum { MOST = 101 };
  int64_t tag[2 * MOST];
  int owner[2 * MOST];
  RveFarm *farm;
  CHECK_ALL(rve_farm_create(MPI_COMM_WORLD, &farm) == BASE_OK);
  /* All points on the last rank, tags with gaps, in falling order; then twice as many. */
  for (int n = 1; n <= MOST; n += 10) {
    const int mine = mpi_test_rank() == mpi_test_ranks() - 1 ? 2 * n : 0;
    int moved = 0;
    for (int k = 0; k < 2 * n; k++) tag[k] = 3 * (2 * n - k);
    CHECK_ALL(rve_farm_assign(farm, mine / 2, tag, 1) == BASE_OK);
    CHECK_ALL(rve_farm_size(farm) == n && tags_are_shared_evenly(farm, 1));
    for (int k = 0; k < n; k++) owner[k] = rve_farm_owner(farm, tag[k]);
    CHECK_ALL(rve_farm_assign(farm, mine, tag, 0) == BASE_OK);
    CHECK_ALL(rve_farm_size(farm) == 2 * n && tags_are_shared_evenly(farm, 1));
    for (int k = 0; k < n; k++) moved += owner[k] != rve_farm_owner(farm, tag[k]);
    CHECK_ALL(moved == 0 && rve_farm_owner(farm, 1) == -1);
    CHECK_ALL(rve_farm_assign(farm, 0, NULL, 1) == BASE_OK && rve_farm_size(farm) == 0);
  }
  rve_farm_destroy(farm);
}

static void ranks_share_the_cores_of_their_node(void **state) {
  (void)state;
  const int mine = rank_threads(MPI_COMM_WORLD);
  const long cores = sysconf(_SC_NPROCESSORS_CONF);
  int sum;
  MPI_Allreduce(&mine, &sum, 1, MPI_INT, MPI_SUM, MPI_COMM_WORLD);
  CHECK_ALL(mine >= 1 && (sum <= cores || sum == mpi_test_ranks()));
}

static void bulk_density_is_that_of_the_crystals(void **state) {
  (void)state;
  static double answers[TAGS * ANSWER];
  RveLaw *law;
  CHECK_ALL(run_law(MPI_COMM_WORLD, 0, &law, answers) == BASE_OK);
  /* pi R^2 / (2 R 0.99)^2 of each crystal, whatever its size. 1e-14: round-off of a few products. */
  const double expected = 2650 * 3.14159265358979323846 / (4 * 0.99 * 0.99);
  CHECK_ALL(fabs(rve_law_bulk_density(law) / expected - 1) < 1e-14);
  rve_law_destroy(law);
}

static int run(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(rves_are_spread_evenly_and_stay_where_they_are),
      cmocka_unit_test(ranks_share_the_cores_of_their_node),
      cmocka_unit_test(bulk_density_is_that_of_the_crystals),
      cmocka_unit_test(answers_are_those_of_one_serial_batch_while_points_migrate),
      cmocka_unit_test(new_tags_and_gone_tags_leave_the_others_alone),
      cmocka_unit_test(a_tag_that_comes_back_starts_from_its_packing),
      cmocka_unit_test(an_unstable_rve_is_reported_alike_on_all_ranks),
      cmocka_unit_test(wrong_tags_and_volumes_are_refused_on_all_ranks),
      cmocka_unit_test(bad_scenes_and_packings_are_refused_on_all_ranks),
      cmocka_unit_test(a_view_reaches_rank_0_from_any_owner),
  };
  return cmocka_run_group_tests_name("RVE farm", tests, make_packings, free_packings);
}

int main(void) { return mpi_test_main(run, 100); }
