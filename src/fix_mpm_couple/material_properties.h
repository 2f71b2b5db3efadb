/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Material properties under LIGGGHTS' names, as `fix property/global` of the script defines them. */
#ifndef LMP_MATERIAL_PROPERTIES_H
#define LMP_MATERIAL_PROPERTIES_H

#include "keyword_parser.h"
#include "pointers.h"

namespace LAMMPS_NS {

class FixPropertyGlobal;

class MaterialProperties : protected Pointers {
 public:
  /* Values for atom type `type` (1..ntypes), asked for by `fix`. */
  MaterialProperties(LAMMPS *lammps, const Fix *fix, int type) : Pointers(lammps), fix_(fix), type_(type) {}

  bool has(const char *name) const { return find(name) != NULL; }
  /* `peratomtype` and `peratomtypepair` (type with itself, or with type `other`). Ends the program, naming the property and the line that
   * defines it, if it is missing, of another kind, too short for the type or outside `range`. Called on all ranks. */
  double of_type(const char *name, const NumberRange &range) const;
  double of_pair(const char *name, const NumberRange &range) const { return of_pair(name, range, type_); }
  double of_pair(const char *name, const NumberRange &range, int other) const;
  /* `matrix` with `columns` columns, row by row: a property over temperature. `usage`: the values, for messages. */
  std::vector<double> table(const char *name, int columns, const char *usage) const;

 private:
  const Fix *fix_;
  int type_;

  FixPropertyGlobal *find(const char *name) const;
  FixPropertyGlobal *require(const char *name, const char *kind, const char *values) const;
  double checked(const char *name, double value, const NumberRange &range) const;
};

}  // namespace LAMMPS_NS

#endif
