/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The RveLaw as its own two source files see it. */
#ifndef DEMPM_RVE_LAW_PRIVATE_H
#define DEMPM_RVE_LAW_PRIVATE_H

#include "rve_farm.h"
#include "rve_law.h"
#include "rve_store.h"

struct RveLaw {
  MPI_Comm comm; /* own duplicate */
  int rank, ranks;
  int node_threads; /* this rank's share of its node's cores */
  RveBackend backend; /* alike on all ranks */
  int left_device;    /* 1: the RVEs went to the CPU */
  RveFarm *farm;
  RveStore *store;
  int rves_run;    /* on this rank, in the last step */
  double rest_error; /* of rve_law_set_rest() */
  int64_t rested;  /* calls of this rank's RVEs that were answered at rest, since creation */
  double worst_unbalanced;
  char *replay_directory; /* NULL: no replays */
  /* Room for the plan in force. */
  int point_room, request_room;
  double *point_value;     /* [point_room][RVE_FARM_WIDTH] */
  RveInput *request_input; /* [request_room] */
  RveInput *run_input;     /* [request_room] of the requests that are run, as are */
  int *run_handle;         /* [request_room] */
  double *request_value;   /* [request_room][RVE_FARM_WIDTH] */
};

/* Creates the RVEs of tags that `farm` gave to this rank and `store` has not. Collective. */
BaseStatus rve_law_create_missing(MPI_Comm comm, RveFarm *farm, RveStore *store);
/* All ranks' RVEs go to the CPU if those of one did. Collective. */
BaseStatus rve_law_agree_on_device(RveLaw *law);

#endif
