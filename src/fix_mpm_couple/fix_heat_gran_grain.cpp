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
      convection_(false),
      radiation_(false),
      neighbours_(false),
      friction_(false),
      correction_(false),
      damping_(NO_DAMPING),
      conductivity_table_(false),
      capacity_table_(false),
      walls_(lammps),
      walls_found_(false),
      law_(HOOKE_STIFFNESS),
      bonds_(NULL),
      reach_(0.0) {
  vector_flag = 1;
  size_vector = FLOWS;
  extvector = 1;
  std::vector<std::string> keywords = {"initial_temperature", "area_correction", "convection", "radiation",
                                       "absolute_zero", "conductivity", "capacity", "friction", "damping"};
  keywords.insert(keywords.begin() + 1, CONDUCTION_KEYWORDS.begin(), CONDUCTION_KEYWORDS.end());
  KeywordParser parser(lmp, this, narg, arg, 3, keywords);
  read_model(parser);
  parser.require("initial_temperature", "initial_temperature T");
  parser.require("direct", "direct none|batchelor|liggghts|pipe|collisional");
  check_keywords(parser);
  check_radiation(parser);
  const bool conducts = model_.direct != GRAIN_DIRECT_NONE || model_.indirect != GRAIN_INDIRECT_NONE;
  if ((conducts || !(convection_ || radiation_ || neighbours_ || friction_)) && grain_heat_check(&model_) != BASE_OK)
    parser.fail(base_error_message());
  force_reneighbor = reaches();
  next_reneighbor = -1;
}

void FixHeatGranGrain::read_model(KeywordParser &parser) {
  while (parser.next()) {
    if (parser.is("initial_temperature")) T0 = parser.number(NumberRange::any());
    else if (parser.is("area_correction")) correction_ = parser.yes_no();
    else if (read_conduction(parser, model_, true)) continue;
    else if (parser.is("convection")) {
      convection_ = true;
      surface_.coefficient = parser.number(NumberRange::at_least(0.0));
      surface_.fluid_temperature = parser.number(NumberRange::any());
    } else if (parser.is("radiation")) {
      surface_.emissivity = parser.number(NumberRange::between(0.0, 1.0));
      radiation_ = !parser.accept("none");
      if (radiation_) surface_.surroundings = parser.number(NumberRange::any());
      neighbours_ = parser.accept("neighbours");
      if (!radiation_ && !neighbours_) parser.refuse("none", "a temperature, or 'none neighbours'");
    } else if (parser.is("absolute_zero")) surface_.absolute_zero = parser.number(NumberRange::any());
    else if (parser.is("conductivity")) conductivity_table_ = parser.choice({"constant", "table"}) == 1;
    else if (parser.is("capacity")) capacity_table_ = parser.choice({"constant", "table"}) == 1;
    else if (parser.is("friction")) friction_ = parser.yes_no();
    else if (parser.is("damping")) damping_ = (Damping)parser.choice({"no", "yes", "normal"});
  }
}

/* Fourth powers mean nothing but on an absolute scale. */
void FixHeatGranGrain::check_radiation(const KeywordParser &parser) const {
  if (!parser.given("radiation")) {
    if (parser.given("absolute_zero")) parser.fail("keyword 'absolute_zero' has a meaning with 'radiation' only");
    return;
  }
  if (strcmp(update->unit_style, "si") != 0)
    parser.fail(std::string("keyword 'radiation' needs 'units si', not ") + update->unit_style);
  const struct {
    const char *keyword;
    double temperature;
  } checks[] = {{"radiation", radiation_ ? surface_.surroundings : T0}, {"initial_temperature", T0}};
  for (const auto &check : checks)
    if (check.temperature < surface_.absolute_zero)
      parser.fail(format_text("keyword '%s': the temperature is %g, allowed is a number >= %g; keyword 'absolute_zero' "
                              "names the absolute zero of another scale",
                              check.keyword, check.temperature, surface_.absolute_zero));
}

/* A keyword that the model does not use is a mistake in the script. */
void FixHeatGranGrain::check_keywords(const KeywordParser &parser) const {
  check_conduction(parser, model_, neighbours_);
  const bool conducts = model_.direct != GRAIN_DIRECT_NONE || model_.indirect != GRAIN_INDIRECT_NONE;
  if (parser.given("area_correction") && !conducts)
    parser.fail("keyword 'area_correction' has a meaning with a direct or an indirect model only");
  if (counts_damping() && !friction_) parser.fail("keyword 'damping' has a meaning with 'friction yes' only");
}

int FixHeatGranGrain::setmask() {
  const int neighbours = reaches() ? FixConst::POST_INTEGRATE : 0;
  const int integrate = capacity_table_ ? FixConst::FINAL_INTEGRATE : 0;
  return FixHeatGran::setmask() | FixConst::PRE_FORCE | FixConst::POST_FORCE | FixConst::PRE_FINAL_INTEGRATE |
         neighbours | integrate;
}

void FixHeatGranGrain::init() {
  if (modify->n_fixes_style("heat/gran") > 1)
    fix_failed(lmp, this, "there is another fix heat/gran or heat/gran/...: each contact would conduct twice");
  if (force->newton_pair) fix_failed(lmp, this, "'newton off' is needed");
  init_conductivity();
  check_skin();
  FixHeatGran::init();
  init_capacity();
  init_area_correction();
  init_history();
}

/* As in LIGGGHTS' fix heat/gran/conduction: at the same force the overlap goes as E*^(-1/exponent), force ~ E*
 * overlap^exponent. */
void FixHeatGranGrain::init_area_correction() {
  if (!correction_) return;
  const size_t types = conductivity_.size();
  std::vector<double> soft(types, 0.0), real(types, 0.0); /* (1 - nu^2) / E */
  for (int type = 1; type < (int)types; type++) {
    const MaterialProperties properties(lmp, this, type);
    const double ratio = properties.of_type("poissonsRatio", NumberRange::from_below(0.0, 1.0));
    soft[type] = (1.0 - ratio * ratio) / properties.of_type("youngsModulus", NumberRange::positive());
    real[type] = (1.0 - ratio * ratio) / properties.of_type("youngsModulusOriginal", NumberRange::positive());
  }
  overlap_ratio_.assign(types * types, 1.0);
  for (size_t a = 1; a < types; a++)
    for (size_t b = 1; b < types; b++)
      overlap_ratio_[a * types + b] =
          pow((real[a] + real[b]) / (soft[a] + soft[b]), 1.0 / pair_gran->stressStrainExponent());
}

/* Distance of the centres, or of a centre from a wall (sum: its radius), with the overlap of the real stiffness. */
double FixHeatGranGrain::find_real_distance(double distance, double sum, int type, int other) const {
  if (!correction_ || distance >= sum) return distance;
  return sum - (sum - distance) * overlap_ratio_[type * conductivity_.size() + other];
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
  if (!reaches()) return;
  const double radius = find_largest_radius();
  reach_ = fmax(grain_heat_reach(&model_, radius), neighbours_ ? model_.reach * radius : 0.0);
  if (neighbor->skin <= reach_)
    fix_failed(
        lmp, this,
        format_text("the skin (command neighbor) is %g, but the indirect model or radiation reaches over gaps of %g: "
                    "allowed is a number > %g; the more, the more seldom lists are built",
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

/* In radii of the grain. At radiation the face lies in the wall: the grain's mirror image is a neighbour. */
double FixHeatGranGrain::find_wall_reach() const {
  return fmax(grain_heat_wall_reach(&model_), neighbours_ ? 0.5 * model_.reach : 0.0);
}

/* LIGGGHTS' lists of a mesh hold what was nearer than half the skin when they were built. */
void FixHeatGranGrain::find_walls() {
  walls_.take_over(this);
  walls_found_ = true;
  if (friction_) walls_.check_springs(this, LAW_NAMES[law_]);
  if (walls_.empty()) return;
  if (model_.direct == GRAIN_DIRECT_NONE && !reaches())
    fix_failed(lmp, this,
               "'direct none': a wall (fix wall/gran) has a temperature, but only a direct or an indirect model "
               "conducts at walls; allowed are batchelor, liggghts and pipe, or an indirect model");
  const double reach = walls_.has_mesh() ? 2.0 * find_wall_reach() * find_largest_radius() : 0.0;
  if (neighbor->skin <= reach)
    fix_failed(lmp, this,
               format_text("the skin (command neighbor) is %g, but the indirect model or radiation reaches over gaps "
                           "of %g at a mesh with a temperature: allowed is a number > twice that, %g",
                           neighbor->skin, 0.5 * reach, reach));
  reach_ = fmax(reach_, reach);
}

void FixHeatGranGrain::keep_positions() {
  if (!reaches()) return;
  built_.resize(4 * (size_t)atom->nlocal);
  for (size_t k = 0; k < built_.size(); k++) built_[k] = k % 4 < 3 ? atom->x[k / 4][k % 4] : atom->radius[k / 4];
}

void FixHeatGranGrain::pre_force(int) {
  if (neighbor->ago == 0) keep_positions();
}

/* LIGGGHTS builds the list anew when a grain has moved (or grown) by half the skin, which is early enough for contacts.
 * Pairs with a gap up to the reach need it once a grain has moved by half of what the skin has beyond the reach. */
void FixHeatGranGrain::post_integrate() {
  const size_t count = 4 * (size_t)atom->nlocal;
  double largest = built_.size() == count ? 0.0 : HUGE_VAL, all;
  for (size_t k = 0; k + 3 < count && k + 3 < built_.size(); k += 4) {
    const double *x = atom->x[k / 4], move[3] = {x[0] - built_[k], x[1] - built_[k + 1], x[2] - built_[k + 2]};
    const double growth = atom->radius[k / 4] - built_[k + 3];
    largest = fmax(largest, sqrt(move[0] * move[0] + move[1] * move[1] + move[2] * move[2]) + growth);
  }
  MPI_Allreduce(&largest, &all, 1, MPI_DOUBLE, MPI_MAX, world);
  if (2.0 * all > neighbor->skin - reach_) next_reneighbor = update->ntimestep;
}

GrainPair FixHeatGranGrain::pair_of(int i, int j) const {
  double **x = atom->x;
  const double branch[3] = {x[i][0] - x[j][0], x[i][1] - x[j][1], x[i][2] - x[j][2]};
  const int *type = atom->type;
  const double distance = sqrt(branch[0] * branch[0] + branch[1] * branch[1] + branch[2] * branch[2]);
  return {{atom->radius[i], atom->radius[j]},
          {find_conductivity(type[i], Temp[i]), find_conductivity(type[j], Temp[j])},
          find_real_distance(distance, atom->radius[i] + atom->radius[j], type[i], type[j])};
}

/* Pairs that cross a boundary between ranks are seen by both: each takes its own grain's part, of the same bits. */
void FixHeatGranGrain::exchange(int i, int j, double *record) {
  double **x = atom->x;
  const double branch[3] = {x[i][0] - x[j][0], x[i][1] - x[j][1], x[i][2] - x[j][2]};
  const GrainPair pair = pair_of(i, j);
  const double conductance = record ? collide(i, j, pair, record) : grain_heat_conductance(&model_, &pair);
  const double flow = (Temp[j] - Temp[i]) * conductance + (neighbours_ ? radiate(i, j, pair) : 0.0);
  if (flow == 0.0) return;
  heatFlux[i] += flow;
  if (j < atom->nlocal) heatFlux[j] -= flow;
  for (int a = 0; a < 3; a++) {
    directionalHeatFlux[i][a] += 0.5 * flow * branch[a];
    if (j < atom->nlocal) directionalHeatFlux[j][a] += 0.5 * flow * branch[a];
  }
}

/* Nothing if they are too far apart to be neighbours. */
GrainView FixHeatGranGrain::view_of(const GrainPair &pair) const {
  const double sum = pair.radius[0] + pair.radius[1];
  if (pair.distance - sum >= 0.5 * model_.reach * sum) return {};
  return grain_view(&pair, grain_face_radius(&pair, model_.porosity), surface_.emissivity);
}

GrainView FixHeatGranGrain::view_of_wall(const WallContact &contact) const {
  const int i = contact.grain;
  const double radius = atom->radius[i];
  const double distance = find_real_distance(contact.distance, radius, atom->type[i], contact.type);
  if (!contact.in_sight || distance - radius >= 0.5 * model_.reach * radius) return {};
  const GrainPair mirror = {{radius, radius}, {}, 2.0 * distance};
  return grain_view_wall(radius, distance, grain_face_radius(&mirror, model_.porosity), surface_.emissivity);
}

double FixHeatGranGrain::radiate(int i, int j, const GrainPair &pair) {
  const GrainView view = view_of(pair);
  hidden_[i] += view.share[0];
  if (j < atom->nlocal) hidden_[j] += view.share[1];
  const double temperature[2] = {Temp[i], Temp[j]};
  return grain_radiation_between(view.area, temperature, surface_.absolute_zero);
}

double FixHeatGranGrain::radiate_to_wall(const WallContact &contact) {
  const GrainView view = view_of_wall(contact);
  hidden_[contact.grain] += view.share[0];
  const double temperature[2] = {Temp[contact.grain], contact.temperature};
  return grain_radiation_between(view.area, temperature, surface_.absolute_zero);
}

void FixHeatGranGrain::exchange_with_surroundings() {
  for (int i = 0; i < atom->nlocal; i++) {
    if (!(atom->mask[i] & groupbit)) continue;
    double flows[FLOWS] = {};
    if (convection_) flows[CONVECTION] = grain_convection(&surface_, atom->radius[i], Temp[i]);
    if (radiation_) flows[RADIATION] = grain_radiation(&surface_, atom->radius[i], Temp[i]);
    if (radiation_ && neighbours_) flows[RADIATION] *= fmax(1.0 - hidden_[i], 0.0);
    for (int k = 0; k < FLOWS; k++) heatFlux[i] += flows[k], flow_[k].add(flows[k]);
  }
}

double FixHeatGranGrain::add_up(const DoubleSum &mine) const {
  std::vector<DoubleSum> parts(comm->nprocs);
  MPI_Allgather(&mine, sizeof mine, MPI_BYTE, parts.data(), sizeof mine, MPI_BYTE, world);
  DoubleSum sum;
  for (const DoubleSum &part : parts) sum.add(part);
  return sum.value();
}

double FixHeatGranGrain::compute_vector(int n) { return add_up(flow_[n]); }

void FixHeatGranGrain::post_force(int) {
  updatePtrs();
  for (DoubleSum &flow : flow_) flow = DoubleSum();
  if (neighbours_) hidden_.assign(atom->nlocal, 0.0);
  if (friction_) heat_by_friction();
  const NeighList *list = pair_gran->list;
  const int impact = collides() ? pair_gran->fix_extra_dnum_index(this) + (friction_ ? 4 : 0) : 0;
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

double FixHeatGranGrain::find_wall_conductance(const WallContact &contact) const {
  const int type = atom->type[contact.grain];
  const double radius = atom->radius[contact.grain];
  const double k[2] = {find_conductivity(type, Temp[contact.grain]),
                       find_conductivity(contact.type, contact.temperature)};
  const double distance = find_real_distance(contact.distance, radius, type, contact.type);
  const double direct = contact.touches ? grain_heat_wall_conductance(&model_, radius, k, distance) : 0.0;
  return contact.in_sight ? direct + grain_heat_wall_indirect(&model_, radius, k[0], distance) : direct;
}

/* Here and not in post_force(): walls may come after this fix. */
void FixHeatGranGrain::pre_final_integrate() {
  updatePtrs();
  for (const WallContact &contact : walls_.find_contacts(find_wall_reach())) {
    const int i = contact.grain;
    if (!(atom->mask[i] & groupbit)) continue;
    double flow = find_wall_conductance(contact) * (contact.temperature - Temp[i]);
    if (neighbours_) flow += radiate_to_wall(contact);
    heatFlux[i] += flow;
    flow_[WALLS].add(flow);
  }
  if (friction_) rub_walls();
  if (convection_ || radiation_) exchange_with_surroundings();
}
