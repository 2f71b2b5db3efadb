/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Heat of grains and contacts other than conduction: slip, damping, surroundings, radiation between neighbours; tables. */
#include "mpm_help.h"

#include "grain_heat/grain_heat.h"
#include "grain_heat/grain_table.h"

/* Largest |a / b - 1| so far; a NaN stays. */
static void note(double *worst, double a, double b) {
  const double deviation = fabs(a / b - 1.0);
  if (!(deviation <= *worst)) *worst = deviation;
}

/* ---------------------------------------------------------------------------------------------------- slip */
/* Grain 0 above grain 1; it moves along x at 2 m/s, and its spin takes 1 m/s of that off at the point of contact. */
static void slip_work_is_force_times_slip(void **state) {
  (void)state;
  const double k = 1000.0, constant[2] = {k, k}, dt = 1e-5;
  const double before[3] = {3e-6, 0, 0}, after[3] = {4e-6, 0, 0}, same[3] = {1.3e-5, 0, 0};
  const GrainMotion motion = {.radius = {0.5, 0.25},
                              .branch = {0, 0, 0.75},
                              .velocity = {{2, 0, 7}, {0, 0, 0}},
                              .spin = {{0, 2, 5}, {0, 0, 0}}};
  double worst = 0.0;
  note(&worst, grain_slip_work(&motion, constant, dt, before, after), k * 3.5e-6 * (3e-6 + 1e-5 - 4e-6));
  AT_MOST(worst, 1e-14);
  assert_true(grain_slip_work(&motion, constant, dt, before, same) == 0.0); /* the spring takes it all: no slip */
  const GrainMotion other = {.radius = {0.25, 0.5},
                             .branch = {0, 0, -0.75},
                             .velocity = {{0, 0, 0}, {2, 0, 7}},
                             .spin = {{0, 0, 0}, {0, 2, 5}}};
  const double before2[3] = {-3e-6, 0, 0}, after2[3] = {-4e-6, 0, 0};
  worst = 0.0;
  note(&worst, grain_slip_work(&other, constant, dt, before2, after2),
       grain_slip_work(&motion, constant, dt, before, after));
  AT_MOST(worst, 1e-14);
  /* A spring that is held while its stiffness falls loses energy. */
  const GrainMotion still = {.radius = {0.5, 0.25}, .branch = {0, 0, 0.75}};
  assert_true(fabs(grain_slip_work(&still, (double[]){k, 0.25 * k}, dt, before, before) - 0.375 * k * 9e-12) < 1e-20);
}

/* Sticking, and slipping in both steps: the spring of the step before is found again. */
static void springs_of_the_step_before_are_found(void **state) {
  (void)state;
  const double dt = 1e-5, k[2] = {900, 1000}, before[3] = {3e-6, 4e-6, 0};
  const GrainMotion motion = {
      .radius = {0.5, 0}, .branch = {0, 0, 0.499}, .velocity = {{0.4, 0.1, 7}, {0, 0, 0}}, .spin = {{0.2, 0.3, 1}}};
  /* Velocity at the point of contact, an arm of 0.4995 below the centre: (0.4 - 0.3 arm, 0.1 + 0.2 arm). */
  const double slide[2] = {0.4 - 0.3 * 0.4995, 0.1 + 0.2 * 0.4995};
  const double trial[3] = {before[0] + slide[0] * dt, before[1] + slide[1] * dt, 0.0};
  for (int slips = 0; slips < 2; slips++) {
    const double shortened = slips ? 0.7 : 1.0, length = shortened * hypot(trial[0], trial[1]);
    const double after[3] = {shortened * trial[0], shortened * trial[1], 0.0};
    const double limit[2] = {k[0] * 5e-6, slips ? k[1] * length : 1.0};
    double found[3], worst = 0.0;
    grain_spring_before(&motion, k, limit, dt, after, found);
    for (int a = 0; a < 2; a++) note(&worst, found[a], before[a]);
    AT_MOST(worst, 1e-12);
  }
}

/* Dashpots: power = c v (v + acceleration dt / 2). Parting at 3 m/s, sliding at 1 m/s. */
static void dashpots_work_at_the_mean_velocity(void **state) {
  (void)state;
  const GrainContact contact = {.stiffness = {1000, 500}, .damping = {2, 4}, .mass = 0.1};
  const GrainMotion motion = {.radius = {0.5, 0.5}, .branch = {0, 0, 0.99}, .velocity = {{1, 0, 3}, {0, 0, 0}}};
  const double dt = 1e-3, before[3] = {1e-3, 0, 0}, after[3] = {2e-3, 0, 0}, shorter[3] = {1.5e-3, 0, 0};
  const double normal = 2 * 3 * (3 + 0.005 * (10 - 6)), tangential = 4 * 1 * (1 - 3.5 * 0.005 * (1 + 4));
  double worst = 0.0;
  note(&worst, grain_damping_work(&motion, &contact, dt, before, after), dt * (normal + tangential));
  note(&worst, grain_damping_work(&motion, &contact, dt, before, shorter), dt * normal);
  AT_MOST(worst, 1e-13);
}

/* ------------------------------------------------------------------------------------------------- surface */
static void surfaces_exchange_heat_by_newton_and_stefan_boltzmann(void **state) {
  (void)state;
  const GrainSurface kelvin = {
      .coefficient = 25.0, .fluid_temperature = 300.0, .emissivity = 0.8, .surroundings = 400.0};
  const double area = 4.0 * PI * 0.01 * 0.01;
  double worst = 0.0;
  note(&worst, grain_convection(&kelvin, 0.01, 350.0), -25.0 * area * 50.0);
  note(&worst, grain_radiation(&kelvin, 0.01, 500.0), -0.8 * area * 5.670374419e-8 * (625e8 - 256e8));
  note(&worst, grain_radiation(&kelvin, 0.01, 0.0), 0.8 * area * 5.670374419e-8 * 256e8);
  /* Near equilibrium: 4 T^3 dT to first order. */
  const double small = ldexp(1.0, -20);
  note(&worst, grain_radiation(&kelvin, 0.01, 400.0 - small) / (0.8 * area * 5.670374419e-8),
       4.0 * 64e6 * small * (1.0 - 1.5 * small / 400.0));
  AT_MOST(worst, 1e-14);
  assert_true(grain_radiation(&kelvin, 0.01, 400.0) == 0.0 && grain_convection(&kelvin, 0.01, 300.0) == 0.0);
  /* As a conductance; of equal temperatures the derivative; the same from both sides; none below the absolute zero. */
  worst = 0.0;
  const double both[2] = {500.0, 400.0}, turned[2] = {400.0, 500.0}, equal[2] = {400.0, 400.0}, none[2] = {-5.0, 0.0};
  note(&worst, grain_emission(both, 0.0), 5.670374419e-8 * (625e8 - 256e8) / 100.0);
  note(&worst, grain_emission(equal, 0.0), 4.0 * 5.670374419e-8 * 64e6);
  AT_MOST(worst, 1e-14);
  assert_true(grain_emission(both, 0.0) == grain_emission(turned, 0.0) && grain_emission(none, 0.0) == 0.0);
  /* The same on the scale of Celsius. */
  const GrainSurface celsius = {.emissivity = 0.8, .surroundings = 400.0 - 273.15, .absolute_zero = -273.15};
  worst = 0.0;
  note(&worst, grain_radiation(&celsius, 0.01, 500.0 - 273.15), grain_radiation(&kelvin, 0.01, 500.0));
  AT_MOST(worst, 1e-14);
}

/* Cap areas and shares by quadrature over the angle; the formula of two grey surfaces. */
static void neighbours_radiate_through_their_face(void **state) {
  (void)state;
  const struct {
    double a, b, d, face, emissivity;
  } cases[] = {{1, 1, 2, 0.6, 1}, {1, 0.5, 1.45, 0.5, 0.8}, {0.3, 1, 1.4, 0.4, 0.3}, {1, 1, 1.9, 0.5, 0.6}};
  double worst = 0.0;
  for (size_t n = 0; n < sizeof cases / sizeof cases[0]; n++) {
    const double radius[2] = {cases[n].a, cases[n].b}, d = cases[n].d, face = cases[n].face, e = cases[n].emissivity;
    const GrainPair pair = {.radius = {radius[0], radius[1]}, .distance = d};
    const double contact = grain_radius_geometric(&pair);
    const double h0 = 0.5 * (d + (radius[0] - radius[1]) * (radius[0] + radius[1]) / d), height[2] = {h0, d - h0};
    double cap[2] = {0}, share[2] = {0};
    for (int g = 0; g < 2; g++) {
      const double from = asin(contact / radius[g]), to = atan(face / height[g]);
      for (int k = 0; k < 20000; k++) cap[g] += sin(from + (to - from) * (k + 0.5) / 20000) * (to - from) / 20000;
      cap[g] *= 2.0 * PI * radius[g] * radius[g];
      share[g] = pow(sin(0.5 * to), 2);
    }
    const GrainView view = grain_view(&pair, face, e);
    note(&worst, view.area, 1.0 / (1.0 / fmin(cap[0], cap[1]) + (1.0 - e) / e * (1.0 / cap[0] + 1.0 / cap[1])));
    for (int g = 0; g < 2; g++) note(&worst, view.share[g], share[g]);
    const GrainView turned = grain_view(&(GrainPair){.radius = {radius[1], radius[0]}, .distance = d}, face, e);
    assert_true(turned.area == view.area && turned.share[0] == view.share[1]);
    const double there = grain_radiation_between(view.area, (double[]){300.1, 812.7}, -0.3);
    assert_true(there > 0.0 && there == -grain_radiation_between(view.area, (double[]){812.7, 300.1}, -0.3));
  }
  /* A plane that touches: the cap of a grain at a mirror, and the ring of the plane. */
  const double cap = 2.0 * PI * (1.0 - 1.0 / sqrt(1.25)), ring = PI * 0.25;
  const GrainView wall = grain_view_wall(1.0, 1.0, 0.5, 0.5);
  note(&worst, wall.area, 1.0 / (1.0 / fmin(cap, ring) + 1.0 / cap + 1.0 / ring));
  note(&worst, wall.share[0], cap / (4.0 * PI));
  note(&worst, grain_radiation_between(2.0, (double[]){300.0, 500.0}, 0.0), 2.0 * 5.670374419e-8 * (625e8 - 81e8));
  AT_MOST(worst, 1e-8);
  assert_true(grain_view(&(GrainPair){.radius = {1, 1}, .distance = 1.2}, 0.5, 1.0).area == 0.0); /* contact > face */
  assert_true(grain_view(&(GrainPair){.radius = {1, 1}, .distance = 2.0}, 0.5, 0.0).area == 0.0);
}

/* -------------------------------------------------------------------------------------------------- tables */
static const double ROWS[4 * 3] = {100, 2, 9, 200, 4, 9, 500, 1, 8, 600, 3, 9};
static const GrainTable TABLE = {ROWS, 4, 3};

static void tables_are_linear_between_rows_and_constant_beyond(void **state) {
  (void)state;
  const double at[7] = {-50, 100, 150, 200, 400, 600, 900}, wanted[7] = {2, 2, 3, 4, 2, 3, 3};
  for (int n = 0; n < 7; n++) assert_true(fabs(grain_table_find(&TABLE, 1, at[n]) - wanted[n]) < 1e-14);
  assert_true(fabs(grain_table_find(&TABLE, 2, 350.0) - 8.5) < 1e-14);
  const double enthalpy[7] = {-100, 200, 325, 500, 1100, 1450, 2350};
  for (int n = 0; n < 7; n++) assert_true(fabs(grain_table_integral(&TABLE, 1, at[n]) - enthalpy[n]) < 1e-11);
  OK(grain_table_check(&TABLE, true));
}

/* Over rows and beyond both ends, upwards and downwards: the integral changes by the heat. */
static void heat_is_the_change_of_enthalpy(void **state) {
  (void)state;
  uint64_t seed = 5;
  double worst = 0.0, smallest = 0.0;
  for (int n = 0; n < 20000; n++) {
    const double start = n % 7 ? 800.0 * base_random(&seed) : ROWS[3 * (n % 4)], size = n % 3 ? 3000.0 : 1e-9;
    const double heat = size * (base_random(&seed) - 0.5), end = grain_table_heat(&TABLE, 1, start, heat);
    const double gain = grain_table_integral(&TABLE, 1, end) - grain_table_integral(&TABLE, 1, start);
    worst = fmax(worst, fabs(gain - heat));
    assert_true((end - start) * heat >= 0.0);
    if (size < 1.0) smallest = fmax(smallest, fabs((end - start) * grain_table_find(&TABLE, 1, start) - heat));
  }
  AT_MOST(worst, 1e-11);
  AT_MOST(smallest, 2e-12); /* round-off of the temperature */
  assert_true(grain_table_heat(&TABLE, 1, 333.0, 0.0) == 333.0);
}

static void wrong_tables_are_refused(void **state) {
  (void)state;
  const double wrong[5][4] = {
      {300, 1, 300, 2}, {300, 1, 200, 2}, {300, -1, 400, 2}, {300, NAN, 400, 2}, {NAN, 1, 400, 2}};
  for (int n = 0; n < 5; n++)
    assert_int_equal(grain_table_check(&(GrainTable){wrong[n], 2, 2}, false), BASE_ERROR_ARGUMENT);
  const double zero[4] = {300, 0, 400, 2};
  OK(grain_table_check(&(GrainTable){zero, 2, 2}, false));
  assert_int_equal(grain_table_check(&(GrainTable){zero, 2, 2}, true), BASE_ERROR_ARGUMENT);
  assert_int_equal(grain_table_check(&(GrainTable){zero, 4, 1}, false), BASE_ERROR_ARGUMENT);
  assert_int_equal(grain_table_check(&(GrainTable){zero, 0, 2}, false), BASE_ERROR_ARGUMENT);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(slip_work_is_force_times_slip),
      cmocka_unit_test(springs_of_the_step_before_are_found),
      cmocka_unit_test(dashpots_work_at_the_mean_velocity),
      cmocka_unit_test(surfaces_exchange_heat_by_newton_and_stefan_boltzmann),
      cmocka_unit_test(neighbours_radiate_through_their_face),
      cmocka_unit_test(tables_are_linear_between_rows_and_constant_beyond),
      cmocka_unit_test(heat_is_the_change_of_enthalpy),
      cmocka_unit_test(wrong_tables_are_refused),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
