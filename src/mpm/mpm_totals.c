/* SPDX-License-Identifier: GPL-2.0-or-later */
#include <math.h>
#include <string.h>

#include "../base/tensor.h"
#include "mpm.h"

void mpm_totals(const MpmPoint *points, int count, MpmTotals *totals) {
  memset(totals, 0, sizeof *totals);
  for (int p = 0; p < count; p++) {
    const MpmPoint *point = &points[p];
    totals->mass += point->mass;
    for (int i = 0; i < 3; i++) {
      totals->momentum[i] += point->mass * point->velocity[i];
      totals->kinetic_energy += 0.5 * point->mass * point->velocity[i] * point->velocity[i];
    }
    totals->thermal_energy += point->mass * point->heat_capacity * point->temperature + point->heat_waiting;
    totals->heat_power += point->volume0 * tensor_determinant(point->deformation_gradient) * point->heat;
  }
}
