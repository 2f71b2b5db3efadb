/* SPDX-License-Identifier: GPL-2.0-or-later */
/* One RVE from the command line, for comparisons with other codes and for validation scripts.
 *
 *   rve_run PACKING DIMENSION keyword value ...
 *
 * Scene: grain disk|sphere  thickness  density  kn  kt  mu  gamman  gammat  viscous  local  rotation  dt  fraction.
 * Heat and bonds: expansion  reference  bond_strength (bonds all contacts at the start)  bond_shear_ratio  bond_melting
 *      temperature T (of the end, by equal parts from the reference; see the end of this head).
 * Run: L xx xy xz yx ... zz (velocity gradient)  steps N  every N (a line of figures each; 0: only the last)
 *      copies NX NY NZ (of the packing, side by side)
 *      verlet 1 (see below)  kick N VX VY VZ (the first N grains get this velocity added after the run, which is then
 *      repeated)  grains FILE (the last positions, velocities and spins).
 * Exit code 3: the RVE became unstable; the last line says at which step.
 *
 * verlet 1: velocities of the packing and of the output belong to whole steps, as those of velocity Verlet codes. The engine's
 * leapfrog keeps them half a step behind the positions. Both integrators are the same: v(n+1/2) = v(n) + dt/2 a(n), x(n+1) =
 * x(n) + dt v(n+1/2), and LIGGGHTS too evaluates forces, dashpots included, with the velocities of the half step. Only the
 * first force differs: LIGGGHTS takes it from v(0). Hence a start u = v(-1/2) is sought whose first step ends in
 * v(1/2) = v(0) + dt/2 a(x(0), v(0)); at the end v(n) is the mean of v(n-1/2) and v(n+1/2).
 *
 * temperature: step k is computed at reference + (k - 1) parts, as in LIGGGHTS, where grains have in each step the temperature
 * that the step before left. */
#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "cuda_rve/rve.h"
#include "cuda_rve/rve_packing.h"

typedef struct Run {
  RveScene scene;
  RveInput input;
  int64_t steps, every;
  int verlet, kicked, copies[3];
  double kick[3], temperature;
  const char *grains;
} Run;

typedef struct Keyword {
  const char *name;
  double *real;
  int values;
} Keyword;

static _Noreturn void stop(const char *why) {
  fprintf(stderr, "rve_run: ERROR: %s\n", why);
  exit(1);
}
static void must(BaseStatus status) {
  if (status != BASE_OK) stop(base_error_message());
}

static double number(const char *text) {
  char *end;
  const double value = text ? strtod(text, &end) : NAN;
  if (!text || end == text || *end != '\0') stop("a number is needed");
  return value;
}

static void parse(char **text, Run *run) {
  RveScene *s = &run->scene;
  double rotation = 1.0, steps = 0.0, every = 0.0, verlet = 0.0, kick[4] = {0.0}, copies[3] = {1.0, 1.0, 1.0};
  const Keyword table[] = {{"thickness", &s->thickness, 1},
                           {"density", &s->density, 1},
                           {"kn", &s->normal_stiffness, 1},
                           {"kt", &s->tangential_stiffness, 1},
                           {"mu", &s->friction, 1},
                           {"gamman", &s->normal_viscosity, 1},
                           {"gammat", &s->tangential_viscosity, 1},
                           {"viscous", &s->critical_damping, 1},
                           {"local", &s->local_damping, 1},
                           {"rotation", &rotation, 1},
                           {"expansion", &s->expansion, 1},
                           {"reference", &s->reference_temperature, 1},
                           {"temperature", &run->temperature, 1},
                           {"bond_strength", &s->bond_strength, 1},
                           {"bond_shear_ratio", &s->bond_shear_ratio, 1},
                           {"bond_melting", &s->bond_melting_temperature, 1},
                           {"dt", &s->time_step, 1},
                           {"fraction", &s->time_step_fraction, 1},
                           {"L", run->input.velocity_gradient, 9},
                           {"steps", &steps, 1},
                           {"every", &every, 1},
                           {"verlet", &verlet, 1},
                           {"kick", kick, 4},
                           {"copies", copies, 3}};
  while (*text) {
    const char *word = *text++;
    int known = 0;
    if (strcmp(word, "grain") == 0 && *text) s->grain = strcmp(*text++, "sphere") == 0 ? RVE_SPHERE : RVE_DISK, known = 1;
    if (strcmp(word, "grains") == 0 && *text) run->grains = *text++, known = 1;
    for (size_t k = 0; k < sizeof table / sizeof *table; k++)
      if (strcmp(word, table[k].name) == 0) {
        for (int i = 0; i < table[k].values; i++, text += *text != NULL) table[k].real[i] = number(*text);
        known = 1;
      }
    if (!known) {
      fprintf(stderr, "rve_run: ERROR: unknown keyword '%s'\n", word);
      exit(1);
    }
  }
  s->rotation = rotation != 0.0;
  s->bonds = s->bond_strength > 0.0;
  s->thermal = !isnan(s->expansion);
  if (s->thermal) s->pipe_resistance = 1.0; /* not asked for */
  run->steps = (int64_t)steps, run->every = every > 0.0 ? (int64_t)every : (int64_t)steps;
  run->verlet = verlet != 0.0, run->kicked = (int)kick[0];
  memcpy(run->kick, kick + 1, sizeof run->kick);
  for (int k = 0; k < 3; k++) run->copies[k] = (int)copies[k];
}

static RveBatch *create(const Run *run, const RvePacking *packing) {
  RveBatch *batch;
  must(rve_batch_create(&run->scene, packing, 1, NULL, 1, RVE_BACKEND_CPU, &batch));
  if (run->scene.bonds) must(rve_batch_install_bonds(batch, 0, NULL));
  return batch;
}

/* The state that is wanted after `step` steps. */
static RveInput input_at(const Run *run, int64_t step) {
  RveInput input = run->input;
  const double reference = run->scene.reference_temperature;
  if (run->scene.thermal)
    input.temperature = reference + (run->temperature - reference) * (double)(step > 0 ? step - 1 : 0) / (double)run->steps;
  return input;
}

/* Velocities and spins after one step from `packing`. */
static RvePacking one_step(const Run *run, const RvePacking *packing) {
  RveBatch *batch = create(run, packing);
  const RveInput input = input_at(run, 1);
  RveAnswer answer;
  RvePacking after;
  must(rve_batch_step(batch, 1, NULL, &input, run->scene.time_step, &answer));
  must(rve_batch_packing(batch, 0, &after));
  rve_batch_destroy(batch);
  return after;
}

/* Whole-step velocities of `packing` to those of the half step before. */
static void half_step_back(const Run *run, RvePacking *packing) {
  enum { ROUNDS = 12 }; /* the dashpots' part of a step's velocity change shrinks by dt times their rate in each */
  const size_t n = 3 * (size_t)packing->grains;
  double *const own[2] = {packing->velocity, packing->spin};
  double *goal[2] = {NULL, NULL};
  RvePacking after = one_step(run, packing);
  for (int m = 0; m < 2; m++) {
    const double *moved = m ? after.spin : after.velocity;
    must(BASE_ALLOC(n, &goal[m]));
    for (size_t k = 0; k < n; k++) goal[m][k] = 0.5 * (own[m][k] + moved[k]), own[m][k] -= 0.5 * (moved[k] - own[m][k]);
  }
  for (int round = 0; round < ROUNDS; round++) {
    rve_packing_destroy(&after);
    after = one_step(run, packing);
    for (int m = 0; m < 2; m++)
      for (size_t k = 0; k < n; k++) own[m][k] += goal[m][k] - (m ? after.spin : after.velocity)[k];
  }
  rve_packing_destroy(&after);
  base_free(goal[0]), base_free(goal[1]);
}

/* Half-step velocities of `packing`, the present state of `batch`, to those of the whole step, through one step more. */
static void half_step_on(const Run *run, RveBatch *batch, RvePacking *packing) {
  const RveInput input = input_at(run, run->steps + 1);
  RveAnswer answer;
  RvePacking after;
  must(rve_batch_step(batch, 1, NULL, &input, run->scene.time_step, &answer));
  must(rve_batch_packing(batch, 0, &after));
  for (int k = 0; k < 3 * packing->grains; k++) {
    packing->velocity[k] = 0.5 * (packing->velocity[k] + after.velocity[k]);
    packing->spin[k] = 0.5 * (packing->spin[k] + after.spin[k]);
  }
  rve_packing_destroy(&after);
}

static void print_answer(const RveAnswer *a) {
  printf("%lld", (long long)a->steps);
  for (int k = 0; k < 6; k++) printf(" %.12g", a->stress[k]);
  printf(" %.12g %.12g %.12g %.12g %.6g %.6g %.12g %.9g %.12g\n", a->kinetic_energy, a->elastic_energy, a->friction_work,
         a->damping_work, a->coordination, a->unbalanced, a->volume, a->solid_fraction,
         a->bond_fraction);
}

/* From packing to packing; returns 0 if the RVE became unstable. */
static int advance(const Run *run, RvePacking *packing) {
  if (run->verlet) half_step_back(run, packing);
  RveBatch *batch = create(run, packing);
  RveInput input = input_at(run, 0);
  RveAnswer answer;
  must(rve_batch_step(batch, 1, NULL, &input, 0.0, &answer));
  print_answer(&answer);
  for (int64_t done = 0, next; done < run->steps; done += next) {
    next = run->scene.thermal && done == 0 ? 1 : run->every - done % run->every;
    if (next > run->steps - done) next = run->steps - done;
    input = input_at(run, done + next);
    const BaseStatus status = rve_batch_step(batch, 1, NULL, &input, (double)next * run->scene.time_step, &answer);
    if (status == BASE_ERROR_UNSTABLE) {
      printf("unstable between steps %lld and %lld\n", (long long)done, (long long)(done + next));
      rve_batch_destroy(batch);
      return 0;
    }
    must(status);
    if ((done + next) % run->every == 0 || done + next == run->steps) print_answer(&answer);
  }
  rve_packing_destroy(packing);
  must(rve_batch_packing(batch, 0, packing));
  if (run->verlet) half_step_on(run, batch, packing);
  rve_batch_destroy(batch);
  return 1;
}

/* Lines "number x y z vx vy vz wx wy wz"; the cell's centre is the origin. */
static void write_grains(const char *name, const RvePacking *p) {
  FILE *file = fopen(name, "w");
  if (!file) stop(strerror(errno));
  for (int i = 0; i < p->grains; i++) {
    const double *h = p->cell, *s = p->position + 3 * i, *v = p->velocity + 3 * i, *w = p->spin + 3 * i;
    fprintf(file, "%d", i + 1);
    for (int k = 0; k < 3; k++) fprintf(file, " %.17g", h[3 * k] * s[0] + h[3 * k + 1] * s[1] + h[3 * k + 2] * s[2]);
    fprintf(file, " %.17g %.17g %.17g %.17g %.17g %.17g\n", v[0], v[1], v[2], w[0], w[1], w[2]);
  }
  if (fclose(file)) stop(strerror(errno));
}

int main(int count, char **text) {
  Run run = {.scene = rve_scene_default()};
  RvePacking packing;
  if (count < 3) stop("usage: rve_run PACKING DIMENSION keyword value ... (see the head of its source)");
  run.scene.dimension = (int)number(text[2]);
  run.scene.grain = run.scene.dimension == 3 ? RVE_SPHERE : RVE_DISK;
  run.scene.threads = 1;
  parse(text + 3, &run);
  RvePacking tile;
  must(rve_packing_read(text[1], run.scene.dimension, &tile));
  must(rve_packing_replicate(&tile, run.copies, &packing));
  rve_packing_destroy(&tile);
  const size_t n = 3 * (size_t)packing.grains;
  if (!packing.velocity) must(BASE_ALLOC(n, &packing.velocity));
  if (!packing.spin) must(BASE_ALLOC(n, &packing.spin));
  must(rve_scene_check(&run.scene));
  if (run.scene.time_step == 0.0)
    run.scene.time_step = run.scene.time_step_fraction * rve_critical_time_step(&run.scene, &packing);
  printf("# time step %.17g s, critical %.17g s\n", run.scene.time_step, rve_critical_time_step(&run.scene, &packing));
  printf("# step sxx syy szz sxy sxz syz [Pa] kinetic elastic friction damping [J] coordination unbalanced volume solid bonds\n");
  int stable = advance(&run, &packing);
  if (stable && run.kicked > 0) {
    for (int i = 0; i < run.kicked && i < packing.grains; i++)
      for (int k = 0; k < 3; k++) packing.velocity[3 * i + k] += run.kick[k];
    stable = advance(&run, &packing);
  }
  if (stable && run.grains) write_grains(run.grains, &packing);
  rve_packing_destroy(&packing);
  return stable ? 0 : 3;
}
