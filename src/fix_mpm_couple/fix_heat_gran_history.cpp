/* SPDX-License-Identifier: GPL-2.0-or-later */
/* fix heat/gran/grain: what needs the past of a contact, friction and collisions. LIGGGHTS keeps values for this fix
 * with the history of each contact; they travel with the grains and are in restart files. */
#include <cmath>

#include "atom.h"
#include "fix_contact_history.h"
#include "fix_heat_gran_grain.h"
#include "keyword_parser.h"
#include "material_properties.h"
#include "neigh_list.h"
#include "pair_gran.h"
#include "properties.h"
#include "rank_error.h"
#include "update.h"

using namespace LAMMPS_NS;

int FixHeatGranGrain::n_history_extra() { return (friction_ ? 3 : 0) + (collides() ? 2 : 0); }

/* The tangential spring of the step before changes sign with the order of the grains, age and speed of impact do
 * not. */
bool FixHeatGranGrain::history_args(char **args) {
  static char names[5][16] = {"slip_x", "slip_y", "slip_z", "impact_age", "impact_speed"};
  static char flags[2][2] = {"0", "1"};
  int count = 0;
  for (int k = 0; k < 5; k++) {
    if (!(k < 3 ? friction_ : collides())) continue;
    args[2 * count] = names[k], args[2 * count + 1] = flags[k < 3];
    count++;
  }
  return true;
}

/* LIGGGHTS' history of contacts keeps the size that it had in the first run, but pair styles expect that of the fixes
 * which are there: without this fix they would read beyond it. */
void FixHeatGranGrain::pre_delete(bool unfix) {
  if (unfix && (stiffness_.size() > 0 || compliance_.size() > 0))
    fix_failed(lmp, this,
               "with 'friction yes' or 'direct collisional' the fix cannot be removed after the first run");
}

void FixHeatGranGrain::init_history() {
  FixContactHistory *history = pair_gran->get_fix_history();
  if (history && history->get_dnum() != pair_gran->dnum())
    fix_failed(lmp, this,
               "keyword 'friction' and 'direct collisional' cannot change after the first run: define the fix before "
               "it; contacts that exist have no record");
  if (friction_) init_friction();
  if (collides()) init_collisions();
}

void FixHeatGranGrain::init_friction() {
  /* The spring comes first in the history if nothing else of the pair style is in it. */
  if (!pair_gran->contact_match("normal", "hooke/stiffness") || !pair_gran->contact_match("tangential", "history") ||
      pair_gran->dnum_pair() != 3)
    fix_failed(lmp, this,
               "keyword 'friction': allowed is pair_style gran model hooke/stiffness tangential history, without "
               "models that have a history of their own (rolling_friction epsd..., cohesion with liquid)");
  const int types = atom->get_properties()->max_type();
  stiffness_.assign((types + 1) * (types + 1), 0.0);
  for (int a = 1; a <= types; a++)
    for (int b = 1; b <= types; b++)
      stiffness_[a * (types + 1) + b] =
          MaterialProperties(lmp, this, a).of_pair("kt", NumberRange::at_least(0.0), b);
}

/* Half of the work to each grain. Contacts are in the lists of two ranks if the grains are: each heats its own. */
void FixHeatGranGrain::slip(int i, int j, double *history) {
  double *before = history + pair_gran->fix_extra_dnum_index(this);
  GrainMotion motion = {{atom->radius[i], atom->radius[j]}, {}, {}, {}};
  double square = 0.0;
  for (int a = 0; a < 3; a++) {
    motion.branch[a] = atom->x[i][a] - atom->x[j][a];
    motion.velocity[0][a] = atom->v[i][a], motion.velocity[1][a] = atom->v[j][a];
    motion.spin[0][a] = atom->omega[i][a], motion.spin[1][a] = atom->omega[j][a];
    square += motion.branch[a] * motion.branch[a];
  }
  const double reach = motion.radius[0] + motion.radius[1];
  if (square < reach * reach) {
    const double stiffness = stiffness_[atom->type[i] * conductivity_.size() + atom->type[j]];
    const double power = grain_slip_work(&motion, stiffness, update->dt, before, history) / update->dt;
    for (const int grain : {i, j})
      if (grain < atom->nlocal) heatFlux[grain] += 0.5 * power, flow_[FRICTION].add(0.5 * power);
  }
  for (int a = 0; a < 3; a++) before[a] = history[a];
}

void FixHeatGranGrain::start_slip(double *history) const {
  if (!friction_) return;
  double *before = history + pair_gran->fix_extra_dnum_index(const_cast<FixHeatGranGrain *>(this));
  for (int a = 0; a < 3; a++) before[a] = history[a];
}

void FixHeatGranGrain::heat_by_friction() {
  const NeighList *list = pair_gran->list;
  for (int n = 0; n < list->inum; n++) {
    const int i = list->ilist[n];
    for (int k = 0; k < list->numneigh[i]; k++) {
      const int j = list->firstneigh[i][k] & NEIGHMASK;
      if (atom->mask[i] & atom->mask[j] & groupbit)
        slip(i, j, list->listgranhistory->firstdouble[i] + (size_t)pair_gran->dnum() * k);
    }
  }
}

void FixHeatGranGrain::init_collisions() {
  capacity_.assign(conductivity_.size(), 0.0), compliance_ = capacity_;
  for (int type = 1; type < (int)conductivity_.size(); type++) {
    const MaterialProperties properties(lmp, this, type);
    const double ratio = properties.of_type("poissonsRatio", NumberRange::from_below(0.0, 1.0));
    capacity_[type] = properties.of_type("thermalCapacity", NumberRange::positive());
    compliance_[type] = (1.0 - ratio * ratio) / properties.of_type("youngsModulus", NumberRange::positive());
  }
}

/* record: age of the contact, s, and speed of approach when it began, m/s. */
double FixHeatGranGrain::collide(int i, int j, const GrainPair &pair, double *record) const {
  const bool touching = pair.distance < pair.radius[0] + pair.radius[1];
  const double age = record[0];
  if (touching && age == 0.0) {
    double approach = 0.0;
    for (int a = 0; a < 3; a++) approach -= (atom->v[i][a] - atom->v[j][a]) * (atom->x[i][a] - atom->x[j][a]);
    record[1] = approach / pair.distance;
  }
  record[0] = touching ? age + update->dt : 0.0;
  if (!touching || record[1] <= 0.0) return grain_heat_conductance(&model_, &pair);
  const int grains[2] = {i, j};
  GrainImpact impact;
  double mass[2], compliance = 0.0;
  for (int g = 0; g < 2; g++) {
    const int type = atom->type[grains[g]];
    mass[g] = atom->rmass[grains[g]];
    impact.heat_capacity[g] = mass[g] * capacity_[type] / (4.0 / 3.0 * M_PI * pow(pair.radius[g], 3));
    compliance += compliance_[type];
  }
  grain_impact_hertz(&pair, mass, 1.0 / compliance, record[1], &impact.radius_max, &impact.duration);
  return grain_heat_impact_conductance(&model_, &pair, &impact, age, update->dt);
}
