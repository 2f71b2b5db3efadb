/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "rve_packing_file.h"

#include <errno.h>
#include <limits.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

int packing_next_line(PackingReader *reader, PackingLine *line) {
  const PackingFile *file = reader->file;
  if (reader->at >= file->size) return 0;
  const char *start = file->bytes + reader->at;
  const size_t rest = file->size - reader->at;
  const char *end = memchr(start, '\n', rest);
  *line = (PackingLine){
      .start = start, .length = end ? (size_t)(end - start) : rest, .number = ++reader->number, .ended = end != NULL};
  reader->at += line->length + (end ? 1 : 0);
  return 1;
}

static int is_blank(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\v' || c == '\f'; }

int packing_split(const PackingLine *line, int comments, PackingToken token[PACKING_TOKENS]) {
  int count = 0;
  const char *at = line->start, *end = line->start + line->length;
  if (comments) {
    const char *hash = memchr(at, '#', line->length);
    if (hash) end = hash;
  }
  while (count < PACKING_TOKENS) {
    while (at < end && is_blank(*at)) at++;
    if (at == end) break;
    token[count].start = at;
    while (at < end && !is_blank(*at)) at++;
    token[count].length = (size_t)(at - token[count].start);
    count++;
  }
  return count;
}

int packing_token_is(const PackingToken *token, const char *word) {
  return strlen(word) == token->length && memcmp(token->start, word, token->length) == 0;
}

int packing_line_starts(const PackingLine *line, const char *word) {
  const size_t length = strlen(word);
  return line->length >= length && memcmp(line->start, word, length) == 0;
}

/* strtod and strtoll need an end: numbers of a file are short. */
enum { NUMBER_BYTES = 64 };
static int number_text(const PackingToken *token, char text[NUMBER_BYTES]) {
  if (token->length == 0 || token->length >= NUMBER_BYTES) return 0;
  if (memchr(token->start, '\0', token->length)) return 0;
  memcpy(text, token->start, token->length);
  text[token->length] = '\0';
  return 1;
}

int packing_number(const PackingToken *token, double *value) {
  char text[NUMBER_BYTES], *end;
  if (!number_text(token, text)) return 0;
  *value = strtod(text, &end);
  return end != text && *end == '\0';
}

int packing_integer(const PackingToken *token, int64_t *value) {
  char text[NUMBER_BYTES], *end;
  if (!number_text(token, text)) return 0;
  errno = 0;
  const long long parsed = strtoll(text, &end, 10);
  if (end == text || *end != '\0' || errno == ERANGE) return 0;
  *value = parsed;
  return 1;
}

const char *packing_quote(const PackingToken *token, char text[PACKING_QUOTE]) {
  const size_t room = PACKING_QUOTE - 4;
  const size_t length = token->length < room ? token->length : room;
  for (size_t k = 0; k < length; k++) text[k] = token->start[k] >= ' ' && token->start[k] < 127 ? token->start[k] : '?';
  strcpy(text + length, token->length > room ? "..." : "");
  return text;
}

BaseStatus packing_numbers(const PackingReader *reader, const PackingToken *token, int count, const char *what,
                           double *value) {
  char text[PACKING_QUOTE];
  for (int k = 0; k < count; k++)
    if (!packing_number(token + k, value + k) || !isfinite(value[k]))
      return base_error(BASE_ERROR_FORMAT, "packing file %s, line %lld: found '%s', need a finite number (%s)",
                        reader->file->name, (long long)reader->number, packing_quote(token + k, text), what);
  return BASE_OK;
}

BaseStatus packing_box_create(int64_t grains, int motion, PackingBox *box) {
  if (grains < 1 || grains > INT_MAX / 8)
    return base_error(BASE_ERROR_FORMAT, "%lld grains; 1 to %d are allowed", (long long)grains, INT_MAX / 8);
  const size_t n = (size_t)grains;
  box->grains = (int)grains;
  TRY(BASE_ALLOC(n, &box->id));
  TRY(BASE_ALLOC(3 * n, &box->position));
  TRY(BASE_ALLOC(n, &box->radius));
  if (!motion) return BASE_OK;
  TRY(BASE_ALLOC(3 * n, &box->velocity));
  return BASE_ALLOC(3 * n, &box->spin);
}

void packing_box_destroy(PackingBox *box) {
  base_free(box->id);
  base_free(box->position);
  base_free(box->radius);
  base_free(box->velocity);
  base_free(box->spin);
  base_free(box->history);
  *box = (PackingBox){0};
}

/* Merge sort, for it is stable and needs no global variable to reach the ids. */
static void sort_by_id(const int64_t *id, int *order, int *spare, int count) {
  if (count < 2) return;
  const int half = count / 2;
  sort_by_id(id, order, spare, half);
  sort_by_id(id, order + half, spare, count - half);
  memcpy(spare, order, (size_t)count * sizeof *order);
  for (int k = 0, a = 0, b = half; k < count; k++)
    order[k] = b == count || (a < half && id[spare[a]] <= id[spare[b]]) ? spare[a++] : spare[b++];
}

BaseStatus packing_sort_ids(const PackingFile *file, const PackingBox *box, int **order) {
  int *spare = NULL;
  BaseStatus status;
  *order = NULL;
  TRY_GOTO(BASE_ALLOC((size_t)box->grains, order), status, failed);
  TRY_GOTO(BASE_ALLOC((size_t)box->grains, &spare), status, failed);
  for (int k = 0; k < box->grains; k++) (*order)[k] = k;
  sort_by_id(box->id, *order, spare, box->grains);
  for (int k = 1; k < box->grains; k++)
    if (box->id[(*order)[k]] == box->id[(*order)[k - 1]]) {
      status = base_error(BASE_ERROR_FORMAT, "packing file %s: the id %lld is there twice", file->name,
                          (long long)box->id[(*order)[k]]);
      goto failed;
    }
  base_free(spare);
  return BASE_OK;
failed:
  base_free(spare);
  base_free(*order);
  *order = NULL;
  return status;
}

int packing_find_id(const PackingBox *box, const int *order, int64_t id) {
  int low = 0, high = box->grains - 1;
  while (low < high) {
    const int middle = low + (high - low) / 2;
    if (box->id[order[middle]] < id) low = middle + 1;
    else high = middle;
  }
  return low == high && box->id[order[low]] == id ? order[low] : -1;
}
