/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Defaults and checks of what the caller configures. */
#include "mpm.h"

#include <math.h>

MpmScene mpm_scene_default(void) {
  return (MpmScene){.dimension = 3,
                    .shape = MPM_SHAPE_GIMP,
                    .transfer = MPM_TRANSFER_FLIP,
                    .xpic_order = 2,
                    .order = MPM_ORDER_USF,
                    .mechanical = 1,
                    .mass_cutoff = 1e-30};
}

static BaseStatus check_number(const char *entry, double value, double low, double high) {
  if (value >= low && value <= high) return BASE_OK;
  if (high == INFINITY) return base_error(BASE_ERROR_ARGUMENT, "scene: %s is %g; allowed: >= %g", entry, value, low);
  return base_error(BASE_ERROR_ARGUMENT, "scene: %s is %g; allowed: %g to %g", entry, value, low, high);
}

static BaseStatus check_integer(const char *entry, int value, int low, int high) {
  if (value >= low && value <= high) return BASE_OK;
  return base_error(BASE_ERROR_ARGUMENT, "scene: %s is %d; allowed: %d to %d", entry, value, low, high);
}

static BaseStatus check_box(const MpmScene *scene) {
  static const char *const axis[3] = {"x", "y", "z"};
  if (!(scene->spacing > 0.0 && isfinite(scene->spacing)))
    return base_error(BASE_ERROR_ARGUMENT, "scene: spacing is %g; allowed: finite and > 0", scene->spacing);
  for (int i = 0; i < scene->dimension; i++) {
    if (!isfinite(scene->origin[i]))
      return base_error(BASE_ERROR_ARGUMENT, "scene: origin %s is %g; it must be finite", axis[i], scene->origin[i]);
    if (!scene->periodic[i]) continue;
    const double cells = scene->period[i] / scene->spacing, whole = round(cells);
    if (!(isfinite(cells) && whole >= 4.0 && fabs(cells - whole) <= 1e-9 * whole))
      return base_error(BASE_ERROR_ARGUMENT,
                        "scene: period %s is %g, %g times the spacing; allowed: a whole multiple, at least 4", axis[i],
                        scene->period[i], cells);
  }
  return BASE_OK;
}

BaseStatus mpm_scene_check(const MpmScene *scene) {
  TRY(check_integer("dimension", scene->dimension, 2, 3));
  TRY(check_box(scene));
  TRY(check_integer("shape", (int)scene->shape, MPM_SHAPE_LINEAR, MPM_SHAPE_BSPLINE));
  TRY(check_integer("transfer", (int)scene->transfer, MPM_TRANSFER_FLIP, MPM_TRANSFER_XPIC));
  TRY(check_integer("order", (int)scene->order, MPM_ORDER_USF, MPM_ORDER_MUSL));
  TRY(check_integer("volumetric", (int)scene->volumetric, MPM_VOLUMETRIC_POINT, MPM_VOLUMETRIC_CELL));
  TRY(check_number("pic_fraction", scene->pic_fraction, 0.0, 1.0));
  if (scene->transfer == MPM_TRANSFER_XPIC) TRY(check_integer("xpic_order", scene->xpic_order, 1, 10));
  TRY(check_number("point_damping", scene->point_damping, 0.0, 1e300));
  TRY(check_number("grid_damping", scene->grid_damping, 0.0, 1e300));
  TRY(check_number("mass_cutoff", scene->mass_cutoff, 0.0, 1e-3));
  TRY(check_integer("threads", scene->threads, 0, 4096));
  TRY(check_integer("gimp_stretch", scene->gimp_stretch, 0, scene->shape == MPM_SHAPE_GIMP));
  if (!scene->mechanical && !scene->thermal)
    return base_error(BASE_ERROR_ARGUMENT, "scene: mechanical and thermal are both 0; at least one must be 1");
  return BASE_OK;
}

void mpm_point_default(MpmPoint *point) {
  *point = (MpmPoint){.size0 = {0.0, 0.0, 1.0}};
  for (int i = 0; i < 3; i++) point->deformation_gradient[4 * i] = 1.0;
}

MpmWall mpm_wall_default(void) {
  MpmWall wall = {.kind = MPM_WALL_PLANE,
                  .contact = MPM_WALL_NO_CONTACT,
                  .separable = 1,
                  .heat = MPM_WALL_ADIABATIC,
                  .sides = MPM_SIDE_FRONT | MPM_SIDE_BACK};
  for (int i = 0; i < 3; i++) wall.range[0][i] = -INFINITY, wall.range[1][i] = INFINITY;
  return wall;
}

static BaseStatus check_plane(const MpmWall *wall, int dimension) {
  double square = 0.0;
  for (int i = 0; i < 3; i++) {
    if (!isfinite(wall->point[i]))
      return base_error(BASE_ERROR_ARGUMENT, "wall: point[%d] is %g; it must be finite", i, wall->point[i]);
    square += wall->normal[i] * wall->normal[i];
  }
  if (!(fabs(square - 1.0) <= 1e-9))
    return base_error(BASE_ERROR_ARGUMENT, "wall: normal (%g, %g, %g) has length %g; it must have length 1",
                      wall->normal[0], wall->normal[1], wall->normal[2], sqrt(square));
  if (dimension == 2 && wall->normal[2] != 0.0)
    return base_error(BASE_ERROR_ARGUMENT, "wall: normal z is %g; in two dimensions it must be 0", wall->normal[2]);
  return BASE_OK;
}

static BaseStatus check_ranges(const MpmWall *wall, int dimension) {
  for (int i = 0; i < dimension; i++) {
    if (wall->kind == MPM_WALL_BOX && !(wall->low[i] < wall->high[i]))
      return base_error(BASE_ERROR_ARGUMENT, "wall: box axis %d reaches from %g to %g; low must be below high", i,
                        wall->low[i], wall->high[i]);
    if (!(wall->range[0][i] <= wall->range[1][i]))
      return base_error(BASE_ERROR_ARGUMENT, "wall: range of axis %d is %g to %g; the first must not exceed the second",
                        i, wall->range[0][i], wall->range[1][i]);
    if (!isfinite(wall->velocity[i]))
      return base_error(BASE_ERROR_ARGUMENT, "wall: velocity[%d] is %g; it must be finite", i, wall->velocity[i]);
  }
  return BASE_OK;
}

BaseStatus mpm_wall_check(const MpmWall *wall, int dimension, int thermal) {
  if ((int)wall->kind < MPM_WALL_PLANE || wall->kind > MPM_WALL_SURFACE)
    return base_error(BASE_ERROR_ARGUMENT, "wall: kind is %d; allowed: 0 (plane), 1 (box), 2 (surface)",
                      (int)wall->kind);
  if (wall->kind == MPM_WALL_SURFACE && (wall->facet_count < 1 || !wall->facets))
    return base_error(BASE_ERROR_ARGUMENT, "wall: the surface has no facets");
  if (wall->kind == MPM_WALL_SURFACE && (wall->sides < 1 || wall->sides > 3))
    return base_error(BASE_ERROR_ARGUMENT, "wall: sides is %d; allowed: 1 (front), 2 (back), 3 (both)", wall->sides);
  if ((int)wall->contact < MPM_WALL_NO_CONTACT || wall->contact > MPM_WALL_FRICTION)
    return base_error(BASE_ERROR_ARGUMENT, "wall: contact is %d; allowed: 0 to 3", (int)wall->contact);
  if ((int)wall->heat < MPM_WALL_ADIABATIC || wall->heat > MPM_WALL_FLUX)
    return base_error(BASE_ERROR_ARGUMENT, "wall: heat is %d; allowed: 0 to 2", (int)wall->heat);
  if (wall->kind == MPM_WALL_PLANE) TRY(check_plane(wall, dimension));
  TRY(check_ranges(wall, dimension));
  if (wall->contact == MPM_WALL_FRICTION && !(wall->friction >= 0.0 && isfinite(wall->friction)))
    return base_error(BASE_ERROR_ARGUMENT, "wall: friction is %g; allowed: finite and >= 0", wall->friction);
  if (wall->heat != MPM_WALL_ADIABATIC && !thermal)
    return base_error(BASE_ERROR_ARGUMENT, "wall: a temperature or a heat flux needs a thermal scene");
  if (wall->heat == MPM_WALL_TEMPERATURE && !isfinite(wall->temperature))
    return base_error(BASE_ERROR_ARGUMENT, "wall: temperature is %g; it must be finite", wall->temperature);
  if (wall->heat == MPM_WALL_FLUX && !isfinite(wall->flux))
    return base_error(BASE_ERROR_ARGUMENT, "wall: flux is %g; it must be finite", wall->flux);
  return BASE_OK;
}
