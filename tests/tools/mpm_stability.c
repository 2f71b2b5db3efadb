/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Growth of energy of a free elastic disk against time step and PIC fraction, without grains.
 *
 *   mpm_stability linear|gimp|bspline usf|usl|musl [STEPS]
 *
 * One line per pair: courant,pic,largest,last: the largest and the last energy over that at the start, kinetic energy
 * of the mass centre left out. courant = dt (c + v) / h, c of compression waves, v the speed of the body; inf: the run
 * broke off. The disk, 8 cells wide with 2 x 2 points per cell, crosses the grid with a tenth of c and starts with
 * random velocities of 1e-3 c. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "mpm/mpm.h"

enum { CELLS = 8, ROOM = 4 * CELLS * CELLS };
static const double YOUNG = 1346.153846153846, POISSON = 0.3, DENSITY = 1000.0; /* not 1: c = 1.346 m/s */

static double noise(void) { return 2.0 * rand() / RAND_MAX - 1.0; }

static int make_disk(MpmPoint *points, double h, double speed) {
  const double size = 0.5 * h, radius = 0.5 * CELLS * h;
  int n = 0;
  srand(1);
  for (int j = 0; j < 2 * CELLS; j++)
    for (int i = 0; i < 2 * CELLS; i++) {
      const double x[2] = {(i + 0.5) * size, (j + 0.5) * size};
      if (hypot(x[0] - radius, x[1] - radius) >= radius) continue;
      MpmPoint *p = &points[n++];
      mpm_point_default(p);
      p->tag = n;
      p->volume0 = size * size;
      p->mass = DENSITY * p->volume0;
      for (int a = 0; a < 2; a++) {
        p->position[a] = x[a], p->size0[a] = size;
        p->velocity[a] = (a == 0 ? 0.08 : 0.06) * speed + 1e-3 * speed * noise();
      }
    }
  return n;
}

static double inner_energy(const MpmPoint *points, int count) {
  double sum = 0.0, mass = 0.0, momentum[2] = {0.0, 0.0};
  for (int p = 0; p < count; p++) {
    const double *f = points[p].deformation_gradient, *v = points[p].velocity;
    sum += points[p].volume0 * (f[0] * f[4] - f[1] * f[3]) * f[8] * points[p].scalars[MPM_LAW_ENERGY_DENSITY];
    sum += 0.5 * points[p].mass * (v[0] * v[0] + v[1] * v[1]);
    for (int a = 0; a < 2; a++) momentum[a] += points[p].mass * v[a];
    mass += points[p].mass;
  }
  return sum - 0.5 * (momentum[0] * momentum[0] + momentum[1] * momentum[1]) / mass;
}

/* The largest and the last energy over the first; steps end early when it has grown a millionfold. */
static BaseStatus run(MpmScene scene, double courant, int steps, double growth[2]) {
  static MpmPoint points[ROOM];
  const MpmElastic elastic = {.mode = MPM_ELASTIC_PLANE_STRAIN, .young = YOUNG, .poisson = POISSON};
  const double speed =
      sqrt(YOUNG * (1.0 - POISSON) / ((1.0 + POISSON) * (1.0 - 2.0 * POISSON)) / DENSITY);
  MpmLaw law;
  Mpm *mpm;
  TRY(mpm_elastic_create(&elastic, &law));
  TRY(mpm_create(&scene, &law, NULL, &mpm));
  const int count = make_disk(points, scene.spacing, speed);
  const double dt = courant * scene.spacing / (1.1 * speed), start = inner_energy(points, count);
  BaseStatus status = mpm_initialise(mpm, points, count);
  growth[0] = growth[1] = 1.0;
  for (int s = 0; s < steps && status == BASE_OK && growth[0] < 1e6; s++) {
    status = mpm_step(mpm, points, count, dt);
    growth[1] = inner_energy(points, count) / start;
    growth[0] = fmax(growth[0], growth[1]);
  }
  if (status != BASE_OK || !isfinite(growth[1])) growth[0] = growth[1] = INFINITY;
  mpm_destroy(mpm);
  law.destroy(law.content);
  return BASE_OK;
}

static int find(const char *word, const char *const names[3]) {
  for (int k = 0; k < 3; k++)
    if (strcmp(word, names[k]) == 0) return k;
  return -1;
}

int main(int argc, char **argv) {
  static const char *const shapes[3] = {"linear", "gimp", "bspline"}, *const orders[3] = {"usf", "usl", "musl"};
  static const double pic[] = {0.0, 1e-3, 0.01, 0.03, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0};
  const int shape = argc > 2 ? find(argv[1], shapes) : -1, order = argc > 2 ? find(argv[2], orders) : -1;
  const int steps = argc > 3 ? atoi(argv[3]) : 1000;
  if (shape < 0 || order < 0 || steps < 1) {
    fprintf(stderr, "usage: mpm_stability linear|gimp|bspline usf|usl|musl [STEPS]\n");
    return 2;
  }
  MpmScene scene = mpm_scene_default();
  scene.dimension = 2;
  scene.spacing = 0.05;
  scene.shape = (MpmShape)shape;
  scene.order = (MpmOrder)order;
  scene.threads = 1;
  printf("courant,pic,largest,last\n");
  for (int c = 1; c <= 22; c++)
    for (size_t k = 0; k < sizeof pic / sizeof *pic; k++) {
      double growth[2];
      scene.pic_fraction = pic[k];
      if (run(scene, 0.1 * c, steps, growth) != BASE_OK) {
        fprintf(stderr, "mpm_stability: %s\n", base_error_message());
        return 1;
      }
      printf("%.1f,%g,%.6g,%.6g\n", 0.1 * c, pic[k], growth[0], growth[1]);
    }
  return 0;
}
