/* SPDX-License-Identifier: GPL-2.0-or-later */
#include <math.h>

#include "grain_heat.h"

#define PI 3.14159265358979323846
#define STEFAN_BOLTZMANN 5.670374419e-8 /* W/(m2 K4), CODATA 2018 */

static double surface(double radius) { return 4.0 * PI * radius * radius; }

double grain_convection(const GrainSurface *exchange, double radius, double temperature) {
  return exchange->coefficient * surface(radius) * (exchange->fluid_temperature - temperature);
}

/* sigma (T1^4 - T0^4) / (T1 - T0): with the difference as a factor no digits are lost near equilibrium. */
static double find_emission(double from, double to, double zero) {
  const double hot = from - zero, own = to - zero, sum = hot + own;
  return STEFAN_BOLTZMANN * sum * (sum * sum - 2.0 * (hot * own));
}

static double emit(double from, double to, double zero) { return (from - to) * find_emission(from, to, zero); }

double grain_emission(const double temperature[2], double absolute_zero) {
  return find_emission(fmax(temperature[1], absolute_zero), fmax(temperature[0], absolute_zero), absolute_zero);
}

double grain_radiation(const GrainSurface *exchange, double radius, double temperature) {
  return exchange->emissivity * surface(radius) * emit(exchange->surroundings, temperature, exchange->absolute_zero);
}

double grain_radiation_between(double area, const double temperature[2], double absolute_zero) {
  return area * emit(temperature[1], temperature[0], absolute_zero);
}

static double enclose(double a, double b, double emissivity) {
  if (!(a > 0.0 && b > 0.0 && emissivity > 0.0)) return 0.0;
  return 1.0 / (1.0 / fmin(a, b) + (1.0 - emissivity) / emissivity * (1.0 / a + 1.0 / b));
}

/* Area of the cap between the contact circle and the face, in a plane at `height` > 0 from the centre. */
static double find_cap(double radius, double height, double face) {
  return 2.0 * PI * radius * (fmin(height, radius) - radius * height / hypot(height, face));
}

static double find_share(double height, double face) { return 0.5 * (1.0 - height / hypot(height, face)); }

GrainView grain_view(const GrainPair *pair, double face, double emissivity) {
  const double a = pair->radius[0], b = pair->radius[1], d = pair->distance;
  const double height[2] = {((a - b) * (a + b) + d * d) / (2.0 * d), ((b - a) * (b + a) + d * d) / (2.0 * d)};
  GrainView view = {.share = {find_share(height[0], face), find_share(height[1], face)}};
  /* Without a contact the plane lies outside of both spheres. */
  if (fmin(height[0], height[1]) > 0.0 && face > grain_radius_geometric(pair))
    view.area = enclose(find_cap(a, height[0], face), find_cap(b, height[1], face), emissivity);
  return view;
}

GrainView grain_view_wall(double radius, double distance, double face, double emissivity) {
  const double square = fmax((radius - distance) * (radius + distance), 0.0); /* of the contact radius */
  GrainView view = {.share = {find_share(distance, face)}};
  if (face * face > square)
    view.area = enclose(find_cap(radius, distance, face), PI * (face * face - square), emissivity);
  return view;
}
