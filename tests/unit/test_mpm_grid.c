/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The active grid: sparse, complete, periodic. */
#include "mpm_help.h"

static void nodes_follow_the_points_and_not_the_box(void **state) {
  (void)state;
  MpmLaw law = elastic_law(MPM_ELASTIC_3D, 1.0, 0.0);
  for (int dimension = 2; dimension <= 3; dimension++)
    for (int shape = 0; shape < 3; shape++) {
      MpmScene scene = mpm_scene_default();
      scene.dimension = dimension;
      scene.spacing = 0.1;
      scene.shape = (MpmShape)shape;
      Mpm *mpm;
      OK(mpm_create(&scene, &law, NULL, &mpm));
      /* Two points, 900,000 cells apart in each direction: a dense box would have 10^12 nodes or more. */
      MpmPoint points[2];
      for (int p = 0; p < 2; p++) {
        mpm_point_default(&points[p]);
        points[p].tag = p + 1;
        points[p].mass = points[p].volume0 = 1.0 + p;
        for (int i = 0; i < dimension; i++)
          points[p].size0[i] = 0.05, points[p].position[i] = p ? 45000.033 : -45000.021;
      }
      OK(mpm_step(mpm, points, 2, 1e-6));
      MpmGridView view;
      mpm_grid_view(mpm, &view);
      const int width = shape == MPM_SHAPE_LINEAR ? 2 : 3,
                support = dimension == 3 ? width * width * width : width * width;
      assert_int_equal(view.nodes, 2 * support);
      double mass = 0.0;
      for (int n = 0; n < view.nodes; n++) {
        mass += view.mass[n];
        assert_int_equal(view.owned[n], 1);
        for (int i = 0; i < dimension; i++) assert_true(abs(abs(view.index[3 * n + i]) - 450000) <= 3);
      }
      AT_MOST(fabs(mass - 3.0), 1e-11); /* the weights of a point at 450,000 cells carry 450,000 units of round-off */
      mpm_destroy(mpm);
    }
  law.destroy(law.content);
}

/* One rank of a periodic box: its foreign points are images of its own. */
typedef struct ImageHalo {
  double period;
  int count;
  int index[2000];
  MpmPoint foreign[2000];
} ImageHalo;

static BaseStatus image_begin(void *content, const MpmPoint *own, int own_count, double reach, const MpmPoint **foreign,
                              int *foreign_count) {
  ImageHalo *halo = content;
  (void)reach; /* all of them: more than needed does no harm */
  halo->count = 0;
  for (int side = -1; side <= 1; side += 2)
    for (int p = 0; p < own_count; p++) {
      halo->index[halo->count] = p;
      halo->foreign[halo->count] = own[p];
      halo->foreign[halo->count++].position[0] += side * halo->period;
    }
  *foreign = halo->foreign;
  *foreign_count = halo->count;
  return BASE_OK;
}

static BaseStatus image_forward(void *content, int width, const double *value, double *foreign_value) {
  const ImageHalo *halo = content;
  for (int f = 0; f < halo->count; f++)
    memcpy(foreign_value + f * width, value + halo->index[f] * width, (size_t)width * sizeof *value);
  return BASE_OK;
}

/* A body that lies across the periodic boundary moves as one that lies in the middle. */
static void a_body_across_a_periodic_boundary_is_whole(void **state) {
  (void)state;
  const double period = 1.6, low[3] = {0.513, 0.2, 0.0};
  const int number[3] = {10, 6, 1};
  MpmPoint *body[2];
  int count;
  for (int shape = 0; shape < 3; shape++) {
    for (int across = 0; across < 2; across++) {
      MpmLaw law = elastic_law(MPM_ELASTIC_PLANE_STRAIN, 1e4, 0.3);
      static ImageHalo content;
      content = (ImageHalo){.period = period};
      const MpmHalo halo = {&content, image_begin, image_forward, NULL};
      MpmScene scene = mpm_scene_default();
      scene.dimension = 2;
      scene.spacing = 0.1;
      scene.shape = (MpmShape)shape;
      scene.periodic[0] = 1, scene.period[0] = period;
      Mpm *mpm;
      OK(mpm_create(&scene, &law, &halo, &mpm));
      body[across] = make_box(2, low, number, 0.05, 1000.0, 1, &count);
      uint64_t seed = 3;
      for (int p = 0; p < count; p++) {
        for (int i = 0; i < 2; i++) body[across][p].velocity[i] = 0.2 * (base_random(&seed) - 0.5);
        double *x = &body[across][p].position[0];
        if (across) *x += 0.8;
        if (*x > period) *x -= period;
      }
      OK(mpm_initialise(mpm, body[across], count));
      for (int s = 0; s < 300; s++) OK(mpm_step(mpm, body[across], count, 3e-3));
      mpm_destroy(mpm);
      law.destroy(law.content);
    }
    int wrapped = 0;
    for (int p = 0; p < count; p++) {
      double distance = body[1][p].position[0] - body[0][p].position[0] - 0.8;
      if (distance < -0.5 * period) distance += period, wrapped++;
      /* Not bit for bit: x + 0.8 rounds otherwise. 300 steps of about 4 round-offs each, amplified by the motion. */
      AT_MOST(fabs(distance), 1e-10);
      for (int i = 0; i < 2; i++) AT_MOST(fabs(body[1][p].velocity[i] - body[0][p].velocity[i]), 1e-9);
    }
    assert_in_range(wrapped, 10, count - 10);
    free(body[0]), free(body[1]);
  }
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(nodes_follow_the_points_and_not_the_box),
      cmocka_unit_test(a_body_across_a_periodic_boundary_is_whole),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
