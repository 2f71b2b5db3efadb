/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "fix_mpm_traction.h"

#include "domain.h"
#include "fix_mpm_couple.h"
#include "keyword_parser.h"
#include "rank_error.h"

using namespace LAMMPS_NS;

FixMPMTraction::FixMPMTraction(LAMMPS *lammps, int narg, char **arg) : Fix(lammps, narg, arg), traction_{} {
  if (narg < 4) fix_failed(lmp, this, "the id of a fix mpm/couple is missing");
  mpm_id_ = arg[3];
  double pressure = 0.0;
  KeywordParser parser(lmp, this, narg, arg, 4, {"axis", "side", "surface", "pressure", "traction"});
  while (parser.next()) {
    if (parser.is("axis")) {
      traction_.axis = parser.choice({"x", "y", "z"});
      if (traction_.axis >= domain->dimension) parser.refuse("z", "x or y in 2D");
    } else if (parser.is("side")) traction_.side = parser.choice({"-", "+"}) == 1 ? 1 : -1;
    else if (parser.is("surface")) traction_.surface = 1;
    else if (parser.is("pressure")) pressure = parser.number(NumberRange::any());
    else if (parser.is("traction"))
      for (double &t : traction_.traction) t = parser.number(NumberRange::any());
  }
  if (traction_.surface) {
    for (const char *other : {"axis", "side", "traction"}) parser.exclude("surface", other);
    parser.require("pressure", "pressure P");
    traction_.pressure = pressure;
    return;
  }
  parser.require("axis", "axis x|y|z, or surface");
  parser.require("side", "side +|-");
  parser.exclude("pressure", "traction");
  if (!parser.given("traction")) parser.require("pressure", "pressure P, or traction tx ty tz");
  if (parser.given("pressure")) traction_.traction[traction_.axis] = -pressure * traction_.side;
  if (domain->dimension == 2 && traction_.traction[2] != 0.0) parser.fail("keyword 'traction': tz must be 0 in 2D");
}

void FixMPMTraction::init() { FixMPMCouple::find(lmp, this, mpm_id_); }
