/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The conductivity of a packing by its network: closed forms, dense solutions, bounds; when it is worked out anew. */
#include "cuda_rve/rve_network.h"
#include "cuda_rve/rve_packing.h"
#include "rve_help.h"

enum { MOST_GRAINS = 256 };

static void add(RveNetwork *network, int i, int j, double x, double y, double z, double conductance) {
  const RveLink link = {{i, j}, {x, y, z}, conductance};
  MUST(rve_network_add(network, &link));
}

/* Least n.(a - b).n over the trace of a, in 200 directions: > 0 if b is below a. */
static double least_margin(int dimension, const double a[6], const double b[6]) {
  double least = 1.0, x[9], y[9];
  uint64_t seed = 3;
  help_full(a, x), help_full(b, y);
  const double trace = x[0] + x[4] + (dimension == 3 ? x[8] : 0.0);
  for (int trial = 0; trial < 200; trial++) {
    double n[3] = {0.0, 0.0, 0.0}, square = 0.0, margin = 0.0;
    for (int k = 0; k < dimension; k++) n[k] = help_uniform(&seed, -1.0, 1.0), square += n[k] * n[k];
    for (int i = 0; i < dimension; i++)
      for (int j = 0; j < dimension; j++) margin += n[i] * n[j] * (x[3 * i + j] - y[3 * i + j]) / square;
    least = fmin(least, margin / trace);
  }
  return least;
}

/* The same by Gauss' elimination with pivots, grain 0 of the (connected) network held. */
static void solve_dense(const RveNetwork *network, int grains, int dimension, double volume, double k[6]) {
  static double a[MOST_GRAINS][MOST_GRAINS + 3];
  static const int row[6] = {0, 1, 2, 0, 0, 1}, column[6] = {0, 1, 2, 1, 2, 2};
  assert_true(grains <= MOST_GRAINS);
  memset(a, 0, sizeof a);
  for (int l = 0; l < network->links; l++) {
    const RveLink *link = &network->link[l];
    const int i = link->pair[0], j = link->pair[1];
    if (i == j) continue;
    a[i][i] += link->conductance, a[j][j] += link->conductance;
    a[i][j] -= link->conductance, a[j][i] -= link->conductance;
    for (int d = 0; d < dimension; d++) {
      a[i][grains + d] += link->conductance * link->branch[d];
      a[j][grains + d] -= link->conductance * link->branch[d];
    }
  }
  for (int m = 0; m < grains + 3; m++) a[0][m] = m == 0;
  for (int p = 0; p < grains; p++) {
    int best = p;
    for (int i = p; i < grains; i++) best = fabs(a[i][p]) > fabs(a[best][p]) ? i : best;
    for (int m = 0; m < grains + 3; m++) {
      const double swap = a[p][m];
      a[p][m] = a[best][m], a[best][m] = swap;
    }
    for (int i = 0; i < grains; i++) {
      const double factor = a[i][p] / a[p][p];
      for (int m = p; i != p && m < grains + 3; m++) a[i][m] -= factor * a[p][m];
    }
  }
  double sum[6] = {0.0};
  for (int l = 0; l < network->links; l++) {
    const RveLink *link = &network->link[l];
    const int i = link->pair[0], j = link->pair[1];
    double d[3] = {0.0};
    for (int m = 0; m < dimension; m++)
      d[m] = link->branch[m] + a[j][grains + m] / a[j][j] - a[i][grains + m] / a[i][i];
    for (int m = 0; m < 6; m++) sum[m] += link->conductance * d[row[m]] * link->branch[column[m]];
  }
  for (int m = 0; m < 6; m++) k[m] = sum[m] / volume;
}

/* ------------------------------------------------------------------------------------------------ networks by hand */

static void a_chain_conducts_as_resistors_in_series(void **state) {
  (void)state;
  const double h[4] = {1.0, 3.0, 0.02, 70.0}, step[4] = {0.1, 0.3, 0.2, 0.15}, volume = 0.4;
  double length = 0.0, resistance = 0.0, k[6], affine[6];
  RveNetwork network = {0};
  for (int c = 0; c < 4; c++) {
    add(&network, c, (c + 1) % 4, step[c], 0.0, 0.0, h[c]);
    length += step[c], resistance += 1.0 / h[c];
  }
  MUST(rve_network_solve(&network, 4, 2, volume, k));
  rve_network_affine(&network, 2, volume, affine);
  assert_true(fabs(k[0] / (length * length / resistance / volume) - 1.0) < 1e-13);
  for (int m = 1; m < 6; m++) assert_true(k[m] == 0.0);
  assert_true(affine[0] > 10.0 * k[0]);
  rve_network_destroy(&network);
}

/* Two chains that do not touch, a grain without links, a grain linked to its own image. */
static void clusters_and_loose_grains_conduct_side_by_side(void **state) {
  (void)state;
  double k[6];
  RveNetwork network = {0};
  add(&network, 0, 1, 0.1, 0.0, 0.0, 2.0), add(&network, 1, 0, 0.3, 0.0, 0.0, 5.0);
  add(&network, 2, 3, 0.0, 0.2, 0.0, 1.0), add(&network, 3, 2, 0.0, 0.2, 0.0, 9.0);
  add(&network, 5, 5, 0.0, 0.0, 0.7, 4.0);
  MUST(rve_network_solve(&network, 6, 3, 1.0, k));
  const double expected[6] = {0.16 / (1.0 / 2.0 + 1.0 / 5.0), 0.16 / (1.0 + 1.0 / 9.0), 0.49 * 4.0, 0.0, 0.0, 0.0};
  assert_true(help_difference(6, k, expected) < 1e-14);
  network.links = 0;
  MUST(rve_network_solve(&network, 6, 3, 1.0, k));
  for (int m = 0; m < 6; m++) assert_true(k[m] == 0.0);
  rve_network_destroy(&network);
}

/* A ring through all grains makes it connected; conductances over `decades`. */
static double random_network_error(uint64_t *seed, int grains, int links, double decades, double *margin) {
  RveNetwork network = {0};
  double k[6], affine[6], expected[6];
  for (int c = 0; c < links; c++) {
    const int i = c < grains ? c : (int)(base_random(seed) * grains), j = (int)(base_random(seed) * grains);
    add(&network, i, c < grains ? (c + 1) % grains : j, help_uniform(seed, -1.0, 1.0), help_uniform(seed, -1.0, 1.0),
        help_uniform(seed, -1.0, 1.0), pow(10.0, help_uniform(seed, -decades, 0.0)));
  }
  MUST(rve_network_solve(&network, grains, 3, 2.0, k));
  rve_network_affine(&network, 3, 2.0, affine);
  solve_dense(&network, grains, 3, 2.0, expected);
  *margin = fmin(*margin, least_margin(3, affine, k));
  rve_network_destroy(&network);
  return help_difference(6, k, expected);
}

static void random_networks_meet_the_dense_solution(void **state) {
  (void)state;
  double even = 0.0, uneven = 0.0, margin = 1.0;
  uint64_t seed = 11;
  for (int trial = 0; trial < 40; trial++) {
    even = fmax(even, random_network_error(&seed, 30, 90, 1.0, &margin));
    uneven = fmax(uneven, random_network_error(&seed, 30, 90, 9.0, &margin));
  }
  help_report("network against dense solution, conductances over 1 decade", even);
  help_report("the same over 9 decades", uneven);
  assert_true(even < 1e-12);
  assert_true(uneven < 1e-12);
  assert_true(margin > 0.0);
}

/* ------------------------------------------------------------------------------------------------- models, packings */

enum { MODELS = 10 };
static RveScene model_scene(int dimension, int model) {
  RveScene scene = help_scene(dimension);
  help_heat(&scene);
  scene.network = 1;
  scene.network_change = 0.0;
  if (model == 0) return scene;
  scene.pipe_resistance = NAN;
  scene.grain_conductivity = 1.4;
  scene.conduction.fluid = 0.026;
  if (model < 4) scene.conduction.direct = (GrainDirect)model; /* batchelor, liggghts, pipe */
  else if (model < 7) scene.conduction.indirect = (GrainIndirect)(model - 3);
  else scene.conduction.direct = GRAIN_DIRECT_BATCHELOR, scene.conduction.indirect = (GrainIndirect)(model - 6);
  if (model % 2) scene.conduction.area = GRAIN_AREA_HERTZ;
  return scene;
}

/* All neighbours of a lattice up to three cells away: the affine sum, which is that of the network. */
static void lattice_sum(const RvePacking *cell, const RveScene *scene, double k[6]) {
  const int deep = scene->dimension == 3 ? 3 : 0;
  const double volume = tensor_determinant(cell->cell) * (scene->dimension == 2 ? scene->thickness : 1.0),
               r = cell->radius[0];
  double sum[9] = {0.0};
  for (int x = -3; x <= 3; x++)
    for (int y = -3; y <= 3; y++)
      for (int z = -deep; z <= deep; z++) {
        double b[3], h;
        if (x == 0 && y == 0 && z == 0) continue;
        for (int i = 0; i < 3; i++)
          b[i] = cell->cell[3 * i] * x + cell->cell[3 * i + 1] * y + cell->cell[3 * i + 2] * z;
        const double length = sqrt(b[0] * b[0] + b[1] * b[1] + b[2] * b[2]);
        const GrainPair pair = {{r, r}, {scene->grain_conductivity, scene->grain_conductivity}, length};
        if (isnan(scene->pipe_resistance)) h = grain_heat_conductance(&scene->conduction, &pair);
        else h = length < 2.0 * r ? 1.0 / (scene->pipe_resistance * length) : 0.0;
        for (int m = 0; m < 9; m++) sum[m] += 0.5 * h * b[m / 3] * b[m % 3] / volume;
      }
  help_symmetric(sum, k);
}

static void networks_of_crystals_are_affine_with_any_model(void **state) {
  (void)state;
  double error = 0.0, apart = 0.0;
  for (int lattice = 0; lattice < 5; lattice++)
    for (int model = 0; model < MODELS; model++)
      for (int copies = 1; copies <= 5; copies += 2) {
        RvePacking cell, packing;
        MUST(rve_packing_lattice((RveLattice)lattice, 5e-3, 0.01, &cell));
        const int many[3] = {copies, copies, cell.dimension == 3 ? copies : 1};
        MUST(rve_packing_replicate(&cell, many, &packing));
        const RveScene scene = model_scene(cell.dimension, model);
        RveBatch *batch = help_batch(&scene, &packing);
        const RveAnswer answer = help_step(batch, NULL, 0.0, 0.0);
        double expected[6];
        lattice_sum(&cell, &scene, expected);
        error = fmax(error, help_difference(6, answer.conductivity, expected));
        apart = fmax(apart, help_difference(6, answer.conductivity, answer.conductivity_affine));
        rve_batch_destroy(batch);
        rve_packing_destroy(&packing);
        rve_packing_destroy(&cell);
      }
  help_report("crystals, ten models: network against lattice sum", error);
  help_report("crystals, ten models: network against affine sum", apart);
  assert_true(error < 1e-12);
  assert_true(apart < 1e-13);
}

/* Grains that have grown: contacts and gaps are those of the radii at the temperature, with any model. */
static void crystals_of_warm_grains(void **state) {
  (void)state;
  double error = 0.0, change = 0.0;
  for (int model = 0; model < MODELS; model++) {
    RvePacking cell;
    MUST(rve_packing_lattice(RVE_HEXAGONAL, 5e-3, 0.01, &cell));
    RveScene scene = model_scene(cell.dimension, model);
    scene.expansion = 1e-5;
    RveBatch *batch = help_batch(&scene, &cell);
    double cold[6], expected[6];
    lattice_sum(&cell, &scene, cold);
    const RveAnswer answer = help_step(batch, NULL, scene.reference_temperature + 40.0, 1e-3);
    cell.radius[0] *= 1.0 + 40.0 * scene.expansion;
    lattice_sum(&cell, &scene, expected);
    error = fmax(error, help_difference(6, answer.conductivity, expected));
    if (model > 0) change = fmax(change, help_difference(6, cold, expected));
    rve_batch_destroy(batch);
    rve_packing_destroy(&cell);
  }
  help_report("crystals of warm grains: network against lattice sum", error);
  assert_true(error < 1e-9 && change > 1e-3);
}

/* Contacts from the view, by the dense solver. */
static void packings_meet_the_dense_solution_below_the_affine_sum(void **state) {
  (void)state;
  for (int dimension = 2; dimension <= 3; dimension++) {
    RvePacking packing = help_random(dimension, dimension == 2 ? 12 : 5, 2e4, 5);
    for (int model = 0; model < MODELS; model++) {
      RveScene scene = model_scene(dimension, model);
      RveBatch *batch = help_batch(&scene, &packing);
      const RveAnswer answer = help_step(batch, NULL, 0.0, 0.0);
      const double ratio = answer.conductivity[0] / answer.conductivity_affine[0];
      assert_true(least_margin(dimension, answer.conductivity_affine, answer.conductivity) > 0.0);
      printf("           %dD, model %d: network over affine %.3f\n", dimension, model, ratio);
      assert_true(ratio > 0.5 && ratio < 1.0);
      if (model < 4) {
        RveView view;
        RveNetwork network = {0};
        double expected[6];
        int from = 0;
        MUST(rve_batch_view(batch, 0, &view));
        for (int pass = 0; pass < 2; pass++) /* a grain that conducts comes to be the one that is held: no rattler is */
          for (int c = 0; c < view.contacts; c++) {
            const double *b = view.branch + 3 * c, length = sqrt(b[0] * b[0] + b[1] * b[1] + b[2] * b[2]);
            const int i = view.pair[2 * c], j = view.pair[2 * c + 1];
            const GrainPair pair = {{view.radius[i], view.radius[j]}, {1.4, 1.4}, length};
            const double h = model == 0 ? 1.0 / (1000.0 * length) : grain_heat_conductance(&scene.conduction, &pair);
            if (pass == 0) from = c == 0 ? i : from;
            else
              add(&network, i == from ? 0 : i == 0 ? from : i, j == from ? 0 : j == 0 ? from : j, b[0], b[1], b[2], h);
          }
        for (int i = 1; i < view.grains; i++) add(&network, 0, i, 0.0, 0.0, 0.0, 1e-30); /* holds rattlers */
        solve_dense(&network, view.grains, dimension, answer.volume, expected);
        const double error = help_difference(6, answer.conductivity, expected);
        help_report(dimension == 2 ? "2D packing against dense solution" : "3D packing against dense solution", error);
        assert_true(error < 1e-12);
        rve_network_destroy(&network);
        rve_view_destroy(&view);
      }
      rve_batch_destroy(batch);
    }
    rve_packing_destroy(&packing);
  }
}

/* ------------------------------------------------------------------------------------------------ when it is solved */

static const double shear[9] = {-0.5, 0.3, 0.0, 0.0, 0.5, 0.0, 0.0, 0.0, 0.0};
enum { CALLS = 60 }; /* of 1e-3 s: 0.03 of strain in all */

static void kept_networks_stay_near_solved_ones(void **state) {
  (void)state;
  RvePacking packing = help_random(2, 10, 2e4, 7);
  for (int model = 0; model < 2; model++) {
    double largest = 0.0;
    int64_t solved, kept, all, none;
    RveScene scene = model_scene(2, model);
    scene.local_damping = 0.5, scene.tangential_stiffness = scene.normal_stiffness;
    RveBatch *each = help_batch(&scene, &packing);
    scene.network_change = 0.01;
    RveBatch *some = help_batch(&scene, &packing);
    for (int call = 0; call < CALLS; call++) {
      const RveAnswer exact = help_step(each, shear, 0.0, 1e-3), near = help_step(some, shear, 0.0, 1e-3);
      largest = fmax(largest, help_difference(6, near.conductivity, exact.conductivity));
      assert_true(least_margin(2, near.conductivity_affine, near.conductivity) > 0.0);
      assert_memory_equal(near.conductivity_affine, exact.conductivity_affine, sizeof exact.conductivity_affine);
    }
    rve_batch_network_counts(each, &all, &none);
    rve_batch_network_counts(some, &solved, &kept);
    assert_int_equal(all, CALLS + 1);
    assert_int_equal(none, 0);
    assert_int_equal(solved + kept, CALLS + 1);
    printf("           %s: %d of %d networks solved\n", model ? "batchelor" : "pipes", (int)solved, CALLS + 1);
    help_report("largest deviation of those kept", largest);
    assert_true(solved >= 4 && kept >= 10);
    assert_true(largest <
                0.05); /* a contact more or less is 0.5 % of 100 grains' conductivity; see doc/fix_mpm_rve.md */
    rve_batch_destroy(each);
    rve_batch_destroy(some);
  }
  rve_packing_destroy(&packing);
}

/* |a - b| over |b|, of all nine components. */
static double tensor_change(const double a[6], const double b[6]) {
  double x[9], y[9], apart = 0.0, size = 0.0;
  help_full(a, x), help_full(b, y);
  for (int m = 0; m < 9; m++) apart += (x[m] - y[m]) * (x[m] - y[m]), size += y[m] * y[m];
  return sqrt(apart / size);
}

/* When the affine tensor has changed by `change` since the last solution, or the strain path is that long: a crystal of three
 * contact directions whose tensor shears with the grains, and one that turns as a whole. */
static void networks_are_solved_when_they_should_be(void **state) {
  (void)state;
  const double turn[9] = {0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0}, across[9] = {0.0, 0.1, 0.0, 0.1};
  for (int way = 0; way < 2; way++) {
    RvePacking cell;
    MUST(rve_packing_lattice(RVE_HEXAGONAL, 5e-3, 0.01, &cell));
    RveScene scene = model_scene(2, 1);
    scene.network_change = 0.01;
    RveBatch *batch = help_batch(&scene, &cell);
    double solved_affine[6], path = 0.0, largest = 0.0;
    const RveAnswer first = help_step(batch, NULL, 0.0, 0.0);
    memcpy(solved_affine, first.conductivity_affine, sizeof solved_affine);
    int64_t solved, kept, before, times = 0;
    rve_batch_network_counts(batch, &before, &kept);
    for (int call = 0; call < 40; call++) {
      const RveAnswer answer = help_step(batch, way ? across : turn, 0.0, 1e-3);
      path += (way ? 0.1 : 1.0) * sqrt(2.0) * 1e-3;
      const double change = tensor_change(answer.conductivity_affine, solved_affine);
      rve_batch_network_counts(batch, &solved, &kept);
      assert_int_equal(solved - before, change > 0.01 || path > 0.01);
      largest = fmax(largest, change);
      if (solved > before) times++, path = 0.0, memcpy(solved_affine, answer.conductivity_affine, sizeof solved_affine);
      before = solved;
    }
    printf("           %s: solved %d times in 40 calls\n", way ? "sheared" : "turned", (int)times);
    assert_true(way ? largest > 0.01 && times > 5 : largest < 0.01 && times == 5);
    rve_batch_destroy(batch);
    rve_packing_destroy(&cell);
  }
}

static void asking_again_changes_nothing_and_states_carry_all(void **state) {
  (void)state;
  RvePacking packing = help_random(2, 8, 2e4, 9);
  for (int every = 1; every <= 3; every += 2) {
    RveScene scene = model_scene(2, 1);
    scene.network_change = 0.01;
    scene.conductivity_every = every;
    RveBatch *through = help_batch(&scene, &packing), *again = help_batch(&scene, &packing);
    RveAnswer answer, before;
    memset(&before, 0, sizeof before);
    int stood = 0;
    for (int call = 0; call < 20; call++) {
      answer = help_step(through, shear, 0.0, 1e-3);
      stood += memcmp(before.conductivity, answer.conductivity, sizeof before.conductivity) == 0;
      before = answer;
      answer = help_step(through, NULL, 0.0, 0.0);
      assert_memory_equal(before.conductivity, answer.conductivity, sizeof before.conductivity);
      if (call == 10) {
        void *bytes;
        size_t size;
        MUST(base_alloc(rve_batch_state_bytes(through, 0), 1, &bytes));
        MUST(rve_batch_pack(through, 0, bytes, &size));
        MUST(rve_batch_unpack(again, 0, bytes, size));
        base_free(bytes);
      }
      if (call > 10) {
        answer = help_step(again, shear, 0.0, 1e-3);
        assert_memory_equal(before.conductivity, answer.conductivity, sizeof before.conductivity);
        assert_memory_equal(before.conductivity_affine, answer.conductivity_affine, sizeof before.conductivity);
      }
    }
    assert_int_equal(stood, every == 1 ? 0 : 13); /* worked out at creation and in calls 2, 5, ... 17 */
    rve_batch_destroy(through);
    rve_batch_destroy(again);
  }
  rve_packing_destroy(&packing);
}

static void other_parameters_are_answered_at_once(void **state) {
  (void)state;
  RvePacking packing = help_random(2, 8, 2e4, 9);
  RveScene scene = model_scene(2, 1);
  scene.conductivity_every = 1000;
  RveBatch *batch = help_batch(&scene, &packing);
  const RveAnswer one = help_step(batch, NULL, 0.0, 0.0);
  scene.grain_conductivity *= 2.0;
  MUST(rve_batch_set_scene(batch, &scene));
  const RveAnswer two = help_step(batch, NULL, 0.0, 0.0);
  for (int k = 0; k < 2; k++) assert_true(fabs(two.conductivity[k] / one.conductivity[k] - 2.0) < 1e-12);
  rve_batch_destroy(batch);
  rve_packing_destroy(&packing);
}

static void refused(const RveScene *scene, const char *words) {
  assert_int_equal(rve_scene_check(scene), BASE_ERROR_ARGUMENT);
  if (!strstr(base_error_message(), words)) fail_msg("'%s' lacks '%s'", base_error_message(), words);
}

static void wrong_scenes_are_refused(void **state) {
  (void)state;
  RveScene scene = model_scene(2, 1);
  MUST(rve_scene_check(&scene));
  scene.grain_conductivity = NAN;
  refused(&scene, "grain_conductivity is missing");
  scene = model_scene(2, 1);
  scene.pipe_resistance = 16.0;
  refused(&scene, "exclude each other");
  scene = model_scene(2, 1);
  scene.conduction.direct = GRAIN_DIRECT_COLLISIONAL;
  refused(&scene, "collisional");
  scene = model_scene(2, 5);
  scene.conduction.porosity = 1.5;
  refused(&scene, "the porosity is 1.5");
  scene = model_scene(2, 0);
  scene.network = 2;
  refused(&scene, "network = 2");
  scene = model_scene(2, 0);
  scene.network_change = -1.0;
  refused(&scene, "network_change = -1");
  scene = model_scene(2, 0);
  scene.conductivity_every = 0;
  refused(&scene, "conductivity_every = 0");
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(a_chain_conducts_as_resistors_in_series),
      cmocka_unit_test(clusters_and_loose_grains_conduct_side_by_side),
      cmocka_unit_test(random_networks_meet_the_dense_solution),
      cmocka_unit_test(networks_of_crystals_are_affine_with_any_model),
      cmocka_unit_test(packings_meet_the_dense_solution_below_the_affine_sum),
      cmocka_unit_test(crystals_of_warm_grains),
      cmocka_unit_test(networks_are_solved_when_they_should_be),
      cmocka_unit_test(kept_networks_stay_near_solved_ones),
      cmocka_unit_test(asking_again_changes_nothing_and_states_carry_all),
      cmocka_unit_test(other_parameters_are_answered_at_once),
      cmocka_unit_test(wrong_scenes_are_refused),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
