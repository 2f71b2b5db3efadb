/* SPDX-License-Identifier: GPL-2.0-or-later */
/* One status for all ranks, so that an error on one of them never leaves the others waiting in the next exchange. */
#ifndef DEMPM_RANK_AGREE_H
#define DEMPM_RANK_AGREE_H

#include <mpi.h>

#include "../base/base.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Collective. BASE_OK if `status` is BASE_OK on every rank. Else the status and message (base_error_message) of one
 * failing rank, alike on all ranks: the one with the smallest `key`, then the lowest rank. Ranks without an error may
 * pass any key. */
BaseStatus rank_agree(MPI_Comm comm, BaseStatus status, int64_t key);

#ifdef __cplusplus
}
#endif
#endif
