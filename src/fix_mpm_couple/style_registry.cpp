/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "style_registry.h"

#include <cstdio>
#include <cstring>
#include <map>
#include <string>

#include "fix.h"
#include "fix_bond_gran_thermal.h"
#include "fix_expansion_gran.h"
#include "fix_heat_gran_grain.h"
#include "fix_mpm_couple.h"
#include "fix_mpm_rve.h"
#include "fix_mpm_traction.h"
#include "fix_mpm_vtk.h"
#include "fix_mpm_wall.h"
#include "input.h"
#include "lammps.h"
#include "modify.h"
#include "read_restart.h"
#include "restart_seal.h"
#include "comm.h"
#include "error.h"

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

typedef void (*CommandCreator)(LAMMPS *, int, char **);
struct CommandMap {
  typedef std::map<std::string, CommandCreator> *Input::*type;
  friend type member_of(CommandMap);
};
template struct Expose<CommandMap, &Input::command_map>;

/* LIGGGHTS' read_restart, after a look whether a file with material points is whole. */
static void read_whole_restart(LAMMPS *lmp, int narg, char **arg) {
  BaseStatus status = BASE_OK;
  if (narg > 0 && !strchr(arg[0], '%') && lmp->comm->me == 0) status = restart_check(restart_find(arg[0]).c_str());
  int failed = status != BASE_OK;
  MPI_Bcast(&failed, 1, MPI_INT, 0, lmp->world);
  if (failed) {
    char text[1024];
    snprintf(text, sizeof text, "Read_restart: %s", base_error_message());
    MPI_Bcast(text, sizeof text, MPI_CHAR, 0, lmp->world);
    lmp->error->all(FLERR, text);
  }
  ReadRestart(lmp).command(narg, arg);
}

template <typename Style>
static Fix *create(LAMMPS *lmp, int narg, char **arg) {
  return new Style(lmp, narg, arg);
}

void LAMMPS_NS::register_styles(LAMMPS *lmp) {
  std::map<std::string, FixCreator> &map = *(lmp->modify->*member_of(FixMap()));
#define FIX_CLASS
#define FixStyle(key, Class) map[#key] = &create<Class>;
#include "fix_bond_gran_thermal.h"
#include "fix_expansion_gran.h"
#include "fix_heat_gran_grain.h"
#include "fix_mpm_couple.h"
#include "fix_mpm_rve.h"
#include "fix_mpm_traction.h"
#include "fix_mpm_vtk.h"
#include "fix_mpm_wall.h"
#undef FixStyle
#undef FIX_CLASS
  (*(lmp->input->*member_of(CommandMap())))["read_restart"] = &read_whole_restart;
}
