/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The scene: defaults, checks, and what one call of the kernels asks for. */
#include <math.h>
#include <string.h>

#include "../base/tensor.h"
#include "rve_backend.h"

static const double steps_max = 1e10; /* DEM steps in one call: more is a mistake in units */

RveScene rve_scene_default(void) {
  RveScene scene;
  memset(&scene, 0, sizeof scene);
  scene.dimension = 2;
  scene.grain = RVE_DISK;
  scene.thickness = scene.density = scene.normal_stiffness = scene.tangential_stiffness = scene.friction = NAN;
  scene.expansion = scene.pipe_resistance = scene.grain_heat_capacity = NAN;
  scene.rotation = 1;
  scene.conduction = grain_heat_default();
  scene.grain_conductivity = NAN;
  scene.network_change = 0.01;
  scene.conductivity_every = 1;
  scene.bond_shear_ratio = 0.5;
  scene.bond_melting_temperature = INFINITY;
  scene.time_step_fraction = 0.5;
  scene.share = 1;
  scene.flight = scene.resting = 1;
  return scene;
}

static BaseStatus outside(const char *name, double value, const char *allowed) {
  if (isnan(value)) return base_error(BASE_ERROR_ARGUMENT, "%s is missing or not a number (allowed: %s)", name, allowed);
  return base_error(BASE_ERROR_ARGUMENT, "%s = %g (allowed: %s)", name, value, allowed);
}
static BaseStatus positive(const char *name, double value) {
  return value > 0.0 && isfinite(value) ? BASE_OK : outside(name, value, "> 0");
}
static BaseStatus not_negative(const char *name, double value) {
  return value >= 0.0 && isfinite(value) ? BASE_OK : outside(name, value, ">= 0");
}
static BaseStatus flag(const char *name, int value) {
  return value == 0 || value == 1 ? BASE_OK : outside(name, value, "0 or 1");
}

static BaseStatus check_contact(const RveScene *scene) {
  TRY(positive("density", scene->density));
  TRY(positive("normal_stiffness", scene->normal_stiffness));
  TRY(not_negative("tangential_stiffness", scene->tangential_stiffness));
  if (scene->tangential_stiffness > 0.0) TRY(not_negative("friction", scene->friction));
  TRY(not_negative("normal_viscosity", scene->normal_viscosity));
  TRY(not_negative("tangential_viscosity", scene->tangential_viscosity));
  TRY(not_negative("critical_damping", scene->critical_damping));
  if (!(scene->local_damping >= 0.0 && scene->local_damping < 1.0))
    return outside("local_damping", scene->local_damping, "0 <= local_damping < 1");
  return flag("rotation", scene->rotation);
}

static BaseStatus check_conduction(const RveScene *scene) {
  TRY(flag("network", scene->network));
  TRY(not_negative("network_change", scene->network_change));
  if (scene->conductivity_every < 1) return outside("conductivity_every", scene->conductivity_every, ">= 1");
  if (scene->conduction.direct == GRAIN_DIRECT_NONE && scene->conduction.indirect == GRAIN_INDIRECT_NONE)
    return positive("pipe_resistance", scene->pipe_resistance);
  if (scene->conduction.direct == GRAIN_DIRECT_COLLISIONAL)
    return base_error(BASE_ERROR_ARGUMENT, "conduction.direct = collisional (allowed: none, batchelor, liggghts, pipe)");
  if (!isnan(scene->pipe_resistance))
    return base_error(BASE_ERROR_ARGUMENT, "pipe_resistance and a conduction model exclude each other");
  TRY(grain_heat_check(&scene->conduction));
  return positive("grain_conductivity", scene->grain_conductivity);
}

static BaseStatus check_heat(const RveScene *scene) {
  TRY(flag("thermal", scene->thermal));
  if (!scene->thermal) return BASE_OK;
  TRY(not_negative("expansion", scene->expansion));
  if (!isfinite(scene->reference_temperature))
    return outside("reference_temperature", scene->reference_temperature, "a finite temperature");
  return check_conduction(scene);
}

static BaseStatus check_bonds(const RveScene *scene) {
  TRY(flag("bonds", scene->bonds));
  if (!scene->bonds) return BASE_OK;
  TRY(not_negative("bond_strength", scene->bond_strength));
  TRY(not_negative("bond_shear_ratio", scene->bond_shear_ratio));
  const double melting = scene->bond_melting_temperature;
  if (isnan(melting)) return outside("bond_melting_temperature", melting, "a temperature or INFINITY");
  if (scene->thermal && !(melting > scene->reference_temperature))
    return base_error(BASE_ERROR_ARGUMENT, "bond_melting_temperature = %g (allowed: > reference_temperature = %g)", melting,
                      scene->reference_temperature);
  return BASE_OK;
}

static BaseStatus check_steps(const RveScene *scene) {
  TRY(not_negative("time_step", scene->time_step));
  if (scene->time_step == 0.0 && !(scene->time_step_fraction > 0.0 && scene->time_step_fraction <= 1.0))
    return outside("time_step_fraction", scene->time_step_fraction, "0 < time_step_fraction <= 1");
  if (scene->substeps < 0) return outside("substeps", scene->substeps, ">= 0");
  if (!(scene->skin >= 0.0 && scene->skin <= 1.0)) return outside("skin", scene->skin, "0 <= skin <= 1");
  TRY(flag("mixed", scene->mixed));
  TRY(flag("share", scene->share));
  TRY(flag("flight", scene->flight));
  TRY(flag("resting", scene->resting));
  if (scene->threads < 0) return outside("threads", scene->threads, ">= 0");
  return BASE_OK;
}

BaseStatus rve_scene_check(const RveScene *scene) {
  if (scene->dimension != 2 && scene->dimension != 3) return outside("dimension", scene->dimension, "2 or 3");
  if (scene->grain != RVE_DISK && scene->grain != RVE_SPHERE) return outside("grain", scene->grain, "disk or sphere");
  if (scene->dimension == 3 && scene->grain != RVE_SPHERE)
    return base_error(BASE_ERROR_ARGUMENT, "grain = disk (allowed in 3D: sphere)");
  if (scene->dimension == 2) TRY(positive("thickness", scene->thickness));
  TRY(check_contact(scene));
  TRY(check_heat(scene));
  TRY(check_bonds(scene));
  return check_steps(scene);
}

uint64_t rve_scene_hash(const RveScene *scene) {
  const int32_t kind[] = {scene->dimension, (int32_t)scene->grain, scene->thermal, scene->bonds,
                          scene->tangential_stiffness > 0.0};
  const double size[] = {scene->dimension == 2 ? scene->thickness : 1.0, scene->density};
  return base_hash(size, sizeof size, base_hash(kind, sizeof kind, BASE_HASH_SEED));
}

RveFeatures rve_scene_features(const RveScene *scene) {
  RveFeatures features = {scene->dimension, scene->tangential_stiffness > 0.0, 0, scene->bonds};
  features.viscous =
      scene->normal_viscosity > 0.0 || scene->tangential_viscosity > 0.0 || scene->critical_damping > 0.0;
  return features;
}

static void call_material(const RveScene *scene, RveCall *call) {
  const int sticks = scene->tangential_stiffness > 0.0;
  call->normal_stiffness = scene->normal_stiffness;
  call->tangential_stiffness = scene->tangential_stiffness;
  call->friction = sticks ? scene->friction : 0.0;
  call->normal_viscosity = scene->normal_viscosity;
  call->tangential_viscosity = sticks ? scene->tangential_viscosity : 0.0;
  call->critical_viscosity = 2.0 * scene->critical_damping * sqrt(scene->normal_stiffness);
  call->local_damping = scene->local_damping;
  call->rotation = scene->rotation;
  call->thermal = scene->thermal;
  call->expansion = scene->thermal ? scene->expansion : 0.0;
  call->reference_temperature = scene->reference_temperature;
  /* With a conduction model the kernels' sum over pipes is replaced afterwards. */
  call->pipe_resistance = scene->thermal && !isnan(scene->pipe_resistance) ? scene->pipe_resistance : 1.0;
  call->bond_strength = scene->bond_strength;
  call->bond_shear_ratio = scene->bond_shear_ratio;
  call->bond_melting_temperature = scene->bond_melting_temperature;
  call->skin_fraction = scene->skin;
  call->thickness = scene->dimension == 2 ? scene->thickness : 1.0;
  call->flight = scene->flight;
  call->resting = scene->resting;
}

/* exp(factor a) - 1. Small ones by their own series: adding the unit first would round away what thousands of steps add up. */
static void exponential_minus_one(const double a[9], double factor, double e[9]) {
  double norm = 0.0, scaled[9], term[9], product[9];
  for (int k = 0; k < 9; k++) norm = fmax(norm, fabs(scaled[k] = a[k] * factor));
  if (norm > 0.05) {
    tensor_exponential(a, factor, e);
    for (int k = 0; k < 9; k += 4) e[k] -= 1.0;
    return;
  }
  memcpy(e, scaled, sizeof scaled);
  memcpy(term, scaled, sizeof scaled);
  for (int order = 2; order <= 10; order++) {
    tensor_multiply(term, scaled, product);
    for (int k = 0; k < 9; k++) term[k] = product[k] / order, e[k] += term[k];
  }
}

/* L per DEM step, its exponential, and its symmetric and rotating parts. */
static void call_deformation(const RveScene *scene, const double gradient[9], double factor, RveCall *call) {
  double spin[9], norm = 0.0;
  call->moving = call->turning = 0;
  for (int k = 0; k < 9; k++) {
    const int in_plane = scene->dimension == 3 || (k / 3 < 2 && k % 3 < 2);
    call->gradient[k] = in_plane ? gradient[k] * factor : 0.0;
    call->moving |= call->gradient[k] != 0.0;
  }
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) {
      call->rate[3 * i + j] = 0.5 * (call->gradient[3 * i + j] + call->gradient[3 * j + i]);
      spin[3 * i + j] = 0.5 * (call->gradient[3 * i + j] - call->gradient[3 * j + i]);
      norm += call->rate[3 * i + j] * call->rate[3 * i + j];
      call->turning |= scene->dimension == 3 && spin[3 * i + j] != 0.0;
    }
  exponential_minus_one(call->gradient, call->dt, call->step_map);
  tensor_exponential(spin, call->dt, call->turn);
  call->shorten = exp(sqrt(norm) * call->dt);
}

BaseStatus rve_call_make(const RveScene *scene, const RveHead *head, const RveInput *input, double duration, RveCall *call) {
  memset(call, 0, sizeof *call);
  call_material(scene, call);
  const double stable = scene->time_step > 0.0 ? scene->time_step : scene->time_step_fraction * head->critical_time_step;
  double factor = 1.0;
  call->dt = stable;
  call->temperature = scene->thermal && duration > 0.0 ? input->temperature : head->temperature;
  if (duration > 0.0 && scene->substeps > 0) {
    call->steps = scene->substeps;
    factor = duration / ((double)call->steps * stable);
  } else if (duration > 0.0) {
    const double steps = ceil(duration / stable * (1.0 - 1e-12));
    if (!(steps <= steps_max))
      return base_error(BASE_ERROR_ARGUMENT, "a step of %g s takes %g DEM steps of %g s (allowed: at most %g)", duration, steps,
                        stable, steps_max);
    call->steps = steps < 1.0 ? 1 : (int64_t)steps;
    call->dt = duration / (double)call->steps;
  }
  call_deformation(scene, input->velocity_gradient, factor, call);
  if (call->steps == 0) memcpy(call->rate, head->rate, sizeof call->rate);
  return BASE_OK;
}
