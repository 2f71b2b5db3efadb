/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Mixed precision against FP64: the same state, the same laws, forces to single precision. Without AVX-512 both are FP64. */
#include "rve_help.h"

#include "cuda_rve/rve_packing.h"

static const double ROUND_OFF = 2e-5; /* of a stress after one step */

static double stress_distance(const RveAnswer *a, const RveAnswer *b) {
  double worst = 0.0, size = 0.0;
  for (int k = 0; k < 6; k++) worst = fmax(worst, fabs(a->stress[k] - b->stress[k])), size = fmax(size, fabs(b->stress[k]));
  return worst / size;
}

static RveScene rough_scene(int dimension) {
  RveScene scene = help_scene(dimension);
  scene.tangential_stiffness = 1e6;
  scene.local_damping = 0.2;
  return scene;
}

/* Crystals deform affinely: stress and conductivity are closed forms, met to single precision. */
static void crystals_keep_their_stress(void **state) {
  (void)state;
  const RveLattice lattice[] = {RVE_SQUARE, RVE_HEXAGONAL, RVE_SIMPLE_CUBIC, RVE_BCC, RVE_FCC};
  uint64_t seed = 7;
  double stress = 0.0, conductivity = 0.0;
  for (int l = 0; l < 5; l++)
    for (int sample = 0; sample < 10; sample++) {
      RvePacking packing;
      RveAnswer answer[2];
      double gradient[9] = {0.0};
      MUST(rve_packing_lattice(lattice[l], 0.01, 0.02, &packing));
      const int dim = packing.dimension;
      for (int i = 0; i < dim; i++)
        for (int j = 0; j < dim; j++) gradient[3 * i + j] = help_uniform(&seed, -1.0, 1.0);
      for (int mixed = 0; mixed < 2; mixed++) {
        RveScene scene = help_scene(dim);
        help_heat(&scene);
        scene.mixed = mixed;
        RveBatch *batch = help_batch(&scene, &packing);
        answer[mixed] = help_step(batch, gradient, 10.0, 1e-3);
        rve_batch_destroy(batch);
      }
      stress = fmax(stress, stress_distance(&answer[1], &answer[0]));
      for (int k = 0; k < 6; k++)
        conductivity = fmax(conductivity, fabs(answer[1].conductivity[k] - answer[0].conductivity[k]) / answer[0].conductivity[0]);
      rve_packing_destroy(&packing);
    }
  printf("mixed, crystals: stress %.1e, conductivity %.1e\n", stress, conductivity);
  assert_true(stress < 2e-5); /* 6e-8 of a branch over an overlap of 2 % and less */
  assert_true(conductivity < 1e-6);
}

static RveAnswer sheared(const RveScene *scene, const RvePacking *packing, double duration) {
  const double gradient[9] = {-0.5, 0.2, 0.0, 0.0, 0.5, 0.0, 0.0, 0.0, 0.0};
  RveBatch *batch = help_batch(scene, packing);
  if (scene->bonds) MUST(rve_batch_install_bonds(batch, 0, NULL));
  const RveAnswer answer = help_step(batch, gradient, 0.0, duration);
  rve_batch_destroy(batch);
  return answer;
}

/* Every variant of the kernel. One step shows the noise of the forces: 6e-8 of a branch over an overlap of 1e-3 of it. After
 * 1e-3 s rearrangements have amplified it. */
static void packings_follow_fp64(void **state) {
  (void)state;
  const char *const variant[] = {"smooth", "rough", "viscous", "bonded"};
  for (int dim = 2; dim <= 3; dim++) {
    RvePacking packing = help_random(dim, dim == 2 ? 10 : 5, 1e5, 3);
    for (int v = 0; v < 4; v++) {
      RveAnswer first[2], answer[2];
      for (int mixed = 0; mixed < 2; mixed++) {
        RveScene scene = rough_scene(dim);
        scene.mixed = mixed;
        if (v == 0) scene.tangential_stiffness = 0.0;
        if (v >= 2) scene.normal_viscosity = scene.tangential_viscosity = 500.0;
        if (v == 3) scene.bonds = 1, scene.bond_strength = 0.1; /* none breaks: that would be an event */
        first[mixed] = sheared(&scene, &packing, 1e-6);
        answer[mixed] = sheared(&scene, &packing, 1e-3);
      }
      const double once = stress_distance(&first[1], &first[0]), stress = stress_distance(&answer[1], &answer[0]);
      const double slip = fabs(answer[1].friction_work - answer[0].friction_work) / fmax(answer[0].friction_work, 1e-300);
      const double loss = fabs(answer[1].damping_work - answer[0].damping_work) / answer[0].damping_work;
      printf("mixed, %dD %s: stress %.1e after one step; after 1e-3 s %.1e, friction %.1e, damping %.1e\n", dim, variant[v],
             once, stress, slip, loss);
      assert_true(once < ROUND_OFF);
      assert_true(stress < 5e-4);
      assert_true(loss < 5e-3);
      if (v == 1 || v == 2) assert_true(slip < 5e-3);
    }
    rve_packing_destroy(&packing);
  }
}

/* The ledger of a long frictional run: work of the boundary against stored, rubbed and damped energy. */
static void energy_is_conserved(void **state) {
  (void)state;
  const double rate = 0.5, gradient[9] = {-rate, 0.0, 0.0, 0.0, rate, 0.0, 0.0, 0.0, 0.0};
  RvePacking packing = help_random(2, 10, 1e5, 5);
  RveScene scene = rough_scene(2);
  scene.mixed = 1;
  RveBatch *batch = help_batch(&scene, &packing);
  RveAnswer before = help_step(batch, NULL, 0.0, 0.0), now = before;
  const double start = before.kinetic_energy + before.elastic_energy;
  double work = 0.0;
  for (int k = 0; k < 2000; k++) {
    now = help_step(batch, gradient, 0.0, 1e-5);
    for (int m = 0; m < 2; m++)
      work += 0.5 * (before.stress[m] * before.volume + now.stress[m] * now.volume) * gradient[4 * m] * 1e-5;
    before = now;
  }
  const double held = now.kinetic_energy + now.elastic_energy - start + now.friction_work + now.damping_work;
  printf("mixed, ledger of 2 %% shear: %.1e of the work\n", fabs(held / work - 1.0));
  assert_true(now.friction_work > 0.1 * work);
  assert_true(fabs(held / work - 1.0) < 1e-3);
  rve_batch_destroy(batch);
  rve_packing_destroy(&packing);
}

/* Repeats and restarts are bit-equal; a state of one precision continues in the other. */
static void states_are_exact(void **state) {
  (void)state;
  const double gradient[9] = {-0.5, 0.0, 0.0, 0.0, 0.5, 0.0, 0.0, 0.0, 0.0};
  for (int dim = 2; dim <= 3; dim++) {
    RvePacking packing = help_random(dim, dim == 2 ? 8 : 4, 1e5, 9);
    RveScene scene = rough_scene(dim);
    RveAnswer end[3];
    scene.mixed = 1;
    RveBatch *batch = help_batch(&scene, &packing);
    help_step(batch, gradient, 0.0, 2e-3);
    const size_t room = rve_batch_state_bytes(batch, 0);
    size_t written;
    unsigned char *bytes;
    MUST(BASE_ALLOC(room, &bytes));
    MUST(rve_batch_pack(batch, 0, bytes, &written));
    end[0] = help_step(batch, gradient, 0.0, 2e-3);
    rve_batch_destroy(batch);
    for (int other = 0; other < 2; other++) {
      scene.mixed = !other;
      batch = help_batch(&scene, &packing);
      MUST(rve_batch_unpack(batch, 0, bytes, written));
      end[1 + other] = help_step(batch, gradient, 0.0, 2e-3);
      rve_batch_destroy(batch);
    }
    assert_memory_equal(&end[0], &end[1], sizeof end[0]);
    printf("mixed, %dD, goes on in FP64: stress %.1e\n", dim, stress_distance(&end[2], &end[0]));
    assert_true(stress_distance(&end[2], &end[0]) < 1e-3);
    base_free(bytes);
    rve_packing_destroy(&packing);
  }
}

/* The view's forces, written by the host, balance the stress that the kernel measured. */
static void views_show_the_same_forces(void **state) {
  (void)state;
  for (int dim = 2; dim <= 3; dim++) {
    RvePacking packing = help_random(dim, dim == 2 ? 8 : 4, 1e5, 2);
    RveScene scene = rough_scene(dim);
    RveView view;
    scene.mixed = 1;
    scene.thickness = 1.0;
    RveBatch *batch = help_batch(&scene, &packing);
    const RveAnswer answer = help_step(batch, NULL, 0.0, 1e-4);
    double pressure = 0.0, kinetic = 2.0 * answer.kinetic_energy;
    MUST(rve_batch_view(batch, 0, &view));
    for (int c = 0; c < view.contacts; c++) {
      double length = 0.0;
      for (int k = 0; k < 3; k++) length += view.branch[3 * c + k] * view.branch[3 * c + k];
      pressure += view.force_normal[c] * sqrt(length) / answer.volume;
    }
    double trace = 0.0;
    for (int k = 0; k < dim; k++) trace -= answer.stress[k];
    assert_true(fabs(trace - pressure) < 1e-5 * pressure + kinetic / answer.volume);
    rve_view_destroy(&view);
    rve_batch_destroy(batch);
    rve_packing_destroy(&packing);
  }
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(crystals_keep_their_stress), cmocka_unit_test(packings_follow_fp64),
      cmocka_unit_test(energy_is_conserved),        cmocka_unit_test(states_are_exact),
      cmocka_unit_test(views_show_the_same_forces),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
