/* SPDX-License-Identifier: GPL-2.0-or-later */
#define _GNU_SOURCE /* sched_getaffinity */
#include "rank_threads.h"

#include <sched.h>

int rank_threads(MPI_Comm comm) {
  MPI_Comm node;
  int rank, allowed[CPU_SETSIZE] = {0}, sharers[CPU_SETSIZE];
  cpu_set_t cores;
  MPI_Comm_rank(comm, &rank);
  MPI_Comm_split_type(comm, MPI_COMM_TYPE_SHARED, rank, MPI_INFO_NULL, &node);
  CPU_ZERO(&cores);
  if (sched_getaffinity(0, sizeof cores, &cores) == 0)
    for (int c = 0; c < CPU_SETSIZE; c++) allowed[c] = CPU_ISSET(c, &cores) ? 1 : 0;
  MPI_Allreduce(allowed, sharers, CPU_SETSIZE, MPI_INT, MPI_SUM, node);
  MPI_Comm_free(&node);

  double share = 0.0;
  for (int c = 0; c < CPU_SETSIZE; c++)
    if (allowed[c]) share += 1.0 / sharers[c];
  const int threads = (int)(share + 1e-9);
  return threads > 1 ? threads : 1;
}
