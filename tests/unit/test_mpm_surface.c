/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Thin walls of facets: segments in 2D, triangles in 3D. */
#include "block_help.h"

static const double GRAVITY = 10.0;

static MpmFacet segment(double x0, double y0, double x1, double y1) {
  return (MpmFacet){.node = {{x0, y0, 0.0}, {x1, y1, 0.0}}};
}

static MpmWall surface_wall(MpmFacet *facets, int count, int dimension, MpmWallContact contact) {
  OK(mpm_facets_prepare(facets, count, dimension));
  MpmWall wall = mpm_wall_default();
  wall.kind = MPM_WALL_SURFACE;
  wall.facets = facets, wall.facet_count = count;
  wall.contact = contact;
  return wall;
}

/* The block of block_help.h, turned so that it stands on a slope that rises to the left; its lower left corner at
 * `corner`. */
static void turn_block(Block *block, double angle, const double corner[2]) {
  for (int p = 0; p < block->count; p++) {
    double *x = block->points[p].position, along = x[0], up = x[1];
    x[0] = corner[0] + along * cos(angle) + up * sin(angle);
    x[1] = corner[1] - along * sin(angle) + up * cos(angle);
  }
}

/* Gravity, along and into a slope. */
static void pull(Block *block, double angle, double along, double into) {
  for (int p = 0; p < block->count; p++) {
    block->points[p].force[0] = block->points[p].mass * (along * cos(angle) - into * sin(angle));
    block->points[p].force[1] = block->points[p].mass * (-along * sin(angle) - into * cos(angle));
  }
}

static void run_block(Block *block, int steps) {
  for (int s = 0; s < steps; s++) OK(mpm_step(block->mpm, block->points, block->count, block->dt));
}

static double least_height(const Block *block, double angle, const double corner[2]) {
  double least = INFINITY;
  for (int p = 0; p < block->count; p++) {
    const double *x = block->points[p].position;
    least = fmin(least, (x[0] - corner[0]) * sin(angle) + (x[1] - corner[1]) * cos(angle));
  }
  return least;
}

/* Pressed onto a slope, then let go: acceleration down the slope over `time`. */
static double slide_down(double angle, double friction, MpmTransfer transfer, double time, double *height) {
  const double low[3] = {0.0, 0.0, 0.0}, corner[2] = {-0.031, 0.017};
  Block block;
  make_block(&block, transfer, 1e6, 0.0, low);
  turn_block(&block, angle, corner);
  const double reach = 20.0;
  MpmFacet slope = segment(corner[0] + reach * cos(angle), corner[1] - reach * sin(angle),
                           corner[0] - reach * cos(angle), corner[1] + reach * sin(angle));
  MpmWall wall = surface_wall(&slope, 1, 2, MPM_WALL_FRICTION);
  wall.friction = friction;
  OK(mpm_set_walls(block.mpm, &wall, 1));
  for (int s = 0; s < 4000; s++) {
    pull(&block, angle, 0.0, GRAVITY * cos(angle) * fmin(1.0, s / 2000.0));
    run_block(&block, 1);
  }
  pull(&block, angle, GRAVITY * sin(angle), GRAVITY * cos(angle));
  const double start = mean_velocity(&block, 0) * cos(angle) - mean_velocity(&block, 1) * sin(angle);
  const int steps = (int)(time / block.dt);
  run_block(&block, steps);
  const double end = mean_velocity(&block, 0) * cos(angle) - mean_velocity(&block, 1) * sin(angle);
  *height = least_height(&block, angle, corner);
  free_block(&block);
  return (end - start) / (steps * block.dt);
}

static void a_block_slides_down_a_slope_as_coulomb_says(void **state) {
  (void)state;
  for (int degrees = 30; degrees <= 45; degrees += 15)
    for (int transfer = MPM_TRANSFER_FLIP; transfer <= MPM_TRANSFER_APIC; transfer++) {
      const double angle = degrees * PI / 180.0, frictions[3] = {0.0, 0.3, 1.2};
      for (int f = 0; f < 3; f++) {
        double height;
        const double exact = fmax(0.0, GRAVITY * (sin(angle) - frictions[f] * cos(angle)));
        const double found = slide_down(angle, frictions[f], (MpmTransfer)transfer, 0.4, &height);
        printf("slope %d degrees, friction %.1f, transfer %d: acceleration %.4f, exact %.4f, lowest point %.4f\n", degrees,
               frictions[f], transfer, found, exact, height);
      }
    }
}

static void a_block_rests_on_a_slope_without_creep(void **state) {
  (void)state;
  for (int degrees = 15; degrees <= 45; degrees += 15)
    for (int transfer = MPM_TRANSFER_FLIP; transfer <= MPM_TRANSFER_APIC; transfer++) {
      const double angle = degrees * PI / 180.0, low[3] = {0.0, 0.0, 0.0}, corner[2] = {-0.031, 0.017}, reach = 20.0;
      Block block;
      make_block(&block, (MpmTransfer)transfer, 1e6, 20.0, low);
      turn_block(&block, angle, corner);
      MpmFacet slope = segment(corner[0] - reach * cos(angle), corner[1] + reach * sin(angle),
                               corner[0] + reach * cos(angle), corner[1] - reach * sin(angle));
      MpmWall wall = surface_wall(&slope, 1, 2, MPM_WALL_FRICTION);
      wall.friction = 1.2;
      OK(mpm_set_walls(block.mpm, &wall, 1));
      for (int s = 0; s < 10000; s++) {
        pull(&block, angle, GRAVITY * sin(angle) * fmin(1.0, s / 2000.0), GRAVITY * cos(angle) * fmin(1.0, s / 2000.0));
        run_block(&block, 1);
      }
      double before = 0.0, after = 0.0, height = least_height(&block, angle, corner);
      for (int p = 0; p < block.count; p++) before += block.points[p].position[0] / block.count;
      run_block(&block, 20000);
      for (int p = 0; p < block.count; p++) after += block.points[p].position[0] / block.count;
      printf("%d degrees, transfer %d: creep in %.1f s %.2e m, height %.4f %.4f  reaction %g %g power %g\n", degrees, transfer, 20000 * block.dt, after - before, height,
       least_height(&block, angle, corner), wall.reaction[0]/(block.mass*GRAVITY), wall.reaction[1]/(block.mass*GRAVITY), wall.power_friction);
      free_block(&block);
    }
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(a_block_slides_down_a_slope_as_coulomb_says),
      cmocka_unit_test(a_block_rests_on_a_slope_without_creep),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
