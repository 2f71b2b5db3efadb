/* SPDX-License-Identifier: GPL-2.0-or-later */
/* A block of material points for the tests of walls. */
#ifndef DEMPM_TEST_BLOCK_HELP_H
#define DEMPM_TEST_BLOCK_HELP_H

#include "mpm_help.h"

/* A stiff block (8 x 4 points in cells of 0.1) on a plane floor at y = 0. */
typedef struct Block {
  MpmLaw law;
  Mpm *mpm;
  MpmPoint *points;
  int count;
  double dt, mass;
} Block;

/* The core borrows block->law: a block stays where it is made. */
static inline void make_block(Block *block, MpmTransfer transfer, double young, double damping, const double low[3]) {
  const int number[3] = {8, 4, 1};
  *block = (Block){.law = elastic_law(MPM_ELASTIC_PLANE_STRAIN, young, 0.2)};
  MpmScene scene = mpm_scene_default();
  scene.dimension = 2;
  scene.spacing = 0.1;
  scene.transfer = transfer;
  scene.pic_fraction = 0.01;
  scene.point_damping = damping;
  OK(mpm_create(&scene, &block->law, NULL, &block->mpm));
  block->points = make_box(2, low, number, 0.05, 1000.0, 1, &block->count);
  OK(mpm_initialise(block->mpm, block->points, block->count));
  double thermal;
  mpm_critical_time_steps(block->mpm, block->points, block->count, &block->dt, &thermal);
  for (int p = 0; p < block->count; p++) block->mass += block->points[p].mass;
}

static inline void free_block(Block *block) {
  free(block->points);
  mpm_destroy(block->mpm);
  block->law.destroy(block->law.content);
}

static inline double mean_velocity(const Block *block, int axis) {
  double sum = 0.0;
  for (int p = 0; p < block->count; p++) sum += block->points[p].mass * block->points[p].velocity[axis];
  return sum / block->mass;
}

static inline void apply_gravity(Block *block, double gravity) {
  for (int p = 0; p < block->count; p++) block->points[p].force[1] = -gravity * block->points[p].mass;
}

#endif
