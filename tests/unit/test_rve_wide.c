/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Cells so wide that no pair of the list reaches half a cell edge go without images (RveHead.wide). That such a list may do
 * so in every call; that narrow cells do not; that empty slots name another grain. The same bits either way, and that those
 * never touch: test_rve_resting.c. And that each list leaves a row behind it, which the contact pass reads. */
#include "rve_help.h"

#include "cuda_rve/rve_batch_private.h"

enum { STRAINS = 60 };

/* Nearest image of s_j - s_i, in units of a cell edge / 2^60; what the kernel takes in its stead. */
static int64_t nearest(int64_t si, int64_t sj) { return (int64_t)(((uint64_t)sj - (uint64_t)si) << 4) / 16; }

/* The contact pass reads one row behind the last: there must be one, and it must name grains. */
static void assert_row_behind(const RveRecord *record) {
  const RveCounts *n = &record->counts;
  const int rows = record->arrays.slot_first[n->blocks];
  assert_true(rows > 0 && rows < n->slot_rows);
  for (int lane = 0; lane < n->lanes; lane++)
    assert_true(record->arrays.neighbour[rows * n->lanes + lane] < (uint32_t)(n->blocks * n->lanes * (n->row ? n->row : 1)));
}

/* Pairs whose image is not the nearest one's. */
static int strays(const RveRecord *record, int *pairs, int *empty) {
  const RveCounts *n = &record->counts;
  const RveArrays *a = &record->arrays;
  int found = 0;
  for (int block = 0; block < n->blocks; block++)
    for (int slot = a->slot_first[block] * n->lanes; slot < a->slot_first[block + 1] * n->lanes; slot++) {
      const int i = block * n->lanes + slot % n->lanes, j = (int)a->neighbour[slot] / (n->row ? n->row : 1);
      int p[3], stray = 0;
      rve_image_unpack(a->image[slot], p);
      if (a->image[slot] & RVE_IMAGE_VOID) {
        *empty += 1, found += j == i;
        continue;
      }
      for (int k = 0; k < n->dimension; k++)
        stray |= a->position[k][j] - a->position[k][i] + p[k] * RVE_ONE != nearest(a->position[k][i], a->position[k][j]);
      *pairs += 1, found += stray;
    }
  return found;
}

static RveBatch *batch_of(const RvePacking *packing, int resting) {
  RveScene scene = help_scene(packing->dimension);
  RveBatch *batch;
  scene.tangential_stiffness = 1e6, scene.local_damping = 0.2;
  scene.resting = resting;
  MUST(rve_batch_create(&scene, packing, 1, NULL, 1, RVE_BACKEND_CPU, &batch));
  return batch;
}

/* Far beyond several reductions of the cell: sheared by 12, squeezed, stretched. */
static void strain(const RvePacking *packing) {
  const double motion[3][9] = {{0, 40, 0, 0, 0, 0, 0, 0, 0}, {-20, 0, 0, 0, 20, 0, 0, 0, 0}, {20, -10, 0, 5, -20, 0, 0, 0, 0}};
  RveBatch *batch = batch_of(packing, 1);
  const int lanes = batch->record[0].counts.lanes; /* with one there are no empty slots */
  const int may = packing->dimension == 2 || strcmp(rve_batch_backend_name(batch), "cpu/avx512_gather") == 0;
  int pairs = 0, empty = 0, wide = 0;
  for (int call = 0; call < STRAINS; call++) {
    help_step(batch, motion[3 * call / STRAINS], 0.0, 5e-3);
    const RveRecord *record = &batch->record[0];
    wide += rve_head(record->arena)->wide;
    if (!rve_head(record->arena)->wide) continue;
    const int found = strays(record, &pairs, &empty);
    if (found > 0) fail_msg("%d grains, call %d: %d slots are not the nearest images'", packing->grains, call, found);
  }
  printf("%s, %d grains, %dD: wide after %d of %d calls, %d pairs and %d empty slots seen\n", rve_batch_backend_name(batch),
         packing->grains, packing->dimension, wide, STRAINS, pairs, empty);
  if (may) assert_true(wide > STRAINS / 2 && pairs > 0 && (empty > 0 || lanes == 1));
  else assert_int_equal(wide, 0);
  rve_batch_destroy(batch);
}

static void images_are_the_nearest(void **state) {
  (void)state;
  const int dimension[3] = {2, 2, 3}, sides[3] = {20, 12, 9};
  for (int c = 0; c < 3; c++) {
    RvePacking packing = help_random(dimension[c], sides[c], dimension[c] == 2 ? 2e4 : 1e5, 7);
    for (int gathers = 0; gathers < 2; gathers++) { /* or the machine's best, if it has none */
      setenv("DEMPM_ISA", gathers ? "avx512_gather" : "avx512", 1);
      strain(&packing);
      unsetenv("DEMPM_ISA");
    }
    rve_packing_destroy(&packing);
  }
}

static void narrow_cells_keep_their_images(void **state) {
  (void)state;
  for (int n = 1; n <= 2; n++) {
    RvePacking packing = help_crystal(HELP_HEXAGONAL, n, 3e-3, 1e-3);
    RveBatch *batch = batch_of(&packing, 1);
    help_step(batch, NULL, 0.0, 1e-3);
    assert_int_equal(rve_head(batch->record[0].arena)->wide, 0);
    rve_batch_destroy(batch);
    rve_packing_destroy(&packing);
  }
  RvePacking packing = help_random(2, 12, 2e4, 7);
  RveBatch *batch = batch_of(&packing, 0); /* asked for */
  help_step(batch, NULL, 0.0, 1e-3);
  assert_int_equal(rve_head(batch->record[0].arena)->wide, 0);
  rve_batch_destroy(batch);
  rve_packing_destroy(&packing);
}

/* Small packings, whose lists come to fill their arenas to the last row. */
static void a_row_is_left_behind_the_list(void **state) {
  (void)state;
  const double motion[9] = {0, 40, 0, 0, 0, 0, 0, 0, 0};
  int lists = 0;
  for (uint64_t seed = 1; seed <= 8; seed++)
    for (int side = 2; side <= 6; side++) {
      RvePacking packing = help_random(2, side, 2e4, seed);
      RveBatch *batch = batch_of(&packing, 1);
      for (int call = 0; call < 20; call++) {
        help_step(batch, motion, 0.0, 5e-3);
        assert_row_behind(&batch->record[0]);
      }
      lists += (int)rve_head(batch->record[0].arena)->rebuilds;
      rve_batch_destroy(batch);
      rve_packing_destroy(&packing);
    }
  printf("%d lists\n", lists);
}

int main(void) {
  const struct CMUnitTest tests[] = {cmocka_unit_test(images_are_the_nearest), cmocka_unit_test(narrow_cells_keep_their_images),
                                     cmocka_unit_test(a_row_is_left_behind_the_list)};
  return cmocka_run_group_tests(tests, NULL, NULL);
}
