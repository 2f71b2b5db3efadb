/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Verification A9 and bonds: loss of all contacts, jamming, breaking, melting; A11: heat of a pair. */
#include "rve_help.h"

static RveAnswer run(RveBatch *batch, const double gradient[9], double temperature, double step, int steps) {
  RveAnswer answer = help_step(batch, gradient, temperature, 0.0);
  for (int k = 0; k < steps; k++) {
    answer = help_step(batch, gradient, temperature, step);
    double sum = answer.kinetic_energy + answer.elastic_energy + answer.unbalanced + answer.modulus;
    for (int m = 0; m < 6; m++) sum += answer.stress[m] + answer.fabric[m];
    assert_true(isfinite(sum));
  }
  return answer;
}

static void stretched_rve_is_a_stressless_gas_and_comes_back(void **state) {
  (void)state;
  for (int dim = 2; dim <= 3; dim++) {
    RvePacking packing = help_random(dim, dim == 2 ? 10 : 5, dim == 2 ? 2e4 : 1e5, 3);
    RveScene scene = help_scene(dim);
    double out[9] = {0.0}, in[9] = {0.0};
    const double rate = log(2.0) / 0.05;
    for (int k = 0; k < dim; k++) out[4 * k] = rate, in[4 * k] = -rate;
    scene.tangential_stiffness = 8e5;
    scene.local_damping = 0.7;
    scene.critical_damping = 0.2;
    RveBatch *batch = help_batch(&scene, &packing);
    const RveAnswer start = help_step(batch, NULL, 0.0, 0.0), gas = run(batch, out, 0.0, 5e-4, 100);
    assert_true(gas.coordination == 0.0 && gas.elastic_energy == 0.0 && gas.modulus == 0.0);
    /* No contacts: what is left is the kinetic stress of slow grains, 2 K / V at most. */
    for (int m = 0; m < 6; m++)
      assert_true(fabs(gas.stress[m]) <= 2.0 * gas.kinetic_energy / gas.volume * (1.0 + 1e-12));
    for (int m = 0; m < 6; m++) assert_true(fabs(gas.stress[m]) <= 1e-3 * fabs(start.stress[0]));
    assert_true(fabs(gas.volume / start.volume / pow(2.0, dim) - 1.0) < 1e-12);
    const RveAnswer again = run(batch, in, 0.0, 5e-4, 100);
    assert_true(again.coordination > 2.0 && again.stress[0] < 0.0);
    assert_true(fabs(again.volume / start.volume - 1.0) < 1e-12);
    rve_batch_destroy(batch);
    rve_packing_destroy(&packing);
  }
}

/* A cloud of slow grains, stretched, let go, sheared, heated: flights beside steps, to round-off; and the same bits again,
 * also after a restart. Nothing meets, as a collision would make differences of round-off grow. */
static void free_flights_equal_the_steps(void **state) {
  (void)state;
  for (int dim = 2; dim <= 3; dim++) {
    RvePacking packing = help_random(dim, dim == 2 ? 10 : 5, dim == 2 ? 2e4 : 1e5, 3);
    RveScene scene = help_scene(dim);
    RveBatch *batch[3];
    RveAnswer answer[3];
    double out[9] = {0.0}, shear[9] = {0.0}, worst = 0.0;
    uint64_t seed = 7;
    for (int k = 0; k < dim; k++) out[4 * k] = 10.0 + k;
    for (int g = 0; g < packing.grains; g++) {
      packing.radius[g] *= 0.9;
      for (int k = 0; k < dim; k++) packing.velocity[3 * g + k] = 4e-3 * (base_random(&seed) - 0.5);
    }
    shear[1] = 3.0, shear[3] = -1.0, shear[0] = 2.0, shear[4] = 2.0;
    help_heat(&scene);
    scene.tangential_stiffness = 8e5;
    scene.critical_damping = 0.2;
    int64_t calls = 0;
    for (int b = 0; b < 3; b++) {
      scene.flight = b > 0;
      batch[b] = help_batch(&scene, &packing);
      for (int k = 0; k < 150; k++) {
        const double *gradient = k < 60 ? out : k < 100 ? NULL : shear;
        answer[b] = help_step(batch[b], gradient, 0.1 * k, 5e-4);
        calls += b == 1;
        if (b < 2 || k != 75) continue;
        void *bytes; /* the third one is stored and restored on its way */
        size_t size;
        MUST(base_alloc(rve_batch_state_bytes(batch[b], 0), 1, &bytes));
        MUST(rve_batch_pack(batch[b], 0, bytes, &size));
        rve_batch_destroy(batch[b]);
        batch[b] = help_batch(&scene, &packing);
        MUST(rve_batch_unpack(batch[b], 0, bytes, size));
        base_free(bytes);
      }
    }
    const int64_t flown = rve_batch_flown(batch[1]);
    RveView view[2];
    for (int b = 0; b < 2; b++) MUST(rve_batch_view(batch[b], 0, &view[b]));
    for (int g = 0; g < packing.grains; g++)
      for (int k = 0; k < dim; k++) {
        double gap = 0.0; /* wrapped at another moment, a grain may be a cell away */
        double apart[3] = {0.0, 0.0, 0.0}, s[3];
        for (int m = 0; m < 3; m++) apart[m] = view[1].position[3 * g + m] - view[0].position[3 * g + m];
        double inverse[9];
        tensor_inverse(view[0].cell, inverse);
        for (int i = 0; i < 3; i++) {
          s[i] = inverse[3 * i] * apart[0] + inverse[3 * i + 1] * apart[1] + inverse[3 * i + 2] * apart[2];
          gap = fmax(gap, fabs(s[i] - round(s[i])));
        }
        worst = fmax(worst, gap);
      }
    printf("free flight, %dD: %lld of %lld calls; positions differ by %.1e of a cell, kinetic energy by %.1e\n", dim,
           (long long)flown, (long long)calls, worst, fabs(answer[1].kinetic_energy / answer[0].kinetic_energy - 1.0));
    assert_true(flown >= 120 && rve_batch_flown(batch[0]) == 0);
    assert_true(worst <= 1e-12);
    assert_true(fabs(answer[1].kinetic_energy / answer[0].kinetic_energy - 1.0) <= 1e-11);
    assert_true(help_difference(6, answer[1].stress, answer[0].stress) <= 1e-11);
    assert_true(fabs(answer[1].volume / answer[0].volume - 1.0) <= 1e-13 && answer[1].steps == answer[0].steps);
    assert_true(fabs(answer[1].solid_fraction / answer[0].solid_fraction - 1.0) <= 1e-12);
    assert_memory_equal(&answer[1], &answer[2], sizeof answer[1]);
    for (int b = 0; b < 2; b++) rve_view_destroy(&view[b]);
    for (int b = 0; b < 3; b++) rve_batch_destroy(batch[b]);
    rve_packing_destroy(&packing);
  }
}

/* Two grains that fly at each other: the call in which they meet is stepped, and those that need a new list. */
static void a_flight_ends_before_grains_meet(void **state) {
  (void)state;
  RvePacking packing = help_packing(2, 2);
  RveScene scene = help_scene(2);
  RveAnswer answer[2];
  packing.cell[0] = packing.cell[4] = 0.1;
  packing.radius[0] = packing.radius[1] = 5e-3;
  packing.position[0] = -0.2, packing.position[3] = 0.2; /* 3 cm apart, 0.1 m/s: contact after 0.3 s */
  MUST(BASE_ALLOC(6, &packing.velocity));
  packing.velocity[0] = 0.05, packing.velocity[3] = -0.05;
  for (int flight = 0; flight < 2; flight++) {
    scene.flight = flight;
    RveBatch *batch = help_batch(&scene, &packing);
    for (int k = 0; k < 400; k++) answer[flight] = help_step(batch, NULL, 0.0, 1e-3);
    assert_true(answer[flight].coordination == 0.0); /* bounced */
    assert_true(fabs(answer[flight].kinetic_energy / answer[0].kinetic_energy - 1.0) <= 1e-9);
    const int64_t flown = rve_batch_flown(batch);
    printf("two grains that meet: %lld of 400 calls were flights\n", (long long)flown);
    assert_true(flight ? flown > 300 && flown < 400 : flown == 0);
    rve_batch_destroy(batch);
  }
  rve_packing_destroy(&packing);
}

static void a_crystal_touches_again_as_at_first_load(void **state) {
  (void)state;
  RvePacking packing = help_crystal(HELP_HEXAGONAL, 3, 5e-3, 1e-3);
  RveScene scene = help_scene(2);
  double out[9] = {0.0}, in[9] = {0.0};
  out[0] = out[4] = 10.0, in[0] = in[4] = -10.0;
  scene.tangential_stiffness = 8e5;
  scene.local_damping = 0.3;
  RveBatch *batch = help_batch(&scene, &packing);
  const RveAnswer start = help_step(batch, NULL, 0.0, 0.0);
  const RveAnswer apart = run(batch, out, 0.0, 1e-4, 50);
  assert_true(apart.coordination == 0.0);
  const RveAnswer again = run(batch, in, 0.0, 1e-4, 50);
  assert_true(help_difference(6, again.stress, start.stress) <
              1e-10); /* lengths differ by round-off of 1e-14 over 1e-3 */
  rve_batch_destroy(batch);
  rve_packing_destroy(&packing);
}

static void jamming_cycles_stay_bounded(void **state) {
  (void)state;
  RvePacking packing = help_random(2, 10, 2e4, 8);
  RveScene scene = help_scene(2);
  double out[9] = {0.0}, in[9] = {0.0}, kinetic = 0.0, elastic = 0.0;
  out[0] = 8.0, out[4] = 6.0, in[0] = -8.0, in[4] = -6.0;
  scene.tangential_stiffness = 8e5;
  scene.critical_damping = 0.2;
  RveBatch *batch = help_batch(&scene, &packing);
  for (int cycle = 0; cycle < 6; cycle++) {
    const RveAnswer loose = run(batch, out, 0.0, 2e-4, 50), dense = run(batch, in, 0.0, 2e-4, 50);
    kinetic = fmax(kinetic, fmax(loose.kinetic_energy, dense.kinetic_energy));
    elastic = fmax(elastic, dense.elastic_energy);
    assert_true(loose.coordination < 1.0 && dense.coordination > 2.0);
  }
  assert_true(kinetic < 2.0 * elastic); /* work put in comes from springs; dashpots take it away */
  rve_batch_destroy(batch);
  rve_packing_destroy(&packing);
}

static void an_rve_that_runs_away_is_reported_and_keeps_its_last_answer(void **state) {
  (void)state;
  RvePacking packing = help_crystal(HELP_SQUARE, 4, 5e-3, 0.01);
  RveScene scene = help_scene(2);
  RveInput input = {{0.0}, 0.0};
  RveAnswer answer, good;
  MUST(BASE_ALLOC(3 * (size_t)packing.grains, &packing.velocity));
  packing.velocity[0] = packing.velocity[4] = 0.1;
  scene.time_step = 3.0 * rve_critical_time_step(&scene, &packing);
  RveBatch *batch = help_batch(&scene, &packing);
  good = answer = help_step(batch, NULL, 0.0, 0.0);
  BaseStatus status = BASE_OK;
  for (int k = 0; k < 1000 && status == BASE_OK; k++) {
    good = answer;
    status = rve_batch_step(batch, 1, NULL, &input, scene.time_step, &answer);
  }
  assert_int_equal(status, BASE_ERROR_UNSTABLE);
  assert_int_equal(answer.status, BASE_ERROR_UNSTABLE);
  assert_memory_equal(answer.stress, good.stress, sizeof good.stress);
  assert_int_equal(rve_batch_step(batch, 1, NULL, &input, 1e-3, &answer), BASE_ERROR_UNSTABLE); /* and stays so */
  rve_batch_destroy(batch);
  rve_packing_destroy(&packing);
}

/* -----------------------------------------------------------------------------------------------------------------
 * bonds */

static RveBatch *bonded(const RveScene *scene, const RvePacking *packing) {
  RveBatch *batch = help_batch(scene, packing);
  MUST(rve_batch_install_bonds(batch, 0, NULL));
  return batch;
}

static void bonds_carry_tension_to_their_strength_and_stay_broken(void **state) {
  (void)state;
  const double radius = 5e-3, strength = 1e-2; /* F_nb = strength kn R */
  RvePacking packing = help_crystal(HELP_SQUARE, 2, radius, 1e-6);
  RveScene scene = help_scene(2);
  double pull[9] = {0.0}, push[9] = {0.0};
  scene.bonds = 1;
  scene.bond_strength = strength;
  scene.tangential_stiffness = 5e5;
  scene.substeps = 1;
  pull[0] = 1e-3, push[0] = -1e-3;
  RveBatch *batch = bonded(&scene, &packing);
  RveAnswer answer = help_step(batch, NULL, 0.0, 0.0);
  assert_true(answer.bond_fraction == 1.0);
  /* Opening 2R e_xx = F_nb / kn = strength R at a strain of 0.5 %. */
  double most = 0.0;
  for (int k = 0; k < 10; k++) {
    answer = help_step(batch, pull, 0.0, 1.0);
    most = fmax(most, answer.stress[0]);
    assert_true(answer.bond_fraction == (k < 4 ? 1.0 : 0.5)); /* bonds along x break, those along y do not */
  }
  assert_true(answer.stress[0] == 0.0);
  assert_true(most > 0.75 * strength * radius * scene.normal_stiffness / (2.0 * radius * scene.thickness));
  for (int k = 0; k < 10; k++) answer = help_step(batch, push, 0.0, 1.0);
  assert_true(answer.bond_fraction == 0.5);
  for (int k = 0; k < 5; k++) answer = help_step(batch, push, 0.0, 1.0);
  assert_true(answer.stress[0] < 0.0); /* an ordinary contact now: pushes */
  for (int k = 0; k < 10; k++) answer = help_step(batch, pull, 0.0, 1.0);
  assert_true(answer.stress[0] == 0.0); /* but does not pull */
  rve_batch_destroy(batch);
  rve_packing_destroy(&packing);
}

static void bonds_break_under_shear(void **state) {
  (void)state;
  RvePacking packing = help_crystal(HELP_SQUARE, 3, 5e-3, 1e-6);
  RveScene scene = help_scene(2);
  double shear[9] = {0.0};
  scene.bonds = 1;
  scene.bond_strength = 1e-2;
  scene.bond_shear_ratio = 0.5;
  scene.tangential_stiffness = 5e5;
  scene.substeps = 1;
  shear[1] = shear[3] = 5e-4;
  RveBatch *batch = bonded(&scene, &packing);
  /* F_t = kt 2R e_xy per contact (pure shear, no spin by symmetry) reaches mu_b F_nb at e_xy = 0.5 1e-2 1e6 R / (5e5
   * 2R) = 5e-3. */
  RveAnswer answer = help_step(batch, NULL, 0.0, 0.0);
  for (int k = 1; k <= 12; k++) {
    answer = help_step(batch, shear, 0.0, 1.0);
    assert_true(k == 10 || answer.bond_fraction == (k < 10 ? 1.0 : 0.0));
  }
  rve_batch_destroy(batch);
  rve_packing_destroy(&packing);
}

static void bonds_melt(void **state) {
  (void)state;
  RvePacking packing = help_crystal(HELP_SQUARE, 2, 5e-3, 1e-6);
  RveScene scene = help_scene(2);
  double pull[9] = {0.0};
  help_heat(&scene);
  scene.expansion = 0.0;
  scene.bonds = 1;
  scene.bond_strength = 1e-2;
  scene.bond_melting_temperature = 10.0;
  scene.substeps = 1;
  pull[0] = pull[4] = 2e-3;
  RveBatch *batch = bonded(&scene, &packing);
  RveAnswer answer = help_step(batch, pull, 0.0, 1.0);
  assert_true(answer.bond_fraction == 1.0 && answer.stress[0] > 0.0);
  answer = help_step(batch, NULL, 5.0, 1.0); /* half the strength still holds 2e-3 * 2R kn = 0.4 F_nb */
  assert_true(answer.bond_fraction == 1.0);
  answer = help_step(batch, NULL, 7.0, 1.0); /* 30 % does not */
  assert_true(answer.bond_fraction == 0.0 && answer.stress[0] == 0.0);
  answer = help_step(batch, NULL, 0.0, 1.0);
  assert_true(answer.bond_fraction == 0.0);
  rve_batch_destroy(batch);
  rve_packing_destroy(&packing);
}

/* Bonds so weak that they stretch out of any list's reach must not be lost: unbroken, they pull the crystal back. */
static void long_bonds_survive_new_lists(void **state) {
  (void)state;
  RvePacking packing = help_crystal(HELP_SQUARE, 3, 5e-3, 1e-6);
  RveScene scene = help_scene(2);
  double pull[9] = {0.0};
  scene.bonds = 1;
  scene.bond_strength = 1e3;
  scene.substeps = 10;
  pull[0] = pull[4] = 0.05;
  RveBatch *batch = bonded(&scene, &packing);
  RveAnswer answer = help_step(batch, NULL, 0.0, 0.0);
  const int64_t rebuilds = answer.rebuilds;
  for (int k = 0; k < 10; k++) answer = help_step(batch, pull, 0.0, 1.0);
  assert_true(answer.rebuilds > rebuilds);
  assert_true(answer.bond_fraction == 1.0);
  const double length = 2.0 * 5e-3 * (1.0 - 1e-6), stretched = length * exp(0.5);
  const double expected = scene.normal_stiffness * (stretched - 2.0 * 5e-3) / (stretched * scene.thickness);
  assert_true(fabs(answer.stress[0] / expected - 1.0) < 1e-12);
  rve_batch_destroy(batch);
  rve_packing_destroy(&packing);
}

/* ------------------------------------------------------------------------------------------------------------------
 * heat */

static void two_grains_exchange_heat_exponentially(void **state) {
  (void)state;
  const double pi = 3.14159265358979323846, r = 5e-3, length = 2.0 * r * (1.0 - 1e-3);
  RvePacking packing = help_packing(3, 2);
  RveScene scene = help_scene(3);
  help_heat(&scene);
  for (int k = 0; k < 3; k++) packing.cell[4 * k] = 0.05;
  packing.radius[0] = packing.radius[1] = r;
  packing.position[0] = -0.5 * length / 0.05, packing.position[3] = 0.5 * length / 0.05;
  RveBatch *batch = help_batch(&scene, &packing);
  const double capacity = scene.density * 4.0 / 3.0 * pi * r * r * r * scene.grain_heat_capacity;
  const double h = 1.0 / (scene.pipe_resistance * length), rate = 2.0 * h / capacity;
  const int64_t steps = 2000000;
  const double dt = 1.0 / (rate * (double)steps); /* one decay time; Euler's error is dt rate / 2 = 2.5e-7 */
  double temperature[2] = {350.0, 290.0};
  const double sum = temperature[0] + temperature[1], difference = temperature[0] - temperature[1];
  MUST(rve_batch_conduct(batch, 0, dt, steps, temperature));
  const double error = fabs((temperature[0] - temperature[1]) / (difference * exp(-1.0)) - 1.0);
  const double energy = fabs((temperature[0] + temperature[1]) / sum - 1.0);
  help_report("A11 temperature difference of a pair", error);
  help_report("A11 energy of a pair", energy);
  assert_true(error <= 1e-6);
  assert_true(energy <= 1e-13);
  assert_int_equal(rve_batch_conduct(batch, 0, capacity / h * 1.01, 1, temperature), BASE_ERROR_ARGUMENT);
  rve_batch_destroy(batch);
  rve_packing_destroy(&packing);
}

static void grains_expand_and_press(void **state) {
  (void)state;
  RvePacking packing = help_random(2, 8, 2e4, 30);
  RveScene scene = help_scene(2);
  help_heat(&scene);
  scene.tangential_stiffness = 8e5;
  scene.local_damping = 0.7;
  RveBatch *batch = help_batch(&scene, &packing);
  const RveAnswer cold = help_step(batch, NULL, 0.0, 0.0);
  RveAnswer warm = cold;
  for (int k = 1; k <= 50; k++) warm = help_step(batch, NULL, 1.0 * k, 1e-4);
  assert_true(warm.stress[0] + warm.stress[1] < cold.stress[0] + cold.stress[1]);
  assert_true(fabs(warm.solid_fraction / cold.solid_fraction / pow(1.0 + 50.0 * scene.expansion, 2.0) - 1.0) < 1e-12);
  rve_batch_destroy(batch);
  rve_packing_destroy(&packing);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(stretched_rve_is_a_stressless_gas_and_comes_back),
      cmocka_unit_test(free_flights_equal_the_steps),
      cmocka_unit_test(a_flight_ends_before_grains_meet),
      cmocka_unit_test(a_crystal_touches_again_as_at_first_load),
      cmocka_unit_test(jamming_cycles_stay_bounded),
      cmocka_unit_test(an_rve_that_runs_away_is_reported_and_keeps_its_last_answer),
      cmocka_unit_test(bonds_carry_tension_to_their_strength_and_stay_broken),
      cmocka_unit_test(bonds_break_under_shear),
      cmocka_unit_test(bonds_melt),
      cmocka_unit_test(long_bonds_survive_new_lists),
      cmocka_unit_test(two_grains_exchange_heat_exponentially),
      cmocka_unit_test(grains_expand_and_press),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
