/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Heat on the grid: explicit, lumped capacity (TM-DEMPM eq. 14-21, signs of the loads as corrected in eq. 17). */
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

/* The flux enters through the outermost layer: points whose domain touches the wall, each with the area of its face. */
void mpm_heat_walls(Mpm *mpm, MpmVec *load) {
  const int dimension = mpm->scene.dimension, width = mpm_load_width(mpm);
  for (int w = 0; w < mpm->wall_count; w++) {
    MpmWall *wall = &mpm->walls[w];
    if (wall->heat != MPM_WALL_FLUX) continue;
    for (int k = 0; k < mpm->points.own; k++) {
      double normal[3], vector[3], f[9];
      const MpmVec place = mpm->points.position[k];
      const double position[3] = {place[1], place[2], place[3]};
      if (!mpm_wall_in_range(wall, dimension, position)) continue;
      mpm_row_deformation(mpm, k, f);
      const double distance = mpm_wall_distance(wall, dimension, position, normal);
      const double area = mpm_face_area(&mpm->points.home[mpm->points.slot[k]], f, normal, vector);
      const double layer = mpm_row_volume(mpm, k) / area;
      if (!(distance <= layer)) continue;
      load[(size_t)k * (size_t)width][0] += wall->flux * area;
      wall->heat_flow += wall->flux * area;
    }
  }
}
