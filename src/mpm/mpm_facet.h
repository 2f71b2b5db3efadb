/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The geometry of one facet of a surface. */
#ifndef DEMPM_MPM_FACET_H
#define DEMPM_MPM_FACET_H

#include "mpm.h"

/* Where a facet is nearest to a place. */
typedef struct MpmFacetNearest {
  double distance;    /* m, >= 0 */
  double height;      /* m, over the facet's plane, > 0 in front */
  double point[3];    /* of the facet */
  double velocity[3]; /* m/s, of the facet there */
  int is_inside;      /* the place projects into the facet or onto its edge */
  int is_rim;         /* not inside, and nearest is an edge or node that no other facet shares */
} MpmFacetNearest;

/* tolerance, m: how far outside of the facet still counts as on its edge. */
void mpm_facet_nearest(const MpmFacet *facet, int dimension, const double x[3], double tolerance,
                       MpmFacetNearest *nearest);

#endif
