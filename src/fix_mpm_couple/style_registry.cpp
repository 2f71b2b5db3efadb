/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "style_registry.h"

#include <map>
#include <string>

#include "fix.h"
#include "fix_mpm_couple.h"
#include "fix_mpm_rve.h"
#include "fix_mpm_traction.h"
#include "fix_mpm_vtk.h"
#include "fix_mpm_wall.h"
#include "lammps.h"
#include "modify.h"

using namespace LAMMPS_NS;

typedef Fix *(*FixCreator)(LAMMPS *, int, char **);

/* Modify::fix_map is private. Access is not checked in the arguments of an explicit instantiation ([temp.spec]), which
 * therefore may hand out the pointer to the member. */
template <typename Tag, typename Tag::type Member>
struct Expose {
  friend typename Tag::type member_of(Tag) { return Member; }
};
struct FixMap {
  typedef std::map<std::string, FixCreator> *Modify::*type;
  friend type member_of(FixMap);
};
template struct Expose<FixMap, &Modify::fix_map>;

template <typename Style>
static Fix *create(LAMMPS *lmp, int narg, char **arg) {
  return new Style(lmp, narg, arg);
}

void LAMMPS_NS::register_styles(LAMMPS *lmp) {
  std::map<std::string, FixCreator> &map = *(lmp->modify->*member_of(FixMap()));
#define FIX_CLASS
#define FixStyle(key, Class) map[#key] = &create<Class>;
#include "fix_mpm_couple.h"
#include "fix_mpm_rve.h"
#include "fix_mpm_traction.h"
#include "fix_mpm_vtk.h"
#include "fix_mpm_wall.h"
#undef FixStyle
#undef FIX_CLASS
}
