/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Transfers between points and grid: what each of them keeps, and independence of order, threads and ranks. */
#include "mpm_help.h"

#include <omp.h>

typedef struct Kind {
  const char *name;
  MpmTransfer transfer;
  double pic;
  int xpic;
} Kind;
static const Kind kinds[] = {{"FLIP", MPM_TRANSFER_FLIP, 0.0, 1},   {"FLIP 0.1 PIC", MPM_TRANSFER_FLIP, 0.1, 1},
                             {"PIC", MPM_TRANSFER_FLIP, 1.0, 1},    {"APIC", MPM_TRANSFER_APIC, 0.0, 1},
                             {"XPIC(1)", MPM_TRANSFER_XPIC, 0.0, 1}, {"XPIC(2)", MPM_TRANSFER_XPIC, 0.0, 2},
                             {"XPIC(5)", MPM_TRANSFER_XPIC, 0.0, 5}};
enum { KINDS = sizeof kinds / sizeof *kinds };
enum { STEPS = 10 /* of the comparisons bit for bit: points change their cells in them */ };

static MpmScene make_scene(int dimension, MpmShape shape, const Kind *kind, MpmOrder order) {
  MpmScene scene = mpm_scene_default();
  scene.dimension = dimension;
  scene.spacing = 0.1;
  scene.shape = shape;
  scene.transfer = kind->transfer;
  scene.pic_fraction = kind->pic;
  scene.xpic_order = kind->xpic;
  scene.order = order;
  return scene;
}

/* A block of points, jittered so that nothing is symmetric. */
static MpmPoint *make_jittered(int dimension, int edge, int *count) {
  const int number[3] = {edge, edge - 1, edge - 2};
  const double low[3] = {0.213, -0.37, 0.121};
  MpmPoint *points = make_box(dimension, low, number, 0.05, 1000.0, 1, count);
  uint64_t seed = 7;
  for (int p = 0; p < *count; p++)
    for (int i = 0; i < dimension; i++) points[p].position[i] += 0.01 * (base_random(&seed) - 0.5);
  return points;
}

static void give_random_velocity(MpmPoint *points, int count, int dimension) {
  uint64_t seed = 11;
  for (int p = 0; p < count; p++)
    for (int i = 0; i < dimension; i++) points[p].velocity[i] = base_random(&seed) - 0.5;
}

/* Errata, eq. 27: the printed position update moves points by 1 - alpha per step in uniform motion. */
static void uniform_motion_is_exact_for_every_transfer(void **state) {
  (void)state;
  MpmLaw law = elastic_law(MPM_ELASTIC_PLANE_STRAIN, 1e5, 0.3);
  const double velocity[2] = {1.0, -0.5}, dt = 1e-3;
  for (int k = 0; k < KINDS; k++)
    for (int shape = 0; shape < 3; shape++)
      for (int order = 0; order < 3; order++) {
        const MpmScene scene = make_scene(2, (MpmShape)shape, &kinds[k], (MpmOrder)order);
        Mpm *mpm;
        int count;
        OK(mpm_create(&scene, &law, NULL, &mpm));
        MpmPoint *points = make_jittered(2, 8, &count), *start = make_jittered(2, 8, &count);
        for (int p = 0; p < count; p++) memcpy(points[p].velocity, velocity, sizeof velocity);
        for (int s = 0; s < 100; s++) OK(mpm_step(mpm, points, count, dt));
        for (int p = 0; p < count; p++)
          for (int i = 0; i < 2; i++) {
            /* Round-off of 100 steps; the law answers round-off in L with E dt/(rho h) = 10 times as much. */
            AT_MOST(fabs(points[p].position[i] - start[p].position[i] - 100 * dt * velocity[i]), 1e-13);
            AT_MOST(fabs(points[p].velocity[i] - velocity[i]), 1e-12);
          }
        free(points), free(start);
        mpm_destroy(mpm);
      }
  law.destroy(law.content);
}

static void sum_momenta(const MpmPoint *points, int count, double linear[3], double *angular) {
  linear[0] = linear[1] = linear[2] = *angular = 0.0;
  for (int p = 0; p < count; p++) {
    for (int i = 0; i < 3; i++) linear[i] += points[p].mass * points[p].velocity[i];
    *angular += points[p].mass *
                (points[p].position[0] * points[p].velocity[1] - points[p].position[1] * points[p].velocity[0]);
  }
}

static void linear_momentum_is_kept_by_every_transfer(void **state) {
  (void)state;
  for (int dimension = 2; dimension <= 3; dimension++) {
    MpmLaw law = elastic_law(dimension == 3 ? MPM_ELASTIC_3D : MPM_ELASTIC_PLANE_STRESS, 1e5, 0.3);
    for (int k = 0; k < KINDS; k++)
      for (int shape = 0; shape < 3; shape++) {
        const MpmScene scene = make_scene(dimension, (MpmShape)shape, &kinds[k], MPM_ORDER_MUSL);
        Mpm *mpm;
        int count;
        double before[3], after[3], angular, scale = 0.0;
        OK(mpm_create(&scene, &law, NULL, &mpm));
        MpmPoint *points = make_jittered(dimension, 6, &count);
        give_random_velocity(points, count, dimension);
        for (int p = 0; p < count; p++) scale += points[p].mass;
        sum_momenta(points, count, before, &angular);
        for (int s = 0; s < 100; s++) OK(mpm_step(mpm, points, count, 5e-4));
        sum_momenta(points, count, after, &angular);
        for (int i = 0; i < 3; i++) AT_MOST(fabs(after[i] - before[i]), 1e-13 * scale); /* round-off of 100 steps */
        free(points);
        mpm_destroy(mpm);
      }
    law.destroy(law.content);
  }
}

/* Angular momentum of one step without stress, of a body that rotates: FLIP and APIC keep it, the latter when the
 * matrix is counted; PIC loses a share of order (h/R)^2 per step, XPIC(m) an ever smaller one. The order of merit is
 * the claim. */
static double rotation_loss(const Kind *kind, MpmShape shape, int steps) {
  MpmLaw law = elastic_law(MPM_ELASTIC_PLANE_STRAIN, 1e-6, 0.0);
  const MpmScene scene = make_scene(2, shape, kind, MPM_ORDER_USF);
  Mpm *mpm;
  int count;
  double linear[3], before, after;
  OK(mpm_create(&scene, &law, NULL, &mpm));
  MpmPoint *points = make_jittered(2, 12, &count);
  for (int p = 0; p < count; p++) {
    points[p].velocity[0] = -points[p].position[1], points[p].velocity[1] = points[p].position[0];
    points[p].affine[1] = -1.0, points[p].affine[3] = 1.0;
  }
  /* Small steps: the bodies hardly move, only the transfers act. */
  sum_momenta(points, count, linear, &before);
  double centre[3] = {0}, mass = 0.0;
  for (int p = 0; p < count; p++) {
    mass += points[p].mass;
    for (int i = 0; i < 2; i++) centre[i] += points[p].mass * points[p].position[i];
  }
  before -= (centre[0] * linear[1] - centre[1] * linear[0]) / mass;
  for (int s = 0; s < steps; s++) OK(mpm_step(mpm, points, count, 1e-9));
  sum_momenta(points, count, linear, &after);
  after -= (centre[0] * linear[1] - centre[1] * linear[0]) / mass;
  free(points);
  mpm_destroy(mpm);
  law.destroy(law.content);
  return 1.0 - after / before;
}

static void angular_momentum_is_lost_as_each_transfer_promises(void **state) {
  (void)state;
  for (int shape = 0; shape < 3; shape++) {
    double loss[KINDS];
    printf("angular momentum lost in 20 transfers, shape %d:", shape);
    for (int k = 0; k < KINDS; k++) {
      loss[k] = rotation_loss(&kinds[k], (MpmShape)shape, 20);
      printf(" %s %.2e", kinds[k].name, loss[k]);
    }
    printf("\n");
    AT_MOST(fabs(loss[0]), 1e-8);            /* FLIP: what moves in 20 steps of 1e-9 s */
    AT_MOST(0.02, loss[2]);                  /* PIC: a good part in 20 steps on 6 cells */
    AT_MOST(fabs(loss[4] - loss[2]), 1e-12); /* XPIC(1) is PIC */
    AT_MOST(loss[5], 0.8 * loss[2]);         /* and higher orders filter less */
    AT_MOST(loss[6], 0.8 * loss[5]);
    /* APIC reproduces a rigid rotation; linear loses the matrix of the points within 2 % of a node, here about 1e-3. */
    AT_MOST(fabs(loss[3]), shape == MPM_SHAPE_LINEAR ? 2e-3 : 1e-8);
    AT_MOST(loss[1], 0.2 * loss[2]);         /* a tenth of PIC's loss per step */
  }
}

/* APIC's conserved quantity (Jiang et al. 2015): sum m x cross v + the moment of the matrices, sum m D (A_21 - A_12), D
 * = h^2/4 for the B-spline. */
static void apic_keeps_angular_momentum_with_its_matrix(void **state) {
  (void)state;
  const Kind apic = kinds[3];
  MpmLaw law = elastic_law(MPM_ELASTIC_PLANE_STRAIN, 1e4, 0.3);
  const MpmScene scene = make_scene(2, MPM_SHAPE_BSPLINE, &apic, MPM_ORDER_USF);
  Mpm *mpm;
  int count;
  double total[2] = {0.0, 0.0}, linear[3];
  OK(mpm_create(&scene, &law, NULL, &mpm));
  MpmPoint *points = make_jittered(2, 8, &count);
  give_random_velocity(points, count, 2);
  for (int when = 0; when < 2; when++) {
    if (when)
      for (int s = 0; s < 50; s++) OK(mpm_step(mpm, points, count, 1e-3));
    sum_momenta(points, count, linear, &total[when]);
    for (int p = 0; p < count; p++)
      total[when] +=
          points[p].mass * 0.25 * scene.spacing * scene.spacing * (points[p].affine[3] - points[p].affine[1]);
  }
  AT_MOST(fabs(total[1] - total[0]), 1e-12); /* of masses and velocities near 1: round-off of 50 steps */
  free(points);
  mpm_destroy(mpm);
  law.destroy(law.content);
}

/* ---------------------------------------------------------------------------------- order of the caller, threads,
 * ranks */

static MpmPoint *run_reference(const MpmScene *given, int threads, int reversed, int edge, int *count) {
  MpmScene scene = *given;
  scene.threads = threads;
  MpmElastic elastic = {.mode = scene.dimension == 3 ? MPM_ELASTIC_3D : MPM_ELASTIC_PLANE_STRAIN,
                        .young = 1e5,
                        .poisson = 0.3,
                        .expansion = 1e-3,
                        .conductivity = {5, 3, 4, 1, 0.5, 0.2},
                        .thermal = scene.thermal};
  MpmLaw law;
  Mpm *mpm;
  OK(mpm_elastic_create(&elastic, &law));
  OK(mpm_create(&scene, &law, NULL, &mpm));
  MpmWall wall = plane_wall(1, -0.4, 1.0, MPM_WALL_FRICTION);
  wall.friction = 0.4;
  OK(mpm_set_walls(mpm, &wall, 1));
  MpmPoint *points = make_jittered(scene.dimension, edge, count);
  give_random_velocity(points, *count, scene.dimension);
  for (int p = 0; p < *count; p++)
    points[p].temperature = points[p].velocity[0], points[p].force[1] = -9.81 * points[p].mass;
  if (reversed)
    for (int p = 0; p < *count / 2; p++) {
      const MpmPoint swap = points[p];
      points[p] = points[*count - 1 - p], points[*count - 1 - p] = swap;
    }
  OK(mpm_initialise(mpm, points, *count));
  for (int s = 0; s < STEPS; s++) OK(mpm_step(mpm, points, *count, 5e-4));
  qsort(points, (size_t)*count, sizeof *points, compare_tags);
  mpm_destroy(mpm);
  law.destroy(law.content);
  return points;
}

static void results_do_not_depend_on_threads_or_on_the_callers_order(void **state) {
  (void)state;
  for (int dimension = 2; dimension <= 3; dimension++)
    for (int shape = 0; shape < 3; shape++)
      for (int k = 0; k < KINDS; k += 3) {
        int count;
        MpmScene scene = make_scene(dimension, (MpmShape)shape, &kinds[k], k == 3 ? MPM_ORDER_MUSL : MPM_ORDER_USF);
        scene.thermal = 1;
        scene.volumetric = k == 3 ? MPM_VOLUMETRIC_CELL : MPM_VOLUMETRIC_POINT;
        /* Enough points that the threads do start (2,000). */
        const int edge = dimension == 3 ? 15 : 50;
        MpmPoint *reference = run_reference(&scene, 1, 0, edge, &count);
        for (int threads = 1; threads <= 3; threads++) {
          MpmPoint *other = run_reference(&scene, threads, threads != 2, edge, &count);
          assert_memory_equal(reference, other, (size_t)count * sizeof *reference);
          free(other);
        }
        free(reference);
      }
}

/* Two ranks as two threads: each has every second point; the halo copies through shared memory. */
typedef struct SharedHalo {
  const MpmPoint *own[2];
  int own_count[2];
  const double *value[2];
} SharedHalo;

typedef struct RankHalo {
  SharedHalo *shared;
  int rank, count;
  int index[4000];
  MpmPoint foreign[4000];
} RankHalo;

static BaseStatus halo_begin(void *content, const MpmPoint *own, int own_count, double reach, const MpmPoint **foreign,
                             int *foreign_count) {
  RankHalo *halo = content;
  const int other = 1 - halo->rank;
  halo->shared->own[halo->rank] = own;
  halo->shared->own_count[halo->rank] = own_count;
#pragma omp barrier
  halo->count = 0;
  for (int p = 0; p < halo->shared->own_count[other]; p++) {
    const MpmPoint *point = &halo->shared->own[other][p];
    int is_near = 0;
    for (int q = 0; q < own_count && !is_near; q++) {
      is_near = 1;
      for (int i = 0; i < 3; i++) is_near &= fabs(point->position[i] - own[q].position[i]) <= reach;
    }
    if (!is_near) continue;
    halo->index[halo->count] = p;
    halo->foreign[halo->count++] = *point;
  }
#pragma omp barrier
  *foreign = halo->foreign;
  *foreign_count = halo->count;
  return BASE_OK;
}

static BaseStatus halo_forward(void *content, int width, const double *value, double *foreign_value) {
  RankHalo *halo = content;
  halo->shared->value[halo->rank] = value;
#pragma omp barrier
  for (int f = 0; f < halo->count; f++)
    memcpy(foreign_value + (size_t)f * (size_t)width,
           halo->shared->value[1 - halo->rank] + (size_t)halo->index[f] * (size_t)width, (size_t)width * sizeof *value);
#pragma omp barrier
  return BASE_OK;
}

/* Splits the points at a plane that cuts cells, or by parity of the tag; runs both halves at once; joins them by tag.
 */
static MpmPoint *run_on_two_ranks(const MpmScene *scene, int by_parity, int edge, int *count) {
  SharedHalo shared = {0};
  MpmPoint *all = make_jittered(scene->dimension, edge, count), *joined = malloc((size_t)*count * sizeof *joined);
  give_random_velocity(all, *count, scene->dimension);
  int share[2] = {0, 0}, failures = 0;
#pragma omp parallel num_threads(2) reduction(+ : failures)
  {
    const int rank = omp_get_thread_num();
    MpmScene own_scene = *scene;
    own_scene.threads = 1;
    MpmElastic elastic = {.mode = scene->dimension == 3 ? MPM_ELASTIC_3D : MPM_ELASTIC_PLANE_STRAIN, .young = 1e5,
                          .poisson = 0.3, .expansion = 1e-3, .conductivity = {5, 3, 4, 1, 0.5, 0.2},
                          .thermal = scene->thermal};
    MpmLaw law;
    Mpm *mpm;
    RankHalo *content = calloc(1, sizeof *content);
    content->shared = &shared, content->rank = rank;
    MpmHalo halo = {content, halo_begin, halo_forward, NULL};
    failures += mpm_elastic_create(&elastic, &law) != BASE_OK;
    failures += mpm_create(&own_scene, &law, &halo, &mpm) != BASE_OK;
    MpmWall wall = plane_wall(1, -0.4, 1.0, MPM_WALL_FRICTION);
    wall.friction = 0.4;
    failures += mpm_set_walls(mpm, &wall, 1) != BASE_OK;
    MpmPoint *own = malloc((size_t)*count * sizeof *own);
    int n = 0;
    for (int p = 0; p < *count; p++) {
      const int to = by_parity ? (int)(all[p].tag & 1) : all[p].position[0] > 0.31;
      if (to == rank) own[n++] = all[p];
    }
    share[rank] = n;
    for (int p = 0; p < n; p++) own[p].temperature = own[p].velocity[0], own[p].force[1] = -9.81 * own[p].mass;
    failures += mpm_initialise(mpm, own, n) != BASE_OK;
    for (int s = 0; s < STEPS; s++) failures += mpm_step(mpm, own, n, 5e-4) != BASE_OK;
#pragma omp barrier
    memcpy(joined + (rank ? share[0] : 0), own, (size_t)n * sizeof *own);
    free(own), free(content);
    mpm_destroy(mpm);
    law.destroy(law.content);
  }
  assert_int_equal(failures, 0);
  assert_int_equal(share[0] + share[1], *count);
  free(all);
  qsort(joined, (size_t)*count, sizeof *joined, compare_tags);
  return joined;
}

static void results_do_not_depend_on_ranks(void **state) {
  (void)state;
  for (int dimension = 2; dimension <= 3; dimension++)
    for (int shape = 0; shape < 3; shape++)
      for (int k = 0; k < KINDS; k++)
        for (int order = 0; order < 3; order += 2) {
          int count;
          MpmScene scene = make_scene(dimension, (MpmShape)shape, &kinds[k], (MpmOrder)order);
          scene.thermal = 1;
          scene.volumetric = (k + shape) % 2 ? MPM_VOLUMETRIC_CELL : MPM_VOLUMETRIC_POINT;
          const int edge = dimension == 3 ? 8 : 14;
          MpmPoint *reference = run_reference(&scene, 1, 0, edge, &count);
          MpmPoint *split = run_on_two_ranks(&scene, (k + order) % 2, edge, &count);
          assert_memory_equal(reference, split, (size_t)count * sizeof *reference);
          free(reference), free(split);
        }
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(uniform_motion_is_exact_for_every_transfer),
      cmocka_unit_test(linear_momentum_is_kept_by_every_transfer),
      cmocka_unit_test(angular_momentum_is_lost_as_each_transfer_promises),
      cmocka_unit_test(apic_keeps_angular_momentum_with_its_matrix),
      cmocka_unit_test(results_do_not_depend_on_threads_or_on_the_callers_order),
      cmocka_unit_test(results_do_not_depend_on_ranks),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
