/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "fix_bond_gran_thermal.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "atom.h"
#include "comm.h"
#include "domain.h"
#include "fix_heat_gran_grain.h"
#include "fix_property_atom.h"
#include "force.h"
#include "keyword_parser.h"
#include "material_properties.h"
#include "memory.h"
#include "modify.h"
#include "neigh_list.h"
#include "neighbor.h"
#include "pair_gran.h"
#include "properties.h"
#include "rank_error.h"
#include "update.h"

using namespace LAMMPS_NS;

FixBondGranThermal::FixBondGranThermal(LAMMPS *lammps, int narg, char **arg)
    : Fix(lammps, narg, arg),
      law_{0.0, 0.0, HUGE_VAL, 0.0},
      gap_(0.0),
      install_pending_(false),
      pair_(NULL),
      count_{},
      temperature_(NULL),
      heat_(NULL),
      round_(0),
      grown_(0),
      types_(0) {
  scalar_flag = vector_flag = peratom_flag = 1;
  size_vector = COUNTS;
  global_freq = peratom_freq = 1;
  extvector = 1;
  size_peratom_cols = 0;
  restart_global = restart_peratom = 1;
  create_attribute = 1;
  just_created = 0; /* or LIGGGHTS would clear all bonds in the setup in which they are made */
  virial_flag = 1;
  comm_forward = WORDS;
  vector_atom = NULL;
  KeywordParser parser(lmp, this, narg, arg, 3, {"strength", "shear_ratio", "melting", "reference", "gap"});
  while (parser.next()) {
    if (parser.is("strength")) law_.strength = parser.number(NumberRange::positive());
    else if (parser.is("shear_ratio")) law_.shear_ratio = parser.number(NumberRange::positive());
    else if (parser.is("melting")) law_.melting = parser.accept("none") ? HUGE_VAL : parser.number(NumberRange::any());
    else if (parser.is("reference")) law_.reference = parser.number(NumberRange::any());
    else if (parser.is("gap")) gap_ = parser.number(NumberRange::at_least(0.0));
  }
  parser.require("strength", "strength B, of a bond over kn (Ri + Rj)/2");
  parser.require("shear_ratio", "shear_ratio M, shear over tensile strength");
  parser.require("melting", "melting TS|none, the temperature without strength");
  if (!std::isinf(law_.melting)) {
    parser.require("reference", "reference T0, the temperature of the full strength of melting bonds");
    if (law_.melting <= law_.reference)
      parser.fail(format_text("keyword 'melting': %g is given, allowed is a number > %g (keyword 'reference') or none",
                              law_.melting, law_.reference));
  }
  if (!atom->radius_flag) parser.fail("atoms without radius; 'atom_style granular' is needed");
  grow_arrays(atom->nmax);
  atom->add_callback(0);
  atom->add_callback(1);
}

FixBondGranThermal::~FixBondGranThermal() {
  atom->delete_callback(id, 0);
  atom->delete_callback(id, 1);
  memory->destroy(vector_atom);
}

int FixBondGranThermal::setmask() { return FixConst::PRE_FORCE; }

int FixBondGranThermal::modify_param(int narg, char **arg) {
  KeywordParser parser(lmp, this, narg, arg, 0, {"bonds"});
  while (parser.next()) {
    parser.choice({"install"});
    install_pending_ = true;
  }
  return narg;
}

/* ------------------------------------------------------------------------------------------------ start of a run */

void FixBondGranThermal::init() {
  pair_ = static_cast<PairGran *>(force->pair_match("gran", 0));
  if (!pair_) fix_failed(lmp, this, "'pair_style gran' is needed");
  if (force->newton_pair) fix_failed(lmp, this, "'newton off' is needed");
  if (atom->map_style == 0) fix_failed(lmp, this, "'atom_modify map array' is needed");
  if (strstr(update->integrate_style, "verlet") != update->integrate_style)
    fix_failed(lmp, this, std::string("'run_style verlet' is needed, not ") + update->integrate_style);
  heat_ = NULL;
  for (int k = 0; k < modify->nfix; k++) {
    if (modify->fix[k] != this && strcmp(modify->fix[k]->style, style) == 0)
      fix_failed(lmp, this,
                 std::string("there is another one (id ") + modify->fix[k]->id +
                     "); different strengths are not provided for");
    if (FixHeatGranGrain *heat = dynamic_cast<FixHeatGranGrain *>(modify->fix[k])) heat_ = heat;
  }
  read_springs();
  find_temperature();
}

void FixBondGranThermal::read_springs() {
  const bool hooke = pair_->contact_match("normal", "hooke/stiffness");
  const bool history = pair_->contact_match("tangential", "history");
  if (!hooke && !pair_->contact_match("normal", "hertz"))
    fix_failed(lmp, this, "the model of pair_style gran is another one; allowed is hooke/stiffness or hertz");
  /* The spring comes first in the history if nothing else of the pair style is in it. */
  if (history ? pair_->dnum_pair() != 3 : !pair_->contact_match("tangential", "off") || pair_->dnum_pair() != 0)
    fix_failed(lmp, this,
               "allowed is pair_style gran with 'tangential history' or 'off', without models that have a history of "
               "their own (rolling_friction epsd..., cohesion with liquid)");
  const int count = types_ = atom->get_properties()->max_type() + 1;
  const NumberRange any = NumberRange::at_least(0.0);
  springs_.assign(count * count, PairSprings{});
  for (int a = 1; a < count; a++)
    for (int b = 1; b < count; b++) {
      const MaterialProperties properties(lmp, this, a);
      PairSprings &springs = springs_[a * count + b];
      springs.normal = properties.of_pair("kn", NumberRange::positive(), b) / force->nktv2p;
      if (history) springs.tangential = properties.of_pair("kt", any, b) / force->nktv2p;
      if (hooke) springs.gamman = properties.of_pair("gamman", any, b);
      if (hooke && history) springs.gammat = properties.of_pair("gammat", any, b);
    }
}

void FixBondGranThermal::find_temperature() {
  temperature_ = NULL;
  if (std::isinf(law_.melting)) return;
  temperature_ =
      static_cast<FixPropertyAtom *>(modify->find_fix_property("Temp", "property/atom", "scalar", 0, 0, style, false));
  if (!temperature_ || temperature_->comm_forward == 0)
    fix_failed(lmp, this,
               "bonds melt, but grains (and their copies on other ranks) have no temperature: a fix heat/gran/... is "
               "needed, 'fix ID all property/atom Temp scalar yes yes no T', or 'melting none'");
}

void FixBondGranThermal::setup_pre_force(int vflag) { pre_force(vflag); }

/* --------------------------------------------------------------------------------------------------------- a step */

/* Springs and ends first, on all ranks, then forces: both grains of a bond must see it end in the same step. A setup
 * takes the forces of the step before again: nothing moves on and nothing ends. */
void FixBondGranThermal::pre_force(int vflag) {
  const double step = update->setupflag ? 0.0 : update->dt;
  if (neighbor->ago == 0) {
    if (temperature_) temperature_->do_forward_comm();
    find_images();
    if (install_pending_) install();
    find_contacts();
  }
  if (vflag) v_setup(vflag);
  else evflag = 0;
  for (int i = 0; i < atom->nlocal; i++) advance(i, step);
  if (step > 0.0) {
    tell_partners();
    for (int i = 0; i < atom->nlocal; i++) end_bonds(i);
  }
  count_[BONDS_INTACT] = count_[ENERGY] = 0.0;
  for (int i = 0; i < atom->nlocal; i++) {
    for (Bond &bond : bonds_[i]) hold(i, bond, step);
    vector_atom[i] = (double)bonds_[i].size();
  }
}

GrainMotion FixBondGranThermal::motion_of(int i, int j) const {
  GrainMotion motion;
  const int grain[2] = {i, j};
  for (int g = 0; g < 2; g++) {
    motion.radius[g] = atom->radius[grain[g]];
    for (int a = 0; a < 3; a++) {
      motion.velocity[g][a] = atom->v[grain[g]][a];
      motion.spin[g][a] = atom->omega[grain[g]][a];
    }
  }
  for (int a = 0; a < 3; a++) motion.branch[a] = atom->x[i][a] - atom->x[j][a];
  return motion;
}

/* As the pair style has it. */
double FixBondGranThermal::effective_mass(int i, int j) const {
  double mass[2] = {atom->rmass[i], atom->rmass[j]};
  if (pair_->fr_pair()) {
    const double *body = pair_->mr_pair();
    if (body[i] > 0.0) mass[0] = body[i];
    if (body[j] > 0.0) mass[1] = body[j];
  }
  double effective = mass[0] * mass[1] / (mass[0] + mass[1]);
  if (atom->mask[i] & pair_->freeze_group_bit()) effective = mass[1];
  if (atom->mask[j] & pair_->freeze_group_bit()) effective = mass[0];
  return effective;
}

void FixBondGranThermal::find_springs(int i, Bond &bond) const {
  const PairSprings &springs = springs_[atom->type[i] * types_ + atom->type[bond.other]];
  const double mass = effective_mass(i, bond.other);
  bond.springs = {springs.normal, springs.tangential, springs.gamman * mass, springs.gammat * mass};
}

void FixBondGranThermal::advance(int i, double step) {
  for (Bond &bond : bonds_[i]) {
    find_springs(i, bond);
    const GrainMotion motion = motion_of(i, bond.other);
    const double *all = temperature_ ? temperature_->vector_atom : NULL;
    const double temperature = all ? 0.5 * (all[i] + all[bond.other]) : law_.reference;
    bond.news = grain_bond_advance(&law_, &bond.springs, &motion, &bond.bond, temperature, step, &bond.state);
  }
}

/* The contact goes on with the bond's tangential spring of the step before: the pair style is about to take this one. */
void FixBondGranThermal::end_bond(Bond &bond) {
  const bool handed = shared(bond) && bond.history;
  if (bond.history)
    for (int a = 0; a < 3; a++) bond.history[a] = handed ? bond.sign * bond.bond.spring[a] : 0.0;
  if (handed && heat_) heat_->start_slip(bond.history);
  GrainBondSprings springs = bond.springs;
  if (handed) springs.tangential = 0.0;
  count_[PULLED + bond.news - GRAIN_BOND_PULLED] += 0.5;
  count_[RELEASED] += 0.5 * grain_bond_energy(&springs, &bond.bond, &bond.state, shared(bond));
}

void FixBondGranThermal::end_bonds(int i) {
  std::vector<Bond> &bonds = bonds_[i];
  for (Bond &bond : bonds)
    if (bond.news != NONE) end_bond(bond);
  bonds.erase(std::remove_if(bonds.begin(), bonds.end(), [](const Bond &bond) { return bond.news != NONE; }),
              bonds.end());
}

/* Those of the pair style where the grains touch, else the bond's own. This grain's half. */
void FixBondGranThermal::heat_by_dashpots(int i, const Bond &bond, double step) const {
  GrainBondSprings springs = bond.springs;
  if (shared(bond)) heat_->find_dashpots(i, bond.other, bond.state.overlap, &springs);
  heat_->keep_damping(i, bond.other,
                      0.5 * grain_bond_damping_work(&springs, &bond.state, effective_mass(i, bond.other), step));
}

bool FixBondGranThermal::holds(int i, int j) const {
  for (const Bond &bond : bonds_[i])
    if (bond.partner == atom->tag[j]) return true;
  return false;
}

/* The pair style adds the step's slip to its spring: from this value it comes to zero, and never to Coulomb's limit. */
void FixBondGranThermal::hold(int i, Bond &bond, double step) {
  double push[3], turn[3];
  grain_bond_force(&bond.springs, &bond.bond, &bond.state, shared(bond), push, turn);
  for (int a = 0; a < 3; a++) {
    bond.bond.spring[a] = bond.state.spring[a];
    atom->f[i][a] += push[a];
    atom->torque[i][a] += turn[a];
    if (bond.history) bond.history[a] = shared(bond) ? -bond.sign * bond.state.velocity[a] * step : 0.0;
  }
  if (heat_ && heat_->counts_damping() && step > 0.0) heat_by_dashpots(i, bond, step);
  count_[BONDS_INTACT] += 0.5;
  count_[ENERGY] += 0.5 * grain_bond_energy(&bond.springs, &bond.bond, &bond.state, shared(bond));
  if (!evflag) return;
  double d[3];
  for (int a = 0; a < 3; a++) d[a] = atom->x[i][a] - atom->x[bond.other][a];
  double virial_of_pair[6] = {d[0] * push[0], d[1] * push[1], d[2] * push[2],
                              d[0] * push[1], d[0] * push[2], d[1] * push[2]};
  v_tally(1, &i, 2.0, virial_of_pair);
}

/* ------------------------------------------------------------------------------------------------ neighbour list */

FixBondGranThermal::Bond *FixBondGranThermal::find_bond(int i, int partner) {
  for (Bond &bond : bonds_[i])
    if (bond.partner == partner) return &bond;
  return NULL;
}

FixBondGranThermal::Bond *FixBondGranThermal::add_bond(int i, int j) {
  Bond bond = {};
  bond.partner = atom->tag[j];
  bond.other = j;
  bond.news = MADE;
  const GrainMotion motion = motion_of(i, j);
  const double *d = motion.branch, distance = sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
  bond.bond.gap = std::max(0.0, distance - motion.radius[0] - motion.radius[1]);
  bonds_[i].push_back(bond);
  return &bonds_[i].back();
}

void FixBondGranThermal::find_images() {
  int missing = 0, all;
  for (int i = 0; i < atom->nlocal; i++)
    for (Bond &bond : bonds_[i]) {
      bond.other = domain->closest_image(i, atom->map(bond.partner));
      bond.listed = false, bond.history = NULL, bond.news = NONE;
      missing += bond.other < 0;
    }
  MPI_Allreduce(&missing, &all, 1, MPI_INT, MPI_SUM, world);
  if (all > 0) forget_removed(missing);
}

/* `missing` partners are not seen by this rank. Bonds with grains that are nowhere any more go with them. */
void FixBondGranThermal::forget_removed(int missing) {
  std::vector<int> mine, counts(comm->nprocs), starts(comm->nprocs + 1, 0);
  for (int i = 0; i < atom->nlocal; i++)
    for (const Bond &bond : bonds_[i])
      if (bond.other < 0) mine.push_back(bond.partner);
  MPI_Allgather(&missing, 1, MPI_INT, counts.data(), 1, MPI_INT, world);
  for (int rank = 0; rank < comm->nprocs; rank++) starts[rank + 1] = starts[rank] + counts[rank];
  std::vector<int> partners(starts.back());
  MPI_Allgatherv(mine.data(), missing, MPI_INT, partners.data(), counts.data(), starts.data(), MPI_INT, world);
  int here = 0, there;
  for (int partner : partners) {
    const int i = atom->map(partner);
    if (i >= 0 && i < atom->nlocal) here = std::max(here, partner);
  }
  MPI_Allreduce(&here, &there, 1, MPI_INT, MPI_MAX, world);
  if (there > 0)
    fix_failed(
        lmp, this,
        format_text(
            "a bond of grain %d is longer than what ranks see of each other's grains, %g; a larger skin (command "
            "neighbor) widens that",
            there, comm->cutghost[0]));
  for (int i = 0; i < atom->nlocal; i++)
    bonds_[i].erase(std::remove_if(bonds_[i].begin(), bonds_[i].end(), [](const Bond &bond) { return bond.other < 0; }),
                    bonds_[i].end());
}

void FixBondGranThermal::find_contact(int i, int j, double *history, double sign) {
  if (i >= atom->nlocal) return;
  Bond *bond = find_bond(i, atom->tag[j]);
  if (bond) bond->other = j, bond->listed = true, bond->history = history, bond->sign = sign;
}

void FixBondGranThermal::find_contacts() {
  const NeighList *list = pair_->list;
  for (int n = 0; n < list->inum; n++) {
    const int i = list->ilist[n];
    for (int k = 0; k < list->numneigh[i]; k++) {
      const int j = list->firstneigh[i][k] & NEIGHMASK;
      double *history = pair_->is_history() ? list->listgranhistory->firstdouble[i] + (size_t)pair_->dnum() * k : NULL;
      find_contact(i, j, history, 1.0);
      find_contact(j, i, history, -1.0);
    }
  }
}

/* The neighbour list is new. A contact's tangential spring becomes that of the bond. */
void FixBondGranThermal::install() {
  install_pending_ = false;
  if (gap_ >= neighbor->skin)
    fix_failed(lmp, this,
               format_text("keyword 'gap': %g is given, but the skin (command neighbor) is %g; allowed is a number "
                           "below that",
                           gap_, neighbor->skin));
  const NeighList *list = pair_->list;
  BaseStatus status = BASE_OK;
  for (int n = 0; n < list->inum; n++) {
    const int i = list->ilist[n];
    for (int k = 0; k < list->numneigh[i]; k++) {
      const int j = list->firstneigh[i][k] & NEIGHMASK;
      const GrainMotion motion = motion_of(i, j);
      const double *d = motion.branch, reach = motion.radius[0] + motion.radius[1] + gap_;
      const double square = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
      if (!(atom->mask[i] & atom->mask[j] & groupbit)) continue;
      if (gap_ > 0.0 ? square > reach * reach : square >= reach * reach) continue;
      const double *history =
          pair_->is_history() ? list->listgranhistory->firstdouble[i] + (size_t)pair_->dnum() * k : NULL;
      const int grain[2] = {i, j};
      for (int g = 0; g < 2 && grain[g] < atom->nlocal; g++) {
        Bond *bond = find_bond(grain[g], atom->tag[grain[1 - g]]);
        if (bond && bond->other != grain[1 - g])
          status =
              base_error(BASE_ERROR_ARGUMENT,
                         "grains %d and %d touch in two places, through the periodic boundary; a box of more than two "
                         "grains' width is needed",
                         atom->tag[i], atom->tag[j]);
        if (bond) continue;
        bond = add_bond(grain[g], grain[1 - g]);
        for (int a = 0; a < 3 && history; a++) bond->bond.spring[a] = g == 0 ? history[a] : -history[a];
      }
    }
  }
  fix_check(lmp, this, status);
  tell_partners();
  for (double &count : count_) count = 0.0;
  for (int i = 0; i < atom->nlocal; i++) count_[BONDS_MADE] += 0.5 * (double)bonds_[i].size();
}

/* ------------------------------------------------------------------------------------------------------ partners */

/* Round-off may let a bond begin or end as one of its grains sees it and not as the other does: either is enough. */
void FixBondGranThermal::tell_partners() {
  int most = 0, all;
  for (int i = 0; i < atom->nlocal; i++) {
    int count = 0;
    for (const Bond &bond : bonds_[i]) count += bond.news != NONE;
    most = std::max(most, count);
  }
  MPI_Allreduce(&most, &all, 1, MPI_INT, MPI_MAX, world);
  if (all == 0) return;
  heard_.clear();
  for (round_ = 0; round_ * WORDS < all; round_++) comm->forward_comm_fix(this);
  for (int i = 0; i < atom->nlocal; i++) /* partners on this rank who are no ghosts */
    for (const Bond &bond : bonds_[i])
      if (bond.news != NONE && bond.other < atom->nlocal) heard_.push_back({bond.other, atom->tag[i], bond.news});
  for (const Message &message : heard_) hear(message);
}

/* If both grains have news, those of the lower tag count. */
void FixBondGranThermal::hear(const Message &message) {
  Bond *bond = find_bond(message.grain, message.partner);
  if (!bond && message.news == MADE)
    bond = add_bond(message.grain, domain->closest_image(message.grain, atom->map(message.partner)));
  if (bond && (bond->news == NONE || message.partner < atom->tag[message.grain])) bond->news = message.news;
}

int FixBondGranThermal::pack_comm(int n, int *list, double *buf, int, int *) {
  double *word = buf;
  for (int k = 0; k < n; k++, word += WORDS) {
    int count = -round_ * WORDS;
    for (int w = 0; w < WORDS; w++) word[w] = 0.0;
    if (list[k] >= atom->nlocal) continue;
    for (const Bond &bond : bonds_[list[k]]) {
      if (bond.news == NONE) continue;
      if (count >= 0 && count < WORDS) word[count] = (double)bond.partner * NEWS + bond.news;
      count++;
    }
  }
  return WORDS;
}

void FixBondGranThermal::unpack_comm(int n, int first, double *buf) {
  for (int k = 0; k < n; k++)
    for (int w = 0; w < WORDS; w++) {
      const int64_t word = (int64_t)buf[k * WORDS + w];
      if (word == 0) continue;
      const int i = atom->map((int)(word / NEWS));
      if (i >= 0 && i < atom->nlocal) heard_.push_back({i, atom->tag[first + k], (int)(word % NEWS)});
    }
}

/* -------------------------------------------------------------------------------------------------------- output */

double FixBondGranThermal::compute_vector(int n) {
  double sum;
  MPI_Allreduce(&count_[n], &sum, 1, MPI_DOUBLE, MPI_SUM, world);
  return sum;
}

double FixBondGranThermal::compute_scalar() {
  const double made = compute_vector(BONDS_MADE), intact = compute_vector(BONDS_INTACT);
  return made > 0.0 ? intact / made : 0.0;
}
