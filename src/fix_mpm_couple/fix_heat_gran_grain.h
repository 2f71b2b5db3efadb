/* SPDX-License-Identifier: GPL-2.0-or-later */
/* clang-format off: the style's name is made a string as it stands */
#ifdef FIX_CLASS

FixStyle(heat/gran/grain,FixHeatGranGrain)

/* clang-format on */
#else

#ifndef LMP_FIX_HEAT_GRAN_GRAIN_H
#define LMP_FIX_HEAT_GRAN_GRAIN_H

#include <vector>

#include "../grain_bond/grain_bond.h"
#include "../grain_heat/grain_heat.h"
#include "../grain_heat/grain_table.h"
#include "double_sum.h"
#include "fix_heat_gran.h"
#include "heat_walls.h"

namespace LAMMPS_NS {

/* Heat conduction between the particles of a group (pair_style gran), in place of LIGGGHTS' fix heat/gran/conduction.
 *
 *   fix ID group heat/gran/grain initial_temperature T direct none|batchelor|liggghts|pipe|collisional
 *       [area geometric|hertz] [area_correction yes|no]
 *       [indirect none|voronoi_a|voronoi_b|layer] [fluid K] [porosity E] [core C] [reach F] [layer F] [minimum_gap S]
 *       [convection H T] [radiation EMISSIVITY T|none [neighbours]] [absolute_zero Z]
 *       [conductivity constant|table] [capacity constant|table]
 *       [friction yes|no] [damping yes|normal|no]
 *
 * LIGGGHTS' base class brings the properties Temp, heatFlux, heatSource and directionalHeatFlux, the fix that
 * integrates Temp, and the scalar f_ID: sum of m c T, J. The vector f_ID: heat flows into the group in the last step,
 * W: convection, radiation, walls, friction, damping. */
class FixHeatGranGrain : public FixHeatGran {
 public:
  FixHeatGranGrain(class LAMMPS *, int, char **);
  int setmask();
  void init();
  void setup_pre_force(int);
  void initial_integrate(int);
  void post_integrate();
  void pre_force(int);
  void post_force(int);
  void pre_final_integrate();
  void final_integrate();
  double compute_scalar();
  double compute_vector(int);
  void pre_delete(bool);
  int n_history_extra();
  bool history_args(char **);
  /* With `friction`: the tangential spring at the head of a contact's history was set, not grown by slip. */
  void start_slip(double *history) const;
  /* With `damping`, for bonds, before post_force(): the dashpots of the pair style between i and j; half of the work of a
   * bond's dashpots in the step, J, for grain i. */
  bool counts_damping() const { return damping_ != NO_DAMPING; }
  void find_dashpots(int i, int j, double overlap, GrainBondSprings *springs) const;
  void keep_damping(int i, int j, double work);

 private:
  friend class FixHeatRest; /* steps the same temperatures by the same conductances, while the grains are at rest */
  enum Flow { CONVECTION, RADIATION, WALLS, FRICTION, DAMPING, FLOWS };
  enum Damping { NO_DAMPING, ALL_DAMPING, NORMAL_DAMPING }; /* of which dashpots */
  enum Law { HOOKE_STIFFNESS, HERTZ, HERTZ_STIFFNESS }; /* normal models of the pair style */
  static const char *const LAW_NAMES[3];

  GrainHeat model_;
  GrainSurface surface_;
  bool convection_, radiation_;      /* to the surroundings */
  bool neighbours_;                  /* radiation between grains, and to walls of given temperature */
  bool friction_, correction_;
  Damping damping_;
  bool conductivity_table_, capacity_table_;
  DoubleSum flow_[FLOWS];            /* W, this rank's part */
  HeatWalls walls_;
  bool walls_found_;                 /* in this run */
  std::vector<double> conductivity_; /* by atom type; [0] is unused */
  Law law_;                          /* with friction */
  std::vector<GrainContact> laws_;   /* by pair of types, with friction: factors of find_contact(); mass is unused */
  std::vector<double> coulomb_;      /* coefficients of friction by pair of types; with friction */
  std::vector<double> capacity_;     /* J/(kg K), by atom type; with collisions */
  std::vector<double> compliance_;   /* (1 - nu^2) / E, 1/Pa, by atom type; with collisions */
  std::vector<double> overlap_ratio_; /* real by simulated overlap, by pair of types; with area_correction */
  std::vector<double> conductivity_rows_, capacity_rows_; /* of tables: temperature, then a value per atom type */
  class FixBondGranThermal *bonds_;  /* NULL if there are none; with friction */
  std::vector<double> damped_;       /* J by grain, in bonds; from a step's pre_force() to its post_force() */
  double reach_;                     /* m, between surfaces: grains may be that far apart and conduct */
  std::vector<double> hidden_;       /* share of a grain's surface that neighbours take; with `neighbours` */
  std::vector<double> built_;        /* positions and radii when the neighbour list was built */

  void read_model(class KeywordParser &);
  void check_keywords(const class KeywordParser &) const;
  double find_largest_radius() const;
  void check_skin();
  void init_area_correction();
  void init_conductivity();
  void init_capacity();
  GrainTable make_table(const std::vector<double> &rows) const;
  double find_conductivity(int type, double temperature) const;
  double find_capacity(int type, double temperature) const; /* J/(kg K) */
  double add_up(const DoubleSum &part) const;
  double find_real_distance(double distance, double sum, int type, int other) const;
  bool reaches() const { return model_.indirect != GRAIN_INDIRECT_NONE || neighbours_; } /* over gaps */
  double find_wall_reach() const;
  bool collides() const { return model_.direct == GRAIN_DIRECT_COLLISIONAL; }
  void init_history();
  void init_friction();
  GrainContact read_law(int type, int other) const;
  GrainContact find_contact(int type, int other, double mass, double radius, double overlap) const;
  double find_coulomb_limit(int type, int other, const GrainContact &contact, double overlap, double parting) const;
  void rub_walls();
  void init_collisions();
  double collide(int i, int j, const GrainPair &pair, double *record) const;
  void heat_by_friction();
  void slip(int i, int j, double *history);
  GrainContact find_contact_of(int i, int j, double overlap) const;
  void find_walls();
  double find_wall_conductance(const WallContact &contact) const;
  GrainView view_of(const GrainPair &pair) const;
  GrainView view_of_wall(const WallContact &contact) const;
  double radiate(int i, int j, const GrainPair &pair);
  double radiate_to_wall(const WallContact &contact);
  void keep_positions();
  void check_radiation(const class KeywordParser &) const;
  GrainPair pair_of(int i, int j) const;
  void exchange(int i, int j, double *record);
  void exchange_with_surroundings();
};

}  // namespace LAMMPS_NS

#endif
#endif
