/* SPDX-License-Identifier: GPL-2.0-or-later */
/* dempm's own form of a packing: lines of text whose numbers come back bit for bit, with a version and a checksum.
 *
 *   dempm packing 1
 *   checksum HEX                      FNV-1a of all bytes after this line
 *   dimension 2
 *   cell H11 H12 ... H33              m, row by row; columns are the cell vectors
 *   grains N at_rest | moving
 *   s1 s2 s3 radius [v1 v2 v3 w1 w2 w3]            N lines
 *   contacts M
 *   i j P1 P2 P3 f1 f2 f3             M lines: grains from 0, cell shift, tangential force on i in N
 *   end
 */
#define _POSIX_C_SOURCE 200809L
#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "rve_packing_file.h"
#include "rve_packing_pairs.h"

static const char title[] = "dempm packing";
enum { FORM_VERSION = 1 };

int packing_is_text(const PackingFile *file) {
  return file->size >= sizeof title - 1 && memcmp(file->bytes, title, sizeof title - 1) == 0;
}

static BaseStatus text_error(const PackingReader *reader, const char *need) {
  return base_error(BASE_ERROR_FORMAT, "packing file %s, line %lld: truncated or altered; need %s", reader->file->name,
                    (long long)reader->number, need);
}

/* The next line, of at least `least` tokens, the first of them `word` (NULL: any). */
static BaseStatus next_tokens(PackingReader *reader, const char *word, int least, const char *need,
                              PackingToken token[PACKING_TOKENS], int *count) {
  PackingLine line;
  if (!packing_next_line(reader, &line) || !line.ended) return text_error(reader, need);
  *count = packing_split(&line, 0, token);
  if (*count < least || (word && !packing_token_is(token, word))) return text_error(reader, need);
  return BASE_OK;
}

/* "word N": N within 0 .. what the rest of the file can hold at `shortest` bytes per line. */
static BaseStatus read_count(PackingReader *reader, const PackingToken *token, int shortest, int *count) {
  int64_t value;
  const int64_t most = (int64_t)(reader->file->size - reader->at) / shortest;
  if (!packing_integer(token, &value) || value < 0 || value > most || value > INT_MAX / 8)
    return text_error(reader, "a number that the file has lines for");
  *count = (int)value;
  return BASE_OK;
}

static BaseStatus check_head(PackingReader *reader) {
  PackingToken token[PACKING_TOKENS];
  int count;
  int64_t version;
  TRY(next_tokens(reader, "dempm", 3, "'dempm packing 1'", token, &count));
  if (!packing_integer(token + 2, &version) || version != FORM_VERSION)
    return base_error(BASE_ERROR_FORMAT,
                      "packing file %s: written in another version of the form; this dempm reads version %d",
                      reader->file->name, FORM_VERSION);
  TRY(next_tokens(reader, "checksum", 2, "'checksum' and 16 hexadecimal digits", token, &count));
  char found[17] = "", expected[17];
  const uint64_t hash = base_hash(reader->file->bytes + reader->at, reader->file->size - reader->at, BASE_HASH_SEED);
  snprintf(expected, sizeof expected, "%016" PRIx64, hash);
  if (token[1].length == 16) memcpy(found, token[1].start, 16);
  if (strcmp(found, expected) != 0)
    return base_error(BASE_ERROR_FORMAT,
                      "packing file %s: the checksum does not fit: truncated or altered since it was written",
                      reader->file->name);
  return BASE_OK;
}

static BaseStatus read_grains(PackingReader *reader, int dimension, const double cell[9], RvePacking *packing) {
  PackingToken token[PACKING_TOKENS];
  int count, grains;
  TRY(next_tokens(reader, "grains", 3, "'grains N at_rest' or 'grains N moving'", token, &count));
  TRY(read_count(reader, token + 1, 8, &grains));
  const int motion = packing_token_is(token + 2, "moving");
  if (grains < 1 || (!motion && !packing_token_is(token + 2, "at_rest")))
    return text_error(reader, "at least 1 grain, at_rest or moving");
  TRY(packing_create(dimension, grains, motion, packing));
  memcpy(packing->cell, cell, 9 * sizeof *cell);
  for (size_t i = 0; i < (size_t)grains; i++) {
    TRY(next_tokens(reader, NULL, motion ? 10 : 4, "s1 s2 s3 radius [v1 v2 v3 w1 w2 w3]", token, &count));
    TRY(packing_numbers(reader, token, 3, "s1 s2 s3", packing->position + 3 * i));
    TRY(packing_numbers(reader, token + 3, 1, "radius", packing->radius + i));
    if (!motion) continue;
    TRY(packing_numbers(reader, token + 4, 3, "velocity", packing->velocity + 3 * i));
    TRY(packing_numbers(reader, token + 7, 3, "spin", packing->spin + 3 * i));
  }
  return BASE_OK;
}

static BaseStatus read_contacts(PackingReader *reader, RvePacking *packing) {
  PackingToken token[PACKING_TOKENS];
  int count, contacts;
  TRY(next_tokens(reader, "contacts", 2, "'contacts M'", token, &count));
  TRY(read_count(reader, token + 1, 16, &contacts));
  TRY(BASE_ALLOC(2 * (size_t)contacts, &packing->contact_pair));
  TRY(BASE_ALLOC(3 * (size_t)contacts, &packing->contact_image));
  TRY(BASE_ALLOC(3 * (size_t)contacts, &packing->contact_shear));
  packing->contacts = contacts;
  for (size_t c = 0; c < (size_t)contacts; c++) {
    int64_t value[5];
    TRY(next_tokens(reader, NULL, 8, "i j P1 P2 P3 f1 f2 f3", token, &count));
    for (int k = 0; k < 5; k++)
      if (!packing_integer(token + k, value + k) || value[k] < INT_MIN || value[k] > INT_MAX)
        return text_error(reader, "integers i j P1 P2 P3");
    for (size_t k = 0; k < 2; k++) packing->contact_pair[2 * c + k] = (int)value[k];
    for (size_t k = 0; k < 3; k++) packing->contact_image[3 * c + k] = (int)value[2 + k];
    TRY(packing_numbers(reader, token + 5, 3, "tangential force", packing->contact_shear + 3 * c));
  }
  return next_tokens(reader, "end", 1, "'end'", token, &count);
}

BaseStatus packing_read_text(const PackingFile *file, RvePacking *packing) {
  PackingReader reader = {.file = file};
  PackingToken token[PACKING_TOKENS];
  int count;
  int64_t dimension;
  double cell[9];
  TRY(check_head(&reader));
  TRY(next_tokens(&reader, "dimension", 2, "'dimension 2' or 'dimension 3'", token, &count));
  if (!packing_integer(token + 1, &dimension) || (dimension != 2 && dimension != 3))
    return text_error(&reader, "dimension 2 or 3");
  TRY(next_tokens(&reader, "cell", 10, "'cell' and nine numbers", token, &count));
  TRY(packing_numbers(&reader, token + 1, 9, "cell", cell));
  TRY(read_grains(&reader, (int)dimension, cell, packing));
  return read_contacts(&reader, packing);
}

static void print_body(FILE *out, const RvePacking *packing) {
  const int motion = packing->velocity || packing->spin;
  fprintf(out, "dimension %d\ncell", packing->dimension);
  for (int k = 0; k < 9; k++) fprintf(out, " %.17g", packing->cell[k]);
  fprintf(out, "\ngrains %d %s\n", packing->grains, motion ? "moving" : "at_rest");
  for (size_t i = 0; i < (size_t)packing->grains; i++) {
    for (size_t k = 0; k < 3; k++) fprintf(out, "%.17g ", packing->position[3 * i + k]);
    fprintf(out, "%.17g", packing->radius[i]);
    for (size_t k = 0; k < 3 && motion; k++)
      fprintf(out, " %.17g", packing->velocity ? packing->velocity[3 * i + k] : 0.0);
    for (size_t k = 0; k < 3 && motion; k++) fprintf(out, " %.17g", packing->spin ? packing->spin[3 * i + k] : 0.0);
    fputc('\n', out);
  }
  fprintf(out, "contacts %d\n", packing->contacts);
  for (size_t c = 0; c < (size_t)packing->contacts; c++) {
    const int *pair = packing->contact_pair + 2 * c, *image = packing->contact_image + 3 * c;
    const double *shear = packing->contact_shear + 3 * c;
    fprintf(out, "%d %d %d %d %d %.17g %.17g %.17g\n", pair[0], pair[1], image[0], image[1], image[2], shear[0],
            shear[1], shear[2]);
  }
  fputs("end\n", out);
}

/* All bytes to a new file, on the disk when this returns BASE_OK. */
static BaseStatus write_synced(const char *name, const char *head, const char *body, size_t bytes) {
  FILE *file = fopen(name, "wb");
  if (!file) return base_error(BASE_ERROR_FILE, "cannot open %s for writing: %s", name, strerror(errno));
  int good =
      fputs(head, file) >= 0 && fwrite(body, 1, bytes, file) == bytes && fflush(file) == 0 && fsync(fileno(file)) == 0;
  const int reason = errno;
  good = fclose(file) == 0 && good;
  if (good) return BASE_OK;
  unlink(name);
  return base_error(BASE_ERROR_FILE, "cannot write %s: %s", name, strerror(reason));
}

BaseStatus rve_packing_write(const char *file, const RvePacking *packing) {
  char *body = NULL, *temporary = NULL, head[64];
  size_t bytes = 0;
  TRY(rve_packing_check(packing));
  FILE *memory = open_memstream(&body, &bytes);
  if (!memory) return base_error(BASE_ERROR_MEMORY, "no memory to write packing %s", file);
  print_body(memory, packing);
  const int failed = ferror(memory) != 0;
  if (fclose(memory) != 0 || failed) {
    free(body);
    return base_error(BASE_ERROR_MEMORY, "no memory to write packing %s", file);
  }
  snprintf(head, sizeof head, "%s %d\nchecksum %016" PRIx64 "\n", title, FORM_VERSION,
           base_hash(body, bytes, BASE_HASH_SEED));
  BaseStatus status;
  const size_t room = strlen(file) + 32;
  TRY_GOTO(BASE_ALLOC(room, &temporary), status, done);
  snprintf(temporary, room, "%s.part-%ld", file, (long)getpid());
  TRY_GOTO(write_synced(temporary, head, body, bytes), status, done);
  if (rename(temporary, file) != 0) {
    status = base_error(BASE_ERROR_FILE, "cannot rename %s to %s: %s", temporary, file, strerror(errno));
    unlink(temporary);
  }
done:
  free(body);
  base_free(temporary);
  return status;
}
