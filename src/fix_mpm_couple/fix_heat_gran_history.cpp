/* SPDX-License-Identifier: GPL-2.0-or-later */
/* fix heat/gran/grain: what needs the past of a contact, friction and collisions. LIGGGHTS keeps values for this fix
 * with the history of each contact; they travel with the grains and are in restart files. */
#include <cmath>
#include <vector>

#include "atom.h"
#include "fix_bond_gran_thermal.h"
#include "fix_contact_history.h"
#include "fix_heat_gran_grain.h"
#include "fix_scalar_transport_equation.h"
#include "keyword_parser.h"
#include "material_properties.h"
#include "modify.h"
#include "neigh_list.h"
#include "pair_gran.h"
#include "properties.h"
#include "rank_error.h"
#include "update.h"

using namespace LAMMPS_NS;

int FixHeatGranGrain::n_history_extra() { return (friction_ ? 4 : 0) + (collides() ? 2 : 0); }

/* The tangential spring of the step before changes sign with the order of the grains; its stiffness, age and speed of
 * impact do not. */
bool FixHeatGranGrain::history_args(char **args) {
  static char names[6][16] = {"slip_x", "slip_y", "slip_z", "slip_stiffness", "impact_age", "impact_speed"};
  static char flags[2][2] = {"0", "1"};
  int count = 0;
  for (int k = 0; k < 6; k++) {
    if (!(k < 4 ? friction_ : collides())) continue;
    args[2 * count] = names[k], args[2 * count + 1] = flags[k < 3];
    count++;
  }
  return true;
}

/* LIGGGHTS' history of contacts keeps the size that it had in the first run, but pair styles expect that of the fixes
 * which are there: without this fix they would read beyond it. */
void FixHeatGranGrain::pre_delete(bool unfix) {
  Fix *integrator = modify->find_fix_scalar_transport_equation("heattransfer");
  if (unfix && capacity_table_ && integrator) {
    char integrate[] = "integrate", start[] = "start", *words[] = {integrate, start};
    integrator->modify_param(2, words);
  }
  if (unfix && (laws_.size() > 0 || compliance_.size() > 0))
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

const char *const FixHeatGranGrain::LAW_NAMES[3] = {"hooke/stiffness", "hertz", "hertz/stiffness"};

void FixHeatGranGrain::init_friction() {
  bonds_ = NULL;
  for (int k = 0; k < modify->nfix; k++)
    if (FixBondGranThermal *bonds = dynamic_cast<FixBondGranThermal *>(modify->fix[k])) bonds_ = bonds;
  int law = 0;
  while (law < 3 && !pair_gran->contact_match("normal", LAW_NAMES[law])) law++;
  /* The spring comes first in the history if nothing else of the pair style is in it. */
  if (law == 3 || !pair_gran->contact_match("tangential", "history") || pair_gran->dnum_pair() != 3)
    fix_failed(lmp, this,
               "keyword 'friction': allowed is pair_style gran model hooke/stiffness, hertz or hertz/stiffness with "
               "tangential history, without models that have a history of their own (rolling_friction epsd..., "
               "cohesion with liquid)");
  law_ = (Law)law;
  const size_t types = conductivity_.size();
  laws_.assign(types * types, GrainContact());
  coulomb_.assign(types * types, 0.0);
  for (size_t a = 1; a < types; a++)
    for (size_t b = 1; b < types; b++) {
      laws_[a * types + b] = read_law(a, b);
      if (damping_ == NORMAL_DAMPING) laws_[a * types + b].damping[1] = 0.0; /* off in the pair style */
      coulomb_[a * types + b] =
          MaterialProperties(lmp, this, a).of_pair("coefficientFriction", NumberRange::at_least(0.0), b);
    }
}

/* Of LIGGGHTS' normal models. `hertz`: stiffness 4/3 E* and 8 G*; damping as a share of critical damping. */
GrainContact FixHeatGranGrain::read_law(int a, int b) const {
  const MaterialProperties one(lmp, this, a), two(lmp, this, b);
  const NumberRange any = NumberRange::at_least(0.0), modulus = NumberRange::positive();
  if (law_ != HERTZ) {
    return {{one.of_pair("kn", any, b), one.of_pair("kt", any, b)},
            {one.of_pair("gamman", any, b), one.of_pair("gammat", any, b)},
            0.0};
  }
  double soft = 0.0, shear = 0.0;
  for (const MaterialProperties *grain : {&one, &two}) {
    const double E = grain->of_type("youngsModulus", modulus);
    const double nu = grain->of_type("poissonsRatio", NumberRange::from_below(0.0, 1.0));
    soft += (1.0 - nu * nu) / E, shear += 2.0 * (2.0 - nu) * (1.0 + nu) / E;
  }
  GrainContact law = {{4.0 / 3.0 / soft, 8.0 / shear}, {}, 0.0};
  const double log_e = log(one.of_pair("coefficientRestitution", NumberRange::positive(), b));
  const double share = -2.0 * sqrt(5.0 / 6.0) * log_e / sqrt(log_e * log_e + M_PI * M_PI);
  law.damping[0] = share * sqrt(2.0 / soft), law.damping[1] = share * sqrt(8.0 / shear);
  return law;
}

/* Effective mass and radius of the pair; at walls those of the particle. */
GrainContact FixHeatGranGrain::find_contact(int type, int other, double mass, double radius, double overlap) const {
  GrainContact contact = laws_[type * conductivity_.size() + other];
  contact.mass = mass;
  const double width = law_ == HOOKE_STIFFNESS ? 1.0 : sqrt(radius * fmax(overlap, 0.0)); /* Hertz' contact radius */
  for (int k = 0; k < 2; k++) {
    contact.stiffness[k] *= width;
    contact.damping[k] *= law_ == HERTZ ? sqrt(width * mass) : width * mass;
  }
  return contact;
}

double FixHeatGranGrain::find_coulomb_limit(int type, int other, const GrainContact &contact, double overlap,
                                            double parting) const {
  if (overlap <= 0.0) return 0.0;
  const double normal = contact.stiffness[0] * overlap - contact.damping[0] * parting;
  return coulomb_[type * conductivity_.size() + other] * fabs(normal);
}

/* LIGGGHTS keeps no values for this fix with contacts at walls: the spring of the step before is worked out again. Half
 * of the work heats the particle; the other half is the wall's. */
void FixHeatGranGrain::rub_walls() {
  for (const WallTouch &touch : walls_.find_touches()) {
    const int i = touch.grain, type = atom->type[i];
    if (!(atom->mask[i] & groupbit)) continue;
    const double radius = atom->radius[i], mass = atom->rmass[i], dt = update->dt;
    GrainMotion motion = {{radius, 0.0}, {}, {}, {}};
    double square = 0.0, parting = 0.0, push = 0.0, stretch = 0.0;
    for (int a = 0; a < 3; a++) {
      push -= atom->f[i][a] * touch.delta[a], stretch += touch.spring[a] * touch.spring[a];
      motion.branch[a] = -touch.delta[a];
      motion.velocity[0][a] = atom->v[i][a], motion.velocity[1][a] = touch.velocity[a];
      motion.spin[0][a] = atom->omega[i][a];
      square += touch.delta[a] * touch.delta[a];
      parting -= (atom->v[i][a] - touch.velocity[a]) * touch.delta[a];
    }
    const double distance = sqrt(square), overlap = radius - distance;
    parting /= distance, push /= distance;
    const double change = push / mass * dt; /* of the speed, in this step and nearly so in the last one */
    const GrainContact now = find_contact(type, touch.type, mass, radius, overlap);
    const GrainContact then = find_contact(type, touch.type, mass, radius, overlap + parting * dt);
    const double limit[2] = {find_coulomb_limit(type, touch.type, then, overlap + parting * dt, parting - change),
                             find_coulomb_limit(type, touch.type, now, overlap, parting)};
    const double stiffness[2] = {then.stiffness[1], now.stiffness[1]};
    double before[3];
    grain_spring_before(&motion, stiffness, limit, dt, touch.spring, before);
    double slip = grain_slip_work(&motion, stiffness, dt, before, touch.spring);
    /* The force is complete: the grain's next place is known, and whether the contact opens with a stretched spring. */
    if (overlap <= (parting + change) * dt) slip += 0.5 * stiffness[1] * stretch;
    const double damp = counts_damping() ? grain_damping_work(&motion, &now, dt, before, touch.spring) : 0.0;
    heatFlux[i] += 0.5 * (slip + damp) / dt;
    flow_[FRICTION].add(0.5 * slip / dt), flow_[DAMPING].add(0.5 * damp / dt);
  }
}

GrainContact FixHeatGranGrain::find_contact_of(int i, int j, double overlap) const {
  const double *m = atom->rmass, *r = atom->radius;
  return find_contact(atom->type[i], atom->type[j], m[i] * m[j] / (m[i] + m[j]), r[i] * r[j] / (r[i] + r[j]), overlap);
}

void FixHeatGranGrain::find_dashpots(int i, int j, double overlap, GrainBondSprings *springs) const {
  const GrainContact contact = find_contact_of(i, j, overlap);
  springs->normal_damping = contact.damping[0], springs->tangential_damping = contact.damping[1];
}

void FixHeatGranGrain::keep_damping(int i, int j, double work) {
  if (!(atom->mask[i] & atom->mask[j] & groupbit)) return;
  damped_.resize(atom->nlocal, 0.0);
  damped_[i] += work;
}

/* Half of the work to each grain. Contacts are in the lists of two ranks if the grains are: each heats its own. The
 * energy that the spring still has when a contact opens is lost to LIGGGHTS. */
void FixHeatGranGrain::slip(int i, int j, double *history) {
  double *before = history + pair_gran->fix_extra_dnum_index(this);
  GrainMotion motion = {{atom->radius[i], atom->radius[j]}, {}, {}, {}};
  double square = 0.0, work[2] = {};
  for (int a = 0; a < 3; a++) {
    motion.branch[a] = atom->x[i][a] - atom->x[j][a];
    motion.velocity[0][a] = atom->v[i][a], motion.velocity[1][a] = atom->v[j][a];
    motion.spin[0][a] = atom->omega[i][a], motion.spin[1][a] = atom->omega[j][a];
    square += motion.branch[a] * motion.branch[a];
    work[0] += 0.5 * before[3] * before[a] * before[a];
  }
  const double reach = motion.radius[0] + motion.radius[1];
  double stiffness = 0.0;
  if (square < reach * reach) {
    const GrainContact contact = find_contact_of(i, j, reach - sqrt(square));
    stiffness = contact.stiffness[1];
    const double both[2] = {before[3] > 0.0 ? before[3] : stiffness, stiffness}; /* 0: a new contact, or a spring that was set */
    work[0] = grain_slip_work(&motion, both, update->dt, before, history);
    if (counts_damping() && !(bonds_ && bonds_->holds(i, j)))
      work[1] = grain_damping_work(&motion, &contact, update->dt, before, history);
  }
  for (const int grain : {i, j}) {
    if (grain >= atom->nlocal) continue;
    const double share = 0.5 / update->dt;
    heatFlux[grain] += share * (work[0] + work[1]);
    flow_[FRICTION].add(share * work[0]), flow_[DAMPING].add(share * work[1]);
  }
  for (int a = 0; a < 3; a++) before[a] = history[a];
  before[3] = stiffness;
}

void FixHeatGranGrain::start_slip(double *history) const {
  if (!friction_) return;
  double *before = history + pair_gran->fix_extra_dnum_index(const_cast<FixHeatGranGrain *>(this));
  for (int a = 0; a < 3; a++) before[a] = history[a];
}

void FixHeatGranGrain::heat_by_friction() {
  for (size_t i = 0; i < damped_.size(); i++) {
    heatFlux[i] += damped_[i] / update->dt;
    flow_[DAMPING].add(damped_[i] / update->dt);
  }
  damped_.clear();
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
    const char *modulus = correction_ ? "youngsModulusOriginal" : "youngsModulus";
    compliance_[type] = (1.0 - ratio * ratio) / properties.of_type(modulus, NumberRange::positive());
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
    const double density = mass[g] / (4.0 / 3.0 * M_PI * pow(pair.radius[g], 3));
    impact.heat_capacity[g] = density * find_capacity(type, Temp[grains[g]]);
    compliance += compliance_[type];
  }
  grain_impact_hertz(&pair, mass, 1.0 / compliance, record[1], &impact.radius_max, &impact.duration);
  return grain_heat_impact_conductance(&model_, &pair, &impact, age, update->dt);
}
