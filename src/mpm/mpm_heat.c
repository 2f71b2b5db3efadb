/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Heat on the grid: explicit, lumped capacity (TM-DEMPM eq. 14-21, signs of the loads as corrected in eq. 17). */
#include <math.h>

#include "mpm_core.h"

/* T_I = sum m c S T_p / C_I; nodes under a temperature wall take the wall's (the last wall's, if there are several). */
void mpm_heat_start(Mpm *mpm) {
  MpmGrid *grid = &mpm->grid;
  for (int n = 0; n < grid->nodes; n++)
    grid->state[n][0] = grid->heat[n][0] > 0.0 ? grid->heat[n][1] / grid->heat[n][0] : 0.0;
  for (int c = 0; c < mpm->contact_count; c++) {
    const MpmWall *wall = &mpm->walls[mpm->contacts[c].wall];
    if (wall->heat == MPM_WALL_TEMPERATURE) grid->state[mpm->contacts[c].node][0] = wall->temperature;
  }
}

/* rate[0]: W on entry, K/s on return. A temperature wall supplies what keeps its nodes from changing: that is the heat
 * that reaches the points, since they receive increments only (eq. 28). */
void mpm_heat_update(Mpm *mpm) {
  MpmGrid *grid = &mpm->grid;
  for (int c = mpm->contact_count - 1; c >= 0; c--) {
    MpmWall *wall = &mpm->walls[mpm->contacts[c].wall];
    const int n = mpm->contacts[c].node;
    if (wall->heat != MPM_WALL_TEMPERATURE) continue;
    if (grid->owned[n]) wall->heat_flow -= grid->rate[n][0];
    grid->rate[n][0] = 0.0;
  }
  for (int n = 0; n < grid->nodes; n++) {
    const int carries = grid->sum[n][0] > mpm->scene.mass_cutoff * grid->scale[n];
    grid->rate[n][0] = carries ? grid->rate[n][0] / grid->heat[n][0] : 0.0;
  }
}

/* -------------------------------------------------------------------------------------------- steps of its own */

double mpm_heat_source(const Mpm *mpm, int row) {
  const MpmPoint *point = &mpm->points.home[mpm->points.slot[row]];
  return (mpm->scene.mechanical ? mpm_row_volume(mpm, row) * point->heat : 0.0) + point->heat_external;
}

void mpm_heat_collect(Mpm *mpm) {
  MpmPoints *p = &mpm->points;
#pragma omp parallel for num_threads(mpm->threads) if (mpm_is_parallel(mpm))
  for (int k = 0; k < p->live; k++) {
    MpmPoint *point = &p->home[p->slot[k]];
    point->heat_waiting += mpm->dt * mpm_heat_source(mpm, k);
    if (mpm->heats) point->heat_power = point->heat_waiting / mpm->heat_duration;
  }
}

void mpm_heat_carry(Mpm *mpm) {
  MpmPoints *p = &mpm->points;
#pragma omp parallel for num_threads(mpm->threads) if (mpm_is_parallel(mpm))
  for (int k = 0; k < p->live; k++) {
    MpmPoint *point = &p->home[p->slot[k]];
    const double change = mpm->dt * point->temperature_rate;
    point->temperature += change;
    point->temperature_mapped += change;
    point->heat_waiting -= mpm->dt * point->heat_power;
    if (!isfinite(point->temperature)) mpm_note_point(mpm, BASE_ERROR_UNSTABLE, point->tag, "temperature is not finite");
  }
}

/* ------------------------------------------------------------------------------------------------------- walls */

static void add_flux(Mpm *mpm, MpmWall *wall, int row, double distance, const double normal[3], MpmVec *load) {
  double vector[3], f[9];
  mpm_row_deformation(mpm, row, f);
  const double area = mpm_face_area(&mpm->points.home[mpm->points.slot[row]], f, normal, vector);
  if (!(distance <= mpm_row_volume(mpm, row) / area)) return;
  load[(size_t)row * (size_t)mpm_load_width(mpm)][0] += wall->flux * area;
  wall->heat_flow += wall->flux * area;
}

/* The flux enters through the outermost layer: points whose domain touches the wall, each with the area of its face. */
void mpm_heat_walls(Mpm *mpm, MpmVec *load) {
  const int dimension = mpm->scene.dimension;
  for (int w = 0; w < mpm->wall_count; w++) {
    MpmWall *wall = &mpm->walls[w];
    if (wall->heat != MPM_WALL_FLUX || wall->kind == MPM_WALL_SURFACE) continue;
    for (int k = 0; k < mpm->points.own; k++) {
      const MpmVec place = mpm->points.position[k];
      const double position[3] = {place[1], place[2], place[3]};
      double normal[3];
      if (!mpm_wall_in_range(wall, dimension, position, 0.0)) continue;
      const double distance = mpm_wall_distance(wall, dimension, position, normal);
      add_flux(mpm, wall, k, distance, normal, load);
    }
  }
  for (int k = 0; k < mpm->wall_scratch.nears; k++) {
    const MpmNear *near = &mpm->wall_scratch.near[k];
    if (mpm->walls[near->wall].heat == MPM_WALL_FLUX)
      add_flux(mpm, &mpm->walls[near->wall], near->row, near->distance, near->normal, load);
  }
}
