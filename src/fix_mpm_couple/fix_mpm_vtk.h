/* SPDX-License-Identifier: GPL-2.0-or-later */
/* clang-format off: the style's name is made a string as it stands */
#ifdef FIX_CLASS

FixStyle(mpm/vtk,FixMPMVtk)

/* clang-format on */
#else

#ifndef LMP_FIX_MPM_VTK_H
#define LMP_FIX_MPM_VTK_H

#include <string>
#include <vector>

#include "fix.h"

namespace LAMMPS_NS {

class FixMPMCouple;

/* Writes RVEs and the background grid of a fix mpm/couple for ParaView. The group is not used.
 *
 *   fix ID group mpm/vtk MPMFIXID every N prefix PATH [rves TAG ...] [grid yes|no]
 *
 * Files PATH_<tag>_<step>.vtm and PATH_grid_<step>.vtu with a .pvd time series each (vtk_writer.h), every N steps and
 * at the start of a run (RVEs only: there is no grid before a step). */
class FixMPMVtk : public Fix {
 public:
  FixMPMVtk(class LAMMPS *, int, char **);
  int setmask();
  void init();
  void setup(int);
  void end_of_step();

 private:
  std::string mpm_id_, prefix_;
  std::vector<int64_t> tags_;
  bool grid_;
  FixMPMCouple *mpm_;

  void write_rves();
  void write_grid();
};

}  // namespace LAMMPS_NS

#endif
#endif
