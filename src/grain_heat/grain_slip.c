/* SPDX-License-Identifier: GPL-2.0-or-later */
#include <math.h>
#include <stdbool.h>

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

/* As LIGGGHTS moves the spring; true if the Coulomb limit shortened it. */
static bool move_spring(const GrainMotion *motion, double step, const double before[3], const double after[3],
                        double trial[3]) {
  const double distance = sqrt(dot(motion->branch, motion->branch));
  double normal[3];
  grain_tangential_velocity(motion, distance, normal, trial);
  for (int a = 0; a < 3; a++) trial[a] = before[a] + trial[a] * step;
  const double along = dot(trial, normal);
  for (int a = 0; a < 3; a++) trial[a] -= along * normal[a];
  return dot(trial, trial) > dot(after, after) * (1.0 + 1e-12);
}

double grain_slip_work(const GrainMotion *motion, const double stiffness[2], double step, const double before[3],
                       const double after[3]) {
  double trial[3], work = 0.5 * (stiffness[0] - stiffness[1]) * dot(before, after);
  if (!move_spring(motion, step, before, after, trial)) return work;
  /* Mean force times slip. The force of the step's end alone would err to first order in the step. */
  for (int a = 0; a < 3; a++)
    work += 0.5 * (stiffness[0] * before[a] + stiffness[1] * after[a]) * (trial[a] - after[a]);
  return work;
}

/* The force of a step acts until the middle of the next one: what it takes is force times mean velocity. Rolling about
 * the contact makes spheres 7/2 times as easy to move tangentially. */
double grain_damping_work(const GrainMotion *motion, const GrainContact *contact, double step, const double before[3],
                          const double after[3]) {
  const double distance = sqrt(dot(motion->branch, motion->branch)), half = 0.5 * step / contact->mass;
  double normal[3], slide[3], trial[3];
  const double parting = grain_tangential_velocity(motion, distance, normal, slide);
  const double overlap = motion->radius[0] + motion->radius[1] - distance;
  const double force = contact->stiffness[0] * overlap - contact->damping[0] * parting;
  double power = contact->damping[0] * parting * (parting + half * force);
  if (move_spring(motion, step, before, after, trial)) return power * step;
  for (int a = 0; a < 3; a++) {
    const double back = -contact->stiffness[1] * after[a] - contact->damping[1] * slide[a];
    power += contact->damping[1] * slide[a] * (slide[a] + 3.5 * half * back);
  }
  return power * step;
}

void grain_spring_before(const GrainMotion *motion, const double stiffness[2], const double limit[2], double step,
                         const double after[3], double before[3]) {
  const double distance = sqrt(dot(motion->branch, motion->branch)), length = sqrt(dot(after, after));
  double normal[3], slide[3];
  grain_tangential_velocity(motion, distance, normal, slide);
  double stretch = 1.0; /* of the trial state, which is parallel to `after` */
  if (length > 0.0 && stiffness[1] * length >= limit[1] * (1.0 - 1e-9)) {
    /* |trial - slide step| is the length that the limit allowed before */
    const double allowed = stiffness[0] > 0.0 ? limit[0] / stiffness[0] : 0.0;
    const double along = dot(after, slide) * step / length;
    const double square = allowed * allowed - dot(slide, slide) * step * step + along * along;
    stretch = fmax((along + sqrt(fmax(square, 0.0))) / length, 1.0);
  }
  for (int a = 0; a < 3; a++) before[a] = stretch * after[a] - slide[a] * step;
}
