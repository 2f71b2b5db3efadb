/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Verification A7: bonded crystals of all lattices over 100,000 steps at 0.1, 0.98 and 1.02 of the critical time step. */
#include "cuda_rve/rve_packing.h"
#include "rve_help.h"

enum { LATTICES = 5, STEPS = 100000, CALLS = 50 };
static const char *const name[LATTICES] = {"square", "hexagonal", "simple cubic", "bcc", "fcc"};
static const double pi = 3.14159265358979323846;

/* 3 x 3 (x 3) cells under random velocities and spins. kt = kn: rotation in phase limits the step in every lattice, W = 4 N kt / kn
 * in 2D and 10/3 N kt / kn in 3D for N contacts per grain, which the estimate meets exactly. */
static RvePacking shaken_crystal(int lattice) {
  RvePacking cell, packing;
  uint64_t seed = 5;
  MUST(rve_packing_lattice((RveLattice)lattice, 5e-3, 1e-10, &cell));
  const int copies[3] = {3, 3, cell.dimension == 3 ? 3 : 1}, dim = cell.dimension;
  MUST(rve_packing_replicate(&cell, copies, &packing));
  MUST(BASE_ALLOC(3 * (size_t)packing.grains, &packing.velocity));
  MUST(BASE_ALLOC(3 * (size_t)packing.grains, &packing.spin));
  for (int i = 0; i < packing.grains; i++)
    for (int k = 0; k < dim; k++) {
      packing.velocity[3 * i + k] = help_uniform(&seed, -1e-4, 1e-4);
      packing.spin[3 * i + (dim == 2 ? 2 : k)] = help_uniform(&seed, -2e-2, 2e-2);
    }
  rve_packing_destroy(&cell);
  return packing;
}

static RveScene bonded_scene(int dimension) {
  RveScene scene = help_scene(dimension);
  scene.tangential_stiffness = scene.normal_stiffness;
  scene.bonds = 1;
  scene.bond_strength = scene.bond_shear_ratio = 1e6;
  return scene;
}

/* What leapfrog conserves exactly on linear springs: v(n-1/2) M v(n+1/2) / 2 + elastic energy(n). It is positive below the
 * critical step and has none of the ripple that the energies of different times make together. Takes one step. */
static double conserved_energy(RveBatch *batch, const RveScene *scene) {
  RvePacking before, after;
  double kinetic = 0.0;
  const double elastic = help_step(batch, NULL, 0.0, 0.0).elastic_energy;
  MUST(rve_batch_packing(batch, 0, &before));
  help_step(batch, NULL, 0.0, scene->time_step);
  MUST(rve_batch_packing(batch, 0, &after));
  for (int i = 0; i < before.grains; i++) {
    const double r = before.radius[i], disk = scene->grain == RVE_DISK;
    const double mass = scene->density * (disk ? pi * r * r * scene->thickness : 4.0 / 3.0 * pi * r * r * r);
    for (int k = 0; k < 3; k++)
      kinetic += 0.5 * mass * before.velocity[3 * i + k] * after.velocity[3 * i + k] +
                 0.5 * (disk ? 0.5 : 0.4) * mass * r * r * before.spin[3 * i + k] * after.spin[3 * i + k];
  }
  rve_packing_destroy(&before);
  rve_packing_destroy(&after);
  return kinetic + elastic;
}

/* Largest relative deviation of the conserved energy from its first value; -1 if the watchdog spoke before. */
static double run(int lattice, double fraction) {
  RvePacking packing = shaken_crystal(lattice);
  RveScene scene = bonded_scene(packing.dimension);
  RveInput input = {{0.0}, 0.0};
  RveAnswer answer;
  double drift = 0.0;
  scene.time_step = fraction * rve_critical_time_step(&scene, &packing);
  RveBatch *batch = help_batch(&scene, &packing);
  MUST(rve_batch_install_bonds(batch, 0, NULL));
  if (fraction < 1.0) {
    const double first = conserved_energy(batch, &scene);
    assert_true(first > 0.0);
    for (int call = 0; call < CALLS; call++) {
      help_step(batch, NULL, 0.0, (STEPS / CALLS - 1) * scene.time_step);
      drift = fmax(drift, fabs(conserved_energy(batch, &scene) / first - 1.0));
    }
  } else if (rve_batch_step(batch, 1, NULL, &input, STEPS * scene.time_step, &answer) != BASE_OK) {
    assert_int_equal(answer.status, BASE_ERROR_UNSTABLE);
    drift = -1.0;
  }
  rve_batch_destroy(batch);
  rve_packing_destroy(&packing);
  return drift;
}

static void report(const char *lattice, double fraction, double drift) {
  print_message("           A7 %s at %.2f: energy drift %.1e\n", lattice, fraction, drift);
}

static void energy_does_not_drift_at_a_tenth_of_the_critical_step(void **state) {
  (void)state;
  for (int lattice = 0; lattice < LATTICES; lattice++) {
    const double drift = run(lattice, 0.1);
    report(name[lattice], 0.1, drift);
    assert_true(drift <= 1e-3);
  }
}

static void nothing_grows_just_below_the_critical_step(void **state) {
  (void)state;
  for (int lattice = 0; lattice < LATTICES; lattice++) {
    const double drift = run(lattice, 0.98);
    report(name[lattice], 0.98, drift);
    assert_true(drift <= 1e-3);
  }
}

static void the_watchdog_speaks_just_above_the_critical_step(void **state) {
  (void)state;
  for (int lattice = 0; lattice < LATTICES; lattice++) assert_true(run(lattice, 1.02) == -1.0);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(energy_does_not_drift_at_a_tenth_of_the_critical_step),
      cmocka_unit_test(nothing_grows_just_below_the_critical_step),
      cmocka_unit_test(the_watchdog_speaks_just_above_the_critical_step),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
