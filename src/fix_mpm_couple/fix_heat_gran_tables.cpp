/* SPDX-License-Identifier: GPL-2.0-or-later */
/* fix heat/gran/grain: conductivity and capacity, of constant values or of tables over temperature. */
#include "atom.h"
#include "fix_heat_gran_grain.h"
#include "fix_scalar_transport_equation.h"
#include "keyword_parser.h"
#include "material_properties.h"
#include "properties.h"
#include "rank_error.h"
#include "update.h"

using namespace LAMMPS_NS;

static const char *const USAGE = "NTYPES+1 ROWS [each row: temperature, one value per atom type]";

GrainTable FixHeatGranGrain::make_table(const std::vector<double> &rows) const {
  const int columns = conductivity_.size(); /* [0] is unused: temperature takes its place */
  return {rows.data(), (int)rows.size() / columns, columns};
}

void FixHeatGranGrain::init_conductivity() {
  const int types = atom->get_properties()->max_type();
  conductivity_.assign(types + 1, 0.0);
  for (int type = 1; !conductivity_table_ && type <= types; type++)
    conductivity_[type] =
        MaterialProperties(lmp, this, type).of_type("thermalConductivity", NumberRange::at_least(0.0));
  if (!conductivity_table_) return;
  conductivity_rows_ = MaterialProperties(lmp, this, 1).table("thermalConductivityTable", types + 1, USAGE);
  const GrainTable table = make_table(conductivity_rows_);
  if (grain_table_check(&table, false) != BASE_OK)
    fix_failed(lmp, this, std::string("property 'thermalConductivityTable': ") + base_error_message());
}

/* The fix that integrates Temp knows one capacity per atom type: with a table this fix takes its place. */
void FixHeatGranGrain::init_capacity() {
  const int types = atom->get_properties()->max_type();
  for (int type = 1; type <= types; type++)
    MaterialProperties(lmp, this, type).of_type("thermalCapacity", NumberRange::at_least(0.0));
  if (!capacity_table_) return;
  capacity_rows_ = MaterialProperties(lmp, this, 1).table("thermalCapacityTable", types + 1, USAGE);
  const GrainTable table = make_table(capacity_rows_);
  if (grain_table_check(&table, true) != BASE_OK)
    fix_failed(lmp, this, std::string("property 'thermalCapacityTable': ") + base_error_message());
  char integrate[] = "integrate", stop[] = "stop", *words[] = {integrate, stop};
  fix_ste->modify_param(2, words);
}

double FixHeatGranGrain::find_conductivity(int type, double temperature) const {
  if (!conductivity_table_) return conductivity_[type];
  const GrainTable table = make_table(conductivity_rows_);
  return grain_table_find(&table, type, temperature);
}

double FixHeatGranGrain::find_capacity(int type, double temperature) const {
  if (!capacity_table_) return capacity_[type];
  const GrainTable table = make_table(capacity_rows_);
  return grain_table_find(&table, type, temperature);
}

/* With a table of capacities: the heat of the step is the change of enthalpy, however long the step. */
void FixHeatGranGrain::final_integrate() {
  updatePtrs();
  const GrainTable table = make_table(capacity_rows_);
  for (int i = 0; i < atom->nlocal; i++) {
    if (!(atom->mask[i] & groupbit)) continue;
    const double heat = (heatFlux[i] + heatSource[i]) * update->dt / atom->rmass[i];
    Temp[i] = grain_table_heat(&table, atom->type[i], Temp[i], heat);
  }
}

double FixHeatGranGrain::compute_scalar() {
  if (!capacity_table_) return FixHeatGran::compute_scalar();
  updatePtrs();
  const GrainTable table = make_table(capacity_rows_);
  DoubleSum enthalpy;
  for (int i = 0; i < atom->nlocal; i++)
    if (atom->mask[i] & groupbit)
      enthalpy.add(atom->rmass[i] * grain_table_integral(&table, atom->type[i], Temp[i]));
  return add_up(enthalpy);
}
