/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Element tests: a packing through a loading path, prescribed by velocity gradients and by stresses that a servo holds.
 * Internal to the program dempm-rve. Tension positive; pressures and strains of the built-in paths are compression
 * positive, as soil mechanics has them. */
#ifndef DEMPM_RVE_ELEMENT_H
#define DEMPM_RVE_ELEMENT_H

#include <stdio.h>

#include "rve.h"

/* What the --set settings say. NAN: not given. */
typedef struct ElementSettings {
  RveScene scene;
  RveBackend backend;
  /* built-in paths */
  double pressure;  /* Pa, > 0 */
  double start;     /* isotropic: Pa, > 0, pressure at time 0 */
  double duration;  /* isotropic: s */
  double rate;      /* 1/s, > 0: axial compression, or shear */
  double strain;    /* at the end: logarithmic axial compression, or shear angle's tangent */
  /* servo */
  double servo_rate;       /* 1/s, > 0: it asks for no faster strain rates; NAN: found from path and packing */
  int servo_steps;         /* DEM steps of one call under stress control */
  double stress_tolerance; /* of the largest stress that is asked for */
  double most_steps;       /* DEM steps that the approach to the first row's stresses may take */
} ElementSettings;

ElementSettings element_settings_default(int dimension);
/* Takes "name=value" words; refuses unknown, repeated, wrong and missing ones. path: name of a built-in path, or NULL
 * for a path from a file. */
BaseStatus element_settings_read(int words, char *const *word, const char *path, ElementSettings *settings);

/* From its time to the next row's. */
typedef struct ElementRow {
  double time;        /* s */
  double gradient[9]; /* L_ij, 1/s, held until the next row; 0 where a stress is asked for */
  double stress[6];   /* asked for at this time, Pa, xx yy zz xy xz yz; NAN: the velocity gradient rules. Goes linearly to
                         the next row's value; stays if the next row asks for none */
  double temperature; /* at this time, linear in between; NAN: none is given, the same for all rows */
} ElementRow;

typedef struct ElementPath {
  int rows; /* at least 2; the first is at time 0 */
  ElementRow *row;
  double approach[6]; /* Pa, stress to be reached before time 0; NAN: the component is not strained */
} ElementPath;

void element_path_destroy(ElementPath *path);
/* 1 if the name is that of a built-in path. */
int element_path_is_builtin(const char *name);
extern const char element_path_names[]; /* "isotropic, oedometer, ..." */
/* present: the packing's stress. */
BaseStatus element_path_make(const char *name, const ElementSettings *settings, const double present[6],
                             ElementPath *path);
BaseStatus element_path_read(const char *file, const RveScene *scene, ElementPath *path);

/* Which entry of a symmetric tensor is which of the full one. */
extern const int element_row[6], element_column[6];
extern const char element_axis[3];
/* 1 if entry k of a symmetric tensor lies in the plane (always in 3D). */
int element_in_plane(int dimension, int k);

/* One line of the answer. */
typedef struct ElementState {
  double time;        /* s */
  double gradient[9]; /* F since time 0 */
  double temperature;
  double heat; /* W/m3, mean since the last line */
  RveAnswer answer;
  double friction_work, damping_work; /* J since time 0 */
  double overlap;                     /* deepest one, over the smaller radius */
} ElementState;
/* Deepest overlap of RVE 0, over the smaller radius; unchanged if it has failed: its grains may be anywhere then. */
BaseStatus element_overlap(const RveBatch *batch, double *overlap);
/* Which columns there are follows from the scene. */
void element_table_head(FILE *out, const RveScene *scene);
void element_table_line(FILE *out, const RveScene *scene, const ElementState *state);

typedef struct ElementFigures { /* of a whole run */
  double seconds;               /* wall time in the engine */
  double particle_steps;
  double worst_overlap; /* of all lines */
  double worst_stress;  /* largest deviation of the running mean from what was asked for, over the largest stress */
  double approach_time; /* s, of the approach */
  int64_t approach_steps;
  double approach[9]; /* F of the approach */
  int lines;
} ElementFigures;

typedef struct ElementRun {
  const ElementSettings *settings;
  const ElementPath *path;
  int copies;      /* RVEs that take the same path */
  int64_t every;   /* DEM steps from line to line; 0: 200 lines */
  FILE *out;
  const char *replay_file; /* is written if the packing becomes unstable */
} ElementRun;
/* Runs the path. The lines so far are written also on an error. */
BaseStatus element_run(const ElementRun *run, const RvePacking *packing, RveBatch *batch, ElementFigures *figures);

#endif
