/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Verification A1: crystals answer with their closed forms. */
#include "cuda_rve/rve_packing.h"
#include "rve_help.h"

static const double radius = 5e-3;
enum { TRIALS = 50 };

/* 0.2 % random strain and rotation in the crystal's dimensions. */
static void random_gradient(int dim, double size, uint64_t *seed, double gradient[9]) {
  memset(gradient, 0, 9 * sizeof *gradient);
  for (int i = 0; i < dim; i++)
    for (int j = 0; j < dim; j++) gradient[3 * i + j] = help_uniform(seed, -size, size);
}

typedef struct Expected {
  double stress[6], conductivity[6];
} Expected;

enum { BRANCHES = 6 }; /* fcc has 12 neighbours */

/* Branches of one grain, one of each +- pair, and what goes with them, undeformed. */
typedef struct Crystal {
  int contacts;
  double branch[BRANCHES][3], volume; /* m; m^3 */
} Crystal;

static Crystal table_crystal(HelpLattice lattice, const RveScene *scene, double overlap) {
  Crystal crystal;
  double branch[HELP_NEIGHBOURS][3], cell[9];
  const double length = 2.0 * radius * (1.0 - overlap);
  memset(&crystal, 0, sizeof crystal);
  crystal.contacts = help_branches(lattice, branch, cell);
  crystal.volume = tensor_determinant(cell) * pow(length, scene->dimension) * (scene->dimension == 2 ? scene->thickness : 1.0);
  for (int c = 0; c < crystal.contacts; c++)
    for (int k = 0; k < 3; k++) crystal.branch[c][k] = length * branch[c][k];
  return crystal;
}

/* Of a primitive cell: all lattice vectors shorter than 2R. */
static Crystal lattice_crystal(const double cell[9], const RveScene *scene) {
  Crystal crystal;
  const int deep = scene->dimension == 3 ? 3 : 0;
  memset(&crystal, 0, sizeof crystal);
  crystal.volume = tensor_determinant(cell) * (scene->dimension == 2 ? scene->thickness : 1.0);
  for (int x = 0; x <= 3; x++)
    for (int y = -3; y <= 3; y++)
      for (int z = -deep; z <= deep; z++) {
        double b[3];
        if (x == 0 && (y < 0 || (y == 0 && z <= 0))) continue; /* one of +- */
        for (int k = 0; k < 3; k++) b[k] = cell[3 * k] * x + cell[3 * k + 1] * y + cell[3 * k + 2] * z;
        if (sqrt(b[0] * b[0] + b[1] * b[1] + b[2] * b[2]) >= 2.0 * radius) continue;
        assert_true(crystal.contacts < BRANCHES);
        memcpy(crystal.branch[crystal.contacts++], b, sizeof b);
      }
  return crystal;
}

/* Sums over the branches, deformed by F = exp(gradient): normal force from the length, tangential force from one step of
 * relative motion kt (1 - n n) D b, D = sym gradient. */
static Expected closed_form(const Crystal *crystal, const RveScene *scene, double expansion, const double gradient[9]) {
  double f[9], stress[9] = {0.0}, conductivity[9] = {0.0};
  tensor_exponential(gradient, 1.0, f);
  const double volume = crystal->volume * tensor_determinant(f);
  for (int c = 0; c < crystal->contacts; c++) {
    const double *b0 = crystal->branch[c];
    double b[3], force[3], length = 0.0, along = 0.0, moved[3];
    for (int i = 0; i < 3; i++) b[i] = f[3 * i] * b0[0] + f[3 * i + 1] * b0[1] + f[3 * i + 2] * b0[2];
    length = sqrt(b[0] * b[0] + b[1] * b[1] + b[2] * b[2]);
    for (int i = 0; i < 3; i++) {
      moved[i] = 0.0;
      for (int j = 0; j < 3; j++) moved[i] += 0.5 * (gradient[3 * i + j] + gradient[3 * j + i]) * b[j];
      along += moved[i] * b[i] / length;
    }
    for (int i = 0; i < 3; i++)
      force[i] = -scene->normal_stiffness * (2.0 * radius * (1.0 + expansion) - length) * b[i] / length +
                 scene->tangential_stiffness * (moved[i] - along * b[i] / length);
    for (int i = 0; i < 3; i++)
      for (int j = 0; j < 3; j++) {
        stress[3 * i + j] += force[i] * b[j] / volume;
        conductivity[3 * i + j] += b[i] * b[j] / (scene->pipe_resistance * length * volume);
      }
  }
  Expected expected;
  help_symmetric(stress, expected.stress);
  help_symmetric(conductivity, expected.conductivity);
  return expected;
}

/* Relative errors of one random deformation in one DEM step. */
static void compare_once(const RveScene *scene, const RvePacking *packing, const Crystal *crystal, uint64_t *seed,
                         double *stress_error, double *conductivity_error) {
  double gradient[9];
  random_gradient(scene->dimension, 2e-3, seed, gradient);
  RveBatch *batch = help_batch(scene, packing);
  const RveAnswer answer = help_step(batch, gradient, 0.0, 1.0);
  const Expected expected = closed_form(crystal, scene, 0.0, gradient);
  *stress_error = fmax(*stress_error, help_difference(6, answer.stress, expected.stress));
  *conductivity_error = fmax(*conductivity_error, help_difference(6, answer.conductivity, expected.conductivity));
  rve_batch_destroy(batch);
}

static RveScene sticking_scene(int dimension, double kt) {
  RveScene scene = help_scene(dimension);
  help_heat(&scene);
  scene.tangential_stiffness = kt;
  scene.friction = 1e9; /* contacts stick */
  scene.substeps = 1;
  return scene;
}

static void compare_crystal(HelpLattice lattice, int copies, double kt, double *stress_error,
                            double *conductivity_error) {
  const double overlap = 0.02;
  const RveScene scene = sticking_scene(help_dimension(lattice), kt);
  RvePacking packing = help_crystal(lattice, copies, radius, overlap);
  const Crystal crystal = table_crystal(lattice, &scene, overlap);
  uint64_t seed = 7;
  for (int trial = 0; trial < TRIALS; trial++)
    compare_once(&scene, &packing, &crystal, &seed, stress_error, conductivity_error);
  rve_packing_destroy(&packing);
}

static void crystals_meet_closed_forms_of_stress_and_conductivity(void **state) {
  (void)state;
  double stress = 0.0, conductivity = 0.0;
  for (int lattice = 0; lattice < 3; lattice++)
    for (int stiffness = 0; stiffness < 3; stiffness++) {
      compare_crystal((HelpLattice)lattice, 1, 3e5 * stiffness, &stress, &conductivity);
      compare_crystal((HelpLattice)lattice, lattice == HELP_CUBIC ? 3 : 5, 3e5 * stiffness, &stress, &conductivity);
    }
  help_report("A1 largest relative error of stress", stress);
  help_report("A1 largest relative error of conductivity", conductivity);
  /* Verification A1. Round-off of a length over the overlap of 2 % is 1e-14. */
  assert_true(stress <= 1e-12);
  assert_true(conductivity <= 1e-12);
}

/* A random rotation: H <- Q H. */
static void turn_cell(int dim, uint64_t *seed, double cell[9]) {
  double spin[9] = {0.0}, q[9], turned[9];
  for (int i = 0; i < dim; i++)
    for (int j = 0; j < i; j++) {
      spin[3 * i + j] = help_uniform(seed, -2.0, 2.0);
      spin[3 * j + i] = -spin[3 * i + j];
    }
  tensor_exponential(spin, 1.0, q);
  tensor_multiply(q, cell, turned);
  memcpy(cell, turned, sizeof turned);
}

static void all_lattices_in_any_orientation_meet_the_lattice_sum(void **state) {
  (void)state;
  static const int neighbours[5] = {4, 6, 6, 8, 12};
  double stress = 0.0, conductivity = 0.0;
  uint64_t seed = 19;
  for (int lattice = 0; lattice < 5; lattice++)
    for (int turned = 0; turned < 4; turned++)
      for (int copies = 1; copies <= 3; copies += 2) {
        RvePacking cell, packing;
        MUST(rve_packing_lattice((RveLattice)lattice, radius, 0.02, &cell));
        if (turned) turn_cell(cell.dimension, &seed, cell.cell);
        const int many[3] = {copies, copies, cell.dimension == 3 ? copies : 1};
        MUST(rve_packing_replicate(&cell, many, &packing));
        const RveScene scene = sticking_scene(cell.dimension, 3e5 * turned);
        const Crystal crystal = lattice_crystal(cell.cell, &scene);
        assert_int_equal(2 * crystal.contacts, neighbours[lattice]);
        for (int trial = 0; trial < TRIALS; trial++)
          compare_once(&scene, &packing, &crystal, &seed, &stress, &conductivity);
        rve_packing_destroy(&packing);
        rve_packing_destroy(&cell);
      }
  help_report("A1 largest relative error of stress, five lattices, turned", stress);
  help_report("A1 largest relative error of conductivity, five lattices, turned", conductivity);
  assert_true(stress <= 1e-12);
  assert_true(conductivity <= 1e-12);
}

static void clamped_heating_raises_the_bulk_pressure(void **state) {
  (void)state;
  double error = 0.0;
  const double still[9] = {0.0}, hotter = 37.0;
  for (int lattice = 0; lattice < 3; lattice++)
    for (int copies = 1; copies <= 4; copies += 3) {
      const double overlap = 0.01;
      RveScene scene = help_scene(help_dimension((HelpLattice)lattice));
      RvePacking packing = help_crystal((HelpLattice)lattice, copies, radius, overlap);
      help_heat(&scene);
      RveBatch *batch = help_batch(&scene, &packing);
      const RveAnswer before = help_step(batch, still, 0.0, 1e-4), after = help_step(batch, still, hotter, 1e-4);
      const Crystal crystal = table_crystal((HelpLattice)lattice, &scene, overlap);
      const Expected expected = closed_form(&crystal, &scene, scene.expansion * hotter, still);
      error = fmax(error, help_difference(6, after.stress, expected.stress));
      /* The rise itself: C11 + C12 (2D), C11 + 2 C12 (3D) times strain beta dT, with l = 2R in the closed forms. */
      const double rise = expected.stress[0] - before.stress[0];
      assert_true(rise < 0.0);
      assert_true(fabs((after.stress[0] - before.stress[0]) / rise - 1.0) < 1e-12);
      rve_batch_destroy(batch);
      rve_packing_destroy(&packing);
    }
  help_report("A1 largest relative error of the clamped pressure", error);
  assert_true(error <= 1e-12);
}

/* C_11, C_12, C_44 of the table in verification.md, times thickness in 2D. */
static void table(HelpLattice lattice, double kn, double kt, double l, double c[3]) {
  const double q = sqrt(3.0) / 4.0;
  if (lattice == HELP_SQUARE) c[0] = kn, c[1] = 0.0, c[2] = kt / 2.0;
  if (lattice == HELP_HEXAGONAL) c[0] = q * (3.0 * kn + kt), c[1] = q * (kn - kt), c[2] = q * (kn + kt);
  if (lattice == HELP_CUBIC) c[0] = kn / l, c[1] = 0.0, c[2] = kt / (2.0 * l);
}

/* Bonded, just touching crystals: half the difference of the stresses under +-strain is linear elasticity up to
 * strain^2. */
static void small_strain_moduli_are_those_of_the_table(void **state) {
  (void)state;
  double error = 0.0;
  for (int lattice = 0; lattice < 3; lattice++)
    for (int stiffness = 0; stiffness < 3; stiffness++) {
      const int dim = help_dimension((HelpLattice)lattice);
      const double size = 1e-5;
      RveScene scene = help_scene(dim);
      RvePacking packing = help_crystal((HelpLattice)lattice, 2, radius, 1e-9);
      double c[3];
      uint64_t seed = 3;
      scene.tangential_stiffness = 5e5 * stiffness;
      scene.substeps = 1;
      scene.bonds = 1;
      scene.bond_strength = scene.bond_shear_ratio = 1e3;
      table((HelpLattice)lattice, scene.normal_stiffness, scene.tangential_stiffness, 2.0 * radius, c);
      for (int trial = 0; trial < TRIALS; trial++) {
        double gradient[9], expected[6], stress[6] = {0.0}, trace = 0.0;
        random_gradient(dim, size, &seed, gradient);
        for (int sign = -1; sign <= 1; sign += 2) {
          double signed_gradient[9];
          for (int k = 0; k < 9; k++) signed_gradient[k] = sign * gradient[k];
          RveBatch *batch = help_batch(&scene, &packing);
          MUST(rve_batch_install_bonds(batch, 0, NULL));
          const RveAnswer answer = help_step(batch, signed_gradient, 0.0, 1.0);
          for (int k = 0; k < 6; k++) stress[k] += 0.5 * sign * answer.stress[k];
          rve_batch_destroy(batch);
        }
        help_symmetric(gradient, expected); /* the strain */
        for (int k = 0; k < dim; k++) trace += expected[k];
        for (int k = 0; k < 3; k++) expected[k] = k < dim ? (c[0] - c[1]) * expected[k] + c[1] * trace : 0.0;
        for (int k = 3; k < 6; k++) expected[k] *= 2.0 * c[2];
        for (int k = 0; k < 6 && dim == 2; k++) expected[k] /= scene.thickness;
        error = fmax(error, help_difference(6, stress, expected));
      }
      rve_packing_destroy(&packing);
    }
  help_report("A1 largest relative error of the moduli", error);
  assert_true(error <= 1e-7); /* strain 1e-5: third-order terms 1e-10, over the smallest stress about 1e-8 */
}

static void modulus_is_the_largest_p_wave_modulus(void **state) {
  (void)state;
  for (int lattice = 0; lattice < 3; lattice++) {
    RveScene scene = help_scene(help_dimension((HelpLattice)lattice));
    RvePacking packing = help_crystal((HelpLattice)lattice, 3, radius, 1e-6);
    double c[3];
    scene.tangential_stiffness = 4e5;
    table((HelpLattice)lattice, scene.normal_stiffness, scene.tangential_stiffness, 2.0 * radius, c);
    RveBatch *batch = help_batch(&scene, &packing);
    const RveAnswer answer = help_step(batch, NULL, 0.0, 0.0);
    /* 1e-5: the branch is 1e-6 shorter than 2R. The largest is along an axis here, as kn > kt. */
    assert_true(fabs(answer.modulus * (scene.dimension == 2 ? scene.thickness : 1.0) / c[0] - 1.0) < 1e-5);
    rve_batch_destroy(batch);
    rve_packing_destroy(&packing);
  }
}

static void critical_time_steps_are_met_exactly_or_from_below(void **state) {
  (void)state;
  const double pi = 3.14159265358979323846;
  for (int lattice = 0; lattice < 3; lattice++)
    for (int k = 0; k <= 4; k++) {
      const double r = 0.25 * k;
      RveScene scene = help_scene(help_dimension((HelpLattice)lattice));
      RvePacking packing = help_crystal((HelpLattice)lattice, 3, radius, 1e-6);
      scene.tangential_stiffness = r * scene.normal_stiffness;
      const double exact[3] = {fmax(4 + 4 * r, 16 * r), fmax(6 + 2 * r, 24 * r), fmax(4 + 8 * r, 20 * r)};
      const double bound[3] = {exact[0], fmax(6 + 6 * r, 24 * r), exact[2]};
      const double mass = scene.density * (lattice == HELP_CUBIC ? 4.0 / 3.0 * pi * pow(radius, 3.0)
                                                                 : pi * radius * radius * scene.thickness);
      const double unit = 2.0 * sqrt(mass / scene.normal_stiffness), found = rve_critical_time_step(&scene, &packing);
      assert_true(fabs(found / (unit / sqrt(bound[lattice])) - 1.0) < 1e-12);
      assert_true(found <= unit / sqrt(exact[lattice]) * (1.0 + 1e-12));
      rve_packing_destroy(&packing);
    }
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(crystals_meet_closed_forms_of_stress_and_conductivity),
      cmocka_unit_test(all_lattices_in_any_orientation_meet_the_lattice_sum),
      cmocka_unit_test(clamped_heating_raises_the_bulk_pressure),
      cmocka_unit_test(small_strain_moduli_are_those_of_the_table),
      cmocka_unit_test(modulus_is_the_largest_p_wave_modulus),
      cmocka_unit_test(critical_time_steps_are_met_exactly_or_from_below),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
