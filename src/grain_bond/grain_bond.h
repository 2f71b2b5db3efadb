/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Bond between two grains whose strength falls with temperature: the law of the packings (src/cuda_rve, TM-DEMPM eq.
 * 38-40 with the corrected eq. 40), for LIGGGHTS' own particles. SI units. */
#ifndef DEMPM_GRAIN_BOND_H
#define DEMPM_GRAIN_BOND_H

#include "../grain_heat/grain_heat.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct GrainBondLaw {
  double strength;    /* B > 0: tension that breaks, F = B kn (R0 + R1)/2 at `reference` */
  double shear_ratio; /* M > 0: shear that breaks over tension that breaks */
  double melting;     /* temperature from which on the strength is 0, > reference; INFINITY: it never falls */
  double reference;   /* temperature of the full strength; without meaning if `melting` is infinite */
} GrainBondLaw;

/* Springs and dashpots of one bond; all >= 0. */
typedef struct GrainBondSprings {
  double normal, tangential;                 /* N/m */
  double normal_damping, tangential_damping; /* N s/m */
} GrainBondSprings;

/* What a bond remembers. `spring` is seen from grain 0; from grain 1 it is the negative. */
typedef struct GrainBond {
  double gap;       /* of the surfaces when the bond was made, m, >= 0: its natural length */
  double spring[3]; /* tangential spring, m */
} GrainBond;

/* A bond in a step, as grain 0 sees it. */
typedef struct GrainBondState {
  double normal[3];   /* unit vector from grain 1 to grain 0 */
  double overlap;     /* R0 + R1 - distance, m */
  double approach;    /* gap + overlap, m: the shortening of the bond; < 0: it is stretched */
  double separation;  /* speed at which the grains move apart, m/s */
  double velocity[3]; /* tangential velocity of the surface of grain 0 relative to that of grain 1, m/s */
  double spring[3];   /* tangential spring at the end of the step, m */
  double arm;         /* of the tangential force about the centre of grain 0, m */
} GrainBondState;

typedef enum GrainBondEnd {
  GRAIN_BOND_HOLDS,
  GRAIN_BOND_PULLED,  /* tension above F */
  GRAIN_BOND_SHEARED, /* shear above M F */
  GRAIN_BOND_MELTED   /* any tension or shear, at or above the melting temperature */
} GrainBondEnd;

/* B clip((T_s - T) / (T_s - T_ref), 0, 1). */
double grain_bond_strength(const GrainBondLaw *law, double temperature);

/* Moves the spring on by a step of duration `step`, s (0: it stays as it is), and tells whether the bond holds. */
GrainBondEnd grain_bond_advance(const GrainBondLaw *law, const GrainBondSprings *springs, const GrainMotion *motion,
                                const GrainBond *bond, double temperature, double step, GrainBondState *state);

/* Force and torque on grain 0. shared: 1 where a contact law acts between the grains anyhow, along the normal with the
 * overlap and with its dashpots, but with no tangential spring; the bond then adds what is missing. Torque on grain 1:
 * exchange the grains. */
void grain_bond_force(const GrainBondSprings *springs, const GrainBond *bond, const GrainBondState *state, int shared,
                      double force[3], double torque[3]);

/* Work of the dashpots in springs->..._damping in a step of duration `step`, J, whoever exerts them, between grains of the
 * effective mass `mass`, kg: as grain_damping_work(), with the velocities half-way to those of the next step. */
double grain_bond_damping_work(const GrainBondSprings *springs, const GrainBondState *state, double mass, double step);

/* Elastic energy, J, beside that of the contact's normal spring if it is `shared`. */
double grain_bond_energy(const GrainBondSprings *springs, const GrainBond *bond, const GrainBondState *state,
                         int shared);

#ifdef __cplusplus
}
#endif
#endif
