/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Walls as springs and dashpots, for the heat of friction and damping. */
#include "heat_walls.h"

#include "atom.h"
#include "liggghts_walls.h"
#include "modify.h"
#include "rank_error.h"

using namespace LAMMPS_NS;

namespace {
struct Access : FixWallGran {
  static FixPropertyAtom *FixWallGran::*history() { return &Access::fix_history_primitive_; }
  static int FixWallGran::*shears() { return &Access::shear_; }
  static int FixWallGran::*direction() { return &Access::shearDim_; }
  static int FixWallGran::*axis() { return &Access::shearAxis_; }
  static double FixWallGran::*speed() { return &Access::vshear_; }
  static double (FixWallGran::*spin())[3] { return &Access::shearAxisVec_; }
};
}  // namespace

void HeatWalls::check_springs(const Fix *fix, const char *normal) {
  for (int k = 0; k < modify->nfix; k++) {
    FixWallGran *wall = dynamic_cast<FixWallGran *>(modify->fix[k]);
    if (wall && (!wall->contact_match("normal", normal) || !wall->contact_match("tangential", "history") ||
                 wall->dnum() != 3))
      fix_failed(lmp, fix,
                 format_text("keyword 'friction': fix %s: allowed is model %s tangential history, as in the pair "
                             "style, without models that have a history of their own",
                             wall->id, normal));
  }
}

const std::vector<WallTouch> &HeatWalls::find_touches() {
  touches_.clear();
  for (int k = 0; k < modify->nfix; k++) {
    FixWallGran *wall = dynamic_cast<FixWallGran *>(modify->fix[k]);
    if (!wall) continue;
    if (!wall->is_mesh_wall()) rub_primitive(wall);
    for (int n = 0; wall->is_mesh_wall() && n < wall->n_meshes(); n++) rub_mesh(wall->mesh_list()[n]);
  }
  return touches_;
}

void HeatWalls::rub_primitive(FixWallGran *wall) {
  int *near;
  const int count = wall->primitiveWall()->getNeighbors(near);
  for (int n = 0; n < count; n++) {
    const int i = near[n];
    if (!(atom->mask[i] & wall->groupbit)) continue;
    WallTouch touch = {i, wall->atom_type_wall(), {}, {}, (wall->*Access::history())->array_atom[i]};
    if (wall->primitiveWall()->resolveContact(atom->x[i], atom->radius[i], touch.delta) >= 0.0) continue;
    if (wall->*Access::shears()) touch.velocity[wall->*Access::direction()] = wall->*Access::speed();
    if (wall->*Access::shears() && wall->*Access::axis() >= 0) {
      double arm[3];
      wall->primitiveWall()->calcRadialDistance(atom->x[i], arm);
      const double *spin = wall->*Access::spin();
      for (int a = 0; a < 3; a++)
        touch.velocity[a] = spin[(a + 1) % 3] * arm[(a + 2) % 3] - spin[(a + 2) % 3] * arm[(a + 1) % 3];
    }
    touches_.push_back(touch);
  }
}

void HeatWalls::rub_mesh(FixMeshSurface *fix_mesh) {
  TriMesh *mesh = fix_mesh->triMesh();
  FixContactHistoryMesh *history = fix_mesh->contactHistory();
  MultiVectorContainer<double, 3, 3> *motion =
      mesh->prop().getElementProperty<MultiVectorContainer<double, 3, 3>>("v");
  for (int t = 0; t < mesh->sizeLocal() + mesh->sizeGhost(); t++)
    for (const int i : fix_mesh->meshNeighlist()->get_contact_list(t)) {
      if (i >= atom->nlocal) continue;
      const int partner = find_partner(history, i, mesh->id(t));
      if (partner < 0) continue;
      WallTouch touch = {i, fix_mesh->atomTypeWall(), {}, {}, history->contacthistory(i, partner)};
      double corner[3];
      int sides;
      if (mesh->resolveTriSphereContactBary(i, t, atom->radius[i], atom->x[i], touch.delta, corner, sides) >= 0.0)
        continue;
      for (int node = 0; motion && node < 3; node++)
        for (int a = 0; a < 3; a++) touch.velocity[a] += corner[node] * motion->begin()[t][node][a];
      touches_.push_back(touch);
    }
}
