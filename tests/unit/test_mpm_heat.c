/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Heat: verification B6, sources, walls with a temperature or a flux. */
#include "mpm_help.h"

static Mpm *make_heat(const MpmScene *scene, const double conductivity[6], MpmLaw *law) {
  MpmElastic elastic = {
      .mode = scene->dimension == 3 ? MPM_ELASTIC_3D : MPM_ELASTIC_PLANE_STRAIN, .young = 1.0, .thermal = 1};
  memcpy(elastic.conductivity, conductivity, sizeof elastic.conductivity);
  Mpm *mpm;
  OK(mpm_elastic_create(&elastic, law));
  OK(mpm_create(scene, law, NULL, &mpm));
  return mpm;
}

static MpmScene heat_scene(int dimension, double spacing, MpmShape shape) {
  MpmScene scene = mpm_scene_default();
  scene.dimension = dimension;
  scene.spacing = spacing;
  scene.shape = shape;
  scene.thermal = 1;
  scene.mechanical = 0;
  return scene;
}

/* T = sin(pi x) exp(-pi^2 t) on [0, 1], rho c = k = 1, both ends held at 0; one row of cells. L2 error at t = 0.05. */
static double find_sine_error(int cells, MpmShape shape) {
  const double h = 1.0 / cells, conductivity[6] = {1, 1, 1, 0, 0, 0}, low[3] = {0, 0, 0};
  const int number[3] = {2 * cells, 2, 1};
  const MpmScene scene = heat_scene(2, h, shape);
  MpmLaw law;
  Mpm *mpm = make_heat(&scene, conductivity, &law);
  MpmWall walls[2] = {plane_wall(0, 0.0, 1.0, MPM_WALL_NO_CONTACT), plane_wall(0, 1.0, -1.0, MPM_WALL_NO_CONTACT)};
  for (int w = 0; w < 2; w++) walls[w].heat = MPM_WALL_TEMPERATURE;
  OK(mpm_set_walls(mpm, walls, 2));
  int count;
  MpmPoint *points = make_box(2, low, number, 0.5 * h, 1.0, 1, &count);
  for (int p = 0; p < count; p++) points[p].temperature = sin(PI * points[p].position[0]);
  OK(mpm_initialise(mpm, points, count));
  const int steps = 5 * cells * cells / 16; /* dt = 0.16 h^2: its error is of order h^2, too */
  const double end = 0.05;
  for (int s = 0; s < steps; s++) OK(mpm_step(mpm, points, count, end / steps));
  double square = 0.0;
  for (int p = 0; p < count; p++) {
    const double error = points[p].temperature_mapped - sin(PI * points[p].position[0]) * exp(-PI * PI * end);
    square += error * error / count;
  }
  free(points);
  mpm_destroy(mpm);
  law.destroy(law.content);
  return sqrt(square);
}

static void a_sine_profile_decays_with_second_order(void **state) {
  (void)state;
  const MpmShape shapes[2] = {MPM_SHAPE_LINEAR, MPM_SHAPE_GIMP};
  for (int s = 0; s < 2; s++) {
    double error[3];
    for (int g = 0; g < 3; g++) error[g] = find_sine_error(8 << g, shapes[s]);
    const double slope = log2(error[1] / error[2]);
    printf("heat, sine, shape %d: errors %.2e %.2e %.2e, order %.2f %.2f\n", s, error[0], error[1], error[2],
           log2(error[0] / error[1]), slope);
    AT_MOST(1.9, slope);
  }
}

static void an_insulated_body_keeps_its_heat_and_evens_out(void **state) {
  (void)state;
  for (int dimension = 2; dimension <= 3; dimension++)
    for (int shape = 0; shape < 3; shape++) {
      const MpmScene scene = heat_scene(dimension, 0.1, (MpmShape)shape);
      const double conductivity[6] = {2, 1, 1, 0.5, 0, 0}, low[3] = {0.03, -0.02, 0.04};
      const int number[3] = {10, 9, 8};
      MpmLaw law;
      Mpm *mpm = make_heat(&scene, conductivity, &law);
      int count;
      MpmPoint *points = make_box(dimension, low, number, 0.05, 1.0, 1, &count);
      uint64_t seed = 5;
      for (int p = 0; p < count; p++) points[p].temperature = base_random(&seed);
      OK(mpm_initialise(mpm, points, count));
      MpmTotals start, end;
      mpm_totals(points, count, &start);
      double mechanical, dt, spread = 0.0;
      mpm_critical_time_steps(mpm, points, count, &mechanical, &dt);
      assert_true(isinf(mechanical));
      for (int s = 0; s < 2000; s++) OK(mpm_step(mpm, points, count, dt));
      mpm_totals(points, count, &end);
      AT_MOST(fabs(end.thermal_energy / start.thermal_energy - 1.0), 1e-13);
      const double mean = start.thermal_energy / start.mass;
      for (int p = 0; p < count; p++) spread = fmax(spread, fabs(points[p].temperature_mapped - mean));
      AT_MOST(spread, 1e-3); /* the slowest mode has decayed by exp(-9) or more */
      free(points);
      mpm_destroy(mpm);
      law.destroy(law.content);
    }
}

/* A Gaussian that spreads in a large body under a conductivity tensor whose axes are turned by 30 degrees: covariance
 * grows by 2 K t. */
static void check_turned_conductivity(const double stretch[3]) {
  const double c = cos(PI / 6), s = sin(PI / 6), k1 = 2.0, k2 = 0.5, end = 0.02;
  const double conductivity[6] = {k1 * c * c + k2 * s * s, k1 * s * s + k2 * c * c, 1.0, (k1 - k2) * c * s, 0, 0};
  const double h = 0.05, low[3] = {-1.5, -1.5, 0};
  const int number[3] = {120, 120, 1};
  const MpmScene scene = heat_scene(2, h, MPM_SHAPE_GIMP);
  MpmLaw law;
  Mpm *mpm = make_heat(&scene, conductivity, &law);
  OK(mpm_set_stretch(mpm, stretch));
  int count;
  MpmPoint *points = make_box(2, low, number, 0.5 * h, 1.0, 1, &count);
  const double start = 0.04; /* variance */
  for (int p = 0; p < count; p++) {
    const double *x = points[p].position;
    points[p].temperature = exp(-0.5 * (x[0] * x[0] + x[1] * x[1]) / start);
  }
  OK(mpm_initialise(mpm, points, count));
  for (int n = 0; n < 64; n++) OK(mpm_step(mpm, points, count, end / 64));
  double sum = 0.0, moment[3] = {0, 0, 0};
  for (int p = 0; p < count; p++) {
    const double *x = points[p].position, t = points[p].temperature;
    sum += t;
    moment[0] += t * x[0] * x[0], moment[1] += t * x[1] * x[1], moment[2] += t * x[0] * x[1];
  }
  const int component[3] = {0, 1, 3};
  for (int i = 0; i < 3; i++) {
    const double exact = (i < 2 ? start : 0.0) + 2.0 * conductivity[component[i]] * end;
    printf("turned conductivity: second moment %d is %.6f, exact %.6f\n", i, moment[i] / sum, exact);
    /* The lumped operator spreads a quadratic field exactly up to the smoothing of eq. 28's remap, of order h^2 per
     * decay time. */
    AT_MOST(fabs(moment[i] / sum - exact), 1e-3 * start);
  }
  free(points);
  mpm_destroy(mpm);
  law.destroy(law.content);
}

static void a_turned_conductivity_gives_the_turned_answer(void **state) {
  (void)state;
  check_turned_conductivity((const double[3]){1.0, 1.0, 1.0});
  check_turned_conductivity((const double[3]){1.0, 0.7, 1.0});
}

/* Ledger: heat of the points = sources + walls, for a flux at one end, a temperature at the other, sources inside. */
static void walls_and_sources_balance_the_heat_of_the_body(void **state) {
  (void)state;
  const MpmScene scene = heat_scene(2, 0.1, MPM_SHAPE_GIMP);
  const double conductivity[6] = {0.3, 0.3, 0.3, 0, 0, 0}, low[3] = {0, 0, 0}, dt = 2e-3;
  const int number[3] = {20, 4, 1};
  MpmLaw law;
  Mpm *mpm = make_heat(&scene, conductivity, &law);
  MpmWall walls[2] = {plane_wall(0, 0.0, 1.0, MPM_WALL_NO_CONTACT), plane_wall(0, 1.0, -1.0, MPM_WALL_NO_CONTACT)};
  walls[0].heat = MPM_WALL_TEMPERATURE, walls[0].temperature = 3.0;
  walls[1].heat = MPM_WALL_FLUX, walls[1].flux = 2.0;
  OK(mpm_set_walls(mpm, walls, 2));
  int count;
  MpmPoint *points = make_box(2, low, number, 0.05, 1.0, 1, &count);
  for (int p = 0; p < count; p++) points[p].heat_external = 0.01;
  OK(mpm_initialise(mpm, points, count));
  double supplied = 0.0;
  MpmTotals totals;
  for (int s = 0; s < 6000; s++) {
    OK(mpm_step(mpm, points, count, dt));
    supplied += dt * (walls[0].heat_flow + walls[1].heat_flow + 0.01 * count);
    AT_MOST(fabs(walls[1].heat_flow - 2.0 * 0.2), 1e-13); /* flux times the height of the body */
  }
  mpm_totals(points, count, &totals);
  AT_MOST(fabs(totals.thermal_energy - supplied) / totals.thermal_energy, 1e-12);
  /* Steady: what comes in leaves through the held wall, and the gradient next to the flux wall is flux / k: 6.67 K/m.
   */
  AT_MOST(fabs(walls[0].heat_flow + 0.4 + 0.01 * count) / 0.4, 2e-2);
  double at_end = 0.0, source = 0.01 * count / 0.2;
  for (int p = 0; p < count; p++)
    if (points[p].position[0] > 0.97) at_end = points[p].temperature_mapped;
  /* T(x) = 3 + ((q + s) x - s x^2 / 2) / k with the source s per volume; the last column lies at x = 0.975. */
  const double x = 0.975, exact = 3.0 + ((2.0 + source) * x - 0.5 * source * x * x) / 0.3;
  printf("held wall, flux, source: temperature at the far end %.4f, exact %.4f\n", at_end, exact);
  AT_MOST(fabs(at_end / exact - 1.0), 1e-2); /* the flux enters over a layer of one point, 0.05 long */
  free(points);
  mpm_destroy(mpm);
  law.destroy(law.content);
}

typedef struct Ledger {
  double given, worst; /* J: heat from walls and sources; largest gap between it and the heat of the points */
} Ledger;

/* `steps` time steps between a hot wall and a flux, from the start; `every` of them per thermal step (0: plain ones). The sources of a
 * thermal step are given in the next one: `delay` does the same to plain steps. Returns the points. */
static MpmPoint *run_thermal_steps(int steps, double dt, int every, double source, double delay, int *count, Ledger *ledger) {
  const MpmScene scene = heat_scene(2, 0.1, MPM_SHAPE_GIMP);
  const double conductivity[6] = {0.3, 0.3, 0.3, 0, 0, 0}, low[3] = {0, 0, 0};
  const int number[3] = {20, 4, 1};
  MpmLaw law;
  Mpm *mpm = make_heat(&scene, conductivity, &law);
  MpmWall walls[2] = {plane_wall(0, 0.0, 1.0, MPM_WALL_NO_CONTACT), plane_wall(0, 1.0, -1.0, MPM_WALL_NO_CONTACT)};
  walls[0].heat = MPM_WALL_TEMPERATURE, walls[0].temperature = 3.0;
  walls[1].heat = MPM_WALL_FLUX, walls[1].flux = 2.0;
  OK(mpm_set_walls(mpm, walls, 2));
  MpmPoint *points = make_box(2, low, number, 0.05, 1.0, 1, count);
  OK(mpm_initialise(mpm, points, *count));
  *ledger = (Ledger){0.0, 0.0};
  for (int s = 0; s < steps; s++) {
    const double power = s == 0 ? source * delay : source;
    for (int p = 0; p < *count; p++) points[p].heat_external = power;
    if (every > 0) mpm_set_heat_duration(mpm, s % every == 0 ? every * dt : 0.0);
    OK(mpm_step(mpm, points, *count, dt));
    ledger->given += dt * (walls[0].heat_flow + walls[1].heat_flow + power * *count);
    MpmTotals totals;
    mpm_totals(points, *count, &totals);
    ledger->worst = fmax(ledger->worst, fabs(totals.thermal_energy - ledger->given));
  }
  mpm_destroy(mpm);
  law.destroy(law.content);
  return points;
}

/* Thermal steps of four time steps: the same as time steps four times as long where nothing moves; heat, with what waits, is kept
 * at every time step, also when the last thermal step is not over. */
static void thermal_steps_of_their_own_are_longer_euler_steps_and_lose_no_heat(void **state) {
  (void)state;
  const double dt = 2e-3;
  int count;
  Ledger ledger;
  /* The first thermal step finds the sources of one time step waiting. */
  MpmPoint *fine = run_thermal_steps(400, dt, 4, 0.01, 1.0, &count, &ledger);
  MpmPoint *coarse = run_thermal_steps(100, 4.0 * dt, 0, 0.01, 0.25, &count, &ledger);
  double difference = 0.0;
  for (int p = 0; p < count; p++) difference = fmax(difference, fabs(fine[p].temperature - coarse[p].temperature));
  printf("thermal steps of four time steps beside time steps four times as long: %.1e K\n", difference);
  AT_MOST(difference, 1e-12);
  free(fine), free(coarse);
  fine = run_thermal_steps(403, dt, 4, 0.01, 1.0, &count, &ledger);
  AT_MOST(ledger.worst, 1e-12 * ledger.given);
  free(fine);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(a_sine_profile_decays_with_second_order),
      cmocka_unit_test(an_insulated_body_keeps_its_heat_and_evens_out),
      cmocka_unit_test(a_turned_conductivity_gives_the_turned_answer),
      cmocka_unit_test(walls_and_sources_balance_the_heat_of_the_body),
      cmocka_unit_test(thermal_steps_of_their_own_are_longer_euler_steps_and_lose_no_heat),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
