/* SPDX-License-Identifier: GPL-2.0-or-later */
/* What the watchdog saw when an RVE became unstable, and files from which the failure can be repeated. */
#ifndef DEMPM_RVE_REPLAY_H
#define DEMPM_RVE_REPLAY_H

#include "rve.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { RVE_CAUSE_BYTES = 384, RVE_NAME_BYTES = 64 };

/* When and why an RVE failed. */
typedef struct RveFailure {
  int64_t step;                /* DEM step since creation at which the watchdog spoke, counted from 1 */
  int64_t call_step;           /* the same within the call that failed; 0 if the failure is older than this batch */
  int64_t call_steps;          /* DEM steps that call was to run */
  char cause[RVE_CAUSE_BYTES]; /* grain (counted from 1, as the packing's), what was found, what is allowed */
} RveFailure;

/* BASE_ERROR_ARGUMENT if the RVE does not exist or has not failed. */
BaseStatus rve_batch_failure(const RveBatch *batch, int rve, RveFailure *failure);

/* keep = 1: from now on a failed RVE keeps the state it had before the call, so that a replay can be written. Costs one
 * copy of the state per RVE and call, into memory of the thread, and nothing else until an RVE fails. Calls of fewer than
 * 100 DEM steps are copied only when the packing moves or strains visibly. Off at first. CPU only: on a device no states
 * are kept. */
void rve_batch_keep_states(RveBatch *batch, int keep);

/* Writes state before the failing call, input, duration, scene and failure of a failed RVE. name (may be NULL): what
 * the RVE is called outside, at most RVE_NAME_BYTES - 1 bytes are kept. BASE_ERROR_ARGUMENT if the RVE has not failed or
 * its state was not kept (too calm before the call); BASE_ERROR_FILE. */
BaseStatus rve_batch_write_replay(const RveBatch *batch, int rve, const char *name, const char *file);

typedef struct RveReplay {
  RveScene scene;
  RveInput input;
  double duration; /* s */
  RveFailure failure;
  char name[RVE_NAME_BYTES];
  char backend[RVE_BACKEND_BYTES]; /* as rve_batch_backend_name(): only the same one repeats the failure bit for bit */
  void *state;      /* for rve_batch_unpack() */
  size_t bytes;
} RveReplay;

/* BASE_ERROR_FILE, BASE_ERROR_FORMAT (truncated, altered, of another version). */
BaseStatus rve_replay_read(const char *file, RveReplay *replay);
void rve_replay_destroy(RveReplay *replay); /* accepts NULL */
/* A batch of one RVE in the state before the failing call. scene: the replay's, or a changed one. */
BaseStatus rve_replay_start(const RveReplay *replay, const RveScene *scene, RveBatch **batch);

#ifdef __cplusplus
}
#endif
#endif
