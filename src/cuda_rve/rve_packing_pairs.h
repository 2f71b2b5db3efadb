/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Internal to the packing files: geometry of a packing's cell and its pairs of near grains. */
#ifndef DEMPM_RVE_PACKING_PAIRS_H
#define DEMPM_RVE_PACKING_PAIRS_H

#include "rve_packing.h"

enum { PACKING_CRYSTAL_GRAINS = 16 /* up to so many grains all images of a pair are visited, not the nearest only */ };

/* Allocates the arrays of a packing of `grains` grains at rest; motion: velocity and spin too. BASE_ERROR_MEMORY. */
BaseStatus packing_create(int dimension, int grains, int motion, RvePacking *packing);

/* Called for each pair once, i <= j; branch = H (s_j - s_i + image), distance = |branch|. Not BASE_OK ends the visit.
 */
typedef BaseStatus (*PackingVisit)(void *context, int i, int j, const int image[3], const double branch[3],
                                   double distance);

/* Visits all pairs whose surfaces are nearer than `margin` (m). In a cell of more than PACKING_CRYSTAL_GRAINS grains whose heights
 * are at least twice the largest diameter plus margin only the nearest image can be; else all are tried. BASE_ERROR_ARGUMENT
 * if a cell is so flat that more than 17 images lie across a grain. */
BaseStatus packing_visit_pairs(const RvePacking *packing, double margin, PackingVisit visit, void *context);

/* Distances between opposite faces of the cell, m (2D: the third is 1). */
void packing_heights(const double cell[9], double height[3]);
/* Area (2D) or volume (3D) of the cell and of the grains, overlaps not removed. */
double packing_cell_measure(const RvePacking *packing);
double packing_grain_measure(const RvePacking *packing);
double packing_largest_radius(const RvePacking *packing);
/* s to [-0.5, 0.5). */
double packing_wrap(double fraction);

#endif
