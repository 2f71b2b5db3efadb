/* SPDX-License-Identifier: GPL-2.0-or-later */
/* RVEs as a constitutive law of the MPM core, spread over MPI ranks: the RVE farm. Plain C, knows nothing of
 * LIGGGHTS.
 *
 * An RVE never travels: it stays on the rank where it was created while its material point migrates. Each step
 * ships the velocity gradient and temperature of every point to its RVE's rank and the answer back.
 *
 * All functions are collective over the law's ranks unless they say "local", and return the same status with the
 * same message on all of them. */
#ifndef DEMPM_RVE_LAW_H
#define DEMPM_RVE_LAW_H

#include <mpi.h>

#include "../cuda_rve/rve.h"
#include "../mpm/mpm_law.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct RveLaw RveLaw;

/* Of the RVEs present, over all ranks, summed in the order of tags: alike bit for bit on any number of ranks (but
 * seconds). Works and energies are those of the material: J per RVE times volume of the point / volume of the RVE.
 * That ratio is constant because both deform alike; it is NAN, and with it these sums, until rve_law_set_volumes()
 * told the volumes. */
typedef struct RveLawTotals {
  int64_t rves, grains;    /* present */
  int64_t rves_run;        /* in the last step */
  int64_t particle_steps;  /* grains times DEM steps, since the law was created (not before a restart) */
  int64_t calls, shared;   /* steps of RVEs since then, and how many were copies of a twin's (depends on the ranks) */
  int64_t flown;           /* how many of the calls were free flights, answered in closed form, and no copies */
  int64_t rested;          /* steps that were not run since their points are at rest, not among the calls */
  int64_t networks_solved, networks_kept; /* conductivities of networks since then: solved, carried along from a solution */
  double worst_unbalanced; /* of the last step */
  double friction_work;    /* J, slip work since the RVEs were created (per metre of depth in 2D) */
  double damping_work;     /* J, lost to local and viscous damping, likewise */
  double stored_energy;    /* J, elastic + fluctuation, present */
  double seconds;          /* wall time spent in RVEs on the slowest rank since the law was created */
} RveLawTotals;

/* scene, packings are copied; point tag t gets packing packing_of_tag(t) = (t - 1) mod packing_count.
 * A GPU whose memory is too small on any rank: all RVEs go on on the CPU (rve_law_left_device). AUTO must find devices on all ranks or
 * on none. scene->threads = 0 and no OMP_NUM_THREADS: each rank takes its share of its node's cores. */
BaseStatus rve_law_create(MPI_Comm comm, const RveScene *scene, const RvePacking *packings, int packing_count,
                          RveBackend backend, RveLaw **law);
void rve_law_destroy(RveLaw *law); /* accepts NULL */

/* Gives every tag on any rank that has none an RVE, so that all ranks hold equally many (+-1 unless RVEs were
 * forgotten); forgets RVEs whose tag is gone. tags [n] are this rank's points. Called by the fix when the set of
 * points changed. rve_law_update itself adds RVEs for tags that it does not know, but forgets none.
 * BASE_ERROR_ARGUMENT: a tag below 1 or twice; BASE_ERROR_MEMORY, BASE_ERROR_DEVICE. */
BaseStatus rve_law_assign(RveLaw *law, int n, const int64_t *tags);

/* Tells the present volumes of this rank's points, m3 (2D: m2 times unit depth), volumes [n] > 0, to the RVEs of
 * tags [n]; once for each new point, before its first step or at any time later. Kept by rve_law_pack(). Used only
 * by the totals. */
BaseStatus rve_law_set_volumes(RveLaw *law, int n, const int64_t *tags, const double *volumes);

/* MpmLaw view: content is the RveLaw, destroy is rve_law_destroy. update: BASE_ERROR_UNSTABLE names the lowest tag
 * whose RVE failed, with the DEM step and the cause. Local. */
void rve_law_as_mpm_law(RveLaw *law, MpmLaw *mpm_law);

/* An RVE that becomes unstable is written to `directory`/rve_TAG.replay, for dempm-rve replay: of each rank the one with
 * the lowest tag. NULL (so at first): none. The directory is not created. Local; BASE_ERROR_MEMORY. */
BaseStatus rve_law_set_replay(RveLaw *law, const char *directory);

/* RVEs whose points rest are not run: their stress is estimated while its error stays below `error` times their mean pressure
 * (rve_rest.h). 0 (so at first): all are run. Local. */
void rve_law_set_rest(RveLaw *law, double error);

BaseStatus rve_law_totals(RveLaw *law, RveLawTotals *totals);
BaseStatus rve_law_set_scene(RveLaw *law, const RveScene *scene);
/* Of all RVEs present; RVEs that are created later have none. */
BaseStatus rve_law_install_bonds(RveLaw *law);
BaseStatus rve_law_rest(RveLaw *law);
double rve_law_bulk_density(const RveLaw *law);      /* mean of packings: mass of grains / cell volume, kg/m3; local */
int rve_law_threads(const RveLaw *law);              /* OpenMP threads of this rank; 0 = OpenMP's own choice; local */
int rve_law_left_device(const RveLaw *law);          /* 1: a GPU's memory was too small; alike on all ranks; local */
const char *rve_law_backend_name(const RveLaw *law); /* of this rank's RVEs, "" if it has none; local */

/* All RVEs' states for a restart: gathers on rank 0 (others get NULL, 0), in the order of tags, so that the bytes
 * are the same for any number of ranks. Freed by base_free. Carries a checksum. */
BaseStatus rve_law_pack(RveLaw *law, void **bytes, size_t *size);
/* Every rank passes the whole record. Replaces all RVEs by those of the record, spread over the ranks anew.
 * BASE_ERROR_FORMAT if it is truncated, altered, differs between ranks, or belongs to other packings or another
 * kind of scene; nothing has changed then. */
BaseStatus rve_law_unpack(RveLaw *law, const void *bytes, size_t size);

/* View of the RVE of a tag on rank 0 (others: untouched), for writers; rve_view_destroy() it there.
 * BASE_ERROR_ARGUMENT if no such tag. */
BaseStatus rve_law_view(RveLaw *law, int64_t tag, RveView *view);

/* The halo of foreign points over MPI (mpm.h, MpmHalo). Ranks exchange bounding boxes of their points, then send the
 * points that lie within reach. period[i] > 0: the box is periodic in i with that length, images are made for this rank
 * itself too. halo->destroy before MPI_Finalize. BASE_ERROR_ARGUMENT on all ranks alike. */
struct MpmHalo;
BaseStatus point_halo_create(MPI_Comm comm, int dimension, const double period[3], struct MpmHalo *halo);

#ifdef __cplusplus
}
#endif
#endif
