/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Shape functions of one axis against what defines them. */
#include "mpm_help.h"

#include "mpm/mpm_shape.h"

static const MpmShape shapes[3] = {MPM_SHAPE_LINEAR, MPM_SHAPE_GIMP, MPM_SHAPE_BSPLINE};
static const double halves[3] = {0.1, 0.25, 0.5};

/* Weights at u; returns the support's first node. */
static int evaluate(MpmShape shape, double u, double half, double value[3], double slope[3]) {
  const int base = (int)floor(mpm_shape_anchor(shape, u, half));
  value[2] = slope[2] = 0.0;
  mpm_shape_axis(shape, u - base, half, value, slope);
  return base;
}

/* S of node `node` at u; 0 outside the support. */
static double value_at(MpmShape shape, double u, double half, int node) {
  double value[3], slope[3];
  const int base = evaluate(shape, u, half, value, slope);
  return node >= base && node < base + mpm_shape_width(shape) ? value[node - base] : 0.0;
}

static void weights_sum_to_one_and_reproduce_the_position(void **state) {
  (void)state;
  for (int s = 0; s < 3; s++)
    for (int h = 0; h < 3; h++)
      for (int n = 0; n <= 1000; n++) {
        const double u = -2.0 + n * 0.005;
        double value[3], slope[3], one = 0.0, zero = 0.0, position = 0.0, unit = 0.0, least = 1.0;
        const int base = evaluate(shapes[s], u, halves[h], value, slope);
        for (int a = 0; a < mpm_shape_width(shapes[s]); a++) {
          one += value[a], zero += slope[a];
          position += value[a] * (base + a), unit += slope[a] * (base + a);
          least = fmin(least, value[a]);
        }
        AT_MOST(fabs(one - 1.0), 1e-15); /* three numbers of size 1: a few units of round-off */
        AT_MOST(fabs(zero), 1e-14);      /* slopes up to 1 / (2 half) = 5 */
        AT_MOST(fabs(position - u), 4e-15);
        AT_MOST(fabs(unit - 1.0), 2e-14);
        AT_MOST(-least, 1e-16); /* never negative, to round-off */
      }
}

static void slopes_are_the_derivatives_of_the_values(void **state) {
  (void)state;
  const double step = 1e-6;
  for (int s = 0; s < 3; s++)
    for (int h = 0; h < 3; h++)
      for (int n = 0; n < 400; n++) {
        /* 0.0137 and the half edges keep the differences away from the kinks. */
        const double u = 0.00137 + n * 0.005;
        double value[3], slope[3];
        const int base = evaluate(shapes[s], u, halves[h], value, slope);
        for (int a = 0; a < mpm_shape_width(shapes[s]); a++) {
          const double difference = (value_at(shapes[s], u + step, halves[h], base + a) -
                                     value_at(shapes[s], u - step, halves[h], base + a)) / (2.0 * step);
          /* Round-off 1e-16 / 1e-6; the parabolas have no third derivative. */
          AT_MOST(fabs(difference - slope[a]), 1e-9);
        }
      }
}

/* uGIMP is the mean of the hat function over the domain (TM-DEMPM eq. 12): midpoint sum with 20,000 pieces, error 1e-9
 * or less per kink. */
static void ugimp_is_the_mean_of_the_hat_function(void **state) {
  (void)state;
  enum { PIECES = 20000 };
  for (int h = 0; h < 3; h++)
    for (int n = 0; n < 40; n++) {
      const double u = 0.013 + n * 0.05;
      double value[3], slope[3];
      const int base = evaluate(MPM_SHAPE_GIMP, u, halves[h], value, slope);
      for (int a = 0; a < 3; a++) {
        double mean = 0.0;
        for (int q = 0; q < PIECES; q++) {
          const double x = u + halves[h] * (2.0 * (q + 0.5) / PIECES - 1.0);
          mean += fmax(0.0, 1.0 - fabs(x - base - a)) / PIECES;
        }
        AT_MOST(fabs(mean - value[a]), 2e-8);
      }
    }
}

/* APIC's rows give the slope of a linear field exactly; linear shape functions away from nodes only (see mpm_shape.h),
 * less there. */
static void affine_rows_are_exact_for_linear_fields(void **state) {
  (void)state;
  for (int s = 0; s < 3; s++)
    for (int h = 0; h < 3; h++)
      for (int n = 0; n <= 100; n++) {
        const double u = n * 0.02;
        double value[3], slope[3], row[3], constant = 0.0, linear = 0.0;
        const int base = evaluate(shapes[s], u, halves[h], value, slope);
        mpm_shape_affine(shapes[s], u - base, value, row);
        for (int a = 0; a < mpm_shape_width(shapes[s]); a++) constant += row[a], linear += row[a] * (base + a);
        AT_MOST(fabs(constant), 1e-13);
        const double f = u - base;
        if (shapes[s] == MPM_SHAPE_LINEAR && f * (1.0 - f) < 0.02) AT_MOST(linear, 1.0);
        else AT_MOST(fabs(linear - 1.0), 1e-13);
      }
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(weights_sum_to_one_and_reproduce_the_position),
      cmocka_unit_test(slopes_are_the_derivatives_of_the_values),
      cmocka_unit_test(ugimp_is_the_mean_of_the_hat_function),
      cmocka_unit_test(affine_rows_are_exact_for_linear_fields),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
