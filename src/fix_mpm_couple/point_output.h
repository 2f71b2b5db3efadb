/* SPDX-License-Identifier: GPL-2.0-or-later */
/* What a dump can show of one material point: the columns of f_ID[i] of fix mpm/couple. */
#ifndef LMP_POINT_OUTPUT_H
#define LMP_POINT_OUTPUT_H

#include "../mpm/mpm.h"

namespace LAMMPS_NS {

/* Column i of this list is f_ID[i+1]. */
enum PointOutput {
  OUTPUT_STRESS = 0,            /* 1-6: Cauchy xx yy zz xy xz yz, Pa, tension positive */
  OUTPUT_PRESSURE = 6,          /* 7: minus the mean normal stress, Pa; 2D: of xx and yy */
  OUTPUT_DEVIATORIC_STRESS,     /* 8: 3D sqrt(3/2 s:s), 2D |sigma_1 - sigma_2|, Pa */
  OUTPUT_DEVIATORIC_STRAIN,     /* 9: TM-DEMPM eq. 47-48, of (F + F^T)/2 - I: not rotation invariant */
  OUTPUT_DEVIATORIC_LOG_STRAIN, /* 10: the same measure of ln(F F^T)/2 */
  OUTPUT_VOLUME_RATIO,          /* 11: det F */
  OUTPUT_VOLUME,                /* 12: m3 (2D: m2 times unit depth) */
  OUTPUT_TEMPERATURE,           /* 13: remapped from the grid (eq. 29) */
  OUTPUT_HEAT,                  /* 14: frictional heat of the grains, W/m3 */
  OUTPUT_SOLID_FRACTION,        /* 15 */
  OUTPUT_COORDINATION,          /* 16 */
  OUTPUT_BOND_FRACTION,         /* 17: intact / installed */
  OUTPUT_UNBALANCED,            /* 18: mean resultant / mean contact force of the RVE */
  OUTPUT_ENERGY_DENSITY,        /* 19: stored by the law, J/m3 */
  OUTPUT_DISSIPATION,           /* 20: of the law, all kinds, W/m3 */
  OUTPUT_DEFORMATION_GRADIENT,  /* 21-29: F row-major */
  OUTPUT_NUMBER = OUTPUT_DEFORMATION_GRADIENT + 9, /* 30: of the point, see fix_mpm_couple.h */
  OUTPUT_COLUMNS
};

void point_output(const MpmPoint &point, int dimension, double column[OUTPUT_COLUMNS]);

/* Deviatoric measures of eq. 48: |e_1 - e_2| in the plane (2D), sqrt(2/3 e:e) of the deviator e (3D). */
double deviatoric_strain(const double strain[9], int dimension);
/* ln(F F^T)/2, the spatial logarithmic strain, row-major. */
void logarithmic_strain(const double deformation_gradient[9], double strain[9]);

}  // namespace LAMMPS_NS

#endif
