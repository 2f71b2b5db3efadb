/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The halo of foreign points against brute force over all points of all ranks and all periodic images. */
#include "mpi_test.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "../../src/fix_mpm_couple/rank_agree.h"
#include "../../src/fix_mpm_couple/rve_law.h"
#include "../../src/mpm/mpm.h"

enum { POINTS = 240 };

typedef struct Scene {
  int dimension;
  double period[3];
  double reach;
  int empty_rank; /* this rank owns nothing; -1: none. With one rank the scene has no points then */
  int clustered;  /* 1: ranks own slabs in x; 0: owners are random, all boxes overlap */
} Scene;

/* All points of the scene, the same on every rank; owner[] says whose. Positions in [0, 1). */
static void make_points(const Scene *scene, uint64_t seed, MpmPoint *point, int *owner) {
  const int ranks = mpi_test_ranks();
  uint64_t state = seed;
  for (int p = 0; p < POINTS; p++) {
    memset(&point[p], 0, sizeof point[p]);
    point[p].tag = p + 1;
    for (int i = 0; i < 3; i++) point[p].position[i] = base_random(&state);
    point[p].mass = base_random(&state);
    point[p].scalars[MPM_LAW_SCALARS - 1] = base_random(&state); /* the last field must arrive too */
    owner[p] = (int)((scene->clustered ? point[p].position[0] : base_random(&state)) * ranks);
    if (owner[p] == scene->empty_rank) owner[p] = ranks > 1 ? (owner[p] + 1) % ranks : -1;
  }
}

static int own_points(const MpmPoint *point, const int *owner, MpmPoint *own) {
  int count = 0;
  for (int p = 0; p < POINTS; p++)
    if (owner[p] == mpi_test_rank()) own[count++] = point[p];
  return count;
}

/* A copy is known by its tag and image: shift in units of periods, each -1, 0, 1. */
static int copy_key(int64_t tag, const int shift[3]) {
  return (int)((tag * 3 + shift[0] + 1) * 9 + (shift[1] + 1) * 3 + shift[2] + 1);
}

static int by_value(const void *a, const void *b) {
  const int left = *(const int *)a, right = *(const int *)b;
  return (left > right) - (left < right);
}

static int inside(const Scene *scene, const double x[3], const double box[6]) {
  for (int i = 0; i < scene->dimension; i++)
    if (!(x[i] >= box[i] - scene->reach && x[i] <= box[3 + i] + scene->reach)) return 0;
  return 1;
}

/* Keys, sorted, of the copies that this rank must get: the definition, without any short cut. */
static int expected_copies(const Scene *scene, const MpmPoint *point, const int *owner, int *key) {
  double box[6] = {INFINITY, INFINITY, INFINITY, -INFINITY, -INFINITY, -INFINITY};
  int count = 0;
  for (int p = 0; p < POINTS; p++)
    for (int i = 0; i < 3 && owner[p] == mpi_test_rank(); i++) {
      box[i] = fmin(box[i], point[p].position[i]);
      box[3 + i] = fmax(box[3 + i], point[p].position[i]);
    }
  for (int p = 0; p < POINTS; p++)
    for (int image = 0; image < 27 && owner[p] >= 0; image++) {
      const int shift[3] = {image % 3 - 1, image / 3 % 3 - 1, image / 9 - 1};
      double x[3];
      int possible = owner[p] != mpi_test_rank() || image != 13;
      for (int i = 0; i < 3; i++) {
        x[i] = point[p].position[i] + shift[i] * scene->period[i];
        if (shift[i] != 0 && (scene->period[i] == 0.0 || i >= scene->dimension)) possible = 0;
      }
      if (possible && inside(scene, x, box)) key[count++] = copy_key(point[p].tag, shift);
    }
  qsort(key, (size_t)count, sizeof *key, by_value);
  return count;
}

/* 1 if the copy is the original but for the shift of its position. */
static int is_copy(const Scene *scene, const MpmPoint *copy, const MpmPoint *point, int *key) {
  if (copy->tag < 1 || copy->tag > POINTS) return 0;
  MpmPoint restored = *copy;
  const MpmPoint *original = &point[copy->tag - 1];
  int shift[3] = {0, 0, 0};
  for (int i = 0; i < 3; i++) {
    if (scene->period[i] > 0.0) shift[i] = (int)lround((copy->position[i] - original->position[i]) / scene->period[i]);
    if (copy->position[i] != original->position[i] + shift[i] * scene->period[i]) return 0;
    restored.position[i] = original->position[i];
  }
  *key = copy_key(copy->tag, shift);
  return memcmp(&restored, original, sizeof restored) == 0;
}

static double forwarded(int64_t tag, int k) { return sin((double)tag) + k; }

static int forward_matches(const MpmHalo *halo, const MpmPoint *own, int own_count, const MpmPoint *foreign,
                           int foreign_count, int width) {
  double *value = calloc((size_t)(own_count + 1) * width, sizeof *value);
  double *copy = calloc((size_t)(foreign_count + 1) * width, sizeof *copy);
  for (int p = 0; p < own_count; p++)
    for (int k = 0; k < width; k++) value[p * width + k] = forwarded(own[p].tag, k);
  int good = halo->forward(halo->content, width, value, copy) == BASE_OK;
  for (int p = 0; p < foreign_count; p++)
    for (int k = 0; k < width; k++) good = good && copy[p * width + k] == forwarded(foreign[p].tag, k);
  free(value);
  free(copy);
  return good;
}

static void check_scene(const Scene *scene, uint64_t seed) {
  static MpmPoint point[POINTS], own[POINTS];
  static int owner[POINTS], expected[27 * POINTS], key[27 * POINTS];
  MpmHalo halo;
  CHECK_ALL(point_halo_create(MPI_COMM_WORLD, scene->dimension, scene->period, &halo) == BASE_OK);
  /* Several steps with one halo: buffers grow and are used again, counts fall and rise. */
  for (int step = 0; step < 4; step++) {
    const MpmPoint *foreign;
    int foreign_count;
    make_points(scene, seed + (uint64_t)step, point, owner);
    const int own_count = own_points(point, owner, own);
    CHECK_ALL(halo.begin(halo.content, own, own_count, scene->reach, &foreign, &foreign_count) == BASE_OK);
    const int wanted = expected_copies(scene, point, owner, expected);
    int good = wanted == foreign_count;
    for (int k = 0; k < foreign_count && good; k++) good = is_copy(scene, &foreign[k], point, &key[k]);
    CHECK_ALL(good);
    qsort(key, (size_t)foreign_count, sizeof *key, by_value);
    CHECK_ALL(memcmp(key, expected, (size_t)wanted * sizeof *key) == 0);
    CHECK_ALL(forward_matches(&halo, own, own_count, foreign, foreign_count, 1));
    CHECK_ALL(forward_matches(&halo, own, own_count, foreign, foreign_count, 19));
  }
  halo.destroy(halo.content);
}

static void halo_is_what_brute_force_finds_without_periods(void **state) {
  (void)state;
  for (int dimension = 2; dimension <= 3; dimension++)
    for (int clustered = 0; clustered <= 1; clustered++)
      check_scene(&(Scene){dimension, {0, 0, 0}, 0.11, -1, clustered}, 1);
}

static void halo_is_what_brute_force_finds_in_periodic_boxes(void **state) {
  (void)state;
  for (int dimension = 2; dimension <= 3; dimension++)
    for (int clustered = 0; clustered <= 1; clustered++) {
      check_scene(&(Scene){dimension, {1, 0, 0}, 0.11, -1, clustered}, 2);
      check_scene(&(Scene){dimension, {1, 1, 1}, 0.2, -1, clustered}, 3);
    }
}

static void ranks_without_points_take_part(void **state) {
  (void)state;
  check_scene(&(Scene){2, {0, 0, 0}, 0.3, 0, 1}, 4);
  check_scene(&(Scene){3, {1, 0, 1}, 0.3, mpi_test_ranks() - 1, 0}, 5);
}

static void a_point_that_is_not_finite_disturbs_no_one(void **state) {
  (void)state;
  MpmHalo halo;
  MpmPoint own[2];
  memset(own, 0, sizeof own);
  own[0].tag = 2 * mpi_test_rank() + 1, own[1].tag = own[0].tag + 1;
  own[0].position[1] = NAN;
  const MpmPoint *foreign;
  int count, bad = 0;
  CHECK_ALL(point_halo_create(MPI_COMM_WORLD, 2, (double[3]){0, 0, 0}, &halo) == BASE_OK);
  CHECK_ALL(halo.begin(halo.content, own, 2, 0.5, &foreign, &count) == BASE_OK);
  for (int k = 0; k < count; k++) bad += foreign[k].tag % 2 == 1;
  CHECK_ALL(count == mpi_test_ranks() - 1 && bad == 0);
  halo.destroy(halo.content);
}

static void wrong_arguments_are_refused_on_all_ranks(void **state) {
  (void)state;
  MpmHalo halo;
  CHECK_ALL(point_halo_create(MPI_COMM_WORLD, 4, (double[3]){0, 0, 0}, &halo) == BASE_ERROR_ARGUMENT);
  /* Wrong on one rank only: all are told, none hangs. */
  const double period = mpi_test_rank() == mpi_test_ranks() - 1 ? -1.0 : 1.0;
  CHECK_ALL(point_halo_create(MPI_COMM_WORLD, 2, (double[3]){0, period, 0}, &halo) == BASE_ERROR_ARGUMENT);
  CHECK_ALL(strstr(base_error_message(), "period 1 is -1") != NULL);
}

static void an_error_of_any_rank_becomes_that_of_all(void **state) {
  (void)state;
  const int last = mpi_test_rank() == mpi_test_ranks() - 1;
  BaseStatus status = last ? base_error(BASE_ERROR_UNSTABLE, "tag %d", 7) : BASE_OK;
  CHECK_ALL(rank_agree(MPI_COMM_WORLD, status, INT64_MAX) == BASE_ERROR_UNSTABLE);
  CHECK_ALL(strcmp(base_error_message(), "tag 7") == 0);
  /* All fail: the smallest key speaks. */
  status = base_error(last ? BASE_ERROR_FILE : BASE_ERROR_MEMORY, "rank %d", mpi_test_rank());
  CHECK_ALL(rank_agree(MPI_COMM_WORLD, status, -mpi_test_rank()) == BASE_ERROR_FILE);
  CHECK_ALL(mpi_test_same((uint64_t)base_error_message()[5]));
  CHECK_ALL(rank_agree(MPI_COMM_WORLD, BASE_OK, 0) == BASE_OK);
}

static int run(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(an_error_of_any_rank_becomes_that_of_all),
      cmocka_unit_test(halo_is_what_brute_force_finds_without_periods),
      cmocka_unit_test(halo_is_what_brute_force_finds_in_periodic_boxes),
      cmocka_unit_test(ranks_without_points_take_part),
      cmocka_unit_test(a_point_that_is_not_finite_disturbs_no_one),
      cmocka_unit_test(wrong_arguments_are_refused_on_all_ranks),
  };
  return cmocka_run_group_tests_name("point halo", tests, NULL, NULL);
}

int main(void) { return mpi_test_main(run, 60); }
