/* SPDX-License-Identifier: GPL-2.0-or-later */
/* cmocka under mpirun: every rank runs all tests, rank 0 prints; other ranks' output is shown only if they fail. */
#ifndef DEMPM_MPI_TEST_H
#define DEMPM_MPI_TEST_H
#ifndef _POSIX_C_SOURCE
#define _POSIX_C_SOURCE 200809L /* include this header first */
#endif

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <unistd.h>

#include <cmocka.h>
#include <mpi.h>

#include "../../src/base/base.h"

/* Collective over MPI_COMM_WORLD: fails on all ranks if the condition fails on one, so that none is left waiting. */
static inline void mpi_test_check(int good, const char *text, const char *file, int line) {
  int all;
  if (!good) fprintf(stderr, "%s:%d: %s (last message: %s)\n", file, line, text, base_error_message());
  MPI_Allreduce(&good, &all, 1, MPI_INT, MPI_MIN, MPI_COMM_WORLD);
  _assert_true(all != 0, text, file, line);
}
#define CHECK_ALL(condition) mpi_test_check((condition) ? 1 : 0, #condition, __FILE__, __LINE__)

/* 1 if all ranks hold the same value. Collective over MPI_COMM_WORLD. */
static inline int mpi_test_same(uint64_t value) {
  uint64_t low, high;
  MPI_Allreduce(&value, &low, 1, MPI_UINT64_T, MPI_MIN, MPI_COMM_WORLD);
  MPI_Allreduce(&value, &high, 1, MPI_UINT64_T, MPI_MAX, MPI_COMM_WORLD);
  return low == high;
}

static inline int mpi_test_rank(void) {
  int rank;
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  return rank;
}

static inline int mpi_test_ranks(void) {
  int ranks;
  MPI_Comm_size(MPI_COMM_WORLD, &ranks);
  return ranks;
}

/* Everything around cmocka_run_group_tests(tests). A hang ends after `seconds` with SIGALRM. Returns main's result. */
static inline int mpi_test_main(int (*run)(void), unsigned seconds) {
  MPI_Init(NULL, NULL);
  alarm(seconds);
  FILE *hidden = NULL;
  const int screen = dup(STDERR_FILENO);
  if (mpi_test_rank() != 0 && (hidden = tmpfile()) != NULL) {
    dup2(fileno(hidden), STDOUT_FILENO);
    dup2(fileno(hidden), STDERR_FILENO);
  }
  const int failed = run();
  fflush(NULL);
  if (hidden && failed) {
    char text[4096];
    size_t n;
    rewind(hidden);
    while ((n = fread(text, 1, sizeof text, hidden)) > 0)
      if (write(screen, text, n) < 0) break;
  }
  int any;
  MPI_Allreduce(&failed, &any, 1, MPI_INT, MPI_MAX, MPI_COMM_WORLD);
  MPI_Finalize();
  return any ? 1 : 0;
}

#endif
