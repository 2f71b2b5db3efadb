/* SPDX-License-Identifier: GPL-2.0-or-later */
/* A law over ranks and the serial batch that its answers have to be those of, for the tests of the RVE farm. */
#ifndef DEMPM_FARM_HELP_H
#define DEMPM_FARM_HELP_H

#include "mpi_test.h" /* first */

#include "backend_help.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "../../src/fix_mpm_couple/rank_threads.h"
#include "../../src/fix_mpm_couple/rve_farm.h"
#include "../../src/fix_mpm_couple/rve_law.h"

#define HELP __attribute__((unused)) static

enum { TAGS = 28, PACKINGS = 3, ANSWER = 14 + MPM_LAW_SCALARS };
static const double time_step = 2e-5; /* s, of the points; some 10 DEM steps */

static RvePacking packing[PACKINGS];

HELP RveScene make_scene(void) {
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
HELP BaseStatus make_crystal(int n, RvePacking *crystal) {
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

HELP int make_packings(void **state) {
  (void)state;
  for (int k = 0; k < PACKINGS; k++)
    if (make_crystal(2 + k, &packing[k]) != BASE_OK) return -1;
  return 0;
}

HELP int free_packings(void **state) {
  (void)state;
  for (int k = 0; k < PACKINGS; k++) rve_packing_destroy(&packing[k]);
  return 0;
}

/* What point `tag` asks in step `step`: the same on every rank. */
HELP void make_input(int64_t tag, int step, RveInput *input) {
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

HELP BaseStatus truth_create(const RveScene *scene, Truth *truth) {
  int packing_of_rve[TAGS];
  for (int k = 0; k < TAGS; k++) packing_of_rve[k] = k % PACKINGS;
  memset(truth, 0, sizeof *truth);
  return rve_batch_create(scene, packing, PACKINGS, packing_of_rve, TAGS, help_backend(), &truth->batch);
}

/* Steps the RVEs of alive tags; answers [TAGS][ANSWER] as the law reports them, rows of others untouched. */
HELP BaseStatus truth_step(Truth *truth, const int *alive, int step, double dt, double *answers) {
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
HELP BaseStatus law_step(RveLaw *law, MPI_Comm comm, const int *alive, int step, double dt, int64_t spoil,
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
HELP int same_answers(const double *a, const double *b, const int *alive) {
  for (int k = 0; k < TAGS; k++)
    for (int i = 0; i < ANSWER && alive[k]; i++)
      if (!(a[ANSWER * k + i] == b[ANSWER * k + i])) {
        fprintf(stderr, "tag %d, value %d: %.17g and %.17g\n", k + 1, i, a[ANSWER * k + i], b[ANSWER * k + i]);
        return 0;
      }
  return 1;
}

/* The record on all ranks of MPI_COMM_WORLD; law is over MPI_COMM_WORLD. */
HELP BaseStatus pack_for_all(RveLaw *law, char **bytes, size_t *size) {
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

HELP void all_alive(int *alive) {
  for (int k = 0; k < TAGS; k++) alive[k] = 1;
}

HELP BaseStatus assign_alive(RveLaw *law, const int *alive) {
  int64_t tag[TAGS];
  int n = 0;
  for (int k = 0; k < TAGS; k++)
    if (alive[k] && k % mpi_test_ranks() == mpi_test_rank()) tag[n++] = k + 1;
  return rve_law_assign(law, n, tag);
}

/* A law over comm after `steps` steps with all tags alive; volumes told. */
HELP BaseStatus run_law(MPI_Comm comm, int steps, RveLaw **law, double *answers) {
  const RveScene scene = make_scene();
  int alive[TAGS], rank;
  int64_t tag[TAGS];
  double volume[TAGS];
  all_alive(alive);
  MPI_Comm_rank(comm, &rank);
  TRY(rve_law_create(comm, &scene, packing, PACKINGS, help_backend(), law));
  for (int k = 0; k < TAGS; k++) tag[k] = k + 1, volume[k] = 1e-4 * (k + 1);
  /* All points on one rank. In two portions, so that ranks hold tags of both and not one range of tags each. */
  TRY(rve_law_assign(*law, rank == 0 ? TAGS / 2 : 0, tag + TAGS - TAGS / 2));
  TRY(rve_law_assign(*law, rank == 0 ? TAGS : 0, tag));
  TRY(rve_law_set_volumes(*law, rank == 0 ? TAGS : 0, tag, volume));
  for (int step = 0; step < steps; step++) TRY(law_step(*law, comm, alive, step, time_step, 0, answers));
  return BASE_OK;
}

#endif
