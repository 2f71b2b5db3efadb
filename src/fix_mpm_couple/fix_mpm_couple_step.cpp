/* SPDX-License-Identifier: GPL-2.0-or-later */
/* One step: particles to points, the MPM step, points to particles; and what keeps points from getting lost.
 *
 * While the points are attached to the core it alone has their state: points_ and state_ are behind it until write_points()
 * and write_state(). LIGGGHTS' own arrays have positions and velocities after each step, and whoever changes them, or the
 * forces, is heard in the next. What moves rows of state_ or adds some detaches first. */
#include <algorithm>
#include <cstring>

#include "atom.h"
#include "comm.h"
#include "domain.h"
#include "fix_mpm_couple.h"
#include "fix_mpm_rve.h"
#include "fix_mpm_wall.h"
#include "output.h"
#include "rank_error.h"
#include "update.h"

using namespace LAMMPS_NS;

bool FixMPMCouple::is_point(int i) const { return atom->mask[i] & groupbit; }

/* ---------------------------------------------------------------------------------------------------- new points */

/* Collective. */
void FixMPMCouple::start_points() {
  BaseStatus status = BASE_OK;
  std::vector<int> started;
  for (int i = 0; i < atom->nlocal && status == BASE_OK; i++) {
    if (!is_point(i)) continue;
    if (state_[i][STATE_STAGE] == STAGE_NEW) {
      if (rve_ || atom->density[i] > 0.0) start_point(i), started.push_back(i);
      else
        status = base_error(BASE_ERROR_ARGUMENT, "particle %d has density %g; set it by: set group GROUP density RHO",
                            atom->tag[i], atom->density[i]);
    }
    /* `set ... diameter` or `density` on points that have started would change rmass, the mass of the point. */
    MpmPoint point;
    memcpy(&point, state_[i], sizeof point);
    atom->rmass[i] = point.mass;
  }
  fix_check(lmp, this, status);
  number_points(started);
}

/* A point that waits for its number. Sorted as LIGGGHTS' create_atoms counts on one rank. */
struct Unnumbered {
  double position[3];
  double id; /* tells points at the same place apart */
  bool operator<(const Unnumbered &other) const {
    for (int k = 2; k >= 0; k--)
      if (position[k] != other.position[k]) return position[k] < other.position[k];
    return id < other.id;
  }
};

/* Numbers new points by position: z, then y, then x. LIGGGHTS' ids will not do, because create_atoms gives other ones
 * on another number of ranks, and order of sums and choice of packings must not depend on that. Collective. */
void FixMPMCouple::number_points(const std::vector<int> &started) {
  const int mine = 4 * (int)started.size();
  std::vector<int> count(comm->nprocs), first(comm->nprocs);
  MPI_Allgather(&mine, 1, MPI_INT, count.data(), 1, MPI_INT, world);
  int total = 0;
  for (int r = 0; r < comm->nprocs; r++) first[r] = total, total += count[r];
  if (total == 0) return;

  std::vector<Unnumbered> own, all(total / 4);
  for (int i : started) own.push_back({{atom->x[i][0], atom->x[i][1], atom->x[i][2]}, (double)atom->tag[i]});
  MPI_Allgatherv(own.data(), mine, MPI_DOUBLE, all.data(), count.data(), first.data(), MPI_DOUBLE, world);
  std::sort(all.begin(), all.end());
  for (size_t k = 0; k < started.size(); k++) {
    MpmPoint point;
    memcpy(&point, state_[started[k]], sizeof point);
    point.tag = last_number_ + 1 + (std::lower_bound(all.begin(), all.end(), own[k]) - all.begin());
    memcpy(state_[started[k]], &point, sizeof point);
  }
  last_number_ += total / 4;
}

void FixMPMCouple::start_point(int i) {
  MpmPoint point;
  mpm_point_default(&point);
  if (rve_) atom->density[i] = bulk_density_;
  memcpy(point.size0, size0_, sizeof size0_);
  point.volume0 = size0_[0] * size0_[1] * size0_[2];
  point.mass = atom->density[i] * point.volume0;
  point.heat_capacity = heat_capacity_;
  point.temperature = point.temperature_mapped = start_temperature_;
  memcpy(state_[i], &point, sizeof point);
  state_[i][STATE_EXTERNAL_WORK] = 0.0;
  state_[i][STATE_STAGE] = STAGE_STARTED;
}

void FixMPMCouple::assign_rves() {
  if (!rve_) return;
  std::vector<int64_t> tags;
  int mine = 0, any;
  for (size_t k = 0; k < points_.size(); k++) {
    tags.push_back(points_[k].tag);
    if (state_[particle_[k]][STATE_STAGE] == STAGE_ANSWERED) mine = 1;
  }
  MPI_Allreduce(&mine, &any, 1, MPI_INT, MPI_MAX, world);
  if (any && !rve_->has_state())
    fix_failed(lmp, this, "the points have run before, but fix " + rve_id_ +
                              " has no RVEs of theirs: it is new, or had another id or style in the restart file");
  if (!any && rve_->has_state())
    fix_failed(lmp, this, "the points are new, but fix " + rve_id_ +
                              " has RVEs of other points: this fix had another id or style in the restart file");
  rve_->assign(tags);
}

/* Volumes of new points, by which the law weighs its sums. */
void FixMPMCouple::tell_volumes() {
  if (!rve_) return;
  std::vector<int64_t> tags;
  std::vector<double> volumes;
  for (size_t k = 0; k < points_.size(); k++) {
    if (state_[particle_[k]][STATE_STAGE] == STAGE_ANSWERED) continue;
    tags.push_back(points_[k].tag);
    volumes.push_back(points_[k].volume0);
  }
  fix_check(lmp, this, rve_law_set_volumes(rve_->law(), (int)tags.size(), tags.data(), volumes.data()));
}

/* Stress, conductivity and modulus of points that have not met the law yet. Collective. */
void FixMPMCouple::answer_points() {
  int mine = 0, any;
  for (int i : particle_)
    if (state_[i][STATE_STAGE] != STAGE_ANSWERED) mine = 1;
  MPI_Allreduce(&mine, &any, 1, MPI_INT, MPI_MAX, world);
  if (!any) return;
  std::vector<MpmPoint> answered = points_;
  fix_check(lmp, this, mpm_initialise(mpm_, answered.data(), (int)answered.size()));
  tell_volumes();
  for (size_t k = 0; k < points_.size(); k++) {
    double *state = state_[particle_[k]];
    if (state[STATE_STAGE] == STAGE_ANSWERED) continue;
    points_[k] = answered[k];
    memcpy(state, &points_[k], sizeof(MpmPoint));
    state[STATE_STAGE] = STAGE_ANSWERED;
  }
}

/* ---------------------------------------------------------------------------------------------------- one step */

void FixMPMCouple::gather() {
  points_.clear();
  particle_.clear();
  for (int i = 0; i < atom->nlocal; i++) {
    if (!is_point(i)) continue;
    MpmPoint point;
    memcpy(&point, state_[i], sizeof point);
    point.heat_capacity = heat_capacity_;
    point.heat_external = 0.0;
    for (int k = 0; k < 3; k++) {
      point.position[k] = atom->x[i][k];
      point.velocity[k] = atom->v[i][k];
      point.force[k] = k < scene_.dimension ? atom->f[i][k] : 0.0;
    }
    points_.push_back(point);
    particle_.push_back(i);
  }
}

/* LIGGGHTS' arrays, whose rows follow each other in memory. */
MpmMotion FixMPMCouple::motion() {
  MpmMotion motion = {};
  if (points_.empty()) return motion;
  motion.index = particle_.data();
  motion.position = (double(*)[3])atom->x[0];
  motion.velocity = (double(*)[3])atom->v[0];
  motion.force = (const double(*)[3])atom->f[0];
  motion.work = work_.data();
  return motion;
}

/* Some were deleted without a word to this fix. */
bool FixMPMCouple::has_other_particles() const { return attached_ && atom->nlocal != attached_particles_; }

/* The points stay in the core until LIGGGHTS does more to them than to change their motion (detach). */
BaseStatus FixMPMCouple::attach() {
  if (attached_ && !has_other_particles()) {
    const MpmMotion present = motion();
    mpm_take_motion(mpm_, &present);
    return BASE_OK;
  }
  detach();
  gather();
  work_.resize(points_.size());
  for (size_t n = 0; n < points_.size(); n++) work_[n] = state_[particle_[n]][STATE_EXTERNAL_WORK];
  TRY(mpm_attach(mpm_, points_.data(), (int)points_.size()));
  attached_ = true;
  attached_particles_ = atom->nlocal;
  return BASE_OK;
}

/* points_ as they are now. */
void FixMPMCouple::write_points() {
  if (!attached_ || points_written_) return;
  mpm_write(mpm_);
  points_written_ = true;
}

/* state_ as it is now. */
void FixMPMCouple::write_state() {
  if (!attached_ || state_written_) return;
  write_points();
  for (size_t n = 0; n < points_.size(); n++) {
    double *state = state_[particle_[n]];
    memcpy(state, &points_[n], sizeof points_[n]);
    state[STATE_EXTERNAL_WORK] = work_[n];
  }
  state_written_ = true;
}

void FixMPMCouple::detach() {
  write_state();
  attached_ = false;
}

/* What others see between steps. At once remapped, not when LIGGGHTS happens to reneighbour: the way must not depend on
 * that. */
void FixMPMCouple::give_motion() {
  double low[3], high[3];
  const MpmMotion present = motion();
  mpm_give_motion(mpm_, &present, low, high);
  points_written_ = state_written_ = false;
  bool leaves = false;
  for (int k = 0; k < scene_.dimension; k++) leaves = leaves || low[k] < domain->boxlo[k] || high[k] >= domain->boxhi[k];
  for (size_t n = 0; leaves && n < points_.size(); n++) domain->remap(atom->x[particle_[n]], atom->image[particle_[n]]);
  check_leaving(atom->x, leaves);
}

void FixMPMCouple::final_integrate() {
  for (size_t k = 0; k < walls_.size(); k++) walls_[k] = wall_fixes_[k]->present(update->dt);
  follow_walls();
  if (!followed_.empty()) detach(); /* the domains of points over the grid's spacing are found when they are attached */
  BaseStatus status = attach();
  begin_heat();
  if (status == BASE_OK) status = mpm_advance(mpm_, update->dt);
  fix_check(lmp, this, status);
  give_motion();
  for (size_t k = 0; k < walls_.size(); k++) wall_fixes_[k]->end_step(walls_[k], update->dt);
  check_time_step(false);
  if (output_is_due()) fill_output();
  if (rve_) rve_->tell_backend();
  progress();
  /* Points have moved after LIGGGHTS fitted a shrink-wrapped box around them: a restart file needs a box that holds
   * them. */
  if (domain->nonperiodic == 2 && output->restart_requested(update->ntimestep)) domain->reset_box();
}

/* ---------------------------------------------------------------------------------------------------- nothing lost */

/* Beyond a fixed boundary, where LIGGGHTS drops particles silently. */
bool FixMPMCouple::is_outside(const double position[3]) const {
  for (int k = 0; k < 3; k++) {
    if (domain->boundary[k][0] == 1 && position[k] < domain->boxlo[k]) return true;
    if (domain->boundary[k][1] == 1 && position[k] >= domain->boxhi[k]) return true;
  }
  return false;
}

void FixMPMCouple::check_leaving(double **x, bool some) const {
  if (delete_leaving_) return;
  BaseStatus status = BASE_OK;
  for (size_t n = 0; some && n < particle_.size(); n++) {
    const int i = particle_[n];
    if (status == BASE_OK && is_outside(x[i]))
      status = base_error(BASE_ERROR_UNSTABLE,
                          "the material point with particle id %d left the box at step %lld through a fixed boundary, "
                          "at (%g, %g, %g): add "
                          "a fix mpm/wall, make the box "
                          "larger, or let points go by 'leaving delete'",
                          atom->tag[i], (long long)update->ntimestep, x[i][0], x[i][1], x[i][2]);
  }
  fix_check(lmp, this, status);
}

bigint FixMPMCouple::count_points(bool inside_only) const {
  bigint mine = 0, all;
  for (int i = 0; i < atom->nlocal; i++) mine += is_point(i) && !(inside_only && is_outside(atom->x[i]));
  MPI_Allreduce(&mine, &all, 1, MPI_LMP_BIGINT, MPI_SUM, world);
  return all;
}

void FixMPMCouple::pre_exchange() { points_before_exchange_ = count_points(true); }

/* After LIGGGHTS moved particles between ranks, which drops those that are no neighbour's. Particles inserted by
 * another fix join here. */
void FixMPMCouple::pre_neighbor() {
  const bigint now = count_points(false), expected = points_before_exchange_;
  if (expected >= 0 && now < expected)
    fix_failed(lmp, this,
               format_text("%lld material point(s) were lost between processors: they moved further than a processor's "
                           "sub-domain since the "
                           "last reneighbouring; use 'neigh_modify every 1 delay 0 check yes' or a smaller timestep",
                           (long long)(expected - now)));
  if (update->setupflag || !mpm_) return;
  const int mine = !attached_;
  int any;
  MPI_Allreduce(&mine, &any, 1, MPI_INT, MPI_MAX, world);
  if (!any) return; /* nobody came, went or changed places */
  detach();
  start_points();
  gather();
  answer_points();
}
