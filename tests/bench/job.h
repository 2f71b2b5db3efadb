/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The grains of the job that is compared with other DEM codes (rve.py): spheres, 2D in one layer. */
#ifndef DEMPM_BENCH_JOB_H
#define DEMPM_BENCH_JOB_H

#include "cuda_rve/rve.h"

static inline RveScene job_scene(int dimension) {
  RveScene scene = rve_scene_default();
  scene.dimension = dimension;
  scene.grain = RVE_SPHERE;
  scene.thickness = 0.01;
  scene.density = 2650.0;
  scene.normal_stiffness = scene.tangential_stiffness = 1e6;
  scene.friction = 0.5;
  scene.local_damping = 0.2;
  scene.time_step = 2e-6;
  scene.threads = 1;
  scene.share = 0; /* all RVEs of a batch do the same: each must work for itself */
  return scene;
}

#endif
