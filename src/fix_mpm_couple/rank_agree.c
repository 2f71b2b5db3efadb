/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "rank_agree.h"

#include <stdio.h>

BaseStatus rank_agree(MPI_Comm comm, BaseStatus status, int64_t key) {
  /* The good case costs one reduction. A failing rank must stand out even with the largest key: hence INT64_MAX - 1. */
  const int64_t mine = status == BASE_OK ? INT64_MAX : key < INT64_MAX - 1 ? key : INT64_MAX - 1;
  int64_t first;
  MPI_Allreduce(&mine, &first, 1, MPI_INT64_T, MPI_MIN, comm);
  if (first == INT64_MAX) return BASE_OK;

  int rank, ranks, root;
  MPI_Comm_rank(comm, &rank);
  MPI_Comm_size(comm, &ranks);
  const int candidate = mine == first ? rank : ranks;
  MPI_Allreduce(&candidate, &root, 1, MPI_INT, MPI_MIN, comm);
  struct {
    int status;
    char message[1024];
  } news = {(int)status, ""};
  if (rank == root) snprintf(news.message, sizeof news.message, "%s", base_error_message());
  MPI_Bcast(&news, (int)sizeof news, MPI_BYTE, root, comm);
  return base_error((BaseStatus)news.status, "%s", news.message);
}
