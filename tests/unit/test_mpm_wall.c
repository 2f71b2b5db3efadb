/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Walls and tractions. */
#include "block_help.h"

/* Lets the block come to rest on the floor, then gives it a speed of 1 m/s; returns the mean deceleration over `time`.
 */
static double slide(MpmTransfer transfer, MpmWallContact contact, double friction, double time, double *heat_error) {
  const double low[3] = {0.02, 0.0, 0.0}, gravity = 10.0;
  Block block;
  make_block(&block, transfer, 1e6, 0.0, low);
  MpmWall floor = plane_wall(1, 0.0, 1.0, contact);
  floor.friction = friction;
  OK(mpm_set_walls(block.mpm, &floor, 1));
  for (int s = 0; s < 4000; s++) {
    apply_gravity(&block, gravity * fmin(1.0, s / 2000.0));
    OK(mpm_step(block.mpm, block.points, block.count, block.dt));
  }
  for (int p = 0; p < block.count; p++) block.points[p].velocity[0] += 1.0;
  const double start = mean_velocity(&block, 0);
  double work = 0.0, impulse = 0.0;
  const int steps = (int)(time / block.dt);
  for (int s = 0; s < steps; s++) {
    OK(mpm_step(block.mpm, block.points, block.count, block.dt));
    work += block.dt * floor.power_friction;
    impulse += block.dt * floor.reaction[0];
  }
  const double end = mean_velocity(&block, 0);
  /* The wall's tangential impulse is what the body lost; its work is friction heat. */
  AT_MOST(fabs(impulse - block.mass * (end - start)), 1e-10 * block.mass);
  const double lost = 0.5 * block.mass * (start * start - end * end);
  *heat_error = lost > 0.0 ? fabs(work - lost) / lost : fabs(work);
  free_block(&block);
  return (start - end) / (steps * block.dt);
}

static void a_sliding_block_decelerates_by_mu_g(void **state) {
  (void)state;
  const MpmTransfer transfers[3] = {MPM_TRANSFER_FLIP, MPM_TRANSFER_APIC, MPM_TRANSFER_XPIC};
  for (int t = 0; t < 3; t++) {
    double heat_error;
    const double deceleration = slide(transfers[t], MPM_WALL_FRICTION, 0.3, 0.2, &heat_error);
    printf("sliding block, transfer %d: deceleration %.4f of mu g = 3, friction work off by %.2e\n", t, deceleration,
           heat_error);
    AT_MOST(fabs(deceleration / 3.0 - 1.0), 0.01);
    /* The block also rocks and shears: a few per cent of its loss is elastic, not heat. */
    AT_MOST(heat_error, 0.05);
  }
}

static void slip_does_not_brake_and_no_slip_stops(void **state) {
  (void)state;
  double unused;
  /* 1e-13 per step's round-off of the mean over thousands of steps. */
  AT_MOST(fabs(slide(MPM_TRANSFER_FLIP, MPM_WALL_SLIP, 0.0, 0.2, &unused)), 1e-9);
  /* No-slip: the block of height 0.2 swings like a shear beam around zero; APIC has damped that after 25 periods. */
  AT_MOST(fabs(slide(MPM_TRANSFER_APIC, MPM_WALL_NO_SLIP, 0.0, 1.0, &unused) - 1.0), 0.02);
}

static void the_floor_carries_the_weight_and_lets_go(void **state) {
  (void)state;
  const double low[3] = {0.02, 0.0, 0.0};
  const MpmWallContact contacts[3] = {MPM_WALL_NO_SLIP, MPM_WALL_SLIP, MPM_WALL_FRICTION};
  for (int c = 0; c < 3; c++) {
    Block block;
    make_block(&block, MPM_TRANSFER_FLIP, 1e6, 50.0, low);
    MpmWall floor = plane_wall(1, 0.0, 1.0, contacts[c]);
    floor.friction = 0.5;
    OK(mpm_set_walls(block.mpm, &floor, 1));
    for (int s = 0; s < 4000; s++) {
      apply_gravity(&block, 10.0 * fmin(1.0, s / 2000.0));
      OK(mpm_step(block.mpm, block.points, block.count, block.dt));
    }
    AT_MOST(fabs(floor.reaction[1] / (10.0 * block.mass) - 1.0), 1e-3); /* at rest but for e^-5 of the first swing */
    AT_MOST(fabs(floor.reaction[0]), 1e-3 * 10.0 * block.mass);
    AT_MOST(fabs(floor.power_friction), 1e-3 * block.mass);
    if (contacts[c] != MPM_WALL_NO_SLIP) { /* pull it up: a separable wall does not hold it */
      apply_gravity(&block, -10.0);
      double pull = 0.0;
      for (int s = 0; s < 2000; s++) {
        OK(mpm_step(block.mpm, block.points, block.count, block.dt));
        pull = fmin(pull, floor.reaction[1]);
      }
      AT_MOST(-pull, 1e-12);
      assert_true(mean_velocity(&block, 1) > 0.0);
    }
    free_block(&block);
  }
}

/* A plate that moves down presses a block onto the floor; a glued one takes it along. */
static void a_moving_wall_takes_the_body_along(void **state) {
  (void)state;
  const double low[3] = {0.0, 0.0, 0.0};
  Block block;
  make_block(&block, MPM_TRANSFER_FLIP, 1e6, 100.0, low);
  MpmWall walls[2] = {plane_wall(1, 0.0, 1.0, MPM_WALL_SLIP), plane_wall(1, 0.2, -1.0, MPM_WALL_SLIP)};
  walls[1].velocity[1] = -0.001;
  OK(mpm_set_walls(block.mpm, walls, 2));
  const int steps = 4000;
  for (int s = 0; s < steps; s++) {
    OK(mpm_step(block.mpm, block.points, block.count, block.dt));
    walls[1].point[1] += block.dt * walls[1].velocity[1];
  }
  /* Lateral strain is free: sigma_yy = E / (1 - nu^2) ln(1 + dv t / H). The damping force 100 1/s x 0.01 m/s x m is
   * 1e-3 of it. */
  const double strain = log(1.0 - 0.001 * steps * block.dt / 0.2), exact = 1e6 / (1.0 - 0.04) * strain;
  const double force = -0.4 * exact;
  printf("plate: force %.1f above, %.1f below, exact %.1f\n", -walls[1].reaction[1], walls[0].reaction[1], force);
  AT_MOST(fabs(walls[0].reaction[1] / force - 1.0),
          0.05); /* nodal walls: the plate acts on the node row above it until it passes it */
  AT_MOST(fabs(-walls[1].reaction[1] / force - 1.0), 0.05);
  free_block(&block);

  Block drawn;
  make_block(&drawn, MPM_TRANSFER_FLIP, 1e6, 0.0, low);
  MpmWall belt = plane_wall(1, 0.0, 1.0, MPM_WALL_FRICTION);
  belt.friction = 0.5, belt.velocity[0] = 0.3;
  OK(mpm_set_walls(drawn.mpm, &belt, 1));
  apply_gravity(&drawn, 10.0);
  for (int s = 0; s < (int)(2.0 / drawn.dt); s++) OK(mpm_step(drawn.mpm, drawn.points, drawn.count, drawn.dt));
  AT_MOST(fabs(mean_velocity(&drawn, 0) - 0.3), 0.01); /* after 0.06 s of slip it sticks to the belt */
  free_block(&drawn);
}

/* A corner of two walls that are not perpendicular (a hopper): no node moves into either, for any incoming velocity. */
static void corners_satisfy_all_their_walls(void **state) {
  (void)state;
  const double low[3] = {0.0, 0.0, 0.0};
  for (int turn = 0; turn < 12; turn++) {
    Block block;
    make_block(&block, MPM_TRANSFER_APIC, 1e6, 0.0, low);
    MpmWall walls[2] = {plane_wall(0, 0.1, 1.0, MPM_WALL_SLIP), plane_wall(0, 0.0, 1.0, MPM_WALL_SLIP)};
    walls[1].point[0] = 0.1, walls[1].point[1] = 0.1;
    walls[1].normal[0] = walls[1].normal[1] = sqrt(0.5);
    OK(mpm_set_walls(block.mpm, walls, 2));
    for (int p = 0; p < block.count; p++) {
      block.points[p].velocity[0] = cos(turn * PI / 6), block.points[p].velocity[1] = sin(turn * PI / 6);
    }
    OK(mpm_step(block.mpm, block.points, block.count, block.dt));
    MpmGridView view;
    mpm_grid_view(block.mpm, &view);
    int tested = 0;
    for (int n = 0; n < view.nodes; n++) {
      const double x = 0.1 * view.index[3 * n], y = 0.1 * view.index[3 * n + 1];
      const double *v = view.velocity + 3 * n;
      const int is_left = x <= 0.1 + 1e-9, is_below = x - 0.1 + y - 0.1 <= 1e-9;
      tested += is_left + is_below;
      if (is_left) AT_MOST(-v[0], 1e-6);
      /* 20 sweeps over walls that meet at 45 degrees: the error halves with each. */
      if (is_below) AT_MOST(-(v[0] + v[1]), 2e-6);
    }
    assert_true(tested >= 6);
    free_block(&block);
  }
}

static void a_box_stops_a_block_at_its_face(void **state) {
  (void)state;
  const double low[3] = {0.0, 0.21, 0.0};
  Block block;
  make_block(&block, MPM_TRANSFER_FLIP, 1e6, 20.0, low);
  MpmWall box = mpm_wall_default();
  box.kind = MPM_WALL_BOX;
  box.contact = MPM_WALL_SLIP;
  box.low[0] = -0.5, box.high[0] = 1.0, box.low[1] = -0.5, box.high[1] = 0.1;
  OK(mpm_set_walls(block.mpm, &box, 1));
  apply_gravity(&block, 10.0);
  for (int s = 0; s < (int)(1.5 / block.dt); s++) OK(mpm_step(block.mpm, block.points, block.count, block.dt));
  double lowest = INFINITY;
  for (int p = 0; p < block.count; p++) lowest = fmin(lowest, block.points[p].position[1]);
  /* Grid contact begins when a point's domain reaches the node row below it: up to one cell above the face. */
  assert_true(lowest > 0.1 && lowest < 0.1 + 0.1 + 0.03);
  AT_MOST(fabs(box.reaction[1] / (10.0 * block.mass) - 1.0), 0.05);
  AT_MOST(fabs(mean_velocity(&block, 0)), 1e-10); /* the side faces do nothing */
  free_block(&block);
}

static void a_range_limits_a_wall(void **state) {
  (void)state;
  const double low[3] = {0.0, 0.0, 0.0};
  Block block;
  make_block(&block, MPM_TRANSFER_FLIP, 1e6, 0.0, low);
  MpmWall floor = plane_wall(1, 0.0, 1.0, MPM_WALL_NO_SLIP);
  floor.range[0][0] = 5.0;
  OK(mpm_set_walls(block.mpm, &floor, 1));
  apply_gravity(&block, 10.0);
  for (int s = 0; s < 100; s++) OK(mpm_step(block.mpm, block.points, block.count, block.dt));
  AT_MOST(fabs(mean_velocity(&block, 1) + 10.0 * 100 * block.dt), 1e-10); /* free fall */
  AT_MOST(fabs(floor.reaction[1]), 0.0);
  free_block(&block);
}

/* Pressure on all four sides: rigid balance to round-off, then sigma = -p inside. Lateral bins: each side gets its own
 * length. */
static void tractions_load_the_outermost_layer(void **state) {
  (void)state;
  const double low[3] = {0.013, 0.027, 0.0}, pressure = 1e4;
  Block block;
  make_block(&block, MPM_TRANSFER_FLIP, 1e6, 100.0, low);
  MpmTraction sides[4] = {
      {.axis = 0, .side = 1, .traction = {-pressure, 0, 0}}, {.axis = 0, .side = -1, .traction = {pressure, 0, 0}},
      {.axis = 1, .side = 1, .traction = {0, -pressure, 0}}, {.axis = 1, .side = -1, .traction = {0, pressure, 0}}};
  /* One side alone, one step: momentum = p x height x dt. */
  OK(mpm_set_tractions(block.mpm, sides, 1));
  OK(mpm_step(block.mpm, block.points, block.count, block.dt));
  AT_MOST(fabs(mean_velocity(&block, 0) * block.mass / (-pressure * 0.2 * block.dt) - 1.0), 1e-12);
  free_block(&block);

  make_block(&block, MPM_TRANSFER_FLIP, 1e6, 100.0, low);
  OK(mpm_set_tractions(block.mpm, sides, 4));
  for (int s = 0; s < 6000; s++) OK(mpm_step(block.mpm, block.points, block.count, block.dt));
  double mean[2] = {0.0, 0.0};
  for (int p = 0; p < block.count; p++)
    for (int i = 0; i < 2; i++) mean[i] += block.points[p].stress[i] / block.count;
  printf("traction of -10000 on all sides: mean stress %.1f %.1f\n", mean[0], mean[1]);
  /* Exactly: sum V sigma = sum x f. The load acts on the centres of the outermost points, 7/8 of the width and 3/4 of
   * the height apart. */
  AT_MOST(fabs(mean[0] / (-pressure * 7 / 8) - 1.0), 1e-3);
  AT_MOST(fabs(mean[1] / (-pressure * 3 / 4) - 1.0), 1e-3);
  /* Opposite layers differ a little in deformation: the resultant (damping 100 1/s times momentum) stays below 1 % of
   * the side's load. */
  for (int i = 0; i < 2; i++) AT_MOST(100.0 * block.mass * fabs(mean_velocity(&block, i)), 0.01 * pressure * 0.2);
  free_block(&block);
}

/* The whole surface: a body under -p I rests to round-off, turned and sheared; a free one comes to -p I in every point. */
static void a_surface_pressure_is_the_stress_at_rest(void **state) {
  (void)state;
  const double low[3] = {0.013, 0.027, 0.0}, pressure = 1e4;
  const MpmTraction around = {.surface = 1, .pressure = pressure};
  Block block;
  make_block(&block, MPM_TRANSFER_FLIP, 1e6, 100.0, low);
  OK(mpm_set_tractions(block.mpm, &around, 1));
  for (int p = 0; p < block.count; p++) {
    MpmPoint *point = &block.points[p];
    const double x = point->position[0], y = point->position[1];
    point->position[0] = 0.8 * x - 0.7 * y, point->position[1] = 0.5 * x + 0.9 * y;
    for (int i = 0; i < 2; i++) point->stress[i] = -pressure;
  }
  OK(mpm_step(block.mpm, block.points, block.count, block.dt));
  double fastest = 0.0;
  for (int p = 0; p < block.count; p++)
    for (int i = 0; i < 2; i++) fastest = fmax(fastest, fabs(block.points[p].velocity[i]));
  AT_MOST(fastest / (pressure * 0.05 * block.dt / block.points[0].mass), 1e-14); /* against one point's load */
  free_block(&block);

  make_block(&block, MPM_TRANSFER_FLIP, 1e6, 100.0, low);
  OK(mpm_set_tractions(block.mpm, &around, 1));
  for (int s = 0; s < 6000; s++) OK(mpm_step(block.mpm, block.points, block.count, block.dt));
  /* Single points keep what the grid does not see, an alternating stress; their mean is exact at rest. */
  double error = 0.0, sum[2] = {0.0, 0.0}, volume = 0.0;
  for (int p = 0; p < block.count; p++) {
    const MpmPoint *point = &block.points[p];
    const double *F = point->deformation_gradient, v = point->volume0 * (F[0] * F[4] - F[1] * F[3]);
    volume += v;
    for (int i = 0; i < 2; i++) {
      sum[i] += v * point->stress[i];
      error = fmax(error, fabs(point->stress[i] / -pressure - 1.0));
    }
  }
  printf("pressure of 10000 on the whole surface: mean stress off by %.1e, single points by up to %.1e\n",
         fabs(sum[0] / volume / -pressure - 1.0), error);
  for (int i = 0; i < 2; i++) AT_MOST(fabs(sum[i] / volume / -pressure - 1.0), 1e-5);
  AT_MOST(error, 0.01);
  free_block(&block);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(a_sliding_block_decelerates_by_mu_g),
      cmocka_unit_test(slip_does_not_brake_and_no_slip_stops),
      cmocka_unit_test(the_floor_carries_the_weight_and_lets_go),
      cmocka_unit_test(a_moving_wall_takes_the_body_along),
      cmocka_unit_test(corners_satisfy_all_their_walls),
      cmocka_unit_test(a_box_stops_a_block_at_its_face),
      cmocka_unit_test(a_range_limits_a_wall),
      cmocka_unit_test(tractions_load_the_outermost_layer),
      cmocka_unit_test(a_surface_pressure_is_the_stress_at_rest),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
