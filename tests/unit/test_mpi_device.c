/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The RVE farm on devices that are too small. They need the device's source on the host (tests/cuda_host), which refuses memory when it is
 * asked to; elsewhere they are skipped. */
#include "farm_help.h"

#include "device_help.h"

/* Largest deviation of an entry of the answers, over the largest such entry. */
static double deviation(const double *a, const double *b, const int *alive) {
  double worst = 0.0;
  for (int i = 0; i < ANSWER; i++) {
    double size = 1e-300, apart = 0.0;
    for (int k = 0; k < TAGS; k++) {
      if (!alive[k]) continue;
      size = fmax(size, fabs(b[ANSWER * k + i]));
      apart = fmax(apart, fabs(a[ANSWER * k + i] - b[ANSWER * k + i]));
    }
    worst = fmax(worst, apart / size);
  }
  return worst;
}

static int runs_on(const RveLaw *law, const char *name) {
  return strncmp(rve_law_backend_name(law), name, strlen(name)) == 0;
}

static void refuse_memory(int rank) {
  if (mpi_test_rank() == rank) setenv("DEMPM_CUDA_HOST_MEMORY", "1", 1);
}

/* Half of the points first; then one rank's device has no room for the others, and all ranks go on on the CPU. */
static void all_ranks_leave_a_device_that_is_too_small_for_one(void **state) {
  (void)state;
  NEED_A_DEVICE_THAT_REFUSES();
  const RveScene scene = make_scene();
  static double expected[TAGS * ANSWER], found[TAGS * ANSWER];
  int alive[TAGS] = {0};
  Truth truth;
  RveLaw *law;
  for (int k = 0; k < TAGS / 2; k++) alive[k] = 1;
  CHECK_ALL(truth_create(&scene, &truth) == BASE_OK);
  CHECK_ALL(rve_law_create(MPI_COMM_WORLD, &scene, packing, PACKINGS, RVE_BACKEND_CUDA, &law) == BASE_OK);
  for (int step = 0; step < 6; step++) {
    if (step == 3) {
      CHECK_ALL(runs_on(law, "cuda") && !rve_law_left_device(law));
      refuse_memory(mpi_test_ranks() - 1);
      all_alive(alive);
    }
    CHECK_ALL(truth_step(&truth, alive, step, time_step, expected) == BASE_OK);
    CHECK_ALL(law_step(law, MPI_COMM_WORLD, alive, step, time_step, 0, found) == BASE_OK);
    CHECK_ALL(deviation(found, expected, alive) < 1e-9);
  }
  CHECK_ALL(getenv("DEMPM_CUDA_HOST_MEMORY") || mpi_test_rank() < mpi_test_ranks() - 1);
  CHECK_ALL(rve_law_left_device(law) && runs_on(law, "cpu/"));
  unsetenv("DEMPM_CUDA_HOST_MEMORY");
  rve_law_destroy(law);
  rve_batch_destroy(truth.batch);
}

static void a_record_goes_on_where_there_is_no_room_for_it(void **state) {
  (void)state;
  NEED_A_DEVICE_THAT_REFUSES();
  const RveScene scene = make_scene();
  static double expected[TAGS * ANSWER], found[TAGS * ANSWER];
  int alive[TAGS];
  char *bytes;
  size_t size;
  RveLaw *law, *restored;
  all_alive(alive);
  CHECK_ALL(rve_law_create(MPI_COMM_WORLD, &scene, packing, PACKINGS, RVE_BACKEND_CUDA, &law) == BASE_OK);
  CHECK_ALL(law_step(law, MPI_COMM_WORLD, alive, 0, time_step, 0, expected) == BASE_OK);
  CHECK_ALL(pack_for_all(law, &bytes, &size) == BASE_OK);
  CHECK_ALL(law_step(law, MPI_COMM_WORLD, alive, 1, time_step, 0, expected) == BASE_OK && runs_on(law, "cuda"));

  refuse_memory(0);
  CHECK_ALL(rve_law_create(MPI_COMM_WORLD, &scene, packing, PACKINGS, RVE_BACKEND_CUDA, &restored) == BASE_OK);
  CHECK_ALL(rve_law_unpack(restored, bytes, size) == BASE_OK && rve_law_left_device(restored));
  CHECK_ALL(law_step(restored, MPI_COMM_WORLD, alive, 1, time_step, 0, found) == BASE_OK && runs_on(restored, "cpu/"));
  CHECK_ALL(deviation(found, expected, alive) < 1e-9);
  unsetenv("DEMPM_CUDA_HOST_MEMORY");
  rve_law_destroy(law);
  rve_law_destroy(restored);
  base_free(bytes);
}

static int run(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(all_ranks_leave_a_device_that_is_too_small_for_one),
      cmocka_unit_test(a_record_goes_on_where_there_is_no_room_for_it),
  };
  return cmocka_run_group_tests_name("the RVE farm on devices", tests, make_packings, free_packings);
}

int main(void) { return mpi_test_main(run, 100); }
