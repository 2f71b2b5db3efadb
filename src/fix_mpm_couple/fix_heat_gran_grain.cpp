/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "fix_heat_gran_grain.h"

#include <cmath>
#include <cstring>

#include "atom.h"
#include "comm.h"
#include "conduction_keywords.h"
#include "fix_property_atom.h"
#include "force.h"
#include "keyword_parser.h"
#include "material_properties.h"
#include "modify.h"
#include "neigh_list.h"
#include "neighbor.h"
#include "pair_gran.h"
#include "properties.h"
#include "rank_error.h"
#include "update.h"

using namespace LAMMPS_NS;

/* What LIGGGHTS' base class reads of a command; the temperature is set afterwards, as all keywords are read in any
 * order. */
namespace {
struct BaseWords {
  char keyword[20] = "initial_temperature", value[2] = "0";
  char *words[5];
  explicit BaseWords(char **arg) : words{arg[0], arg[1], arg[2], keyword, value} {}
};
}  // namespace

FixHeatGranGrain::FixHeatGranGrain(LAMMPS *lammps, int narg, char **arg)
    : FixHeatGran(lammps, 5, BaseWords(arg).words),
      model_(grain_heat_default()),
      surface_{},
      friction_(false),
      walls_(lammps),
      walls_found_(false),
      reach_(0.0) {
  vector_flag = 1;
  size_vector = FLOWS;
  extvector = 1;
  std::vector<std::string> keywords = {"initial_temperature", "convection", "radiation", "absolute_zero", "friction"};
  keywords.insert(keywords.begin() + 1, CONDUCTION_KEYWORDS.begin(), CONDUCTION_KEYWORDS.end());
  KeywordParser parser(lmp, this, narg, arg, 3, keywords);
  read_model(parser);
  parser.require("initial_temperature", "initial_temperature T");
  parser.require("direct", "direct none|batchelor|liggghts|pipe|collisional");
  check_conduction(parser, model_);
  convection_ = parser.given("convection"), radiation_ = parser.given("radiation");
  check_radiation(parser);
  const bool conducts = model_.direct != GRAIN_DIRECT_NONE || model_.indirect != GRAIN_INDIRECT_NONE;
  if ((conducts || !(convection_ || radiation_ || friction_)) && grain_heat_check(&model_) != BASE_OK)
    parser.fail(base_error_message());
  force_reneighbor = model_.indirect != GRAIN_INDIRECT_NONE;
  next_reneighbor = -1;
}

void FixHeatGranGrain::read_model(KeywordParser &parser) {
  while (parser.next()) {
    if (parser.is("initial_temperature")) T0 = parser.number(NumberRange::any());
    else if (read_conduction(parser, model_, true)) continue;
    else if (parser.is("convection")) {
      surface_.coefficient = parser.number(NumberRange::at_least(0.0));
      surface_.fluid_temperature = parser.number(NumberRange::any());
    } else if (parser.is("radiation")) {
      surface_.emissivity = parser.number(NumberRange::between(0.0, 1.0));
      surface_.surroundings = parser.number(NumberRange::any());
    } else if (parser.is("absolute_zero")) surface_.absolute_zero = parser.number(NumberRange::any());
    else if (parser.is("friction")) friction_ = parser.yes_no();
  }
}

/* Fourth powers mean nothing but on an absolute scale. */
void FixHeatGranGrain::check_radiation(const KeywordParser &parser) const {
  if (!radiation_) {
    if (parser.given("absolute_zero")) parser.fail("keyword 'absolute_zero' has a meaning with 'radiation' only");
    return;
  }
  if (strcmp(update->unit_style, "si") != 0)
    parser.fail(std::string("keyword 'radiation' needs 'units si', not ") + update->unit_style);
  const struct {
    const char *keyword;
    double temperature;
  } checks[] = {{"radiation", surface_.surroundings}, {"initial_temperature", T0}};
  for (const auto &check : checks)
    if (check.temperature < surface_.absolute_zero)
      parser.fail(format_text("keyword '%s': the temperature is %g, allowed is a number >= %g; keyword 'absolute_zero' "
                              "names the absolute zero of another scale",
                              check.keyword, check.temperature, surface_.absolute_zero));
}

int FixHeatGranGrain::setmask() {
  const int neighbours = model_.indirect == GRAIN_INDIRECT_NONE ? 0 : FixConst::POST_INTEGRATE;
  return FixHeatGran::setmask() | FixConst::PRE_FORCE | FixConst::POST_FORCE | FixConst::PRE_FINAL_INTEGRATE |
         neighbours;
}

void FixHeatGranGrain::init() {
  if (modify->n_fixes_style("heat/gran") > 1)
    fix_failed(lmp, this, "there is another fix heat/gran or heat/gran/...: each contact would conduct twice");
  if (force->newton_pair) fix_failed(lmp, this, "'newton off' is needed");
  const int types = atom->get_properties()->max_type();
  conductivity_.assign(types + 1, 0.0);
  for (int type = 1; type <= types; type++) {
    const MaterialProperties properties(lmp, this, type);
    conductivity_[type] = properties.of_type("thermalConductivity", NumberRange::at_least(0.0));
    properties.of_type("thermalCapacity", NumberRange::at_least(0.0));
  }
  check_skin();
  FixHeatGran::init();
  init_history();
}

/* Of the group's grains and of those that fixes may yet insert. Material points, outside the group, have radii too. */
double FixHeatGranGrain::find_largest_radius() const {
  double mine = 0.0, all;
  for (int i = 0; i < atom->nlocal; i++)
    if (atom->mask[i] & groupbit) mine = fmax(mine, atom->radius[i]);
  for (int k = 0; k < modify->nfix; k++)
    for (int type = 1; type < (int)conductivity_.size(); type++)
      if (modify->fix[k]->use_rad_for_cut_neigh_and_ghost()) mine = fmax(mine, modify->fix[k]->max_rad(type));
  MPI_Allreduce(&mine, &all, 1, MPI_DOUBLE, MPI_MAX, world);
  return all;
}

/* The neighbour list holds pairs whose gap was below the skin when it was built. `neigh_modify contact_distance_factor`
 * would be another way to more distant pairs, but with it LIGGGHTS' walls of a given temperature take the root of a
 * negative contact area wherever there is a gap, and the temperatures become not-a-number. */
void FixHeatGranGrain::check_skin() {
  if (model_.indirect == GRAIN_INDIRECT_NONE) return;
  reach_ = grain_heat_reach(&model_, find_largest_radius());
  if (neighbor->skin <= reach_)
    fix_failed(
        lmp, this,
        format_text("the skin (command neighbor) is %g, but the indirect model reaches over gaps of %g: allowed is "
                    "a number > %g; the more, the more seldom lists are built",
                    neighbor->skin, reach_, reach_));
}

void FixHeatGranGrain::setup_pre_force(int) {
  keep_positions();
  walls_found_ = false;
}

void FixHeatGranGrain::initial_integrate(int vflag) {
  FixHeatGran::initial_integrate(vflag);
  if (!walls_found_) find_walls();
}

void FixHeatGranGrain::find_walls() {
  walls_.take_over(this);
  walls_found_ = true;
  if (model_.direct == GRAIN_DIRECT_NONE && !walls_.empty())
    fix_failed(lmp, this,
               "'direct none': a wall (fix wall/gran) has a temperature, but only a direct model conducts at walls; "
               "allowed are batchelor, liggghts and pipe");
}

void FixHeatGranGrain::keep_positions() {
  if (model_.indirect == GRAIN_INDIRECT_NONE) return;
  built_.resize(3 * (size_t)atom->nlocal);
  for (size_t k = 0; k < built_.size(); k++) built_[k] = atom->x[k / 3][k % 3];
}

void FixHeatGranGrain::pre_force(int) {
  if (neighbor->ago == 0) keep_positions();
}

/* LIGGGHTS builds the list anew when a grain has moved by half the skin, which is early enough for contacts. Pairs
 * with a gap up to the reach need it once a grain has moved by half of what the skin has beyond the reach. */
void FixHeatGranGrain::post_integrate() {
  const size_t count = 3 * (size_t)atom->nlocal;
  double largest = built_.size() == count ? 0.0 : HUGE_VAL, all;
  for (size_t k = 0; k + 2 < count && k + 2 < built_.size(); k += 3) {
    const double *x = atom->x[k / 3], move[3] = {x[0] - built_[k], x[1] - built_[k + 1], x[2] - built_[k + 2]};
    largest = fmax(largest, move[0] * move[0] + move[1] * move[1] + move[2] * move[2]);
  }
  MPI_Allreduce(&largest, &all, 1, MPI_DOUBLE, MPI_MAX, world);
  if (2.0 * sqrt(all) > neighbor->skin - reach_) next_reneighbor = update->ntimestep;
}

/* Pairs that cross a boundary between ranks are seen by both: each takes its own grain's part, of the same bits. */
void FixHeatGranGrain::exchange(int i, int j, double *record) {
  double **x = atom->x;
  const double branch[3] = {x[i][0] - x[j][0], x[i][1] - x[j][1], x[i][2] - x[j][2]};
  const int *type = atom->type;
  const GrainPair pair = {{atom->radius[i], atom->radius[j]},
                          {conductivity_[type[i]], conductivity_[type[j]]},
                          sqrt(branch[0] * branch[0] + branch[1] * branch[1] + branch[2] * branch[2])};
  const double conductance = record ? collide(i, j, pair, record) : grain_heat_conductance(&model_, &pair);
  if (conductance == 0.0) return;
  const double flow = (Temp[j] - Temp[i]) * conductance;
  heatFlux[i] += flow;
  if (j < atom->nlocal) heatFlux[j] -= flow;
  for (int a = 0; a < 3; a++) {
    directionalHeatFlux[i][a] += 0.5 * flow * branch[a];
    if (j < atom->nlocal) directionalHeatFlux[j][a] += 0.5 * flow * branch[a];
  }
}

void FixHeatGranGrain::exchange_with_surroundings() {
  for (int i = 0; i < atom->nlocal; i++) {
    if (!(atom->mask[i] & groupbit)) continue;
    double flows[FLOWS] = {};
    if (convection_) flows[CONVECTION] = grain_convection(&surface_, atom->radius[i], Temp[i]);
    if (radiation_) flows[RADIATION] = grain_radiation(&surface_, atom->radius[i], Temp[i]);
    for (int k = 0; k < FLOWS; k++) heatFlux[i] += flows[k], flow_[k].add(flows[k]);
  }
}

double FixHeatGranGrain::compute_vector(int n) {
  std::vector<DoubleSum> parts(comm->nprocs);
  MPI_Allgather(&flow_[n], sizeof flow_[n], MPI_BYTE, parts.data(), sizeof flow_[n], MPI_BYTE, world);
  DoubleSum sum;
  for (const DoubleSum &part : parts) sum.add(part);
  return sum.value();
}

void FixHeatGranGrain::post_force(int) {
  updatePtrs();
  for (DoubleSum &flow : flow_) flow = DoubleSum();
  if (convection_ || radiation_) exchange_with_surroundings();
  if (friction_) heat_by_friction();
  const NeighList *list = pair_gran->list;
  const int impact = collides() ? pair_gran->fix_extra_dnum_index(this) + (friction_ ? 3 : 0) : 0;
  for (int n = 0; n < list->inum; n++) {
    const int i = list->ilist[n];
    for (int k = 0; k < list->numneigh[i]; k++) {
      const int j = list->firstneigh[i][k] & NEIGHMASK;
      double *record = NULL;
      if (collides()) record = list->listgranhistory->firstdouble[i] + (size_t)pair_gran->dnum() * k + impact;
      if (atom->mask[i] & atom->mask[j] & groupbit) exchange(i, j, record);
    }
  }
}

/* Here and not in post_force(): walls may come after this fix. */
void FixHeatGranGrain::pre_final_integrate() {
  updatePtrs();
  for (const WallContact &contact : walls_.find_contacts()) {
    const int i = contact.grain;
    if (!(atom->mask[i] & groupbit)) continue;
    const double k[2] = {conductivity_[atom->type[i]], conductivity_[contact.type]};
    const double h = grain_heat_wall_conductance(&model_, atom->radius[i], k, contact.distance);
    const double flow = h * (contact.temperature - Temp[i]);
    heatFlux[i] += flow;
    flow_[WALLS].add(flow);
  }
}
