/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "fix_mpm_vtk.h"

#include <climits>
#include <cstring>

#include "comm.h"
#include "fix_mpm_couple.h"
#include "fix_mpm_rve.h"
#include "keyword_parser.h"
#include "rank_error.h"
#include "update.h"
#include "vtk_writer.h"

using namespace LAMMPS_NS;
using namespace FixConst;

FixMPMVtk::FixMPMVtk(LAMMPS *lammps, int narg, char **arg) : Fix(lammps, narg, arg), grid_(false), mpm_(NULL) {
  if (narg < 4) fix_failed(lmp, this, "the id of a fix mpm/couple is missing");
  mpm_id_ = arg[3];
  KeywordParser parser(lmp, this, narg, arg, 4, {"every", "prefix", "rves", "grid"});
  while (parser.next()) {
    if (parser.is("every")) nevery = parser.integer(1, INT_MAX);
    else if (parser.is("prefix")) prefix_ = parser.word("the path of the files, up to their number");
    else if (parser.is("rves")) {
      do tags_.push_back(parser.long_integer(1, INT_MAX));
      while (parser.has_value());
    } else if (parser.is("grid")) grid_ = parser.yes_no();
  }
  parser.require("every", "every N");
  parser.require("prefix", "prefix PATH");
  if (tags_.empty() && !grid_) parser.fail("nothing to write: give 'rves TAG ...', 'grid yes' or both");
}

int FixMPMVtk::setmask() { return END_OF_STEP; }

void FixMPMVtk::init() { mpm_ = FixMPMCouple::find(lmp, this, mpm_id_); }

void FixMPMVtk::setup(int) {
  if (!tags_.empty() && !mpm_->rve())
    fix_failed(lmp, this, "keyword 'rves': fix " + mpm_id_ + " has no RVEs (material elastic)");
  if (update->ntimestep % nevery == 0) write_rves();
}

void FixMPMVtk::end_of_step() {
  write_rves();
  if (grid_) write_grid();
}

void FixMPMVtk::write_rves() {
  for (const int64_t tag : tags_) {
    RveView view;
    memset(&view, 0, sizeof view);
    fix_check(lmp, this, rve_law_view(mpm_->rve()->law(), tag, &view));
    BaseStatus status = BASE_OK;
    if (comm->me == 0) {
      status = vtk_write_rve(prefix_.c_str(), update->ntimestep, (double)update->ntimestep * update->dt, tag, &view);
      rve_view_destroy(&view);
    }
    fix_check(lmp, this, status);
  }
}

void FixMPMVtk::write_grid() {
  MpmGridView view;
  mpm_grid_view(mpm_->mpm(), &view);
  const MpmScene *scene = mpm_scene(mpm_->mpm());
  fix_check(lmp, this,
            vtk_write_grid(world, prefix_.c_str(), update->ntimestep, (double)update->ntimestep * update->dt, &view,
                           scene->origin));
}
