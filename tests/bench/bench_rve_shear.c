/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The job that is compared with other DEM codes: isochoric biaxial shear of a packing, 2 % in 20,000 steps of 2e-6 s,
 * kn = kt = 1e6 N/m, mu = 0.5. 2D grains are spheres in one layer.
 *
 *   bench_rve_shear PACKING 2|3 [keyword value]...
 *
 *   backend cpu|cuda   rves N   threads N   steps N   repeat N
 *   call N        DEM steps per call, as a material point would ask for in one MPM step (1000)
 *   skin F        as in RveScene; 0 = automatic
 *   damping local|viscous       local: Cundall's, 0.2, as in YADE; viscous: dashpots as in LIGGGHTS and LAMMPS
 *   gas F         the cell's edges times F: no grain touches another
 *   thermal 0|1   heat is computed as well
 *   mixed 0|1     contact forces in FP32
 *
 * Prints one line of JSON. Seconds are wall time of the steps alone, one entry per repetition; stresses are those at
 * the end, compression positive, Pa (2D: N/m). */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "cuda_rve/rve_packing.h"
#include "job.h"

enum { MOST_REPEATS = 1000 };

typedef struct Job {
  const char *file;
  RveBackend backend;
  RveScene scene;
  int rves, call, repeat;
  long steps;
  double gas;
} Job;

static int set(Job *job, const char *keyword, const char *value) {
  RveScene *scene = &job->scene;
  const double number = atof(value);
  if (strcmp(keyword, "backend") == 0)
    job->backend = strcmp(value, "cuda") == 0 ? RVE_BACKEND_CUDA : RVE_BACKEND_CPU;
  else if (strcmp(keyword, "rves") == 0) job->rves = (int)number;
  else if (strcmp(keyword, "threads") == 0) scene->threads = (int)number;
  else if (strcmp(keyword, "steps") == 0) job->steps = (long)number;
  else if (strcmp(keyword, "repeat") == 0) job->repeat = (int)number;
  else if (strcmp(keyword, "call") == 0) job->call = (int)number;
  else if (strcmp(keyword, "skin") == 0) scene->skin = number;
  else if (strcmp(keyword, "gas") == 0) job->gas = number;
  else if (strcmp(keyword, "mixed") == 0) scene->mixed = (int)number;
  else if (strcmp(keyword, "thermal") == 0) scene->thermal = (int)number;
  else if (strcmp(keyword, "damping") == 0 && strcmp(value, "viscous") == 0)
    scene->local_damping = 0.0, scene->normal_viscosity = 2.3e4, scene->tangential_viscosity = 1.15e4;
  else return strcmp(keyword, "damping") == 0;
  return 1;
}

static int read_job(int argc, char **argv, Job *job) {
  memset(job, 0, sizeof *job);
  job->rves = job->repeat = 1;
  job->call = 1000;
  job->steps = 20000;
  job->gas = 1.0;
  job->backend = RVE_BACKEND_CPU;
  if (argc < 3) return 0;
  job->file = argv[1];
  job->scene = job_scene(atoi(argv[2]));
  job->scene.expansion = 1e-5;
  job->scene.pipe_resistance = 1e3;
  for (int k = 3; k < argc; k += 2)
    if (k + 1 >= argc || !set(job, argv[k], argv[k + 1])) return 0;
  return job->rves > 0 && job->call > 0 && job->repeat > 0 && job->repeat <= MOST_REPEATS && job->steps > 0;
}

static double processor_seconds(void) { return (double)clock() / CLOCKS_PER_SEC; }

/* Histories are dropped: the other codes start without them. */
static BaseStatus read_packing(const Job *job, RvePacking *packing) {
  TRY(rve_packing_read(job->file, job->scene.dimension, packing));
  packing->contacts = 0;
  for (int a = 0; a < job->scene.dimension; a++)
    for (int b = 0; b < job->scene.dimension; b++) packing->cell[3 * a + b] *= job->gas;
  return BASE_OK;
}

static BaseStatus run(const Job *job, const RvePacking *packing, char name[RVE_BACKEND_BYTES], double *seconds, double *processor,
                      double *first_coordination, RveAnswer *answer) {
  RveBatch *batch = NULL;
  RveInput *input = NULL;
  BaseStatus status;
  TRY(BASE_ALLOC((size_t)job->rves, &input));
  for (int k = 0; k < job->rves; k++) input[k].velocity_gradient[0] = -0.5, input[k].velocity_gradient[4] = 0.5;
  TRY_GOTO(rve_batch_create(&job->scene, packing, 1, NULL, job->rves, job->backend, &batch), status, done);
  TRY_GOTO(rve_batch_step(batch, job->rves, NULL, input, 0.0, answer), status, done);
  *first_coordination = answer[0].coordination;
  snprintf(name, RVE_BACKEND_BYTES, "%s", rve_batch_backend_name(batch));
  const double start = base_seconds(), used = processor_seconds();
  for (long k = 0; k < job->steps; k += job->call)
    TRY_GOTO(rve_batch_step(batch, job->rves, NULL, input, job->call * job->scene.time_step, answer), status, done);
  *seconds = base_seconds() - start;
  *processor = processor_seconds() - used;
done:
  rve_batch_destroy(batch);
  base_free(input);
  return status;
}

static void print(const Job *job, const RvePacking *packing, const char *name, double first_coordination,
                  const double *seconds, const double *processor, const RveAnswer *answer) {
  const double unit = job->scene.dimension == 2 ? -job->scene.thickness : -1.0;
  printf("{\"backend\": \"%s\", \"dimension\": %d, \"grains\": %d, \"rves\": %d, \"threads\": %d, \"steps\": %lld, ",
         name, job->scene.dimension, packing->grains, job->rves, job->scene.threads, (long long)answer->steps);
  printf("\"sxx\": %.6g, \"syy\": %.6g, \"coordination_start\": %.4f, \"coordination_end\": %.4f, \"rebuilds\": %lld",
         unit * answer->stress[0], unit * answer->stress[1], first_coordination, answer->coordination,
         (long long)answer->rebuilds);
  for (int k = 0; k < 2; k++) {
    printf(", \"%s\": [", k == 0 ? "seconds" : "processor_seconds");
    for (int r = 0; r < job->repeat; r++) printf("%s%.6f", r ? ", " : "", k == 0 ? seconds[r] : processor[r]);
    printf("]");
  }
  printf("}\n");
}

int main(int argc, char **argv) {
  static double seconds[MOST_REPEATS], processor[MOST_REPEATS];
  Job job;
  RvePacking packing = {0};
  RveAnswer *answer = NULL;
  char name[RVE_BACKEND_BYTES];
  double first = 0.0;
  if (!read_job(argc, argv, &job)) {
    fprintf(stderr, "usage: bench_rve_shear PACKING 2|3 [keyword value]...; the keywords are in its source\n");
    return 2;
  }
  BaseStatus status = read_packing(&job, &packing);
  if (status == BASE_OK) status = BASE_ALLOC((size_t)job.rves, &answer);
  for (int r = 0; r < job.repeat && status == BASE_OK; r++)
    status = run(&job, &packing, name, &seconds[r], &processor[r], &first, answer);
  if (status == BASE_OK) print(&job, &packing, name, first, seconds, processor, answer);
  else fprintf(stderr, "bench_rve_shear: %s\n", base_error_message());
  base_free(answer);
  rve_packing_destroy(&packing);
  return status != BASE_OK;
}
