/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Speed of the MPM core without grains: two elastic bodies that collide, million point-steps per second.
 * bench_mpm [cpu] [threads]; the first argument is what every benchmark gets and has no meaning here. */
#include <math.h>
#include <omp.h>
#include <stdio.h>
#include <stdlib.h>

#include "mpm/mpm.h"

static BaseStatus make_points(int dimension, int cells, MpmPoint **points, int *count) {
  const double size = 0.5 / cells, radius = 0.2, centre[2] = {0.3, 0.7};
  MpmPoint *list = NULL;
  int n = 0, room = 0;
  for (int k = 0; k < (dimension == 3 ? 2 * cells : 1); k++)
    for (int j = 0; j < 2 * cells; j++)
      for (int i = 0; i < 2 * cells; i++)
        for (int b = 0; b < 2; b++) {
          const double x[3] = {(i + 0.5) * size, (j + 0.5) * size, dimension == 3 ? (k + 0.5) * size : centre[b]};
          double square = 0.0;
          for (int a = 0; a < 3; a++) square += (x[a] - centre[b]) * (x[a] - centre[b]);
          if (square >= radius * radius) continue;
          if (n == room) {
            const int larger = 2 * room + 1000;
            TRY(BASE_GROW((size_t)room, (size_t)larger, &list));
            room = larger;
          }
          MpmPoint *p = &list[n++];
          mpm_point_default(p);
          p->tag = n;
          p->volume0 = dimension == 3 ? size * size * size : size * size;
          p->mass = 1000.0 * p->volume0;
          for (int a = 0; a < dimension; a++) {
            p->position[a] = x[a], p->size0[a] = size;
            p->velocity[a] = b ? -0.1 : 0.1;
          }
        }
  *points = list;
  *count = n;
  return BASE_OK;
}

static BaseStatus run(int dimension, MpmShape shape, int cells, int threads) {
  static const char *const name[3] = {"linear", "uGIMP", "B-spline"};
  MpmScene scene = mpm_scene_default();
  scene.dimension = dimension;
  scene.spacing = 1.0 / cells;
  scene.shape = shape;
  scene.threads = threads;
  const MpmElastic elastic = {
      .mode = dimension == 3 ? MPM_ELASTIC_3D : MPM_ELASTIC_PLANE_STRAIN, .young = 1000.0, .poisson = 0.3};
  MpmLaw law;
  Mpm *mpm;
  MpmPoint *points;
  int count;
  TRY(mpm_elastic_create(&elastic, &law));
  TRY(mpm_create(&scene, &law, NULL, &mpm));
  TRY(make_points(dimension, cells, &points, &count));
  TRY(mpm_initialise(mpm, points, count));
  const double dt = 0.2 * scene.spacing / sqrt(1346.0 / 1000.0);
  TRY(mpm_attach(mpm, points, count));
  for (int s = 0; s < 3; s++) TRY(mpm_advance(mpm, dt));
  const int steps = dimension == 3 ? 30 : 60;
  double best = 0.0;
  for (int round = 0; round < 3; round++) {
    const double start = base_seconds();
    for (int s = 0; s < steps; s++) TRY(mpm_advance(mpm, dt));
    best = fmax(best, 1e-6 * steps * count / (base_seconds() - start));
  }
  printf("MPM %dD %-8s %6d points, %d thread(s): %6.2f million point-steps/s (best of 3)\n", dimension, name[shape],
         count, threads, best);
  base_free(points);
  mpm_destroy(mpm);
  law.destroy(law.content);
  return BASE_OK;
}

int main(int argc, char **argv) {
  const int threads = argc > 2 ? atoi(argv[2]) : 1;
  omp_set_num_threads(threads > 0 ? threads : 1); /* the law's own loop */
  for (int dimension = 2; dimension <= 3; dimension++)
    for (int shape = 0; shape < 3; shape++)
      if (run(dimension, (MpmShape)shape, dimension == 2 ? 200 : 48, threads) != BASE_OK) {
        fprintf(stderr, "bench_mpm: %s\n", base_error_message());
        return 1;
      }
  return 0;
}
