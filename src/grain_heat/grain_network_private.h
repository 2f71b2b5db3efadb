/* SPDX-License-Identifier: GPL-2.0-or-later */
/* What the solver shares with the network. */
#ifndef DEMPM_GRAIN_NETWORK_PRIVATE_H
#define DEMPM_GRAIN_NETWORK_PRIVATE_H

#include "grain_network.h"

/* Knuth's two-sum: `low` collects what each addition to `high` rounds away. */
void grain_network_add(GrainSum *sum, double x);
/* Sum of all conductances of a grain, W/K. */
double grain_network_sum(const GrainNetwork *network, int grain);
/* The temperature to which `heat` (J) takes a grain from T. */
double grain_network_warm(const GrainNetwork *network, int grain, double T, double heat);

#endif
