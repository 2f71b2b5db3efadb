/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Bodies of material points and short forms for the tests of the MPM core. */
#ifndef DEMPM_TEST_MPM_HELP_H
#define DEMPM_TEST_MPM_HELP_H

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "mpm/mpm.h"

#define PI 3.14159265358979323846

#define OK(expression)                                                       \
  do {                                                                       \
    if ((expression) != BASE_OK) fail_msg("%s: %s", #expression, base_error_message()); \
  } while (0)

/* value <= limit, with a message that shows both; a NaN fails. */
#define AT_MOST(value, limit)                                                            \
  do {                                                                                   \
    const double value_ = (value), limit_ = (limit);                                     \
    if (!(value_ <= limit_)) fail_msg("%s = %.6g exceeds %.6g", #value, value_, limit_); \
  } while (0)

/* A rectangle (box) of points on a regular lattice: `number` points of edge `size` per axis, low corner at `low`. Tags
 * from first_tag. */
static inline MpmPoint *make_box(int dimension, const double low[3], const int number[3], double size, double density,
                                 int64_t first_tag, int *count) {
  const int depth = dimension == 3 ? number[2] : 1;
  *count = number[0] * number[1] * depth;
  MpmPoint *points = malloc((size_t)*count * sizeof *points);
  assert_non_null(points);
  for (int n = 0; n < *count; n++) {
    MpmPoint *p = &points[n];
    const int at[3] = {n % number[0], n / number[0] % number[1], n / (number[0] * number[1])};
    mpm_point_default(p);
    p->tag = first_tag + n;
    p->volume0 = dimension == 3 ? size * size * size : size * size;
    p->mass = density * p->volume0;
    p->heat_capacity = 1.0;
    for (int i = 0; i < dimension; i++) {
      p->position[i] = low[i] + (at[i] + 0.5) * size;
      p->size0[i] = size;
    }
  }
  return points;
}

static inline MpmLaw elastic_law(MpmElasticMode mode, double young, double poisson) {
  const MpmElastic elastic = {.mode = mode, .young = young, .poisson = poisson};
  MpmLaw law;
  OK(mpm_elastic_create(&elastic, &law));
  return law;
}

static inline MpmWall plane_wall(int axis, double at, double normal, MpmWallContact contact) {
  MpmWall wall = mpm_wall_default();
  wall.point[axis] = at;
  wall.normal[axis] = normal;
  wall.contact = contact;
  return wall;
}

static inline double elastic_energy(const MpmPoint *points, int count) {
  double energy = 0.0;
  for (int p = 0; p < count; p++) {
    const double *f = points[p].deformation_gradient;
    const double volume = points[p].volume0 * (f[0] * (f[4] * f[8] - f[5] * f[7]) - f[1] * (f[3] * f[8] - f[5] * f[6]) +
                                               f[2] * (f[3] * f[7] - f[4] * f[6]));
    energy += volume * points[p].scalars[MPM_LAW_ENERGY_DENSITY];
  }
  return energy;
}

static inline int compare_tags(const void *a, const void *b) {
  const int64_t left = ((const MpmPoint *)a)->tag, right = ((const MpmPoint *)b)->tag;
  return (left > right) - (left < right);
}

#endif
