/* SPDX-License-Identifier: GPL-2.0-or-later */
/* What is refused: every message names the entry, what was given and what is allowed. */
#include "mpm_help.h"

static void expect(BaseStatus status, BaseStatus wanted, const char *first, const char *second) {
  assert_int_equal(status, wanted);
  const char *message = base_error_message();
  if (!strstr(message, first) || !strstr(message, second)) fail_msg("'%s' lacks '%s' or '%s'", message, first, second);
}

static MpmScene valid_scene(void) {
  MpmScene scene = mpm_scene_default();
  scene.dimension = 2;
  scene.spacing = 0.1;
  return scene;
}

#define REFUSED(entry, value, first, second)                                   \
  do {                                                                         \
    MpmScene scene = valid_scene();                                            \
    scene.entry = (value);                                                     \
    expect(mpm_scene_check(&scene), BASE_ERROR_ARGUMENT, first, second);       \
  } while (0)

static void wrong_scenes_are_refused(void **state) {
  (void)state;
  const MpmScene good = valid_scene();
  OK(mpm_scene_check(&good));
  REFUSED(dimension, 4, "dimension", "2 to 3");
  REFUSED(spacing, 0.0, "spacing", "> 0");
  REFUSED(spacing, NAN, "spacing", "nan");
  REFUSED(spacing, INFINITY, "spacing", "inf");
  REFUSED(origin[1], NAN, "origin y", "finite");
  REFUSED(shape, (MpmShape)3, "shape", "0 to 2");
  REFUSED(transfer, (MpmTransfer)-1, "transfer", "-1");
  REFUSED(order, (MpmOrder)7, "order", "7");
  REFUSED(pic_fraction, 1.5, "pic_fraction", "0 to 1");
  REFUSED(pic_fraction, NAN, "pic_fraction", "nan");
  REFUSED(point_damping, -1.0, "point_damping", "-1");
  REFUSED(grid_damping, NAN, "grid_damping", "nan");
  REFUSED(mass_cutoff, 0.5, "mass_cutoff", "0.5");
  REFUSED(threads, -1, "threads", "-1");
  REFUSED(gimp_stretch, 2, "gimp_stretch", "0 to 1");
  REFUSED(mechanical, 0, "mechanical", "thermal");
  MpmScene scene = valid_scene();
  scene.transfer = MPM_TRANSFER_XPIC, scene.xpic_order = 11;
  expect(mpm_scene_check(&scene), BASE_ERROR_ARGUMENT, "xpic_order", "1 to 10");
  scene = valid_scene();
  scene.periodic[0] = 1, scene.period[0] = 0.3;
  expect(mpm_scene_check(&scene), BASE_ERROR_ARGUMENT, "period x", "at least 4");
  scene.period[0] = 0.45;
  expect(mpm_scene_check(&scene), BASE_ERROR_ARGUMENT, "period x", "whole multiple");
  scene.period[0] = 0.5;
  OK(mpm_scene_check(&scene));
  MpmLaw law = elastic_law(MPM_ELASTIC_PLANE_STRAIN, 1.0, 0.0);
  Mpm *mpm;
  expect(mpm_create(&scene, &law, NULL, &mpm), BASE_ERROR_ARGUMENT, "periodic", "halo");
  assert_null(mpm);
  mpm_destroy(NULL);
  law.destroy(law.content);
}

static void wrong_walls_and_tractions_are_refused(void **state) {
  (void)state;
  MpmLaw law = elastic_law(MPM_ELASTIC_PLANE_STRAIN, 1.0, 0.0);
  const MpmScene scene = valid_scene();
  Mpm *mpm;
  OK(mpm_create(&scene, &law, NULL, &mpm));
  const MpmWall good = plane_wall(1, 0.0, 1.0, MPM_WALL_FRICTION);
  MpmWall walls[2] = {good, good};
  OK(mpm_set_walls(mpm, walls, 2));
  walls[1].normal[0] = 1.0;
  expect(mpm_set_walls(mpm, walls, 2), BASE_ERROR_ARGUMENT, "wall 2 of 2", "normal");
  walls[1] = good, walls[1].normal[1] = 0.0, walls[1].normal[2] = 1.0;
  expect(mpm_set_walls(mpm, walls, 2), BASE_ERROR_ARGUMENT, "normal z", "two dimensions");
  walls[1] = good, walls[1].friction = -0.1;
  expect(mpm_set_walls(mpm, walls, 2), BASE_ERROR_ARGUMENT, "friction", "-0.1");
  walls[1] = good, walls[1].heat = MPM_WALL_TEMPERATURE;
  expect(mpm_set_walls(mpm, walls, 2), BASE_ERROR_ARGUMENT, "temperature", "thermal");
  walls[1] = good, walls[1].kind = MPM_WALL_BOX;
  expect(mpm_set_walls(mpm, walls, 2), BASE_ERROR_ARGUMENT, "box", "low");
  walls[1] = good, walls[1].point[0] = NAN;
  expect(mpm_set_walls(mpm, walls, 2), BASE_ERROR_ARGUMENT, "point[0]", "nan");
  walls[1] = good, walls[1].range[0][0] = 2.0, walls[1].range[1][0] = 1.0;
  expect(mpm_set_walls(mpm, walls, 2), BASE_ERROR_ARGUMENT, "range", "2 to 1");
  walls[1] = good, walls[1].velocity[1] = INFINITY;
  expect(mpm_set_walls(mpm, walls, 2), BASE_ERROR_ARGUMENT, "velocity", "inf");
  walls[1] = good, walls[1].contact = (MpmWallContact)9;
  expect(mpm_set_walls(mpm, walls, 2), BASE_ERROR_ARGUMENT, "contact", "9");
  MpmTraction traction = {.axis = 2, .side = 1};
  expect(mpm_set_tractions(mpm, &traction, 1), BASE_ERROR_ARGUMENT, "axis", "0 to 1");
  traction = (MpmTraction){.axis = 0, .side = 0};
  expect(mpm_set_tractions(mpm, &traction, 1), BASE_ERROR_ARGUMENT, "side", "-1 and 1");
  traction = (MpmTraction){.axis = 0, .side = 1, .traction = {NAN, 0, 0}};
  expect(mpm_set_tractions(mpm, &traction, 1), BASE_ERROR_ARGUMENT, "component 0", "nan");
  mpm_destroy(mpm);
  law.destroy(law.content);
}

static void wrong_elastic_constants_are_refused(void **state) {
  (void)state;
  const MpmElastic good = {
      .mode = MPM_ELASTIC_3D, .young = 1.0, .poisson = 0.3, .conductivity = {1, 1, 1, 0, 0, 0}, .thermal = 1};
  MpmLaw law;
  MpmElastic e = good;
  e.young = 0.0;
  expect(mpm_elastic_create(&e, &law), BASE_ERROR_ARGUMENT, "young", "> 0");
  e = good, e.poisson = 0.5;
  expect(mpm_elastic_create(&e, &law), BASE_ERROR_ARGUMENT, "poisson", "< 0.5");
  e = good, e.mode = MPM_ELASTIC_BAR;
  expect(mpm_elastic_create(&e, &law), BASE_ERROR_ARGUMENT, "poisson", "bar");
  e = good, e.expansion = -1.0;
  expect(mpm_elastic_create(&e, &law), BASE_ERROR_ARGUMENT, "expansion", ">= 0");
  e = good, e.conductivity[3] = 2.0;
  expect(mpm_elastic_create(&e, &law), BASE_ERROR_ARGUMENT, "conductivity", "negative");
  e = good, e.conductivity[0] = NAN;
  expect(mpm_elastic_create(&e, &law), BASE_ERROR_ARGUMENT, "conductivity[0]", "nan");
  e = good, e.mode = (MpmElasticMode)4;
  expect(mpm_elastic_create(&e, &law), BASE_ERROR_ARGUMENT, "mode", "0 to 3");
}

/* A law that answers NaN for one tag; D: a NaN is caught within one step and names the point. */
static BaseStatus update_with_nan(void *content, MpmLawBatch *batch) {
  for (int p = 0; p < batch->n; p++) {
    batch->modulus[p] = 1.0;
    if (batch->tag[p] == *(int64_t *)content) batch->stress[6 * p + 3] = NAN;
  }
  return BASE_OK;
}

static void a_fault_names_the_lowest_point_within_the_step(void **state) {
  (void)state;
  int64_t bad = 17;
  MpmLaw law = {"nan", &bad, 0, update_with_nan, NULL, NULL, NULL};
  MpmScene scene = valid_scene();
  const double low[3] = {0, 0, 0};
  const int number[3] = {6, 6, 1};
  int count;
  Mpm *mpm;
  MpmPoint *points = make_box(2, low, number, 0.05, 1000.0, 1, &count);
  OK(mpm_create(&scene, &law, NULL, &mpm));
  expect(mpm_initialise(mpm, points, count), BASE_ERROR_UNSTABLE, "point 17:", "stress is not finite");
  for (int p = 0; p < count; p++) memset(points[p].stress, 0, sizeof points[p].stress);
  expect(mpm_step(mpm, points, count, 1e-3), BASE_ERROR_UNSTABLE, "point 17:", "stress");
  bad = 0;
  for (int p = 0; p < count; p++) memset(points[p].stress, 0, sizeof points[p].stress);
  points[20].position[1] = NAN, points[30].position[0] = 1e9;
  expect(mpm_step(mpm, points, count, 1e-3), BASE_ERROR_UNSTABLE, "point 21:", "position");
  free(points);
  points = make_box(2, low, number, 0.05, 1000.0, 1, &count);
  points[30].position[0] = 1e9;
  expect(mpm_step(mpm, points, count, 1e-3), BASE_ERROR_UNSTABLE, "point 31:", "cells away");
  points[30].position[0] = 0.1, points[3].velocity[0] = INFINITY;
  expect(mpm_step(mpm, points, count, 1e-3), BASE_ERROR_UNSTABLE, "point 4:", "velocity");
  points[3].velocity[0] = 0.0, points[8].size0[0] = 0.2;
  expect(mpm_step(mpm, points, count, 1e-3), BASE_ERROR_ARGUMENT, "point 9:", "size0");
  points[8].size0[0] = 0.05, points[8].mass = 0.0;
  expect(mpm_step(mpm, points, count, 1e-3), BASE_ERROR_ARGUMENT, "point 9:", "mass");
  points[8].mass = 1.0, points[9].tag = 9, points[9].position[0] = points[8].position[0];
  expect(mpm_step(mpm, points, count, 1e-3), BASE_ERROR_ARGUMENT, "point 9:", "twice");
  points[9].tag = 10;
  OK(mpm_step(mpm, points, count, 1e-3)); /* and the core goes on after an error */
  expect(mpm_step(mpm, points, count, 0.0), BASE_ERROR_ARGUMENT, "time step", "> 0");
  expect(mpm_step(mpm, points, -1, 1e-3), BASE_ERROR_ARGUMENT, "number of points", "-1");
  OK(mpm_step(mpm, points, 0, 1e-3)); /* a rank without points */
  OK(mpm_step(mpm, points, count / 2, 1e-3));
  OK(mpm_step(mpm, points, count, 1e-3));
  free(points);
  mpm_destroy(mpm);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(wrong_scenes_are_refused),
      cmocka_unit_test(wrong_walls_and_tractions_are_refused),
      cmocka_unit_test(wrong_elastic_constants_are_refused),
      cmocka_unit_test(a_fault_names_the_lowest_point_within_the_step),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
