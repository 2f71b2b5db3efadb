/* SPDX-License-Identifier: GPL-2.0-or-later */
/* LIGGGHTS data files: what read_data reads and write_data writes for atom_style granular (or sphere). A data file does
 * not say which boundaries are periodic: it is taken as periodic. */
#include <string.h>

#include "rve_packing_file.h"

/* Columns of the Atoms section; LIGGGHTS puts the position before a hybrid style's own columns. */
typedef struct AtomColumns {
  int diameter, x;
} AtomColumns;
static const AtomColumns granular_columns = {2, 4}, hybrid_columns = {5, 2};

typedef struct DataReader {
  PackingReader reader;
  PackingBox *box;
  int64_t atoms; /* of the header, -1: not met */
  int have[3];   /* edges met in the header */
  int *order;    /* grains by id, once the Atoms section is read */
} DataReader;

static BaseStatus data_error(const DataReader *data, const char *what, const PackingToken *found, const char *need) {
  char text[PACKING_QUOTE] = "";
  if (found) packing_quote(found, text);
  return base_error(BASE_ERROR_FORMAT, "packing file %s, line %lld: %s%s%s%s; need %s", data->reader.file->name,
                    (long long)data->reader.number, what, found ? " '" : "", text, found ? "'" : "", need);
}

/* The next line with content; 0 at the end of the file. */
static int next_content(DataReader *data, PackingLine *line, PackingToken token[PACKING_TOKENS], int *count) {
  while (packing_next_line(&data->reader, line)) {
    *count = packing_split(line, 1, token);
    if (*count > 0) return 1;
  }
  return 0;
}

static int starts_with_number(const PackingToken *token) {
  double value;
  return packing_number(token, &value);
}

static BaseStatus read_header_line(DataReader *data, const PackingToken *token, int count) {
  static const char *const edge[3][2] = {{"xlo", "xhi"}, {"ylo", "yhi"}, {"zlo", "zhi"}};
  if (count == 2 && packing_token_is(token + 1, "atoms")) {
    if (!packing_integer(token, &data->atoms) || data->atoms < 1)
      return data_error(data, "found", token, "the number of atoms, at least 1");
    return BASE_OK;
  }
  for (int k = 0; k < 3; k++)
    if (count == 4 && packing_token_is(token + 2, edge[k][0]) && packing_token_is(token + 3, edge[k][1])) {
      double bound[2];
      TRY(packing_numbers(&data->reader, token, 2, "box bounds", bound));
      data->box->low[k] = bound[0], data->box->high[k] = bound[1], data->have[k] = 1;
      return BASE_OK;
    }
  if (count == 6 && packing_token_is(token + 3, "xy") && packing_token_is(token + 4, "xz") &&
      packing_token_is(token + 5, "yz"))
    return packing_numbers(&data->reader, token, 3, "tilt factors", data->box->tilt);
  return BASE_OK; /* atom types, bonds, ...: nothing that a packing needs */
}

/* "Atoms # style": which columns. Without the hint granular is taken. */
static BaseStatus columns_of(DataReader *data, const PackingLine *line, AtomColumns *columns) {
  PackingToken token[PACKING_TOKENS];
  const char *hash = memchr(line->start, '#', line->length);
  *columns = granular_columns;
  if (!hash) return BASE_OK;
  const PackingLine hint = {.start = hash + 1, .length = line->length - (size_t)(hash + 1 - line->start)};
  const int count = packing_split(&hint, 0, token);
  if (count == 0 || packing_token_is(token, "granular") || packing_token_is(token, "sphere")) return BASE_OK;
  if (packing_token_is(token, "hybrid") && count > 1 &&
      (packing_token_is(token + 1, "granular") || packing_token_is(token + 1, "sphere"))) {
    *columns = hybrid_columns;
    return BASE_OK;
  }
  return data_error(data, "found atom style", token,
                    "granular or sphere (grains with radii), or hybrid with one of these first");
}

static BaseStatus read_atom(DataReader *data, const AtomColumns *columns, const PackingToken *token, int count, int k) {
  if (columns->x == granular_columns.x) {
    if (count != 7 && count != 10)
      return data_error(data, "found another number of columns at", token,
                        "7 or 10 columns: id type diameter density x y z [ix iy iz] (atom_style granular)");
  } else if (count < 7)
    return data_error(data, "found too few columns at", token,
                      "id type x y z diameter density (atom_style hybrid granular)");
  double diameter;
  if (!packing_integer(token, data->box->id + k)) return data_error(data, "found", token, "an atom id");
  TRY(packing_numbers(&data->reader, token + columns->diameter, 1, "diameter", &diameter));
  if (!(diameter > 0.0)) return data_error(data, "found diameter", token + columns->diameter, "a diameter above 0");
  data->box->radius[k] = 0.5 * diameter;
  return packing_numbers(&data->reader, token + columns->x, 3, "x y z", data->box->position + 3 * (size_t)k);
}

static BaseStatus read_atoms(DataReader *data, const PackingLine *title) {
  AtomColumns columns;
  PackingLine line;
  PackingToken token[PACKING_TOKENS];
  int count;
  if (data->order) return data_error(data, "found a second section Atoms", NULL, "one");
  TRY(columns_of(data, title, &columns));
  if (data->atoms < 0)
    return data_error(data, "found no line 'N atoms' in the header", NULL, "it before the section Atoms");
  enum { SHORTEST_LINE = 14 }; /* seven one-digit columns: what the rest of the file can hold bounds the memory */
  if (data->atoms > (int64_t)(data->reader.file->size - data->reader.at) / SHORTEST_LINE + 1)
    return base_error(
        BASE_ERROR_FORMAT,
        "packing file %s, line %lld: the header says %lld atoms, the file is too short for them (truncated?)",
        data->reader.file->name, (long long)data->reader.number, (long long)data->atoms);
  TRY(packing_box_create(data->atoms, 0, data->box));
  for (int k = 0; k < data->box->grains; k++) {
    if (!next_content(data, &line, token, &count) || !line.ended)
      return base_error(BASE_ERROR_FORMAT,
                        "packing file %s: ends in line %lld, inside grain %d of %d of the section Atoms (truncated?)",
                        data->reader.file->name, (long long)data->reader.number, k + 1, data->box->grains);
    TRY(read_atom(data, &columns, token, count, k));
  }
  return packing_sort_ids(data->reader.file, data->box, &data->order);
}

static BaseStatus read_velocities(DataReader *data) {
  PackingLine line;
  PackingToken token[PACKING_TOKENS];
  PackingBox *box = data->box;
  int count;
  int64_t id;
  if (!data->order) return data_error(data, "found the section Velocities", NULL, "the section Atoms before it");
  if (box->velocity) return data_error(data, "found a second section Velocities", NULL, "one");
  TRY(BASE_ALLOC(3 * (size_t)box->grains, &box->velocity));
  TRY(BASE_ALLOC(3 * (size_t)box->grains, &box->spin));
  for (int k = 0; k < box->grains; k++) {
    if (!next_content(data, &line, token, &count) || !line.ended)
      return base_error(
          BASE_ERROR_FORMAT,
          "packing file %s: ends in line %lld, inside grain %d of %d of the section Velocities (truncated?)",
          data->reader.file->name, (long long)data->reader.number, k + 1, box->grains);
    if (count != 4 && count != 7)
      return data_error(data, "found another number of columns at", token, "id vx vy vz [wx wy wz]");
    const int grain = packing_integer(token, &id) ? packing_find_id(box, data->order, id) : -1;
    if (grain < 0) return data_error(data, "found", token, "the id of an atom of the section Atoms");
    TRY(packing_numbers(&data->reader, token + 1, 3, "vx vy vz", box->velocity + 3 * (size_t)grain));
    if (count == 7) TRY(packing_numbers(&data->reader, token + 4, 3, "wx wy wz", box->spin + 3 * (size_t)grain));
  }
  return BASE_OK;
}

static BaseStatus read_lines(DataReader *data) {
  PackingLine line;
  PackingToken token[PACKING_TOKENS];
  int count, in_header = 1;
  packing_next_line(&data->reader, &line); /* a title, which LIGGGHTS skips too */
  while (next_content(data, &line, token, &count)) {
    if (starts_with_number(token)) {
      if (in_header) TRY(read_header_line(data, token, count));
      continue; /* a line of a section that a packing does not need */
    }
    in_header = 0;
    if (packing_token_is(token, "Atoms")) TRY(read_atoms(data, &line));
    else if (packing_token_is(token, "Velocities")) TRY(read_velocities(data));
  }
  return BASE_OK;
}

BaseStatus packing_read_data(const PackingFile *file, int dimension, PackingBox *box) {
  (void)dimension;
  DataReader data = {.reader = {.file = file}, .box = box, .atoms = -1};
  BaseStatus status = read_lines(&data);
  if (status == BASE_OK && !data.order)
    status = base_error(BASE_ERROR_FORMAT,
                        "packing file %s: no section 'Atoms' found: this is neither a LIGGGHTS data file, text dump or "
                        "binary restart nor a "
                        "packing written by dempm",
                        file->name);
  for (int k = 0; k < 3 && status == BASE_OK; k++)
    if (!data.have[k])
      status = base_error(BASE_ERROR_FORMAT, "packing file %s: no line '%clo %chi' in the header", file->name, 'x' + k,
                          'x' + k);
  base_free(data.order);
  return status;
}
