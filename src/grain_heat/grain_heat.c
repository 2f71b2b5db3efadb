/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "grain_heat.h"

#include <math.h>

GrainHeat grain_heat_default(void) {
  return (GrainHeat){.porosity = 0.4, .core = 0.5, .layer = 0.4, .minimum_gap = 2.75e-8, .reach = 0.5};
}

static BaseStatus check_inside(const char *name, double value, double low, double high) {
  if (value > low && value < high) return BASE_OK;
  return base_error(BASE_ERROR_ARGUMENT, "%s is %g, allowed is a number > %g and < %g", name, value, low, high);
}

BaseStatus grain_heat_check(const GrainHeat *model) {
  if (model->direct == GRAIN_DIRECT_NONE && model->indirect == GRAIN_INDIRECT_NONE)
    return base_error(BASE_ERROR_ARGUMENT, "neither a direct nor an indirect model is given: nothing conducts");
  if (model->indirect == GRAIN_INDIRECT_NONE) return BASE_OK;
  TRY(check_inside("the conductivity of the fluid", model->fluid, 0.0, HUGE_VAL));
  if (model->indirect == GRAIN_INDIRECT_LAYER) {
    TRY(check_inside("the thickness of the layer", model->layer, 0.0, HUGE_VAL));
    return check_inside("the minimum gap", model->minimum_gap, 0.0, HUGE_VAL);
  }
  TRY(check_inside("the porosity", model->porosity, 0.0, 1.0));
  TRY(check_inside("the reach", model->reach, 0.0, HUGE_VAL));
  if (model->indirect == GRAIN_INDIRECT_VORONOI_B) return check_inside("the core", model->core, 0.0, 1.0);
  return BASE_OK;
}

static double conduct_directly(const GrainHeat *model, const GrainPair *pair, double radius) {
  switch (model->direct) {
    case GRAIN_DIRECT_COLLISIONAL:
    case GRAIN_DIRECT_BATCHELOR: return grain_direct_batchelor(pair, radius);
    case GRAIN_DIRECT_LIGGGHTS: return grain_direct_liggghts(pair, radius);
    case GRAIN_DIRECT_PIPE: return grain_direct_pipe(pair, radius);
    case GRAIN_DIRECT_NONE: break;
  }
  return 0.0;
}

static double conduct_in_contact(const GrainHeat *model, const GrainPair *pair) {
  if (pair->distance >= pair->radius[0] + pair->radius[1]) return 0.0;
  const double radius = model->area == GRAIN_AREA_HERTZ ? grain_radius_hertz(pair) : grain_radius_geometric(pair);
  return conduct_directly(model, pair, radius);
}

double grain_heat_wall_conductance(const GrainHeat *model, double radius, const double conductivity[2],
                                   double distance) {
  if (distance >= radius) return 0.0;
  const GrainPair pair = {{radius, 0.0}, {conductivity[0], conductivity[1]}, distance};
  const double width = model->area == GRAIN_AREA_HERTZ ? radius : radius + distance;
  return conduct_directly(model, &pair, sqrt(width * (radius - distance)));
}

static double conduct_through_fluid(const GrainHeat *model, const GrainPair *pair) {
  if (model->indirect == GRAIN_INDIRECT_NONE) return 0.0;
  if (model->indirect == GRAIN_INDIRECT_LAYER)
    return grain_indirect_layer(pair, model->fluid, model->layer, model->minimum_gap);
  const double sum = pair->radius[0] + pair->radius[1];
  if (pair->distance - sum >= 0.5 * model->reach * sum) return 0.0;
  const double face = grain_face_radius(pair, model->porosity);
  if (model->indirect == GRAIN_INDIRECT_VORONOI_A) return grain_indirect_voronoi_a(pair, face, model->fluid);
  return grain_indirect_voronoi_b(pair, face, model->fluid, model->core);
}

double grain_heat_wall_reach(const GrainHeat *model) {
  if (model->indirect == GRAIN_INDIRECT_NONE) return 0.0;
  return model->indirect == GRAIN_INDIRECT_LAYER ? model->layer : 0.5 * model->reach;
}

double grain_heat_wall_indirect(const GrainHeat *model, double radius, double conductivity, double distance) {
  if (model->indirect == GRAIN_INDIRECT_NONE) return 0.0;
  if (model->indirect == GRAIN_INDIRECT_LAYER)
    return grain_indirect_layer_wall(radius, distance, model->fluid, model->layer, model->minimum_gap);
  const GrainPair mirror = {{radius, radius}, {conductivity, conductivity}, 2.0 * distance};
  return 2.0 * conduct_through_fluid(model, &mirror);
}

double grain_heat_conductance(const GrainHeat *model, const GrainPair *pair) {
  return conduct_in_contact(model, pair) + conduct_through_fluid(model, pair);
}

double grain_heat_impact_conductance(const GrainHeat *model, const GrainPair *pair, const GrainImpact *impact,
                                     double age, double step) {
  const double share = fmin(fmax((impact->duration - age) / step, 0.0), 1.0);
  if (share == 0.0 || grain_impact_fourier(pair, impact) > 5.0) return grain_heat_conductance(model, pair);
  return share * grain_direct_collisional(pair, impact) + (1.0 - share) * conduct_in_contact(model, pair) +
         conduct_through_fluid(model, pair);
}

double grain_heat_reach(const GrainHeat *model, double radius) {
  switch (model->indirect) {
    case GRAIN_INDIRECT_LAYER: return model->layer * radius;
    case GRAIN_INDIRECT_VORONOI_A:
    case GRAIN_INDIRECT_VORONOI_B: return model->reach * radius;
    case GRAIN_INDIRECT_NONE: break;
  }
  return 0.0;
}
