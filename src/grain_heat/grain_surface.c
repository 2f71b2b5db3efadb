/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "grain_heat.h"

#define PI 3.14159265358979323846
#define STEFAN_BOLTZMANN 5.670374419e-8 /* W/(m2 K4), CODATA 2018 */

static double surface(double radius) { return 4.0 * PI * radius * radius; }

double grain_convection(const GrainSurface *exchange, double radius, double temperature) {
  return exchange->coefficient * surface(radius) * (exchange->fluid_temperature - temperature);
}

double grain_radiation_conductance(const GrainSurface *exchange, double radius, double temperature) {
  const double hot = exchange->surroundings - exchange->absolute_zero, own = temperature - exchange->absolute_zero;
  return STEFAN_BOLTZMANN * exchange->emissivity * surface(radius) * (hot + own) * (hot * hot + own * own);
}

/* The difference of fourth powers as a product: no digits are lost near the temperature of the surroundings. */
double grain_radiation(const GrainSurface *exchange, double radius, double temperature) {
  const double hot = exchange->surroundings - exchange->absolute_zero, own = temperature - exchange->absolute_zero;
  const double difference = (exchange->surroundings - temperature) * (hot + own) * (hot * hot + own * own);
  return STEFAN_BOLTZMANN * exchange->emissivity * surface(radius) * difference;
}
