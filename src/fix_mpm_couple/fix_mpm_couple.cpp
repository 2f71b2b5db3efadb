/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The command and what happens before a run. */
#include "fix_mpm_couple.h"

#include <omp.h>

#include <cmath>
#include <cstring>

#include "atom.h"
#include "comm.h"
#include "domain.h"
#include "fix_mpm_rve.h"
#include "fix_mpm_traction.h"
#include "fix_mpm_wall.h"
#include "force.h"
#include "group.h"
#include "keyword_parser.h"
#include "lattice.h"
#include "material_properties.h"
#include "memory.h"
#include "modify.h"
#include "neighbor.h"
#include "rank_error.h"
#include "rank_threads.h"
#include "update.h"

using namespace LAMMPS_NS;
using namespace FixConst;

FixMPMCouple::FixMPMCouple(LAMMPS *lammps, int narg, char **arg) : Fix(lammps, narg, arg), scene_(mpm_scene_default()) {
  if (!atom->radius_flag || !atom->rmass_flag || !atom->density_flag)
    fix_failed(lmp, this, "needs atom_style granular");
  read_keywords(narg, arg);

  time_integrate = 1;
  create_attribute = 1;
  restart_global = restart_peratom = restart_file = 1;
  scalar_flag = vector_flag = 1;
  size_vector = TOTALS;
  extscalar = extvector = 0;
  global_freq = 1;
  peratom_flag = 1;
  size_peratom_cols = OUTPUT_COLUMNS;
  peratom_freq = 1;

  grow_arrays(atom->nmax);
  atom->add_callback(0);
  atom->add_callback(1);
  for (int i = 0; i < atom->nlocal; i++) set_arrays(i);
  exclude_from_neighbor_lists();
}

FixMPMCouple::~FixMPMCouple() {
  atom->delete_callback(id, 0);
  atom->delete_callback(id, 1);
  destroy_mpm();
  memory->destroy(state_);
  memory->destroy(array_atom);
}

int FixMPMCouple::setmask() { return PRE_EXCHANGE | PRE_NEIGHBOR | FINAL_INTEGRATE; }

/* ---------------------------------------------------------------------------------------------------- the command */

void FixMPMCouple::read_keywords(int narg, char **arg) {
  scene_.dimension = domain->dimension;
  KeywordParser parser(
      lmp, this, narg, arg, 3,
      {"grid", "origin", "shape", "transfer", "order", "material", "thermal", "temperature", "mechanics",
       "damping/point", "damping/grid", "point/size", "density/bulk", "timestep/check", "leaving", "threads", "follow",
       "thermal/every", "volumetric"});
  while (parser.next()) {
    if (parser.is("grid")) scene_.spacing = parser.number(NumberRange::positive());
    else if (parser.is("origin"))
      for (double &o : scene_.origin) o = parser.number(NumberRange::any());
    else if (parser.is("shape"))
      scene_.shape = (MpmShape[]){MPM_SHAPE_LINEAR, MPM_SHAPE_GIMP,
                                  MPM_SHAPE_BSPLINE}[parser.choice({"linear", "gimp", "bspline"})];
    else if (parser.is("transfer")) read_transfer(parser);
    else if (parser.is("order"))
      scene_.order = (MpmOrder[]){MPM_ORDER_USF, MPM_ORDER_USL, MPM_ORDER_MUSL}[parser.choice({"usf", "usl", "musl"})];
    else if (parser.is("volumetric"))
      scene_.volumetric = (MpmVolumetric[]){MPM_VOLUMETRIC_POINT, MPM_VOLUMETRIC_CELL}[parser.choice({"point", "cell"})];
    else if (parser.is("material")) read_material(parser);
    else if (parser.is("thermal")) scene_.thermal = parser.yes_no();
    else if (parser.is("thermal/every")) read_thermal_every(parser);
    else if (parser.is("temperature")) start_temperature_ = parser.number(NumberRange::any());
    else if (parser.is("mechanics")) scene_.mechanical = parser.yes_no();
    else if (parser.is("damping/point")) scene_.point_damping = parser.number(NumberRange::at_least(0.0));
    else if (parser.is("damping/grid")) scene_.grid_damping = parser.number(NumberRange::at_least(0.0));
    else if (parser.is("point/size"))
      for (int i = 0; i < domain->dimension; i++) size0_[i] = parser.number(NumberRange::positive());
    else if (parser.is("density/bulk")) given_density_ = parser.number(NumberRange::positive());
    else if (parser.is("timestep/check")) check_time_step_ = parser.yes_no();
    else if (parser.is("leaving")) delete_leaving_ = parser.choice({"error", "delete"}) == 1;
    else if (parser.is("follow")) {
      do followed_.push_back(parser.word("the id of a plane fix mpm/wall"));
      while (parser.has_value());
    } else if (parser.is("threads")) scene_.threads = parser.integer(1, 4096);
  }
  check_keywords(parser);
  if (!parser.given("point/size")) take_size_from_lattice();
  if (domain->dimension == 2) size0_[2] = 1.0;
}

void FixMPMCouple::check_keywords(const KeywordParser &parser) {
  parser.require("grid", "grid H, the edge of a grid cell, m");
  parser.require("shape", "shape linear|gimp|bspline");
  parser.require("transfer", "transfer flip A|pic|apic|xpic M");
  parser.require("material", "material rve RVEFIXID, or material elastic 3d|plane_strain|plane_stress|bar");
  if (scene_.thermal)
    parser.require("temperature", "temperature T0, that of the points at the start, is needed with 'thermal yes'");
  if (!scene_.mechanical && !scene_.thermal)
    parser.fail("keyword 'mechanics': 'no' without 'thermal yes' leaves nothing to do");
  if (parser.given("thermal/every") && !(scene_.thermal && scene_.mechanical))
    parser.fail("keyword 'thermal/every' needs 'thermal yes' and 'mechanics yes'; with 'mechanics no' the time step is the "
                "thermal one");
  if (scene_.volumetric == MPM_VOLUMETRIC_CELL && rve_id_.empty() && elastic_mode_ == MPM_ELASTIC_BAR)
    parser.fail("keyword 'volumetric': 'cell' has no meaning with 'material elastic bar', whose stress has one direction; allowed: "
                "'point'");
  if (given_density_ > 0.0 && rve_id_.empty())
    parser.fail("keyword 'density/bulk' needs 'material rve'; with 'material elastic': set group GROUP density RHO");
  if (!parser.given("threads")) {
    const int share = rank_threads(world), wanted = omp_get_max_threads();
    scene_.threads = share < wanted ? share : wanted;
  }
}

void FixMPMCouple::read_transfer(KeywordParser &parser) {
  const int kind = parser.choice({"flip", "pic", "apic", "xpic"});
  scene_.transfer = kind == 2 ? MPM_TRANSFER_APIC : kind == 3 ? MPM_TRANSFER_XPIC : MPM_TRANSFER_FLIP;
  if (kind == 0) scene_.pic_fraction = 1.0 - parser.number(NumberRange::between(0.0, 1.0));
  if (kind == 1) scene_.pic_fraction = 1.0;
  if (kind == 3) scene_.xpic_order = parser.integer(1, 10);
}

void FixMPMCouple::read_material(KeywordParser &parser) {
  if (parser.choice({"rve", "elastic"}) == 0) {
    rve_id_ = parser.word("the id of a fix mpm/rve");
    const int k = modify->find_fix(rve_id_.c_str());
    if (k < 0 || strcmp(modify->fix[k]->style, "mpm/rve") != 0)
      parser.fail("keyword 'material': '" + rve_id_ + "' is not the id of a fix mpm/rve, which must be defined before");
    return;
  }
  const MpmElasticMode modes[] = {MPM_ELASTIC_3D, MPM_ELASTIC_PLANE_STRAIN, MPM_ELASTIC_PLANE_STRESS, MPM_ELASTIC_BAR};
  elastic_mode_ = modes[parser.choice({"3d", "plane_strain", "plane_stress", "bar"})];
  if (domain->dimension == 2 && elastic_mode_ == MPM_ELASTIC_3D)
    parser.refuse("3d", "plane_strain, plane_stress or bar in 2D");
  if (domain->dimension == 3 &&
      (elastic_mode_ == MPM_ELASTIC_PLANE_STRAIN || elastic_mode_ == MPM_ELASTIC_PLANE_STRESS))
    parser.refuse("plane_strain or plane_stress", "3d or bar in 3D");
}

/* LIGGGHTS' lattices of one point per cell: their spacing is the size of a point. */
void FixMPMCouple::take_size_from_lattice() {
  const Lattice *lattice = domain->lattice;
  if (!lattice || lattice->nbasis != 1)
    fix_failed(lmp, this,
               "keyword 'point/size' is missing: point/size LX LY [LZ], m; it can be left out after 'lattice sq' or "
               "'lattice sc' only");
  const double spacing[3] = {lattice->xlattice, lattice->ylattice, lattice->zlattice};
  for (int i = 0; i < domain->dimension; i++) size0_[i] = spacing[i];
}

void FixMPMCouple::exclude_from_neighbor_lists() {
  char exclude[] = "exclude", kind[] = "group", all[] = "all";
  char *words[] = {exclude, kind, group->names[igroup], all};
  neighbor->modify_params(4, words);
}

FixMPMCouple *FixMPMCouple::find(LAMMPS *lammps, const Fix *asking, const std::string &mpm_id) {
  const int k = lammps->modify->find_fix(mpm_id.c_str());
  FixMPMCouple *couple = k < 0 ? NULL : dynamic_cast<FixMPMCouple *>(lammps->modify->fix[k]);
  if (!couple) fix_failed(lammps, asking, "'" + mpm_id + "' is not the id of a fix mpm/couple");
  return couple;
}

int FixMPMCouple::modify_param(int narg, char **arg) {
  KeywordParser parser(lmp, this, narg, arg, 0, {"damping/point", "damping/grid"});
  while (parser.next()) {
    const double value = parser.number(NumberRange::at_least(0.0));
    (parser.is("damping/point") ? scene_.point_damping : scene_.grid_damping) = value;
  }
  return narg;
}

/* ---------------------------------------------------------------------------------------------------- start of a run
 */

/* Also called by write_restart without a run. */
void FixMPMCouple::init() {
  check_domain();
  check_other_fixes();
  const int type = find_point_type();
  check_place();
  destroy_mpm();
  create_law(type);
  create_mpm();
  find_walls_and_tractions();
  start_points();
  set_sort_bins();
  find_readers();
  just_created = 0; /* Modify::setup would reset the state of a new fix */
}

/* LIGGGHTS sorts particles by bins of half a neighbour cutoff. Without a pair style there is none, and it would end. */
void FixMPMCouple::set_sort_bins() {
  if (force->pair) return;
  /* Nor are there lists to build; bins would fail in the flat boxes of 2D ("box size << cutoff"). 0: style nsq. */
  neighbor->style = 0;
  if (atom->sortfreq <= 0) return;
  char keyword[] = "sort";
  std::string every = std::to_string(atom->sortfreq), size = format_text("%.17g", scene_.spacing);
  char *words[] = {keyword, &every[0], &size[0]};
  atom->modify_params(3, words);
}

void FixMPMCouple::check_domain() {
  if (update->whichflag == 2) fix_failed(lmp, this, "cannot be used with 'minimize'");
  if (strstr(update->integrate_style, "respa")) fix_failed(lmp, this, "needs 'run_style verlet'");
  if (domain->triclinic) fix_failed(lmp, this, "cannot be used in a triclinic box");
  scene_.dimension = domain->dimension;
  for (int i = 0; i < 3; i++) {
    scene_.periodic[i] = i < domain->dimension && domain->periodicity[i];
    scene_.period[i] = scene_.periodic[i] ? domain->prd[i] : 0.0;
    if (scene_.periodic[i] && (domain->box_change_size || domain->box_change_shape))
      fix_failed(lmp, this, "a periodic box may not change its size or shape");
  }
  fix_check(lmp, this, mpm_scene_check(&scene_));
}

/* Other integrators would move the points a second time, contacts with walls of grains would push them. */
void FixMPMCouple::check_other_fixes() {
  for (int k = 0; k < modify->nfix; k++) {
    const Fix *other = modify->fix[k];
    const bool contact = strncmp(other->style, "wall/gran", 9) == 0;
    if (other == this || !(other->time_integrate || contact)) continue;
    int mine = 0, shared;
    for (int i = 0; i < atom->nlocal; i++)
      if (is_point(i) && (atom->mask[i] & other->groupbit)) mine = 1;
    MPI_Allreduce(&mine, &shared, 1, MPI_INT, MPI_MAX, world);
    if (shared)
      fix_failed(lmp, this,
                 format_text("fix %s (style %s) acts on particles of group %s, which are material points: %s",
                             other->id, other->style, group->names[igroup],
                             contact ? "use fix mpm/wall for them and give that fix a group without points"
                                     : "give it a group without points"));
  }
}

/* The atom type of the points; all have the same. */
int FixMPMCouple::find_point_type() {
  int mine[2] = {-atom->ntypes - 1, 0}, all[2]; /* minus the smallest, the largest */
  for (int i = 0; i < atom->nlocal; i++) {
    if (!is_point(i)) continue;
    mine[0] = MAX(mine[0], -atom->type[i]);
    mine[1] = MAX(mine[1], atom->type[i]);
  }
  MPI_Allreduce(mine, all, 2, MPI_INT, MPI_MAX, world);
  if (all[1] == 0)
    fix_failed(lmp, this, format_text("group %s has no particles to be material points", group->names[igroup]));
  if (-all[0] != all[1])
    fix_failed(
        lmp, this,
        format_text(
            "the particles of group %s have atom types %d to %d; all material points of a fix must have one type",
            group->names[igroup], -all[0], all[1]));
  return all[1];
}

/* Before LIGGGHTS drops particles beyond a fixed boundary, and a body smaller than a cell moves like one point. */
void FixMPMCouple::check_place() {
  BaseStatus status = BASE_OK;
  for (int i = 0; i < atom->nlocal && !delete_leaving_; i++)
    if (status == BASE_OK && is_point(i) && is_outside(atom->x[i]))
      status = base_error(BASE_ERROR_ARGUMENT,
                          "the material point with particle id %d, at (%g, %g, %g), is outside of the box, which "
                          "reaches from (%g, %g, %g) to (%g, %g, %g) with a fixed boundary; make the box larger, or let "
                          "points go by 'leaving delete'",
                          atom->tag[i], atom->x[i][0], atom->x[i][1], atom->x[i][2], domain->boxlo[0], domain->boxlo[1],
                          domain->boxlo[2], domain->boxhi[0], domain->boxhi[1], domain->boxhi[2]);
  fix_check(lmp, this, status);
  double low[3], high[3], largest = 0.0;
  find_bounds(low, high);
  for (int k = 0; k < domain->dimension; k++) largest = MAX(largest, high[k] - low[k] + size0_[k]);
  if (count_points(false) > 1 && largest < scene_.spacing)
    fix_failed(lmp, this,
               format_text("keyword 'grid': cells of %g m are coarser than the body of material points, whose longest "
                           "edge is %g m; allowed: cells smaller than the body",
                           scene_.spacing, largest));
}

void FixMPMCouple::create_law(int type) {
  const MaterialProperties properties(lmp, this, type);
  heat_capacity_ = scene_.thermal ? properties.of_type("thermalCapacity", NumberRange::positive()) : 0.0;
  rve_ = NULL;
  if (rve_id_.empty()) {
    create_elastic_law(type);
    return;
  }
  const int k = modify->find_fix(rve_id_.c_str());
  rve_ = k < 0 ? NULL : dynamic_cast<FixMPMRve *>(modify->fix[k]);
  if (!rve_) fix_failed(lmp, this, "keyword 'material': fix " + rve_id_ + " of style mpm/rve does not exist any more");
  rve_->prepare(id, type, scene_.thermal);
  rve_law_as_mpm_law(rve_->law(), &law_);
  bulk_density_ = given_density_ > 0.0 ? given_density_ : rve_law_bulk_density(rve_->law());
}

void FixMPMCouple::create_elastic_law(int type) {
  const MaterialProperties properties(lmp, this, type);
  MpmElastic elastic = {};
  elastic.mode = elastic_mode_;
  elastic.thermal = scene_.thermal;
  elastic.young = properties.of_type("youngsModulus", NumberRange::positive());
  if (elastic_mode_ != MPM_ELASTIC_BAR)
    elastic.poisson = properties.of_type("poissonsRatio", NumberRange::inside(-1.0, 0.5));
  if (scene_.thermal) {
    elastic.expansion = properties.of_type("thermalExpansionCoefficient", NumberRange::at_least(0.0));
    const double conductivity = properties.of_type("thermalConductivity", NumberRange::at_least(0.0));
    for (int i = 0; i < 3; i++) elastic.conductivity[i] = conductivity;
  }
  fix_check(lmp, this, mpm_elastic_create(&elastic, &law_));
}

void FixMPMCouple::create_mpm() {
  const bool periodic = scene_.periodic[0] || scene_.periodic[1] || scene_.periodic[2];
  if (comm->nprocs > 1 || periodic)
    fix_check(lmp, this, point_halo_create(world, scene_.dimension, scene_.period, &halo_));
  fix_check(lmp, this, mpm_create(&scene_, &law_, halo_.content ? &halo_ : NULL, &mpm_));
}

void FixMPMCouple::destroy_mpm() {
  detach();
  mpm_destroy(mpm_);
  mpm_ = NULL;
  if (halo_.content) halo_.destroy(halo_.content);
  memset(&halo_, 0, sizeof halo_);
  if (rve_id_.empty() && law_.content) law_.destroy(law_.content);
  memset(&law_, 0, sizeof law_);
}

void FixMPMCouple::find_bounds(double low[3], double high[3]) {
  double mine[6], all[6]; /* low and minus high, for one reduction */
  for (int k = 0; k < 6; k++) mine[k] = HUGE_VAL;
  for (int i = 0; i < atom->nlocal; i++) {
    if (!is_point(i)) continue;
    for (int k = 0; k < 3; k++) {
      mine[k] = MIN(mine[k], atom->x[i][k]);
      mine[3 + k] = MIN(mine[3 + k], -atom->x[i][k]);
    }
  }
  MPI_Allreduce(mine, all, 6, MPI_DOUBLE, MPI_MIN, world);
  for (int k = 0; k < 3; k++) low[k] = all[k], high[k] = -all[3 + k];
}

/* In the order of their definition, on all ranks alike. */
void FixMPMCouple::find_walls_and_tractions() {
  double low[3], high[3];
  find_bounds(low, high);
  wall_fixes_.clear();
  walls_.clear();
  std::vector<MpmTraction> tractions;
  for (int k = 0; k < modify->nfix; k++) {
    FixMPMWall *wall = dynamic_cast<FixMPMWall *>(modify->fix[k]);
    if (wall && wall->mpm_id() == id) {
      wall->begin_run(scene_.thermal, low, high);
      wall_fixes_.push_back(wall);
      walls_.push_back(wall->present(0.0));
    }
    const FixMPMTraction *traction = dynamic_cast<FixMPMTraction *>(modify->fix[k]);
    if (traction && traction->mpm_id() == id) tractions.push_back(traction->traction());
  }
  fix_check(lmp, this, mpm_set_walls(mpm_, walls_.data(), (int)walls_.size()));
  check_followed();
  follow_walls();
  fix_check(lmp, this, mpm_set_tractions(mpm_, tractions.data(), (int)tractions.size()));
}

static FixMPMWall *find_wall(const std::vector<FixMPMWall *> &walls, const std::string &name) {
  for (FixMPMWall *wall : walls)
    if (name == wall->id) return wall;
  return NULL;
}

void FixMPMCouple::check_followed() {
  bool taken[3] = {false, false, false};
  for (const std::string &name : followed_) {
    const FixMPMWall *wall = find_wall(wall_fixes_, name);
    int axis;
    if (!wall || wall->stretch(scene_.origin, axis) == 0.0)
      fix_failed(lmp, this, "keyword 'follow': '" + name + "' is given, allowed is the id of a plane fix mpm/wall of this fix, "
                            "not at the grid's origin");
    const double cells = (wall->first_position() - scene_.origin[axis]) / scene_.spacing;
    if (fabs(cells - round(cells)) > 1e-6 || round(cells) == 0.0)
      fix_failed(lmp, this, format_text("keyword 'follow': wall '%s' is %g cells from the grid's origin; allowed is a whole number "
                                        "other than 0, so that it is on a node", name.c_str(), cells));
    if (taken[axis]) fix_failed(lmp, this, "keyword 'follow': '" + name + "' is the second wall along its axis; allowed is one");
    taken[axis] = true;
  }
}

/* The grid is as long as its walls say. */
void FixMPMCouple::follow_walls() {
  if (followed_.empty()) return;
  double stretch[3] = {1.0, 1.0, 1.0};
  for (const std::string &name : followed_) {
    int axis;
    const double ratio = find_wall(wall_fixes_, name)->stretch(scene_.origin, axis);
    stretch[axis] = ratio;
  }
  fix_check(lmp, this, mpm_set_stretch(mpm_, stretch));
}

/* Nothing here changes the way of points that have run before: a restart continues bit for bit. */
void FixMPMCouple::setup(int) {
  detach();
  start_points();
  gather();
  assign_rves();
  answer_points();
  warned_time_step_ = false;
  check_time_step(true);
  fill_output();
  totals_step_ = -1;
  start_progress();
}

/* Critical time steps, s, mechanical and thermal, of all points. Collective. */
void FixMPMCouple::find_limits(double limit[2]) const {
  double mine[2];
  if (attached_) mpm_critical_attached(mpm_, &mine[0], &mine[1]);
  else mpm_critical_time_steps(mpm_, points_.data(), (int)points_.size(), &mine[0], &mine[1]);
  MPI_Allreduce(mine, limit, 2, MPI_DOUBLE, MPI_MIN, world);
  if (!scene_.mechanical) limit[0] = HUGE_VAL;
  if (!scene_.thermal) limit[1] = HUGE_VAL;
}

/* Without a look at each point. Collective. */
bool FixMPMCouple::is_below_limits() const {
  int mine = attached_ && mpm_is_below_critical(mpm_, update->dt), all;
  MPI_Allreduce(&mine, &all, 1, MPI_INT, MPI_MIN, world);
  return all;
}

void FixMPMCouple::check_time_step(bool starting) {
  if (!check_time_step_ || (!starting && warned_time_step_)) return;
  if (!starting && is_below_limits()) return;
  double limit[2];
  find_limits(limit);
  const int every = heat_every_ > 1 ? heat_every_ : 1, worse = limit[1] / every < limit[0];
  const double step = worse ? every * update->dt : update->dt;
  if (step <= limit[worse]) return;
  const std::string times = worse && every > 1 ? format_text("%d times ('thermal/every') ", every) : "";
  const std::string message = format_text("%stimestep %g s is larger than the critical %s time step %g s", times.c_str(),
                                          update->dt, worse ? "thermal" : "mechanical", limit[worse]);
  if (starting) fix_failed(lmp, this, message + "; reduce 'timestep', or override by 'timestep/check no'");
  fix_warning(lmp, this, format_text("at step %lld ", (long long)update->ntimestep) + message);
  warned_time_step_ = true;
}
