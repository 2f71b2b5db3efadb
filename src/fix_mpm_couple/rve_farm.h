/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Who holds the RVE of which material point, and the way of numbers between points and RVEs. Knows tags and
 * `handles` (small integers by which the caller finds an RVE on its own rank), not what an RVE is.
 *
 * Every rank keeps the whole directory, sorted by tag: it follows from the history of assign() calls alone, so all
 * copies are equal without further talk. All functions are collective unless they say "local". */
#ifndef DEMPM_RVE_FARM_H
#define DEMPM_RVE_FARM_H

#include <mpi.h>

#include "../base/base.h"

typedef struct RveFarm RveFarm;

enum { RVE_FARM_WIDTH = 32 /* most doubles per point that one transfer carries */ };

typedef enum RveFarmNews {
  RVE_FARM_SAME,   /* tags are those of the last plan, which stands */
  RVE_FARM_PLANNED,/* a new plan was made: rve_farm_requests() has changed */
  RVE_FARM_UNKNOWN /* some rank has a tag without RVE: nothing was planned, call rve_farm_assign() */
} RveFarmNews;

/* An empty farm. comm is borrowed. */
BaseStatus rve_farm_create(MPI_Comm comm, RveFarm **farm);
void rve_farm_destroy(RveFarm *farm); /* accepts NULL; local */

/* Gives each of the tags [n] of every rank that has no owner one: ranks that hold least are filled first, new tags
 * in ascending order go to ranks in ascending order, so counts differ by at most 1 unless tags were forgotten.
 * Tags that have an owner keep it. forget = 1: tags that no rank named lose theirs. BASE_ERROR_ARGUMENT (tag < 1,
 * tag on two ranks), the farm is then unchanged. */
BaseStatus rve_farm_assign(RveFarm *farm, int n, const int64_t *tags, int forget);

/* Tags that this rank holds, ascending, and their handles: -1 = new, to be set by the caller. Both belong to the
 * farm, valid until the next assign. Returns their number. Local. */
int rve_farm_own(const RveFarm *farm, const int64_t **tags, int **handles);
int rve_farm_size(const RveFarm *farm);               /* tags of all ranks; local */
int rve_farm_owner(const RveFarm *farm, int64_t tag); /* rank, -1 if unknown; local */
int rve_farm_handle(const RveFarm *farm, int64_t tag);/* -1 if not on this rank; local */

/* Plans transfers for this rank's points tags [n]; `news` is alike on all ranks. One reduction while nothing changes.
 * BASE_ERROR_ARGUMENT if two points ask for one RVE. */
BaseStatus rve_farm_plan(RveFarm *farm, int n, const int64_t *tags, RveFarmNews *news);
void rve_farm_drop_plan(RveFarm *farm); /* the next rve_farm_plan() starts anew; local, to be called on all ranks */
/* What other ranks' (and own) points ask of this rank by the last plan. Returns their number. Local. */
int rve_farm_requests(const RveFarm *farm, const int64_t **tags, const int **handles);

/* width <= RVE_FARM_WIDTH doubles per point: from points [n][width] to requests [requests][width], and back. */
void rve_farm_send(RveFarm *farm, int width, const double *of_points, double *of_requests);
void rve_farm_reply(RveFarm *farm, int width, const double *of_requests, double *of_points);

#endif
