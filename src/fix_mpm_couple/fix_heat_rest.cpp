/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "fix_heat_rest.h"

#include <cmath>
#include <cstring>

#include "atom.h"
#include "comm.h"
#include "fix_heat_gran_grain.h"
#include "fix_property_atom.h"
#include "fix_property_global.h"
#include "fix_scalar_transport_equation.h"
#include "keyword_parser.h"
#include "modify.h"
#include "neigh_list.h"
#include "output.h"
#include "pair_gran.h"
#include "rank_error.h"
#include "signal_handling.h"
#include "timer.h"
#include "update.h"
#include "verlet.h"

using namespace LAMMPS_NS;

namespace {
const int MOST_ITERATIONS = 20000;
const double SMALLEST_CAPACITY = 1e-8; /* J/(kg K): below, LIGGGHTS keeps the temperature */

/* LIGGGHTS' set-up of a run (neighbours, one evaluation of forces, walls' contacts), then steps of temperature only.
 * Output and fixes that act at the end of a step see them as they see others. */
class RestIntegrate : public Verlet {
 public:
  RestIntegrate(LAMMPS *lammps, FixHeatRest *fix) : Verlet(lammps, 0, NULL), fix_(fix) {}
  void setup() {
    Verlet::setup();
    fix_->freeze();
  }
  void run(int steps) {
    if (steps > 0) fix_->begin();
    for (int k = 0; k < steps; k++) {
      const bigint step = ++update->ntimestep;
      ev_set(step); /* energies and pressures of the set-up hold on: nothing moves */
      output->restart_requested(step); /* by a signal */
      timer->stamp();
      fix_->advance(step == output->next || modify->n_end_of_step > 0);
      if (modify->n_end_of_step) modify->end_of_step();
      timer->stamp(TIME_MODIFY);
      if (step == output->next) {
        output->write(step);
        timer->stamp(TIME_OUTPUT);
      }
      if (SignalHandler::request_quit && !SignalHandler::request_write_restart) break;
    }
  }

 private:
  FixHeatRest *fix_;
};

/* LIGGGHTS has no public way to this member; a derived class may name it. */
struct Access : FixScalarTransportEquation {
  static bool FixScalarTransportEquation::*integrates() { return &Access::int_flag; }
};
}  // namespace

FixHeatRest::FixHeatRest(LAMMPS *lammps, int narg, char **arg)
    : Fix(lammps, narg, arg),
      solver_(EXPLICIT),
      tolerance_(1e-10),
      heat_(NULL),
      mine_(NULL),
      theirs_(NULL),
      network_(NULL),
      solution_{},
      limit_(0.0),
      pairs_(0.0),
      walls_(0.0),
      spread_(NULL) {
  vector_flag = 1;
  size_vector = 6;
  global_freq = 1;
  extvector = 0;
  comm_forward = 1;
  if (strcmp(arg[1], "all") != 0)
    fix_failed(lmp, this,
               format_text("the group is %s, allowed is all: the particles are those of fix heat/gran/grain", arg[1]));
  KeywordParser parser(lmp, this, narg, arg, 3, {"solver", "tolerance"});
  while (parser.next()) {
    if (parser.is("solver")) solver_ = (Solver)parser.choice({"explicit", "implicit", "steady"});
    else if (parser.is("tolerance")) tolerance_ = parser.number(NumberRange::inside(0.0, 1.0));
  }
  if (solver_ == EXPLICIT && parser.given("tolerance"))
    parser.fail("keyword 'tolerance' has a meaning with 'solver implicit' or 'steady' only");
}

FixHeatRest::~FixHeatRest() {
  grain_network_destroy(network_);
  delete theirs_;
}

/* At the end of the program LIGGGHTS has deleted its present integrator before the fixes: only `unfix` puts the old one
 * back. */
void FixHeatRest::pre_delete(bool unfix) {
  if (!unfix || !mine_ || update->integrate != mine_) return;
  delete mine_;
  update->integrate = theirs_;
  mine_ = theirs_ = NULL;
}

void FixHeatRest::init() {
  find_heat();
  check_integration();
  if (update->whichflag != 1 || (mine_ && update->integrate == mine_)) return;
  delete theirs_; /* left over if a command run_style has taken the place of this fix's integrator */
  theirs_ = update->integrate;
  update->integrate = mine_ = new RestIntegrate(lmp, this);
  mine_->init(); /* that of all integrators has just been called */
}

void FixHeatRest::find_heat() {
  heat_ = NULL;
  for (int k = 0; k < modify->nfix; k++) {
    Fix *fix = modify->fix[k];
    if (FixHeatGranGrain *heat = dynamic_cast<FixHeatGranGrain *>(fix)) heat_ = heat;
    if (fix != this && strcmp(fix->style, style) == 0)
      fix_failed(lmp, this, format_text("there is another fix %s (id %s)", style, fix->id));
    if (strncmp(fix->style, "mpm/couple", 10) == 0)
      fix_failed(lmp, this,
                 format_text("fix %s (id %s) moves material points, but nothing moves in runs with this fix: remove "
                             "one of them (unfix)",
                             fix->style, fix->id));
  }
  if (!heat_)
    fix_failed(lmp, this, "there is no fix heat/gran/grain: its models and its particles are those of this fix, too");
}

bool FixHeatRest::has_tables() const { return heat_->conductivity_table_ || heat_->capacity_table_; }

/* What the user can change in the integration of LIGGGHTS' own fix, which this one replaces. */
void FixHeatRest::check_integration() {
  if (update->whichflag == 1 && strncmp(update->integrate_style, "verlet", 6) != 0)
    fix_failed(lmp, this, format_text("the run_style is %s, allowed is verlet", update->integrate_style));
  FixScalarTransportEquation *equation = modify->find_fix_scalar_transport_equation("heattransfer");
  if (!equation) fix_failed(lmp, this, "LIGGGHTS' fix transportequation/scalar for the temperature is missing");
  if (!heat_->capacity_table_ && !(equation->*Access::integrates())) /* with the table fix heat/gran/grain stops it */
    fix_failed(lmp, this,
               format_text("the integration of temperatures was stopped (fix_modify %s integrate stop): allowed is "
                           "'integrate start'",
                           equation->id));
}

/* ------------------------------------------------------------------------------------------------- network */
void FixHeatRest::freeze() {
  heat_->updatePtrs();
  heat_->find_walls();
  heat_->walls_found_ = true;
  spread(heat_->Temp);
  std::vector<GrainLink> links;
  std::vector<GrainBath> baths;
  collect_links(links);
  collect_baths(baths);
  grain_network_destroy(network_);
  network_ = NULL;
  fix_check(lmp, this,
            grain_network_create(atom->nlocal, atom->nghost, (int64_t)links.size(), links.data(), (int)baths.size(),
                                 baths.data(), &network_));
  set_properties();
  solution_ = GrainSolution();
  /* Every pair has two links, on one rank or on two. */
  double mine[2] = {0.5 * (double)links.size(), (double)contacts_.size()}, all[2];
  MPI_Allreduce(mine, all, 2, MPI_DOUBLE, MPI_SUM, world);
  pairs_ = all[0], walls_ = all[1];
  find_limit(false);
}

/* With a table a pair counts whatever its conductivities are now: they may be 0. */
void FixHeatRest::collect_links(std::vector<GrainLink> &links) {
  const NeighList *list = heat_->pair_gran->list;
  heat_->hidden_.assign(atom->nlocal, 0.0);
  for (int n = 0; n < list->inum; n++) {
    const int i = list->ilist[n];
    for (int k = 0; k < list->numneigh[i]; k++) {
      const int j = list->firstneigh[i][k] & NEIGHMASK;
      if (!(atom->mask[i] & atom->mask[j] & heat_->groupbit)) continue;
      GrainPair pair = heat_->pair_of(i, j);
      if (heat_->conductivity_table_) pair.conductivity[0] = pair.conductivity[1] = 1.0;
      const double h = grain_heat_conductance(&heat_->model_, &pair);
      const GrainView view = heat_->neighbours_ ? heat_->view_of(pair) : GrainView();
      heat_->hidden_[i] += view.share[0];
      if (j < atom->nlocal) heat_->hidden_[j] += view.share[1];
      if (!(h > 0.0 || view.area > 0.0)) continue;
      links.push_back({i, j, atom->tag[j], h, view.area});
      if (j < atom->nlocal) links.push_back({j, i, atom->tag[i], h, view.area});
    }
  }
}

/* Walls last, as contacts_. */
void FixHeatRest::collect_baths(std::vector<GrainBath> &baths) {
  const GrainSurface &surface = heat_->surface_;
  std::vector<GrainBath> walls;
  contacts_.clear();
  for (const WallContact &contact : heat_->walls_.find_contacts(heat_->find_wall_reach())) {
    if (!(atom->mask[contact.grain] & heat_->groupbit)) continue;
    const GrainView view = heat_->neighbours_ ? heat_->view_of_wall(contact) : GrainView();
    heat_->hidden_[contact.grain] += view.share[0];
    contacts_.push_back(contact);
    walls.push_back({contact.grain, GRAIN_BATH_WALL, heat_->find_wall_conductance(contact), view.area,
                     contact.temperature, 0.0});
  }
  for (int i = 0; i < atom->nlocal; i++) {
    if (!(atom->mask[i] & heat_->groupbit)) continue;
    const double area = 4.0 * M_PI * atom->radius[i] * atom->radius[i];
    if (heat_->convection_)
      baths.push_back({i, GRAIN_BATH_CONVECTION, surface.coefficient * area, 0.0, surface.fluid_temperature, 0.0});
    if (heat_->radiation_)
      baths.push_back({i, GRAIN_BATH_RADIATION, 0.0, surface.emissivity * area * fmax(1.0 - heat_->hidden_[i], 0.0),
                       surface.surroundings, 0.0});
  }
  baths.insert(baths.end(), walls.begin(), walls.end());
}

void FixHeatRest::set_properties() {
  const int types = (int)heat_->conductivity_.size() - 1;
  FixPropertyGlobal *specific = static_cast<FixPropertyGlobal *>(
      modify->find_fix_property("thermalCapacity", "property/global", "peratomtype", types, 0, style));
  network_->absolute_zero = heat_->surface_.absolute_zero;
  network_->varies = heat_->radiation_ || heat_->neighbours_ || has_tables();
  network_->change.context = this;
  if (has_tables())
    network_->change.renew = [](void *fix, GrainNetwork *, const double *) { static_cast<FixHeatRest *>(fix)->renew(); };
  if (heat_->capacity_table_)
    network_->change.warm = [](void *fix, int grain, double temperature, double heat) {
      return static_cast<FixHeatRest *>(fix)->warm(grain, temperature, heat);
    };
  for (int i = 0; i < atom->nlocal; i++) {
    const double c = specific->compute_vector(atom->type[i] - 1);
    network_->capacity[i] = (atom->mask[i] & heat_->groupbit) && c > SMALLEST_CAPACITY ? c * atom->rmass[i] : 0.0;
  }
}

/* Properties of the temperatures in heat_->Temp, which all of this fix's steps and iterations work on. */
void FixHeatRest::renew() {
  GrainNetwork *n = network_;
  for (int i = 0; i < n->grains; i++) {
    for (int k = n->first[i]; heat_->conductivity_table_ && k < n->first[i + 1]; k++) {
      const GrainPair pair = heat_->pair_of(i, n->other[k]);
      n->conduction[k] = grain_heat_conductance(&heat_->model_, &pair);
    }
    if (heat_->capacity_table_ && (atom->mask[i] & heat_->groupbit))
      n->capacity[i] = atom->rmass[i] * heat_->find_capacity(atom->type[i], heat_->Temp[i]);
  }
  for (size_t k = 0; k < contacts_.size(); k++)
    n->bath[n->baths - contacts_.size() + k].conduction = heat_->find_wall_conductance(contacts_[k]);
}

double FixHeatRest::warm(int grain, double temperature, double heat) const {
  const GrainTable table = heat_->make_table(heat_->capacity_rows_);
  return grain_table_heat(&table, atom->type[grain], temperature, heat / atom->rmass[grain]);
}

/* ---------------------------------------------------------------------------------------------------- steps */
void FixHeatRest::find_limit(bool check) {
  grain_network_refresh(network_, heat_->Temp);
  int grain, least_rank;
  struct {
    double step;
    int rank;
  } mine, least;
  mine.step = grain_network_time_step(network_, &grain), mine.rank = comm->me;
  MPI_Allreduce(&mine, &least, 1, MPI_DOUBLE_INT, MPI_MINLOC, world);
  limit_ = least.step, least_rank = least.rank;
  if (!check || update->dt <= limit_) return;
  int tag = grain < 0 ? 0 : atom->tag[grain];
  MPI_Bcast(&tag, 1, MPI_INT, least_rank, world);
  fix_failed(lmp, this,
             format_text("the time step (command timestep) is %g s; allowed with 'solver explicit' is a number <= %g, "
                         "the heat capacity of particle %d over the sum of its conductances; 'solver implicit' has no "
                         "limit",
                         update->dt, limit_, tag));
}

void FixHeatRest::begin() {
  heat_->updatePtrs();
  if (solver_ == EXPLICIT) find_limit(true);
}

void FixHeatRest::advance(bool is_shown) {
  heat_->updatePtrs();
  spread(heat_->Temp);
  if (solver_ != EXPLICIT) solve();
  else if (network_->varies) find_limit(true);
  GrainSum flows[GRAIN_BATH_KINDS];
  grain_network_flow(network_, heat_->Temp, heat_->heatFlux, flows);
  keep_flows(flows);
  if (is_shown) direct_flux();
  if (solver_ == EXPLICIT)
    grain_network_advance(network_, update->dt, heat_->heatFlux, heat_->heatSource, heat_->Temp);
}

void FixHeatRest::solve() {
  const GrainRanks all = ranks();
  const double step = solver_ == STEADY ? HUGE_VAL : update->dt;
  fix_check(lmp, this,
            grain_network_solve(network_, &all, step, tolerance_, MOST_ITERATIONS, heat_->heatSource, heat_->Temp,
                                &solution_));
}

void FixHeatRest::keep_flows(const GrainSum *flows) {
  const int to[] = {FixHeatGranGrain::CONVECTION, FixHeatGranGrain::RADIATION, FixHeatGranGrain::WALLS};
  for (DoubleSum &flow : heat_->flow_) flow = DoubleSum();
  for (int k = 0; k < GRAIN_BATH_KINDS; k++) heat_->flow_[to[k]] = {flows[k].high, flows[k].low};
}

void FixHeatRest::direct_flux() {
  const GrainNetwork *n = network_;
  const double *T = heat_->Temp;
  double **x = atom->x;
  for (int i = 0; i < n->grains; i++)
    for (int a = 0; a < 3; a++) {
      double sum = 0.0;
      for (int k = n->first[i]; k < n->first[i + 1]; k++)
        sum += 0.5 * n->conductance[k] * (T[n->other[k]] - T[i]) * (x[i][a] - x[n->other[k]][a]);
      heat_->directionalHeatFlux[i][a] = sum;
    }
}

/* -------------------------------------------------------------------------------------------------- ranks */
GrainRanks FixHeatRest::ranks() {
  GrainRanks all;
  all.context = this;
  all.spread = [](void *context, double *values) { static_cast<FixHeatRest *>(context)->spread(values); };
  all.sum = [](void *context, int count, GrainSum *sums) {
    const FixHeatRest *fix = static_cast<FixHeatRest *>(context);
    std::vector<GrainSum> parts((size_t)count * fix->comm->nprocs);
    const int bytes = count * (int)sizeof *sums;
    MPI_Allgather(sums, bytes, MPI_BYTE, parts.data(), bytes, MPI_BYTE, fix->world);
    for (int k = 0; k < count; k++) {
      DoubleSum total;
      for (size_t p = k; p < parts.size(); p += count) total.add({parts[p].high, parts[p].low});
      sums[k] = {total.high, total.low};
    }
  };
  return all;
}

void FixHeatRest::spread(double *values) {
  spread_ = values;
  comm->forward_comm_fix(this);
}

int FixHeatRest::pack_comm(int n, int *list, double *buffer, int, int *) {
  for (int k = 0; k < n; k++) buffer[k] = spread_[list[k]];
  return 1;
}

void FixHeatRest::unpack_comm(int n, int first, double *buffer) {
  for (int k = 0; k < n; k++) spread_[first + k] = buffer[k];
}

double FixHeatRest::compute_vector(int n) {
  const double values[6] = {limit_, pairs_, walls_, (double)solution_.iterations, solution_.residual,
                            (double)solution_.renewals};
  return values[n];
}
