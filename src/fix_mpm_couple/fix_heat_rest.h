/* SPDX-License-Identifier: GPL-2.0-or-later */
/* clang-format off: the style's name is made a string as it stands */
#ifdef FIX_CLASS

FixStyle(heat/rest,FixHeatRest)

/* clang-format on */
#else

#ifndef LMP_FIX_HEAT_REST_H
#define LMP_FIX_HEAT_REST_H

#include <vector>

#include "../grain_heat/grain_network.h"
#include "fix.h"
#include "heat_walls.h"

namespace LAMMPS_NS {

class FixHeatGranGrain;
class Integrate;

/* Thermal-only analysis: while the fix is there, runs step the temperatures of fix heat/gran/grain and nothing else.
 *
 *   fix ID all heat/rest [solver explicit|implicit|steady] [tolerance T]
 *
 * The vector f_ID: 1 limit of the explicit time step, s; 2 conducting pairs; 3 contacts with walls of a temperature; 4
 * iterations and 5 residual of the last step; 6 its linearisations. */
class FixHeatRest : public Fix {
 public:
  FixHeatRest(class LAMMPS *, int, char **);
  ~FixHeatRest();
  int setmask() { return 0; }
  void init();
  double compute_vector(int);
  void pre_delete(bool);
  int pack_comm(int, int *, double *, int, int *);
  void unpack_comm(int, int, double *);

  /* For the integrator of this fix: after setup, before the steps of a run, a step; each on all ranks. */
  void freeze();
  void begin();
  void advance(bool is_shown);

 private:
  enum Solver { EXPLICIT, IMPLICIT, STEADY };
  Solver solver_;
  double tolerance_;
  FixHeatGranGrain *heat_;
  Integrate *mine_, *theirs_; /* this fix's integrator, and the one whose place it takes (owned while it does) */
  GrainNetwork *network_;
  std::vector<WallContact> contacts_; /* behind the network's baths GRAIN_BATH_WALL, the last ones */
  GrainSolution solution_;
  double limit_;         /* s */
  double pairs_, walls_; /* on all ranks */
  double *spread_;       /* what pack_comm() sends */

  bool has_tables() const;
  void find_heat();
  void check_integration();
  void collect_links(std::vector<GrainLink> &links);
  void collect_baths(std::vector<GrainBath> &baths);
  void set_properties();
  void renew();
  double warm(int grain, double temperature, double heat) const;
  void find_limit(bool check);
  void solve();
  void keep_flows(const GrainSum *flows);
  void direct_flux();
  void spread(double *values);
  GrainRanks ranks();
};

}  // namespace LAMMPS_NS

#endif
#endif
