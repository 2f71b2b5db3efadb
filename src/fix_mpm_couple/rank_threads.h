/* SPDX-License-Identifier: GPL-2.0-or-later */
/* How many OpenMP threads a rank may use without taking cores from the other ranks of its node. */
#ifndef DEMPM_RANK_THREADS_H
#define DEMPM_RANK_THREADS_H

#include <mpi.h>

#ifdef __cplusplus
extern "C" {
#endif

/* This rank's share of the cores that its node lets it run on, at least 1: cores allowed to several ranks are
 * divided among them, so that bound ranks (mpirun's default) and free ones both use every core once. Collective. */
int rank_threads(MPI_Comm comm);

#ifdef __cplusplus
}
#endif
#endif
