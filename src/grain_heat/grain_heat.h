/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Heat conduction between two spherical grains: conductances h of a pair in W/K, heat into grain 0 = h (T1 - T0) in W.
 *
 * Sources: tables 1 (direct: through the contact) and 2 (indirect: through the fluid around it) of R. Rangel, A.
 * Franci, A. Cornejo, E. Onate, F. Zarate, "Thermo-mechanical analysis of continuous and discrete media with PFEM and
 * DEM". "Corrected" marks formulas that are wrong as printed there; doc/fix_heat_gran_grain.md says how. SI units.
 *
 * All functions give the same bits when the two grains change places: heat is then neither made nor lost, although two
 * ranks may each work out one side of a pair. */
#ifndef DEMPM_GRAIN_HEAT_H
#define DEMPM_GRAIN_HEAT_H

#include "../base/base.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Two grains. Radii and distance of the centres (> 0) in m, conductivities (>= 0) in W/(m K). A conductivity of 0 lets
 * no heat through: h = 0 but for the surrounding layer, which the grains' conductivities do not enter. */
typedef struct GrainPair {
  double radius[2], conductivity[2];
  double distance;
} GrainPair;

/* ------------------------------------------------------------------------------------------ contact radius */
/* Radius of the circle in which the spheres meet, m; 0 if they do not overlap. A sphere whose centre lies deeper in the
 * other than that circle (distance below the larger radius) counts with its own radius, as in LIGGGHTS. */
double grain_radius_geometric(const GrainPair *pair);
/* Hertz: sqrt(R* overlap), 1/R* = 1/R0 + 1/R1, m. About 1/sqrt(2) of the geometric one for a small overlap. */
double grain_radius_hertz(const GrainPair *pair);

/* -------------------------------------------------------------------------------------------------- direct */
/* Batchelor and O'Brien (table 1): 4 k Rc, k = k0 k1 / (k0 + k1). */
double grain_direct_batchelor(const GrainPair *pair, double contact_radius);
/* What LIGGGHTS' fix heat/gran/conduction has: 4 k sqrt(A), A = pi Rc^2; sqrt(pi) times the above. */
double grain_direct_liggghts(const GrainPair *pair, double contact_radius);
/* Thermal pipe (table 1): pi Rc^2 k / d, k = (R0 + R1) / (R0/k0 + R1/k1). */
double grain_direct_pipe(const GrainPair *pair, double contact_radius);

/* An impact: largest contact radius, m, and duration, s. */
typedef struct GrainImpact {
  double radius_max, duration;
  double heat_capacity[2]; /* density times specific heat, J/(m3 K) */
} GrainImpact;
/* Elastic Hertz impact (not printed; corrected against public codes): masses kg, stiffness
 * 1/E* = (1 - nu0^2)/E0 + (1 - nu1^2)/E1 in Pa, speed of approach m/s, all > 0. */
void grain_impact_hertz(const GrainPair *pair, const double mass[2], double stiffness, double speed, double *radius_max,
                        double *duration);
/* Fourier number of the impact, of the grain that the collisional model takes it of. */
double grain_impact_fourier(const GrainPair *pair, const GrainImpact *impact);
/* Collisional (table 1, corrected: C2 = ... + 24.885, the ratio of heat capacities not squared and at most 1): mean
 * over the impact. The published fit; accurate to some per cent for Fourier numbers below 0.1 only, not-a-number
 * above some 16 for unequal capacities. */
double grain_direct_collisional(const GrainPair *pair, const GrainImpact *impact);

/* ------------------------------------------------------------------------------------------------ indirect */
/* Radius of the Voronoi face between two grains in a packing of the given porosity: 0.56 Rmean (1 - porosity)^(-1/3), m
 * (Yang et al. 2002). */
double grain_face_radius(const GrainPair *pair, double porosity);
/* Voronoi A (table 2, corrected: r_sf with a plus sign), paths parallel to the line of centres within the cone over a
 * face of radius `face`; for unequal radii each grain has its own height and cone (Gan, Zhou, Yu 2016). 0 if the
 * contact is larger than the face. `fluid`: conductivity, W/(m K). Quadrature with a relative error below 1e-10. */
double grain_indirect_voronoi_a(const GrainPair *pair, double face, double fluid);
/* Voronoi B (table 2, corrected: the listed angles are cosines), radial paths from isothermal cores of radius core * R,
 * 0 < core < 1, to the surface that is equally far from both grains. Closed form, also for unequal radii. */
double grain_indirect_voronoi_b(const GrainPair *pair, double face, double fluid, double core);
/* Surrounding layer (table 2, corrected: factor k_f; R_e at most the smaller radius): the larger grain carries a layer
 * of fluid of thickness layer * R; minimum_gap > 0, m, bounds the length of a path from below. Closed form. */
double grain_indirect_layer(const GrainPair *pair, double fluid, double layer, double minimum_gap);
/* The same between a grain, which carries the layer, and a plane at `distance` (> 0) from its centre, m. */
double grain_indirect_layer_wall(double radius, double distance, double fluid, double layer, double minimum_gap);

/* --------------------------------------------------------------------------------------------------- model */
typedef enum GrainArea { GRAIN_AREA_GEOMETRIC, GRAIN_AREA_HERTZ } GrainArea;
typedef enum GrainDirect {
  GRAIN_DIRECT_NONE,
  GRAIN_DIRECT_BATCHELOR,
  GRAIN_DIRECT_LIGGGHTS,
  GRAIN_DIRECT_PIPE,
  GRAIN_DIRECT_COLLISIONAL /* after the impact: Batchelor and O'Brien, as at walls */
} GrainDirect;
typedef enum GrainIndirect {
  GRAIN_INDIRECT_NONE,
  GRAIN_INDIRECT_VORONOI_A,
  GRAIN_INDIRECT_VORONOI_B,
  GRAIN_INDIRECT_LAYER
} GrainIndirect;

/* One direct and one indirect model; their conductances add. */
typedef struct GrainHeat {
  GrainArea area; /* of the direct model; indirect paths begin at the geometric contact radius, where the fluid does */
  GrainDirect direct;
  GrainIndirect indirect;
  double fluid;       /* conductivity, W/(m K) */
  double porosity;    /* Voronoi */
  double core;        /* Voronoi B */
  double layer;       /* in radii of the larger grain */
  double minimum_gap; /* layer, m */
  double reach;       /* Voronoi: largest gap between surfaces, in mean radii of the pair */
} GrainHeat;

/* Nothing conducts; porosity 0.4, core 0.5, layer 0.4, minimum_gap 2.75e-8 m, reach 0.5; no fluid. */
GrainHeat grain_heat_default(void);
BaseStatus grain_heat_check(const GrainHeat *model);
/* h of a pair, W/K; of the collisional model the value after the impact. */
double grain_heat_conductance(const GrainHeat *model, const GrainPair *pair);
/* h of a pair in contact for a step that begins at `age` (s) of the impact, W/K: for the part of the step before
 * impact->duration has passed the collisional mean takes the place of the direct model; not at Fourier numbers above
 * 5, where the published fit ends and conduction is nearly steady. */
double grain_heat_impact_conductance(const GrainHeat *model, const GrainPair *pair, const GrainImpact *impact,
                                     double age, double step);
/* Of the direct model between a grain and a wall at `distance` (> 0) from its centre, m. The wall is the limit of a
 * grain of infinite radius; in a thermal pipe, which it enters as R1 = 0, the path ends at its surface. */
double grain_heat_wall_conductance(const GrainHeat *model, double radius, const double conductivity[2],
                                   double distance);
/* Of the indirect model between a grain of the given conductivity and the surface of a wall, which is isothermal, W/K.
 * The Voronoi models: half of the way to the mirror image of the grain, hence twice the h of that pair. */
double grain_heat_wall_indirect(const GrainHeat *model, double radius, double conductivity, double distance);
/* Gap between a grain and a wall, in radii of the grain, from which on grain_heat_wall_indirect is 0. */
double grain_heat_wall_reach(const GrainHeat *model);
/* Smallest gap between surfaces, m, from which on h = 0 for every pair of grains no larger than `radius`; 0 without an
 * indirect model. */
double grain_heat_reach(const GrainHeat *model, double radius);

/* ---------------------------------------------------------------------------------------------------- slip */
/* Two grains in contact as `pair_style gran ... tangential history` sees them in a step: radii in m, branch = x0 - x1
 * in m, velocities in m/s, spins in 1/s. */
typedef struct GrainMotion {
  double radius[2], branch[3], velocity[2][3], spin[2][3];
} GrainMotion;
/* Unit normal from grain 1 to grain 0, and the tangential velocity of the surface of grain 0 relative to that of grain 1
 * at the point of contact, m/s. distance: |branch|, > 0. Returns the speed at which the centres move apart, m/s. */
double grain_tangential_velocity(const GrainMotion *motion, double distance, double normal[3], double velocity[3]);
/* Springs (N/m) and dashpots (N s/m) of the contact at its overlap, normal and tangential, and the effective mass,
 * kg. */
typedef struct GrainContact {
  double stiffness[2], damping[2], mass;
} GrainContact;
/* Work of friction in a step of duration `step`, J. The tangential spring goes from `before` by the grains' motion to a
 * trial state, which the Coulomb limit shortens to `after`, m: mean force times slip, nothing where the limit is not
 * reached. Its stiffness goes from stiffness[0] to stiffness[1], N/m: what the spring loses by that counts, too (< 0
 * where it gains). That is what velocity Verlet takes from the grains' motion and does not keep in the spring. (Slip
 * work is negative only in a step in which the slip turns back by more than the spring is long.) With `before` and
 * `after` negated the same for the grains in the other order. */
double grain_slip_work(const GrainMotion *motion, const double stiffness[2], double step, const double before[3],
                       const double after[3]);
/* Work of the dashpots in the step, J, with the velocities half-way between those of the motion and the next ones; the
 * tangential dashpot rests while the contact slips. */
double grain_damping_work(const GrainMotion *motion, const GrainContact *contact, double step, const double before[3],
                          const double after[3]);
/* What `before` was, m, where it is not kept (at walls): from the state `after` of the step, the Coulomb limits and
 * tangential stiffnesses ([0] before, [1] after; N, N/m). Exact but for the turn of the plane of contact while the
 * contact sticks or slips; in the step in which it begins to slip the limit takes the place of the spring's force. */
void grain_spring_before(const GrainMotion *motion, const double stiffness[2], const double limit[2], double step,
                         const double after[3], double before[3]);

/* ------------------------------------------------------------------------------------------------- surface */
/* What a grain exchanges with its surroundings over its whole surface, 4 pi R^2. Temperatures on the scale of the
 * grains, whose absolute zero is at `absolute_zero` (0 for kelvin, -273.15 for degrees Celsius). */
typedef struct GrainSurface {
  double coefficient, fluid_temperature; /* of convection, W/(m2 K), >= 0 */
  double emissivity, surroundings;       /* 0 to 1; >= absolute_zero */
  double absolute_zero;
} GrainSurface;
/* Heat into a grain of the given radius, m, and temperature, W: Newton's law of cooling. */
double grain_convection(const GrainSurface *exchange, double radius, double temperature);
/* Stefan-Boltzmann: sigma emissivity 4 pi R^2 (T_s^4 - T^4), absolute temperatures, W. Surroundings are black or
 * large. */
double grain_radiation(const GrainSurface *exchange, double radius, double temperature);
/* sigma (T1^4 - T0^4) / (T1 - T0), absolute temperatures, W/(m2 K): of a black surface, a conductance by area; of equal
 * temperatures the derivative 4 sigma T^3. The same bits if both change places. Below the absolute zero, where iterates of
 * a solver may come, as at it. */
double grain_emission(const double temperature[2], double absolute_zero);

/* Two grains that see each other through the Voronoi face between them, a circle of radius `face`; or a grain (0) and a
 * plane. Seen from either centre the face bounds a cap of the surface, without the contact. The smaller cap sees the
 * other one alone: the enclosure of two grey surfaces of heat transfer textbooks, 1/G = 1/A_min + (1 - e)/e (1/A0 +
 * 1/A1). Radiation beyond the nearest neighbours is left out. */
typedef struct GrainView {
  double area;     /* G, m2 */
  double share[2]; /* of the surface of each grain that the face takes, 0 to 1, with the contact; [1] of a plane: 0 */
} GrainView;
GrainView grain_view(const GrainPair *pair, double face, double emissivity);
GrainView grain_view_wall(double radius, double distance, double face, double emissivity);
/* Into grain 0: sigma G (T1^4 - T0^4), absolute temperatures, W; the opposite to the last bit if both change places. */
double grain_radiation_between(double area, const double temperature[2], double absolute_zero);

#ifdef __cplusplus
}
#endif
#endif
