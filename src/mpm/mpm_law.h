/* SPDX-License-Identifier: GPL-2.0-or-later */
/* A constitutive law, seen by the MPM core: a batch of points in, stresses out. The core knows nothing of grains. */
#ifndef DEMPM_MPM_LAW_H
#define DEMPM_MPM_LAW_H

#include "../base/base.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Extra values per point that a law reports for output. */
enum {
  MPM_LAW_SOLID_FRACTION = 0,
  MPM_LAW_COORDINATION,
  MPM_LAW_BOND_FRACTION,
  MPM_LAW_UNBALANCED,
  MPM_LAW_ENERGY_DENSITY, /* stored elastic + fluctuation energy, J/m3 */
  MPM_LAW_DISSIPATION,    /* W/m3, all kinds */
  MPM_LAW_SCALARS
};

/* Arrays of n points, point-major ([n][k]); the law reads the first block and writes the second. */
typedef struct MpmLawBatch {
  int n;
  double dt;                          /* s, of this MPM step; 0 = answer for the present state */
  const int64_t *tag;                 /* [n] the points' global identities */
  const double *velocity_gradient;    /* [n][9] 1/s, row-major */
  const double *deformation_gradient; /* [n][9] F before this step's increment */
  const double *temperature;          /* [n] remapped (TM-DEMPM eq. 29), at the end of the law's interval, which is the
                                       * step with USL and MUSL and, as the stress of USF belongs to the positions it
                                       * starts from, the step before with USF; NULL without heat, as are the next and
                                       * heat and conductivity */
  const double *temperature_rate;     /* [n] 1/s */
  double *stress;                     /* [n][6] Cauchy, Pa, tension positive; in: before, out: after the step */
  double *heat;                       /* [n] W/m3 of current volume */
  double *conductivity;               /* [n][6] W/(m K) */
  double *modulus;                    /* [n] P-wave modulus bound, Pa */
  double *scalars;                    /* [n][MPM_LAW_SCALARS] */
} MpmLawBatch;

/* Points for `advance`: arrays of one component each. Two dimensions: only xx, xy, yx, yy (0, 1, 3, 4) of the velocity
 * gradient and xx, yy, zz, xy (0 to 3) of the stress are there, the others are NULL. */
typedef struct MpmLawRows {
  int n, dimension;
  double dt;                          /* s, > 0 */
  const double *velocity_gradient[9]; /* [n] each, 1/s */
  double *stress[6];                  /* [n] each, Pa; in and out */
} MpmLawRows;

/* A law = content + operations. All functions are collective over the ranks that share the scene. */
typedef struct MpmLaw {
  const char *name;
  void *content;
  int thermal;               /* 1 if heat and conductivity are written */
  BaseStatus (*update)(void *content, MpmLawBatch *batch);
  void (*destroy)(void *content);
  /* Both or none (NULL): for laws whose answer to a point depends on that point alone and, without heat, is its new
   * stress; everything else follows from the stress. Not collective, called by many threads at once. */
  void (*advance)(const void *content, const MpmLawRows *rows);
  void (*describe)(const void *content, const double stress[6], double *modulus, double scalars[MPM_LAW_SCALARS]);
} MpmLaw;

typedef enum MpmElasticMode {
  MPM_ELASTIC_3D,
  MPM_ELASTIC_PLANE_STRAIN,
  MPM_ELASTIC_PLANE_STRESS,
  MPM_ELASTIC_BAR
} MpmElasticMode;

typedef struct MpmElastic {
  MpmElasticMode mode;    /* BAR: uniaxial stress along x: sigma_xx = E (eps_xx - beta dT), the rest 0 */
  double young;           /* Pa, > 0 */
  double poisson;         /* -1 < nu < 0.5; 0 in BAR */
  double expansion;       /* 1/K, >= 0 */
  double conductivity[6]; /* W/(m K), constant tensor */
  int thermal;
} MpmElastic;
/* Hypoelastic with the Jaumann rate (TM-DEMPM eq. 50-51): sigma += dt (C : (D - beta T' I) + W s - s W).
 * Allocates law->content; free by law->destroy. BASE_ERROR_ARGUMENT. */
BaseStatus mpm_elastic_create(const MpmElastic *elastic, MpmLaw *law);

#ifdef __cplusplus
}
#endif
#endif
