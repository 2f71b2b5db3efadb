/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Walls as conditions on nodal velocities. Nodes at or beyond a wall (to round-off) are under its condition.
 *
 * The condition is applied twice. Before the update to v_I alone, so that the velocity gradient respects the wall; the
 * FLIP points do not feel that change. Then to v_I + a_I dt, as impulses: they are what the points feel. Several walls
 * at one node: the impulses are iterated (projected Gauss-Seidel). */
#include <math.h>
#include <string.h>

#include "../base/tensor.h"
#include "mpm_core.h"

enum { SWEEPS = 20 };
static const double ROUND_OFF = 1e-8; /* of the spacing: a moving wall's position is itself a sum of many steps */

int mpm_wall_in_range(const MpmWall *wall, int dimension, const double x[3]) {
  for (int i = 0; i < dimension; i++)
    if (!(x[i] >= wall->range[0][i] && x[i] <= wall->range[1][i])) return 0;
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

static int is_under(const Mpm *mpm, const MpmWall *wall, int node, double normal[3]) {
  const MpmScene *scene = &mpm->scene;
  const double tolerance = ROUND_OFF * scene->spacing;
  double x[3] = {0.0, 0.0, 0.0}, velocity[3];
  for (int i = 0; i < scene->dimension; i++) {
    x[i] = scene->origin[i] + mpm->spacing[i] * mpm->grid.index[node][i];
    if (!(x[i] >= wall->range[0][i] - tolerance && x[i] <= wall->range[1][i] + tolerance)) return 0;
  }
  if (wall->kind == MPM_WALL_PLANE) return mpm_wall_distance(wall, scene->dimension, x, normal) <= tolerance;
  for (int i = 0; i < 3; i++) velocity[i] = mpm->grid.state[node][1 + i];
  return box_distance(wall, scene->dimension, x, velocity, tolerance, normal) <= tolerance;
}

static BaseStatus add_contact(Mpm *mpm, int node, int wall, const double normal[3]) {
  if (mpm->contact_count == mpm->contact_room) {
    const size_t room = 2 * (size_t)mpm->contact_room + 256;
    TRY(BASE_GROW((size_t)mpm->contact_count, room, &mpm->contacts));
    mpm->contact_room = (int)room;
  }
  MpmContact *contact = &mpm->contacts[mpm->contact_count];
  *contact = (MpmContact){.node = node, .wall = wall, .is_first = mpm->grid.contact_of[node] == 0};
  memcpy(contact->normal, normal, sizeof contact->normal);
  mpm->grid.contact_of[node] = 1;
  if (!contact->is_first) mpm->has_corners = 1;
  mpm->contact_count++;
  return BASE_OK;
}

BaseStatus mpm_wall_find(Mpm *mpm) {
  MpmGrid *grid = &mpm->grid;
  mpm->contact_count = mpm->has_corners = 0;
  for (int n = 0; n < grid->nodes; n++) grid->contact_of[n] = 0;
  for (int w = 0; w < mpm->wall_count; w++) {
    MpmWall *wall = &mpm->walls[w];
    double normal[3];
    for (int i = 0; i < 3; i++) wall->reaction[i] = 0.0;
    wall->power_friction = wall->heat_flow = 0.0;
    if (wall->contact == MPM_WALL_NO_CONTACT && wall->heat != MPM_WALL_TEMPERATURE) continue;
    for (int n = 0; n < grid->nodes; n++)
      if (is_under(mpm, wall, n, normal)) TRY(add_contact(mpm, n, w, normal));
  }
  return BASE_OK;
}

/* change = what the wall does to a node that moves with `free` relative to it. Coulomb in impulse form: the tangential
 * impulse is at most friction times the normal one. */
static void respond(const MpmWall *wall, const double normal[3], const double free[3], int with_friction,
                    double change[3]) {
  for (int i = 0; i < 3; i++) change[i] = 0.0;
  if (wall->contact == MPM_WALL_NO_CONTACT) return;
  if (wall->contact == MPM_WALL_NO_SLIP) {
    for (int i = 0; i < 3; i++) change[i] = -free[i];
    return;
  }
  const double approach = -(free[0] * normal[0] + free[1] * normal[1] + free[2] * normal[2]);
  if (approach <= 0.0 && wall->separable) return;
  for (int i = 0; i < 3; i++) change[i] = approach * normal[i];
  if (wall->contact != MPM_WALL_FRICTION || !with_friction || approach <= 0.0) return;
  double slip[3], square = 0.0;
  for (int i = 0; i < 3; i++) slip[i] = free[i] + change[i], square += slip[i] * slip[i];
  const double speed = sqrt(square), limit = wall->friction * approach;
  const double share = speed <= limit ? 1.0 : limit / speed;
  for (int i = 0; i < 3; i++) change[i] -= share * slip[i];
}

/* One contact of the iteration: takes its own earlier change back, answers anew. Returns the size of the correction. */
static double relax(const MpmWall *wall, const double normal[3], int dimension, int with_friction, double change[3],
                    MpmVec *velocity) {
  double free[3] = {0.0, 0.0, 0.0}, answer[3], correction = 0.0;
  for (int i = 0; i < dimension; i++) free[i] = (*velocity)[1 + i] - wall->velocity[i] - change[i];
  respond(wall, normal, free, with_friction, answer);
  for (int i = 0; i < dimension; i++) {
    correction = fmax(correction, fabs(answer[i] - change[i]));
    (*velocity)[1 + i] = wall->velocity[i] + (free[i] + answer[i]); /* no-slip: the wall's velocity exactly */
    change[i] = answer[i];
  }
  return correction;
}

/* field: velocity of the nodes under walls. */
static void iterate(Mpm *mpm, MpmVec *field, int is_update) {
  const int sweeps = mpm->has_corners ? SWEEPS : 1;
  for (int sweep = 0; sweep < sweeps; sweep++) {
    double correction = 0.0;
    for (int c = 0; c < mpm->contact_count; c++) {
      MpmContact *contact = &mpm->contacts[c];
      const MpmWall *wall = &mpm->walls[contact->wall];
      if (wall->contact == MPM_WALL_NO_CONTACT) continue;
      correction = fmax(correction, relax(wall, contact->normal, mpm->scene.dimension, is_update,
                                          is_update ? contact->change : contact->start, &field[contact->node]));
    }
    if (correction == 0.0) break;
  }
}

void mpm_wall_start(Mpm *mpm) {
  for (int c = 0; c < mpm->contact_count; c++) memset(mpm->contacts[c].start, 0, sizeof mpm->contacts[c].start);
  iterate(mpm, mpm->grid.state, 0);
}

/* Force on the body, and the power of slip: minus impulse times the mean of the node's velocities before and after the
 * step, which is the wall's share of the change of kinetic energy while all forces act at once. */
static void add_outputs(Mpm *mpm, const MpmContact *contact) {
  const MpmScene *scene = &mpm->scene;
  const int n = contact->node;
  if (!mpm->grid.owned[n]) return;
  MpmWall *wall = &mpm->walls[contact->wall];
  const double mass = mpm->grid.sum[n][0];
  /* The share of the first change that the points do feel, through the PIC part of the transfer. */
  const double felt = scene->transfer == MPM_TRANSFER_FLIP ? scene->pic_fraction : 1.0;
  double normal_change = 0.0, work = 0.0;
  for (int i = 0; i < scene->dimension; i++) {
    wall->reaction[i] += mass * (contact->change[i] + felt * contact->start[i]) / mpm->dt;
    normal_change += contact->change[i] * contact->normal[i];
  }
  if (wall->contact != MPM_WALL_FRICTION) return;
  for (int i = 0; i < scene->dimension; i++) {
    const double slip = 0.5 * (mpm->grid.state[n][1 + i] + mpm->grid.rate[n][1 + i]) - wall->velocity[i];
    work -= mass * (contact->change[i] - normal_change * contact->normal[i]) * slip;
  }
  wall->power_friction += work / mpm->dt;
}

void mpm_wall_update(Mpm *mpm) {
  MpmGrid *grid = &mpm->grid;
  /* rate holds the updated velocity of the nodes under walls while the impulses are found. */
  for (int c = 0; c < mpm->contact_count; c++) {
    const int n = mpm->contacts[c].node;
    if (!mpm->contacts[c].is_first) continue;
    for (int i = 1; i < 4; i++) grid->rate[n][i] = grid->state[n][i] + mpm->dt * grid->rate[n][i];
  }
  iterate(mpm, grid->rate, 1);
  for (int c = 0; c < mpm->contact_count; c++) add_outputs(mpm, &mpm->contacts[c]);
  for (int c = 0; c < mpm->contact_count; c++) {
    const int n = mpm->contacts[c].node;
    if (!mpm->contacts[c].is_first) continue;
    for (int i = 1; i < 4; i++) grid->rate[n][i] = (grid->rate[n][i] - grid->state[n][i]) / mpm->dt;
  }
}
