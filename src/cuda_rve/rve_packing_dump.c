/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The last complete frame of a LIGGGHTS text dump (dump custom). */
#include <math.h>
#include <string.h>

#include "rve_packing_file.h"

/* Columns that are looked for. Each triple may come absolute, unwrapped or scaled with the box. */
typedef enum DumpColumn {
  DUMP_ID,
  DUMP_RADIUS,
  DUMP_DIAMETER,
  DUMP_X,
  DUMP_Y,
  DUMP_Z,
  DUMP_XU,
  DUMP_YU,
  DUMP_ZU,
  DUMP_XS,
  DUMP_YS,
  DUMP_ZS,
  DUMP_XSU,
  DUMP_YSU,
  DUMP_ZSU,
  DUMP_VX,
  DUMP_VY,
  DUMP_VZ,
  DUMP_OMEGAX,
  DUMP_OMEGAY,
  DUMP_OMEGAZ,
  DUMP_COLUMNS
} DumpColumn;
static const char *const column_name[DUMP_COLUMNS] = {"id",  "radius", "diameter", "x",  "y",      "z",      "xu",
                                                      "yu",  "zu",     "xs",       "ys", "zs",     "xsu",    "ysu",
                                                      "zsu", "vx",     "vy",       "vz", "omegax", "omegay", "omegaz"};

typedef struct DumpReader {
  PackingReader reader;
  PackingBox *box;
  int dimension;
  int64_t atoms;
  int have_bounds, triclinic, scaled;
  int cut;                  /* the file ends inside the frame */
  int column[DUMP_COLUMNS]; /* its place in a line, -1: not there */
  int columns;
  DumpColumn position; /* the first of the triple that is used */
} DumpReader;

static BaseStatus dump_error(const DumpReader *dump, const char *found, const char *need) {
  return base_error(BASE_ERROR_FORMAT, "packing file %s, line %lld: found %s; need %s", dump->reader.file->name,
                    (long long)dump->reader.number, found, need);
}

/* A line that has to be there. */
static BaseStatus require_line(DumpReader *dump, PackingLine *line) {
  if (packing_next_line(&dump->reader, line) && line->ended) return BASE_OK;
  dump->cut = 1;
  return base_error(BASE_ERROR_FORMAT,
                    "packing file %s: ends in line %lld, inside a frame, and no frame before it is complete",
                    dump->reader.file->name, (long long)dump->reader.number);
}

static BaseStatus read_count(DumpReader *dump) {
  PackingLine line;
  PackingToken token[PACKING_TOKENS];
  TRY(require_line(dump, &line));
  if (packing_split(&line, 0, token) != 1 || !packing_integer(token, &dump->atoms))
    return dump_error(dump, "no integer", "the number of atoms");
  if (dump->atoms < 1) return dump_error(dump, "a frame without atoms", "at least 1 grain");
  return BASE_OK;
}

/* "ITEM: BOX BOUNDS [xy xz yz] pp pp pp" and three lines. */
static BaseStatus read_bounds(DumpReader *dump, const PackingLine *title) {
  PackingLine line;
  PackingToken token[PACKING_TOKENS];
  const int count = packing_split(title, 0, token);
  dump->triclinic = count > 3 && packing_token_is(token + 3, "xy");
  const int flags = dump->triclinic ? 6 : 3;
  for (int k = 0; k < dump->dimension; k++) {
    char text[PACKING_QUOTE] = "nothing";
    if (flags + k < count && packing_token_is(token + flags + k, "pp")) continue;
    if (flags + k < count) packing_quote(token + flags + k, text);
    return base_error(BASE_ERROR_FORMAT,
                      "packing file %s, line %lld: found '%s' as boundary along %c; need pp: a packing is periodic",
                      dump->reader.file->name, (long long)dump->reader.number, text, 'x' + k);
  }
  for (int k = 0; k < 3; k++) {
    double value[3] = {0, 0, 0};
    const int values = dump->triclinic ? 3 : 2;
    TRY(require_line(dump, &line));
    if (packing_split(&line, 0, token) < values)
      return dump_error(dump, "too few numbers", "the box bounds, lo hi [tilt]");
    TRY(packing_numbers(&dump->reader, token, values, "box bounds", value));
    dump->box->low[k] = value[0], dump->box->high[k] = value[1], dump->box->tilt[k] = value[2];
  }
  if (dump->triclinic) { /* the bounds of a tilted box are those of its bounding box */
    const double xy = dump->box->tilt[0], xz = dump->box->tilt[1], yz = dump->box->tilt[2];
    dump->box->low[0] -= fmin(fmin(0.0, xy), fmin(xz, xy + xz));
    dump->box->high[0] -= fmax(fmax(0.0, xy), fmax(xz, xy + xz));
    dump->box->low[1] -= fmin(0.0, yz);
    dump->box->high[1] -= fmax(0.0, yz);
  }
  dump->have_bounds = 1;
  return BASE_OK;
}

static int have_triple(const DumpReader *dump, DumpColumn first) {
  for (int k = 0; k < dump->dimension; k++)
    if (dump->column[first + k] < 0) return 0;
  return 1;
}

static BaseStatus find_columns(DumpReader *dump, const PackingLine *title) {
  static const DumpColumn triple[] = {DUMP_X, DUMP_XU, DUMP_XS, DUMP_XSU};
  PackingToken token[PACKING_TOKENS];
  const int count = packing_split(title, 0, token);
  dump->columns = count - 2; /* ITEM: ATOMS */
  for (int c = 0; c < DUMP_COLUMNS; c++) {
    dump->column[c] = -1;
    for (int k = 2; k < count; k++)
      if (packing_token_is(token + k, column_name[c])) dump->column[c] = k - 2;
  }
  if (dump->column[DUMP_RADIUS] < 0 && dump->column[DUMP_DIAMETER] < 0)
    return dump_error(dump, "no column radius", "radius (or diameter) among the columns of dump custom");
  for (int k = 0; k < 4; k++)
    if (have_triple(dump, triple[k])) {
      dump->position = triple[k];
      dump->scaled = triple[k] >= DUMP_XS;
      return BASE_OK;
    }
  return dump_error(dump, "no position columns",
                    dump->dimension == 2 ? "x y (or xu yu, xs ys)" : "x y z (or xu yu zu, xs ys zs)");
}

static void unscale(const PackingBox *box, double x[3]) {
  const double s[3] = {x[0], x[1], x[2]};
  x[0] = box->low[0] + (box->high[0] - box->low[0]) * s[0] + box->tilt[0] * s[1] + box->tilt[1] * s[2];
  x[1] = box->low[1] + (box->high[1] - box->low[1]) * s[1] + box->tilt[2] * s[2];
  x[2] = box->low[2] + (box->high[2] - box->low[2]) * s[2];
}

/* Reads the columns first, first + 1, first + 2 where they are; the others stay. */
static BaseStatus read_triple(DumpReader *dump, const PackingToken *token, DumpColumn first, double value[3]) {
  for (int k = 0; k < 3; k++) {
    const int at = dump->column[first + k];
    if (at >= 0) TRY(packing_numbers(&dump->reader, token + at, 1, column_name[first + k], value + k));
  }
  return BASE_OK;
}

static BaseStatus read_grain(DumpReader *dump, const PackingToken *token, size_t k) {
  PackingBox *box = dump->box;
  const int has_radius = dump->column[DUMP_RADIUS] >= 0;
  const int size_at = dump->column[has_radius ? DUMP_RADIUS : DUMP_DIAMETER];
  double size;
  TRY(packing_numbers(&dump->reader, token + size_at, 1, has_radius ? "radius" : "diameter", &size));
  if (!(size > 0.0)) return dump_error(dump, "a radius that is not positive", "radius > 0");
  box->radius[k] = has_radius ? size : 0.5 * size;
  if (box->id && !packing_integer(token + dump->column[DUMP_ID], box->id + k))
    return dump_error(dump, "no integer", "an atom id");
  TRY(read_triple(dump, token, dump->position, box->position + 3 * k));
  if (dump->scaled) unscale(box, box->position + 3 * k);
  if (!box->velocity) return BASE_OK;
  TRY(read_triple(dump, token, DUMP_VX, box->velocity + 3 * k));
  return read_triple(dump, token, DUMP_OMEGAX, box->spin + 3 * k);
}

static BaseStatus read_grains(DumpReader *dump, const PackingLine *title) {
  PackingLine line;
  PackingToken token[PACKING_TOKENS];
  if (dump->atoms < 0 || !dump->have_bounds)
    return dump_error(dump, "ITEM: ATOMS", "ITEM: NUMBER OF ATOMS and ITEM: BOX BOUNDS before it");
  TRY(find_columns(dump, title));
  if (dump->atoms > (int64_t)(dump->reader.file->size - dump->reader.at) / 2 / dump->columns + 1) {
    dump->cut = 1; /* the rest of the file cannot hold so many lines */
    return base_error(BASE_ERROR_FORMAT,
                      "packing file %s, line %lld: %lld atoms announced, the file is too short for them (truncated?)",
                      dump->reader.file->name, (long long)dump->reader.number, (long long)dump->atoms);
  }
  TRY(packing_box_create(dump->atoms, have_triple(dump, DUMP_VX), dump->box));
  if (dump->column[DUMP_ID] < 0) base_free(dump->box->id), dump->box->id = NULL;
  for (int k = 0; k < dump->box->grains; k++) {
    TRY(require_line(dump, &line));
    if (packing_split(&line, 0, token) != dump->columns)
      return dump_error(dump, "another number of columns than in ITEM: ATOMS", "one number per column");
    TRY(read_grain(dump, token, (size_t)k));
  }
  return BASE_OK;
}

static BaseStatus read_frame(DumpReader *dump) {
  PackingLine line;
  for (;;) {
    TRY(require_line(dump, &line));
    if (packing_line_starts(&line, "ITEM: NUMBER OF ATOMS")) TRY(read_count(dump));
    else if (packing_line_starts(&line, "ITEM: BOX BOUNDS")) TRY(read_bounds(dump, &line));
    else if (packing_line_starts(&line, "ITEM: ATOMS")) return read_grains(dump, &line);
  }
}

int packing_is_dump(const PackingFile *file) { return file->size >= 5 && memcmp(file->bytes, "ITEM:", 5) == 0; }

BaseStatus packing_read_dump(const PackingFile *file, int dimension, PackingBox *box) {
  PackingReader scan = {.file = file},
                start[2] = {{.file = file}, {.file = file}}; /* the last frame and the one before */
  PackingLine line;
  int frames = 0;
  for (PackingReader before = scan; packing_next_line(&scan, &line); before = scan)
    if (packing_line_starts(&line, "ITEM: TIMESTEP")) start[1] = start[0], start[0] = before, frames++;
  BaseStatus status = base_error(BASE_ERROR_FORMAT, "packing file %s: no line 'ITEM: TIMESTEP' found", file->name);
  for (int k = 0; k < 2 && k < frames; k++) {
    DumpReader dump = {.reader = start[k], .box = box, .dimension = dimension, .atoms = -1};
    status = read_frame(&dump);
    if (status == BASE_OK || !dump.cut) return status;
    packing_box_destroy(box); /* a run that still writes, or was stopped: the frame before counts */
  }
  return status;
}
