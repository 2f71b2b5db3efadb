/* SPDX-License-Identifier: GPL-2.0-or-later */
#include <math.h>

#include "grain_heat.h"
#include "grain_heat_private.h"

#define PI 3.14159265358979323846

/* k0 k1 / (k0 + k1), W/(m K): half the harmonic mean. */
static double join_conductivities(const double k[2]) {
  return k[0] > 0.0 && k[1] > 0.0 ? k[0] * k[1] / (k[0] + k[1]) : 0.0;
}

/* Heron: 16 area^2 of the triangle of both centres and a point of the circle. The product (d + (a - b)) (d - (a - b))
 * keeps its bits when a and b change places. */
double grain_circle(double a, double b, double d) {
  const double sixteen = (a + b - d) * (a + b + d) * ((d + (a - b)) * (d - (a - b)));
  return sqrt(fmax(sixteen, 0.0)) / (2.0 * d);
}

double grain_radius_geometric(const GrainPair *pair) {
  const double a = pair->radius[0], b = pair->radius[1], d = pair->distance;
  if (d >= a + b) return 0.0;
  return d < fmax(a, b) ? fmin(a, b) : grain_circle(a, b, d);
}

double grain_radius_hertz(const GrainPair *pair) {
  const double a = pair->radius[0], b = pair->radius[1], overlap = a + b - pair->distance;
  return overlap > 0.0 ? sqrt(a * b / (a + b) * overlap) : 0.0;
}

double grain_direct_batchelor(const GrainPair *pair, double contact_radius) {
  return 4.0 * join_conductivities(pair->conductivity) * contact_radius;
}

double grain_direct_liggghts(const GrainPair *pair, double contact_radius) {
  return 4.0 * join_conductivities(pair->conductivity) * sqrt(PI * contact_radius * contact_radius);
}

double grain_direct_pipe(const GrainPair *pair, double contact_radius) {
  const double *radius = pair->radius, *k = pair->conductivity;
  if (!(k[0] > 0.0 && k[1] > 0.0)) return 0.0;
  const double mean = (radius[0] + radius[1]) / (radius[0] / k[0] + radius[1] / k[1]);
  return PI * contact_radius * contact_radius * mean / pair->distance;
}

void grain_impact_hertz(const GrainPair *pair, const double mass[2], double stiffness, double speed, double *radius_max,
                        double *duration) {
  const double m = mass[0] * mass[1] / (mass[0] + mass[1]);
  const double r = pair->radius[0] * pair->radius[1] / (pair->radius[0] + pair->radius[1]);
  *radius_max = pow(15.0 * m * r * r * speed * speed / (16.0 * stiffness), 0.2);
  /* 2.8683 = 2.9433 (15/16)^(2/5); 2.9433 = duration / (largest overlap / speed) of a Hertz impact. */
  *duration = 2.8683 * pow(m * m / (r * stiffness * stiffness * speed), 0.2);
}

/* C of table 1; ratio <= 1. The root of C1 C^2 + ... in the form that has no 0/0 where C1 vanishes (ratio 0.5548). */
static double find_collision_factor(double ratio, double fourier) {
  const double c1 = (-2.300 * ratio + 8.909) * ratio - 4.235;
  const double c2 = (8.169 * ratio - 33.770) * ratio + 24.885;
  const double c3 = (-5.758 * ratio + 24.464) * ratio - 20.511;
  const double root = sqrt(c2 * c2 - 4.0 * c1 * (c3 - fourier));
  return c2 > 0.0 ? 1.74 * (fourier - c3) / (c2 + root) : 0.435 / c1 * (root - c2);
}

/* The grain that holds less heat sets the Fourier number; of two that hold the same, the one that conducts less. */
static int find_first(const GrainPair *pair, const GrainImpact *impact) {
  const double *capacity = impact->heat_capacity, *k = pair->conductivity;
  return capacity[0] < capacity[1] || (capacity[0] == capacity[1] && k[0] <= k[1]) ? 0 : 1;
}

double grain_impact_fourier(const GrainPair *pair, const GrainImpact *impact) {
  const int first = find_first(pair, impact);
  const double square = impact->radius_max * impact->radius_max;
  return pair->conductivity[first] * impact->duration / (impact->heat_capacity[first] * square);
}

double grain_direct_collisional(const GrainPair *pair, const GrainImpact *impact) {
  const double *capacity = impact->heat_capacity, *k = pair->conductivity, radius = impact->radius_max;
  if (!(k[0] > 0.0 && k[1] > 0.0)) return 0.0;
  const int first = find_first(pair, impact);
  const double fourier = grain_impact_fourier(pair, impact);
  const double factor = find_collision_factor(capacity[first] / capacity[1 - first], fourier);
  const double resistance = 1.0 / sqrt(capacity[0] * k[0]) + 1.0 / sqrt(capacity[1] * k[1]);
  return factor * PI * radius * radius / (sqrt(impact->duration) * resistance);
}
