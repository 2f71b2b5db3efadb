/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Binary restart files of LIGGGHTS 3.x, little-endian, one file: header of flagged values, groups, masses, force field,
 * fixes' global state, fixes' list of per-atom data, then one chunk of atom records per process. The layout is that of
 * LIGGGHTS-PUBLIC 3.8.0; a force field or atom style that cannot be stepped over is refused. */
#include <math.h>
#include <string.h>

#include "rve_packing_file.h"

/* Flags of the header, in LIGGGHTS' order. */
typedef enum RestartFlag {
  RESTART_VERSION = 0,
  RESTART_BIGINT = 3,
  RESTART_UNITS = 4,
  RESTART_NTIMESTEP = 5,
  RESTART_NPROCS = 7,
  RESTART_XPERIODIC = 13,
  RESTART_ZPERIODIC = 15,
  RESTART_ATOM_STYLE = 22,
  RESTART_NATOMS = 23,
  RESTART_NTYPES = 24,
  RESTART_NBONDS = 25,
  RESTART_NANGLES = 28,
  RESTART_NDIHEDRALS = 31,
  RESTART_NIMPROPERS = 34,
  RESTART_BOXLO_0 = 37,
  RESTART_BOXHI_2 = 42,
  RESTART_SPECIAL_LAST = 48,
  RESTART_XY = 49,
  RESTART_YZ = 51
} RestartFlag;

/* An atom record of atom_style granular: its length, then these, then the fixes' data. */
enum { RECORD_X = 1, RECORD_TAG = 4, RECORD_V = 8, RECORD_RADIUS = 11, RECORD_OMEGA = 14, RECORD_DOUBLES = 17 };
/* Bits 6 to 11 of a granular pair style's code tell the tangential model; `history` is number 2. */
enum { TANGENTIAL_SHIFT = 6, TANGENTIAL_MASK = 63, TANGENTIAL_HISTORY = 2 };

typedef struct RestartReader {
  const PackingFile *file;
  PackingBox *box;
  int dimension;
  size_t at;
  int32_t processes, types;
  int64_t atoms;
  int tangential_history; /* the pair style keeps a tangential displacement */
  int32_t fixes;          /* with data in each atom record */
  int history_fix;        /* which of them is the contact history, -1: none */
  int history_values;     /* numbers per contact */
  size_t histories_room;
  int have_bounds;
} RestartReader;

static BaseStatus restart_error(const RestartReader *restart, const char *what) {
  return base_error(BASE_ERROR_FORMAT, "packing file %s (binary restart), byte %zu: %s", restart->file->name,
                    restart->at, what);
}

static BaseStatus read_bytes(RestartReader *restart, void *to, size_t bytes) {
  if (bytes > restart->file->size - restart->at) return restart_error(restart, "the file ends here (truncated)");
  memcpy(to, restart->file->bytes + restart->at, bytes);
  restart->at += bytes;
  return BASE_OK;
}

static BaseStatus read_int(RestartReader *restart, int32_t *value) { return read_bytes(restart, value, sizeof *value); }

/* A length and so many bytes, the last of them 0. */
static BaseStatus read_text(RestartReader *restart, PackingToken *text) {
  int32_t length = 0;
  TRY(read_int(restart, &length));
  if (length < 0 || (size_t)length > restart->file->size - restart->at)
    return restart_error(restart, "a text longer than the file (altered?)");
  text->start = restart->file->bytes + restart->at;
  text->length = length > 0 ? (size_t)length - 1 : 0;
  restart->at += (size_t)length;
  return BASE_OK;
}

static BaseStatus read_named(RestartReader *restart, int flag) {
  PackingToken text;
  char quote[PACKING_QUOTE];
  TRY(read_text(restart, &text));
  if (flag == RESTART_UNITS && !packing_token_is(&text, "si"))
    return base_error(BASE_ERROR_FORMAT, "packing file %s (binary restart): units are '%s'; need si",
                      restart->file->name, packing_quote(&text, quote));
  if (flag == RESTART_ATOM_STYLE && !packing_token_is(&text, "granular") && !packing_token_is(&text, "sphere"))
    return base_error(BASE_ERROR_FORMAT,
                      "packing file %s (binary restart): atom style is '%s'; need granular (or sphere)",
                      restart->file->name, packing_quote(&text, quote));
  return BASE_OK;
}

static BaseStatus read_wide(RestartReader *restart, int flag) {
  int64_t value;
  TRY(read_bytes(restart, &value, sizeof value));
  if (flag == RESTART_NATOMS) restart->atoms = value;
  return BASE_OK;
}

static BaseStatus read_real(RestartReader *restart, int flag) {
  double value;
  TRY(read_bytes(restart, &value, sizeof value));
  if (flag >= RESTART_BOXLO_0 && flag <= RESTART_BOXHI_2) {
    const int k = flag - RESTART_BOXLO_0;
    (k % 2 ? restart->box->high : restart->box->low)[k / 2] = value;
    restart->have_bounds |= 1 << k;
  }
  if (flag >= RESTART_XY && flag <= RESTART_YZ) restart->box->tilt[flag - RESTART_XY] = value;
  return BASE_OK;
}

static BaseStatus read_small(RestartReader *restart, int flag) {
  int32_t value;
  TRY(read_int(restart, &value));
  if (flag == RESTART_BIGINT && value != 8)
    return restart_error(restart, "written by a LIGGGHTS whose bigint has not 8 bytes");
  if (flag == RESTART_NPROCS) restart->processes = value;
  if (flag == RESTART_NTYPES) restart->types = value;
  if (flag >= RESTART_XPERIODIC && flag < RESTART_XPERIODIC + restart->dimension && value != 1)
    return base_error(BASE_ERROR_FORMAT,
                      "packing file %s (binary restart): the boundary along %c is not periodic; need 'boundary p p p'",
                      restart->file->name, 'x' + flag - RESTART_XPERIODIC);
  return BASE_OK;
}

static BaseStatus read_header(RestartReader *restart) {
  int32_t flag;
  for (;;) {
    TRY(read_int(restart, &flag));
    if (flag == -1) break;
    if (flag < 0 || flag > RESTART_YZ)
      return restart_error(restart, "an unknown flag in the header (altered, or of another version)");
    if (flag == RESTART_VERSION || flag == RESTART_UNITS || flag == RESTART_ATOM_STYLE) TRY(read_named(restart, flag));
    else if (flag == RESTART_NTIMESTEP || flag == RESTART_NATOMS || flag == RESTART_NBONDS || flag == RESTART_NANGLES ||
             flag == RESTART_NDIHEDRALS || flag == RESTART_NIMPROPERS)
      TRY(read_wide(restart, flag));
    else if (flag >= RESTART_BOXLO_0) TRY(read_real(restart, flag));
    else TRY(read_small(restart, flag));
  }
  if (restart->have_bounds != 63) return restart_error(restart, "the header has no box bounds");
  if (restart->atoms < 1) return restart_error(restart, "no grains; at least 1 is needed");
  if (restart->types < 1 || restart->types > 1000000)
    return restart_error(restart, "a number of atom types outside 1 .. 1000000 (altered?)");
  if (restart->processes < 1) return restart_error(restart, "a number of processes below 1 (altered?)");
  return BASE_OK;
}

static BaseStatus skip_groups(RestartReader *restart) {
  enum { MOST_GROUPS = 32 };
  int32_t groups;
  PackingToken name;
  TRY(read_int(restart, &groups));
  if (groups < 0 || groups > MOST_GROUPS) return restart_error(restart, "more than 32 groups (altered?)");
  for (int slot = 0, met = 0; slot < MOST_GROUPS && met < groups; slot++) {
    const size_t before = restart->at;
    TRY(read_text(restart, &name));
    if (restart->at > before + sizeof(int32_t)) met++; /* an empty slot has length 0 */
  }
  return BASE_OK;
}

static BaseStatus skip_bytes(RestartReader *restart, size_t bytes) {
  if (bytes > restart->file->size - restart->at) return restart_error(restart, "the file ends here (truncated)");
  restart->at += bytes;
  return BASE_OK;
}

static BaseStatus skip_masses_and_forces(RestartReader *restart) {
  int32_t flag;
  const size_t types = (size_t)restart->types;
  for (;;) {
    TRY(read_int(restart, &flag));
    if (flag == -1) break;
    if (flag != 0) return restart_error(restart, "an unknown flag among the masses (altered?)");
    TRY(skip_bytes(restart, types * sizeof(double)));
  }
  for (;;) {
    PackingToken style;
    char quote[PACKING_QUOTE];
    int64_t model;
    TRY(read_int(restart, &flag));
    if (flag == -1) return BASE_OK;
    TRY(read_text(restart, &style));
    if (flag != 0 || !packing_token_is(&style, "gran"))
      return base_error(BASE_ERROR_FORMAT,
                        "packing file %s (binary restart): force style '%s' cannot be stepped over; need pair_style "
                        "gran or none (or use "
                        "write_data)",
                        restart->file->name, packing_quote(&style, quote));
    TRY(read_bytes(restart, &model, sizeof model));
    restart->tangential_history = ((model >> TANGENTIAL_SHIFT) & TANGENTIAL_MASK) == TANGENTIAL_HISTORY;
    TRY(skip_bytes(restart, types * (types + 1) / 2 * sizeof(int32_t)));
  }
}

static BaseStatus read_fixes(RestartReader *restart) {
  int32_t count, bytes;
  PackingToken name, style, state;
  TRY(read_int(restart, &count));
  for (int32_t k = 0; k < count; k++) {
    TRY(read_text(restart, &name));
    TRY(read_text(restart, &style));
    TRY(read_int(restart, &bytes));
    if (bytes < 0) return restart_error(restart, "a fix's state of negative size (altered?)");
    state = (PackingToken){restart->file->bytes + restart->at, (size_t)bytes};
    TRY(skip_bytes(restart, (size_t)bytes));
    if (packing_token_is(&style, "contacthistory") && state.length >= sizeof(double)) {
      double values;
      memcpy(&values, state.start, sizeof values);
      restart->history_values = values >= 0 && values < 1000 ? (int)values : 0;
    }
  }
  TRY(read_int(restart, &restart->fixes));
  restart->history_fix = -1;
  for (int32_t k = 0; k < restart->fixes; k++) {
    TRY(read_text(restart, &name));
    TRY(read_text(restart, &style));
    TRY(read_int(restart, &bytes));
    if (packing_token_is(&style, "contacthistory")) restart->history_fix = (int)k;
  }
  return BASE_OK;
}

static double record_real(const char *record, size_t index) {
  double value;
  memcpy(&value, record + index * sizeof value, sizeof value);
  return value;
}

static int64_t record_integer(const char *record, size_t index) {
  int64_t value;
  memcpy(&value, record + index * sizeof value, sizeof value);
  return value;
}

/* A count stored as a double, within 0 .. limit; otherwise -1. */
static int64_t record_count(const char *record, size_t index, size_t limit) {
  const double value = record_real(record, index);
  return value >= 0.0 && value <= (double)limit && value == floor(value) ? (int64_t)value : -1;
}

static BaseStatus add_history(RestartReader *restart, const PackingHistory *history) {
  PackingBox *box = restart->box;
  if ((size_t)box->histories == restart->histories_room) {
    const size_t room = 2 * restart->histories_room + 64;
    TRY(BASE_GROW(restart->histories_room, room, &box->history));
    restart->histories_room = room;
  }
  box->history[box->histories++] = *history;
  return BASE_OK;
}

/* The contact-history fix's part of a grain's record: [length, contacts, (partner, values...) per contact]. Kept only
 * when the three values are the tangential displacement. */
static BaseStatus read_history(RestartReader *restart, const char *record, size_t length, int grain) {
  if (restart->history_fix < 0 || restart->history_values != 3 || !restart->tangential_history) return BASE_OK;
  size_t at = RECORD_DOUBLES;
  for (int k = 0; k < restart->history_fix; k++) {
    const int64_t part = at < length ? record_count(record, at, length - at) : -1;
    if (part < 1) return restart_error(restart, "a fix's data of a grain do not fit in its record (altered?)");
    at += (size_t)part;
  }
  if (at + 2 > length) return restart_error(restart, "a grain's record ends before its contact history (altered?)");
  const int64_t contacts = record_integer(record, at + 1);
  const size_t each = 4;
  if (contacts < 0 || (uint64_t)contacts > (length - at - 2) / each)
    return restart_error(restart, "a grain's contacts do not fit in its record (altered?)");
  for (size_t c = 0; c < (size_t)contacts; c++) {
    const size_t entry = at + 2 + c * each;
    const PackingHistory history = {
        grain,
        record_integer(record, entry),
        {record_real(record, entry + 1), record_real(record, entry + 2), record_real(record, entry + 3)}};
    if (!isfinite(history.displacement[0]) || !isfinite(history.displacement[1]) || !isfinite(history.displacement[2]))
      return restart_error(restart, "a tangential displacement is not finite");
    TRY(add_history(restart, &history));
  }
  return BASE_OK;
}

static BaseStatus read_record(RestartReader *restart, const char *record, size_t length, int grain) {
  PackingBox *box = restart->box;
  const size_t at = 3 * (size_t)grain;
  box->id[grain] = record_integer(record, RECORD_TAG);
  box->radius[grain] = record_real(record, RECORD_RADIUS);
  for (size_t k = 0; k < 3; k++) {
    box->position[at + k] = record_real(record, RECORD_X + k);
    box->velocity[at + k] = record_real(record, RECORD_V + k);
    box->spin[at + k] = record_real(record, RECORD_OMEGA + k);
  }
  return read_history(restart, record, length, grain);
}

static BaseStatus read_records(RestartReader *restart) {
  if ((uint64_t)restart->atoms > (restart->file->size - restart->at) / (RECORD_DOUBLES * sizeof(double)))
    return base_error(
        BASE_ERROR_FORMAT,
        "packing file %s (binary restart): the header says %lld atoms, the file is too short for them (truncated?)",
        restart->file->name, (long long)restart->atoms);
  TRY(packing_box_create(restart->atoms, 1, restart->box));
  int grain = 0;
  for (int32_t process = 0; process < restart->processes; process++) {
    int32_t doubles;
    TRY(read_int(restart, &doubles));
    if (doubles < 0 || (size_t)doubles > (restart->file->size - restart->at) / sizeof(double))
      return restart_error(restart, "the atom records of a process are longer than the file (truncated?)");
    for (size_t left = (size_t)doubles; left > 0;) {
      const char *record = restart->file->bytes + restart->at;
      const int64_t length = record_count(record, 0, left);
      if (length < RECORD_DOUBLES || grain == restart->box->grains)
        return restart_error(restart, "an atom record of wrong length, or one too many (altered?)");
      TRY(read_record(restart, record, (size_t)length, grain++));
      restart->at += (size_t)length * sizeof(double);
      left -= (size_t)length;
    }
  }
  if (grain != restart->box->grains)
    return base_error(BASE_ERROR_FORMAT, "packing file %s (binary restart): %d atom records, the header says %d",
                      restart->file->name, grain, restart->box->grains);
  return BASE_OK;
}

int packing_is_restart(const PackingFile *file) {
  static const char name[] = "LIGGGHTS";
  int32_t head[2];
  if (file->size < sizeof head + 32) return 0;
  memcpy(head, file->bytes, sizeof head);
  if (head[0] != RESTART_VERSION || head[1] < (int32_t)sizeof name || head[1] > 4096) return 0;
  for (size_t k = 0; k + sizeof name - 1 <= 24; k++)
    if (memcmp(file->bytes + sizeof head + k, name, sizeof name - 1) == 0) return 1;
  return 0;
}

BaseStatus packing_read_restart(const PackingFile *file, int dimension, PackingBox *box) {
  RestartReader restart = {.file = file, .box = box, .dimension = dimension, .history_fix = -1};
  TRY(read_header(&restart));
  TRY(skip_groups(&restart));
  TRY(skip_masses_and_forces(&restart));
  TRY(read_fixes(&restart));
  return read_records(&restart);
}
