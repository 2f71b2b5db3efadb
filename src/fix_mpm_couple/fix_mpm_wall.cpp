/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "fix_mpm_wall.h"

#include <cmath>
#include <cstring>

#include "comm.h"
#include "domain.h"
#include "fix_mpm_couple.h"
#include "keyword_parser.h"
#include "rank_error.h"

using namespace LAMMPS_NS;

static const char AXES[] = "xyz";
static const std::vector<std::string> CONTACTS = {"noslip", "slip", "friction", "nocontact"};

/* The whole restart record of a wall. */
struct WallRecord {
  char magic[8];
  int64_t side;
  double displacement[3], sums[FixMPMWall::SUMS];
};
static const char RECORD_MAGIC[8] = {'m', 'p', 'm', 'w', 'a', 'l', 'l', '1'};

FixMPMWall::FixMPMWall(LAMMPS *lammps, int narg, char **arg)
    : Fix(lammps, narg, arg), wall_(mpm_wall_default()), axis_(-1), side_(0), displacement_{}, sums_{} {
  if (narg < 4) fix_failed(lmp, this, "the id of a fix mpm/couple is missing");
  mpm_id_ = arg[3];
  vector_flag = 1;
  size_vector = SUMS + 3;
  global_freq = 1;
  extvector = 0;
  restart_global = 1;
  wall_.contact = MPM_WALL_SLIP;

  KeywordParser parser(lmp, this, narg, arg, 4,
                       {"plane", "box", "noslip", "slip", "friction", "nocontact", "glued", "temperature", "flux",
                        "velocity", "side", "within"});
  while (parser.next()) {
    if (parser.is("plane") || parser.is("box")) read_shape(parser);
    else if (parser.is("noslip")) wall_.contact = MPM_WALL_NO_SLIP;
    else if (parser.is("slip")) wall_.contact = MPM_WALL_SLIP;
    else if (parser.is("nocontact")) wall_.contact = MPM_WALL_NO_CONTACT;
    else if (parser.is("friction"))
      wall_.contact = MPM_WALL_FRICTION, wall_.friction = parser.number(NumberRange::at_least(0.0));
    else if (parser.is("glued")) wall_.separable = 0;
    else if (parser.is("temperature"))
      wall_.heat = MPM_WALL_TEMPERATURE, wall_.temperature = parser.number(NumberRange::any());
    else if (parser.is("flux")) wall_.heat = MPM_WALL_FLUX, wall_.flux = parser.number(NumberRange::any());
    else if (parser.is("velocity"))
      for (double &v : wall_.velocity) v = parser.number(NumberRange::any());
    else if (parser.is("side")) side_ = parser.choice({"-", "+"}) == 1 ? 1 : -1;
    else if (parser.is("within")) read_box(parser, true, wall_.range[0], wall_.range[1]);
  }
  parser.exclude("plane", "box");
  if (!parser.given("box")) parser.require("plane", "plane x|y|z POS, or box x0 x1 y0 y1 [z0 z1]");
  for (size_t a = 0; a < CONTACTS.size(); a++)
    for (size_t b = a + 1; b < CONTACTS.size(); b++) parser.exclude(CONTACTS[a].c_str(), CONTACTS[b].c_str());
  parser.exclude("temperature", "flux");
  parser.exclude("glued", "noslip");
  parser.exclude("glued", "nocontact");
  parser.exclude("box", "side");
  if (domain->dimension == 2 && wall_.velocity[2] != 0.0) parser.fail("keyword 'velocity': vz must be 0 in 2D");
  if (parser.given("nocontact") && wall_.heat == MPM_WALL_ADIABATIC)
    parser.fail("keyword 'nocontact' without 'temperature' or 'flux': the wall would do nothing");
}

void FixMPMWall::init() { FixMPMCouple::find(lmp, this, mpm_id_); }

void FixMPMWall::read_shape(KeywordParser &parser) {
  if (parser.is("box")) {
    wall_.kind = MPM_WALL_BOX;
    read_box(parser, false, wall_.low, wall_.high);
    return;
  }
  wall_.kind = MPM_WALL_PLANE;
  axis_ = parser.choice({"x", "y", "z"});
  if (axis_ >= domain->dimension) parser.refuse("z", "x or y in 2D");
  wall_.point[axis_] = parser.number(NumberRange::any());
}

void FixMPMWall::read_box(KeywordParser &parser, bool infinite, double low[3], double high[3]) {
  for (int i = 0; i < domain->dimension; i++) {
    low[i] = infinite ? parser.number_or_infinity(-1) : parser.number(NumberRange::any());
    high[i] = infinite ? parser.number_or_infinity(1) : parser.number(NumberRange::any());
    if (!(low[i] < high[i]))
      parser.refuse(format_text("%c0 %g %c1 %g", AXES[i], low[i], AXES[i], high[i]),
                    format_text("%c0 < %c1", AXES[i], AXES[i]));
  }
  if (domain->dimension == 2) low[2] = -HUGE_VAL, high[2] = HUGE_VAL;
}

void FixMPMWall::find_side(const double low[3], const double high[3]) {
  if (axis_ < 0 || side_ != 0 || low[axis_] > high[axis_]) return;
  const double position = present().point[axis_];
  if (low[axis_] >= position) side_ = 1;
  else if (high[axis_] <= position) side_ = -1;
  else
    fix_failed(lmp, this,
               format_text(
                   "keyword 'side' is missing: plane %c = %g has points on both sides (%g to %g); add side + or side -",
                   AXES[axis_], position, low[axis_], high[axis_]));
}

void FixMPMWall::begin_run(bool thermal, const double low[3], const double high[3]) {
  if (!thermal && wall_.heat != MPM_WALL_ADIABATIC)
    fix_failed(lmp, this,
               format_text("keyword '%s' needs 'thermal yes' in fix %s",
                           wall_.heat == MPM_WALL_FLUX ? "flux" : "temperature", mpm_id_.c_str()));
  find_side(low, high);
  const MpmWall wall = present();
  fix_check(lmp, this, mpm_wall_check(&wall, domain->dimension, thermal));
}

MpmWall FixMPMWall::present() const {
  MpmWall wall = wall_;
  for (int i = 0; i < 3; i++) {
    wall.point[i] += displacement_[i];
    wall.low[i] += displacement_[i];
    wall.high[i] += displacement_[i];
  }
  if (axis_ >= 0) {
    for (double &n : wall.normal) n = 0.0;
    wall.normal[axis_] = side_ < 0 ? -1.0 : 1.0;
  }
  return wall;
}

double FixMPMWall::stretch(const double origin[3], int &axis) const {
  axis = axis_;
  if (wall_.kind != MPM_WALL_PLANE) return 0.0;
  const double first = wall_.point[axis_] - origin[axis_];
  return (first + displacement_[axis_]) / first;
}

void FixMPMWall::end_step(const MpmWall &answered, double dt) {
  double power = 0.0;
  for (int i = 0; i < 3; i++) {
    sums_[REACTION + i] = answered.reaction[i];
    power += answered.reaction[i] * wall_.velocity[i];
    displacement_[i] += dt * wall_.velocity[i];
  }
  sums_[FRICTION_POWER] = answered.power_friction;
  sums_[HEAT_FLOW] = answered.heat_flow;
  sums_[FRICTION_WORK] += dt * answered.power_friction;
  sums_[HEAT] += dt * answered.heat_flow;
  sums_[WORK] += dt * power;
}

double FixMPMWall::compute_vector(int k) {
  if (k >= SUMS) return displacement_[k - SUMS];
  double sum;
  MPI_Allreduce(&sums_[k], &sum, 1, MPI_DOUBLE, MPI_SUM, world);
  return sum;
}

/* Collective: the sums are spread over the ranks. */
void FixMPMWall::write_restart(FILE *file) {
  WallRecord record;
  memcpy(record.magic, RECORD_MAGIC, sizeof record.magic);
  record.side = side_;
  memcpy(record.displacement, displacement_, sizeof displacement_);
  MPI_Allreduce(sums_, record.sums, SUMS, MPI_DOUBLE, MPI_SUM, world);
  if (comm->me != 0) return;
  const int size = sizeof record;
  fwrite(&size, sizeof size, 1, file);
  fwrite(&record, sizeof record, 1, file);
}

void FixMPMWall::restart(char *bytes) {
  WallRecord record;
  memcpy(&record, bytes, sizeof record);
  if (memcmp(record.magic, RECORD_MAGIC, sizeof record.magic) != 0)
    fix_failed(lmp, this, "the restart file holds no state of this fix, or one of another version");
  side_ = (int)record.side;
  memcpy(displacement_, record.displacement, sizeof displacement_);
  for (int k = 0; k < SUMS; k++) sums_[k] = comm->me == 0 ? record.sums[k] : 0.0;
}
