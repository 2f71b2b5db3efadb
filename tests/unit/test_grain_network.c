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
    link[2 * k] = (GrainLink){i, j, j, h}, link[2 * k + 1] = (GrainLink){j, i, i, h};
  }
  for (int b = 0; b < baths; b++)
    bath[b] = (GrainBath){5 * b, b % 2 ? GRAIN_BATH_WALL : GRAIN_BATH_CONVECTION, 0.5, 100.0 * b};
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
  GrainLink link[2] = {{0, 1, 1, 2.0}, {1, 0, 0, 2.0}};
  GrainNetwork *n;
  assert_int_equal(grain_network_create(2, 0, 2, link, 0, NULL, &n), BASE_OK);
  n->capacity[0] = 4.0, n->capacity[1] = 4.0;
  int grain;
  double T[2] = {1.0, -1.0}, heat[2];
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
  GrainLink one[3] = {{0, 1, 7, 0.1}, {0, 2, 3, 0.7}, {0, 3, 5, 0.3}}, two[3] = {one[2], one[0], one[1]};
  const double T[4] = {1.0, 300.1, 17.3, 4.9};
  double heat[2];
  for (int k = 0; k < 2; k++) {
    GrainNetwork *n;
    GrainSum flows[GRAIN_BATH_KINDS];
    assert_int_equal(grain_network_create(1, 3, 3, k ? two : one, 0, NULL, &n), BASE_OK);
    grain_network_flow(n, T, &heat[k], flows);
    grain_network_destroy(n);
  }
  assert_true(heat[0] == heat[1] && heat[0] > 0.0);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(implicit_and_steady_states_balance),  cmocka_unit_test(heat_is_kept),
      cmocka_unit_test(groups_without_baths_end_at_their_mean),
      cmocka_unit_test(explicit_steps_hold_up_to_the_limit), cmocka_unit_test(sums_do_not_depend_on_storage),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
