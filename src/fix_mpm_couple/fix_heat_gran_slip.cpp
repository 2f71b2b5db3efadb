/* SPDX-License-Identifier: GPL-2.0-or-later */
/* fix heat/gran/grain: the heat of friction. LIGGGHTS keeps three values for this fix with the history of each contact;
 * they travel with the grains and are in restart files. */
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

/* The tangential spring of the step before; it changes sign with the order of the grains. */
bool FixHeatGranGrain::history_args(char **args) {
  static char names[3][12] = {"slip_x", "slip_y", "slip_z"}, changes_sign[2] = "1";
  for (int a = 0; a < 3; a++) args[2 * a] = names[a], args[2 * a + 1] = changes_sign;
  return true;
}

/* LIGGGHTS' history of contacts keeps the size that it had in the first run, but pair styles expect that of the fixes
 * which are there: without this fix they would read beyond it. */
void FixHeatGranGrain::pre_delete(bool unfix) {
  if (unfix && friction_ && stiffness_.size() > 0)
    fix_failed(lmp, this, "with 'friction yes' the fix cannot be removed after the first run");
}

void FixHeatGranGrain::init_friction() {
  FixContactHistory *history = pair_gran->get_fix_history();
  if (history && history->get_dnum() != pair_gran->dnum())
    fix_failed(lmp, this,
               "keyword 'friction' cannot change after the first run: define the fix before it; contacts that exist "
               "have no record");
  if (!friction_) return;
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
