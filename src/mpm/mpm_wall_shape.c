/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Planes and boxes: distances, and the nodes at or beyond them (to round-off). */
#include <math.h>
#include <string.h>

#include "../base/tensor.h"
#include "mpm_core.h"

static const double ROUND_OFF = 1e-8; /* of the spacing: a moving wall's position is itself a sum of many steps */

int mpm_wall_in_range(const MpmWall *wall, int dimension, const double x[3], double tolerance) {
  for (int i = 0; i < dimension; i++)
    if (!(x[i] >= wall->range[0][i] - tolerance && x[i] <= wall->range[1][i] + tolerance)) return 0;
  return 1;
}

/* Distance of x from a box: outside the largest distance along an axis, inside minus the depth under the nearest face,
 * whose normal is returned. `preferred` (or NULL) decides between faces that are equally near: the one that it runs
 * into most. */
static double box_distance(const MpmWall *wall, int dimension, const double x[3], const double *preferred,
                           double tolerance, double normal[3]) {
  double best = -INFINITY, best_speed = 0.0;
  for (int i = 0; i < dimension; i++)
    for (int side = -1; side <= 1; side += 2) {
      const double distance = side < 0 ? wall->low[i] - x[i] : x[i] - wall->high[i];
      const double speed = preferred ? side * (preferred[i] - wall->velocity[i]) : 0.0;
      const int is_tie = fabs(distance - best) <= tolerance;
      if (is_tie ? speed >= best_speed : distance < best) continue;
      best = is_tie && best > distance ? best : distance;
      best_speed = speed;
      normal[0] = normal[1] = normal[2] = 0.0;
      normal[i] = side;
    }
  return best;
}

double mpm_wall_distance(const MpmWall *wall, int dimension, const double x[3], double normal[3]) {
  if (wall->kind == MPM_WALL_BOX) return box_distance(wall, dimension, x, NULL, 0.0, normal);
  double distance = 0.0;
  for (int i = 0; i < dimension; i++) distance += (x[i] - wall->point[i]) * wall->normal[i];
  memcpy(normal, wall->normal, sizeof wall->normal);
  return distance;
}

/* Area vectors of a deformed face a: V0 / size_a cof(F) e_a (Nanson), turned to the side of the normal. */
double mpm_face_area(const MpmPoint *point, const double f[9], const double normal[3], double area[3]) {
  double inverse[9], largest = 0.0;
  tensor_inverse(f, inverse);
  const double volume = point->volume0 * tensor_determinant(f);
  area[0] = area[1] = area[2] = 0.0;
  for (int a = 0; a < 3; a++) {
    if (!(point->size0[a] > 0.0)) continue;
    const double *row = inverse + 3 * a; /* (F^-T)_ia */
    const double projection = volume / point->size0[a] * (normal[0] * row[0] + normal[1] * row[1] + normal[2] * row[2]);
    if (!(fabs(projection) > largest)) continue;
    largest = fabs(projection);
    for (int i = 0; i < 3; i++) area[i] = copysign(volume / point->size0[a], projection) * row[i];
  }
  return largest;
}

void mpm_node_place(const Mpm *mpm, int node, double x[3]) {
  for (int i = 0; i < 3; i++)
    x[i] = i < mpm->scene.dimension ? mpm->scene.origin[i] + mpm->spacing[i] * mpm->grid.index[node][i] : 0.0;
}

int mpm_wall_is_under(const Mpm *mpm, const MpmWall *wall, int node, double normal[3]) {
  const int dimension = mpm->scene.dimension;
  const double tolerance = ROUND_OFF * mpm->scene.spacing;
  double x[3], velocity[3];
  mpm_node_place(mpm, node, x);
  if (!mpm_wall_in_range(wall, dimension, x, tolerance)) return 0;
  if (wall->kind == MPM_WALL_PLANE) return mpm_wall_distance(wall, dimension, x, normal) <= tolerance;
  for (int i = 0; i < 3; i++) velocity[i] = mpm->grid.state[node][1 + i];
  return box_distance(wall, dimension, x, velocity, tolerance, normal) <= tolerance;
}
