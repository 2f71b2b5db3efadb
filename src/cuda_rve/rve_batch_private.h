/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The RveBatch as its own source files see it: rve_batch.c steps, rve_batch_states.c takes states in and out,
 * rve_batch_device.c runs them on a device, rve_watchdog.c says why an RVE failed. */
#ifndef DEMPM_RVE_BATCH_PRIVATE_H
#define DEMPM_RVE_BATCH_PRIVATE_H

#include "rve_conduction.h"
#include "rve_replay.h"

typedef struct RveWorkspace { /* one thread's */
  void *memory;
  size_t bytes;
  RveRecord before; /* the RVE as it was before the call, if kept = 1; its arena has room for `room` bytes */
  size_t room;
  int kept;
  const struct RveTwin *ahead; /* what this thread probably runs next, or NULL */
  RveConductionWork conduction;
} RveWorkspace;

/* All about a failed RVE. */
typedef struct RveFailed {
  RveFailure failure;
  RveScene scene;
  RveInput input;
  double duration;
  void *state; /* as rve_batch_pack() would have written it before the call; NULL if it was not kept */
  size_t bytes;
} RveFailed;

/* RVEs with the same history, sorted together; see rve_twins.c. */
typedef struct RveTwin {
  uint64_t history;
  const RveInput *input;
  int rve, leader; /* leader: the first of its kind */
  /* Its state as the call begins. Another thread may replace it meanwhile: for fetching into the cache only. */
  const char *arena;
  size_t bytes;
} RveTwin;

struct RveBatch {
  RveScene scene;
  RveFeatures features;
  const RveKernels *kernels;
  RveDevice *device; /* NULL on the CPU */
  int count;
  RveRecord *record;
  RveFailed **failed; /* [count], NULL while all is well */
  int keep;           /* states before calls */
  uint64_t *history;  /* [count] equal numbers: same packing, same calls */
  uint64_t histories; /* numbers used */
  int apart;          /* 1: RVEs went on without their histories being kept */
  RveTwin *twin;      /* [count] of the present call */
  int64_t shared;     /* RVE steps copied since creation */
  int64_t flown;      /* RVE steps that were free flights since then, copies excepted */
  int threads;
  RveWorkspace *workspace;
  RveDeviceJob *job; /* [count] on a device */
  char name[RVE_BACKEND_BYTES];
};

/* BASE_ERROR_ARGUMENT unless index[0..n) are RVEs of the batch (index NULL: its first n). */
BaseStatus rve_batch_check_index(const RveBatch *batch, int n, const int *index);

/* rve_batch.c: parts of a step on the host */
extern const RveInput rve_no_input; /* at rest, at 0 C */
int rve_batch_threads(const RveBatch *batch);
const RveKernels *rve_batch_host_kernels(const RveScene *scene);
int rve_record_pairs(const RveRecord *record); /* candidate pairs to have room for */
BaseStatus rve_batch_conduction(const RveBatch *batch, RveRecord *record, const RveInput *input, double duration,
                                RveWorkspace *workspace);
/* Lists, forces and answer of the present state, without time passing and without work done. */
BaseStatus rve_batch_refresh_one(const RveBatch *batch, RveRecord *record, RveWorkspace *workspace);
/* Runs a call, or goes on with one, and measures. */
BaseStatus rve_batch_run_call(RveBatch *batch, int rve, const RveCall *call, double work_before, const RveInput *input,
                              double duration, RveWorkspace *workspace);

/* rve_batch_device.c. When the device's memory is too small, these take all RVEs to the CPU and go on there; batch->device is NULL
 * afterwards. upload, download: RVE k to and from the device; nothing without one. */
BaseStatus rve_batch_choose_backend(RveBatch *batch, RveBackend backend);
BaseStatus rve_batch_upload(RveBatch *batch, int k);
BaseStatus rve_batch_download(const RveBatch *batch, int k);
BaseStatus rve_batch_refresh_there(RveBatch *batch, int n, const int *index);
BaseStatus rve_batch_step_there(RveBatch *batch, int n, const int *index, const RveInput *input, double duration);

/* Lists, forces and answers of RVEs index[0..n), after a change from outside. */
BaseStatus rve_batch_refresh(RveBatch *batch, int n, const int *index);

/* Sorts the call's RVEs by history and input into batch->twin[0..n). */
void rve_twins_sort(RveBatch *batch, int n, const int *index, const RveInput *input);
/* Gives the RVEs of a call, or one that was changed from outside, their new histories. */
void rve_twins_renew(RveBatch *batch, int n);
void rve_twins_leave(RveBatch *batch, int rve);
/* Makes RVE `to` equal to RVE `from`. */
BaseStatus rve_twins_copy(RveBatch *batch, int from, int to);

/* 1 if the record's state is worth a copy before this call. */
int rve_may_fail(const RveBatch *batch, const RveRecord *record, const RveCall *call);
/* Copies the record's state into the thread's memory. */
BaseStatus rve_keep_before(const RveRecord *record, RveWorkspace *workspace);
/* Finds out why the record failed in this call and remembers it, with the kept state if workspace is not NULL. */
BaseStatus rve_note_failure(RveBatch *batch, int rve, const RveCall *call, const RveInput *input, double duration,
                            const RveWorkspace *workspace);
/* BASE_ERROR_UNSTABLE with the RVE's number, DEM step and cause. */
BaseStatus rve_failure_error(const RveBatch *batch, int rve);
void rve_forget_failure(RveBatch *batch, int rve);

#endif
