/* SPDX-License-Identifier: GPL-2.0-or-later */
/* clang-format off: the style's name is made a string as it stands */
#ifdef FIX_CLASS

FixStyle(heat/gran/grain,FixHeatGranGrain)

/* clang-format on */
#else

#ifndef LMP_FIX_HEAT_GRAN_GRAIN_H
#define LMP_FIX_HEAT_GRAN_GRAIN_H

#include <vector>

#include "../grain_heat/grain_heat.h"
#include "double_sum.h"
#include "fix_heat_gran.h"
#include "heat_walls.h"

namespace LAMMPS_NS {

/* Heat conduction between the particles of a group (pair_style gran), in place of LIGGGHTS' fix heat/gran/conduction.
 *
 *   fix ID group heat/gran/grain initial_temperature T direct none|batchelor|liggghts|pipe|collisional
 *       [area geometric|hertz] [indirect none|voronoi_a|voronoi_b|layer] [fluid K] [porosity E] [core C] [reach F]
 *       [layer F] [minimum_gap S]
 *       [convection H T] [radiation EMISSIVITY T] [absolute_zero Z]
 *       [friction yes|no]
 *
 * LIGGGHTS' base class brings the properties Temp, heatFlux, heatSource and directionalHeatFlux, the fix that
 * integrates Temp, and the scalar f_ID: sum of m c T, J. The vector f_ID: heat flows into the group in the last step,
 * W: convection, radiation, walls, friction. */
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
  double compute_vector(int);
  void pre_delete(bool);
  int n_history_extra();
  bool history_args(char **);
  /* With `friction`: the tangential spring at the head of a contact's history was set, not grown by slip. */
  void start_slip(double *history) const;

 private:
  enum Flow { CONVECTION, RADIATION, WALLS, FRICTION, FLOWS };

  GrainHeat model_;
  GrainSurface surface_;
  bool convection_, radiation_, friction_;
  DoubleSum flow_[FLOWS];            /* W, this rank's part */
  HeatWalls walls_;
  bool walls_found_;                 /* in this run */
  std::vector<double> conductivity_; /* by atom type; [0] is unused */
  std::vector<double> stiffness_;    /* of the tangential springs by pair of types, N/m; with friction */
  std::vector<double> capacity_;     /* J/(kg K), by atom type; with collisions */
  std::vector<double> compliance_;   /* (1 - nu^2) / E, 1/Pa, by atom type; with collisions */
  double reach_;                     /* m, between surfaces: grains may be that far apart and conduct */
  std::vector<double> built_;        /* positions when the neighbour list was built */

  void read_model(class KeywordParser &);
  double find_largest_radius() const;
  void check_skin();
  bool collides() const { return model_.direct == GRAIN_DIRECT_COLLISIONAL; }
  void init_history();
  void init_friction();
  void init_collisions();
  double collide(int i, int j, const GrainPair &pair, double *record) const;
  void heat_by_friction();
  void slip(int i, int j, double *history);
  void find_walls();
  void keep_positions();
  void check_radiation(const class KeywordParser &) const;
  void exchange(int i, int j, double *record);
  void exchange_with_surroundings();
};

}  // namespace LAMMPS_NS

#endif
#endif
