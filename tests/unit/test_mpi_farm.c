/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The RVE farm: whatever the ranks, the ownership of points and the history of RVEs coming and going, answers are
 * those of one serial RveBatch, bit for bit. */
#include "mpi_test.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "../../src/fix_mpm_couple/rank_threads.h"
#include "../../src/fix_mpm_couple/rve_farm.h"
#include "../../src/fix_mpm_couple/rve_law.h"

enum { TAGS = 28, PACKINGS = 3, ANSWER = 14 + MPM_LAW_SCALARS };
static const double time_step = 2e-5; /* s, of the points; some 10 DEM steps */

static RvePacking packing[PACKINGS];

static RveScene make_scene(void) {
  RveScene scene = rve_scene_default();
  scene.dimension = 2;
  scene.grain = RVE_DISK;
  scene.thickness = 0.075;
  scene.density = 2650;
  scene.normal_stiffness = 1e6;
  scene.tangential_stiffness = 5e5;
  scene.friction = 0.3;
  scene.local_damping = 0.2;
  scene.thermal = 1;
  scene.expansion = 1e-5;
  scene.reference_temperature = 0;
  scene.pipe_resistance = 1e3;
  scene.threads = 1;
  return scene;
}

/* n x n disks on a square lattice, overlapping by 1 %, each shaken by up to 0.5 % of a diameter: not in equilibrium. */
static BaseStatus make_crystal(int n, RvePacking *crystal) {
  const double radius = 4e-3, spacing = 2 * radius * 0.99;
  uint64_t state = (uint64_t)n;
  *crystal = (RvePacking){.dimension = 2, .grains = n * n, .cell = {n * spacing, 0, 0, 0, n * spacing, 0, 0, 0, 1}};
  TRY(BASE_ALLOC(3 * (size_t)(n * n), &crystal->position));
  TRY(BASE_ALLOC((size_t)(n * n), &crystal->radius));
  for (int g = 0; g < n * n; g++) {
    crystal->radius[g] = radius;
    crystal->position[3 * g] = (g % n + 0.5 + 0.01 * (base_random(&state) - 0.5)) / n - 0.5;
    crystal->position[3 * g + 1] = ((double)(g / n) + 0.5 + 0.01 * (base_random(&state) - 0.5)) / n - 0.5;
  }
  return BASE_OK;
}

static int make_packings(void **state) {
  (void)state;
  for (int k = 0; k < PACKINGS; k++)
    if (make_crystal(2 + k, &packing[k]) != BASE_OK) return -1;
  return 0;
}

static int free_packings(void **state) {
  (void)state;
  for (int k = 0; k < PACKINGS; k++) rve_packing_destroy(&packing[k]);
  return 0;
}

/* What point `tag` asks in step `step`: the same on every rank. */
static void make_input(int64_t tag, int step, RveInput *input) {
  uint64_t state = (uint64_t)tag * 1000 + (uint64_t)step;
  memset(input, 0, sizeof *input);
  for (int k = 0; k < 5; k++)
    if (k != 2) input->velocity_gradient[k] = 20 * (base_random(&state) - 0.5);
  input->temperature = 10 * base_random(&state);
}

/* -- the serial truth ------------------------------------------------------------------------------------------ */

typedef struct Truth {
  RveBatch *batch; /* RVE k belongs to tag k + 1 */
  RveAnswer last[TAGS];
} Truth;

static BaseStatus truth_create(const RveScene *scene, Truth *truth) {
  int packing_of_rve[TAGS];
  for (int k = 0; k < TAGS; k++) packing_of_rve[k] = k % PACKINGS;
  memset(truth, 0, sizeof *truth);
  return rve_batch_create(scene, packing, PACKINGS, packing_of_rve, TAGS, RVE_BACKEND_CPU, &truth->batch);
}

/* Steps the RVEs of alive tags; answers [TAGS][ANSWER] as the law reports them, rows of others untouched. */
static BaseStatus truth_step(Truth *truth, const int *alive, int step, double dt, double *answers) {
  RveInput input[TAGS];
  RveAnswer answer[TAGS];
  int index[TAGS], n = 0;
  for (int k = 0; k < TAGS; k++) {
    if (!alive[k]) continue;
    make_input(k + 1, step, &input[n]);
    index[n++] = k;
  }
  BaseStatus status = rve_batch_step(truth->batch, n, index, input, dt, answer);
  for (int i = 0; i < n; i++) {
    const RveAnswer *a = &answer[i], *before = &truth->last[index[i]];
    double *row = answers + ANSWER * index[i];
    memcpy(row, a->stress, sizeof a->stress);
    row[6] = a->heat;
    memcpy(row + 7, a->conductivity, sizeof a->conductivity);
    row[13] = a->modulus;
    row[14 + MPM_LAW_SOLID_FRACTION] = a->solid_fraction;
    row[14 + MPM_LAW_COORDINATION] = a->coordination;
    row[14 + MPM_LAW_BOND_FRACTION] = a->bond_fraction;
    row[14 + MPM_LAW_UNBALANCED] = a->unbalanced;
    row[14 + MPM_LAW_ENERGY_DENSITY] = (a->elastic_energy + a->kinetic_energy) / a->volume;
    if (dt > 0)
      row[14 + MPM_LAW_DISSIPATION] =
          ((a->friction_work - before->friction_work) + (a->damping_work - before->damping_work)) / (a->volume * dt);
    truth->last[index[i]] = *a;
  }
  return status;
}

/* -- the law under test ---------------------------------------------------------------------------------------- */

static double spoilt = NAN;

/* One update of the law over comm. Point `tag` is on a rank that changes with every step, points come in an order
 * that changes too. answers [TAGS][ANSWER] on all ranks, rows of points that are not alive untouched. spoil > 0: tags
 * from `spoil` on have the velocity gradient `spoilt` in one direction. */
static BaseStatus law_step(RveLaw *law, MPI_Comm comm, const int *alive, int step, double dt, int64_t spoil,
                           double *answers) {
  int64_t tag[TAGS];
  double gradient[TAGS * 9], identity[TAGS * 9] = {0}, temperature[TAGS], rate[TAGS] = {0};
  double stress[TAGS * 6] = {0}, heat[TAGS] = {0}, conductivity[TAGS * 6] = {0}, modulus[TAGS] = {0};
  double scalars[TAGS * MPM_LAW_SCALARS] = {0}, mine[TAGS * ANSWER] = {0}, all[TAGS * ANSWER];
  int rank, ranks, n = 0;
  MPI_Comm_rank(comm, &rank);
  MPI_Comm_size(comm, &ranks);
  for (int k = 0; k < TAGS; k++) {
    const int t = (k * 5 + step) % TAGS; /* 5 and TAGS have no common divisor */
    uint64_t state = (uint64_t)(t + 97 * step);
    RveInput input;
    if (!alive[t] || (int)(base_random(&state) * ranks) != rank) continue;
    make_input(t + 1, step, &input);
    if (spoil && t + 1 >= spoil) input.velocity_gradient[1] = spoilt;
    tag[n] = t + 1;
    temperature[n] = input.temperature;
    memcpy(gradient + 9 * n++, input.velocity_gradient, sizeof input.velocity_gradient);
  }
  MpmLawBatch batch = {n, dt, tag, gradient, identity, temperature, rate, stress, heat, conductivity, modulus, scalars};
  MpmLaw mpm_law;
  rve_law_as_mpm_law(law, &mpm_law);
  TRY(mpm_law.update(mpm_law.content, &batch));
  for (int p = 0; p < n; p++) {
    double *row = mine + ANSWER * (tag[p] - 1);
    memcpy(row, stress + 6 * p, 6 * sizeof *row);
    row[6] = heat[p];
    memcpy(row + 7, conductivity + 6 * p, 6 * sizeof *row);
    row[13] = modulus[p];
    memcpy(row + 14, scalars + MPM_LAW_SCALARS * p, MPM_LAW_SCALARS * sizeof *row);
  }
  /* Each row is zero on all ranks but one: the sum is exact. */
  MPI_Allreduce(mine, all, TAGS * ANSWER, MPI_DOUBLE, MPI_SUM, comm);
  for (int k = 0; k < TAGS; k++)
    if (alive[k]) memcpy(answers + ANSWER * k, all + ANSWER * k, ANSWER * sizeof *answers);
  return BASE_OK;
}

/* As numbers: a sum over ranks turns -0 into +0. NaN is never equal. */
static int same_answers(const double *a, const double *b, const int *alive) {
  for (int k = 0; k < TAGS; k++)
    for (int i = 0; i < ANSWER && alive[k]; i++)
      if (!(a[ANSWER * k + i] == b[ANSWER * k + i])) {
        fprintf(stderr, "tag %d, value %d: %.17g and %.17g\n", k + 1, i, a[ANSWER * k + i], b[ANSWER * k + i]);
        return 0;
      }
  return 1;
}

static void all_alive(int *alive) {
  for (int k = 0; k < TAGS; k++) alive[k] = 1;
}

static BaseStatus assign_alive(RveLaw *law, const int *alive) {
  int64_t tag[TAGS];
  int n = 0;
  for (int k = 0; k < TAGS; k++)
    if (alive[k] && k % mpi_test_ranks() == mpi_test_rank()) tag[n++] = k + 1;
  return rve_law_assign(law, n, tag);
}

/* -- tests ----------------------------------------------------------------------------------------------------- */

static void answers_are_those_of_one_serial_batch_while_points_migrate(void **state) {
  (void)state;
  const RveScene scene = make_scene();
  static double expected[TAGS * ANSWER], found[TAGS * ANSWER];
  int alive[TAGS];
  Truth truth;
  RveLaw *law;
  RveScene threaded = scene;
  threaded.threads = 2;
  all_alive(alive);
  CHECK_ALL(truth_create(&scene, &truth) == BASE_OK);
  CHECK_ALL(rve_law_create(MPI_COMM_WORLD, &threaded, packing, PACKINGS, RVE_BACKEND_CPU, &law) == BASE_OK);
  CHECK_ALL(rve_law_threads(law) == 2 && assign_alive(law, alive) == BASE_OK);
  for (int step = 0; step < 10; step++) {
    const double dt = step % 4 == 0 ? 0.0 : time_step; /* 0: the present state is asked */
    CHECK_ALL(truth_step(&truth, alive, step, dt, expected) == BASE_OK);
    CHECK_ALL(law_step(law, MPI_COMM_WORLD, alive, step, dt, 0, found) == BASE_OK);
    CHECK_ALL(same_answers(expected, found, alive));
  }
  /* The packing is loaded and slides, or the comparison would be an empty one. */
  CHECK_ALL(expected[0] < 0 && expected[14 + MPM_LAW_DISSIPATION] > 0 && expected[13] > 0);
  rve_law_destroy(law);
  rve_batch_destroy(truth.batch);
}

static void new_tags_and_gone_tags_leave_the_others_alone(void **state) {
  (void)state;
  const RveScene scene = make_scene();
  static double expected[TAGS * ANSWER], found[TAGS * ANSWER];
  int alive[TAGS] = {0}, next = 4;
  Truth truth;
  RveLaw *law;
  RveLawTotals totals;
  CHECK_ALL(truth_create(&scene, &truth) == BASE_OK);
  CHECK_ALL(rve_law_create(MPI_COMM_WORLD, &scene, packing, PACKINGS, RVE_BACKEND_CPU, &law) == BASE_OK);
  for (int k = 0; k < next; k++) alive[k] = 1;
  /* One tag more per step, which nobody announces, often enough that batches must be merged; every third step one
   * goes. */
  for (int step = 0; next < TAGS; step++) {
    int living = 0;
    alive[next++] = 1;
    if (step % 3 == 2) {
      alive[step] = 0;
      CHECK_ALL(assign_alive(law, alive) == BASE_OK);
    }
    CHECK_ALL(truth_step(&truth, alive, step, time_step, expected) == BASE_OK);
    CHECK_ALL(law_step(law, MPI_COMM_WORLD, alive, step, time_step, 0, found) == BASE_OK);
    CHECK_ALL(same_answers(expected, found, alive));
    CHECK_ALL(rve_law_totals(law, &totals) == BASE_OK);
    for (int k = 0; k < TAGS; k++) living += alive[k];
    CHECK_ALL(totals.rves == living && totals.rves_run == living);
  }
  rve_law_destroy(law);
  rve_batch_destroy(truth.batch);
}

static void a_tag_that_comes_back_starts_from_its_packing(void **state) {
  (void)state;
  const RveScene scene = make_scene();
  static double first[TAGS * ANSWER], again[TAGS * ANSWER];
  int alive[TAGS];
  RveLaw *law;
  all_alive(alive);
  CHECK_ALL(rve_law_create(MPI_COMM_WORLD, &scene, packing, PACKINGS, RVE_BACKEND_CPU, &law) == BASE_OK);
  CHECK_ALL(law_step(law, MPI_COMM_WORLD, alive, 1, time_step, 0, first) == BASE_OK);
  CHECK_ALL(rve_law_assign(law, 0, NULL) == BASE_OK);
  CHECK_ALL(law_step(law, MPI_COMM_WORLD, alive, 1, time_step, 0, again) == BASE_OK);
  CHECK_ALL(same_answers(first, again, alive));
  rve_law_destroy(law);
}

/* A law over comm after `steps` steps with all tags alive; volumes told. */
static BaseStatus run_law(MPI_Comm comm, int steps, RveLaw **law, double *answers) {
  const RveScene scene = make_scene();
  int alive[TAGS], rank;
  int64_t tag[TAGS];
  double volume[TAGS];
  all_alive(alive);
  MPI_Comm_rank(comm, &rank);
  TRY(rve_law_create(comm, &scene, packing, PACKINGS, RVE_BACKEND_CPU, law));
  for (int k = 0; k < TAGS; k++) tag[k] = k + 1, volume[k] = 1e-4 * (k + 1);
  /* All points on one rank. In two portions, so that ranks hold tags of both and not one range of tags each. */
  TRY(rve_law_assign(*law, rank == 0 ? TAGS / 2 : 0, tag + TAGS - TAGS / 2));
  TRY(rve_law_assign(*law, rank == 0 ? TAGS : 0, tag));
  TRY(rve_law_set_volumes(*law, rank == 0 ? TAGS : 0, tag, volume));
  for (int step = 0; step < steps; step++) TRY(law_step(*law, comm, alive, step, time_step, 0, answers));
  return BASE_OK;
}

/* The record on all ranks of MPI_COMM_WORLD; law is over MPI_COMM_WORLD. */
static BaseStatus pack_for_all(RveLaw *law, char **bytes, size_t *size) {
  void *record;
  uint64_t total;
  TRY(rve_law_pack(law, &record, size));
  total = *size;
  MPI_Bcast(&total, 1, MPI_UINT64_T, 0, MPI_COMM_WORLD);
  *size = (size_t)total;
  TRY(BASE_ALLOC(*size, bytes));
  if (record) memcpy(*bytes, record, *size);
  base_free(record);
  MPI_Bcast(*bytes, (int)*size, MPI_BYTE, 0, MPI_COMM_WORLD);
  return BASE_OK;
}

static void a_restart_on_other_ranks_continues_bit_for_bit(void **state) {
  (void)state;
  const RveScene scene = make_scene();
  static double straight[TAGS * ANSWER], resumed[TAGS * ANSWER];
  int alive[TAGS];
  char *bytes;
  size_t size;
  RveLaw *law, *second;
  MPI_Comm half;
  all_alive(alive);
  CHECK_ALL(run_law(MPI_COMM_WORLD, 5, &law, straight) == BASE_OK);
  CHECK_ALL(pack_for_all(law, &bytes, &size) == BASE_OK);

  /* The ranks fall into two groups (of 2 + 2, 2 + 1, 1 + 1, 1 ranks), each continues the whole of it. */
  MPI_Comm_split(MPI_COMM_WORLD, mpi_test_rank() < (mpi_test_ranks() + 1) / 2, 0, &half);
  CHECK_ALL(rve_law_create(half, &scene, packing, PACKINGS, RVE_BACKEND_CPU, &second) == BASE_OK);
  CHECK_ALL(rve_law_unpack(second, bytes, size) == BASE_OK);
  CHECK_ALL(law_step(second, half, alive, 5, 0.0, 0, resumed) == BASE_OK);
  int good = 1; /* dt = 0: heat is per step and not asked here */
  for (int k = 0; k < TAGS; k++) good = good && memcmp(straight + ANSWER * k, resumed + ANSWER * k, 48) == 0;
  CHECK_ALL(good);
  for (int step = 5; step < 10; step++) {
    CHECK_ALL(law_step(law, MPI_COMM_WORLD, alive, step, time_step, 0, straight) == BASE_OK);
    CHECK_ALL(law_step(second, half, alive, step, time_step, 0, resumed) == BASE_OK);
    CHECK_ALL(same_answers(straight, resumed, alive));
  }
  RveLawTotals a, b;
  CHECK_ALL(rve_law_totals(law, &a) == BASE_OK && rve_law_totals(second, &b) == BASE_OK);
  CHECK_ALL(a.friction_work > 0 && a.friction_work == b.friction_work && a.damping_work == b.damping_work &&
            a.stored_energy == b.stored_energy && a.worst_unbalanced == b.worst_unbalanced && a.grains == b.grains);
  CHECK_ALL(b.particle_steps > 0 && b.particle_steps < a.particle_steps);
  rve_law_destroy(second);
  rve_law_destroy(law);
  MPI_Comm_free(&half);
  base_free(bytes);
}

static void record_and_totals_do_not_depend_on_the_number_of_ranks(void **state) {
  (void)state;
  static double answers[TAGS * ANSWER];
  char *bytes;
  void *alone;
  size_t size, size_alone;
  RveLaw *law, *serial;
  RveLawTotals a, b;
  CHECK_ALL(run_law(MPI_COMM_WORLD, 6, &law, answers) == BASE_OK);
  CHECK_ALL(run_law(MPI_COMM_SELF, 6, &serial, answers) == BASE_OK);
  CHECK_ALL(pack_for_all(law, &bytes, &size) == BASE_OK);
  CHECK_ALL(rve_law_pack(serial, &alone, &size_alone) == BASE_OK);
  CHECK_ALL(size == size_alone && memcmp(bytes, alone, size) == 0);
  CHECK_ALL(rve_law_totals(law, &a) == BASE_OK && rve_law_totals(serial, &b) == BASE_OK);
  a.seconds = b.seconds = 0;
  CHECK_ALL(a.shared >= 0 && a.shared < a.calls && b.shared >= a.shared); /* twins can only be shared where they live */
  a.shared = b.shared;
  CHECK_ALL(a.friction_work > 0 && a.damping_work > 0 && a.stored_energy > 0 && a.rves == TAGS);
  CHECK_ALL(memcmp(&a, &b, sizeof a) == 0);
  rve_law_destroy(law);
  rve_law_destroy(serial);
  base_free(bytes);
  base_free(alone);
}

/* Refused on all ranks with one message that contains `text`; the law goes on as if nothing had happened. */
static int is_refused(RveLaw *law, const void *bytes, size_t size, const char *text) {
  BaseStatus status = rve_law_unpack(law, bytes, size);
  const char *message = base_error_message();
  if (status != BASE_ERROR_FORMAT || !strstr(message, text)) {
    fprintf(stderr, "status %d, message \"%s\"\n", status, message);
    return 0;
  }
  return 1;
}

static void altered_truncated_and_foreign_records_are_refused_on_all_ranks(void **state) {
  (void)state;
  static double straight[TAGS * ANSWER], resumed[TAGS * ANSWER];
  int alive[TAGS];
  char *bytes;
  size_t size;
  RveLaw *law, *other;
  all_alive(alive);
  CHECK_ALL(run_law(MPI_COMM_WORLD, 2, &law, straight) == BASE_OK);
  CHECK_ALL(pack_for_all(law, &bytes, &size) == BASE_OK);
  CHECK_ALL(is_refused(law, bytes, size - 1, "truncated"));
  CHECK_ALL(is_refused(law, bytes, 10, "truncated"));
  CHECK_ALL(is_refused(law, NULL, 0, "truncated"));
  for (size_t at = 0; at < size; at += size / 7) {
    bytes[at] ^= 4;
    CHECK_ALL(is_refused(law, bytes, size, ""));
    bytes[at] ^= 4;
  }
  bytes[size / 2] ^= 1;
  CHECK_ALL(is_refused(law, bytes, size, "altered"));
  bytes[size / 2] ^= 1;
  /* Bad on the last rank only. */
  const int last = mpi_test_rank() == mpi_test_ranks() - 1;
  CHECK_ALL(is_refused(law, bytes, last ? size - 8 : size, "truncated"));

  RveScene scene = make_scene();
  CHECK_ALL(rve_law_create(MPI_COMM_WORLD, &scene, packing + 1, PACKINGS - 1, RVE_BACKEND_CPU, &other) == BASE_OK);
  CHECK_ALL(is_refused(other, bytes, size, "packings"));
  rve_law_destroy(other);
  scene.thermal = 0;
  CHECK_ALL(rve_law_create(MPI_COMM_WORLD, &scene, packing, PACKINGS, RVE_BACKEND_CPU, &other) == BASE_OK);
  CHECK_ALL(is_refused(other, bytes, size, "thermal"));
  rve_law_destroy(other);

  /* After all that the law still takes the good record, and it is what the law holds anyway. */
  CHECK_ALL(law_step(law, MPI_COMM_WORLD, alive, 2, time_step, 0, straight) == BASE_OK);
  CHECK_ALL(rve_law_unpack(law, bytes, size) == BASE_OK);
  CHECK_ALL(law_step(law, MPI_COMM_WORLD, alive, 2, time_step, 0, resumed) == BASE_OK);
  CHECK_ALL(same_answers(straight, resumed, alive));
  rve_law_destroy(law);
  base_free(bytes);
}

static void different_records_on_different_ranks_are_refused(void **state) {
  (void)state;
  static double answers[TAGS * ANSWER];
  char *old, *new;
  size_t old_size, new_size;
  int alive[TAGS];
  RveLaw *law;
  all_alive(alive);
  CHECK_ALL(run_law(MPI_COMM_WORLD, 1, &law, answers) == BASE_OK);
  CHECK_ALL(pack_for_all(law, &old, &old_size) == BASE_OK);
  CHECK_ALL(law_step(law, MPI_COMM_WORLD, alive, 1, time_step, 0, answers) == BASE_OK);
  CHECK_ALL(pack_for_all(law, &new, &new_size) == BASE_OK);
  const int odd = mpi_test_rank() % 2;
  if (mpi_test_ranks() > 1) CHECK_ALL(is_refused(law, odd ? old : new, odd ? old_size : new_size, "different records"));
  CHECK_ALL(rve_law_unpack(law, old, old_size) == BASE_OK);
  rve_law_destroy(law);
  base_free(old);
  base_free(new);
}

static void an_unstable_rve_is_reported_alike_on_all_ranks(void **state) {
  (void)state;
  static double answers[TAGS * ANSWER];
  int alive[TAGS];
  RveLaw *law;
  all_alive(alive);
  for (int64_t spoil = 1; spoil <= TAGS; spoil += 9) {
    char text[64];
    CHECK_ALL(run_law(MPI_COMM_WORLD, 1, &law, answers) == BASE_OK);
    /* Once the input is bad, once it is only far too large: the RVE itself gives up. */
    spoilt = spoil % 2 ? NAN : 1e12;
    CHECK_ALL(law_step(law, MPI_COMM_WORLD, alive, 1, time_step, spoil, answers) == BASE_ERROR_UNSTABLE);
    const char *what = spoil % 2 ? ": its velocity gradient" : " is unstable";
    snprintf(text, sizeof text, "material point %d%s", (int)spoil, what);
    CHECK_ALL(strstr(base_error_message(), text) != NULL);
    CHECK_ALL(mpi_test_same(base_hash(base_error_message(), strlen(base_error_message()), BASE_HASH_SEED)));
    rve_law_destroy(law);
  }
}

static void wrong_tags_and_volumes_are_refused_on_all_ranks(void **state) {
  (void)state;
  static double answers[TAGS * ANSWER];
  const int last = mpi_test_rank() == mpi_test_ranks() - 1;
  const int64_t zero = 0, twice[2] = {5, 5};
  const double volume = -1;
  int alive[TAGS];
  RveLaw *law;
  RveView view;
  all_alive(alive);
  CHECK_ALL(run_law(MPI_COMM_WORLD, 1, &law, answers) == BASE_OK);
  CHECK_ALL(rve_law_assign(law, last, &zero) == BASE_ERROR_ARGUMENT);
  CHECK_ALL(strstr(base_error_message(), "tag 0") != NULL);
  CHECK_ALL(rve_law_assign(law, last ? 2 : 0, twice) == BASE_ERROR_ARGUMENT);
  CHECK_ALL(strstr(base_error_message(), "two material points have the tag 5") != NULL);
  CHECK_ALL(rve_law_set_volumes(law, last, twice, &volume) == BASE_ERROR_ARGUMENT);
  CHECK_ALL(strstr(base_error_message(), "material point 5 has the volume -1") != NULL);
  CHECK_ALL(rve_law_set_volumes(law, last ? 2 : 0, twice, (double[2]){1, 1}) == BASE_ERROR_ARGUMENT);
  CHECK_ALL(rve_law_view(law, TAGS + 1, &view) == BASE_ERROR_ARGUMENT);
  CHECK_ALL(law_step(law, MPI_COMM_WORLD, alive, 1, time_step, 0, answers) == BASE_OK); /* nothing was harmed */
  rve_law_destroy(law);
}

static void bad_scenes_and_packings_are_refused_on_all_ranks(void **state) {
  (void)state;
  RveScene scene = make_scene();
  RveLaw *law;
  CHECK_ALL(rve_law_create(MPI_COMM_WORLD, &scene, packing, 0, RVE_BACKEND_CPU, &law) == BASE_ERROR_ARGUMENT && !law);
  scene.dimension = 5;
  CHECK_ALL(rve_law_create(MPI_COMM_WORLD, &scene, packing, 1, RVE_BACKEND_CPU, &law) == BASE_ERROR_ARGUMENT && !law);
}

static void a_view_reaches_rank_0_from_any_owner(void **state) {
  (void)state;
  static double answers[TAGS * ANSWER];
  int alive[TAGS];
  RveLaw *law;
  Truth truth;
  const RveScene scene = make_scene();
  all_alive(alive);
  CHECK_ALL(truth_create(&scene, &truth) == BASE_OK);
  CHECK_ALL(run_law(MPI_COMM_WORLD, 2, &law, answers) == BASE_OK);
  CHECK_ALL(truth_step(&truth, alive, 0, time_step, answers) == BASE_OK);
  CHECK_ALL(truth_step(&truth, alive, 1, time_step, answers) == BASE_OK);
  for (int64_t tag = 1; tag <= TAGS; tag += 5) {
    RveView found, expected;
    int good = 1;
    memset(&found, 0, sizeof found);
    CHECK_ALL(rve_law_view(law, tag, &found) == BASE_OK);
    if (mpi_test_rank() == 0) {
      const size_t real = sizeof(double);
      good = rve_batch_view(truth.batch, (int)tag - 1, &expected) == BASE_OK;
      const size_t g = (size_t)expected.grains, c = (size_t)expected.contacts;
      good = good && found.grains == expected.grains && found.contacts == expected.contacts && c > 0;
      good = good && memcmp(found.cell, expected.cell, sizeof found.cell) == 0;
      good = good && memcmp(found.position, expected.position, 3 * g * real) == 0;
      good = good && memcmp(found.radius, expected.radius, g * real) == 0;
      good = good && memcmp(found.velocity, expected.velocity, 3 * g * real) == 0;
      good = good && memcmp(found.spin, expected.spin, 3 * g * real) == 0;
      good = good && memcmp(found.pair, expected.pair, 2 * c * sizeof(int)) == 0;
      good = good && memcmp(found.image, expected.image, 3 * c * sizeof(int)) == 0;
      good = good && memcmp(found.branch, expected.branch, 3 * c * real) == 0;
      good = good && memcmp(found.force_normal, expected.force_normal, c * real) == 0;
      good = good && memcmp(found.force_shear, expected.force_shear, 3 * c * real) == 0;
      good = good && memcmp(found.bond, expected.bond, c * sizeof(int)) == 0;
      rve_view_destroy(&expected);
      rve_view_destroy(&found);
    }
    CHECK_ALL(good);
  }
  rve_law_destroy(law);
  rve_batch_destroy(truth.batch);
}

static int tags_are_shared_evenly(const RveFarm *farm, int most_apart) {
  const int64_t *tags;
  int *handles, least, most;
  const int own = rve_farm_own(farm, &tags, &handles);
  MPI_Allreduce(&own, &least, 1, MPI_INT, MPI_MIN, MPI_COMM_WORLD);
  MPI_Allreduce(&own, &most, 1, MPI_INT, MPI_MAX, MPI_COMM_WORLD);
  return most - least <= most_apart;
}

static void rves_are_spread_evenly_and_stay_where_they_are(void **state) {
  (void)state;
  enum { MOST = 101 };
  int64_t tag[2 * MOST];
  int owner[2 * MOST];
  RveFarm *farm;
  CHECK_ALL(rve_farm_create(MPI_COMM_WORLD, &farm) == BASE_OK);
  /* All points on the last rank, tags with gaps, in falling order; then twice as many. */
  for (int n = 1; n <= MOST; n += 10) {
    const int mine = mpi_test_rank() == mpi_test_ranks() - 1 ? 2 * n : 0;
    int moved = 0;
    for (int k = 0; k < 2 * n; k++) tag[k] = 3 * (2 * n - k);
    CHECK_ALL(rve_farm_assign(farm, mine / 2, tag, 1) == BASE_OK);
    CHECK_ALL(rve_farm_size(farm) == n && tags_are_shared_evenly(farm, 1));
    for (int k = 0; k < n; k++) owner[k] = rve_farm_owner(farm, tag[k]);
    CHECK_ALL(rve_farm_assign(farm, mine, tag, 0) == BASE_OK);
    CHECK_ALL(rve_farm_size(farm) == 2 * n && tags_are_shared_evenly(farm, 1));
    for (int k = 0; k < n; k++) moved += owner[k] != rve_farm_owner(farm, tag[k]);
    CHECK_ALL(moved == 0 && rve_farm_owner(farm, 1) == -1);
    CHECK_ALL(rve_farm_assign(farm, 0, NULL, 1) == BASE_OK && rve_farm_size(farm) == 0);
  }
  rve_farm_destroy(farm);
}

static void ranks_share_the_cores_of_their_node(void **state) {
  (void)state;
  const int mine = rank_threads(MPI_COMM_WORLD);
  const long cores = sysconf(_SC_NPROCESSORS_CONF);
  int sum;
  MPI_Allreduce(&mine, &sum, 1, MPI_INT, MPI_SUM, MPI_COMM_WORLD);
  CHECK_ALL(mine >= 1 && (sum <= cores || sum == mpi_test_ranks()));
}

static void bulk_density_is_that_of_the_crystals(void **state) {
  (void)state;
  static double answers[TAGS * ANSWER];
  RveLaw *law;
  CHECK_ALL(run_law(MPI_COMM_WORLD, 0, &law, answers) == BASE_OK);
  /* pi R^2 / (2 R 0.99)^2 of each crystal, whatever its size. 1e-14: round-off of a few products. */
  const double expected = 2650 * 3.14159265358979323846 / (4 * 0.99 * 0.99);
  CHECK_ALL(fabs(rve_law_bulk_density(law) / expected - 1) < 1e-14);
  rve_law_destroy(law);
}

static int run(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(rves_are_spread_evenly_and_stay_where_they_are),
      cmocka_unit_test(ranks_share_the_cores_of_their_node),
      cmocka_unit_test(bulk_density_is_that_of_the_crystals),
      cmocka_unit_test(answers_are_those_of_one_serial_batch_while_points_migrate),
      cmocka_unit_test(new_tags_and_gone_tags_leave_the_others_alone),
      cmocka_unit_test(a_tag_that_comes_back_starts_from_its_packing),
      cmocka_unit_test(a_restart_on_other_ranks_continues_bit_for_bit),
      cmocka_unit_test(record_and_totals_do_not_depend_on_the_number_of_ranks),
      cmocka_unit_test(altered_truncated_and_foreign_records_are_refused_on_all_ranks),
      cmocka_unit_test(different_records_on_different_ranks_are_refused),
      cmocka_unit_test(an_unstable_rve_is_reported_alike_on_all_ranks),
      cmocka_unit_test(wrong_tags_and_volumes_are_refused_on_all_ranks),
      cmocka_unit_test(bad_scenes_and_packings_are_refused_on_all_ranks),
      cmocka_unit_test(a_view_reaches_rank_0_from_any_owner),
  };
  return cmocka_run_group_tests_name("RVE farm", tests, make_packings, free_packings);
}

int main(void) { return mpi_test_main(run, 100); }
