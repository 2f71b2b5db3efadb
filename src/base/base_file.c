/* SPDX-License-Identifier: GPL-2.0-or-later */
#define _POSIX_C_SOURCE 200809L
#include "base_file.h"

#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

/* Reads to the end instead of asking for the size: works for pipes too. */
static BaseStatus read_all(FILE *file, const char *name, const char *what, size_t most, char **bytes, size_t *size) {
  size_t room = 1 << 14;
  *size = 0;
  TRY(base_alloc(room, 1, (void **)bytes));
  for (;;) {
    *size += fread(*bytes + *size, 1, room - 1 - *size, file);
    if (ferror(file)) return base_error(BASE_ERROR_FILE, "cannot read %s %s: %s", what, name, strerror(errno));
    if (*size < room - 1) break;
    if (room > most) return base_error(BASE_ERROR_FORMAT, "%s %s is longer than %zu bytes", what, name, most);
    TRY(base_grow(room, 2 * room, 1, (void **)bytes));
    room *= 2;
  }
  (*bytes)[*size] = '\0';
  return BASE_OK;
}

BaseStatus base_file_read(const char *name, const char *what, size_t most, char **bytes, size_t *size) {
  *bytes = NULL, *size = 0;
  FILE *file = fopen(name, "rb");
  if (!file) return base_error(BASE_ERROR_FILE, "cannot open %s %s: %s", what, name, strerror(errno));
  const BaseStatus status = read_all(file, name, what, most, bytes, size);
  fclose(file);
  if (status == BASE_OK) return BASE_OK;
  base_free(*bytes);
  *bytes = NULL, *size = 0;
  return status;
}

static BaseStatus write_synced(const char *name, const void *head, size_t head_bytes, const void *body,
                               size_t body_bytes) {
  FILE *file = fopen(name, "wb");
  if (!file) return base_error(BASE_ERROR_FILE, "cannot open %s for writing: %s", name, strerror(errno));
  int good = fwrite(head, 1, head_bytes, file) == head_bytes && fwrite(body, 1, body_bytes, file) == body_bytes &&
             fflush(file) == 0 && fsync(fileno(file)) == 0;
  const int reason = errno;
  good = fclose(file) == 0 && good;
  if (good) return BASE_OK;
  unlink(name);
  return base_error(BASE_ERROR_FILE, "cannot write %s: %s", name, strerror(reason));
}

BaseStatus base_file_replace(const char *name, const void *head, size_t head_bytes, const void *body,
                             size_t body_bytes) {
  char *temporary = NULL;
  const size_t room = strlen(name) + 32;
  BaseStatus status;
  TRY(BASE_ALLOC(room, &temporary));
  snprintf(temporary, room, "%s.part-%ld", name, (long)getpid());
  TRY_GOTO(write_synced(temporary, head, head_bytes, body, body_bytes), status, done);
  if (rename(temporary, name) != 0) {
    status = base_error(BASE_ERROR_FILE, "cannot rename %s to %s: %s", temporary, name, strerror(errno));
    unlink(temporary);
  }
done:
  base_free(temporary);
  return status;
}
