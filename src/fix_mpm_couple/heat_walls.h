/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The walls of given temperature that LIGGGHTS' fix wall/gran has (`primitive ... temperature T`, or meshes of fix
 * mesh/surface ... temperature T), as seen by a fix that works out the conduction to them itself. */
#ifndef LMP_HEAT_WALLS_H
#define LMP_HEAT_WALLS_H

#include <vector>

#include "pointers.h"

namespace LAMMPS_NS {

class Fix;
class FixMeshSurface;
class FixWallGran;

struct WallContact {
  int grain;       /* index of a particle of this rank */
  int type;        /* atom type, hence material, of the wall */
  double distance; /* of the particle's centre from the wall, m */
  double temperature;
  bool touches;    /* overlaps, and on a mesh exerts a force there: the direct model conducts */
  bool in_sight;   /* the indirect model conducts: no nearer wall in about the same direction */
  double delta[3]; /* from the particle's centre to the nearest point of the wall, m */
};

class HeatWalls : protected Pointers {
 public:
  explicit HeatWalls(LAMMPS *lammps) : Pointers(lammps) {}

  /* Finds the walls and stops LIGGGHTS' own conduction to them until their next setup(). After all fixes' setup(); all
   * ranks meet the same errors, in the name of `fix`. */
  void take_over(const Fix *fix);
  bool empty() const { return walls_.empty(); }
  bool has_mesh() const;
  /* All contacts, and what is apart by less than `reach` radii of the particle. After the walls' post_force() of the
   * step: meshes know only then at which triangles a particle counts. */
  const std::vector<WallContact> &find_contacts(double reach);

 private:
  std::vector<FixWallGran *> walls_;
  std::vector<WallContact> contacts_;

  void touch_primitive(FixWallGran *wall, double reach);
  void touch_mesh(FixMeshSurface *mesh, double reach);
  void find_walls_in_sight();
};

}  // namespace LAMMPS_NS

#endif
