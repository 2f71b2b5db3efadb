/* SPDX-License-Identifier: GPL-2.0-or-later */
#include <math.h>

#include "grain_heat.h"

static double dot(const double a[3], const double b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

/* The sums stand in LIGGGHTS' order, so that they have its bits. */
double grain_tangential_velocity(const GrainMotion *motion, double distance, double normal[3], double velocity[3]) {
  const double inverse = 1.0 / distance, overlap = motion->radius[0] + motion->radius[1] - distance;
  const double arm[2] = {motion->radius[0] - 0.5 * overlap, motion->radius[1] - 0.5 * overlap};
  const double *d = motion->branch;
  double spin[3];
  for (int a = 0; a < 3; a++) {
    normal[a] = d[a] * inverse;
    velocity[a] = motion->velocity[0][a] - motion->velocity[1][a];
    spin[a] = (arm[0] * motion->spin[0][a] + arm[1] * motion->spin[1][a]) * inverse;
  }
  const double along = dot(velocity, normal);
  for (int a = 0; a < 3; a++) {
    const int b = (a + 1) % 3, c = (a + 2) % 3;
    velocity[a] = velocity[a] - along * normal[a] - (d[c] * spin[b] - d[b] * spin[c]);
  }
  return along;
}

double grain_slip_work(const GrainMotion *motion, double stiffness, double step, const double before[3],
                       const double after[3]) {
  const double distance = sqrt(dot(motion->branch, motion->branch));
  double normal[3], trial[3];
  grain_tangential_velocity(motion, distance, normal, trial);
  for (int a = 0; a < 3; a++) trial[a] = before[a] + trial[a] * step;
  const double along = dot(trial, normal);
  for (int a = 0; a < 3; a++) trial[a] -= along * normal[a];
  if (dot(trial, trial) <= dot(after, after) * (1.0 + 1e-12)) return 0.0;
  /* Mean force times slip. The force of the step's end alone would err to first order in the step. */
  double work = 0.0;
  for (int a = 0; a < 3; a++) work += 0.5 * stiffness * (before[a] + after[a]) * (trial[a] - after[a]);
  return work;
}
