/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The walls of given temperature that LIGGGHTS' fix wall/gran has (`primitive ... temperature T`, or meshes of fix
 * mesh/surface ... temperature T), as seen by a fix that works out the conduction to them itself. */
#ifndef LMP_HEAT_WALLS_H
#define LMP_HEAT_WALLS_H

#include <vector>

#include "pointers.h"

namespace LAMMPS_NS {

class Fix;
class FixContactHistoryMesh;
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

/* A contact with any wall, also without a temperature. */
struct WallTouch {
  int grain, type;      /* as above */
  double delta[3];      /* from the particle's centre to the point of contact, m */
  double velocity[3];   /* of the wall there, m/s */
  const double *spring; /* LIGGGHTS' tangential spring after the step, m */
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
  /* Ends the program, in the name of `fix`, if a wall has another normal model than `normal`, another tangential model
   * than `history`, or a model with more history. */
  void check_springs(const Fix *fix, const char *normal);
  /* Of all walls; only after check_springs(). As find_contacts(), after the walls' post_force(). */
  const std::vector<WallTouch> &find_touches();

 private:
  std::vector<FixWallGran *> walls_;
  std::vector<WallContact> contacts_;
  std::vector<WallTouch> touches_;

  void touch_primitive(FixWallGran *wall, double reach);
  void touch_mesh(FixMeshSurface *mesh, double reach);
  void find_walls_in_sight();
  static int find_partner(FixContactHistoryMesh *history, int i, int triangle);
  void rub_primitive(FixWallGran *wall);
  void rub_mesh(FixMeshSurface *mesh);
};

}  // namespace LAMMPS_NS

#endif
