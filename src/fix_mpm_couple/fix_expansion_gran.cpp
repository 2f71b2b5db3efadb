/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "fix_expansion_gran.h"

#include <algorithm>
#include <cmath>

#include "atom.h"
#include "fix_property_atom.h"
#include "keyword_parser.h"
#include "material_properties.h"
#include "modify.h"
#include "properties.h"
#include "rank_error.h"

using namespace LAMMPS_NS;

FixExpansionGran::FixExpansionGran(LAMMPS *lammps, int narg, char **arg)
    : Fix(lammps, narg, arg),
      reference_(0.0),
      growth_(0.05),
      property_(std::string("expansion_") + arg[0]),
      kept_(NULL),
      temperature_(NULL) {
  scalar_flag = 1;
  global_freq = 1;
  nevery = 1;
  rad_mass_vary_flag = 1; /* LIGGGHTS then sends radii to ghosts, and growth counts for the neighbour list's skin */
  KeywordParser parser(lmp, this, narg, arg, 3, {"reference", "growth"});
  while (parser.next()) {
    if (parser.is("reference")) reference_ = parser.number(NumberRange::any());
    else if (parser.is("growth")) growth_ = parser.number(NumberRange::inside(0.0, 1.0));
  }
  parser.require("reference", "reference T0, the temperature at which the radii hold");
  if (!atom->radius_flag) parser.fail("atoms without radius; 'atom_style granular' is needed");
}

void FixExpansionGran::post_create() {
  const std::string words[] = {property_, "all", "property/atom", property_, "vector", "yes", "no", "no", "0.0", "0.0"};
  std::vector<char *> arg;
  for (const std::string &word : words) arg.push_back(const_cast<char *>(word.c_str()));
  modify->add_fix((int)arg.size(), arg.data());
  kept_ = static_cast<FixPropertyAtom *>(
      modify->find_fix_property(property_.c_str(), "property/atom", "vector", KEPT, 0, style));
  kept_->just_created = 0; /* or LIGGGHTS would set all values to 0 in the first setup, after they have been found */
}

void FixExpansionGran::pre_delete(bool unfix) {
  if (unfix) modify->delete_fix(property_.c_str());
}

/* PRE_EXCHANGE brings setup_pre_exchange(). */
int FixExpansionGran::setmask() { return FixConst::PRE_EXCHANGE | FixConst::POST_INTEGRATE | FixConst::END_OF_STEP; }

void FixExpansionGran::init() {
  for (int k = 0; k < modify->nfix; k++)
    if (modify->fix[k] != this && modify->fix[k]->rad_mass_vary_flag)
      fix_failed(lmp, this, format_text("fix %s (id %s) sets radii too", modify->fix[k]->style, modify->fix[k]->id));
  temperature_ = static_cast<FixPropertyAtom *>(
      modify->find_fix_property("Temp", "property/atom", "scalar", 0, 0, style, false));
  if (!temperature_)
    fix_failed(lmp, this,
               "grains have no temperature: a fix heat/gran/... is needed, or 'fix ID all property/atom Temp scalar "
               "yes yes no T'");
  const int types = atom->get_properties()->max_type();
  expansion_.assign(types + 1, 0.0);
  for (int type = 1; type <= types; type++)
    expansion_[type] =
        MaterialProperties(lmp, this, type).of_type("thermalExpansionCoefficient", NumberRange::at_least(0.0));
  std::vector<double> largest(types + 1, 0.0);
  for (int type = 1; type <= types; type++) largest[type] = max_rad(type);
  limit_ = largest;
  MPI_Allreduce(largest.data(), limit_.data(), types + 1, MPI_DOUBLE, MPI_MAX, world);
}

/* LIGGGHTS sizes bins and the reach of ghosts by the largest radius at the start of a run, this rank's or any other's. */
double FixExpansionGran::max_rad(int type) {
  double largest = 0.0;
  for (int i = 0; i < atom->nlocal; i++)
    if (atom->type[i] == type && (atom->mask[i] & groupbit)) largest = std::max(largest, atom->radius[i]);
  for (int k = 0; k < modify->nfix; k++)
    if (modify->fix[k] != this && modify->fix[k]->use_rad_for_cut_neigh_and_ghost())
      largest = std::max(largest, modify->fix[k]->max_rad(type));
  return (1.0 + growth_) * largest;
}

double FixExpansionGran::radius_of(int i) const {
  const double warmer = temperature_->vector_atom[i] - reference_;
  return kept_->array_atom[i][REFERENCE_RADIUS] * (1.0 + expansion_[atom->type[i]] * warmer);
}

/* A grain that has no reference radius yet is new: it has the radius that the script gave it. At the start of a run radii
 * follow temperatures that the script has set since the last; others stay, as the run before would have gone on with
 * them. */
void FixExpansionGran::expand(bool start) {
  BaseStatus status = BASE_OK;
  for (int i = 0; i < atom->nlocal; i++) {
    if (!(atom->mask[i] & groupbit)) continue;
    double *kept = kept_->array_atom[i];
    const bool fresh = kept[REFERENCE_RADIUS] == 0.0;
    const double temperature = temperature_->vector_atom[i];
    if (fresh) kept[REFERENCE_RADIUS] = atom->radius[i];
    if (start && !fresh && kept[LAST_TEMPERATURE] == temperature) continue;
    const double radius = radius_of(i), limit = limit_[atom->type[i]];
    if (radius > 0.0 && radius <= limit) atom->radius[i] = radius;
    else
      status = base_error(BASE_ERROR_ARGUMENT,
                          "the radius of grain %d at temperature %g becomes %g, %g of that at the reference %g; allowed is "
                          "a number > 0 and <= %g, as grains may grow by %g in a run: keyword 'growth', or several runs",
                          atom->tag[i], temperature, radius, radius / kept[REFERENCE_RADIUS], reference_, limit, growth_);
  }
  fix_check(lmp, this, status);
}

void FixExpansionGran::setup_pre_exchange() { expand(true); }

void FixExpansionGran::post_integrate() { expand(false); }

void FixExpansionGran::end_of_step() {
  for (int i = 0; i < atom->nlocal; i++) kept_->array_atom[i][LAST_TEMPERATURE] = temperature_->vector_atom[i];
}

double FixExpansionGran::compute_scalar() {
  double largest = -HUGE_VAL, all;
  for (int i = 0; i < atom->nlocal; i++)
    if ((atom->mask[i] & groupbit) && kept_->array_atom[i][REFERENCE_RADIUS] > 0.0)
      largest = std::max(largest, atom->radius[i] / kept_->array_atom[i][REFERENCE_RADIUS] - 1.0);
  MPI_Allreduce(&largest, &all, 1, MPI_DOUBLE, MPI_MAX, world);
  return all == -HUGE_VAL ? 0.0 : all;
}
