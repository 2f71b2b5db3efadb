/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Records of the RVE farm: written on some ranks, read on others, the same from any, refused on all if one is wrong. */
#include "farm_help.h"

static void a_restart_on_other_ranks_continues_bit_for_bit(void **state) {
  (void)state;
  const RveScene scene = make_scene();
  static double straight[TAGS * ANSWER], resumed[TAGS * ANSWER];
  int alive[TAGS];
  char *bytes;
  size_t size;
  RveLaw *law, *second;
  MPI_Comm half;
  all_alive(alive);
  CHECK_ALL(run_law(MPI_COMM_WORLD, 5, &law, straight) == BASE_OK);
  CHECK_ALL(pack_for_all(law, &bytes, &size) == BASE_OK);

  /* The ranks fall into two groups (of 2 + 2, 2 + 1, 1 + 1, 1 ranks), each continues the whole of it. */
  MPI_Comm_split(MPI_COMM_WORLD, mpi_test_rank() < (mpi_test_ranks() + 1) / 2, 0, &half);
  CHECK_ALL(rve_law_create(half, &scene, packing, PACKINGS, help_backend(), &second) == BASE_OK);
  CHECK_ALL(rve_law_unpack(second, bytes, size) == BASE_OK);
  CHECK_ALL(law_step(second, half, alive, 5, 0.0, 0, resumed) == BASE_OK);
  int good = 1; /* dt = 0: heat is per step and not asked here */
  for (int k = 0; k < TAGS; k++) good = good && memcmp(straight + ANSWER * k, resumed + ANSWER * k, 48) == 0;
  CHECK_ALL(good);
  for (int step = 5; step < 10; step++) {
    CHECK_ALL(law_step(law, MPI_COMM_WORLD, alive, step, time_step, 0, straight) == BASE_OK);
    CHECK_ALL(law_step(second, half, alive, step, time_step, 0, resumed) == BASE_OK);
    CHECK_ALL(same_answers(straight, resumed, alive));
  }
  RveLawTotals a, b;
  CHECK_ALL(rve_law_totals(law, &a) == BASE_OK && rve_law_totals(second, &b) == BASE_OK);
  CHECK_ALL(a.friction_work > 0 && a.friction_work == b.friction_work && a.damping_work == b.damping_work &&
            a.stored_energy == b.stored_energy && a.worst_unbalanced == b.worst_unbalanced && a.grains == b.grains);
  CHECK_ALL(b.particle_steps > 0 && b.particle_steps < a.particle_steps);
  rve_law_destroy(second);
  rve_law_destroy(law);
  MPI_Comm_free(&half);
  base_free(bytes);
}

static void record_and_totals_do_not_depend_on_the_number_of_ranks(void **state) {
  (void)state;
  static double answers[TAGS * ANSWER];
  char *bytes;
  void *alone;
  size_t size, size_alone;
  RveLaw *law, *serial;
  RveLawTotals a, b;
  CHECK_ALL(run_law(MPI_COMM_WORLD, 6, &law, answers) == BASE_OK);
  CHECK_ALL(run_law(MPI_COMM_SELF, 6, &serial, answers) == BASE_OK);
  CHECK_ALL(pack_for_all(law, &bytes, &size) == BASE_OK);
  CHECK_ALL(rve_law_pack(serial, &alone, &size_alone) == BASE_OK);
  CHECK_ALL(size == size_alone && memcmp(bytes, alone, size) == 0);
  CHECK_ALL(rve_law_totals(law, &a) == BASE_OK && rve_law_totals(serial, &b) == BASE_OK);
  a.seconds = b.seconds = 0;
  CHECK_ALL(a.shared >= 0 && a.shared < a.calls && b.shared >= a.shared); /* twins can only be shared where they live */
  a.shared = b.shared;
  CHECK_ALL(a.friction_work > 0 && a.damping_work > 0 && a.stored_energy > 0 && a.rves == TAGS);
  CHECK_ALL(memcmp(&a, &b, sizeof a) == 0);
  rve_law_destroy(law);
  rve_law_destroy(serial);
  base_free(bytes);
  base_free(alone);
}

/* Refused on all ranks with one message that contains `text`; the law goes on as if nothing had happened. */
static int is_refused(RveLaw *law, const void *bytes, size_t size, const char *text) {
  BaseStatus status = rve_law_unpack(law, bytes, size);
  const char *message = base_error_message();
  if (status != BASE_ERROR_FORMAT || !strstr(message, text)) {
    fprintf(stderr, "status %d, message \"%s\"\n", status, message);
    return 0;
  }
  return 1;
}

static void altered_truncated_and_foreign_records_are_refused_on_all_ranks(void **state) {
  (void)state;
  static double straight[TAGS * ANSWER], resumed[TAGS * ANSWER];
  int alive[TAGS];
  char *bytes;
  size_t size;
  RveLaw *law, *other;
  all_alive(alive);
  CHECK_ALL(run_law(MPI_COMM_WORLD, 2, &law, straight) == BASE_OK);
  CHECK_ALL(pack_for_all(law, &bytes, &size) == BASE_OK);
  CHECK_ALL(is_refused(law, bytes, size - 1, "truncated"));
  CHECK_ALL(is_refused(law, bytes, 10, "truncated"));
  CHECK_ALL(is_refused(law, NULL, 0, "truncated"));
  for (size_t at = 0; at < size; at += size / 7) {
    bytes[at] ^= 4;
    CHECK_ALL(is_refused(law, bytes, size, ""));
    bytes[at] ^= 4;
  }
  bytes[size / 2] ^= 1;
  CHECK_ALL(is_refused(law, bytes, size, "altered"));
  bytes[size / 2] ^= 1;
  /* Bad on the last rank only. */
  const int last = mpi_test_rank() == mpi_test_ranks() - 1;
  CHECK_ALL(is_refused(law, bytes, last ? size - 8 : size, "truncated"));

  RveScene scene = make_scene();
  CHECK_ALL(rve_law_create(MPI_COMM_WORLD, &scene, packing + 1, PACKINGS - 1, help_backend(), &other) == BASE_OK);
  CHECK_ALL(is_refused(other, bytes, size, "packings"));
  rve_law_destroy(other);
  scene.thermal = 0;
  CHECK_ALL(rve_law_create(MPI_COMM_WORLD, &scene, packing, PACKINGS, help_backend(), &other) == BASE_OK);
  CHECK_ALL(is_refused(other, bytes, size, "thermal"));
  rve_law_destroy(other);

  /* After all that the law still takes the good record, and it is what the law holds anyway. */
  CHECK_ALL(law_step(law, MPI_COMM_WORLD, alive, 2, time_step, 0, straight) == BASE_OK);
  CHECK_ALL(rve_law_unpack(law, bytes, size) == BASE_OK);
  CHECK_ALL(law_step(law, MPI_COMM_WORLD, alive, 2, time_step, 0, resumed) == BASE_OK);
  CHECK_ALL(same_answers(straight, resumed, alive));
  rve_law_destroy(law);
  base_free(bytes);
}

static void different_records_on_different_ranks_are_refused(void **state) {
  (void)state;
  static double answers[TAGS * ANSWER];
  char *old, *new;
  size_t old_size, new_size;
  int alive[TAGS];
  RveLaw *law;
  all_alive(alive);
  CHECK_ALL(run_law(MPI_COMM_WORLD, 1, &law, answers) == BASE_OK);
  CHECK_ALL(pack_for_all(law, &old, &old_size) == BASE_OK);
  CHECK_ALL(law_step(law, MPI_COMM_WORLD, alive, 1, time_step, 0, answers) == BASE_OK);
  CHECK_ALL(pack_for_all(law, &new, &new_size) == BASE_OK);
  const int odd = mpi_test_rank() % 2;
  if (mpi_test_ranks() > 1) CHECK_ALL(is_refused(law, odd ? old : new, odd ? old_size : new_size, "different records"));
  CHECK_ALL(rve_law_unpack(law, old, old_size) == BASE_OK);
  rve_law_destroy(law);
  base_free(old);
  base_free(new);
}

static int run(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(a_restart_on_other_ranks_continues_bit_for_bit),
      cmocka_unit_test(record_and_totals_do_not_depend_on_the_number_of_ranks),
      cmocka_unit_test(altered_truncated_and_foreign_records_are_refused_on_all_ranks),
      cmocka_unit_test(different_records_on_different_ranks_are_refused),
  };
  return cmocka_run_group_tests_name("records of the RVE farm", tests, make_packings, free_packings);
}

int main(void) { return mpi_test_main(run, 100); }
