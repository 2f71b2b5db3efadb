/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "heat_walls.h"

#include <algorithm>

#include "atom.h"
#include "liggghts_walls.h"
#include "modify.h"
#include "rank_error.h"

using namespace LAMMPS_NS;

/* LIGGGHTS has no public way to these members of its walls; a derived class may name them. */
namespace {
struct Access : FixWallGran {
  static bool FixWallGran::*conducts() { return &Access::heattransfer_flag_; }
  static double FixWallGran::*temperature() { return &Access::Temp_wall; }
  static int FixWallGran::*area() { return &Access::area_calculation_mode_; }
};
const int AREA_OVERLAP = 0; /* `contact_area overlap`, the default */
const double NO_TEMPERATURE = -1.0;
}  // namespace

void HeatWalls::take_over(const Fix *fix) {
  walls_.clear();
  for (int k = 0; k < modify->nfix; k++) {
    FixWallGran *wall = dynamic_cast<FixWallGran *>(modify->fix[k]);
    if (!wall) continue;
    const double temperature = wall->*Access::temperature();
    if (!wall->is_mesh_wall() && temperature < 0.0 && temperature != NO_TEMPERATURE)
      fix_failed(lmp, fix,
                 format_text("fix %s has the temperature %g: LIGGGHTS' walls conduct at temperatures >= 0 only",
                             wall->id, temperature));
    if (!(wall->*Access::conducts())) continue;
    if (wall->*Access::area() != AREA_OVERLAP)
      fix_failed(lmp, fix,
                 format_text("fix %s has another 'contact_area' than overlap: allowed is overlap, as keyword 'area' "
                             "of this fix holds at walls, too",
                             wall->id));
    wall->*Access::conducts() = false;
    walls_.push_back(wall);
  }
}

bool HeatWalls::has_mesh() const {
  for (FixWallGran *wall : walls_)
    if (wall->is_mesh_wall()) return true;
  return false;
}

const std::vector<WallContact> &HeatWalls::find_contacts(double reach) {
  contacts_.clear();
  for (FixWallGran *wall : walls_) {
    if (!wall->is_mesh_wall()) touch_primitive(wall, reach);
    for (int k = 0; wall->is_mesh_wall() && k < wall->n_meshes(); k++) touch_mesh(wall->mesh_list()[k], reach);
  }
  if (reach > 0.0) find_walls_in_sight();
  return contacts_;
}

void HeatWalls::touch_primitive(FixWallGran *wall, double reach) {
  int *near;
  const int count = wall->primitiveWall()->getNeighbors(near);
  for (int n = 0; n < count; n++) {
    const int i = near[n];
    if (!(atom->mask[i] & wall->groupbit)) continue;
    WallContact contact = {i, wall->atom_type_wall(), 0.0, wall->*Access::temperature(), false, false, {}};
    const double gap = wall->primitiveWall()->resolveContact(atom->x[i], atom->radius[i], contact.delta);
    contact.distance = atom->radius[i] + gap, contact.touches = gap < 0.0;
    if (gap < 0.0 || gap < reach * atom->radius[i]) contacts_.push_back(contact);
  }
}

/* The nearest point of a wall lies on or behind the tangent plane of a nearer one, or less than 60 degrees aside: both
 * share their paths through the fluid, which fill a cone of some 34 degrees about the shortest. */
static bool is_behind(const WallContact &wall, const WallContact &nearer) {
  double dot = 0.0;
  for (int a = 0; a < 3; a++) dot += wall.delta[a] * nearer.delta[a];
  return dot > 0.5 * wall.distance * nearer.distance || dot >= (1.0 - 1e-9) * nearer.distance * nearer.distance;
}

/* A plane of many triangles, or an edge of two, is one wall; a corner of two planes is two. */
void HeatWalls::find_walls_in_sight() {
  std::vector<WallContact *> order, seen;
  for (WallContact &contact : contacts_) order.push_back(&contact);
  std::stable_sort(order.begin(), order.end(), [](const WallContact *a, const WallContact *b) {
    return a->grain != b->grain ? a->grain < b->grain : a->distance < b->distance;
  });
  for (WallContact *contact : order) {
    if (!seen.empty() && seen.front()->grain != contact->grain) seen.clear();
    contact->in_sight = std::none_of(seen.begin(), seen.end(),
                                     [&](const WallContact *nearer) { return is_behind(*contact, *nearer); });
    if (contact->in_sight) seen.push_back(contact);
  }
}

/* A particle near an edge lies on several triangles. The history of its contacts, in the walls' post_force(), holds
 * those of them that exert a force; their number in it, or -1. */
int HeatWalls::find_partner(FixContactHistoryMesh *history, int i, int triangle) {
  for (int k = 0; k < history->nneighs(i); k++)
    if (history->get_partner_idTri(i, k) == triangle) return k;
  return -1;
}

void HeatWalls::touch_mesh(FixMeshSurface *fix_mesh, double reach) {
  TriMesh *mesh = fix_mesh->triMesh();
  const ScalarContainer<double> *temperature = mesh->prop().getGlobalProperty<ScalarContainer<double>>("Temp");
  if (!temperature) return;
  for (int t = 0; t < mesh->sizeLocal() + mesh->sizeGhost(); t++)
    for (const int i : fix_mesh->meshNeighlist()->get_contact_list(t)) {
      if (i >= atom->nlocal) continue;
      WallContact contact = {i, fix_mesh->atomTypeWall(), 0.0, (*temperature)(0), false, false, {}};
      double corner[3]; /* barycentric coordinates */
      int sides;
      const double radius = atom->radius[i];
      const double gap = mesh->resolveTriSphereContactBary(i, t, radius, atom->x[i], contact.delta, corner, sides);
      contact.distance = radius + gap;
      contact.touches = gap < 0.0 && find_partner(fix_mesh->contactHistory(), i, mesh->id(t)) >= 0;
      if (contact.touches || gap < reach * radius) contacts_.push_back(contact);
    }
}
