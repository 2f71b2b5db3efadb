/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Thermal steps that last several time steps: conduction is slow beside sound. */
#include <cmath>

#include "fix_mpm_couple.h"
#include "keyword_parser.h"
#include "rank_error.h"
#include "update.h"

using namespace LAMMPS_NS;

void FixMPMCouple::read_thermal_every(KeywordParser &parser) {
  if (parser.accept("auto")) {
    heat_every_ = 0;
    heat_error_ = parser.number(NumberRange::inside(0.0, 0.1));
  } else {
    heat_every_ = parser.integer(1, 1000000, "auto E, or ");
  }
  heat_apart_ = heat_every_ != 1;
}

/* Sources wait until the next thermal step: not for longer than this, however slow conduction is. */
static const double MOST_STEPS = 1000.0;

/* Time steps of the thermal step that begins now: as many as its critical length allows and as let no temperature change
 * by more than heat_error_ of the range of temperatures at the present rates; at most twice as many as last time, since
 * rates change. Collective. */
int64_t FixMPMCouple::choose_heat_steps() const {
  if (heat_every_ > 0) return heat_every_;
  double mine[3] = {0.0, start_temperature_, -start_temperature_}, all[3]; /* fastest change, highest, minus the lowest */
  for (const MpmWall &wall : walls_) {
    if (wall.heat != MPM_WALL_TEMPERATURE) continue;
    mine[1] = MAX(mine[1], wall.temperature);
    mine[2] = MAX(mine[2], -wall.temperature);
  }
  for (const MpmPoint &point : points_) {
    mine[0] = MAX(mine[0], fabs(point.temperature_rate));
    mine[1] = MAX(mine[1], point.temperature);
    mine[2] = MAX(mine[2], -point.temperature);
  }
  MPI_Allreduce(mine, all, 3, MPI_DOUBLE, MPI_MAX, world);
  double limit[2];
  find_limits(limit);
  const double allowed = all[0] > 0.0 ? heat_error_ * (all[1] + all[2]) / all[0] : HUGE_VAL;
  const double steps = MIN(floor(MIN(allowed, limit[1]) / update->dt), MIN(MOST_STEPS, 2.0 * (double)heat_steps_));
  return (int64_t)MAX(1.0, steps);
}

/* Before a step: is it a thermal one, and for how long? Collective. */
void FixMPMCouple::begin_heat() {
  if (!heat_apart_ || !scene_.thermal) return;
  const bool is_due = heat_left_ == 0;
  if (is_due) heat_left_ = heat_steps_ = choose_heat_steps();
  mpm_set_heat_duration(mpm_, is_due ? (double)heat_left_ * update->dt : 0.0);
  heat_steps_done_ += is_due;
  heat_steps_left_out_ += !is_due;
  heat_left_--;
}

/* For the end of a run; empty if each step was a thermal one. */
std::string FixMPMCouple::heat_line() const {
  if (!heat_apart_ || !scene_.thermal) return "";
  return format_text("Fix %s: %lld thermal steps, left out in %lld time steps\n", id, (long long)heat_steps_done_,
                     (long long)heat_steps_left_out_);
}
