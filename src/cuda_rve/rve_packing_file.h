/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Internal to the packing readers: a file in memory, its lines and tokens, and the grains of a periodic box before they
 * become an RvePacking. Every reader works on bytes that it does not trust. */
#ifndef DEMPM_RVE_PACKING_FILE_H
#define DEMPM_RVE_PACKING_FILE_H

#include "rve_packing.h"

typedef struct PackingFile {
  const char *name; /* as the user gave it */
  const char *bytes;
  size_t size;
} PackingFile;

/* A line without its end; `number` counts from 1. ended: a line feed follows (a last line without one may be cut). */
typedef struct PackingLine {
  const char *start;
  size_t length;
  int64_t number;
  int ended;
} PackingLine;

typedef struct PackingReader {
  const PackingFile *file;
  size_t at;      /* of the next line */
  int64_t number; /* of the line read last */
} PackingReader;

typedef struct PackingToken {
  const char *start;
  size_t length;
} PackingToken;

enum { PACKING_TOKENS = 64 /* columns of a line that are looked at */, PACKING_QUOTE = 48 };

/* The next line; 0 at the end of the file. */
int packing_next_line(PackingReader *reader, PackingLine *line);
/* Splits at blanks into at most PACKING_TOKENS tokens; text after '#' is left out when comments is 1. Returns the
 * count. */
int packing_split(const PackingLine *line, int comments, PackingToken token[PACKING_TOKENS]);
int packing_token_is(const PackingToken *token, const char *word);
int packing_line_starts(const PackingLine *line, const char *word);
/* 1 when the whole token is a number (finite or not) / an integer in range. */
int packing_number(const PackingToken *token, double *value);
int packing_integer(const PackingToken *token, int64_t *value);
/* The token's first characters, unprintable ones as '?', for messages. Returns text. */
const char *packing_quote(const PackingToken *token, char text[PACKING_QUOTE]);

/* Reads `count` finite numbers from token[0..); the error names file, line and what was found. */
BaseStatus packing_numbers(const PackingReader *reader, const PackingToken *token, int count, const char *what,
                           double *value);

/* Tangential history as a LIGGGHTS restart has it: of the contact of grain `owner` (index) with the grain of id
 * `partner`; force on the owner = -kt displacement. */
typedef struct PackingHistory {
  int owner;
  int64_t partner;
  double displacement[3]; /* m */
} PackingHistory;

/* A periodic box as LIGGGHTS describes it: edges (lx,0,0), (xy,ly,0), (xz,yz,lz). */
typedef struct PackingBox {
  double low[3], high[3]; /* m */
  double tilt[3];         /* xy, xz, yz, m */
  int grains;
  int64_t *id;      /* [grains], or NULL: order of the file */
  double *position; /* [grains][3] m */
  double *radius;   /* [grains] m */
  double *velocity; /* [grains][3] m/s, or NULL */
  double *spin;     /* [grains][3] rad/s, or NULL */
  int histories;
  PackingHistory *history; /* [histories], or NULL */
} PackingBox;

/* Room for `grains` grains (zeroed); `motion` also for velocity and spin. */
BaseStatus packing_box_create(int64_t grains, int motion, PackingBox *box);
void packing_box_destroy(PackingBox *box);

/* Grain indices in the order of their ids; find gives the index of an id or -1. BASE_ERROR_FORMAT if an id is there
 * twice. */
BaseStatus packing_sort_ids(const PackingFile *file, const PackingBox *box, int **order);
int packing_find_id(const PackingBox *box, const int *order, int64_t id);

/* The readers of each kind; they fill a box that packing_box_destroy() frees, also after an error. dimension 2 lets z
 * be non-periodic, for z is dropped. */
BaseStatus packing_read_data(const PackingFile *file, int dimension, PackingBox *box);
BaseStatus packing_read_dump(const PackingFile *file, int dimension, PackingBox *box);
BaseStatus packing_read_restart(const PackingFile *file, int dimension, PackingBox *box);
/* rve_packing_write()'s own form. */
BaseStatus packing_read_text(const PackingFile *file, RvePacking *packing);

int packing_is_dump(const PackingFile *file);
int packing_is_restart(const PackingFile *file);
int packing_is_text(const PackingFile *file);

/* Sorts by id, wraps into the cell, drops z in 2D, makes forces of the histories with tangential_stiffness (0: none).
 */
BaseStatus packing_from_box(const PackingFile *file, PackingBox *box, int dimension, double tangential_stiffness,
                            RvePacking *packing);

/* rve_packing_read_history() of a file that is in memory; for it, and for tests and the fuzzer. */
BaseStatus packing_read_bytes(const PackingFile *file, int dimension, double tangential_stiffness, RvePacking *packing);

#endif
