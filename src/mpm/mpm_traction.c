/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Traction on the outermost layer of points (errata A.6): a point belongs to it if no other point lies beyond it, seen
 * along the axis within half a point's width to the sides. Its face has the area V / h, h being the point's own width.
 * The normal component of the traction acts along the face's current normal, as a pressure does (a force of fixed
 * direction would turn a body that is free to turn); the tangential components act along their axes. Or a
 * pressure on the whole surface, see mpm.h. */
#include <math.h>

#include "mpm_kernel.h"

static int find_cell(const MpmGrid *grid, uint64_t key) {
  int low = 0, high = grid->cells;
  while (low < high) {
    const int middle = low + (high - low) / 2;
    if (grid->cell_key[middle] < key) low = middle + 1;
    else high = middle;
  }
  return low < grid->cells && grid->cell_key[low] == key ? low : -1;
}

/* 1 if `other` hides the point at `place`: beyond it, within `half_width` (over h) to the sides. */
static int hides(const Mpm *mpm, MpmVec other, MpmVec place, const MpmTraction *traction, const double half_width[3]) {
  for (int i = 0; i < mpm->scene.dimension; i++) {
    const double offset = (other[1 + i] - place[1 + i]) * mpm->per_length[1 + i];
    if (i == traction->axis) {
      const double beyond = traction->side * offset;
      if (!(beyond > half_width[i] && beyond < 1.5)) return 0;
    } else if (!(fabs(offset) < 0.999 * half_width[i])) return 0;
  }
  return 1;
}

static int is_hidden_by_cell(const Mpm *mpm, uint64_t key, MpmVec place, const MpmTraction *traction,
                             const double half_width[3]) {
  const int cell = find_cell(&mpm->grid, key);
  if (cell < 0) return 0;
  const MpmRuns runs = mpm_cell_runs(mpm, cell);
  for (int r = 0; r < runs.count; r++) {
    const int *run = runs.run ? runs.run[r] : runs.own;
    for (int k = run[0]; k < run[1]; k++)
      if (hides(mpm, mpm->points.position[k], place, traction, half_width)) return 1;
  }
  return 0;
}

/* Cells are offset by half a domain (uGIMP), so that a point 1.5 h further lies at most two cells further. */
static int is_outermost(const Mpm *mpm, uint64_t key, MpmVec place, const MpmTraction *traction,
                        const double half_width[3]) {
  const int axis = traction->axis, first = (axis + 1) % mpm->scene.dimension, second = (axis + 2) % 3;
  const int depth = mpm->scene.dimension == 3;
  for (int along = 0; along <= 2; along++)
    for (int b = -1; b <= 1; b++)
      for (int c = -depth; c <= depth; c++) {
        int64_t shift = ((int64_t)(traction->side * along) * (INT64_C(1) << (axis * MPM_KEY_BITS)));
        shift += b * (INT64_C(1) << (first * MPM_KEY_BITS));
        if (depth) shift += c * (INT64_C(1) << (second * MPM_KEY_BITS));
        if (is_hidden_by_cell(mpm, key + (uint64_t)shift, place, traction, half_width)) return 0;
      }
  return 1;
}

static void add_one(Mpm *mpm, const MpmTraction *traction, MpmVec *load) {
  const MpmPoints *p = &mpm->points;
  const int dimension = mpm->scene.dimension, width = mpm_load_width(mpm);
  for (int k = 0; k < p->own; k++) {
    const double volume = mpm_row_volume(mpm, k);
    double f[9], half_width[3], area = 0.0, vector[3] = {0.0, 0.0, 0.0}, unused[3];
    mpm_row_deformation(mpm, k, f);
    for (int i = 0; i < dimension; i++) {
      const int is_axis = i == traction->axis;
      const double normal[3] = {i == 0, i == 1, i == 2};
      const double face = mpm_face_area(&p->home[p->slot[k]], f, normal, is_axis ? vector : unused);
      half_width[i] = 0.5 * volume / face * mpm->per_length[1 + i];
      if (is_axis) area = face;
    }
    if (!is_outermost(mpm, p->key[k], p->position[k], traction, half_width)) continue;
    MpmVec *force = &load[(size_t)k * (size_t)width];
    for (int i = 0; i < dimension; i++) {
      if (i != traction->axis) (*force)[1 + i] += traction->traction[i] * area;
      (*force)[1 + i] += traction->traction[traction->axis] * vector[i];
    }
  }
}

/* load holds -V sigma_ij / h_j: the stress of the points is measured from that of the pressure. */
static void add_surface_pressure(const Mpm *mpm, double pressure, MpmVec *load) {
  const int dimension = mpm->scene.dimension, width = mpm_load_width(mpm);
  for (int k = 0; k < mpm->points.live; k++) {
    MpmVec *slope = load + (size_t)k * (size_t)width + 1;
    const double volume = mpm_row_volume(mpm, k);
    for (int i = 0; i < dimension; i++) slope[i][1 + i] -= volume * mpm->per_length[1 + i] * pressure;
  }
}

void mpm_traction_add(Mpm *mpm, MpmVec *load) {
  for (int t = 0; t < mpm->traction_count; t++) {
    const MpmTraction *traction = &mpm->tractions[t];
    if (traction->surface) add_surface_pressure(mpm, traction->pressure, load);
    else add_one(mpm, traction, load);
  }
}
