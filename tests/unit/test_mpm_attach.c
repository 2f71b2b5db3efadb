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

/* The caller's own arrays of motion, its rows in another order than the points. */
typedef struct Outside {
  int *index;
  double (*x)[3], (*v)[3], (*f)[3], *work;
} Outside;

static Outside make_outside(const MpmPoint *points, int count) {
  const size_t n = (size_t)count;
  Outside o = {calloc(n, sizeof(int)), calloc(n, 24), calloc(n, 24), calloc(n, 24), calloc(n, sizeof(double))};
  for (int p = 0; p < count; p++) {
    const int row = o.index[p] = count - 1 - p;
    memcpy(o.x[row], points[p].position, 24), memcpy(o.v[row], points[p].velocity, 24);
    memcpy(o.f[row], points[p].force, 24);
  }
  return o;
}

static void free_outside(Outside *o) { free(o->index), free(o->x), free(o->v), free(o->f), free(o->work); }

/* What others do between steps: a push, points that jump to other cells, as a periodic boundary makes them, other forces. */
static void interfere(Outside *o, int step, int count) {
  if (step == 5) o->v[count / 3][1] += 0.3;
  for (int row = 0; step % 10 == 8 && row < 7; row++) o->x[row * 31][0] += 0.017 * row;
  for (int row = 0; step == 12 && row < count; row++) o->f[row][0] = 1e-3 * (row % 5);
}

static void motion_is_exchanged_with_arrays(void **state) {
  (void)state;
  for (int dimension = 2; dimension <= 3; dimension++) {
    const MpmScene scene = make_scene(dimension, MPM_SHAPE_GIMP, MPM_TRANSFER_FLIP, MPM_ORDER_USF);
    MpmLaw law = elastic_law(dimension == 3 ? MPM_ELASTIC_3D : MPM_ELASTIC_PLANE_STRAIN, 1e4, 0.3);
    int count;
    MpmPoint *stays = make_points(dimension, &count), *comes = make_points(dimension, &count);
    Outside a = make_outside(stays, count), b = make_outside(comes, count);
    const MpmMotion motion = {a.index, a.x, a.v, (const double(*)[3])a.f, a.work};
    Mpm *resident, *other;
    OK(mpm_create(&scene, &law, NULL, &resident));
    OK(mpm_create(&scene, &law, NULL, &other));
    OK(mpm_attach(resident, stays, count));
    for (int s = 0; s < STEPS; s++) {
      double low[3], high[3];
      interfere(&a, s, count), interfere(&b, s, count);
      mpm_take_motion(resident, &motion);
      OK(mpm_advance(resident, 1.5e-3));
      mpm_give_motion(resident, &motion, low, high);
      for (int p = 0; p < count; p++) {
        MpmPoint *point = &comes[p];
        const int row = b.index[p];
        memcpy(point->position, b.x[row], 24), memcpy(point->velocity, b.v[row], 24);
        memcpy(point->force, b.f[row], 24);
      }
      OK(mpm_step(other, comes, count, 1.5e-3));
      for (int p = 0; p < count; p++) {
        const int row = b.index[p];
        for (int i = 0; i < dimension; i++) {
          b.work[p] += b.f[row][i] * (comes[p].position[i] - b.x[row][i]);
          assert_true(low[i] <= comes[p].position[i] && comes[p].position[i] <= high[i]);
        }
        memcpy(b.x[row], comes[p].position, 24), memcpy(b.v[row], comes[p].velocity, 24);
      }
      assert_memory_equal(a.x, b.x, 24 * (size_t)count);
      assert_memory_equal(a.v, b.v, 24 * (size_t)count);
      assert_memory_equal(a.work, b.work, sizeof(double) * (size_t)count);
    }
    mpm_write(resident);
    for (int p = 0; p < count; p++) { /* forces are not written back */
      assert_memory_equal(stays[p].deformation_gradient, comes[p].deformation_gradient, 72);
      assert_memory_equal(stays[p].stress, comes[p].stress, 48);
    }
    a.f[a.index[16]][1] = NAN;
    mpm_take_motion(resident, &motion);
    assert_int_equal(mpm_advance(resident, 1.5e-3), BASE_ERROR_UNSTABLE);
    assert_non_null(strstr(base_error_message(), "point 17: force"));
    mpm_destroy(resident), mpm_destroy(other);
    law.destroy(law.content);
    free_outside(&a), free_outside(&b);
    free(stays), free(comes);
  }
}

/* The bound without a look at each point says yes only where the exact limit does, and no as soon as it must. */
static void time_step_is_bounded_without_a_look_at_each_point(void **state) {
  (void)state;
  const MpmScene scene = make_scene(3, MPM_SHAPE_LINEAR, MPM_TRANSFER_FLIP, MPM_ORDER_USF);
  MpmLaw law = elastic_law(MPM_ELASTIC_3D, 1e4, 0.3);
  int count;
  MpmPoint *points = make_points(3, &count);
  Outside o = make_outside(points, count);
  const MpmMotion motion = {o.index, o.x, o.v, (const double(*)[3])o.f, o.work};
  double low[3], high[3], mechanical, thermal, exact, none;
  Mpm *mpm;
  OK(mpm_create(&scene, &law, NULL, &mpm));
  OK(mpm_initialise(mpm, points, count));
  OK(mpm_attach(mpm, points, count));
  mpm_critical_time_steps(mpm, points, count, &exact, &none);
  assert_int_equal(mpm_is_below_critical(mpm, 1e-9), 0); /* nothing is known yet */
  OK(mpm_advance(mpm, 1e-3));
  mpm_give_motion(mpm, &motion, low, high);
  mpm_critical_attached(mpm, &mechanical, &thermal);
  mpm_write(mpm);
  mpm_critical_time_steps(mpm, points, count, &exact, &none);
  assert_true(fabs(mechanical / exact - 1.0) < 1e-14); /* volumes by another formula: round-off */
  assert_true(isinf(thermal) && isinf(none));
  assert_int_equal(mpm_is_below_critical(mpm, 0.9 * exact), 1);
  assert_int_equal(mpm_is_below_critical(mpm, 1.0001 * exact), 0);
  OK(mpm_advance(mpm, 1e-3));
  assert_int_equal(mpm_is_below_critical(mpm, 1e-9), 0); /* velocities are new and were not asked for */
  for (int s = 0; s < 11; s++) OK(mpm_advance(mpm, 1e-6));
  mpm_give_motion(mpm, &motion, low, high);
  assert_int_equal(mpm_is_below_critical(mpm, 0.5 * exact), 1);
  assert_int_equal(mpm_is_below_critical(mpm, 0.95 * exact), 0); /* 12 steps later sound may be 13 % faster */
  o.v[5][0] = 1e3;
  mpm_take_motion(mpm, &motion);
  assert_int_equal(mpm_is_below_critical(mpm, 1e-9), 0);
  OK(mpm_advance(mpm, 1e-9));
  mpm_give_motion(mpm, &motion, low, high);
  assert_int_equal(mpm_is_below_critical(mpm, 0.5 * exact), 0); /* one point is fast */
  assert_int_equal(mpm_is_below_critical(mpm, 1e-9), 1);
  mpm_destroy(mpm);
  law.destroy(law.content);
  free_outside(&o);
  free(points);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(motion_is_exchanged_with_arrays),
      cmocka_unit_test(time_step_is_bounded_without_a_look_at_each_point),
      cmocka_unit_test(points_moved_after_the_first_answer_are_sorted_anew),
      cmocka_unit_test(points_may_stay_in_the_core),
      cmocka_unit_test(attached_points_may_change),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
