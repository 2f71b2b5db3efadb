/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The generator: void ratios of TM-DEMPM 5.3, equilibrium, determinism. */
#include "packing_help.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "cuda_rve/rve_packing_pairs.h"

#define MUST(expression)                                                                \
  do {                                                                                  \
    if ((expression) != BASE_OK) fail_msg("%s: %s", #expression, base_error_message()); \
  } while (0)

/* The grains of TM-DEMPM 5.3: 400 disks of 2.5 to 5 mm, kn = kt = 1e6 N/m, 75 mm thick. */
static RveScene paper_scene(void) {
  RveScene scene = rve_scene_default();
  scene.thickness = 0.075;
  scene.density = 2650.0;
  scene.normal_stiffness = scene.tangential_stiffness = 1e6;
  scene.friction = 0.5;
  return scene;
}

static RveGenerator paper_generator(double pressure, double friction) {
  RveGenerator generator = rve_generator_default();
  generator.radius_min = 0.0025;
  generator.radius_max = 0.005;
  generator.pressure = pressure;
  generator.preparation_friction = friction;
  return generator;
}

static double void_ratio(const RvePacking *packing) {
  return packing_cell_measure(packing) / packing_grain_measure(packing) - 1.0;
}

static double generated_void_ratio(double pressure, double friction, uint64_t seed) {
  const RveScene scene = paper_scene();
  RveGenerator generator = paper_generator(pressure, friction);
  RvePacking packing;
  if (seed > 0) generator.seed = seed;
  MUST(rve_packing_generate(&scene, &generator, &packing));
  const double ratio = void_ratio(&packing);
  rve_packing_destroy(&packing);
  return ratio;
}

/* The sanitizers slow the engine twentyfold and find nothing new in another seed; the bands are wider for few. */
#ifdef __SANITIZE_ADDRESS__
enum { SEEDS = 1 };
static const double wider = 3.0;
#else
enum { SEEDS = 8 };
static const double wider = 1.0;
#endif

static double mean_void_ratio(double pressure, double friction) {
  double sum = 0.0;
  for (uint64_t seed = 1; seed <= SEEDS; seed++) sum += generated_void_ratio(pressure, friction, seed);
  return sum / SEEDS;
}

/* One packing of 400 grains scatters by 0.003 (mu 0.01) and 0.006 (mu 0.5), and every instruction set gives other
 * trajectories: the means of 8 seeds scatter by a third of that. The bands are those the project asks for. */
static void preparation_friction_sets_the_void_ratio_at_100_kpa(void **state) {
  (void)state;
  const double dense = mean_void_ratio(1e5, 0.01), loose = mean_void_ratio(1e5, 0.5);
  print_message("void ratio at 100 kPa: %.4f (mu 0.01), %.4f (mu 0.5)\n", dense, loose);
  assert_true(fabs(dense - 0.165) < 0.005 * wider);
  assert_true(fabs(loose - 0.235) < 0.010 * wider);
}

/* The paper's packings at 10 kPa have 0.243 to 0.251; ours are looser by 0.005 in the mean, within one packing's
 * scatter. */
static void less_pressure_leaves_a_looser_packing(void **state) {
  (void)state;
  const double loose = mean_void_ratio(1e4, 0.5);
  print_message("void ratio at 10 kPa: %.4f (mu 0.5)\n", loose);
  assert_true(fabs(loose - 0.2495) < 0.0065 * wider);
}

/* A batch made from the packing is where the generator left it: the tangential history came along. */
static void check_equilibrium(const RveScene *scene, const RveGenerator *generator, const RvePacking *packing) {
  RveBatch *batch;
  RveAnswer answer;
  const RveInput still = {{0.0}, 0.0};
  MUST(rve_packing_check(packing));
  assert_null(packing->velocity);
  MUST(rve_batch_create(scene, packing, 1, NULL, 1, RVE_BACKEND_CPU, &batch));
  MUST(rve_batch_step(batch, 1, NULL, &still, 0.0, &answer));
  for (int k = 0; k < 6; k++) {
    if (scene->dimension == 2 && k != 0 && k != 1 && k != 3) continue;
    const double target = k < 3 ? -generator->pressure : 0.0;
    assert_true(fabs(answer.stress[k] - target) < generator->stress_tolerance * generator->pressure);
  }
  assert_true(answer.unbalanced < generator->unbalanced_tolerance);
  rve_batch_destroy(batch);
}

static void packing_is_in_isotropic_equilibrium(void **state) {
  (void)state;
  const RveScene scene = paper_scene();
  const RveGenerator generator = paper_generator(1e5, 0.5);
  RvePacking packing;
  MUST(rve_packing_generate(&scene, &generator, &packing));
  assert_int_equal(packing.grains, 400);
  assert_true(packing.contacts > 400);
  check_equilibrium(&scene, &generator, &packing);
  double smallest = 1.0, largest = 0.0;
  for (int i = 0; i < 400; i++)
    smallest = fmin(smallest, packing.radius[i]), largest = fmax(largest, packing.radius[i]);
  assert_true(smallest >= 0.0025 && smallest < 0.00255 && largest < 0.005 && largest > 0.00495);
  rve_packing_destroy(&packing);
}

static void spheres_are_packed_in_three_dimensions(void **state) {
  (void)state;
  RveScene scene = paper_scene();
  RveGenerator generator = paper_generator(1e5, 0.01);
  RvePacking packing;
  scene.dimension = 3;
  scene.grain = RVE_SPHERE;
  generator.grains = 120;
  MUST(rve_packing_generate(&scene, &generator, &packing));
  check_equilibrium(&scene, &generator, &packing);
  /* random close packing of moderately polydisperse spheres: 0.64 to 0.65; 120 of them scatter by 0.01 */
  assert_true(fabs(1.0 / (1.0 + void_ratio(&packing)) - 0.64) < 0.03);
  rve_packing_destroy(&packing);
}

static void same_seed_gives_the_same_packing(void **state) {
  (void)state;
  const RveScene scene = paper_scene();
  RveGenerator generator = paper_generator(1e5, 0.5);
  RvePacking a, b, c;
  generator.grains = 60;
  MUST(rve_packing_generate(&scene, &generator, &a));
  MUST(rve_packing_generate(&scene, &generator, &b));
  generator.seed++;
  MUST(rve_packing_generate(&scene, &generator, &c));
  assert_memory_equal(a.cell, b.cell, sizeof a.cell);
  assert_memory_equal(a.position, b.position, 180 * sizeof(double));
  assert_memory_equal(a.radius, b.radius, 60 * sizeof(double));
  assert_int_equal(a.contacts, b.contacts);
  assert_memory_equal(a.contact_shear, b.contact_shear, 3 * (size_t)a.contacts * sizeof(double));
  assert_memory_not_equal(a.radius, c.radius, 60 * sizeof(double));
  rve_packing_destroy(&a);
  rve_packing_destroy(&b);
  rve_packing_destroy(&c);
}

static void frictionless_grains_need_no_friction(void **state) {
  (void)state;
  RveScene scene = paper_scene();
  RveGenerator generator = paper_generator(1e5, 0.0);
  RvePacking packing;
  scene.tangential_stiffness = 0.0;
  scene.friction = NAN;
  generator.grains = 60;
  MUST(rve_packing_generate(&scene, &generator, &packing));
  check_equilibrium(&scene, &generator, &packing);
  rve_packing_destroy(&packing);
}

static void refused(const RveScene *scene, const RveGenerator *generator, BaseStatus expected, const char *words) {
  RvePacking packing;
  assert_int_equal(rve_packing_generate(scene, generator, &packing), expected);
  if (!strstr(base_error_message(), words)) fail_msg("message '%s' lacks '%s'", base_error_message(), words);
  assert_null(packing.position);
}

static void wrong_requests_are_refused(void **state) {
  (void)state;
  const BaseStatus wrong = BASE_ERROR_ARGUMENT;
  RveScene scene = paper_scene();
  const RveGenerator good = paper_generator(1e5, 0.5);
  RveGenerator g = good;
  g.grains = 15, refused(&scene, &g, wrong, "grains = 15 (allowed: 16 to 1000000)"), g = good;
  scene.dimension = 3, scene.grain = RVE_SPHERE, g.grains = 17, g.radius_min = 0.001;
  refused(&scene, &g, wrong, "narrower than two of the largest grains: use more grains");
  scene = paper_scene(), g = good;
  g.radius_min = NAN, refused(&scene, &g, wrong, "radius_min is missing"), g = good;
  g.radius_min = 0.0, refused(&scene, &g, wrong, "radius_min = 0 (allowed: > 0)"), g = good;
  g.radius_max = 0.002, refused(&scene, &g, wrong, "radius_max = 0.002 (allowed: >= radius_min)"), g = good;
  g.pressure = -1e5, refused(&scene, &g, wrong, "pressure = -100000 (allowed: > 0)"), g = good;
  g.preparation_friction = -0.1, refused(&scene, &g, wrong, "preparation_friction = -0.1"), g = good;
  g.solid_fraction = 0.9, refused(&scene, &g, wrong, "solid_fraction = 0.9 (allowed: 0.05 to 0.75)"), g = good;
  g.stress_tolerance = 0.0, refused(&scene, &g, wrong, "stress_tolerance = 0"), g = good;
  g.unbalanced_tolerance = 2.0, refused(&scene, &g, wrong, "unbalanced_tolerance = 2"), g = good;
  g.max_steps = 0, refused(&scene, &g, wrong, "max_steps = 0"), g = good;
  g.max_steps = 100, refused(&scene, &g, BASE_ERROR_UNSTABLE, "no equilibrium within max_steps = 100: stress"),
  g = good;
  scene.density = NAN, refused(&scene, &g, wrong, "density is missing");
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(preparation_friction_sets_the_void_ratio_at_100_kpa),
      cmocka_unit_test(less_pressure_leaves_a_looser_packing),
      cmocka_unit_test(packing_is_in_isotropic_equilibrium),
      cmocka_unit_test(spheres_are_packed_in_three_dimensions),
      cmocka_unit_test(same_seed_gives_the_same_packing),
      cmocka_unit_test(frictionless_grains_need_no_friction),
      cmocka_unit_test(wrong_requests_are_refused),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
