/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Whole files in and out. */
#ifndef DEMPM_BASE_FILE_H
#define DEMPM_BASE_FILE_H

#include "base.h"

#ifdef __cplusplus
extern "C" {
#endif

/* All bytes of a file, and a zero behind them; what: names its kind in messages ("path file"). Free with base_free().
 * BASE_ERROR_FILE; BASE_ERROR_FORMAT if it is longer than `most` bytes. */
BaseStatus base_file_read(const char *name, const char *what, size_t most, char **bytes, size_t *size);
/* Replaces a file in one move (temporary name, fsync, rename): who reads it sees the old or the new one, whole. The
 * contents are head [head_bytes] and body [body_bytes], one after the other. BASE_ERROR_FILE. */
BaseStatus base_file_replace(const char *name, const void *head, size_t head_bytes, const void *body,
                             size_t body_bytes);

#ifdef __cplusplus
}
#endif
#endif
