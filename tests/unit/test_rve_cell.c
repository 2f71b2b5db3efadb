/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Verification A2-A5: periodic images, large shear, rotation. */
#include "rve_help.h"

/* ------------------------------------------------------------------------------------------- A2: no image is missed */

#if defined(__SANITIZE_ADDRESS__)
enum { CELLS = 20000, STAGES = 1, CALLS = 30 }; /* sanitizers cost a factor of ten */
#else
enum { CELLS = 1000000, STAGES = 8, CALLS = 300 };
#endif
enum { CELLS_PER_BATCH = 2000, GRAINS_MAX = 3, BRANCHES_MAX = 64 };

typedef struct ImageCase {
  RvePacking packing;
  int branches;
  double branch[BRANCHES_MAX][3];
  int owner[BRANCHES_MAX]; /* i * GRAINS_MAX + j with i <= j */
} ImageCase;

static void random_cell(int dim, uint64_t *seed, double cell[9]) {
  tensor_identity(cell);
  for (int k = 0; k < dim; k++) cell[4 * k] = help_uniform(seed, 0.7, 1.4);
  for (int i = 0; i < dim; i++)
    for (int j = 0; j < dim; j++)
      if (i != j) cell[3 * i + j] = (i < j ? 1.6 : 0.2) * help_uniform(seed, -1.0, 1.0);
}

/* Length of the branch (i, j, P); 2D cells have an identity third direction. */
static double branch_of(const RvePacking *packing, int i, int j, const int p[3], double d[3]) {
  double x[3];
  for (int k = 0; k < 3; k++) x[k] = packing->position[3 * j + k] - packing->position[3 * i + k] + p[k];
  for (int k = 0; k < 3; k++)
    d[k] = packing->cell[3 * k] * x[0] + packing->cell[3 * k + 1] * x[1] + packing->cell[3 * k + 2] * x[2];
  return sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
}

static int is_half(const int p[3]) { /* one of each +-P, without 0 */
  for (int k = 0; k < 3; k++)
    if (p[k] != 0) return p[k] > 0;
  return 0;
}

/* Branches shorter than `limit` among `range` images in each direction, or just the shortest length (found NULL). */
static double brute_force(const RvePacking *packing, int range, double limit, ImageCase *found) {
  const int dim = packing->dimension;
  double shortest = INFINITY;
  for (int i = 0; i < packing->grains; i++)
    for (int j = i; j < packing->grains; j++)
      for (int x = -range; x <= range; x++)
        for (int y = -range; y <= range; y++)
          for (int z = dim == 3 ? -range : 0; z <= (dim == 3 ? range : 0); z++) {
            const int p[3] = {x, y, z};
            double d[3];
            if (i == j && !is_half(p)) continue;
            const double length = branch_of(packing, i, j, p, d);
            shortest = fmin(shortest, length);
            if (!found || length >= limit) continue;
            found->owner[found->branches] = i * GRAINS_MAX + j;
            memcpy(found->branch[found->branches++], d, sizeof d);
          }
  return shortest;
}

static void make_case(uint64_t *seed, ImageCase *c) {
  const int dim = base_random(seed) < 0.8 ? 2 : 3, grains = 1 + (int)(base_random(seed) * (dim == 2 ? GRAINS_MAX : 2));
  const int range = dim == 2 ? 5 : 3;
  c->packing = help_packing(dim, grains);
  random_cell(dim, seed, c->packing.cell);
  if (dim == 3) /* keep brute force short: mild skew, still up to neighbours of neighbours */
    for (int k = 0; k < 9; k++)
      if (k % 4) c->packing.cell[k] *= 0.6;
  for (int i = 0; i < grains; i++)
    for (int k = 0; k < dim; k++) c->packing.position[3 * i + k] = help_uniform(seed, -0.5, 0.5);
  /* Equal radii such that the closest pair overlaps by up to 26 % of the radius. */
  const double shortest = brute_force(&c->packing, range, 0.0, NULL);
  const double r = 0.5 * shortest * help_uniform(seed, 1.0001, 1.15);
  for (int i = 0; i < grains; i++) c->packing.radius[i] = r;
  c->branches = 0;
  brute_force(&c->packing, range, 2.0 * r * (1.0 - 1e-12), c);
}

static int same_branch(const double a[3], const double b[3], double sign) {
  double square = 0.0;
  for (int k = 0; k < 3; k++) square += (a[k] - sign * b[k]) * (a[k] - sign * b[k]);
  return square < 1e-20;
}

/* Number of brute-force branches that the view lacks, plus those that it has too many. */
static int count_misses(const ImageCase *c, const RveView *view) {
  int misses = abs(view->contacts - c->branches);
  for (int b = 0; b < c->branches; b++) {
    int found = 0;
    for (int v = 0; v < view->contacts; v++) {
      const int i = view->pair[2 * v], j = view->pair[2 * v + 1], sign = i <= j ? 1 : -1;
      const int owner = i <= j ? i * GRAINS_MAX + j : j * GRAINS_MAX + i;
      if (owner != c->owner[b]) continue;
      found |= same_branch(view->branch + 3 * v, c->branch[b], sign) ||
               (i == j && same_branch(view->branch + 3 * v, c->branch[b], -1.0));
    }
    misses += !found;
  }
  return misses;
}

static void no_periodic_image_is_missed(void **state) {
  (void)state;
  static ImageCase cases[CELLS_PER_BATCH];
  static RvePacking packings[2][CELLS_PER_BATCH];
  static int which[2][CELLS_PER_BATCH];
  uint64_t seed = 11;
  long misses = 0, contacts = 0, images = 0;
  for (int done = 0; done < CELLS; done += CELLS_PER_BATCH) {
    int n[2] = {0, 0};
    for (int k = 0; k < CELLS_PER_BATCH; k++) {
      make_case(&seed, &cases[k]);
      const int d = cases[k].packing.dimension - 2;
      packings[d][n[d]] = cases[k].packing;
      which[d][n[d]++] = k;
    }
    for (int d = 0; d < 2; d++) {
      const RveScene scene = help_scene(d + 2);
      RveBatch *batch;
      int *identity = malloc((size_t)n[d] * sizeof *identity);
      for (int k = 0; k < n[d]; k++) identity[k] = k;
      MUST(rve_batch_create(&scene, packings[d], n[d], identity, n[d], help_backend(), &batch));
      for (int k = 0; k < n[d]; k++) {
        RveView view;
        MUST(rve_batch_view(batch, k, &view));
        misses += count_misses(&cases[which[d][k]], &view);
        contacts += view.contacts;
        for (int v = 0; v < view.contacts; v++) images += view.pair[2 * v] == view.pair[2 * v + 1];
        rve_view_destroy(&view);
      }
      rve_batch_destroy(batch);
      free(identity);
    }
    for (int k = 0; k < CELLS_PER_BATCH; k++) rve_packing_destroy(&cases[k].packing);
  }
  print_message("           A2: %d cells, %ld contacts, %ld of a grain with its own image, %ld misses\n", CELLS,
                contacts, images, misses);
  assert_int_equal(misses, 0);
  assert_true(images > CELLS / 10);
}

/* A fast granular gas that collapses and flies apart while the cell shears: the list never lacks a contact. */
static void no_contact_is_missed_in_motion(void **state) {
  (void)state;
  long contacts = 0, rebuilds = 0;
  for (int dim = 2; dim <= 3; dim++)
    for (int wide = 0; wide < 2; wide++) {
      RvePacking packing = help_random(dim, dim == 2 ? 8 : 4, dim == 2 ? 2e4 : 1e5, 77);
      RveScene scene = help_scene(dim);
      uint64_t seed = 5;
      RveAnswer answer;
      help_heat(&scene);
      scene.tangential_stiffness = 8e5;
      scene.skin = wide ? 0.2 : 0.02;
      for (int i = 0; i < packing.grains; i++)
        for (int k = 0; k < dim; k++) packing.velocity[3 * i + k] = help_uniform(&seed, -3.0, 3.0);
      RveBatch *batch = help_batch(&scene, &packing);
      for (int call = 0; call < CALLS; call++) {
        double gradient[9] = {0.0};
        RvePacking now;
        int expected = 0;
        gradient[1] = 40.0, gradient[0] = call % 60 < 30 ? 10.0 : -10.0, gradient[4] = 0.3 * gradient[0];
        answer = help_step(batch, gradient, call % 20 * 40.0, 1e-4);
        MUST(rve_batch_packing(batch, 0, &now));
        const double grown = 1.0 + scene.expansion * (call % 20 * 40.0);
        for (int i = 0; i < now.grains; i++)
          for (int j = i + 1; j < now.grains; j++)
            for (int x = -2; x <= 2; x++)
              for (int y = -2; y <= 2; y++)
                for (int z = dim == 3 ? -2 : 0; z <= (dim == 3 ? 2 : 0); z++) {
                  const int p[3] = {x, y, z};
                  double d[3];
                  expected += branch_of(&now, i, j, p, d) < (now.radius[i] + now.radius[j]) * grown;
                }
        assert_int_equal((int)(answer.coordination * now.grains / 2.0 + 0.5), expected);
        contacts += expected;
        rve_packing_destroy(&now);
      }
      rebuilds += answer.rebuilds;
      rve_batch_destroy(batch);
      rve_packing_destroy(&packing);
    }
  print_message("           A2: %ld contacts in motion, %ld lists, 0 misses\n", contacts, rebuilds);
}

/* ---------------------------------------------------------------------------------------------- A3: extreme shear */

/* Stress of a crystal of one grain and kt = 0 in any cell: all lattice vectors shorter than 2R. */
static void lattice_stress(const double cell[9], int dim, double radius, double kn, double thickness,
                           double stress[6]) {
  double full[9] = {0.0};
  const int range = 12;
  const double volume = fabs(tensor_determinant(cell)) * thickness;
  for (int x = -range; x <= range; x++)
    for (int y = -range; y <= range; y++)
      for (int z = dim == 3 ? -range : 0; z <= (dim == 3 ? range : 0); z++) {
        const int p[3] = {x, y, z};
        double b[3];
        if (!is_half(p)) continue;
        for (int k = 0; k < 3; k++) b[k] = cell[3 * k] * x + cell[3 * k + 1] * y + cell[3 * k + 2] * z;
        const double length = sqrt(b[0] * b[0] + b[1] * b[1] + b[2] * b[2]);
        if (length >= 2.0 * radius) continue;
        for (int i = 0; i < 3; i++)
          for (int j = 0; j < 3; j++) full[3 * i + j] -= kn * (2.0 * radius - length) * b[i] * b[j] / (length * volume);
      }
  help_symmetric(full, stress);
}

/* Shear to gamma = 10 in steps of 0.01, and J from 1 to 0.5 and 2: the answer is the lattice sum throughout. */
static double extreme_crystal(HelpLattice lattice, int pure) {
  const double radius = 5e-3;
  RveScene scene = help_scene(help_dimension(lattice));
  RvePacking packing = help_crystal(lattice, 1, radius, 0.1);
  double f[9], cell[9], gradient[9], total[9] = {0.0}, error = 0.0;
  scene.substeps = 1;
  RveBatch *batch = help_batch(&scene, &packing);
  for (int k = 0; k < 1000; k++) {
    memset(gradient, 0, sizeof gradient);
    if (pure) { /* J: 1 -> 0.5 -> 2, unequally along the axes */
      const double rate = k < 250 ? log(0.5) / 250.0 : log(4.0) / 750.0;
      gradient[0] = 0.7 * rate, gradient[4] = 0.3 * rate;
    } else {
      gradient[1] = 0.01;
    }
    const RveAnswer answer = help_step(batch, gradient, 0.0, 1.0);
    double expected[6];
    for (int m = 0; m < 9; m++) total[m] += gradient[m]; /* all gradients of a run commute */
    tensor_exponential(total, 1.0, f);
    tensor_multiply(f, packing.cell, cell);
    lattice_stress(cell, scene.dimension, radius, scene.normal_stiffness, scene.dimension == 2 ? scene.thickness : 1.0,
                   expected);
    /* Relative to kn / length scale: the stress itself passes through 0 when the crystal comes apart. */
    const double scale = fmax(help_largest(6, expected),
                              0.01 * scene.normal_stiffness / (scene.dimension == 2 ? scene.thickness : 0.01));
    for (int m = 0; m < 6; m++) error = fmax(error, fabs(answer.stress[m] - expected[m]) / scale);
  }
  rve_batch_destroy(batch);
  rve_packing_destroy(&packing);
  return error;
}

static void crystals_answer_with_the_lattice_sum_at_any_shear(void **state) {
  (void)state;
  double error = 0.0;
  for (int lattice = 0; lattice < 3; lattice++)
    for (int pure = 0; pure < 2; pure++) error = fmax(error, extreme_crystal((HelpLattice)lattice, pure));
  help_report("A3 largest error of a crystal's stress, gamma 0 to 10, J 0.5 to 2", error);
  /* A thousand rounded products make 1e-14 of a length; over an overlap of 10 %, 1e-13. */
  assert_true(error <= 1e-12);
}

/* The same lattice through other cell vectors: H M, M^-1 s, M^-1 P with "vector a plus t times vector b". */
static void skew(int a, int b, int t, RvePacking *packing) {
  for (int k = 0; k < 3; k++) packing->cell[3 * k + a] += t * packing->cell[3 * k + b];
  for (int i = 0; i < packing->grains; i++) packing->position[3 * i + b] -= t * packing->position[3 * i + a];
  for (int c = 0; c < packing->contacts; c++)
    packing->contact_image[3 * c + b] -= t * packing->contact_image[3 * c + a];
}

/* Positions leave the unit cell by skewing; a packing has them in [-0.5, 0.5). */
static void wrap(RvePacking *packing) {
  for (int c = 0; c < packing->contacts; c++)
    for (int k = 0; k < packing->dimension; k++)
      packing->contact_image[3 * c + k] +=
          (int)floor(packing->position[3 * packing->contact_pair[2 * c + 1] + k] + 0.5) -
          (int)floor(packing->position[3 * packing->contact_pair[2 * c] + k] + 0.5);
  for (int i = 0; i < packing->grains; i++)
    for (int k = 0; k < packing->dimension; k++) {
      double *s = &packing->position[3 * i + k];
      *s -= floor(*s + 0.5);
      if (*s >= 0.5) *s = -0.5;
    }
}

static double sum_of_shear(const RveBatch *batch) {
  RveView view;
  double sum = 0.0;
  MUST(rve_batch_view(batch, 0, &view));
  for (int c = 0; c < view.contacts; c++)
    sum += sqrt(view.force_shear[3 * c] * view.force_shear[3 * c] +
                view.force_shear[3 * c + 1] * view.force_shear[3 * c + 1] +
                view.force_shear[3 * c + 2] * view.force_shear[3 * c + 2]);
  rve_view_destroy(&view);
  return sum;
}

/* A frictional packing under shear up to gamma = 10: at many stages its state in a heavily skewed cell, which the
 * engine must reduce at once, gives the same stress and the same tangential forces. */
static void reduction_keeps_stress_and_histories(void **state) {
  (void)state;
  double error = 0.0, history = 0.0;
  for (int dim = 2; dim <= 3; dim++) {
    RvePacking packing = help_random(dim, dim == 2 ? 10 : 6, dim == 2 ? 2e4 : 1e5, 5);
    RveScene scene = help_scene(dim);
    double gradient[9] = {0.0};
    scene.tangential_stiffness = 8e5;
    scene.local_damping = 0.5;
    RveBatch *batch = help_batch(&scene, &packing);
    /* Some room first: at constant volume single overlaps would come near what a packing may have. */
    gradient[4] = 1.0;
    help_step(batch, gradient, 0.0, 0.03);
    gradient[1] = 10.0, gradient[4] = 0.07; /* to gamma = 10 */
    for (int stage = 0; stage < STAGES; stage++) {
      const RveAnswer answer = help_step(batch, gradient, 0.0, 0.125);
      RvePacking skewed;
      MUST(rve_batch_packing(batch, 0, &skewed));
      skew(stage % dim, (stage + 1) % dim, 1 + stage % (4 - dim), &skewed);
      wrap(&skewed);
      if (dim == 2 && (stage & 1)) skew((stage + 1) % dim, stage % dim, -1, &skewed), wrap(&skewed);
      RveBatch *other = help_batch(&scene, &skewed);
      const RveAnswer again = help_step(other, NULL, 0.0, 0.0);
      error = fmax(error, help_difference(6, again.stress, answer.stress));
      history = fmax(history, fabs(sum_of_shear(other) / sum_of_shear(batch) - 1.0));
      assert_true(sum_of_shear(batch) > 0.0);
      rve_batch_destroy(other);
      rve_packing_destroy(&skewed);
    }
    rve_batch_destroy(batch);
    rve_packing_destroy(&packing);
  }
  help_report("A3 largest change of a frictional stress across a reduction", error);
  help_report("A3 largest change of the tangential forces across a reduction", history);
  /* 1e-12 asked; the detour over a packing's double positions costs 2e-17 of a cell over overlaps of 1e-3 radii, 1e-12.
   */
  assert_true(error <= 1e-12);
  assert_true(history <= 1e-12);
}

/* ------------------------------------------------------------------------------------------------------- A4, A5 */

static void one_turn_in_1000_steps_keeps_the_volume(void **state) {
  (void)state;
  const double pi = 3.14159265358979323846;
  double drift = 0.0, stress = 0.0;
  for (int dim = 2; dim <= 3; dim++) {
    RvePacking packing = help_crystal(dim == 2 ? HELP_HEXAGONAL : HELP_CUBIC, 2, 5e-3, 0.05);
    RveScene scene = help_scene(dim);
    double gradient[9] = {0.0};
    gradient[1] = -2.0 * pi, gradient[3] = 2.0 * pi;
    scene.tangential_stiffness = 5e5;
    scene.substeps = 1;
    RveBatch *batch = help_batch(&scene, &packing);
    const RveAnswer first = help_step(batch, NULL, 0.0, 0.0);
    RveAnswer last = first;
    for (int k = 0; k < 1000; k++) last = help_step(batch, gradient, 0.0, 1e-3);
    drift = fmax(drift, fabs(last.volume / first.volume - 1.0));
    stress = fmax(stress, help_difference(6, last.stress, first.stress));
    rve_batch_destroy(batch);
    rve_packing_destroy(&packing);
  }
  help_report("A4 |J - 1| after one turn in 1000 steps", drift);
  help_report("A4 change of stress after one turn", stress);
  assert_true(drift <= 1e-12);
  assert_true(stress <= 1e-10); /* length drift 1e-14 over an overlap of 5 %, and a thousand rounded rotations */
}

static void rotate_vectors(const double q[9], int n, double *x) {
  for (int i = 0; i < n; i++) {
    const double v[3] = {x[3 * i], x[3 * i + 1], x[3 * i + 2]};
    for (int k = 0; k < 3; k++) x[3 * i + k] = q[3 * k] * v[0] + q[3 * k + 1] * v[1] + q[3 * k + 2] * v[2];
  }
}

/* q a q^T */
static void rotate_tensor(const double q[9], const double a[9], double b[9]) {
  double qt[9], qa[9];
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) qt[3 * i + j] = q[3 * j + i];
  tensor_multiply(q, a, qa);
  tensor_multiply(qa, qt, b);
}
static void rotate_stress(const double q[9], const double s[6], double r[6]) {
  double full[9], rotated[9];
  help_full(s, full);
  rotate_tensor(q, full, rotated);
  help_symmetric(rotated, r);
}

static void a_rotated_rve_answers_with_the_rotated_stress(void **state) {
  (void)state;
  double error = 0.0, heat = 0.0, later = 0.0;
  for (int dim = 2; dim <= 3; dim++) {
    RvePacking packing = help_random(dim, dim == 2 ? 12 : 6, dim == 2 ? 2e4 : 1e5, 9), rotated;
    RveScene scene = help_scene(dim);
    double shear[9] = {0.0}, axis[9] = {0.0}, q[9], turned[9], cell[9], expected[6];
    help_heat(&scene);
    scene.tangential_stiffness = 8e5;
    /* The same for both: the critical step depends on the packing, the steps' number on it, and the error on that. */
    scene.time_step = 0.08 * rve_critical_time_step(&scene, &packing);
    RveBatch *batch = help_batch(&scene, &packing);
    shear[1] = 0.5, shear[4] = -0.1;
    RveAnswer answer = help_step(batch, shear, 0.0, 0.02);
    axis[1] = -0.7, axis[3] = 0.7; /* 40 degrees about z, in 3D about a skew axis */
    if (dim == 3) axis[2] = 0.4, axis[6] = -0.4, axis[5] = -0.9, axis[7] = 0.9;
    tensor_exponential(axis, 1.0, q);
    MUST(rve_batch_packing(batch, 0, &rotated));
    tensor_multiply(q, rotated.cell, cell);
    memcpy(rotated.cell, cell, sizeof cell);
    rotate_vectors(q, rotated.grains, rotated.velocity);
    rotate_vectors(q, rotated.grains, rotated.spin);
    rotate_vectors(q, rotated.contacts, rotated.contact_shear);
    RveBatch *other = help_batch(&scene, &rotated);
    RveAnswer seen = help_step(other, NULL, 0.0, 0.0);
    rotate_stress(q, answer.stress, expected);
    error = fmax(error, help_difference(6, seen.stress, expected));
    rotate_stress(q, answer.conductivity, expected);
    heat = fmax(heat, help_difference(6, seen.conductivity, expected));
    /* The same further shear, seen in the rotated frame. */
    rotate_tensor(q, shear, turned);
    answer = help_step(batch, shear, 0.0, 1e-4);
    seen = help_step(other, turned, 0.0, 1e-4);
    rotate_stress(q, answer.stress, expected);
    later = fmax(later, help_difference(6, seen.stress, expected));
    rve_batch_destroy(other);
    rve_batch_destroy(batch);
    rve_packing_destroy(&rotated);
    rve_packing_destroy(&packing);
  }
  help_report("A5 largest relative error of Q s Q^T", error);
  help_report("A5 largest relative error of Q K Q^T", heat);
  help_report("A5 the same after further shear", later);
  assert_true(error <= 1e-10);
  assert_true(heat <= 1e-10);
  assert_true(later <= 1e-9); /* round-off grows in a system of collisions */
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(no_periodic_image_is_missed),
      cmocka_unit_test(no_contact_is_missed_in_motion),
      cmocka_unit_test(crystals_answer_with_the_lattice_sum_at_any_shear),
      cmocka_unit_test(reduction_keeps_stress_and_histories),
      cmocka_unit_test(one_turn_in_1000_steps_keeps_the_volume),
      cmocka_unit_test(a_rotated_rve_answers_with_the_rotated_stress),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
