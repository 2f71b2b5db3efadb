/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Traction on the outermost layer of points (errata A.6): a point belongs to it if no other point lies beyond it, seen
 * along the axis within half a point's width to the sides. Its face has the area V / h, h being the point's own width.
 * The normal component of the traction acts along the face's current normal, as a pressure does (a force of fixed
 * direction would turn a body that is free to turn); the tangential components act along their axes. Or a pressure on the whole surface, see mpm.h. */
#include <math.h>

#include "../base/tensor.h"
#include "mpm_core.h"

static int find_cell(const MpmGrid *grid, uint64_t key) {
  int low = 0, high = grid->cells;
  while (low < high) {
    const int middle = low + (high - low) / 2;
    if (grid->cell_key[middle] < key) low = middle + 1;
    else high = middle;
  }
  return low < grid->cells && grid->cell_key[low] == key ? low : -1;
}

/* 1 if point k of a cell hides the point at `place`: beyond it, within `half_width` to the sides (all over h). */
static int hides(const Mpm *mpm, const double *other, const double *place, const MpmTraction *traction,
                 const double half_width[3]) {
  for (int i = 0; i < mpm->scene.dimension; i++) {
    const double offset = other[i] - place[i];
    if (i == traction->axis) {
      const double beyond = traction->side * offset;
      if (!(beyond > half_width[i] && beyond < 1.5)) return 0;
    } else if (!(fabs(offset) < 0.999 * half_width[i])) return 0;
  }
  return 1;
}

static int is_hidden_by_cell(const Mpm *mpm, uint64_t key, const double *place, const MpmTraction *traction,
                             const double half_width[3]) {
  const int cell = find_cell(&mpm->grid, key);
  if (cell < 0) return 0;
  for (int k = mpm->grid.cell_first[cell]; k < mpm->grid.cell_first[cell + 1]; k++)
    if (hides(mpm, mpm->points.place[k], place, traction, half_width)) return 1;
  return 0;
}

/* Cells are offset by half a domain (uGIMP), so that a point 1.5 h further lies at most two cells further. */
static int is_outermost(const Mpm *mpm, uint64_t key, const double *place, const MpmTraction *traction,
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

static void add_one(Mpm *mpm, const MpmTraction *traction, const MpmPoint *points, MpmVec *load) {
  const MpmPoints *sorted = &mpm->points;
  const int dimension = mpm->scene.dimension, width = mpm_load_width(mpm);
  for (int k = 0; k < sorted->count; k++) {
    const int slot = sorted->item[k].slot;
    if (slot >= sorted->own) continue;
    const MpmPoint *point = &points[slot];
    const double volume = point->volume0 * tensor_determinant(point->deformation_gradient);
    double half_width[3], area = 0.0, vector[3] = {0.0, 0.0, 0.0}, unused[3];
    for (int i = 0; i < dimension; i++) {
      const int is_axis = i == traction->axis;
      const double normal[3] = {i == 0, i == 1, i == 2}, face = mpm_face_area(point, normal, is_axis ? vector : unused);
      half_width[i] = 0.5 * volume / face * mpm->inverse_spacing;
      if (is_axis) area = face;
    }
    if (!is_outermost(mpm, sorted->item[k].cell, sorted->place[k], traction, half_width)) continue;
    MpmVec *force = &load[(size_t)slot * (size_t)width];
    for (int i = 0; i < dimension; i++) {
      if (i != traction->axis) (*force)[1 + i] += traction->traction[i] * area;
      (*force)[1 + i] += traction->traction[traction->axis] * vector[i];
    }
  }
}

/* load holds -V sigma_ij / h: the stress of the points is measured from that of the pressure. */
static void add_surface_pressure(const Mpm *mpm, double pressure, const MpmPoint *points, MpmVec *load) {
  const int dimension = mpm->scene.dimension, width = mpm_load_width(mpm);
  for (int s = 0; s < mpm->points.live; s++) {
    const double volume = points[s].volume0 * tensor_determinant(points[s].deformation_gradient);
    MpmVec *slope = load + (size_t)s * (size_t)width + 1;
    for (int i = 0; i < dimension; i++) slope[i][1 + i] -= volume * mpm->inverse_spacing * pressure;
  }
}

void mpm_traction_add(Mpm *mpm, const MpmPoint *points, MpmVec *load) {
  for (int t = 0; t < mpm->traction_count; t++) {
    const MpmTraction *traction = &mpm->tractions[t];
    if (traction->surface) add_surface_pressure(mpm, traction->pressure, points, load);
    else add_one(mpm, traction, points, load);
  }
}
