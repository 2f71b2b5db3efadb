/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Grains at rest as a network: against a dense solution, closed forms and balances. One rank. */
#include "mpm_help.h"

#include "grain_heat/grain_network.h"

enum { GRAINS = 40, LINKS = 120, BATHS = 8, MOST = 1000 };

static void spread_nothing(void *context, double *values) { (void)context, (void)values; }
static void sum_nothing(void *context, int count, GrainSum *sums) { (void)context, (void)count, (void)sums; }
static const GrainRanks ALONE = {NULL, spread_nothing, sum_nothing};

/* A random network of one piece, capacities over two orders of magnitude. */
static GrainNetwork *make_network(int baths, double *T, double *source) {
  uint64_t state = 5;
  GrainLink link[2 * LINKS];
  GrainBath bath[BATHS];
  for (int k = 0; k < LINKS; k++) {
    const int i = k < GRAINS - 1 ? k + 1 : (int)(GRAINS * base_random(&state));
    int j = (int)((k < GRAINS - 1 ? i : GRAINS) * base_random(&state));
    if (j == i) j = (i + 1) % GRAINS;
    const double h = 0.1 + base_random(&state);
    link[2 * k] = (GrainLink){i, j, j, h, 0.0}, link[2 * k + 1] = (GrainLink){j, i, i, h, 0.0};
  }
  for (int b = 0; b < baths; b++)
    bath[b] = (GrainBath){5 * b, b % 2 ? GRAIN_BATH_WALL : GRAIN_BATH_CONVECTION, 0.5, 0.0, 100.0 * b, 0.0};
  GrainNetwork *network;
  assert_int_equal(grain_network_create(GRAINS, 0, 2 * LINKS, link, baths, bath, &network), BASE_OK);
  for (int i = 0; i < GRAINS; i++) {
    network->capacity[i] = pow(100.0, base_random(&state));
    T[i] = 300.0 + 100.0 * base_random(&state), source[i] = base_random(&state) - 0.5;
  }
  grain_network_refresh(network, T);
  return network;
}

static double energy_of(const GrainNetwork *n, const double *T) {
  double sum = 0.0;
  for (int i = 0; i < GRAINS; i++) sum += n->capacity[i] * T[i];
  return sum;
}

/* Largest |(C (T - T0) / step - flows at T - source)_i|, W. */
static double imbalance(const GrainNetwork *n, double rate, const double *T0, const double *T, const double *source) {
  double heat[GRAINS], worst = 0.0;
  GrainSum flows[GRAIN_BATH_KINDS];
  grain_network_flow(n, T, heat, flows);
  for (int i = 0; i < GRAINS; i++)
    worst = fmax(worst, fabs(n->capacity[i] * (T[i] - T0[i]) * rate - heat[i] - source[i]));
  return worst;
}

static void implicit_and_steady_states_balance(void **state) {
  (void)state;
  const double steps[3] = {0.1, 1e4, HUGE_VAL};
  for (int k = 0; k < 3; k++) {
    double T0[GRAINS], T[GRAINS], source[GRAINS];
    GrainSolution solution;
    GrainNetwork *n = make_network(BATHS, T0, source);
    memcpy(T, T0, sizeof T);
    assert_int_equal(grain_network_solve(n, &ALONE, steps[k], 1e-12, MOST, source, T, &solution), BASE_OK);
    AT_MOST(imbalance(n, 1.0 / steps[k], T0, T, source), 1e-9); /* of flows of some 100 W */
    assert_true(solution.iterations > 0 && solution.iterations < 200);
    /* Once more from there: a steady state stays, to the bit. */
    if (steps[k] == HUGE_VAL) {
      memcpy(T0, T, sizeof T);
      assert_int_equal(grain_network_solve(n, &ALONE, HUGE_VAL, 1e-11, MOST, source, T, &solution), BASE_OK);
      assert_int_equal(solution.iterations, 0);
      assert_memory_equal(T, T0, sizeof T);
    }
    grain_network_destroy(n);
  }
}

/* Without baths and sources the heat is kept to round-off, at the coarsest tolerance and by explicit steps too. */
static void heat_is_kept(void **state) {
  (void)state;
  for (int k = 0; k < 3; k++) {
    double T[GRAINS], source[GRAINS] = {0};
    double unused[GRAINS], heat[GRAINS];
    GrainSolution solution;
    GrainSum flows[GRAIN_BATH_KINDS];
    GrainNetwork *n = make_network(0, T, unused);
    const double before = energy_of(n, T);
    int grain;
    const double limit = grain_network_time_step(n, &grain);
    for (int step = 0; step < 200; step++) {
      if (k == 0) {
        grain_network_flow(n, T, heat, flows);
        grain_network_advance(n, limit, heat, source, T);
      } else
        assert_int_equal(
            grain_network_solve(n, &ALONE, k == 1 ? 5.0 : HUGE_VAL, 0.1, MOST, source, T, &solution), BASE_OK);
    }
    AT_MOST(fabs(energy_of(n, T) / before - 1.0), 1e-13);
    grain_network_destroy(n);
  }
}

static void groups_without_baths_end_at_their_mean(void **state) {
  (void)state;
  double T[GRAINS], source[GRAINS], total = 0.0;
  GrainSolution solution;
  GrainNetwork *n = make_network(0, T, source);
  for (int i = 0; i < GRAINS; i++) total += n->capacity[i];
  const double mean = energy_of(n, T) / total;
  memset(source, 0, sizeof source);
  assert_int_equal(grain_network_solve(n, &ALONE, HUGE_VAL, 1e-12, MOST, source, T, &solution), BASE_OK);
  for (int i = 0; i < GRAINS; i++) AT_MOST(fabs(T[i] / mean - 1.0), 1e-10);
  source[3] = 1.0; /* what comes in never goes out */
  assert_int_equal(grain_network_solve(n, &ALONE, HUGE_VAL, 1e-12, MOST, source, T, &solution), BASE_ERROR_UNSTABLE);
  assert_non_null(strstr(base_error_message(), "no balance of heat"));
  grain_network_destroy(n);
}

/* At the limit an alternating temperature does not grow; at 2.1 times the limit that of some network does. */
static void explicit_steps_hold_up_to_the_limit(void **state) {
  (void)state;
  GrainLink link[2] = {{0, 1, 1, 2.0, 0.0}, {1, 0, 0, 2.0, 0.0}};
  GrainNetwork *n;
  assert_int_equal(grain_network_create(2, 0, 2, link, 0, NULL, &n), BASE_OK);
  n->capacity[0] = 4.0, n->capacity[1] = 4.0;
  int grain;
  double T[2] = {1.0, -1.0}, heat[2];
  grain_network_refresh(n, T);
  const double limit = grain_network_time_step(n, &grain), none[2] = {0.0, 0.0};
  GrainSum flows[GRAIN_BATH_KINDS];
  assert_true(limit == 2.0 && grain == 0);
  grain_network_flow(n, T, heat, flows);
  grain_network_advance(n, limit, heat, none, T);
  assert_true(T[0] == -1.0 && T[1] == 1.0); /* equal capacities: the bound is sharp */
  n->capacity[1] = 0.0;
  grain_network_flow(n, T, heat, flows);
  grain_network_advance(n, limit, heat, none, T);
  assert_true(T[0] == 1.0 && T[1] == 1.0);
  grain_network_destroy(n);
}

/* The order of links does not show in a bit. */
static void sums_do_not_depend_on_storage(void **state) {
  (void)state;
  GrainLink one[3] = {{0, 1, 7, 0.1, 0.0}, {0, 2, 3, 0.7, 0.0}, {0, 3, 5, 0.3, 0.0}}, two[3] = {one[2], one[0], one[1]};
  const double T[4] = {1.0, 300.1, 17.3, 4.9};
  double heat[2];
  for (int k = 0; k < 2; k++) {
    GrainNetwork *n;
    GrainSum flows[GRAIN_BATH_KINDS];
    assert_int_equal(grain_network_create(1, 3, 3, k ? two : one, 0, NULL, &n), BASE_OK);
    grain_network_refresh(n, T);
    grain_network_flow(n, T, &heat[k], flows);
    grain_network_destroy(n);
  }
  assert_true(heat[0] == heat[1] && heat[0] > 0.0);
}

/* ------------------------------------------------------------------------------- properties over temperature */
/* k = 1 + T / 100, h = k0 k1 / (k0 + k1) of each link; c = 1 + T / 200. */
static void renew(void *context, GrainNetwork *n, const double *T) {
  (void)context;
  for (int i = 0; i < n->grains; i++) {
    n->capacity[i] = 1.0 + T[i] / 200.0;
    for (int k = n->first[i]; k < n->first[i + 1]; k++) {
      const double one = 1.0 + T[i] / 100.0, two = 1.0 + T[n->other[k]] / 100.0;
      n->conduction[k] = one * two / (one + two);
    }
  }
}
static double enthalpy(double T) { return T + T * T / 400.0; }
static double warm(void *context, int grain, double T, double heat) {
  (void)context, (void)grain;
  return 200.0 * (sqrt(1.0 + (enthalpy(T) + heat) / 100.0) - 1.0);
}

/* Backward Euler of a network with tables, radiation between grains and to baths: the enthalpy balances to the tolerance
 * in each grain, and to round-off in all of them if there are no baths. */
static void properties_over_temperature_balance(void **state) {
  (void)state;
  const double steps[3] = {0.5, 50.0, HUGE_VAL};
  for (int k = 0; k < 6; k++) {
    double T0[GRAINS], T[GRAINS], source[GRAINS], heat[GRAINS], worst = 0.0, before = 0.0, after = 0.0;
    GrainSolution solution;
    GrainSum flows[GRAIN_BATH_KINDS];
    GrainNetwork *n = make_network(k < 3 ? BATHS : 0, T0, source);
    n->varies = true, n->change = (GrainChange){NULL, renew, warm};
    for (int b = 0; b < n->baths; b++) n->bath[b].area = 1.0;
    for (int l = 0; l < 2 * LINKS; l++) n->area[l] = 1.0;
    if (k >= 3) memset(source, 0, sizeof source);
    memcpy(T, T0, sizeof T);
    assert_int_equal(grain_network_solve(n, &ALONE, steps[k % 3], k < 3 ? 1e-11 : 0.1, MOST, source, T, &solution), BASE_OK);
    assert_true(solution.renewals > (k < 3 ? 2 : 0) && solution.renewals < 40);
    grain_network_refresh(n, T);
    grain_network_flow(n, T, heat, flows);
    for (int i = 0; i < GRAINS; i++) {
      before += enthalpy(T0[i]), after += enthalpy(T[i]);
      worst = fmax(worst, fabs((enthalpy(T[i]) - enthalpy(T0[i])) / steps[k % 3] - heat[i] - source[i]));
    }
    if (k < 3) AT_MOST(worst, 3e-7); /* of flows of some 1e4 W */
    else AT_MOST(fabs(after / before - 1.0), 1e-13);
    grain_network_destroy(n);
  }
}

/* Into the void: T^4 = source / sigma A, from far below and from far above. */
static void steady_radiation_from_afar(void **state) {
  (void)state;
  const double starts[3] = {1.0, 500.0, 1e5};
  for (int k = 0; k < 3; k++) {
    double T[1] = {starts[k]};
    const double source[1] = {2.0};
    const GrainBath bath = {0, GRAIN_BATH_RADIATION, 0.0, 1e-3, 0.0, 0.0};
    GrainSolution solution;
    GrainNetwork *n;
    assert_int_equal(grain_network_create(1, 0, 0, NULL, 1, &bath, &n), BASE_OK);
    n->capacity[0] = 1.0, n->varies = true;
    assert_int_equal(grain_network_solve(n, &ALONE, HUGE_VAL, 1e-12, MOST, source, T, &solution), BASE_OK);
    AT_MOST(fabs(T[0] / pow(2.0 / (5.670374419e-8 * 1e-3), 0.25) - 1.0), 1e-10);
    grain_network_destroy(n);
  }
}

/* A conductance that jumps where it would have to be in between: no temperature balances. */
static void jump(void *context, GrainNetwork *n, const double *T) {
  (void)context;
  n->bath[0].conduction = T[0] < 350.0 ? 1.0 : 100.0;
}
static void a_jump_without_a_balance_is_an_error(void **state) {
  (void)state;
  double T[1] = {300.0};
  const double source[1] = {100.0};
  const GrainBath bath = {0, GRAIN_BATH_WALL, 1.0, 0.0, 300.0, 0.0};
  GrainSolution solution;
  GrainNetwork *n;
  assert_int_equal(grain_network_create(1, 0, 0, NULL, 1, &bath, &n), BASE_OK);
  n->capacity[0] = 1.0, n->varies = true, n->change.renew = jump;
  assert_int_equal(grain_network_solve(n, &ALONE, HUGE_VAL, 1e-8, MOST, source, T, &solution), BASE_ERROR_UNSTABLE);
  assert_non_null(strstr(base_error_message(), "do not agree after"));
  grain_network_destroy(n);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(implicit_and_steady_states_balance),  cmocka_unit_test(heat_is_kept),
      cmocka_unit_test(groups_without_baths_end_at_their_mean),
      cmocka_unit_test(explicit_steps_hold_up_to_the_limit), cmocka_unit_test(sums_do_not_depend_on_storage),
      cmocka_unit_test(properties_over_temperature_balance), cmocka_unit_test(steady_radiation_from_afar),
      cmocka_unit_test(a_jump_without_a_balance_is_an_error),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
