/* SPDX-License-Identifier: GPL-2.0-or-later */
/* clang-format off: the style's name is made a string as it stands */
#ifdef FIX_CLASS

FixStyle(expansion/gran,FixExpansionGran)

/* clang-format on */
#else

#ifndef LMP_FIX_EXPANSION_GRAN_H
#define LMP_FIX_EXPANSION_GRAN_H

#include <string>
#include <vector>

#include "fix.h"

namespace LAMMPS_NS {

/* Grains expand with temperature: radius = R0 (1 + beta (T - T0)), mass unchanged (TM-DEMPM eq. 37).
 *
 *   fix ID group expansion/gran reference T0 [growth F]
 *
 * R0 and the temperature at the end of the last step are kept per grain in fix property/atom expansion_ID. The scalar
 * f_ID: largest radius over R0, less 1. */
class FixExpansionGran : public Fix {
 public:
  FixExpansionGran(class LAMMPS *, int, char **);
  int setmask();
  void post_create();
  void pre_delete(bool);
  void init();
  void setup_pre_exchange();
  void post_integrate();
  void end_of_step();
  double compute_scalar();
  double max_rad(int);

 private:
  enum Kept { REFERENCE_RADIUS, LAST_TEMPERATURE, KEPT };

  double reference_, growth_;
  std::string property_;             /* id and name of the fix that keeps R0 */
  class FixPropertyAtom *kept_, *temperature_;
  std::vector<double> expansion_;    /* 1/K, by atom type; [0] is unused */
  std::vector<double> limit_;        /* m, by atom type: what neighbour lists and ghosts allow for in this run */

  void expand(bool start);
  double radius_of(int i) const;
};

}  // namespace LAMMPS_NS

#endif
#endif
