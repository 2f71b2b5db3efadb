/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Volumetric strain rates averaged over the cells of the grid: what they leave alone, the work of the forces, and locking. */
#include "mpm_help.h"

#include "mpm/mpm_core.h"

static MpmScene make_scene(int dimension, MpmShape shape, MpmTransfer transfer, MpmVolumetric volumetric) {
  MpmScene scene = mpm_scene_default();
  scene.dimension = dimension;
  scene.spacing = 0.1;
  scene.shape = shape;
  scene.transfer = transfer;
  scene.volumetric = volumetric;
  scene.threads = 1;
  return scene;
}

static MpmLaw make_law(int dimension, double poisson) {
  return elastic_law(dimension == 3 ? MPM_ELASTIC_3D : MPM_ELASTIC_PLANE_STRAIN, 1e5, poisson);
}

/* Points in no order, with stresses and velocities of their own. */
static MpmPoint *make_random(int dimension, int edge, int *count) {
  const int number[3] = {edge, edge - 1, edge - 2};
  const double low[3] = {0.213, -0.37, 0.121};
  MpmPoint *points = make_box(dimension, low, number, 0.05, 1000.0, 1, count);
  uint64_t seed = 5;
  for (int p = 0; p < *count; p++) {
    for (int i = 0; i < dimension; i++) {
      points[p].position[i] += 0.04 * (base_random(&seed) - 0.5);
      points[p].velocity[i] = 4.0 * base_random(&seed) - 2.0;
      points[p].deformation_gradient[4 * i] = 1.0 + 0.3 * base_random(&seed);
    }
    for (int k = 0; k < 6; k++) points[p].stress[k] = 1e4 * (base_random(&seed) - 0.5);
    if (dimension == 2) points[p].stress[4] = points[p].stress[5] = 0.0;
  }
  return points;
}

/* A velocity that is linear in space, which APIC's grid has exactly: the mean over a cell is the value of each of its points. */
static void uniform_strain_is_unchanged(void **state) {
  (void)state;
  const double gradient[9] = {0.3, -0.2, 0.1, 0.4, -0.5, 0.25, -0.1, 0.15, 0.35}, dt = 1e-3;
  for (int dimension = 2; dimension <= 3; dimension++) {
    MpmLaw law = make_law(dimension, 0.3);
    for (int shape = 0; shape < 3; shape++) {
      const MpmScene scene = make_scene(dimension, (MpmShape)shape, MPM_TRANSFER_APIC, MPM_VOLUMETRIC_CELL);
      Mpm *mpm;
      int count;
      OK(mpm_create(&scene, &law, NULL, &mpm));
      MpmPoint *points = make_random(dimension, 8, &count);
      for (int p = 0; p < count; p++) {
        double exact[6] = {0};
        MpmPoint *point = &points[p];
        memcpy(point->affine, gradient, sizeof gradient);
        for (int i = 0; i < dimension; i++) {
          point->velocity[i] = 0.0;
          for (int j = 0; j < dimension; j++) point->velocity[i] += gradient[3 * i + j] * point->position[j];
        }
        memcpy(point->stress, exact, sizeof exact);
      }
      OK(mpm_step(mpm, points, count, dt));
      double trace = 0.0;
      for (int i = 0; i < dimension; i++) trace += gradient[4 * i];
      const double lambda = 1e5 * 0.3 / (1.3 * 0.4), twice_mu = 1e5 / 1.3;
      for (int p = 0; p < count; p++) {
        /* Linear shapes give APIC's matrix back but near nodes (mpm_shape_affine); gradients are exact with all. */
        for (int i = 0; i < dimension; i++)
          for (int j = 0; j < dimension; j++)
            AT_MOST(fabs(points[p].velocity_gradient[3 * i + j] - gradient[3 * i + j]), 1e-12);
        for (int i = 0; i < dimension; i++)
          AT_MOST(fabs(points[p].stress[i] - dt * (lambda * trace + twice_mu * gradient[4 * i])), 1e-9);
      }
      free(points);
      mpm_destroy(mpm);
    }
    law.destroy(law.content);
  }
}

/* Of one step from random points: sum_I f_I v_I + sum_p V sigma : L over the sum of the latter's moduli; and, as *without, the
 * same if the law had seen the points' own L, which `own_gradient` has. */
static double power_defect(Mpm *mpm, MpmPoint *points, int count, const double *own_gradient, double *without) {
  const int dimension = mpm->scene.dimension;
  double of_nodes = 0.0, of_points = 0.0, of_own = 0.0, scale = 0.0;
  for (int n = 0; n < mpm->grid.nodes; n++)
    for (int i = 1; i <= dimension; i++)
      of_nodes += mpm->grid.sum[n][0] * mpm->grid.rate[n][i] * mpm->grid.state[n][i];
  static const int voigt[3][3] = {{0, 3, 4}, {3, 1, 5}, {4, 5, 2}};
  for (int p = 0; p < count; p++) {
    const double *f = points[p].deformation_gradient;
    const double volume = points[p].volume0 * (f[0] * (f[4] * f[8] - f[5] * f[7]) - f[1] * (f[3] * f[8] - f[5] * f[6]) +
                                               f[2] * (f[3] * f[7] - f[4] * f[6]));
    for (int i = 0; i < dimension; i++)
      for (int j = 0; j < dimension; j++) {
        const double stress = volume * points[p].stress[voigt[i][j]];
        of_points += stress * points[p].velocity_gradient[3 * i + j];
        of_own += stress * own_gradient[9 * p + 3 * i + j];
        scale += fabs(stress * points[p].velocity_gradient[3 * i + j]);
      }
  }
  *without = fabs(of_nodes + of_own) / scale;
  return fabs(of_nodes + of_points) / scale;
}

/* Volumes change by percents in the step: the weights of the gradient are those before it, those of the force are the ones after. */
static void forces_do_the_work_that_the_law_sees(void **state) {
  (void)state;
  for (int dimension = 2; dimension <= 3; dimension++) {
    MpmLaw law = make_law(dimension, 0.3);
    for (int shape = 0; shape < 3; shape++) {
      double own_gradient[9 * 400], without;
      Mpm *mpm;
      int count;
      for (int volumetric = MPM_VOLUMETRIC_POINT; volumetric <= MPM_VOLUMETRIC_CELL; volumetric++) {
        const MpmScene scene = make_scene(dimension, (MpmShape)shape, MPM_TRANSFER_FLIP, (MpmVolumetric)volumetric);
        OK(mpm_create(&scene, &law, NULL, &mpm));
        MpmPoint *points = make_random(dimension, dimension == 3 ? 7 : 16, &count);
        assert_true(count <= 400);
        OK(mpm_step(mpm, points, count, 1e-3));
        for (int p = 0; p < count && volumetric == MPM_VOLUMETRIC_POINT; p++)
          memcpy(own_gradient + 9 * p, points[p].velocity_gradient, sizeof points[p].velocity_gradient);
        AT_MOST(power_defect(mpm, points, count, own_gradient, &without), 1e-14);
        if (volumetric == MPM_VOLUMETRIC_CELL && !(without > 1e-5)) fail_msg("means change the power by %g only", without);
        free(points);
        mpm_destroy(mpm);
      }
    }
    law.destroy(law.content);
  }
}

static MpmPoint *run_random(MpmScene scene, int threads, int edge, double size, int *count) {
  MpmLaw law = make_law(scene.dimension, 0.3);
  Mpm *mpm;
  scene.threads = threads;
  OK(mpm_create(&scene, &law, NULL, &mpm));
  MpmPoint *points = make_random(scene.dimension, edge, count);
  for (int p = 0; p < *count; p++)
    for (int i = 0; i < scene.dimension; i++) points[p].position[i] *= size / 0.05, points[p].velocity[i] *= 0.1;
  for (int s = 0; s < 8; s++) OK(mpm_step(mpm, points, *count, 1e-4));
  mpm_destroy(mpm);
  law.destroy(law.content);
  return points;
}

static void a_point_alone_in_its_cell_keeps_its_own(void **state) {
  (void)state;
  for (int dimension = 2; dimension <= 3; dimension++)
    for (int shape = 0; shape < 3; shape++) {
      int count;
      MpmScene scene = make_scene(dimension, (MpmShape)shape, MPM_TRANSFER_FLIP, MPM_VOLUMETRIC_POINT);
      MpmPoint *own = run_random(scene, 1, 6, 0.4, &count); /* points 0.4 apart, cells of 0.1: they share nodes only */
      scene.volumetric = MPM_VOLUMETRIC_CELL;
      MpmPoint *mean = run_random(scene, 1, 6, 0.4, &count);
      assert_memory_equal(own, mean, (size_t)count * sizeof *own);
      free(own), free(mean);
    }
}

static void results_do_not_depend_on_threads(void **state) {
  (void)state;
  for (int dimension = 2; dimension <= 3; dimension++)
    for (int shape = 0; shape < 3; shape++)
      for (int order = 0; order < 3; order++) {
        int count;
        MpmScene scene = make_scene(dimension, (MpmShape)shape, MPM_TRANSFER_FLIP, MPM_VOLUMETRIC_CELL);
        scene.order = (MpmOrder)order;
        const int edge = dimension == 3 ? 15 : 50; /* more than 2,000 points: the threads do start */
        MpmPoint *one = run_random(scene, 1, edge, 0.05, &count), *two = run_random(scene, 2, edge, 0.05, &count);
        assert_memory_equal(one, two, (size_t)count * sizeof *one);
        free(one), free(two);
      }
}

/* ------------------------------------------------------------------------------------------------------ locking
 *
 * A square under a body force, held at its border. Displacement and stress are exact: u = rot psi with psi = sin^2(pi x) sin^2(pi
 * y) has no divergence and vanishes at the border, so -mu lap u is the force for every Poisson's ratio, and the pressure is 0. */
static const double AMOUNT = 1e-4, MU = 1e5;

static void exact_displacement(const double x[3], double u[2]) {
  const double sx = sin(PI * x[0]), sy = sin(PI * x[1]);
  u[0] = AMOUNT * sx * sx * sin(2 * PI * x[1]);
  u[1] = -AMOUNT * sin(2 * PI * x[0]) * sy * sy;
}

static void body_force(const double x[3], double b[2]) {
  const double cx = cos(2 * PI * x[0]), cy = cos(2 * PI * x[1]), k = AMOUNT * MU * 2 * PI * PI;
  b[0] = -k * (2 * cx - 1) * sin(2 * PI * x[1]);
  b[1] = k * sin(2 * PI * x[0]) * (2 * cy - 1);
}

typedef struct Locking {
  double displacement; /* error, root mean square over that of the exact one */
  double pressure;     /* root mean square over 2 pi mu times the amount, the largest deviator's size */
  double checkerboard; /* of it, what alternates from cell to cell along both axes: root mean square over 2 x 2 cells */
} Locking;

static double find_checkerboard(const double *cell, int cells) {
  double sum = 0.0;
  for (int j = 0; j + 1 < cells; j++)
    for (int i = 0; i + 1 < cells; i++) {
      const double *c = cell + i + cells * j, alternating = 0.25 * (c[0] - c[1] - c[cells] + c[cells + 1]);
      sum += alternating * alternating;
    }
  return sqrt(sum) / (cells - 1);
}

static Locking solve_square(MpmShape shape, MpmVolumetric volumetric, double poisson, int cells) {
  MpmScene scene = make_scene(2, shape, MPM_TRANSFER_FLIP, volumetric);
  scene.spacing = 1.0 / cells;
  const double density = 1000.0, shear = sqrt(MU / density), slowest = 2.0 * PI * 1.2 * shear;
  scene.grid_damping = 2.0 * slowest;
  MpmLaw law = elastic_law(MPM_ELASTIC_PLANE_STRAIN, 2 * MU * (1 + poisson), poisson);
  Mpm *mpm;
  int count;
  OK(mpm_create(&scene, &law, NULL, &mpm));
  MpmWall wall[4];
  for (int w = 0; w < 4; w++) wall[w] = plane_wall(w / 2, w % 2, w % 2 ? -1.0 : 1.0, MPM_WALL_NO_SLIP);
  OK(mpm_set_walls(mpm, wall, 4));
  const int number[3] = {2 * cells, 2 * cells, 1};
  MpmPoint *points = make_box(2, (double[3]){0, 0, 0}, number, 0.5 / cells, density, 1, &count);
  MpmPoint *start = malloc((size_t)count * sizeof *start);
  for (int p = 0; p < count; p++) {
    double b[2];
    body_force(points[p].position, b);
    for (int i = 0; i < 2; i++) points[p].force[i] = b[i] * points[p].volume0;
  }
  memcpy(start, points, (size_t)count * sizeof *start);
  const double modulus = 2 * MU * (1 - poisson) / (1 - 2 * poisson);
  const double dt = 0.4 * scene.spacing * sqrt(density / modulus);
  OK(mpm_attach(mpm, points, count));
  for (double t = 0.0; t < 20.0 / slowest; t += dt) OK(mpm_advance(mpm, dt));
  mpm_write(mpm);
  Locking result = {0};
  double exact = 0.0, mean[16 * 16] = {0};
  assert_true(cells <= 16);
  for (int p = 0; p < count; p++) {
    double u[2];
    exact_displacement(start[p].position, u);
    for (int i = 0; i < 2; i++) {
      const double error = points[p].position[i] - start[p].position[i] - u[i];
      result.displacement += error * error, exact += u[i] * u[i];
    }
    const double pressure = -0.5 * (points[p].stress[0] + points[p].stress[1]) / (2 * PI * MU * AMOUNT);
    result.pressure += pressure * pressure / count;
    mean[(int)(start[p].position[0] * cells) + cells * (int)(start[p].position[1] * cells)] += 0.25 * pressure;
  }
  result = (Locking){sqrt(result.displacement / exact), sqrt(result.pressure), find_checkerboard(mean, cells)};
  free(points), free(start);
  mpm_destroy(mpm);
  law.destroy(law.content);
  return result;
}

/* Measured on 8 x 8 cells of four points, at Poisson's ratio 0.3 and 0.4999. Undeformed domains of uGIMP of half a cell that do not
 * cross a border have linear shape functions, hence the same numbers. At 0.4999 points alone lock; with means the error is that of
 * 0.3. B-splines do not resolve the held border, which is most of their error with either. */
static void incompressible_bodies_no_longer_lock(void **state) {
  (void)state;
  const struct { const char *name; double locked, soft, soft_means, means; } shape[3] = {
      {"linear", 0.98, 0.081, 0.060, 0.061}, {"uGIMP", 0.98, 0.081, 0.060, 0.061}, {"B-spline", 0.434, 0.147, 0.150, 0.153}};
  for (int s = 0; s < 3; s++) {
    const Locking soft = solve_square((MpmShape)s, MPM_VOLUMETRIC_POINT, 0.3, 8);
    const Locking soft_means = solve_square((MpmShape)s, MPM_VOLUMETRIC_CELL, 0.3, 8);
    const Locking locked = solve_square((MpmShape)s, MPM_VOLUMETRIC_POINT, 0.4999, 8);
    const Locking means = solve_square((MpmShape)s, MPM_VOLUMETRIC_CELL, 0.4999, 8);
    printf("%-8s error of displacement, 0.3: %.3f, means %.3f; 0.4999: %.3f, means %.3f; pressure at 0.4999: %.2f, means %.3f, of it "
           "checkerboard %.3f\n", shape[s].name, soft.displacement, soft_means.displacement, locked.displacement, means.displacement,
           locked.pressure, means.pressure, means.checkerboard);
    AT_MOST(fabs(soft.displacement / shape[s].soft - 1.0), 0.05);
    AT_MOST(fabs(soft_means.displacement / shape[s].soft_means - 1.0), 0.05);
    AT_MOST(fabs(locked.displacement / shape[s].locked - 1.0), 0.05);
    AT_MOST(fabs(means.displacement / shape[s].means - 1.0), 0.05);
    /* The exact one is 0. With linear shape functions nearly all that is left is the same in all cells: a held box hides it. */
    AT_MOST(means.pressure, s == MPM_SHAPE_LINEAR ? 0.2 : 0.04);
    AT_MOST(means.checkerboard, 0.01);
  }
  /* Second order. */
  AT_MOST(solve_square(MPM_SHAPE_GIMP, MPM_VOLUMETRIC_CELL, 0.4999, 16).displacement, 0.0155);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(uniform_strain_is_unchanged),
      cmocka_unit_test(forces_do_the_work_that_the_law_sees),
      cmocka_unit_test(a_point_alone_in_its_cell_keeps_its_own),
      cmocka_unit_test(results_do_not_depend_on_threads),
      cmocka_unit_test(incompressible_bodies_no_longer_lock),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
