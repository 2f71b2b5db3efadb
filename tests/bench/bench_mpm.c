/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Speed of the MPM core without grains: two elastic disks (spheres) that approach, collide and part, USF, FLIP.
 * bench_mpm [cpu] [FILE] [ROUNDS]: the first argument is what every benchmark gets and has no meaning here; FILE gets
 * the figures as JSON. One thread and two threads take turns, so that noise falls on both alike. */
#include <math.h>
#include <omp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "mpm/mpm.h"

enum { CASES = 6, ROUNDS_MAX = 100 };

typedef struct Case {
  const char *name;
  int dimension;
  MpmShape shape;
  int cells; /* per metre */
  int count, steps;
  double rate[2][ROUNDS_MAX]; /* point-steps/s, one and two threads */
  double processor_rate;      /* per second of processor time, one thread, best round: what others use does not count */
  double approach_rate;       /* of the first 0.5 s, before contact, one thread, best round */
  double momentum;            /* change of the total, over that of one body: 0 to round-off */
  double energy;              /* kinetic and elastic at the end over that at the start */
} Case;

static BaseStatus make_points(const Case *job, MpmPoint **points, int *count) {
  const int dimension = job->dimension, cells = job->cells;
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

static double energy_of(const MpmPoint *points, int count) {
  double sum = 0.0;
  for (int p = 0; p < count; p++) {
    const double *f = points[p].deformation_gradient, *v = points[p].velocity;
    const double ratio = f[0] * (f[4] * f[8] - f[5] * f[7]) - f[1] * (f[3] * f[8] - f[5] * f[6]) +
                         f[2] * (f[3] * f[7] - f[4] * f[6]);
    sum += 0.5 * points[p].mass * (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]) +
           points[p].volume0 * ratio * points[p].scalars[MPM_LAW_ENERGY_DENSITY];
  }
  return sum;
}

static BaseStatus run_steps(Case *job, Mpm *mpm, MpmPoint *points, double dt, int threads, double *rate) {
  MpmTotals before, after;
  mpm_totals(points, job->count, &before);
  const double energy = energy_of(points, job->count);
  job->steps = (int)(1.5 / dt); /* s: contact from 0.6 s to about 1.2 s */
  TRY(mpm_attach(mpm, points, job->count));
  TRY(mpm_advance(mpm, dt)); /* memory is taken */
  const double start = base_seconds();
  const clock_t used = clock();
  const int approach = (int)(0.5 / dt);
  for (int s = 1; s < job->steps; s++) {
    TRY(mpm_advance(mpm, dt));
    if (s == approach && threads == 1)
      job->approach_rate = fmax(job->approach_rate, s * (double)job->count / (base_seconds() - start));
  }
  *rate = (job->steps - 1) * (double)job->count / (base_seconds() - start);
  const double seconds = (double)(clock() - used) / CLOCKS_PER_SEC;
  if (threads == 1) job->processor_rate = fmax(job->processor_rate, (job->steps - 1) * (double)job->count / seconds);
  mpm_write(mpm);
  mpm_totals(points, job->count, &after);
  job->momentum = fabs(after.momentum[0] - before.momentum[0]) / (0.05 * before.mass);
  job->energy = energy_of(points, job->count) / energy;
  return BASE_OK;
}

static BaseStatus run(Case *job, int threads, double *rate) {
  MpmScene scene = mpm_scene_default();
  scene.dimension = job->dimension;
  scene.spacing = 1.0 / job->cells;
  scene.shape = job->shape;
  scene.threads = threads;
  const MpmElastic elastic = {
      .mode = job->dimension == 3 ? MPM_ELASTIC_3D : MPM_ELASTIC_PLANE_STRAIN, .young = 1000.0, .poisson = 0.3};
  MpmLaw law;
  Mpm *mpm;
  MpmPoint *points;
  TRY(mpm_elastic_create(&elastic, &law));
  TRY(mpm_create(&scene, &law, NULL, &mpm));
  TRY(make_points(job, &points, &job->count));
  TRY(mpm_initialise(mpm, points, job->count));
  TRY(run_steps(job, mpm, points, 0.2 * scene.spacing / sqrt(1346.0 / 1000.0), threads, rate));
  base_free(points);
  mpm_destroy(mpm);
  law.destroy(law.content);
  return BASE_OK;
}

/* -------------------------------------------------------------------------------------------------- figures */

static int compare(const void *a, const void *b) {
  const double left = *(const double *)a, right = *(const double *)b;
  return (left > right) - (left < right);
}

static double median(double *value, int n) {
  qsort(value, (size_t)n, sizeof *value, compare);
  return n % 2 ? value[n / 2] : 0.5 * (value[n / 2 - 1] + value[n / 2]);
}

static void find_machine(char *name, size_t size) {
  char line[256];
  snprintf(name, size, "unknown processor");
  FILE *file = fopen("/proc/cpuinfo", "r");
  while (file && fgets(line, sizeof line, file)) {
    const char *value = strchr(line, ':');
    if (strncmp(line, "model name", 10) != 0 || !value) continue;
    snprintf(name, size, "%.*s", (int)strcspn(value + 2, "\"\\\n"), value + 2);
    break;
  }
  if (file) fclose(file);
}

static void write_values(FILE *file, const char *key, const Case *jobs, double (*value)(const Case *), int is_last) {
  fprintf(file, "  \"%s\": {", key);
  for (int c = 0; c < CASES; c++) fprintf(file, "%s\"%s\": %.6g", c ? ", " : "", jobs[c].name, value(&jobs[c]));
  fprintf(file, "}%s\n", is_last ? "" : ",");
}

static int rounds = 3;
static double best_rate(const Case *job) { return job->rate[0][rounds - 1]; } /* sorted by median() */
static double median_rate(const Case *job) { return median((double *)job->rate[0], rounds); }
static double scaling(const Case *job) { return median((double *)job->rate[1], rounds) / median_rate(job); }
static double processor_rate(const Case *job) { return job->processor_rate; }
static double approach_rate(const Case *job) { return job->approach_rate; }
static double points_of(const Case *job) { return job->count; }
static double steps_of(const Case *job) { return job->steps; }
static double momentum_of(const Case *job) { return job->momentum; }
static double energy_ratio(const Case *job) { return job->energy; }

static int write_json(const char *path, const Case *jobs, int threads) {
  char machine[256];
  FILE *file = fopen(path, "w");
  if (!file) return 0;
  find_machine(machine, sizeof machine);
  fprintf(file, "{\n  \"machine\": \"%s, %d core(s)\",\n  \"rounds\": %d,\n", machine, omp_get_num_procs(), rounds);
  write_values(file, "median_point_steps_per_second", jobs, median_rate, 0);
  write_values(file, "point_steps_per_second", jobs, best_rate, 0);
  write_values(file, "approach_point_steps_per_second", jobs, approach_rate, 0);
  write_values(file, "point_steps_per_processor_second", jobs, processor_rate, 0);
  if (threads > 1) write_values(file, "two_core_scaling", jobs, scaling, 0);
  write_values(file, "points", jobs, points_of, 0);
  write_values(file, "steps", jobs, steps_of, 0);
  write_values(file, "momentum_error", jobs, momentum_of, 0);
  write_values(file, "energy_ratio", jobs, energy_ratio, 1);
  fprintf(file, "}\n");
  return fclose(file) == 0;
}

int main(int argc, char **argv) {
  static Case jobs[CASES] = {{"2d_linear", 2, MPM_SHAPE_LINEAR, 200, .count = 0},
                             {"2d_gimp", 2, MPM_SHAPE_GIMP, 200, .count = 0},
                             {"2d_bspline", 2, MPM_SHAPE_BSPLINE, 200, .count = 0},
                             {"3d_linear", 3, MPM_SHAPE_LINEAR, 48, .count = 0},
                             {"3d_gimp", 3, MPM_SHAPE_GIMP, 48, .count = 0},
                             {"3d_bspline", 3, MPM_SHAPE_BSPLINE, 48, .count = 0}};
  const int threads = omp_get_num_procs() > 1 ? 2 : 1;
  if (argc > 3) rounds = atoi(argv[3]) > 0 && atoi(argv[3]) <= ROUNDS_MAX ? atoi(argv[3]) : 3;
  for (int c = 0; c < CASES; c++) {
    Case *job = &jobs[c];
    for (int round = 0; round < rounds; round++)
      for (int t = 0; t < threads; t++)
        if (run(job, t + 1, &job->rate[t][round]) != BASE_OK) {
          fprintf(stderr, "bench_mpm: %s\n", base_error_message());
          return 1;
        }
    const double middle = median_rate(job);
    printf("MPM %-10s %6d points, %4d steps: %6.2f million point-steps/s on one core (median %.2f, per processor "
           "second %.2f, before contact %.2f)", job->name, job->count, job->steps, 1e-6 * best_rate(job), 1e-6 * middle,
           1e-6 * job->processor_rate, 1e-6 * job->approach_rate);
    if (threads > 1) printf(", two cores %.2f times as fast", scaling(job));
    printf("; momentum %.1e, energy %.4f\n", job->momentum, job->energy);
    fflush(stdout);
  }
  if (argc > 2 && !write_json(argv[2], jobs, threads)) {
    fprintf(stderr, "bench_mpm: cannot write %s\n", argv[2]);
    return 1;
  }
  return 0;
}
