/* SPDX-License-Identifier: GPL-2.0-or-later */
/* One core, one RVE: isochoric biaxial shear of a packing, 2 % in 20,000 steps of 2e-6 s, kn = kt = 1e6 N/m, mu = 0.5.
 *
 *   bench_rve_shear PACKING.txt [2|3] [steps per call] [steps] [skin] [mixed]
 *
 * PACKING.txt: "Lx Ly Lz n", then n lines "x y z r", in metres. 2D grains are spheres in one layer; stresses are then
 * printed as force per length. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "cuda_rve/rve.h"

static int read_packing(const char *file, int dimension, RvePacking *packing) {
  FILE *f = fopen(file, "r");
  double l[3];
  memset(packing, 0, sizeof *packing);
  if (!f || fscanf(f, "%lf %lf %lf %d", &l[0], &l[1], &l[2], &packing->grains) != 4) return 0;
  packing->dimension = dimension;
  for (int k = 0; k < 3; k++) packing->cell[4 * k] = k < dimension ? l[k] : 1.0;
  if (BASE_ALLOC(3 * (size_t)packing->grains, &packing->position) != BASE_OK) return 0;
  if (BASE_ALLOC((size_t)packing->grains, &packing->radius) != BASE_OK) return 0;
  for (int i = 0; i < packing->grains; i++) {
    double x[3];
    if (fscanf(f, "%lf %lf %lf %lf", &x[0], &x[1], &x[2], &packing->radius[i]) != 4) return 0;
    for (int k = 0; k < dimension; k++) packing->position[3 * i + k] = x[k] / l[k] - 0.5;
  }
  fclose(f);
  return 1;
}

static int compare(const void *a, const void *b) {
  const double x = *(const double *)a, y = *(const double *)b;
  return (x > y) - (x < y);
}

int main(int argc, char **argv) {
  const int dimension = argc > 2 ? atoi(argv[2]) : 2, per_call = argc > 3 ? atoi(argv[3]) : 1000;
  const long steps = argc > 4 ? atol(argv[4]) : 20000;
  RvePacking packing;
  if (argc == 2 && (strcmp(argv[1], "cpu") == 0 || strcmp(argv[1], "cuda") == 0)) {
    printf("bench_rve_shear: needs a packing file, see its head\n");
    return 0;
  }
  if (argc < 2 || !read_packing(argv[1], dimension, &packing)) {
    fprintf(stderr, "usage: bench_rve_shear PACKING.txt [2|3] [steps per call] [steps] [skin] [mixed]\n");
    return 2;
  }
  RveScene scene = rve_scene_default();
  scene.dimension = dimension;
  scene.grain = RVE_SPHERE;
  scene.thickness = 1.0;
  scene.density = 2650.0;
  scene.normal_stiffness = scene.tangential_stiffness = 1e6;
  scene.friction = 0.5;
  scene.local_damping = 0.2;
  scene.time_step = 2e-6;
  scene.threads = 1;
  scene.mixed = argc > 6 && strcmp(argv[6], "mixed") == 0;
  scene.skin = argc > 5 ? atof(argv[5]) : 0.0;
  RveInput input = {{0.0}, 0.0};
  input.velocity_gradient[0] = -0.5;
  input.velocity_gradient[4] = 0.5;
  double seconds[3];
  RveAnswer answer;
  const char *name = "";
  char text[32];
  for (int round = 0; round < 3; round++) {
    RveBatch *batch;
    if (rve_batch_create(&scene, &packing, 1, NULL, 1, RVE_BACKEND_CPU, &batch) != BASE_OK) {
      fprintf(stderr, "%s\n", base_error_message());
      return 1;
    }
    snprintf(text, sizeof text, "%s", rve_batch_backend_name(batch));
    name = text;
    const double start = (double)clock() / CLOCKS_PER_SEC; /* processor time: other jobs do not count */
    for (long k = 0; k < steps; k += per_call)
      if (rve_batch_step(batch, 1, NULL, &input, per_call * scene.time_step, &answer) != BASE_OK) {
        fprintf(stderr, "%s\n", base_error_message());
        return 1;
      }
    seconds[round] = (double)clock() / CLOCKS_PER_SEC - start;
    rve_batch_destroy(batch);
  }
  qsort(seconds, 3, sizeof *seconds, compare);
  printf("%s %dD %d grains: %.2f million particle-steps/s (median of 3; best %.2f), %d steps per call\n", name,
         dimension, packing.grains, 1e-6 * (double)packing.grains * (double)answer.steps / seconds[1],
         1e-6 * (double)packing.grains * (double)answer.steps / seconds[0], per_call);
  printf(
      "  sxx %.2f syy %.2f szz %.2f sxy %.3f (tension positive), Z %.3f, unbalanced %.2e, friction %.4e J, lists "
      "%lld\n",
      answer.stress[0], answer.stress[1], answer.stress[2], answer.stress[3], answer.coordination, answer.unbalanced,
      answer.friction_work, (long long)answer.rebuilds);
  rve_packing_destroy(&packing);
  return 0;
}
