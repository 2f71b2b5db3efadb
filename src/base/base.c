/* SPDX-License-Identifier: GPL-2.0-or-later */
#define _POSIX_C_SOURCE 200809L
#include "base.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { MESSAGE_BYTES = 1024 };
static _Thread_local char message[MESSAGE_BYTES];

BaseStatus base_error(BaseStatus status, const char *format, ...) {
  va_list arguments;
  va_start(arguments, format);
  vsnprintf(message, sizeof message, format, arguments);
  va_end(arguments);
  return status;
}

BaseStatus base_error_context(BaseStatus status, const char *format, ...) {
  char rest[MESSAGE_BYTES];
  memcpy(rest, message, sizeof rest);
  va_list arguments;
  va_start(arguments, format);
  int used = vsnprintf(message, sizeof message, format, arguments);
  va_end(arguments);
  if (used >= 0 && used < MESSAGE_BYTES - 1) {
    size_t room = sizeof message - (size_t)used - 1;
    strncpy(message + used, rest, room);
    message[sizeof message - 1] = '\0';
  }
  return status;
}

const char *base_error_message(void) { return message; }

BaseStatus base_alloc(size_t count, size_t size, void **memory) {
  *memory = NULL;
  if (count == 0 || size == 0) return BASE_OK;
  if (count > (SIZE_MAX / 2 - BASE_ALIGNMENT) / size)
    return base_error(BASE_ERROR_MEMORY, "cannot allocate %zu items of %zu bytes: the product overflows", count, size);
  size_t bytes = (count * size + BASE_ALIGNMENT - 1) / BASE_ALIGNMENT * BASE_ALIGNMENT;
  *memory = aligned_alloc(BASE_ALIGNMENT, bytes);
  if (!*memory) return base_error(BASE_ERROR_MEMORY, "cannot allocate %zu bytes", bytes);
  memset(*memory, 0, bytes);
  return BASE_OK;
}

BaseStatus base_grow(size_t old_count, size_t new_count, size_t size, void **memory) {
  void *larger;
  TRY(base_alloc(new_count, size, &larger));
  size_t kept = old_count < new_count ? old_count : new_count;
  if (*memory && kept) memcpy(larger, *memory, kept * size);
  base_free(*memory);
  *memory = larger;
  return BASE_OK;
}

void base_free(void *memory) { free(memory); }

uint64_t base_hash(const void *data, size_t bytes, uint64_t seed) {
  const unsigned char *byte = data;
  for (size_t k = 0; k < bytes; k++) seed = (seed ^ byte[k]) * UINT64_C(1099511628211);
  return seed;
}

double base_seconds(void) {
  struct timespec now;
  clock_gettime(CLOCK_MONOTONIC, &now);
  return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

double base_random(uint64_t *state) {
  uint64_t z = (*state += UINT64_C(0x9e3779b97f4a7c15));
  z = (z ^ (z >> 30)) * UINT64_C(0xbf58476d1ce4e5b9);
  z = (z ^ (z >> 27)) * UINT64_C(0x94d049bb133111eb);
  z ^= z >> 31;
  return (double)(z >> 11) * 0x1p-53;
}
