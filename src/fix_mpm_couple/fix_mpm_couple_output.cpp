/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Values of points and global ones for dumps and thermo_style, the progress line, the closing line. */
#include <fcntl.h>
#include <unistd.h>

#include <cstdlib>
#include <cstring>

#include "../base/tensor.h"
#include "atom.h"
#include "comm.h"
#include "domain.h"
#include "double_sum.h"
#include "fix_gravity.h"
#include "fix_mpm_couple.h"
#include "fix_mpm_rve.h"
#include "modify.h"
#include "output.h"
#include "rank_error.h"
#include "update.h"

using namespace LAMMPS_NS;
using namespace FixConst;

/* ------------------------------------------------------------------------------------------- who reads f_ID[i], and when */

/* Gravity may follow a variable, which may ask for anything. */
struct GravityWords : public FixGravity {
  static bool has_variable(const FixGravity *gravity) {
    char *FixGravity::*const words[] = {&GravityWords::mstr, &GravityWords::vstr, &GravityWords::pstr, &GravityWords::tstr,
                                        &GravityWords::xstr, &GravityWords::ystr, &GravityWords::zstr};
    for (char *FixGravity::*word : words)
      if (gravity->*word) return true;
    return false;
  }
};

/* Fixes that never look at values of other fixes, variables or computes. */
static bool never_reads(const Fix *fix) {
  if (const FixGravity *gravity = dynamic_cast<const FixGravity *>(fix)) return !GravityWords::has_variable(gravity);
  for (const char *style : {"mpm/", "property/", "mesh/surface", "wall/gran", "nve", "contacthistory", "heat/gran",
                            "heat/rest", "expansion/gran", "bond/gran/thermal"})
    if (strncmp(fix->style, style, strlen(style)) == 0) return true;
  return false;
}

/* Dumps and thermo output come at known steps, as do fixes that act at the end of every n-th step alone (ave/..., print);
 * all other fixes might look at any time. */
void FixMPMCouple::find_readers() {
  output_every_.clear();
  for (int k = 0; k < modify->nfix; k++) {
    const Fix *fix = modify->fix[k];
    if (!never_reads(fix)) output_every_.push_back(modify->fmask[k] == END_OF_STEP && fix->nevery > 0 ? fix->nevery : 1);
  }
}

bool FixMPMCouple::output_is_due() const {
  const bigint step = update->ntimestep;
  for (int every : output_every_)
    if (step % every == 0) return true;
  return step == output->next || step == update->laststep;
}

void FixMPMCouple::fill_output() {
  write_points();
  for (size_t k = 0; k < points_.size(); k++) point_output(points_[k], scene_.dimension, array_atom[particle_[k]]);
}

/* ------------------------------------------------------------------------------------------------------- global values */

/* This rank's part of the sums over points. */
void FixMPMCouple::sum_points(DoubleSum sum[TOTALS]) const {
  for (size_t n = 0; n < points_.size(); n++) {
    const MpmPoint &point = points_[n];
    const int i = particle_[n];
    MpmTotals one;
    mpm_totals(&point, 1, &one);
    sum[TOTAL_MASS].add(one.mass);
    for (int k = 0; k < 3; k++) sum[TOTAL_MOMENTUM + k].add(one.momentum[k]);
    sum[TOTAL_KINETIC].add(one.kinetic_energy);
    sum[TOTAL_THERMAL].add(one.thermal_energy);
    sum[TOTAL_POINTS].add(1.0);
    double position[3];
    domain->unmap(atom->x[i], atom->image[i], position);
    for (int k = 0; k < 3; k++) sum[TOTAL_POTENTIAL].add(-point.force[k] * position[k]);
    const double volume = point.volume0 * tensor_determinant(point.deformation_gradient);
    sum[TOTAL_STORED].add(volume * point.scalars[MPM_LAW_ENERGY_DENSITY]);
    sum[TOTAL_EXTERNAL_WORK].add(state_[i][STATE_EXTERNAL_WORK]);
  }
}

/* Collective, as thermo output is. */
void FixMPMCouple::update_totals() {
  if (totals_step_ == update->ntimestep) return;
  if (has_other_particles()) detach();
  write_state();
  gather(); /* with the present forces; attached points stay where they are in points_ */
  DoubleSum mine[TOTALS];
  sum_points(mine);
  std::vector<DoubleSum> parts((size_t)TOTALS * comm->nprocs);
  MPI_Allgather(mine, 2 * TOTALS, MPI_DOUBLE, parts.data(), 2 * TOTALS, MPI_DOUBLE, world);
  for (int k = 0; k < TOTALS; k++) {
    DoubleSum sum;
    for (int rank = 0; rank < comm->nprocs; rank++) sum.add(parts[(size_t)rank * TOTALS + k]);
    totals_[k] = sum.value();
  }
  if (rve_ && rve_->law()) {
    RveLawTotals law;
    fix_check(lmp, this, rve_law_totals(rve_->law(), &law));
    totals_[TOTAL_FRICTION_HEAT] = law.friction_work;
    totals_[TOTAL_RVES_RUN] = (double)law.rves_run;
    totals_[TOTAL_UNBALANCED] = law.worst_unbalanced;
    totals_[TOTAL_PARTICLE_STEPS] = (double)law.particle_steps;
    totals_[TOTAL_DAMPING_WORK] = law.damping_work;
  }
  totals_step_ = update->ntimestep;
}

double FixMPMCouple::compute_scalar() {
  update_totals();
  return totals_[TOTAL_KINETIC] + totals_[TOTAL_POTENTIAL] + totals_[TOTAL_STORED];
}

double FixMPMCouple::compute_vector(int k) {
  update_totals();
  return totals_[k];
}

/* ---------------------------------------------------------------------------------------------------- how long it
 * takes */

/* Open MPI gives every rank a terminal of its own; where the output really goes is known to mpirun, the parent. */
static bool is_terminal() {
  if (!isatty(STDOUT_FILENO)) return false;
  const int parent = open(format_text("/proc/%d/fd/1", (int)getppid()).c_str(), O_WRONLY | O_NOCTTY | O_NONBLOCK);
  if (parent < 0) return getenv("OMPI_COMM_WORLD_SIZE") == NULL;
  const bool terminal = isatty(parent);
  close(parent);
  return terminal;
}

void FixMPMCouple::start_progress() {
  show_progress_ = comm->me == 0 && screen == stdout && is_terminal();
  progress_shown_ = false;
  run_started_ = progress_printed_ = base_seconds();
  heat_steps_done_ = heat_steps_left_out_ = 0;
  particle_steps_before_ = rve_seconds_before_ = 0.0;
  if (!rve_) return;
  RveLawTotals law;
  fix_check(lmp, this, rve_law_totals(rve_->law(), &law));
  particle_steps_before_ = (double)law.particle_steps;
  rve_seconds_before_ = law.seconds;
}

/* On a terminal, once per second. Written over itself and wiped, so that LIGGGHTS' own lines stay readable. */
void FixMPMCouple::progress() {
  if (!show_progress_) return;
  const double now = base_seconds();
  if (now - progress_printed_ < 1.0) return;
  progress_printed_ = now;
  progress_shown_ = true;
  const double done = (double)(update->ntimestep - update->firststep),
               left = (double)(update->laststep - update->ntimestep);
  const double rate = done / (now - run_started_);
  fprintf(screen, "\r\033[K  step %lld of %lld: %.3g steps/s, %.0f s left\r", (long long)update->ntimestep,
          (long long)update->laststep, rate, left / rate);
  fflush(screen);
}

void FixMPMCouple::post_run() {
  detach();
  if (progress_shown_) fprintf(screen, "\r\033[K");
  std::string line = heat_line() + rve_lines();
  if (comm->me != 0) return;
  if (screen) fputs(line.c_str(), screen);
  if (logfile) fputs(line.c_str(), logfile);
}

/* Collective. */
std::string FixMPMCouple::rve_lines() const {
  if (!rve_) return "";
  RveLawTotals law;
  fix_check(lmp, this, rve_law_totals(rve_->law(), &law));
  const double seconds = base_seconds() - run_started_, steps = (double)law.particle_steps - particle_steps_before_;
  if (steps <= 0.0) return "";
  std::string line = format_text(
      "Fix %s: %lld RVEs of %lld grains in all, %.4g DEM particle-steps, %.4g per second, %.0f %% of the time in "
      "RVEs (backend %s)\n",
      id, (long long)law.rves, (long long)law.grains, steps, steps / seconds,
      100.0 * (law.seconds - rve_seconds_before_) / seconds, rve_law_backend_name(rve_->law()));
  line += format_text("Fix %s: %lld RVE steps so far: %lld computed, %lld copies of one with the same packing and history, "
                      "%lld in free flight, %lld not run as their points rest\n",
                      id, (long long)(law.calls + law.rested), (long long)(law.calls - law.shared - law.flown),
                      (long long)law.shared, (long long)law.flown, (long long)law.rested);
  if (law.networks_solved > 0)
    line += format_text("Fix %s: conductivity of networks so far: %lld solved, %lld carried along from an earlier solution\n", id,
                        (long long)law.networks_solved, (long long)law.networks_kept);
  return line;
}
