/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Particle-steps per second of the RVE engine: bench_rve [cpu|cuda] [seconds per case] */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "cuda_rve/rve.h"
#include "cuda_rve/rve_packing.h"

typedef struct Case {
  const char *name;
  int dimension, copies[3], thermal, bonds;
} Case;

static const Case cases[] = {
    {"200 disks, friction", 2, {20, 10, 1}, 0, 0},
    {"200 disks, friction, heat", 2, {20, 10, 1}, 1, 0},
    {"400 disks, friction, heat, bonds", 2, {20, 20, 1}, 1, 1},
    {"216 spheres, friction, heat", 3, {6, 6, 6}, 1, 0},
};

static RveScene scene_of(const Case *c) {
  RveScene scene = rve_scene_default();
  scene.dimension = c->dimension;
  scene.grain = c->dimension == 2 ? RVE_DISK : RVE_SPHERE;
  scene.thickness = 0.075;
  scene.density = 2650.0;
  scene.normal_stiffness = scene.tangential_stiffness = 1e6;
  scene.friction = 0.5;
  scene.critical_damping = 0.2;
  scene.thermal = c->thermal;
  scene.expansion = 1e-5;
  scene.pipe_resistance = 1e3;
  scene.bonds = c->bonds;
  scene.bond_strength = 0.1;
  scene.substeps = 200;
  scene.share = 0; /* as in job.h */
  return scene;
}

/* A crystal whose grains are shaken a little: neighbours change under shear as in a random packing. */
static BaseStatus packing_of(const Case *c, RvePacking *packing) {
  RvePacking cell;
  const double radius = 0.004;
  TRY(rve_packing_lattice(c->dimension == 2 ? RVE_HEXAGONAL : RVE_SIMPLE_CUBIC, radius, 0.02, &cell));
  const BaseStatus status = rve_packing_replicate(&cell, c->copies, packing);
  rve_packing_destroy(&cell);
  TRY(status);
  uint64_t seed = 1;
  for (int i = 0; i < packing->grains; i++) {
    packing->radius[i] *= 0.95 + 0.1 * base_random(&seed);
    for (int k = 0; k < c->dimension; k++)
      packing->position[3 * i + k] += 0.05 * (base_random(&seed) - 0.5) / c->copies[k];
  }
  return BASE_OK;
}

/* Steps of a slow simple shear until the time is used up. */
static BaseStatus measure(RveBatch *batch, int count, double dt, double seconds, double *steps_per_second) {
  RveInput *input = calloc((size_t)count, sizeof *input);
  RveAnswer *answer = calloc((size_t)count, sizeof *answer);
  BaseStatus status = input && answer ? BASE_OK : base_error(BASE_ERROR_MEMORY, "no memory");
  for (int k = 0; status == BASE_OK && k < count; k++) input[k].velocity_gradient[1] = 0.5, input[k].temperature = 1.0;
  if (status == BASE_OK) status = rve_batch_step(batch, count, NULL, input, dt, answer); /* warm */
  const double start = base_seconds();
  int64_t calls = 0;
  while (status == BASE_OK && base_seconds() - start < seconds) {
    status = rve_batch_step(batch, count, NULL, input, dt, answer);
    calls++;
  }
  *steps_per_second = (double)calls * rve_batch_scene(batch)->substeps * count / (base_seconds() - start);
  free(input);
  free(answer);
  return status;
}

static BaseStatus run(const Case *c, RveBackend backend, double seconds) {
  const RveScene scene = scene_of(c);
  const int count = backend == RVE_BACKEND_CUDA ? 1600 : 64;
  RvePacking packing = {0};
  RveBatch *batch = NULL;
  double rate = 0.0;
  BaseStatus status = packing_of(c, &packing);
  if (status == BASE_OK) status = rve_batch_create(&scene, &packing, 1, NULL, count, backend, &batch);
  if (status == BASE_OK && scene.bonds) status = rve_batch_install_bonds(batch, 0, NULL);
  if (status == BASE_OK) status = measure(batch, count, 200 * 0.25 * rve_critical_time_step(&scene, &packing), seconds, &rate);
  if (status == BASE_OK)
    printf("%-36s %5d RVEs  %-11s %.3g particle-steps/s\n", c->name, count, rve_batch_backend_name(batch),
           rate * packing.grains);
  else printf("%-36s %s\n", c->name, base_error_message());
  rve_batch_destroy(batch);
  rve_packing_destroy(&packing);
  return status;
}

int main(int argc, char **argv) {
  const RveBackend backend = argc > 1 && strcmp(argv[1], "cuda") == 0 ? RVE_BACKEND_CUDA : RVE_BACKEND_CPU;
  const double seconds = argc > 2 ? atof(argv[2]) : 3.0;
  int failed = 0;
  for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) failed |= run(&cases[k], backend, seconds) != BASE_OK;
  return failed;
}
