/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Conduction in an RVE: the links between its grains, and when its conductivity is worked out anew. On the host. */
#ifndef DEMPM_RVE_CONDUCTION_H
#define DEMPM_RVE_CONDUCTION_H

#include "rve_backend.h"
#include "rve_network.h"

/* One thread's memory and what it counted. */
typedef struct RveConductionWork {
  RveNetwork network;
  int64_t solved, kept;
} RveConductionWork;

/* 1 if the scene's conductivity is not simply the kernels' sum over heat pipes. */
int rve_conduction_is_own(const RveScene *scene);
/* 1 if both scenes ask for the same conductivity. */
int rve_conduction_is_same(const RveScene *a, const RveScene *b);
/* Nothing is known: the next answer is worked out. */
void rve_conduction_forget(RveConduction *conduction);
/* Completes record->last after the kernels' measure of a call of `duration` with this input (both 0: the present state is
 * asked for again, and answered as before). BASE_ERROR_UNSTABLE: the network could not be solved; BASE_ERROR_MEMORY. */
BaseStatus rve_conduction_answer(RveRecord *record, const RveScene *scene, const RveInput *input, double duration,
                                 RveConductionWork *work);

#endif
