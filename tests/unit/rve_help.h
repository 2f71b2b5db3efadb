/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Packings and small tools for the tests of the RVE engine. */
#ifndef DEMPM_RVE_HELP_H
#define DEMPM_RVE_HELP_H

#if !defined(_POSIX_C_SOURCE)
#define _POSIX_C_SOURCE 200809L /* setenv */
#endif
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "backend_help.h"
#include "base/tensor.h"
#include "cuda_rve/rve.h"

#define MUST(expression)                                                                                               \
  do {                                                                                                                 \
    if ((expression) != BASE_OK) fail_msg("%s: %s", #expression, base_error_message());                                \
  } while (0)

#define HELP __attribute__((unused)) static

typedef enum HelpLattice { HELP_SQUARE, HELP_HEXAGONAL, HELP_CUBIC } HelpLattice;
enum { HELP_NEIGHBOURS = 3 }; /* most branches of a crystal, one of each +- pair */

HELP int help_dimension(HelpLattice lattice) { return lattice == HELP_CUBIC ? 3 : 2; }

/* Branch vectors of one crystal, unit length; returns their number. cell: primitive cell for unit branches. */
HELP int help_branches(HelpLattice lattice, double branch[HELP_NEIGHBOURS][3], double cell[9]) {
  const double h = sqrt(3.0) / 2.0;
  memset(branch, 0, HELP_NEIGHBOURS * 3 * sizeof(double));
  tensor_identity(cell);
  branch[0][0] = branch[1][1] = branch[2][2] = 1.0;
  if (lattice == HELP_SQUARE) return 2;
  if (lattice == HELP_CUBIC) return 3;
  branch[1][0] = 0.5, branch[1][1] = h;
  branch[2][0] = -0.5, branch[2][1] = h, branch[2][2] = 0.0;
  cell[1] = 0.5, cell[4] = h;
  return 3;
}

HELP RvePacking help_packing(int dimension, int grains) {
  RvePacking packing;
  memset(&packing, 0, sizeof packing);
  packing.dimension = dimension;
  packing.grains = grains;
  tensor_identity(packing.cell);
  MUST(BASE_ALLOC(3 * (size_t)grains, &packing.position));
  MUST(BASE_ALLOC((size_t)grains, &packing.radius));
  return packing;
}

/* n x n (x n) primitive cells; overlap is a fraction of the diameter. */
HELP RvePacking help_crystal(HelpLattice lattice, int n, double radius, double overlap) {
  const int dim = help_dimension(lattice), nz = dim == 3 ? n : 1;
  double branch[HELP_NEIGHBOURS][3], cell[9];
  RvePacking packing = help_packing(dim, n * n * nz);
  help_branches(lattice, branch, cell);
  for (int i = 0; i < dim; i++)
    for (int j = 0; j < dim; j++) packing.cell[3 * i + j] = cell[3 * i + j] * 2.0 * radius * (1.0 - overlap) * n;
  int at = 0;
  for (int z = 0; z < nz; z++)
    for (int y = 0; y < n; y++)
      for (int x = 0; x < n; x++, at++) {
        packing.position[3 * at] = (double)x / n - 0.5;
        packing.position[3 * at + 1] = (double)y / n - 0.5;
        packing.position[3 * at + 2] = dim == 3 ? (double)z / n - 0.5 : 0.0;
        packing.radius[at] = radius;
      }
  return packing;
}

HELP RveScene help_scene(int dimension) {
  RveScene scene = rve_scene_default();
  scene.dimension = dimension;
  scene.grain = dimension == 2 ? RVE_DISK : RVE_SPHERE;
  scene.thickness = 0.075;
  scene.density = 2650.0;
  scene.normal_stiffness = 1e6;
  scene.tangential_stiffness = 0.0;
  scene.friction = 0.5;
  scene.threads = 1;
  return scene;
}

HELP void help_heat(RveScene *scene) {
  scene->thermal = 1;
  scene->expansion = 1e-5;
  scene->reference_temperature = 0.0;
  scene->pipe_resistance = 1000.0;
  scene->grain_heat_capacity = 670.0;
}

HELP RveBatch *help_batch(const RveScene *scene, const RvePacking *packing) {
  RveBatch *batch;
  MUST(rve_batch_create(scene, packing, 1, NULL, 1, help_backend(), &batch));
  return batch;
}

/* One step of RVE 0. */
HELP RveAnswer help_step(RveBatch *batch, const double gradient[9], double temperature, double duration) {
  RveInput input;
  RveAnswer answer;
  memset(&input, 0, sizeof input);
  if (gradient) memcpy(input.velocity_gradient, gradient, sizeof input.velocity_gradient);
  input.temperature = temperature;
  MUST(rve_batch_step(batch, 1, NULL, &input, duration, &answer));
  return answer;
}

HELP double help_uniform(uint64_t *state, double low, double high) { return low + (high - low) * base_random(state); }

/* Random grains on a loose grid, compressed isotropically and frictionlessly to about `pressure`, then calmed. */
HELP RvePacking help_random(int dimension, int per_side, double pressure, uint64_t seed) {
  const int n = dimension == 2 ? per_side * per_side : per_side * per_side * per_side;
  RvePacking gas = help_packing(dimension, n), packing;
  RveScene scene = help_scene(dimension);
  RveInput input;
  RveAnswer answer;
  double gradient[9] = {0.0};
  for (int i = 0; i < n; i++) {
    const int at[3] = {i % per_side, i / per_side % per_side, dimension == 3 ? i / per_side / per_side : 0};
    gas.radius[i] = help_uniform(&seed, 2.5e-3, 5e-3);
    for (int k = 0; k < dimension; k++)
      gas.position[3 * i + k] = (at[k] + 0.5 + help_uniform(&seed, -0.02, 0.02)) / per_side - 0.5;
  }
  for (int k = 0; k < dimension; k++) gas.cell[4 * k] = per_side * 10.5e-3;
  scene.local_damping = 0.3;
  RveBatch *batch = help_batch(&scene, &gas);
  memset(&input, 0, sizeof input);
  memset(&answer, 0, sizeof answer);
  for (int k = 0; k < 4000; k++) {
    double p = 0.0;
    for (int m = 0; m < dimension; m++) p -= answer.stress[m] / dimension;
    double rate = 20.0 * (p / pressure - 1.0);
    rate = rate > 2.0 ? 2.0 : rate < -20.0 ? -20.0 : rate;
    for (int m = 0; m < dimension; m++) gradient[4 * m] = rate;
    memcpy(input.velocity_gradient, gradient, sizeof gradient);
    MUST(rve_batch_step(batch, 1, NULL, &input, 1e-4, &answer));
    if (k > 300 && fabs(p / pressure - 1.0) < 1e-2 && answer.unbalanced < 1e-2) break;
  }
  MUST(rve_batch_rest(batch, 0, NULL));
  MUST(rve_batch_packing(batch, 0, &packing));
  rve_batch_destroy(batch);
  rve_packing_destroy(&gas);
  return packing;
}

HELP double help_largest(int n, const double *a) {
  double largest = 0.0;
  for (int k = 0; k < n; k++) largest = fmax(largest, fabs(a[k]));
  return largest;
}
/* max |a - b| / max |b| */
HELP double help_difference(int n, const double *a, const double *b) {
  double largest = 0.0;
  for (int k = 0; k < n; k++) largest = fmax(largest, fabs(a[k] - b[k]));
  return largest / help_largest(n, b);
}

HELP void help_full(const double s[6], double t[9]) {
  const double full[9] = {s[0], s[3], s[4], s[3], s[1], s[5], s[4], s[5], s[2]};
  memcpy(t, full, sizeof full);
}
HELP void help_symmetric(const double t[9], double s[6]) {
  s[0] = t[0], s[1] = t[4], s[2] = t[8];
  s[3] = 0.5 * (t[1] + t[3]), s[4] = 0.5 * (t[2] + t[6]), s[5] = 0.5 * (t[5] + t[7]);
}

/* A figure of the verification report. */
HELP void help_report(const char *what, double value) { print_message("           %s: %.2e\n", what, value); }

#endif
