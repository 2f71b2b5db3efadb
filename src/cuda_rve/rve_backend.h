/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Between the batch (host, plain C) and the kernels (per instruction set, CUDA), and between the batch's own files. */
#ifndef DEMPM_RVE_BACKEND_H
#define DEMPM_RVE_BACKEND_H

#include "rve_state.h"

#ifdef __cplusplus
extern "C" {
#endif

/* The kernels of one instruction set. */
typedef struct RveKernels {
  const char *name;
  int lanes;
  int row[2], reaction[2]; /* RveCounts' entries in 2D and in 3D */
  /* Returns an RveOutcome. */
  int (*run)(RveFeatures features, const RveCall *call, void *arena, const RveCounts *counts, RveScratch *scratch);
  void (*measure)(RveFeatures features, const RveCall *call, void *arena, const RveCounts *counts, double work_before,
                  double duration, RveAnswer *answer);
} RveKernels;
extern const RveKernels rve_kernels_plain;
#if defined(__x86_64__)
extern const RveKernels rve_kernels_avx2, rve_kernels_avx512, rve_kernels_avx512_whole, rve_kernels_avx512_mixed;
#endif

/* The device. Arenas live there; all functions work on a whole batch. */
typedef struct RveDevice RveDevice;
typedef struct RveDeviceJob {
  int rve;     /* which RVE */
  int refresh; /* 1: only forces of the present state; works done stay as they are */
  int pairs;   /* candidate pairs to have room for */
  int outcome; /* out: RveOutcome */
  RveCall call;
  RveInput input; /* of the call, for the host */
  double work_before, duration;
  RveAnswer answer; /* in: the last one; out */
} RveDeviceJob;

BaseStatus rve_device_create(const RveKernels **layout, RveDevice **device);
void rve_device_destroy(RveDevice *device);
/* (Re)places RVE k's arena on the device by a copy of the host's `arena`. After BASE_ERROR_MEMORY the device has none. */
BaseStatus rve_device_upload(RveDevice *device, int rve, const RveCounts *counts, size_t bytes, const void *arena);
int rve_device_holds(const RveDevice *device, int rve); /* 1 if RVE k's arena is there */
BaseStatus rve_device_download(RveDevice *device, int rve, void *arena);
/* Runs and measures all jobs. BASE_ERROR_MEMORY: nothing has run. */
BaseStatus rve_device_run(RveDevice *device, RveFeatures features, RveDeviceJob *jobs, int count);

/* What an RVE remembers of its conductivity (rve_conduction.h). 8-byte members only: it is stored as it is. */
typedef struct RveConduction {
  double tensor[6], affine[6];                  /* of the last answer, W/(m K) */
  double solved_affine[6], solved_network[6];   /* when the network was solved */
  double path;                                  /* integral of |L| dt since then */
  int64_t has_solution;
  int64_t age; /* calls since the last answer was worked out; -1: there is none */
} RveConduction;

/* One RVE on the host. */
typedef struct RveRecord {
  RveCounts counts;
  RveArrays arrays;
  void *arena; /* on the host; with a device: a copy that may be old */
  size_t bytes;
  RveAnswer last;
  RveConduction conduction;
} RveRecord;

/* rve_state.c, rve_restart.c, rve_view.c, rve_conduction.c */
RveCounts rve_counts_for(const RveKernels *kernels, int dimension, int grains); /* before anything is known of the list */
BaseStatus rve_record_from_packing(const RveKernels *kernels, const RveScene *scene, const RvePacking *packing,
                                   RveRecord *record);
void rve_record_destroy(RveRecord *record);
BaseStatus rve_record_alloc(const RveCounts *counts, RveRecord *record);
/* A larger arena with the same contents; at least the head's need_* rows. */
BaseStatus rve_record_grow(RveRecord *record);
size_t rve_record_state_bytes(const RveRecord *record);
BaseStatus rve_record_pack(const RveRecord *record, uint64_t scene_hash, void *bytes, size_t *written);
/* *record is replaced on success only. *canonical = 1: another lane width, forces and list must be made anew. */
BaseStatus rve_record_unpack(const RveKernels *kernels, uint64_t scene_hash, const void *bytes, size_t size,
                             RveRecord *record, int *canonical);
/* *to: a new record with the state of `from` for other kernels. A call that was interrupted goes on where it stood; else
 * forces and list must be made anew. */
BaseStatus rve_record_convert(const RveKernels *kernels, const RveRecord *from, RveRecord *to);
BaseStatus rve_record_view(const RveRecord *record, RveView *view);
BaseStatus rve_record_packing(const RveRecord *record, RvePacking *packing);
void rve_record_install_bonds(RveRecord *record);
void rve_record_rest(RveRecord *record);
void rve_record_set_rotation(RveRecord *record, const RveScene *scene); /* inertia follows scene.rotation */
BaseStatus rve_record_conduct(const RveRecord *record, const RveScene *scene, double time_step, int64_t steps,
                              double *temperature);
uint64_t rve_scene_hash(const RveScene *scene); /* of what a stored state depends on */

/* rve_scene.c: what one call asks for. BASE_ERROR_ARGUMENT if it would take absurdly many steps. */
BaseStatus rve_call_make(const RveScene *scene, const RveHead *head, const RveInput *input, double duration,
                         RveCall *call);
RveFeatures rve_scene_features(const RveScene *scene);

#ifdef __cplusplus
}
#endif
#endif
