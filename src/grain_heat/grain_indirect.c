/* SPDX-License-Identifier: GPL-2.0-or-later */
#include <math.h>

#include "grain_heat.h"
#include "grain_heat_private.h"

#define PI 3.14159265358979323846

/* A pair with the smaller grain (then the worse conductor) first: the order of the arguments leaves no trace. */
typedef struct Ordered {
  double r1, r2, k1, k2, d; /* r1 <= r2 */
  double height1, height2;  /* of the centres above the plane through the contact circle (the radical plane) */
  double contact, gap;      /* radius of the circle where the fluid begins; gap there: 0 in a contact */
} Ordered;

/* 0 if the centre of the smaller sphere lies beyond the plane: no path through both crosses the fluid. */
static int order_pair(const GrainPair *pair, Ordered *o) {
  const double *radius = pair->radius, *k = pair->conductivity;
  const int first = radius[0] < radius[1] || (radius[0] == radius[1] && k[0] <= k[1]) ? 0 : 1;
  o->r1 = radius[first], o->r2 = radius[1 - first];
  o->k1 = k[first], o->k2 = k[1 - first], o->d = pair->distance;
  o->height1 = ((o->r1 - o->r2) * (o->r1 + o->r2) + o->d * o->d) / (2.0 * o->d);
  o->height2 = o->d - o->height1;
  o->contact = grain_radius_geometric(pair);
  o->gap = fmax(o->d - (o->r1 + o->r2), 0.0);
  return o->height1 > 0.0 && o->contact < o->r1;
}

double grain_face_radius(const GrainPair *pair, double porosity) {
  return 0.56 * 0.5 * (pair->radius[0] + pair->radius[1]) / cbrt(1.0 - porosity);
}

/* ----------------------------------------------------------------------------------------------- Voronoi A */
/* Gauss-Legendre, 16 points, on (-1, 1): the positive half. */
static const double NODE[8] = {0.09501250983763744018, 0.28160355077925891323, 0.45801677765722738634,
                               0.61787624440264374844, 0.75540440835500303389, 0.86563120238783174388,
                               0.94457502307323257607, 0.98940093499164993259};
static const double WEIGHT[8] = {0.18945061045506849628, 0.18260341504492358886, 0.16915651939500253818,
                                 0.14959598881657673208, 0.12462897125553387205, 0.09515851168249278480,
                                 0.06225352393864789286, 0.02715245941175409485};

/* Paths at distance r = r1 sin(angle) from the line of centres; the angle keeps sqrt(r1^2 - r^2) smooth at r = r1. */
typedef struct Paths {
  const Ordered *pair;
  double fluid, cone1, cone2; /* dr/dheight of the cones over the face, as seen from either centre */
  double start;               /* angle at the contact circle */
  double circle1, circle2;    /* heights of the contact circle above the centres, on the spheres */
} Paths;

/* Conductance per angle, W/K, at `start` + `angle`. */
static double conduct_path(const Paths *paths, double angle) {
  const Ordered *o = paths->pair;
  const double sine = sin(paths->start + angle), r = o->r1 * sine;
  const double b1 = o->r1 * cos(paths->start + angle), b2 = sqrt((o->r2 - r) * (o->r2 + r));
  /* r^2 - contact^2 and with it the gap, without the loss of digits of d - b1 - b2 */
  const double square = o->r1 * o->r1 * sin(angle) * sin(2.0 * paths->start + angle);
  const double gap = o->gap + square * (1.0 / (b1 + paths->circle1) + 1.0 / (b2 + paths->circle2));
  const double resistance = (b1 - r / paths->cone1) / o->k1 + (b2 - r / paths->cone2) / o->k2 + gap / paths->fluid;
  return 2.0 * PI * r * b1 / resistance;
}

/* Angle after which the fluid resists as much as the grains do at the start. There
 * gap(r) = gap + (2 contact (r - contact) + (r - contact)^2) / (2 R*) nearly. */
static double find_start_scale(const Paths *paths) {
  const Ordered *o = paths->pair;
  const double reduced = o->r1 * o->r2 / (o->r1 + o->r2);
  const double solid1 = paths->circle1 - o->contact / paths->cone1, solid2 = paths->circle2 - o->contact / paths->cone2;
  const double length = o->gap + paths->fluid * fmax(solid1 / o->k1 + solid2 / o->k2, 0.0);
  const double dr = 2.0 * reduced * length / (o->contact + sqrt(o->contact * o->contact + 2.0 * reduced * length));
  return dr / o->r1;
}

/* Angle before the end, where no solid is left, at which the grains resist as much as the fluid does at the end. */
static double find_end_scale(const Paths *paths, double range) {
  const Ordered *o = paths->pair;
  const double r = o->r1 * sin(paths->start + range), b1 = o->r1 * cos(paths->start + range);
  const double b2 = sqrt((o->r2 - r) * (o->r2 + r));
  const double slope = (r / b1 + 1.0 / paths->cone1) / o->k1 + (r / b2 + 1.0 / paths->cone2) / o->k2;
  return (o->d - b1 - b2) / paths->fluid / (slope * b1);
}

/* From angle `from` over `range` (with a sign). Substitution angle = scale (exp(t) - 1): the integrand ~ 1 / resistance
 * varies over many orders of magnitude of the angle. One panel of 16 points per 0.75 of t. */
static double integrate_paths(const Paths *paths, double from, double range, double scale) {
  scale = fmin(fmax(scale, 1e-12 * fabs(range)), fabs(range));
  const double end = log1p(fabs(range) / scale), sign = range < 0.0 ? -1.0 : 1.0;
  const int panels = (int)ceil(end / 0.75);
  const double half = 0.5 * end / panels;
  double sum = 0.0;
  for (int p = 0; p < panels; p++)
    for (int k = 0; k < 16; k++) {
      const double t = half * (2 * p + 1 + (k < 8 ? NODE[k] : -NODE[k - 8]));
      sum += WEIGHT[k & 7] * exp(t) * conduct_path(paths, from + sign * scale * expm1(t));
    }
  return half * scale * sum;
}

double grain_indirect_voronoi_a(const GrainPair *pair, double face, double fluid) {
  Ordered o;
  if (!order_pair(pair, &o) || face <= o.contact || !(o.k1 > 0.0 && o.k2 > 0.0)) return 0.0;
  /* Corrected r_sf: where the cone over the face meets the smaller sphere. The larger sphere's cone meets its sphere at
   * the same distance from the axis, so that both solid paths vanish there. */
  const double outer = o.r1 * face / hypot(face, o.height1);
  const double start = asin(fmin(o.contact / o.r1, 1.0)), range = asin(outer / o.r1) - start;
  if (!(range > 0.0)) return 0.0;
  const Paths paths = {.pair = &o,
                       .fluid = fluid,
                       .cone1 = face / o.height1,
                       .cone2 = outer / sqrt((o.r2 - outer) * (o.r2 + outer)),
                       .start = start,
                       .circle1 = o.r1 * cos(start),
                       .circle2 = sqrt((o.r2 - o.contact) * (o.r2 + o.contact))};
  return integrate_paths(&paths, 0.0, 0.5 * range, find_start_scale(&paths)) +
         integrate_paths(&paths, range, -0.5 * range, find_end_scale(&paths, range));
}

/* ----------------------------------------------------------------------------------------------- Voronoi B */
/* atanh(sqrt(z)) / sqrt(z), which is atan(sqrt(-z)) / sqrt(-z) for z < 0 and 1 at 0. */
static double atanh_ratio(double z) {
  if (fabs(z) < 1e-8) return 1.0 + z / 3.0;
  const double root = sqrt(fabs(z));
  return (z > 0.0 ? atanh(root) : atan(root)) / root;
}

/* With x = distance from centre 1 / d, on the surface that is equally far from both spheres (a hyperboloid with the
 * centres as foci), distance from centre 2 / d = x + e, e = (r2 - r1) / d, and the paths' conductance is h = pi k_f d
 * (1 - e^2) INTEGRAL dx / (a x^2 - x + b (x + e)^2 - (x + e)),  a, b = (k_f (1/core - 1) / k + 1) d / r from the
 * contact circle to the edge of the face. The denominator has roots, real or not by the sign of L below; the
 * difference of the two antiderivatives is written as one function that is smooth at L = 0. Public codes have half of
 * it for L < 0. Equal radii: table 2, corrected. */
double grain_indirect_voronoi_b(const GrainPair *pair, double face, double fluid, double core) {
  Ordered o;
  if (!order_pair(pair, &o) || face <= o.contact || !(o.k1 > 0.0 && o.k2 > 0.0)) return 0.0;
  const double e = (o.r2 - o.r1) / o.d, flat = (1.0 - e) * (1.0 + e);
  const double solid1 = fluid * (1.0 / core - 1.0) / o.k1 * o.d / o.r1, a = solid1 + o.d / o.r1;
  const double solid2 = fluid * (1.0 / core - 1.0) / o.k2 * o.d / o.r2, b = solid2 + o.d / o.r2;
  const double scale = 4.0 / (o.d * o.d * flat);
  const double root0 = sqrt(scale * o.contact * o.contact + 1.0), root1 = sqrt(scale * face * face + 1.0);
  /* At the start x = r1 / d in a contact: the fluid's share of the denominator is exactly the gap's. */
  const double x = o.contact > 0.0 ? o.r1 / o.d : 0.5 * (1.0 - e), y = x + e;
  const double gap = o.contact > 0.0 ? 0.0 : 0.5 * (o.d - (o.r1 + o.r2)) / o.d; /* of each half, / d */
  const double denominator = x * x * (solid1 + gap / x * o.d / o.r1) + y * y * (solid2 + gap / y * o.d / o.r2);
  const double length = 0.5 * scale * (face - o.contact) * (face + o.contact) / (root0 + root1);
  const double slope = (a + b) * x - (1.0 - e * b), L = (1.0 + e * a) * (1.0 - e * b);
  const double D = length / (denominator + slope * length);
  return PI * fluid * o.d * flat * D * atanh_ratio(L * D * D);
}

/* ----------------------------------------------------------------------------------------------- the layer */
/* k_f INTEGRAL 2 pi r dr / max(S, gap(r)) from the contact circle to R_e. Where the gap exceeds S the integral over
 * s = d - gap, the sum of the spheres' heights at r, is rational: 2 pi r dr = pi/2 (c^2 / s^3 - s) ds with
 * c = r1^2 - r2^2. */
static double integrate_gap(const Ordered *o, double s0, double gap0, double s1) {
  const double d = o->d, c = (o->r1 - o->r2) * (o->r1 + o->r2);
  const double logarithm = log1p((s0 - s1) / gap0), same = d * logarithm - (s0 - s1);
  if (c == 0.0) return 0.5 * PI * same; /* s1 may be 0 */
  const double inverse = 1.0 / s1 - 1.0 / s0;
  const double part = (log(s0 / s1) + logarithm) / d + inverse + 0.5 * d * inverse * (1.0 / s0 + 1.0 / s1);
  return 0.5 * PI * (same - c * c / (d * d) * part);
}

double grain_indirect_layer(const GrainPair *pair, double fluid, double layer, double minimum_gap) {
  Ordered o;
  if (!order_pair(pair, &o)) return 0.0;
  const double outer = o.r2 * (1.0 + layer);
  if (o.d >= outer + o.r1) return 0.0;
  /* R_e: where the layer's surface meets the smaller sphere, corrected: not beyond its equator. */
  const double edge = o.d * o.d <= (outer - o.r1) * (outer + o.r1) ? o.r1 : grain_circle(o.r1, outer, o.d);
  if (edge <= o.contact) return 0.0;
  /* Inside the circle in which the spheres would meet if the centres were S nearer, the gap is below S. */
  const double near = o.d - minimum_gap;
  double inner = 0.0;
  if (near < 0.0 || near * near <= (o.r2 - o.r1) * (o.r2 + o.r1)) inner = o.r1;
  else if (near < o.r1 + o.r2) inner = grain_circle(o.r1, o.r2, near);
  if (inner >= edge) return fluid * PI * (edge - o.contact) * (edge + o.contact) / minimum_gap;
  const double core = PI * (inner - o.contact) * (inner + o.contact) / minimum_gap;
  const double gap0 = fmax(o.gap, minimum_gap), s0 = o.d - gap0;
  const double s1 = sqrt(fmax((o.r1 - edge) * (o.r1 + edge), 0.0)) + sqrt((o.r2 - edge) * (o.r2 + edge));
  return fluid * (core + integrate_gap(&o, s0, gap0, s1));
}

/* As above with s = sqrt(R^2 - r^2) = distance - gap: 2 pi r dr = -2 pi s ds. */
double grain_indirect_layer_wall(double radius, double distance, double fluid, double layer, double minimum_gap) {
  const double outer = radius * (1.0 + layer), near = distance - minimum_gap;
  if (distance >= outer) return 0.0;
  const double contact = sqrt(fmax((radius - distance) * (radius + distance), 0.0));
  const double edge = fmin(radius, sqrt((outer - distance) * (outer + distance)));
  const double inner = near < radius ? sqrt((radius - near) * (radius + near)) : 0.0;
  if (near <= 0.0 || inner >= edge) return fluid * PI * (edge - contact) * (edge + contact) / minimum_gap;
  const double core = PI * (inner - contact) * (inner + contact) / minimum_gap;
  const double gap0 = fmax(distance - radius, minimum_gap), s0 = distance - gap0;
  const double s1 = sqrt(fmax((radius - edge) * (radius + edge), 0.0));
  return fluid * (core + 2.0 * PI * (distance * log1p((s0 - s1) / gap0) - (s0 - s1)));
}
