/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "material_properties.h"

#include <algorithm>

#include "fix_property_global.h"
#include "modify.h"
#include "rank_error.h"

using namespace LAMMPS_NS;

/* The fix that holds property `name` of whatever kind. check_fix compares the name and, with this kind of "kind",
 * nothing else. */
FixPropertyGlobal *MaterialProperties::find(const char *name) const {
  for (int k = 0; k < modify->nfix; k++) {
    FixPropertyGlobal *property = dynamic_cast<FixPropertyGlobal *>(modify->fix[k]);
    if (property && property->check_fix(name, "any", 0, 0, fix_->style, false)) return property;
  }
  return NULL;
}

FixPropertyGlobal *MaterialProperties::require(const char *name, const char *kind, const char *values) const {
  FixPropertyGlobal *property = find(name);
  const std::string line = std::string("fix ID all property/global ") + name + " " + kind + " " + values;
  if (!property) fix_failed(lmp, fix_, std::string("property '") + name + "' is missing; define it by: " + line);
  if (!property->check_fix(name, kind, 0, 0, fix_->style, false))
    fix_failed(lmp, fix_,
               std::string("property '") + name + "' (fix " + property->id + ") must be of kind " + kind + ": " + line);
  return property;
}

double MaterialProperties::checked(const char *name, double value, const NumberRange &range) const {
  const bool low = value > range.low || (!range.open_low && value == range.low);
  const bool high = value < range.high || (!range.open_high && value == range.high);
  if (!low || !high)
    fix_failed(
        lmp, fix_,
        format_text("property '%s' of atom type %d is %g, allowed is %s", name, type_, value, range.text().c_str()));
  return value;
}

double MaterialProperties::of_type(const char *name, const NumberRange &range) const {
  FixPropertyGlobal *property = require(name, "peratomtype", "VALUE [one per atom type]");
  if (property->size_vector < type_)
    fix_failed(lmp, fix_,
               format_text("property '%s' has %d value(s), but there is atom type %d", name,
                           property->size_vector, type_));
  return checked(name, property->compute_vector(type_ - 1), range);
}

double MaterialProperties::of_pair(const char *name, const NumberRange &range, int other) const {
  FixPropertyGlobal *property = require(name, "peratomtypepair", "NTYPES VALUE [NTYPES x NTYPES values]");
  if (property->size_array_rows < type_ || property->size_array_cols < std::max(type_, other))
    fix_failed(lmp, fix_,
               format_text("property '%s' is a %d x %d table, but there is atom type %d", name,
                           property->size_array_rows, property->size_array_cols, std::max(type_, other)));
  return checked(name, property->compute_array(type_ - 1, other - 1), range);
}

std::vector<double> MaterialProperties::table(const char *name, int columns, const char *usage) const {
  FixPropertyGlobal *property = require(name, "matrix", usage);
  if (property->size_array_cols != columns)
    fix_failed(lmp, fix_,
               format_text("property '%s' has %d columns, allowed are %d: the temperature and one per atom type", name,
                           property->size_array_cols, columns));
  std::vector<double> values;
  for (int row = 0; row < property->size_array_rows; row++)
    for (int column = 0; column < columns; column++) values.push_back(property->compute_array(row, column));
  return values;
}
