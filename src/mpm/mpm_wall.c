/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Walls as conditions on nodal velocities: the response. mpm_wall_shape.c and mpm_wall_facet.c find the nodes.
 *
 * The condition is applied twice. Before the update to v_I alone, so that the velocity gradient respects the wall; the
 * FLIP points do not feel that change. Then to v_I + a_I dt, as impulses: they are what the points feel. Several walls
 * at one node: the impulses are iterated (projected Gauss-Seidel). */
#include <math.h>
#include <string.h>

#include "mpm_core.h"

enum { SWEEPS = 20 };

BaseStatus mpm_wall_add(Mpm *mpm, int node, int wall, const double normal[3], const double velocity[3]) {
  if (mpm->contact_count == mpm->contact_room) {
    const size_t room = 2 * (size_t)mpm->contact_room + 256;
    TRY(BASE_GROW((size_t)mpm->contact_count, room, &mpm->contacts));
    mpm->contact_room = (int)room;
  }
  MpmContact *contact = &mpm->contacts[mpm->contact_count];
  *contact = (MpmContact){.node = node, .wall = wall, .is_first = mpm->grid.contact_of[node] == 0};
  memcpy(contact->normal, normal, sizeof contact->normal);
  memcpy(contact->velocity, velocity, sizeof contact->velocity);
  mpm->grid.contact_of[node] = 1;
  if (!contact->is_first) mpm->has_corners = 1;
  mpm->contact_count++;
  return BASE_OK;
}

static BaseStatus find_one(Mpm *mpm, int w) {
  MpmWall *wall = &mpm->walls[w];
  double normal[3];
  for (int i = 0; i < 3; i++) wall->reaction[i] = 0.0;
  wall->power_friction = wall->power_motion = 0.0;
  if (mpm->heats || !mpm->scene.thermal) wall->heat_flow = 0.0; /* else that of the last thermal step goes on */
  if (wall->kind == MPM_WALL_SURFACE) return mpm_surface_find(mpm, w);
  if (wall->contact == MPM_WALL_NO_CONTACT && (wall->heat != MPM_WALL_TEMPERATURE || !mpm->heats)) return BASE_OK;
  for (int n = 0; n < mpm->grid.nodes; n++)
    if (mpm_wall_is_under(mpm, wall, n, normal)) TRY(mpm_wall_add(mpm, n, w, normal, wall->velocity));
  return BASE_OK;
}

BaseStatus mpm_wall_find(Mpm *mpm) {
  mpm->contact_count = mpm->has_corners = mpm->wall_scratch.nears = 0;
  for (int n = 0; n < mpm->grid.nodes; n++) mpm->grid.contact_of[n] = 0;
  for (int w = 0; w < mpm->wall_count; w++) TRY(find_one(mpm, w));
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
static double relax(const MpmWall *wall, const MpmContact *contact, int dimension, int with_friction, double change[3],
                    MpmVec *velocity) {
  double free[3] = {0.0, 0.0, 0.0}, answer[3], correction = 0.0;
  for (int i = 0; i < dimension; i++) free[i] = (*velocity)[1 + i] - contact->velocity[i] - change[i];
  respond(wall, contact->normal, free, with_friction, answer);
  for (int i = 0; i < dimension; i++) {
    correction = fmax(correction, fabs(answer[i] - change[i]));
    (*velocity)[1 + i] = contact->velocity[i] + (free[i] + answer[i]); /* no-slip: the wall's velocity exactly */
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
      correction = fmax(correction, relax(wall, contact, mpm->scene.dimension, is_update,
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
    const double force = mass * (contact->change[i] + felt * contact->start[i]) / mpm->dt;
    wall->reaction[i] += force;
    wall->power_motion += force * contact->velocity[i];
    normal_change += contact->change[i] * contact->normal[i];
  }
  if (wall->contact != MPM_WALL_FRICTION) return;
  for (int i = 0; i < scene->dimension; i++) {
    const double slip = 0.5 * (mpm->grid.state[n][1 + i] + mpm->grid.rate[n][1 + i]) - contact->velocity[i];
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

/* ------------------------------------------------------------------------------------------- points at surfaces */

/* Nodes hold a body, but where it thins out or slides far along an inclined surface single points may drift through the
 * part of a cell that no node guards. A point closer than a quarter of its width comes no closer: it is held as a node
 * is, with friction. In bodies that are not squeezed to half their width this never acts. */
static void guard(const MpmNear *near, MpmWall *wall, int dimension, double dt, const double size0[3], MpmVec *position,
                  MpmVec *velocity) {
  const double mass = (*position)[0];
  double width = INFINITY, moved = 0.0, free[3] = {0.0, 0.0, 0.0}, change[3];
  for (int i = 0; i < dimension; i++) {
    width = fmin(width, size0[i]);
    moved += ((*position)[1 + i] - near->place[i] - dt * near->velocity[i]) * near->normal[i];
    free[i] = (*velocity)[1 + i] - near->velocity[i];
  }
  const double missing = fmin(near->distance, 0.25 * width) - (near->distance + moved);
  if (!(missing > 0.0)) return;
  for (int i = 0; i < dimension; i++) (*position)[1 + i] += missing * near->normal[i];
  respond(wall, near->normal, free, 1, change);
  double normal_change = 0.0, work = 0.0;
  for (int i = 0; i < dimension; i++) normal_change += change[i] * near->normal[i];
  for (int i = 0; i < dimension; i++) {
    const double force = mass * change[i] / dt, slip = free[i] + 0.5 * change[i];
    (*velocity)[1 + i] += change[i];
    wall->reaction[i] += force;
    wall->power_motion += force * near->velocity[i];
    work -= mass * (change[i] - normal_change * near->normal[i]) * slip;
  }
  if (wall->contact == MPM_WALL_FRICTION) wall->power_friction += work / dt;
}

void mpm_wall_guard(Mpm *mpm) {
  MpmPoints *p = &mpm->points;
  for (int k = 0; k < mpm->wall_scratch.nears; k++) {
    const MpmNear *near = &mpm->wall_scratch.near[k];
    MpmWall *wall = &mpm->walls[near->wall];
    if (near->row < p->live && wall->contact != MPM_WALL_NO_CONTACT)
      guard(near, wall, mpm->scene.dimension, mpm->dt, p->home[p->slot[near->row]].size0, &p->position[near->row],
            &p->motion[near->row]);
  }
}

void mpm_wall_free(Mpm *mpm) {
  MpmWallScratch *scratch = &mpm->wall_scratch;
  base_free(mpm->contacts);
  base_free(scratch->nearest);
  base_free(scratch->side_mass);
  base_free(scratch->candidate);
  base_free(scratch->near);
}
