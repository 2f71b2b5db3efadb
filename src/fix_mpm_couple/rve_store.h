/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The RVEs that one rank holds: batches of the RVE engine behind handles that stay valid while RVEs come and go.
 * No MPI. */
#ifndef DEMPM_RVE_STORE_H
#define DEMPM_RVE_STORE_H

#include "../cuda_rve/rve_replay.h"
#include "rve_rest.h"

typedef struct RveStore RveStore;

/* What the store remembers of an RVE besides its state in the engine. */
typedef struct RveStoreItem {
  int64_t tag;        /* of its material point */
  int packing;        /* index of the packing it started from */
  int grains;
  double scale;       /* volume of the material point / of the RVE; NAN until told. Constant: both deform alike */
  double dissipation; /* of the last step, slip and damping, W/m3 of current volume */
  RveAnswer answer;   /* last one */
  RveRest rest;       /* woken by the store when it makes or changes the RVE, else the law's */
} RveStoreItem;

/* Copies scene and packings. BASE_ERROR_ARGUMENT (scene or packing wrong), BASE_ERROR_MEMORY. */
BaseStatus rve_store_create(const RveScene *scene, const RvePacking *packings, int packing_count, RveBackend backend,
                            RveStore **store);
void rve_store_destroy(RveStore *store); /* accepts NULL */

/* Creates n RVEs from packings[packing[k]] for material points tag[k]; handle [n] out. On an error none is created. */
BaseStatus rve_store_add(RveStore *store, int n, const int64_t *tag, const int *packing, int *handle);
/* Forgets an RVE; its memory is used again when RVEs are added later. */
void rve_store_release(RveStore *store, int handle);
RveStoreItem *rve_store_item(RveStore *store, int handle);
/* The next living handle after `handle` (-1: the first); -1 at the end. */
int rve_store_next(const RveStore *store, int handle);
const RveScene *rve_store_scene(const RveStore *store);
const RvePacking *rve_store_packings(const RveStore *store, int *count);

/* Room for steps of n RVEs: nothing is allocated inside rve_store_step() then. */
BaseStatus rve_store_reserve(RveStore *store, int n);
/* Advances RVEs handle[0..n), each named once, by `duration` s; answers are left in the items.
 * BASE_ERROR_UNSTABLE: *unstable is the handle of the one with the lowest tag; -1 else. */
BaseStatus rve_store_step(RveStore *store, int n, const int *handle, const RveInput *input, double duration,
                          int *unstable);
/* States are kept from now on (rve_batch_keep_states()), so that failures can be written. */
void rve_store_keep_states(RveStore *store);
/* What the watchdog saw, and the failure's replay file: rve_batch_failure(), rve_batch_write_replay() with the tag. */
BaseStatus rve_store_failure(const RveStore *store, int handle, RveFailure *failure);
BaseStatus rve_store_write_replay(const RveStore *store, int handle, const char *file);
/* Answers for the present state, without stepping, into the items of all RVEs. */
BaseStatus rve_store_refresh(RveStore *store);

/* As the functions of the same name in rve.h, for all RVEs. */
BaseStatus rve_store_set_scene(RveStore *store, const RveScene *scene);
BaseStatus rve_store_install_bonds(RveStore *store);
BaseStatus rve_store_rest(RveStore *store);

/* As the functions of the same name in rve.h, for one RVE. */
size_t rve_store_state_bytes(const RveStore *store, int handle);
BaseStatus rve_store_pack(const RveStore *store, int handle, void *bytes, size_t *written);
BaseStatus rve_store_unpack(RveStore *store, int handle, const void *bytes, size_t size);
BaseStatus rve_store_view(const RveStore *store, int handle, RveView *view);

typedef struct RveStoreTotals {
  int64_t grains;         /* of RVEs present */
  int64_t particle_steps; /* grains times DEM steps, since the store was created */
  int64_t calls, shared;  /* steps of RVEs, and how many of them were copies of a twin's (of the batches present) */
  int64_t solved, kept;   /* networks: solved, and carried along from an earlier solution (of the batches present) */
  int64_t flown;          /* how many were free flights, copies excepted */
  double seconds;         /* wall time in the RVE engine's steps since then */
} RveStoreTotals;
void rve_store_totals(const RveStore *store, RveStoreTotals *totals);
/* 1 if a device was to be used (any backend but CPU), but does not hold all RVEs: its memory is too small. */
int rve_store_left_device(const RveStore *store);
BaseStatus rve_store_leave_device(RveStore *store); /* all RVEs go on on the CPU, new ones too */
const char *rve_store_backend_name(const RveStore *store); /* "" without RVEs */

#endif
