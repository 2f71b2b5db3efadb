/* SPDX-License-Identifier: GPL-2.0-or-later */
/* A periodic network of thermal resistors between grains, and its conductivity tensor. Knows nothing of packings. */
#ifndef DEMPM_RVE_NETWORK_H
#define DEMPM_RVE_NETWORK_H

#include "../base/base.h"

#ifdef __cplusplus
extern "C" {
#endif

/* One resistor. A grain may be linked to its own image (pair[0] == pair[1]). */
typedef struct RveLink {
  int32_t pair[2];
  double branch[3];   /* m, from the first grain to the linked image of the second; 0 along z in 2D */
  double conductance; /* W/K, >= 0 */
} RveLink;

/* Start from all zeros. The memory is kept from use to use. */
typedef struct RveNetwork {
  int links, link_room;
  RveLink *link; /* [links] */
  /* of rve_network_solve() */
  int grain_room, entry_room;
  int32_t *first, *column;            /* [grains + 1], [2 links]: the Laplacian's rows */
  double *weight, *inverse_diagonal;  /* [2 links] W/K; [grains] K/W, 0 for a grain without links */
  double *rise[3];                    /* [grains] m: temperature less the affine one, for a unit mean gradient */
  double *work[4];                    /* [grains] */
} RveNetwork;

void rve_network_destroy(RveNetwork *network); /* accepts all zeros */
/* Appends a link. BASE_ERROR_MEMORY. */
BaseStatus rve_network_add(RveNetwork *network, const RveLink *link);

/* k, W/(m K), xx yy zz xy xz yz, of a cell of this volume (m3), if all temperatures were affine: (1/V) sum h b (x) b (TM-DEMPM
 * eq. 34 corrected). An upper bound: no direction conducts better. */
void rve_network_affine(const RveNetwork *network, int dimension, double volume, double k[6]);

/* The same with the temperatures that the links themselves bring about: T_i = g.x_i + t_i with a given mean gradient g, and
 * sum_j h_ij (g.b_ij + t_j - t_i) = 0 at each of the `grains` grains. The Laplacian is singular (a constant in each cluster
 * of grains), but its right-hand sides are sums of +- pairs, so that they and all iterates stay in its range. Conjugate
 * gradients with Jacobi's preconditioner in a fixed order, until the residual is 1e-12 of the flows that meet at the grains
 * (preconditioner's norm). k is the dissipation of the temperatures found, whose error goes with the square of the residual,
 * and never below the exact k. BASE_ERROR_UNSTABLE: no solution within 100 + 20 iterations per grain; BASE_ERROR_MEMORY. */
BaseStatus rve_network_solve(RveNetwork *network, int grains, int dimension, double volume, double k[6]);

#ifdef __cplusplus
}
#endif
#endif
