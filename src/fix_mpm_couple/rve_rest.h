/* SPDX-License-Identifier: GPL-2.0-or-later */
/* RVEs of points at rest are not run: while the strain since the last evaluation is so small that an elastic estimate of the
 * stress cannot be off by more than a stated error, that estimate is the answer. Plain C, local. */
#ifndef DEMPM_RVE_REST_H
#define DEMPM_RVE_REST_H

#include "../cuda_rve/rve.h"

/* What one RVE needs for it. 8-byte members only: it is kept in restart files as it is. */
typedef struct RveRest {
  double deformation[9]; /* sum of L dt since the last evaluation */
  double stress[6];      /* present answer, Pa: of the evaluation, or estimated since */
  double evaluated_temperature, temperature; /* at the last evaluation, at the last call */
  double elastic;        /* Pa, modulus times the strain that the evaluation under way is to judge */
  double prepared;       /* Pa, mean pressure of the packing as it was made: a hundredth of it is the least scale of stress */
  double distrust;       /* error of the estimate over its elastic part, as the last evaluations showed it; 0 to 1 */
  int64_t skipped;       /* calls since the last evaluation */
  int64_t calm;          /* evaluations in a row that the estimate met */
} RveRest;

/* Zeroed before the first call. Before the first evaluation, or after the RVE was changed from outside: the next calls are evaluated. */
void rve_rest_wake(RveRest *rest, const RveScene *scene, const RveAnswer *answer, double temperature);

/* 1: this call need not be run, *rest holds the answer. 0: run it with *input, whose velocity gradient now brings the
 * deformation of the skipped calls too, and judge the answer. error: of the stress, relative to the mean pressure of the
 * last evaluation (or to a hundredth of the packing's first one, if that is more); 0 = every call is run. */
int rve_rest_skips(RveRest *rest, const RveScene *scene, const RveAnswer *last, double error, double duration,
                   RveInput *input);

/* After the evaluation of a call that was not skipped, at `temperature`. */
void rve_rest_judge(RveRest *rest, const RveScene *scene, const RveAnswer *answer, double error, double temperature);

#endif
