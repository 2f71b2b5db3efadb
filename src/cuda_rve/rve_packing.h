/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Packings from the user's own LIGGGHTS files, from our own files and from the built-in generator. */
#ifndef DEMPM_RVE_PACKING_H
#define DEMPM_RVE_PACKING_H

#include "rve.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Reads a periodic packing; the kind is recognised by content: a LIGGGHTS data file (atom_style granular/sphere,
 * write_data or read_data form, also triclinic), the last complete frame of a text dump (dump custom with columns id x y
 * [z] radius, box bounds pp, ITEM: BOX BOUNDS also xy xz yz), a LIGGGHTS binary restart, or rve_packing_write()'s own text
 * form (which keeps the tangential history). dimension: 2 drops z (all grains in one layer); 3 keeps it. Grains are sorted
 * by id. Velocities and spins of the file are taken as they are, less the mean velocity. A data file does not tell its
 * boundaries: taken as periodic.
 * BASE_ERROR_FILE / BASE_ERROR_FORMAT with file, line and reason; never crashes on any bytes (fuzzed). */
BaseStatus rve_packing_read(const char *file, int dimension, RvePacking *packing);
/* As rve_packing_read; also makes the tangential displacements that a LIGGGHTS restart of `model hooke/stiffness
 * tangential history` holds into forces of this stiffness (kt, N/m; the file does not tell it). With 0, and with data
 * files and dumps, which have no history, contacts start without tangential force. */
BaseStatus rve_packing_read_history(const char *file, int dimension, double tangential_stiffness, RvePacking *packing);
/* Writes through a temporary name, fsync and rename; text with 17 digits. */
BaseStatus rve_packing_write(const char *file, const RvePacking *packing);

/* The built-in generator (errata A.6): random grains, no overlaps to speak of, then an isotropic servo with a
 * preparation friction, then at rest. */
typedef struct RveGenerator {
  int grains;                    /* >= 16 */
  double radius_min, radius_max; /* m, uniform distribution */
  double pressure;               /* Pa, > 0 (compression) */
  double preparation_friction;   /* mu while consolidating */
  double solid_fraction;         /* of the initial gas; 0 = default: 0.74 in 2D, 0.35 in 3D */
  double stress_tolerance;       /* |sigma_ii/p + 1| and |sigma_ij/p|, default 1e-3 */
  double unbalanced_tolerance;   /* mean resultant over mean contact force, default 1e-3 */
  int64_t max_steps;             /* default 2,000,000 */
  uint64_t seed;                 /* default 5; another seed, another packing */
} RveGenerator;
RveGenerator rve_generator_default(void);
/* scene gives dimension, grains' shape, stiffness, density; its friction is replaced by preparation_friction during
 * preparation. BASE_ERROR_UNSTABLE if max_steps pass first (says what was reached). */
BaseStatus rve_packing_generate(const RveScene *scene, const RveGenerator *generator, RvePacking *packing);

/* Crystals of one grain per primitive cell, radius R, overlap fraction o: branch length 2 R (1 - o). */
typedef enum RveLattice { RVE_SQUARE, RVE_HEXAGONAL, RVE_SIMPLE_CUBIC, RVE_BCC, RVE_FCC } RveLattice;
BaseStatus rve_packing_lattice(RveLattice lattice, double radius, double overlap, RvePacking *packing);

#ifdef __cplusplus
}
#endif
#endif
