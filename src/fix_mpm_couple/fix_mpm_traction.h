/* SPDX-License-Identifier: GPL-2.0-or-later */
/* clang-format off: the style's name is made a string as it stands */
#ifdef FIX_CLASS

FixStyle(mpm/traction,FixMPMTraction)

/* clang-format on */
#else

#ifndef LMP_FIX_MPM_TRACTION_H
#define LMP_FIX_MPM_TRACTION_H

#include <string>

#include "../mpm/mpm.h"
#include "fix.h"

namespace LAMMPS_NS {

/* Traction on the outermost layer of material points of a fix mpm/couple. The group is not used.
 *
 *   fix ID group mpm/traction MPMFIXID axis x|y|z side +|- pressure P | traction tx ty tz
 *
 * `side +`: the layer with the largest coordinate. Pressure: Pa, pushes into the body; traction: Pa, in global axes. */
class FixMPMTraction : public Fix {
 public:
  FixMPMTraction(class LAMMPS *, int, char **);
  int setmask() { return 0; }
  void init();
  const std::string &mpm_id() const { return mpm_id_; }
  const MpmTraction &traction() const { return traction_; }

 private:
  std::string mpm_id_;
  MpmTraction traction_;
};

}  // namespace LAMMPS_NS

#endif
#endif
