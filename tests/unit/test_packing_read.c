/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Packings from LIGGGHTS' files (made by stock LIGGGHTS, tests/data) and from our own form; wrong files. */
#include "packing_help.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#define MUST(expression)                                                                \
  do {                                                                                  \
    if ((expression) != BASE_OK) fail_msg("%s: %s", #expression, base_error_message()); \
  } while (0)

static RvePacking read_fixture(const char *name, int dimension, double kt) {
  char path[4096];
  RvePacking packing;
  fclose(open_fixture(name, path));
  MUST(rve_packing_read_history(path, dimension, kt, &packing));
  return packing;
}

static double largest_difference(const double *a, const double *b, int count) {
  double worst = 0.0;
  for (int k = 0; k < count; k++) worst = fmax(worst, fabs(a[k] - b[k]));
  return worst;
}

/* The Atoms section read in the simplest way, as a witness: x y z and diameter by id. */
static void read_naively(const char *name, int grains, double low[3], double high[3], double (*grain)[4]) {
  char path[4096], line[1024], edge[8];
  FILE *file = open_fixture(name, path);
  while (fgets(line, sizeof line, file) && strncmp(line, "Atoms", 5) != 0) {
    double a, b;
    if (sscanf(line, "%lg %lg %7s", &a, &b, edge) == 3 && strcmp(edge + 1, "lo") == 0)
      low[edge[0] - 'x'] = a, high[edge[0] - 'x'] = b;
  }
  for (int k = 0; k < grains && fgets(line, sizeof line, file);) {
    int id, type;
    double diameter, density, x, y, z;
    if (sscanf(line, "%d %d %lg %lg %lg %lg %lg", &id, &type, &diameter, &density, &x, &y, &z) != 7) continue;
    grain[id - 1][0] = x, grain[id - 1][1] = y, grain[id - 1][2] = z, grain[id - 1][3] = diameter, k++;
  }
  fclose(file);
}

static void data_file_gives_its_grains_sorted_by_id(void **state) {
  (void)state;
  for (int f = 0; f < FIXTURES; f += 4) { /* layer.data, spheres.data */
    double low[3], high[3], grain[64][4];
    const int dimension = fixtures[f].dimension, n = fixtures[f].grains;
    read_naively(fixtures[f].name, n, low, high, grain);
    RvePacking packing = read_fixture(fixtures[f].name, dimension, 0.0);
    assert_int_equal(packing.grains, n);
    assert_int_equal(packing.dimension, dimension);
    for (int k = 0; k < 3; k++)
      assert_true(packing.cell[4 * k] == (k < dimension ? high[k] - low[k] : 1.0) && packing.cell[1] == 0.0);
    for (int i = 0; i < n; i++) {
      assert_true(packing.radius[i] == 0.5 * grain[i][3]);
      for (int k = 0; k < dimension; k++) {
        const double s = (grain[i][k] - low[k]) / (high[k] - low[k]) - 0.5, d = packing.position[3 * i + k] - s;
        assert_true(fabs(d - rint(d)) < 4e-16); /* round-off of numbers below 1 */
      }
      if (dimension == 2) assert_true(packing.position[3 * i + 2] == 0.0);
    }
    rve_packing_destroy(&packing);
  }
}

static void restart_gives_what_the_data_file_gives(void **state) {
  (void)state;
  static const char *const name[2][2] = {{"layer.data", "layer.restart"}, {"spheres.data", "spheres.restart"}};
  for (int k = 0; k < 2; k++) {
    RvePacking a = read_fixture(name[k][0], 2 + k, 0.0), b = read_fixture(name[k][1], 2 + k, 0.0);
    assert_int_equal(a.grains, b.grains);
    /* write_data prints 17 digits: the same bits come back. Velocities differ by the mean's round-off only. */
    assert_memory_equal(a.cell, b.cell, sizeof a.cell);
    assert_memory_equal(a.position, b.position, 3 * (size_t)a.grains * sizeof(double));
    assert_memory_equal(a.radius, b.radius, (size_t)a.grains * sizeof(double));
    assert_true(largest_difference(a.velocity, b.velocity, 3 * a.grains) == 0.0);
    assert_true(largest_difference(a.spin, b.spin, 3 * a.grains) == 0.0);
    assert_int_equal(b.contacts, 0); /* without kt the history is unknown */
    rve_packing_destroy(&a);
    rve_packing_destroy(&b);
  }
}

static void dump_gives_what_the_data_file_gives(void **state) {
  (void)state;
  static const char *const name[2][2] = {{"layer.data", "layer.dump"},
                                         {"spheres.data", "spheres.dump"}}; /* x y z; xs ys zs */
  for (int k = 0; k < 2; k++) {
    RvePacking a = read_fixture(name[k][0], 2 + k, 0.0), b = read_fixture(name[k][1], 2 + k, 0.0);
    assert_int_equal(a.grains, b.grains);
    /* LIGGGHTS prints the box bounds with 6 digits: 5e-8 m each of a cell of 0.02 to 0.05 m. */
    assert_true(largest_difference(a.cell, b.cell, 9) < 1e-7);
    for (int i = 0; i < 3 * a.grains; i++) {
      const double d = a.position[i] - b.position[i];
      assert_true(fabs(d - rint(d)) < 5e-6);
    }
    assert_memory_equal(a.radius, b.radius, (size_t)a.grains * sizeof(double));
    rve_packing_destroy(&a);
    rve_packing_destroy(&b);
  }
}

static RveAnswer answer_of(const RvePacking *packing, double stiffness) {
  RveScene scene = rve_scene_default();
  RveBatch *batch;
  RveAnswer answer;
  const RveInput still = {{0.0}, 0.0};
  scene.dimension = packing->dimension;
  scene.grain = RVE_SPHERE;
  scene.thickness = 0.075;
  scene.density = 2650.0;
  scene.normal_stiffness = scene.tangential_stiffness = stiffness;
  scene.friction = 0.5;
  MUST(rve_batch_create(&scene, packing, 1, NULL, 1, RVE_BACKEND_CPU, &batch));
  MUST(rve_batch_rest(batch, 1, NULL));
  MUST(rve_batch_step(batch, 1, NULL, &still, 0.0, &answer));
  rve_batch_destroy(batch);
  return answer;
}

/* LIGGGHTS' packings are in equilibrium with their tangential forces, and far from it without. */
static void history_of_a_restart_balances_the_grains(void **state) {
  (void)state;
  static const struct {
    const char *name;
    int dimension, contacts;
    double stiffness, pressure;
  } packed[] = {
      {"layer.restart", 2, 57, 1e6, 1e4}, {"ranks.restart", 2, 57, 1e6, 1e4}, {"spheres.restart", 3, 169, 1e5, 1e5}};
  for (int k = 0; k < 3; k++) {
    RvePacking with = read_fixture(packed[k].name, packed[k].dimension, packed[k].stiffness);
    RvePacking without = read_fixture(packed[k].name, packed[k].dimension, 0.0);
    assert_int_equal(with.contacts, packed[k].contacts);
    assert_int_equal(without.contacts, 0);
    const RveAnswer good = answer_of(&with, packed[k].stiffness), bad = answer_of(&without, packed[k].stiffness);
    /* measured: 3e-6 to 1e-4 with (LIGGGHTS' run ended with a little motion), above 0.2 without */
    assert_true(good.unbalanced < 1e-3);
    assert_true(bad.unbalanced > 0.1);
    /* the servo of the script stops within 0.3 % of the pressure; the run to rest after it moves it a little */
    for (int d = 0; d < packed[k].dimension; d++) assert_true(fabs(good.stress[d] / -packed[k].pressure - 1.0) < 0.01);
    rve_packing_destroy(&with);
    rve_packing_destroy(&without);
  }
}

/* Two processes' chunks, and another fix's data in front of the contact history. */
static void restart_of_two_processes_is_read(void **state) {
  (void)state;
  RvePacking one = read_fixture("layer.restart", 2, 1e6), two = read_fixture("ranks.restart", 2, 1e6);
  assert_int_equal(two.grains, one.grains);
  assert_int_equal(two.contacts, one.contacts);
  /* the second file is one DEM step later: 2e-5 s at below 1e-4 m/s, in a cell of 0.05 m */
  for (int i = 0; i < 3 * one.grains; i++) {
    const double d = one.position[i] - two.position[i];
    assert_true(fabs(d - rint(d)) < 1e-7);
  }
  rve_packing_destroy(&one);
  rve_packing_destroy(&two);
}

static void own_form_gives_every_bit_back(void **state) {
  (void)state;
  RvePacking a = read_fixture("layer.restart", 2, 1e6), b;
  char name[] = "packing_read_XXXXXX";
  const int file = mkstemp(name);
  assert_true(file >= 0);
  close(file);
  a.contact_shear[0] = -0.0;
  a.contact_shear[1] = 4.9406564584124654e-324;
  a.spin[2] = -1.7976931348623157e+308;
  MUST(rve_packing_write(name, &a));
  MUST(rve_packing_read(name, 2, &b));
  assert_int_equal(a.grains, b.grains);
  assert_int_equal(a.contacts, b.contacts);
  const size_t n = (size_t)a.grains, c = (size_t)a.contacts, d = sizeof(double);
  assert_memory_equal(a.cell, b.cell, 9 * d);
  assert_memory_equal(a.position, b.position, 3 * n * d);
  assert_memory_equal(a.radius, b.radius, n * d);
  assert_memory_equal(a.velocity, b.velocity, 3 * n * d);
  assert_memory_equal(a.spin, b.spin, 3 * n * d);
  assert_memory_equal(a.contact_pair, b.contact_pair, 2 * c * sizeof(int));
  assert_memory_equal(a.contact_image, b.contact_image, 3 * c * sizeof(int));
  assert_memory_equal(a.contact_shear, b.contact_shear, 3 * c * d);
  rve_packing_destroy(&b);
  assert_int_equal(rve_packing_read(name, 3, &b), BASE_ERROR_FORMAT);
  assert_non_null(strstr(base_error_message(), "of dimension 2; need dimension 3"));
  unlink(name);
  rve_packing_destroy(&a);
}

/* The bytes of the own form of a fixture; free with free(). */
static char *own_form(size_t *size) {
  RvePacking packing = read_fixture("layer.restart", 2, 1e6);
  char name[] = "packing_read_XXXXXX";
  const int file = mkstemp(name);
  assert_true(file >= 0);
  close(file);
  MUST(rve_packing_write(name, &packing));
  rve_packing_destroy(&packing);
  FILE *written = fopen(name, "rb");
  assert_non_null(written);
  char *bytes = malloc(1 << 20);
  assert_non_null(bytes);
  *size = fread(bytes, 1, 1 << 20, written);
  fclose(written);
  unlink(name);
  return bytes;
}

static void any_altered_byte_of_the_own_form_is_found(void **state) {
  (void)state;
  size_t size;
  char *bytes = own_form(&size);
  RvePacking packing;
  MUST(read_copy(bytes, size, 2, &packing));
  rve_packing_destroy(&packing);
  for (size_t at = 0; at < size; at++) {
    bytes[at] ^= (char)(1 << at % 8);
    if (read_copy(bytes, size, 2, &packing) == BASE_OK) fail_msg("byte %zu", at);
    bytes[at] ^= (char)(1 << at % 8);
  }
  free(bytes);
}

/* Cut at every byte. A data file whose last section, Velocities, is missing as a whole is still complete without it. */
static void truncated_files_are_refused(void **state) {
  (void)state;
  for (int f = 0; f <= FIXTURES; f++) {
    size_t size, accepted = 0, all = 0;
    const int own = f == FIXTURES, dimension = own ? 2 : fixtures[f].dimension;
    const int data = !own && strstr(fixtures[f].name, ".data") != NULL;
    char *bytes = own ? own_form(&size) : load_fixture(fixtures[f].name, &size);
    const size_t stride = size > 12000 ? 3 : 1;
    for (size_t cut = 0; cut < size; cut += stride, all++) {
      RvePacking packing;
      if (read_copy(bytes, cut, dimension, &packing) != BASE_OK) {
        assert_true(strlen(base_error_message()) > 0);
        assert_null(packing.position);
        continue;
      }
      accepted++;
      rve_packing_destroy(&packing);
    }
    if (accepted > (data ? sizeof "\nVelocities" : 0))
      fail_msg("%s: %zu of %zu cuts accepted", own ? "own form" : fixtures[f].name, accepted, all);
    free(bytes);
  }
}

static void mutated_files_never_crash(void **state) {
  (void)state;
  fuzz_readers(300, 11); /* tests/fuzz/fuzz_packing runs more of them */
}

static void last_complete_frame_of_a_dump_counts(void **state) {
  (void)state;
  size_t size;
  char *frame = load_fixture("layer.dump", &size), *bytes = malloc(3 * size);
  assert_non_null(bytes);
  RvePacking first, last;
  memcpy(bytes, frame, size);
  memcpy(bytes + size, frame, size);
  memcpy(bytes + 2 * size, frame, size);
  char *bound = strstr(bytes + size, "pp pp pp\n"); /* the second frame's lower x moves */
  assert_non_null(bound);
  double low;
  assert_int_equal(sscanf(bound + 9, "%lg", &low), 1);
  bound[9] = '-';
  MUST(read_copy(bytes, size, 2, &first));
  assert_int_equal(read_copy(bytes, 2 * size, 2, &last), BASE_OK);
  assert_true(last.cell[0] > first.cell[0]);
  rve_packing_destroy(&last);
  MUST(read_copy(bytes, 3 * size, 2, &last));
  assert_memory_equal(last.cell, first.cell, sizeof first.cell);
  rve_packing_destroy(&last);
  MUST(read_copy(bytes, 3 * size - 1, 2, &last)); /* the third is cut: the second counts */
  assert_true(last.cell[0] > first.cell[0]);
  rve_packing_destroy(&last);
  rve_packing_destroy(&first);
  free(bytes);
  free(frame);
}

/* One tilted box in three forms: lattice vectors (4,0), (1,3) for two grains a quarter of each apart. */
static void tilted_boxes_keep_distances(void **state) {
  (void)state;
  static const char *const form[] = {
      "title\n\n2 atoms\n1 atom types\n10 14 xlo xhi\n20 23 ylo yhi\n-1 1 zlo zhi\n1.0 0 0 xy xz yz\n\nAtoms # "
      "granular\n\n"
      "2 1 0.5 2650 12.25 21.5 0\n1 1 1.0 2650 11 20.75 0\n\nVelocities\n\n1 1 0 0 0 0 5\n2 1 0 0 0 0 0\n",
      "ITEM: TIMESTEP\n0\nITEM: NUMBER OF ATOMS\n2\nITEM: BOX BOUNDS xy xz yz pp pp ff\n10 15 1\n20 23 0\n-1 1 0\n"
      "ITEM: ATOMS id x y radius\n2 12.25 21.5 0.25\n1 11 20.75 0.5\n",
      "ITEM: TIMESTEP\n0\nITEM: NUMBER OF ATOMS\n2\nITEM: BOX BOUNDS xy xz yz pp pp ff\n10 15 1\n20 23 0\n-1 1 0\n"
      "ITEM: ATOMS id xs ys diameter\n2 0.4375 0.5 0.5\n1 0.1875 0.25 1\n",
      "title\n\n2 atoms\n10 14 xlo xhi\n20 23 ylo yhi\n-1 1 zlo zhi\n1.0 0 0 xy xz yz\n\nAtoms # hybrid granular "
      "bond\n\n"
      "2 1 12.25 21.5 0 0.5 2650 7 7\n1 1 11 20.75 0 1.0 2650 7 7\n"};
  for (int k = 0; k < 4; k++) {
    RvePacking packing;
    MUST(read_copy(form[k], strlen(form[k]), 2, &packing));
    const double *h = packing.cell, *s = packing.position;
    assert_true(h[0] == 4.0 && h[1] == 1.0 && h[3] == 0.0 && h[4] == 3.0);
    assert_true(packing.radius[0] == 0.5 && packing.radius[1] == 0.25);
    const double a = s[3] - s[0], b = s[4] - s[1];
    assert_true(fabs(h[0] * a + h[1] * b - 1.25) < 1e-15 && fabs(h[4] * b - 0.75) < 1e-15);
    if (k == 0) { /* the common drift is taken away, the spin stays */
      assert_true(packing.velocity[0] == 0.0 && packing.velocity[3] == 0.0);
      assert_true(packing.spin[2] == 5.0);
    } else assert_null(packing.velocity);
    rve_packing_destroy(&packing);
  }
}

/* ------------------------------------------------------------------------------------------------- wrong files */

typedef struct Wrong {
  const char *text, *message; /* what the message must hold */
  int dimension;
} Wrong;

#define HEAD "title\n\n2 atoms\n1 atom types\n0 4 xlo xhi\n0 4 ylo yhi\n-1 1 zlo zhi\n\n"
#define FRAME(flags) "ITEM: TIMESTEP\n0\nITEM: NUMBER OF ATOMS\n2\nITEM: BOX BOUNDS " flags "\n0 4\n0 4\n-1 1\n"
#define GRAINS "ITEM: ATOMS id x y radius\n1 1 1 0.5\n2 3 3 0.5\n"

static const Wrong wrong[] = {
    {"hello\n", "no section 'Atoms' found: this is neither a LIGGGHTS data file, text dump or binary restart", 2},
    {"\x1f\x8b\x08 zipped", "compressed; unpack it with gunzip", 2},
    {"title\n\nAtoms\n\n1 1 1 1 1 1 1\n", "line 3: found no line 'N atoms' in the header", 2},
    {"title\n0 atoms\n", "line 2: found '0'; need the number of atoms, at least 1", 2},
    {"title\n99999999999 atoms\nAtoms\n\n1 1 1 1 1 1 1\n",
     "line 3: the header says 99999999999 atoms, the file is too short", 2},
    {HEAD "Atoms\n\n1 1 1 2650 1 1 0\n", "ends in line 11, inside grain 2 of 2 of the section Atoms", 2},
    {HEAD "Atoms\n\n1 1 1 2650 1 1 0\n2 1 1 2650 3 3 0", "ends in line 12, inside grain 2 of 2 of the section Atoms",
     2},
    {HEAD "Atoms\n\n1 1 1 1 0\n2 1 1 1 0\n", "line 11: found another number of columns at '1'; need 7 or 10 columns",
     2},
    {HEAD "Atoms # molecular\n\n1 1 1 1 0\n2 1 1 1 0\n",
     "line 9: found atom style 'molecular'; need granular or sphere", 2},
    {HEAD "Atoms\n\n1 1 1 2650 1 1 0\n1 1 1 2650 3 3 0\n", "the id 1 is there twice", 2},
    {HEAD "Atoms\n\n1 1 1 2650 1 1 0\n2 1 1 2650 nan 3 0\n", "line 12: found 'nan', need a finite number (x y z)", 2},
    {HEAD "Atoms\n\n1 1 1 2650 1 1 0\n2 1 1 2650 1e999 3 0\n", "line 12: found '1e999', need a finite number (x y z)",
     2},
    {HEAD "Atoms\n\n1 1 0 2650 1 1 0\n2 1 1 2650 3 3 0\n", "line 11: found diameter '0'; need a diameter above 0", 2},
    {HEAD "Atoms\n\n1 1 1 2650 1 1 0\n2 1 1 2650 1.5 1 0\n", "grains 1 and 2 (radii 0.5 and 0.5 m) overlap by 0.5 m",
     2},
    {HEAD "Atoms\n\n1 1 1 2650 1 1 -0.5\n2 1 1 2650 3 3 0.4\n", "grains are not in one layer", 2},
    {HEAD "Velocities\n\n1 0 0 0\n", "line 9: found the section Velocities; need the section Atoms before it", 2},
    {HEAD "Atoms\n\n1 1 1 2650 1 1 0\n2 1 1 2650 3 3 0\n\nVelocities\n\n1 0 0 0\n7 0 0 0\n",
     "line 17: found '7'; need the id", 2},
    {"title\n1 atoms\n0 4 xlo xhi\n0 4 ylo yhi\n\nAtoms\n\n1 1 1 2650 1 1 0\n", "no line 'zlo zhi' in the header", 2},
    {"title\n1 atoms\n4 0 xlo xhi\n0 4 ylo yhi\n0 1 zlo zhi\nAtoms\n\n1 1 1 2650 1 1 0\n",
     "the box goes from 4 to 0 along x", 2},
    {"title\n1 atoms\n0 4 xlo xhi\n0 4 ylo yhi\n0 0 zlo zhi\nAtoms\n\n1 1 1 2650 1 1 0\n",
     "the box goes from 0 to 0 along z", 3},
    {"title\n1 atoms\n0 4 xlo xhi\n0 4 ylo yhi\n0 1 zlo zhi\ninf 0 0 xy xz yz\nAtoms\n\n1 1 1 2650 1 1 0\n",
     "need a finite number (tilt", 3},
    {FRAME("pp ff pp") GRAINS, "line 5: found 'ff' as boundary along y; need pp: a packing is periodic", 2},
    {FRAME("pp pp") GRAINS, "line 5: found 'nothing' as boundary along z", 3},
    {FRAME("") GRAINS, "line 5: found 'nothing' as boundary along x", 2},
    {FRAME("pp pp ff") "ITEM: ATOMS id x y z radius\n1 1 1 0 0.5\n2 3 3 0 0.5\n", "found 'ff' as boundary along z", 3},
    {FRAME("pp pp pp") "ITEM: ATOMS id x y\n1 1 1\n2 3 3\n",
     "line 9: found no column radius; need radius (or diameter)", 2},
    {FRAME("pp pp pp") "ITEM: ATOMS id x radius\n1 1 0.5\n2 3 0.5\n", "line 9: found no position columns; need x y", 2},
    {FRAME("pp pp pp") GRAINS "3 1 3 0.5", "", 2}, /* what follows a complete frame does not matter */
    {FRAME("pp pp pp") "ITEM: ATOMS id x y radius\n1 1 1 0.5\n2 3 3\n", "line 11: found another number of columns", 2},
    {FRAME("pp pp pp") "ITEM: ATOMS id x y radius\n1 1 1 0.5\n2 3 nan 0.5\n",
     "line 11: found 'nan', need a finite number (y)", 2},
    {FRAME("pp pp pp") "ITEM: ATOMS id x y radius\n1 1 1 0.5\n2 3 3 -1\n",
     "line 11: found a radius that is not positive", 2},
    {FRAME("pp pp pp") "ITEM: ATOMS id x y radius\n1 1 1 0.5\n",
     "ends in line 10, inside a frame, and no frame before it", 2},
    {"ITEM: TIMESTEP\n0\nITEM: NUMBER OF ATOMS\n0\n", "line 4: found a frame without atoms; need at least 1 grain", 2},
    {"ITEM: NUMBER OF ATOMS\n2\n", "no line 'ITEM: TIMESTEP' found", 2},
    {"ITEM: TIMESTEP\n0\nITEM: ATOMS id x y radius\n1 1 1 1\n", "line 3: found ITEM: ATOMS; need ITEM: NUMBER OF ATOMS",
     2},
    {"dempm packing 7\n", "written in another version of the form; this dempm reads version 1", 2},
    {"dempm packing 1\nchecksum 0000000000000000\ndimension 2\n", "the checksum does not fit: truncated or altered", 2},
};

static void wrong_files_are_refused_with_place_and_reason(void **state) {
  (void)state;
  for (size_t k = 0; k < sizeof wrong / sizeof *wrong; k++) {
    RvePacking packing;
    const BaseStatus status = read_copy(wrong[k].text, strlen(wrong[k].text), wrong[k].dimension, &packing);
    if (*wrong[k].message == '\0') {
      assert_int_equal(status, BASE_OK);
      rve_packing_destroy(&packing);
      continue;
    }
    if (status == BASE_OK) fail_msg("accepted: %s", wrong[k].text);
    if (!strstr(base_error_message(), wrong[k].message) || !strstr(base_error_message(), "packing file mutated"))
      fail_msg("message '%s' lacks '%s'", base_error_message(), wrong[k].message);
  }
}

/* Replaces `old` by `now` of the same size, once, in a restart; the message must hold `words`. */
static void refuse_patched(const void *old, const void *now, size_t length, const char *words) {
  size_t size, at = 0;
  char *bytes = load_fixture("layer.restart", &size);
  while (at + length <= size && memcmp(bytes + at, old, length) != 0) at++;
  assert_true(at + length <= size);
  memcpy(bytes + at, now, length);
  RvePacking packing;
  assert_int_equal(read_copy(bytes, size, 2, &packing), BASE_ERROR_FORMAT);
  if (!strstr(base_error_message(), words)) fail_msg("message '%s' lacks '%s'", base_error_message(), words);
  free(bytes);
}

static void wrong_restarts_are_refused(void **state) {
  (void)state;
  const int32_t y_periodic[] = {14, 1, 15, 1}, y_fixed[] = {14, 0, 15, 1}; /* flag and value, flag and value */
  const int32_t forty[] = {23, 40, 0}, none[] = {23, 0, 0}, more[] = {23, 41, 0}, fewer[] = {23, 39, 0};
  const int32_t types[] = {24, 1, 25}, odd[] = {24, -1, 25}, unknown[] = {99, 1, 25};
  refuse_patched(y_periodic, y_fixed, sizeof y_fixed, "the boundary along y is not periodic; need 'boundary p p p'");
  refuse_patched(forty, none, sizeof none, "no grains; at least 1 is needed");
  refuse_patched(forty, more, sizeof more, "40 atom records, the header says 41");
  refuse_patched(forty, fewer, sizeof fewer, "an atom record of wrong length, or one too many");
  refuse_patched(types, odd, sizeof odd, "atom types outside 1 .. 1000000");
  refuse_patched(types, unknown, sizeof unknown, "an unknown flag in the header");
  refuse_patched("\3\0\0\0si", "\3\0\0\0lj", 7, "units are 'lj'; need si");
  refuse_patched("granular", "dielectr", 8, "atom style is 'dielectr'; need granular");
  refuse_patched("gran", "lj/c", 5, "force style 'lj/c' cannot be stepped over; need pair_style gran or none");
}

static void files_that_are_none_are_refused(void **state) {
  (void)state;
  RvePacking packing;
  assert_int_equal(rve_packing_read("no such file", 2, &packing), BASE_ERROR_FILE);
  assert_non_null(strstr(base_error_message(), "cannot open packing file no such file: No such file"));
  assert_int_equal(rve_packing_read("/", 2, &packing), BASE_ERROR_FILE);
  assert_non_null(strstr(base_error_message(), "is not a regular file"));
  assert_int_equal(rve_packing_read("/dev/zero", 2, &packing), BASE_ERROR_FILE);
  assert_int_equal(rve_packing_read("/dev/null", 2, &packing), BASE_ERROR_FILE);
  const PackingFile file = {.name = "x", .bytes = "x", .size = 1};
  assert_int_equal(packing_read_bytes(&file, 4, 0.0, &packing), BASE_ERROR_ARGUMENT);
  RvePacking good = read_fixture("layer.data", 2, 0.0);
  assert_int_equal(rve_packing_write("no such directory/packing", &good), BASE_ERROR_FILE);
  assert_non_null(strstr(base_error_message(), "no such directory/packing"));
  rve_packing_destroy(&good);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(data_file_gives_its_grains_sorted_by_id),
      cmocka_unit_test(restart_gives_what_the_data_file_gives),
      cmocka_unit_test(dump_gives_what_the_data_file_gives),
      cmocka_unit_test(history_of_a_restart_balances_the_grains),
      cmocka_unit_test(restart_of_two_processes_is_read),
      cmocka_unit_test(own_form_gives_every_bit_back),
      cmocka_unit_test(any_altered_byte_of_the_own_form_is_found),
      cmocka_unit_test(truncated_files_are_refused),
      cmocka_unit_test(mutated_files_never_crash),
      cmocka_unit_test(last_complete_frame_of_a_dump_counts),
      cmocka_unit_test(tilted_boxes_keep_distances),
      cmocka_unit_test(wrong_files_are_refused_with_place_and_reason),
      cmocka_unit_test(wrong_restarts_are_refused),
      cmocka_unit_test(files_that_are_none_are_refused),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
