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
        printf("slope %d degrees, friction %.1f, transfer %d: acceleration %.4f, exact %.4f, lowest point %.4f\n",
               degrees, frictions[f], transfer, found, exact, height);
        /* Sliding: the block also rocks and shears. Sticking: it swings as it is let go, up to 0.1 m/s of shear. */
        AT_MOST(fabs(found - exact), f == 0 ? 1e-6 * GRAVITY : f == 1 ? 0.01 * GRAVITY : 0.1 / 0.4);
        assert_true(height > 0.02 && height < 0.03); /* half a point's width of 0.05 */
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
      const double creep = after - before;
      printf("rest on %d degrees, transfer %d: creep in %.0f s %.1e m, lowest point %.4f, then %.4f\n", degrees,
             transfer, 20000 * block.dt, creep, height, least_height(&block, angle, corner));
      /* At 45 degrees, friction 1.2 is little more than what holds it: the lower edge carries nearly everything. */
      AT_MOST(fabs(creep), degrees == 45 ? 5e-3 : 1e-5);
      AT_MOST(fabs(least_height(&block, angle, corner) - height), 1e-3);
      AT_MOST(fabs(wall.reaction[1] / (block.mass * GRAVITY) - 1.0), 1e-3);
      AT_MOST(fabs(wall.reaction[0] / (block.mass * GRAVITY)), 1e-3);
      free_block(&block);
    }
}

/* Runs the same block on two walls and compares every bit. */
static void compare_blocks(MpmWall one, MpmWall other, double gravity, const double low[3]) {
  Block block[2];
  for (int b = 0; b < 2; b++) {
    make_block(&block[b], MPM_TRANSFER_FLIP, 1e6, 1.0, low);
    OK(mpm_set_walls(block[b].mpm, b == 0 ? &one : &other, 1));
    for (int p = 0; p < block[b].count; p++) block[b].points[p].velocity[0] = 0.5;
    apply_gravity(&block[b], gravity);
    run_block(&block[b], 3000);
  }
  for (int p = 0; p < block[0].count; p++) {
    assert_memory_equal(block[0].points[p].position, block[1].points[p].position, sizeof(double[3]));
    assert_memory_equal(block[0].points[p].stress, block[1].points[p].stress, sizeof(double[6]));
  }
  assert_memory_equal(one.reaction, other.reaction, sizeof one.reaction);
  assert_true(one.power_friction == other.power_friction && fabs(one.reaction[1]) > 0.0);
  for (int b = 0; b < 2; b++) free_block(&block[b]);
}

static void a_level_segment_is_a_plane_to_the_last_bit(void **state) {
  (void)state;
  const double above[3] = {0.02, 0.0, 0.0}, below[3] = {0.02, -0.2, 0.0};
  MpmWall plane = plane_wall(1, 0.0, 1.0, MPM_WALL_FRICTION);
  plane.friction = 0.3;
  /* one segment; a chain; drawn to the left */
  MpmFacet facets[4] = {segment(-5.0, 0.0, 9.0, 0.0), segment(-5.0, 0.0, 0.25, 0.0), segment(0.25, 0.0, 9.0, 0.0),
                        segment(9.0, 0.0, -5.0, 0.0)};
  for (int k = 0; k < 3; k++) {
    MpmWall wall = k == 0 ? surface_wall(facets, 1, 2, MPM_WALL_FRICTION)
                 : k == 1 ? surface_wall(facets + 1, 2, 2, MPM_WALL_FRICTION)
                          : surface_wall(facets + 3, 1, 2, MPM_WALL_FRICTION);
    wall.friction = 0.3;
    plane.normal[1] = 1.0;
    compare_blocks(plane, wall, 10.0, above);
    plane.normal[1] = -1.0; /* the same wall holds a block under it that is pressed up */
    compare_blocks(plane, wall, -10.0, below);
  }
}

/* Three dimensions: a slope of two triangles against a plane with the same normal. */
static void two_triangles_are_a_plane(void **state) {
  (void)state;
  const double low[3] = {0.0, 0.0, 0.0}, normal[3] = {0.48, 0.0, 0.64 / 0.8};
  const double length = sqrt(normal[0] * normal[0] + normal[2] * normal[2]);
  const int number[3] = {6, 6, 4};
  MpmLaw law = elastic_law(MPM_ELASTIC_3D, 1e6, 0.2);
  MpmPoint *points[2];
  double reaction[2];
  for (int b = 0; b < 2; b++) {
    MpmScene scene = mpm_scene_default();
    scene.dimension = 3, scene.spacing = 0.1, scene.pic_fraction = 0.01;
    Mpm *mpm;
    int count;
    OK(mpm_create(&scene, &law, NULL, &mpm));
    points[b] = make_box(3, low, number, 0.05, 1000.0, 1, &count);
    MpmWall plane = plane_wall(2, 0.0, 1.0, MPM_WALL_SLIP);
    const double across[3] = {3.0, 0.0, -3.0 * normal[0] / normal[2]};
    for (int i = 0; i < 3; i++) plane.normal[i] = normal[i] / length;
    const double x = across[0], z = across[2];
    MpmFacet facets[2] = {{.node = {{-x, -2, -z}, {x, -2, z}, {x, 2, z}}}, {.node = {{-x, -2, -z}, {x, 2, z}, {-x, 2, -z}}}};
    MpmWall wall = surface_wall(facets, 2, 3, MPM_WALL_SLIP);
    for (int p = 0; p < count; p++) {
      points[b][p].position[2] += 0.3;
      points[b][p].force[2] = -10.0 * points[b][p].mass;
    }
    OK(mpm_initialise(mpm, points[b], count));
    OK(mpm_set_walls(mpm, b == 0 ? &plane : &wall, 1));
    for (int s = 0; s < 1500; s++) OK(mpm_step(mpm, points[b], count, 3e-4));
    reaction[b] = b == 0 ? plane.reaction[2] : wall.reaction[2];
    mpm_destroy(mpm);
  }
  /* The surface also holds nodes less than half a cell above it: the cube meets it a little earlier. */
  double mean[2] = {0.0, 0.0}, speed[2] = {0.0, 0.0};
  for (int b = 0; b < 2; b++)
    for (int p = 0; p < 144; p++) mean[b] += points[b][p].position[2] / 144, speed[b] += points[b][p].velocity[0] / 144;
  printf("3D slope: height %.4f plane, %.4f triangles; speed %.4f, %.4f; reaction %.1f, %.1f\n", mean[0], mean[1],
         speed[0], speed[1], reaction[0], reaction[1]);
  assert_true(reaction[1] > 0.0);
  AT_MOST(fabs(mean[1] - mean[0]), 0.01);
  AT_MOST(fabs(speed[1] / speed[0] - 1.0), 0.05);
  for (int b = 0; b < 2; b++) free(points[b]);
  law.destroy(law.content);
}

/* Speed gained downwards in `steps` steps, over that of free fall. */
static double fall(Block *block, int steps) {
  const double before = mean_velocity(block, 1);
  run_block(block, steps);
  return (before - mean_velocity(block, 1)) / (GRAVITY * steps * block->dt);
}

/* A block that slides off the lower end of a slope falls freely once all points are past the end. */
static void the_end_of_a_slope_lets_go(void **state) {
  (void)state;
  for (int degrees = 0; degrees <= 75; degrees += 15) {
    const double angle = degrees * PI / 180.0, low[3] = {0.0, 0.0, 0.0};
    const double corner[2] = {-0.45 * cos(angle), 0.45 * sin(angle)};
    Block block;
    make_block(&block, MPM_TRANSFER_FLIP, 1e6, 0.0, low);
    turn_block(&block, angle, corner);
    MpmFacet slope = segment(-3.0 * cos(angle), 3.0 * sin(angle), 0.0, 0.0);
    MpmWall wall = surface_wall(&slope, 1, 2, MPM_WALL_SLIP);
    OK(mpm_set_walls(block.mpm, &wall, 1));
    apply_gravity(&block, GRAVITY);
    for (int p = 0; p < block.count; p++) {
      block.points[p].velocity[0] = 2.0 * cos(angle);
      block.points[p].velocity[1] = -2.0 * sin(angle);
    }
    double fastest = 0.0;
    for (int s = 0; s < (int)(0.5 / block.dt); s++) {
      run_block(&block, 1);
      for (int p = 0; p < block.count; p++)
        fastest = fmax(fastest, hypot(block.points[p].velocity[0], block.points[p].velocity[1]));
    }
    AT_MOST(fastest, 2.0 * (2.0 + GRAVITY * 0.5)); /* nothing kicks it */
    AT_MOST(fabs(fall(&block, 100) - 1.0), 1e-9);
    free_block(&block);
  }
}

/* A cell beside the end a block falls past it untouched. */
static void the_end_of_a_slope_does_not_reach_further(void **state) {
  (void)state;
  for (int degrees = 0; degrees <= 75; degrees += 15) {
    const double angle = degrees * PI / 180.0, low[3] = {0.125, 0.2, 0.0};
    Block block;
    make_block(&block, MPM_TRANSFER_FLIP, 1e6, 0.0, low);
    MpmFacet slope = segment(-3.0 * cos(angle), 3.0 * sin(angle), 0.0, 0.0);
    MpmWall wall = surface_wall(&slope, 1, 2, MPM_WALL_SLIP);
    OK(mpm_set_walls(block.mpm, &wall, 1));
    apply_gravity(&block, GRAVITY);
    AT_MOST(fabs(fall(&block, (int)(0.3 / block.dt)) - 1.0), 1e-9);
    free_block(&block);
  }
}

/* A soft body in a hopper of two walls at 45 degrees. Outlet open: it sags through; closed: it lies in the corner for
 * 20,000 steps. No point goes through a wall. */
static void nothing_leaks_through_a_hopper(void **state) {
  (void)state;
  const double low[3] = {-0.2, 0.1, 0.0};
  for (int is_closed = 0; is_closed < 2; is_closed++)
    for (int transfer = MPM_TRANSFER_FLIP; transfer <= MPM_TRANSFER_APIC; transfer++) {
      Block block;
      make_block(&block, (MpmTransfer)transfer, 1.5e4, 1.0, low);
      const double end = is_closed ? 0.0 : 0.1;
      MpmFacet facets[2] = {segment(-1.0, 0.927, -end, end - 0.073), segment(end, end - 0.073, 1.0, 0.927)};
      MpmWall wall = surface_wall(facets, 2, 2, MPM_WALL_FRICTION);
      wall.friction = 0.2;
      OK(mpm_set_walls(block.mpm, &wall, 1));
      apply_gravity(&block, GRAVITY);
      double least = INFINITY, lowest = INFINITY;
      for (int s = 0; s < 20000 && (is_closed || lowest > -1.0); s++) {
        run_block(&block, 1);
        for (int p = 0; p < block.count; p++) {
          const double *x = block.points[p].position;
          if (x[1] > end - 0.073) least = fmin(least, (x[1] + 0.073 - fabs(x[0])) * sqrt(0.5));
          lowest = fmin(lowest, x[1]);
        }
      }
      const double load = wall.reaction[1] / (GRAVITY * block.mass);
      printf("hopper, %s, transfer %d: least height over the walls %.4f, lowest point %.3f, load %.3f of the weight\n",
             is_closed ? "closed" : "open", transfer, least, lowest, load);
      assert_true(least > 0.0);
      if (is_closed) AT_MOST(fabs(load - 1.0), 0.01);
      else assert_true(lowest < -1.0);
      free_block(&block);
    }
}

/* Blocks on both sides of a thin wall: the upper one rests, the lower one, more than two cells below, falls freely. */
static void a_thin_wall_parts_its_two_sides(void **state) {
  (void)state;
  const double low[3] = {0.0, 0.0, 0.0}, below[3] = {0.0, -0.45, 0.0};
  const int number[3] = {8, 4, 1};
  Block block;
  make_block(&block, MPM_TRANSFER_FLIP, 1e6, 0.0, low);
  int count;
  MpmPoint *lower = make_box(2, below, number, 0.05, 1000.0, 100, &count);
  MpmPoint *both = malloc((size_t)(block.count + count) * sizeof *both);
  assert_non_null(both);
  memcpy(both, block.points, (size_t)block.count * sizeof *both);
  memcpy(both + block.count, lower, (size_t)count * sizeof *both);
  OK(mpm_initialise(block.mpm, both, block.count + count));
  MpmFacet facet = segment(-1.0, 0.0, 2.0, 0.0);
  MpmWall wall = surface_wall(&facet, 1, 2, MPM_WALL_SLIP);
  OK(mpm_set_walls(block.mpm, &wall, 1));
  const int steps = (int)(0.2 / block.dt);
  for (int p = 0; p < block.count + count; p++) both[p].force[1] = -10.0 * both[p].mass;
  for (int s = 0; s < steps; s++) OK(mpm_step(block.mpm, both, block.count + count, block.dt));
  double speed = 0.0, upper = INFINITY;
  for (int p = 0; p < count; p++) speed += both[block.count + p].velocity[1] / count;
  for (int p = 0; p < block.count; p++) upper = fmin(upper, both[p].position[1]);
  AT_MOST(fabs(speed + 10.0 * steps * block.dt), 1e-9);
  assert_true(upper > 0.02);
  free(lower);
  free(both);
  free_block(&block);
}

/* A square of 2 m, turned, on a slope: heat that has entered it through the wall after `time`. rho c = k = 1. */
static double heat_through_slope(double angle, MpmWallHeat kind, double time) {
  const double low[3] = {0.0, 0.0, 0.0}, corner[2] = {-0.031, 0.017};
  const int number[3] = {40, 40, 1};
  MpmElastic elastic = {
      .mode = MPM_ELASTIC_PLANE_STRAIN, .young = 1.0, .thermal = 1, .conductivity = {1, 1, 1, 0, 0, 0}};
  MpmLaw law;
  OK(mpm_elastic_create(&elastic, &law));
  MpmScene scene = mpm_scene_default();
  scene.dimension = 2, scene.spacing = 0.1, scene.thermal = 1, scene.mechanical = 0;
  Block block = {.law = law};
  OK(mpm_create(&scene, &block.law, NULL, &block.mpm));
  block.points = make_box(2, low, number, 0.05, 1.0, 1, &block.count);
  turn_block(&block, angle, corner);
  for (int p = 0; p < block.count; p++) { /* their faces have turned, too */
    double *f = block.points[p].deformation_gradient;
    f[0] = f[4] = cos(angle), f[1] = sin(angle), f[3] = -sin(angle);
  }
  OK(mpm_initialise(block.mpm, block.points, block.count));
  MpmFacet slope = segment(corner[0] - 9.0 * cos(angle), corner[1] + 9.0 * sin(angle), corner[0] + 9.0 * cos(angle),
                           corner[1] - 9.0 * sin(angle));
  MpmWall wall = surface_wall(&slope, 1, 2, MPM_WALL_NO_CONTACT);
  wall.heat = kind;
  wall.temperature = wall.flux = 1.0;
  OK(mpm_set_walls(block.mpm, &wall, 1));
  block.dt = 1e-3;
  double entered = 0.0, held = 0.0;
  for (int s = 0; s < (int)(time / block.dt + 0.5); s++) {
    run_block(&block, 1);
    entered += wall.heat_flow * block.dt;
  }
  for (int p = 0; p < block.count; p++) held += block.points[p].mass * block.points[p].temperature;
  AT_MOST(fabs(held - entered), 1e-9);
  free_block(&block);
  return entered;
}

static void a_warm_slope_heats_what_lies_on_it(void **state) {
  (void)state;
  for (int degrees = 0; degrees <= 45; degrees += 15) {
    const double angle = degrees * PI / 180.0, time = 0.2;
    const double half_space = 2.0 * 2.0 * sqrt(time / PI), flux = 2.0 * time;
    const double warm = heat_through_slope(angle, MPM_WALL_TEMPERATURE, time);
    const double driven = heat_through_slope(angle, MPM_WALL_FLUX, time);
    printf("slope of %d degrees: heat %.4f of a warm wall, half space %.4f; %.4f of a flux of %.4f\n", degrees, warm,
           half_space, driven, flux);
    /* 10 % is the error of a level wall, too: the diffusion length is 4 cells. */
    AT_MOST(fabs(warm / half_space - 1.0), 0.11);
    AT_MOST(fabs(driven / flux - 1.0), 1e-9);
  }
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(a_block_slides_down_a_slope_as_coulomb_says),
      cmocka_unit_test(a_block_rests_on_a_slope_without_creep),
      cmocka_unit_test(a_level_segment_is_a_plane_to_the_last_bit),
      cmocka_unit_test(two_triangles_are_a_plane),
      cmocka_unit_test(the_end_of_a_slope_lets_go),
      cmocka_unit_test(the_end_of_a_slope_does_not_reach_further),
      cmocka_unit_test(nothing_leaks_through_a_hopper),
      cmocka_unit_test(a_thin_wall_parts_its_two_sides),
      cmocka_unit_test(a_warm_slope_heats_what_lies_on_it),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
