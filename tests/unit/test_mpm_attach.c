/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Points that stay in the core for many steps go the way of points that are handed over at every step, bit for bit. */
#include "mpm_help.h"

enum { STEPS = 40 };

static MpmScene make_scene(int dimension, MpmShape shape, MpmTransfer transfer, MpmOrder order) {
  MpmScene scene = mpm_scene_default();
  scene.dimension = dimension;
  scene.spacing = 0.1;
  scene.shape = shape;
  scene.transfer = transfer;
  scene.order = order;
  scene.gimp_stretch = shape == MPM_SHAPE_GIMP;
  scene.threads = 2;
  return scene;
}

/* A tumbling, falling block over a wall, whose points cross cells in most steps; masses differ. */
static MpmPoint *make_points(int dimension, int *count) {
  const double low[3] = {0.013, 0.021, 0.034};
  const int number[3] = {dimension == 3 ? 9 : 60, dimension == 3 ? 12 : 50, 24};
  MpmPoint *points = make_box(dimension, low, number, 0.05, 1000.0, 1, count);
  uint64_t seed = 5;
  for (int p = 0; p < *count; p++) {
    MpmPoint *point = &points[p];
    point->mass *= 1.0 + 0.1 * base_random(&seed);
    for (int i = 0; i < dimension; i++) point->velocity[i] = 0.4 * (base_random(&seed) - 0.5);
    point->velocity[0] -= 2.0 * point->position[1], point->velocity[1] += 2.0 * point->position[0] - 1.5;
    point->force[1] = -9.81 * point->mass;
  }
  return points;
}

/* Points to compare, by tag. parts: so many times attached and written. */
static MpmPoint *run(const MpmScene *scene, int parts, int reversed, int *count) {
  MpmLaw law = elastic_law(scene->dimension == 3 ? MPM_ELASTIC_3D : MPM_ELASTIC_PLANE_STRAIN, 1e4, 0.3);
  MpmPoint *points = make_points(scene->dimension, count);
  for (int p = 0; reversed && p < *count / 2; p++) {
    const MpmPoint swap = points[p];
    points[p] = points[*count - 1 - p], points[*count - 1 - p] = swap;
  }
  MpmWall wall = plane_wall(1, 0.0, 1.0, MPM_WALL_SLIP);
  Mpm *mpm;
  OK(mpm_create(scene, &law, NULL, &mpm));
  OK(mpm_set_walls(mpm, &wall, 1));
  OK(mpm_initialise(mpm, points, *count));
  for (int part = 0; part < parts; part++) {
    OK(mpm_attach(mpm, points, *count));
    for (int s = 0; s < STEPS / parts; s++) OK(mpm_advance(mpm, 1.5e-3));
    mpm_write(mpm);
  }
  mpm_destroy(mpm);
  law.destroy(law.content);
  qsort(points, (size_t)*count, sizeof *points, compare_tags);
  return points;
}

static void points_may_stay_in_the_core(void **state) {
  (void)state;
  for (int dimension = 2; dimension <= 3; dimension++)
    for (int transfer = 0; transfer < 3; transfer++)
      for (int order = 0; order < 3; order++) {
        const MpmShape shape = (MpmShape)((transfer + order + 1) % 3);
        const MpmScene scene = make_scene(dimension, shape, (MpmTransfer)transfer, (MpmOrder)order);
        int count;
        MpmPoint *each = run(&scene, STEPS, 0, &count), *once = run(&scene, 1, 0, &count);
        MpmPoint *reversed = run(&scene, 2, 1, &count);
        double moved = 0.0;
        for (int p = 0; p < count; p++) moved = fmax(moved, fabs(each[p].deformation_gradient[1]));
        assert_true(moved > 1e-3 && isfinite(moved));
        assert_memory_equal(each, once, (size_t)count * sizeof *each);
        assert_memory_equal(each, reversed, (size_t)count * sizeof *each);
        free(each), free(once), free(reversed);
      }
}

/* The order of rows follows tags and cells only: the last order is not trusted for other points. */
static void attached_points_may_change(void **state) {
  (void)state;
  MpmScene scene = make_scene(2, MPM_SHAPE_LINEAR, MPM_TRANSFER_FLIP, MPM_ORDER_USF);
  MpmLaw law = elastic_law(MPM_ELASTIC_PLANE_STRAIN, 1e4, 0.3);
  int count;
  MpmPoint *points = make_points(2, &count), *fresh = make_points(2, &count);
  Mpm *mpm, *other;
  OK(mpm_create(&scene, &law, NULL, &mpm));
  OK(mpm_create(&scene, &law, NULL, &other));
  OK(mpm_attach(mpm, points, count));
  for (int s = 0; s < 10; s++) OK(mpm_advance(mpm, 1.5e-3));
  /* The same tags elsewhere, then fewer points. */
  for (int n = count; n > count - 2; n--) {
    memcpy(points, fresh, (size_t)count * sizeof *points);
    MpmPoint *expected = make_points(2, &count);
    OK(mpm_step(mpm, points, n, 1.5e-3));
    OK(mpm_step(other, expected, n, 1.5e-3));
    assert_memory_equal(points, expected, (size_t)n * sizeof *points);
    free(expected);
  }
  points[3].position[0] = NAN;
  OK(mpm_attach(mpm, points, count));
  assert_int_equal(mpm_advance(mpm, 1.5e-3), BASE_ERROR_UNSTABLE);
  assert_non_null(strstr(base_error_message(), "point 4: position"));
  mpm_destroy(mpm), mpm_destroy(other);
  law.destroy(law.content);
  free(points), free(fresh);
}

/* Points that the caller moves between the first answer and the first step are found where they are. */
static void points_moved_after_the_first_answer_are_sorted_anew(void **state) {
  (void)state;
  const double low[3] = {0.013, 0.02, 0.0};
  const int number[3] = {8, 6, 1};
  MpmLaw law = elastic_law(MPM_ELASTIC_PLANE_STRAIN, 1e4, 0.2);
  MpmPoint *after[2];
  int count = 0;
  for (int moves = 0; moves < 2; moves++) {
    MpmScene scene = mpm_scene_default();
    scene.dimension = 2, scene.spacing = 0.1;
    Mpm *mpm;
    OK(mpm_create(&scene, &law, NULL, &mpm));
    after[moves] = make_box(2, low, number, 0.05, 1000.0, 1, &count);
    if (moves) OK(mpm_initialise(mpm, after[moves], count));
    for (int p = 0; p < count; p++) {
      double *x = after[moves][p].position, turned = 0.8 * x[0] - 0.6 * x[1];
      x[1] = 3.0 + 0.6 * x[0] + 0.8 * x[1], x[0] = turned;
      after[moves][p].velocity[0] = 1.0 + x[1];
    }
    if (!moves) OK(mpm_initialise(mpm, after[moves], count));
    for (int s = 0; s < 20; s++) OK(mpm_step(mpm, after[moves], count, 1e-3));
    mpm_destroy(mpm);
  }
  for (int p = 0; p < count; p++) {
    assert_memory_equal(after[0][p].position, after[1][p].position, sizeof after[0][p].position);
    assert_memory_equal(after[0][p].stress, after[1][p].stress, sizeof after[0][p].stress);
  }
  free(after[0]);
  free(after[1]);
  law.destroy(law.content);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(points_moved_after_the_first_answer_are_sorted_anew),
      cmocka_unit_test(points_may_stay_in_the_core),
      cmocka_unit_test(attached_points_may_change),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
