/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Crystals, replication and the checks of packings. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "base/tensor.h"
#include "cuda_rve/rve_packing.h"
#include "cuda_rve/rve_packing_pairs.h"

#define MUST(expression)                                                                \
  do {                                                                                  \
    if ((expression) != BASE_OK) fail_msg("%s: %s", #expression, base_error_message()); \
  } while (0)

static const double pi = 3.14159265358979323846;
static const double round_off = 1e-14; /* relative, of a few operations */

typedef struct Shell {
  int pairs;
  double nearest, farthest;
} Shell;

static BaseStatus count_pair(void *context, int i, int j, const int image[3], const double branch[3], double distance) {
  Shell *shell = context;
  (void)i, (void)j, (void)image, (void)branch;
  shell->nearest = shell->pairs ? fmin(shell->nearest, distance) : distance;
  shell->farthest = fmax(shell->farthest, distance);
  shell->pairs++;
  return BASE_OK;
}

typedef struct Crystal {
  RveLattice lattice;
  int dimension, neighbours;
  double solid_fraction; /* touching */
} Crystal;

static void crystals(Crystal crystal[5]) {
  crystal[0] = (Crystal){RVE_SQUARE, 2, 4, pi / 4.0};
  crystal[1] = (Crystal){RVE_HEXAGONAL, 2, 6, pi / (2.0 * sqrt(3.0))};
  crystal[2] = (Crystal){RVE_SIMPLE_CUBIC, 3, 6, pi / 6.0};
  crystal[3] = (Crystal){RVE_BCC, 3, 8, pi * sqrt(3.0) / 8.0};
  crystal[4] = (Crystal){RVE_FCC, 3, 12, pi / (3.0 * sqrt(2.0))};
}

static void crystals_have_their_neighbours_and_solid_fraction(void **state) {
  (void)state;
  const double radius = 0.004, overlap = 0.01;
  Crystal crystal[5];
  crystals(crystal);
  for (int k = 0; k < 5; k++) {
    RvePacking packing;
    Shell shell = {0};
    MUST(rve_packing_lattice(crystal[k].lattice, radius, overlap, &packing));
    MUST(rve_packing_check(&packing));
    assert_int_equal(packing.dimension, crystal[k].dimension);
    MUST(packing_visit_pairs(&packing, 0.0, count_pair, &shell));
    assert_int_equal(2 * shell.pairs, crystal[k].neighbours);
    assert_true(fabs(shell.nearest / (2.0 * radius * (1.0 - overlap)) - 1.0) < round_off);
    assert_true(fabs(shell.farthest / shell.nearest - 1.0) < round_off);
    const double solid = packing_grain_measure(&packing) / packing_cell_measure(&packing);
    const double expected = crystal[k].solid_fraction / pow(1.0 - overlap, packing.dimension);
    assert_true(fabs(solid / expected - 1.0) < round_off);
    rve_packing_destroy(&packing);
  }
}

static void copies_of_a_crystal_have_the_same_neighbours(void **state) {
  (void)state;
  Crystal crystal[5];
  crystals(crystal);
  for (int k = 0; k < 5; k++) {
    RvePacking packing, block;
    Shell shell = {0};
    const int copies[3] = {5, 6, crystal[k].dimension == 3 ? 4 : 1}, cells = copies[0] * copies[1] * copies[2];
    MUST(rve_packing_lattice(crystal[k].lattice, 0.004, 0.01, &packing));
    MUST(rve_packing_replicate(&packing, copies, &block));
    MUST(rve_packing_check(&block));
    assert_int_equal(block.grains, cells);
    assert_true(fabs(packing_cell_measure(&block) / (cells * packing_cell_measure(&packing)) - 1.0) < round_off);
    /* Above 16 grains the search goes through bins and nearest images: another way than for one cell. */
    MUST(packing_visit_pairs(&block, 0.0, count_pair, &shell));
    assert_int_equal(2 * shell.pairs, crystal[k].neighbours * cells);
    assert_true(fabs(shell.farthest / (2.0 * 0.004 * 0.99) - 1.0) < round_off * 100.0); /* wrapped: a few ulps of 1 */
    rve_packing_destroy(&block);
    rve_packing_destroy(&packing);
  }
}

/* The branch of contact c. */
static void branch_of(const RvePacking *packing, int c, double branch[3]) {
  const int *pair = packing->contact_pair + 2 * c, *image = packing->contact_image + 3 * c;
  const double *h = packing->cell;
  double s[3];
  for (int k = 0; k < 3; k++) s[k] = packing->position[3 * pair[1] + k] - packing->position[3 * pair[0] + k] + image[k];
  for (int k = 0; k < 3; k++) branch[k] = h[3 * k] * s[0] + h[3 * k + 1] * s[1] + h[3 * k + 2] * s[2];
}

static void copies_keep_branches_and_forces_of_contacts(void **state) {
  (void)state;
  RvePacking packing, block;
  const int image[9] = {1, 0, 0, 0, 1, 0, -1, 1, 0}, copies[3] = {3, 2, 1};
  MUST(rve_packing_lattice(RVE_HEXAGONAL, 0.004, 0.01, &packing));
  MUST(BASE_ALLOC(6, &packing.contact_pair));
  MUST(BASE_ALLOC(9, &packing.contact_image));
  MUST(BASE_ALLOC(9, &packing.contact_shear));
  packing.contacts = 3;
  memcpy(packing.contact_image, image, sizeof image);
  for (int k = 0; k < 9; k++) packing.contact_shear[k] = k;
  MUST(rve_packing_replicate(&packing, copies, &block));
  assert_int_equal(block.contacts, 18);
  for (int c = 0; c < 18; c++) {
    double one[3], copy[3];
    branch_of(&packing, c % 3, one);
    branch_of(&block, c, copy);
    for (int k = 0; k < 3; k++) assert_true(fabs(copy[k] - one[k]) < 0.008 * round_off);
    assert_memory_equal(block.contact_shear + 3 * c, packing.contact_shear + 3 * (c % 3), 3 * sizeof(double));
    for (int other = 0; other < c; other++) /* no contact is there twice */
      assert_false(memcmp(block.contact_pair + 2 * c, block.contact_pair + 2 * other, 2 * sizeof(int)) == 0 &&
                   memcmp(block.contact_image + 3 * c, block.contact_image + 3 * other, 3 * sizeof(int)) == 0);
  }
  rve_packing_destroy(&block);
  rve_packing_destroy(&packing);
}

static void refused(BaseStatus status, const char *words) {
  assert_int_equal(status, BASE_ERROR_ARGUMENT);
  if (!strstr(base_error_message(), words)) fail_msg("message '%s' lacks '%s'", base_error_message(), words);
}

static void wrong_lattices_and_copies_are_refused(void **state) {
  (void)state;
  RvePacking packing, block;
  refused(rve_packing_lattice((RveLattice)17, 1.0, 0.0, &packing), "lattice 17");
  refused(rve_packing_lattice(RVE_BCC, 0.0, 0.0, &packing), "radius 0 m; it must be positive");
  refused(rve_packing_lattice(RVE_BCC, NAN, 0.0, &packing), "must be positive");
  refused(rve_packing_lattice(RVE_BCC, 1.0, 0.2, &packing), "overlap 0.2");
  MUST(rve_packing_lattice(RVE_SQUARE, 1.0, 0.0, &packing));
  refused(rve_packing_replicate(&packing, (const int[3]){2, 2, 2}, &block), "2 copies along direction 3");
  refused(rve_packing_replicate(&packing, (const int[3]){0, 2, 1}, &block), "0 copies along direction 1");
  refused(rve_packing_replicate(&packing, (const int[3]){10000, 10000, 1}, &block), "100000000 copies of 1 grains");
  assert_null(block.position);
  rve_packing_destroy(&packing);
  rve_packing_destroy(&packing);
  rve_packing_destroy(NULL);
}

/* 5 x 5 touching disks of radius 1 with one thing wrong. */
static RvePacking square_block(void) {
  RvePacking packing, block;
  MUST(rve_packing_lattice(RVE_SQUARE, 1.0, 0.0, &packing));
  MUST(rve_packing_replicate(&packing, (const int[3]){5, 5, 1}, &block));
  rve_packing_destroy(&packing);
  return block;
}

static void wrong_packings_are_refused(void **state) {
  (void)state;
  refused(rve_packing_check(NULL), "NULL");
  RvePacking p = square_block();
  MUST(rve_packing_check(&p));
  p.dimension = 4, refused(rve_packing_check(&p), "dimension 4"), p.dimension = 2;
  p.grains = 0, refused(rve_packing_check(&p), "at least 1"), p.grains = 25;
  p.radius[3] = NAN, refused(rve_packing_check(&p), "grain 4 has radius nan"), p.radius[3] = 1.0;
  p.radius[3] = -1.0, refused(rve_packing_check(&p), "grain 4 has radius -1"), p.radius[3] = 1.0;
  p.radius[3] = 1.4, refused(rve_packing_check(&p), "overlap by 0.4 m"), p.radius[3] = 1.0;
  p.radius[3] = 1.29;
  MUST(rve_packing_check(&p)); /* 30 % of the smaller radius, just so */
  p.radius[3] = 1.0;
  p.radius[3] = 2.6, refused(rve_packing_check(&p), "more than half the cell's height"), p.radius[3] = 1.0;
  const double x = p.position[0];
  p.position[0] = 0.5, refused(rve_packing_check(&p), "[-0.5, 0.5)");
  p.position[0] = NAN, refused(rve_packing_check(&p), "fractional position nan"), p.position[0] = x;
  p.position[2] = 0.1, refused(rve_packing_check(&p), "one layer at 0"), p.position[2] = 0.0;
  p.cell[0] = -10.0, refused(rve_packing_check(&p), "left-handed"), p.cell[0] = 10.0;
  p.cell[8] = 2.0, refused(rve_packing_check(&p), "unit tensor"), p.cell[8] = 1.0;
  p.contacts = 1, refused(rve_packing_check(&p), "without pairs"), p.contacts = 0;
  MUST(BASE_ALLOC(2, &p.contact_pair));
  MUST(BASE_ALLOC(3, &p.contact_image));
  MUST(BASE_ALLOC(3, &p.contact_shear));
  p.contacts = 1;
  p.contact_pair[1] = 25, refused(rve_packing_check(&p), "joins grains 0 and 25 of 25"), p.contact_pair[1] = 1;
  p.contact_image[2] = 1, refused(rve_packing_check(&p), "cell shift 1"), p.contact_image[2] = 0;
  p.contact_shear[1] = INFINITY, refused(rve_packing_check(&p), "tangential force of contact 1 is not finite");
  rve_packing_destroy(&p);
}

/* Brute force over 5 x 5 (x 5) images against the search in bins, in skewed cells. */
static void search_in_bins_misses_no_pair(void **state) {
  (void)state;
  uint64_t random = 3;
  for (int trial = 0; trial < 200; trial++) {
    const int dimension = 2 + trial % 2, n = 40;
    RvePacking p;
    MUST(packing_create(dimension, n, 0, &p));
    for (int k = 0; k < dimension; k++) p.cell[4 * k] = 1.0 + base_random(&random);
    p.cell[1] = 2.0 * base_random(&random) - 1.0; /* sheared by up to the cell's width */
    double height[3];
    packing_heights(p.cell, height);
    const double narrow = fmin(height[0], fmin(height[1], dimension == 3 ? height[2] : 1e9));
    for (int i = 0; i < n; i++) {
      p.radius[i] = narrow * (0.05 + 0.19 * base_random(&random));
      for (int k = 0; k < dimension; k++) p.position[3 * i + k] = base_random(&random) - 0.5;
    }
    Shell shell = {0};
    int expected = 0;
    MUST(packing_visit_pairs(&p, 0.0, count_pair, &shell));
    const int depth = dimension == 3 ? 2 : 0;
    for (int i = 0; i < n; i++)
      for (int j = i + 1; j < n; j++)
        for (int a = -3; a <= 3; a++)
          for (int b = -2; b <= 2; b++)
            for (int c = -depth; c <= depth; c++) {
              const double *h = p.cell, s[3] = {p.position[3 * j] - p.position[3 * i] + a,
                                                p.position[3 * j + 1] - p.position[3 * i + 1] + b,
                                                p.position[3 * j + 2] - p.position[3 * i + 2] + c};
              const double x = h[0] * s[0] + h[1] * s[1], y = h[4] * s[1], z = h[8] * s[2];
              expected += sqrt(x * x + y * y + z * z) < p.radius[i] + p.radius[j];
            }
    assert_int_equal(shell.pairs, expected);
    rve_packing_destroy(&p);
  }
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(crystals_have_their_neighbours_and_solid_fraction),
      cmocka_unit_test(copies_of_a_crystal_have_the_same_neighbours),
      cmocka_unit_test(copies_keep_branches_and_forces_of_contacts),
      cmocka_unit_test(wrong_lattices_and_copies_are_refused),
      cmocka_unit_test(wrong_packings_are_refused),
      cmocka_unit_test(search_in_bins_misses_no_pair),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
