/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Grains at rest as a network of conductances whose geometry is set up once: heat flows, explicit steps, implicit steps
 * and steady states. One rank's part; what others know comes by GrainRanks.
 *
 * C_i dT_i/dt = SUM_j h_ij (T_j - T_i) + SUM_b h_b (T_b - T_i) + s_i, with baths b: walls, fluid, surroundings.
 * h = conduction + area * grain_emission() at the temperatures of both ends; conduction and C may depend on them, too
 * (GrainChange). */
#ifndef DEMPM_GRAIN_NETWORK_H
#define DEMPM_GRAIN_NETWORK_H

#include <stdbool.h>
#include <stdint.h>

#include "grain_heat.h"

#ifdef __cplusplus
extern "C" {
#endif

/* One side of a pair: `grain` of this rank receives h (T_other - T_grain). A pair of two grains of this rank is two
 * links with the same bits of h. */
typedef struct GrainLink {
  int grain, other;   /* `other` may be beyond the grains of this rank: a copy of another's, or of a periodic image */
  int64_t order;      /* links of a grain are sorted by this: sums then do not depend on how grains are stored */
  double conduction;  /* W/K, >= 0 */
  double area;        /* of radiation, m2, >= 0 */
} GrainLink;

typedef enum GrainBathKind {
  GRAIN_BATH_CONVECTION,
  GRAIN_BATH_RADIATION,
  GRAIN_BATH_WALL,
  GRAIN_BATH_KINDS
} GrainBathKind;

typedef struct GrainBath {
  int grain;
  GrainBathKind kind;
  double conduction;  /* W/K */
  double area;        /* of radiation, m2 */
  double temperature;
  double conductance; /* W/K, by grain_network_refresh() */
} GrainBath;

struct GrainNetwork;
/* Properties over temperature. */
typedef struct GrainChange {
  void *context;
  /* Sets conduction (of links and baths) and capacity to those at the temperatures T, copies included. NULL: constant. */
  void (*renew)(void *context, struct GrainNetwork *network, const double *T);
  /* The temperature to which `heat` (J) takes a grain from T. NULL: T + heat / capacity. */
  double (*warm)(void *context, int grain, double T, double heat);
} GrainChange;

typedef struct GrainNetwork {
  int grains;         /* of this rank; arrays of temperatures may be longer, by the copies */
  int *first;         /* [grains + 1] into other, conductance */
  int *other;
  double *conduction, *area; /* W/K, m2 */
  double *conductance; /* W/K, by grain_network_refresh() */
  double *capacity;    /* [grains] m c, J/K, to be set after creation or by renew(); 0: the grain keeps its temperature */
  int copies, baths;
  GrainBath *bath;
  double *own;   /* [grains] sum of the conductances of a grain's baths, W/K */
  double *slope; /* [grains] derivative of the heat that a grain gives to its baths, W/K */
  /* To be set after creation: */
  double absolute_zero; /* of the scale of temperatures */
  bool varies;          /* conductances or capacities depend on temperatures, on some rank: all ranks agree */
  GrainChange change;
  double *work; /* of the solver */
} GrainNetwork;

/* Sorts `links` and keeps copies of both lists. `copies`: temperatures beyond those of the grains.
 * BASE_ERROR_MEMORY. */
BaseStatus grain_network_create(int grains, int copies, int64_t links, GrainLink *link, int baths,
                                const GrainBath *bath, GrainNetwork **network);
void grain_network_destroy(GrainNetwork *network); /* accepts NULL */

/* Conductances (and capacities) at the temperatures T, copies included, and their sums over baths. Needed after
 * creation, and before each explicit step of a network that varies. */
void grain_network_refresh(GrainNetwork *network, const double *T);
/* min C / sum h over the grains of this rank, s; HUGE_VAL if nothing conducts. An explicit step up to it keeps each new
 * temperature between those around it. *grain: the grain it belongs to, -1 if none. */
double grain_network_time_step(const GrainNetwork *network, int *grain);

/* A sum that is rounded once, at the end: high + low. */
typedef struct GrainSum {
  double high, low;
} GrainSum;

/* heat [grains], W: into each grain from others and from baths, at temperatures T. flows [GRAIN_BATH_KINDS], W: from
 * baths into the grains of this rank. */
void grain_network_flow(const GrainNetwork *network, const double *T, double *heat, GrainSum *flows);
/* Heat of a step into the grains: T += (heat + source) step / C, or by change.warm(). */
void grain_network_advance(const GrainNetwork *network, double step, const double *heat, const double *source,
                           double *T);

/* Ways to the other ranks; called by all of them the same number of times. */
typedef struct GrainRanks {
  void *context;
  void (*spread)(void *context, double *values); /* values of grains to their copies, here and elsewhere */
  void (*sum)(void *context, int count, GrainSum *sums); /* over all ranks, the same bits on all */
} GrainRanks;

typedef struct GrainSolution {
  int iterations;  /* of the conjugate gradients, in all linearisations */
  int renewals;    /* linearisations: 1 if the network does not vary, 0 if there was nothing to do */
  double residual; /* heat that is not balanced, over the heat that flows through grains (norms weighted by 1/C) */
} GrainSolution;

/* Backward Euler: (heat that takes T0 to T) / step = flows at T + source; step = HUGE_VAL: the steady state. T (with its
 * copies) goes from T0 to T. Conjugate gradients, until the residual is below `tolerance` or lost in round-off. The
 * capacity is the preconditioner: no iterate then changes the heat of grains that no bath reaches, which is kept to
 * round-off whatever the tolerance. A group of grains without baths so has a steady state, its mean; with sources it has
 * none: BASE_ERROR_UNSTABLE after `most` iterations, on all ranks.
 *
 * A network that varies: Picard iteration. Each linearisation has the conductances of the links at the last temperatures
 * (the matrix stays symmetric), Newton's capacities and slopes of the baths; its correction is brought in as heat, so
 * that this is kept with capacities over temperature, too, and halved until the residual falls. The residual is that of
 * the flows at T, to the same tolerance. BASE_ERROR_UNSTABLE if no correction makes it fall, or after 100. */
BaseStatus grain_network_solve(GrainNetwork *network, const GrainRanks *ranks, double step, double tolerance, int most,
                               const double *source, double *T, GrainSolution *solution);

#ifdef __cplusplus
}
#endif
#endif
