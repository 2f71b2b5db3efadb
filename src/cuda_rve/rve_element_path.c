/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Loading paths: the built-in ones, and those of CSV files. */
#include "rve_element.h"

#include <math.h>
#include <string.h>

#include "../base/base_file.h"
#include "rve_packing_file.h"

const int element_row[6] = {0, 1, 2, 0, 0, 1}, element_column[6] = {0, 1, 2, 1, 2, 2};
const char element_axis[3] = {'x', 'y', 'z'};
const char element_path_names[] = "isotropic, oedometer, biaxial, triaxial, simple-shear";

int element_in_plane(int dimension, int k) { return dimension == 3 || (element_row[k] < 2 && element_column[k] < 2); }

void element_path_destroy(ElementPath *path) {
  base_free(path->row);
  path->row = NULL;
  path->rows = 0;
}

static BaseStatus create(int rows, ElementPath *path) {
  path->rows = rows;
  for (int k = 0; k < 6; k++) path->approach[k] = NAN;
  TRY(BASE_ALLOC((size_t)rows, &path->row));
  for (int r = 0; r < rows; r++) {
    for (int k = 0; k < 6; k++) path->row[r].stress[k] = NAN;
    path->row[r].temperature = NAN;
  }
  return BASE_OK;
}

/* ------------------------------------------------------------------------------------------------------- built-in */

int element_path_is_builtin(const char *name) {
  static const char *const names[] = {"isotropic", "oedometer", "biaxial", "triaxial", "simple-shear"};
  for (size_t k = 0; k < sizeof names / sizeof *names; k++)
    if (strcmp(name, names[k]) == 0) return 1;
  return 0;
}

static void isotropic_stress(int dimension, double pressure, double stress[6]) {
  for (int k = 0; k < 6; k++)
    if (element_in_plane(dimension, k)) stress[k] = k < 3 ? -pressure : 0.0;
}

/* Pressures in a geometric series: soil's void ratio is a function of their logarithm. */
static BaseStatus make_isotropic(const ElementSettings *settings, const double present[6], ElementPath *path) {
  enum { ROWS = 41 };
  const int dimension = settings->scene.dimension;
  double start = settings->start;
  if (isnan(start)) {
    start = 0.0;
    for (int k = 0; k < dimension; k++) start -= present[k] / dimension;
    if (!(start > 0.0))
      return base_error(BASE_ERROR_ARGUMENT,
                        "--set start=... is missing: the packing's own mean pressure is %g Pa, the path needs a "
                        "positive one to begin with",
                        start);
  }
  TRY(create(ROWS, path));
  for (int r = 0; r < ROWS; r++) {
    const double part = (double)r / (ROWS - 1);
    path->row[r].time = settings->duration * part;
    isotropic_stress(dimension, start * pow(settings->pressure / start, part), path->row[r].stress);
  }
  isotropic_stress(dimension, start, path->approach);
  return BASE_OK;
}

BaseStatus element_path_make(const char *name, const ElementSettings *settings, const double present[6],
                             ElementPath *path) {
  const int dimension = settings->scene.dimension, axial = dimension - 1;
  const double p = settings->pressure;
  memset(path, 0, sizeof *path);
  if (strcmp(name, "isotropic") == 0) return make_isotropic(settings, present, path);
  if (strcmp(name, "triaxial") == 0 && dimension == 2)
    return base_error(BASE_ERROR_ARGUMENT, "--path triaxial needs dimension 3 (in dimension 2: biaxial)");
  TRY(create(2, path));
  path->row[1].time = settings->strain / settings->rate;
  if (!isnan(p)) isotropic_stress(dimension, p, path->approach);
  for (int r = 0; r < 2; r++) {
    ElementRow *row = &path->row[r];
    if (strcmp(name, "simple-shear") == 0) {
      row->gradient[1] = settings->rate; /* L_xy */
      if (!isnan(p)) row->stress[1] = -p;
      continue;
    }
    row->gradient[4 * axial] = -settings->rate;
    if (strcmp(name, "biaxial") == 0) row->stress[0] = -p;
    if (strcmp(name, "triaxial") == 0) row->stress[0] = row->stress[1] = -p;
  }
  return BASE_OK;
}

/* ------------------------------------------------------------------------------------------------------- CSV files */

typedef enum ColumnKind { COLUMN_TIME, COLUMN_GRADIENT, COLUMN_STRESS, COLUMN_TEMPERATURE } ColumnKind;
typedef struct Column {
  ColumnKind kind;
  int index; /* of the tensor's entry */
  char name[8];
} Column;

enum { MOST_COLUMNS = 32, MOST_BYTES = 1 << 28 };

/* Splits at commas, blanks around fields left out; at most MOST_COLUMNS + 1 fields. */
static int split(const PackingLine *line, PackingToken field[MOST_COLUMNS + 1]) {
  const char *at = line->start, *end = at + line->length;
  int count = 0;
  for (; count <= MOST_COLUMNS; count++) {
    const char *comma = memchr(at, ',', (size_t)(end - at)), *from = at, *to = comma ? comma : end;
    while (from < to && strchr(" \t\r", *from)) from++;
    while (to > from && strchr(" \t\r", to[-1])) to--;
    field[count] = (PackingToken){from, (size_t)(to - from)};
    if (!comma) return count + 1;
    at = comma + 1;
  }
  return count;
}

static int is_empty(const PackingLine *line) {
  for (size_t k = 0; k < line->length; k++) {
    if (line->start[k] == '#') return 1;
    if (!strchr(" \t\r", line->start[k]) || line->start[k] == '\0') return 0;
  }
  return 1;
}

static BaseStatus read_column(const PackingFile *file, const RveScene *scene, const PackingToken *token, Column *column) {
  char quote[PACKING_QUOTE];
  *column = (Column){COLUMN_TIME, 0, ""};
  if (token->length < sizeof column->name) memcpy(column->name, token->start, token->length);
  if (packing_token_is(token, "time")) return BASE_OK;
  if (packing_token_is(token, "T")) {
    column->kind = COLUMN_TEMPERATURE;
    if (scene->thermal) return BASE_OK;
    return base_error(BASE_ERROR_FORMAT, "path file %s: column T needs heat: --set expansion, Tref and alpha", file->name);
  }
  for (int k = 0; k < 9; k++) {
    const char name[4] = {'L', element_axis[k / 3], element_axis[k % 3], '\0'};
    if (!packing_token_is(token, name)) continue;
    column->kind = COLUMN_GRADIENT, column->index = k;
    if (scene->dimension == 3 || (k / 3 < 2 && k % 3 < 2)) return BASE_OK;
    return base_error(BASE_ERROR_FORMAT, "path file %s: column %s; dimension 2 allows Lxx Lxy Lyx Lyy", file->name, name);
  }
  for (int k = 0; k < 6; k++) {
    const char name[4] = {'s', element_axis[element_row[k]], element_axis[element_column[k]], '\0'};
    if (!packing_token_is(token, name)) continue;
    column->kind = COLUMN_STRESS, column->index = k;
    if (element_in_plane(scene->dimension, k)) return BASE_OK;
    return base_error(BASE_ERROR_FORMAT, "path file %s: column %s; dimension 2 allows sxx syy sxy", file->name, name);
  }
  return base_error(BASE_ERROR_FORMAT,
                    "path file %s: unknown column '%s'; allowed: time, Lxx ... Lzz, sxx syy szz sxy sxz syz, T",
                    file->name, packing_quote(token, quote));
}

static BaseStatus read_head(const PackingFile *file, const RveScene *scene, const PackingLine *line, Column *column,
                            int *columns) {
  PackingToken field[MOST_COLUMNS + 1];
  *columns = split(line, field);
  if (*columns > MOST_COLUMNS)
    return base_error(BASE_ERROR_FORMAT, "path file %s: more than %d columns", file->name, MOST_COLUMNS);
  for (int k = 0; k < *columns; k++) {
    TRY(read_column(file, scene, &field[k], &column[k]));
    for (int m = 0; m < k; m++)
      if (strcmp(column[m].name, column[k].name) == 0)
        return base_error(BASE_ERROR_FORMAT, "path file %s: column %s is there twice", file->name, column[k].name);
  }
  if (column[0].kind != COLUMN_TIME)
    return base_error(BASE_ERROR_FORMAT, "path file %s: the first column is '%s'; it must be time", file->name,
                      column[0].name);
  return BASE_OK;
}

/* A component that a stress rules has no velocity gradient, not even 0. */
static BaseStatus check_row(const PackingFile *file, int64_t line, const int has_gradient[9], const ElementRow *row) {
  for (int k = 0; k < 6; k++) {
    const int i = element_row[k], j = element_column[k];
    if (isnan(row->stress[k]) || !(has_gradient[3 * i + j] || has_gradient[3 * j + i])) continue;
    return base_error(BASE_ERROR_FORMAT,
                      "path file %s, line %lld: s%c%c and L%c%c are both given; leave one of the fields empty",
                      file->name, (long long)line, element_axis[i], element_axis[j],
                      element_axis[has_gradient[3 * i + j] ? i : j], element_axis[has_gradient[3 * i + j] ? j : i]);
  }
  return BASE_OK;
}

static BaseStatus read_row(const PackingFile *file, const PackingLine *line, const Column *column, int columns,
                           ElementRow *row) {
  PackingToken field[MOST_COLUMNS + 1];
  char quote[PACKING_QUOTE];
  int has_gradient[9] = {0};
  const int fields = split(line, field);
  if (fields != columns)
    return base_error(BASE_ERROR_FORMAT, "path file %s, line %lld: %d fields, the header has %d", file->name,
                      (long long)line->number, fields, columns);
  for (int k = 0; k < columns; k++) {
    double value = 0.0;
    const int may_be_empty = column[k].kind == COLUMN_GRADIENT || column[k].kind == COLUMN_STRESS;
    if (field[k].length == 0 && may_be_empty) continue;
    if (!packing_number(&field[k], &value) || !isfinite(value))
      return base_error(BASE_ERROR_FORMAT, "path file %s, line %lld, column %s: found '%s'; a finite number is needed",
                        file->name, (long long)line->number, column[k].name, packing_quote(&field[k], quote));
    if (column[k].kind == COLUMN_TIME) row->time = value;
    if (column[k].kind == COLUMN_TEMPERATURE) row->temperature = value;
    if (column[k].kind == COLUMN_STRESS) row->stress[column[k].index] = value;
    if (column[k].kind == COLUMN_GRADIENT) row->gradient[column[k].index] = value, has_gradient[column[k].index] = 1;
  }
  return check_row(file, line->number, has_gradient, row);
}

static BaseStatus read_rows(const PackingFile *file, const RveScene *scene, ElementPath *path) {
  PackingReader reader = {.file = file};
  PackingLine line;
  Column column[MOST_COLUMNS + 1];
  int columns = 0, room = 1, rows = 0;
  for (PackingReader count = reader; packing_next_line(&count, &line);) room++;
  TRY(create(room, path));
  while (packing_next_line(&reader, &line)) {
    if (is_empty(&line)) continue;
    if (columns == 0) {
      TRY(read_head(file, scene, &line, column, &columns));
      continue;
    }
    TRY(read_row(file, &line, column, columns, &path->row[rows]));
    const double before = rows ? path->row[rows - 1].time : 0.0, time = path->row[rows].time;
    if (rows == 0 ? time != 0.0 : !(time > before))
      return base_error(BASE_ERROR_FORMAT, "path file %s, line %lld: time %g; allowed: %s %g", file->name,
                        (long long)line.number, time, rows ? ">" : "the first row is at", before);
    rows++;
  }
  if (rows < 2)
    return base_error(BASE_ERROR_FORMAT, "path file %s: %d rows of numbers; a header and at least 2 are needed",
                      file->name, rows);
  path->rows = rows;
  memcpy(path->approach, path->row[0].stress, sizeof path->approach);
  return BASE_OK;
}

BaseStatus element_path_read(const char *name, const RveScene *scene, ElementPath *path) {
  char *bytes;
  PackingFile file = {.name = name};
  memset(path, 0, sizeof *path);
  TRY(base_file_read(name, "path file", MOST_BYTES, &bytes, &file.size));
  file.bytes = bytes;
  const BaseStatus status = read_rows(&file, scene, path);
  base_free(bytes);
  if (status != BASE_OK) element_path_destroy(path);
  return status;
}
