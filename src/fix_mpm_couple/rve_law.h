/* SPDX-License-Identifier: GPL-2.0-or-later */
/* RVEs as a constitutive law of the MPM core, spread over MPI ranks: the RVE farm. Plain C, knows nothing of LIGGGHTS.
 *
 * An RVE never travels: it stays on the rank where it was created while its material point migrates. Each step ships the velocity
 * gradient and temperature of every point to its RVE's rank and the answer back. */
#ifndef DEMPM_RVE_LAW_H
#define DEMPM_RVE_LAW_H

#include <mpi.h>

#include "../cuda_rve/rve.h"
#include "../mpm/mpm_law.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct RveLaw RveLaw;

typedef struct RveLawTotals {
  int64_t rves, rves_run, grains, particle_steps; /* over all ranks; rves_run and worst_unbalanced of the last step */
  double worst_unbalanced;
  double friction_work; /* J, since the start, of the material (per metre of depth in 2D), all ranks */
  double damping_work;  /* J, likewise */
  double stored_energy; /* J, elastic + fluctuation, present */
  double seconds;       /* wall time spent in RVEs on the slowest rank since creation */
} RveLawTotals;

/* scene, packings are copied; point tag t gets packing packing_of_tag(t) = (t - 1) mod packing_count. Collective over comm. */
BaseStatus rve_law_create(MPI_Comm comm, const RveScene *scene, const RvePacking *packings, int packing_count,
                          RveBackend backend, RveLaw **law);
void rve_law_destroy(RveLaw *law);

/* Gives every tag on any rank that has none an RVE, on ranks chosen by order of tag so that all hold equally many (+-1); forgets RVEs
 * whose tag is gone. tags [n] are this rank's points. Collective; called by the fix when the set of points changed and
 * by rve_law_update itself when it meets an unknown tag. */
BaseStatus rve_law_assign(RveLaw *law, int n, const int64_t *tags);

/* MpmLaw view: content is the RveLaw, destroy is rve_law_destroy. */
void rve_law_as_mpm_law(RveLaw *law, MpmLaw *mpm_law);

/* Totals over all ranks. volume-weighted quantities use current RVE volumes scaled to the points' volumes. Collective. */
BaseStatus rve_law_totals(RveLaw *law, RveLawTotals *totals);
BaseStatus rve_law_set_scene(RveLaw *law, const RveScene *scene);
BaseStatus rve_law_install_bonds(RveLaw *law);
BaseStatus rve_law_rest(RveLaw *law);
double rve_law_bulk_density(const RveLaw *law); /* mean over packings: mass of grains / cell volume, kg/m3 */

/* All RVEs' states for a restart: gathers on rank 0 (others get NULL, 0). Freed by base_free. Carries a checksum. Collective. */
BaseStatus rve_law_pack(RveLaw *law, void **bytes, size_t *size);
/* Every rank passes the whole record; each keeps the RVEs that it owns. BASE_ERROR_FORMAT on all ranks alike. Collective. */
BaseStatus rve_law_unpack(RveLaw *law, const void *bytes, size_t size);

/* View of the RVE of a tag on rank 0 (others: untouched), for writers. BASE_ERROR_ARGUMENT if no such tag. Collective. */
BaseStatus rve_law_view(RveLaw *law, int64_t tag, RveView *view);

/* The halo of foreign points over MPI (mpm.h, MpmHalo). Ranks exchange bounding boxes of their points, then send the points that lie within
 * reach. period[i] > 0: the box is periodic in i with that length, images are made for this rank itself too. Collective. */
struct MpmHalo;
BaseStatus point_halo_create(MPI_Comm comm, int dimension, const double period[3], struct MpmHalo *halo);

#ifdef __cplusplus
}
#endif
#endif
