/* SPDX-License-Identifier: GPL-2.0-or-later */
/* What every part of dempm shares: status codes with a message, checked memory, checksums. */
#ifndef DEMPM_BASE_H
#define DEMPM_BASE_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef enum BaseStatus {
  BASE_OK = 0,
  BASE_ERROR_ARGUMENT, /* a value outside its allowed range */
  BASE_ERROR_MEMORY,   /* the machine (or the device) has not enough memory */
  BASE_ERROR_FILE,     /* a file cannot be opened, read or written */
  BASE_ERROR_FORMAT,   /* a file or a restart record is truncated, altered or of another kind */
  BASE_ERROR_UNSTABLE, /* a computed value is not finite, or a watchdog spoke */
  BASE_ERROR_DEVICE    /* the accelerator cannot be used */
} BaseStatus;

/* Stores a printf-style message for the calling thread and returns `status`. Messages say what was given and
 * what is allowed; they do not end in a newline. */
BaseStatus base_error(BaseStatus status, const char *format, ...) __attribute__((format(printf, 2, 3)));

/* The calling thread's last message; "" when there is none. Never NULL. Valid until the next base_error(). */
const char *base_error_message(void);

/* Prepends printf-style context ("packing file X: ") to the calling thread's message; returns `status`. */
BaseStatus base_error_context(BaseStatus status, const char *format, ...) __attribute__((format(printf, 2, 3)));

/* Returns from the calling function with the status of `expression` unless it is BASE_OK. */
#define TRY(expression)                                \
  do {                                                 \
    BaseStatus base_try_status_ = (expression);        \
    if (base_try_status_ != BASE_OK) return base_try_status_; \
  } while (0)

/* As TRY, but jumps to `label` with the status in the variable `status`. */
#define TRY_GOTO(expression, status, label)     \
  do {                                          \
    (status) = (expression);                    \
    if ((status) != BASE_OK) goto label;        \
  } while (0)

enum { BASE_ALIGNMENT = 64 /* bytes: one cache line, one AVX-512 vector */ };

/* Zeroed memory of count * size bytes, aligned to BASE_ALIGNMENT. *memory is NULL when count is 0.
 * BASE_ERROR_MEMORY on overflow or shortage. Free with base_free(). */
BaseStatus base_alloc(size_t count, size_t size, void **memory);
#define BASE_ALLOC(count, pointer) base_alloc((count), sizeof **(pointer), (void **)(pointer))

/* Grows *memory (from base_alloc or NULL) to hold new_count items, keeping the first old_count, zeroing the rest. */
BaseStatus base_grow(size_t old_count, size_t new_count, size_t size, void **memory);
#define BASE_GROW(old_count, new_count, pointer) \
  base_grow((old_count), (new_count), sizeof **(pointer), (void **)(pointer))

void base_free(void *memory); /* accepts NULL */

/* 64-bit FNV-1a of `bytes` bytes, continued from `seed` (BASE_HASH_SEED to start). */
#define BASE_HASH_SEED UINT64_C(14695981039346656037)
uint64_t base_hash(const void *data, size_t bytes, uint64_t seed);

/* Seconds of a monotonic clock, for progress lines and benchmarks only. */
double base_seconds(void);

/* Deterministic uniform random number in [0, 1) (SplitMix64); advances *state. */
double base_random(uint64_t *state);

#ifdef __cplusplus
}
#endif
#endif
