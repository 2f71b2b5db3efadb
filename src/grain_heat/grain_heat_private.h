/* SPDX-License-Identifier: GPL-2.0-or-later */
#ifndef DEMPM_GRAIN_HEAT_PRIVATE_H
#define DEMPM_GRAIN_HEAT_PRIVATE_H

/* Radius of the circle in which spheres of radii a and b meet at distance d, |a - b| <= d <= a + b; the same bits
 * for (b, a). */
double grain_circle(double a, double b, double d);

#endif
