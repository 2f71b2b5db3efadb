/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Conduction between two grains: values worked out by another program, own quadratures, symmetry, limits. */
#include "mpm_help.h"

#include "grain_heat/grain_heat.h"

/* Largest |a / b - 1| so far; a NaN stays. */
static void note(double *worst, double a, double b) {
  const double deviation = fabs(a / b - 1.0);
  if (!(deviation <= *worst)) *worst = deviation;
}

/* ---------------------------------------------------------------------------------------- reference values */
/* Fluid 0.026 W/(m K), porosity 0.4, core R/2, minimum gap 2.75e-8 m, layer 0.4 R of the larger grain. Worked out by
 * independent scripts in Python (adaptive quadrature, relative tolerance 1e-10). */
static const struct Reference {
  GrainPair pair;
  double geometric, hertz, face, batchelor, liggghts, pipe, voronoi_a, voronoi_b, layer;
} REFERENCES[] = {{{{0.005, 0.005}, {1, 1}, 0.00999},
                   0.00022355088906108038,
                   0.00015811388300841574,
                   0.003319767084190726,
                   0.00044710177812216077,
                   0.0007924672683793274,
                   1.5715825111426247e-05,
                   0.0009209042257152114,
                   0.0008164513898832168,
                   0.004952007762152006},
                  {{{0.005, 0.005}, {1, 1}, 0.0102},
                   0,
                   0,
                   0.003319767084190726,
                   0,
                   0,
                   0,
                   0.0006625038707453527,
                   0.0006247555621969719,
                   0.0009389735319616269},
                  {{{0.005, 0.005}, {50, 1}, 0.00995},
                   0.000499374608885954,
                   0.0003535533905932727,
                   0.003319767084190726,
                   0.001958331799552761,
                   0.0034710527394680203,
                   0.00015438657365039968,
                   0.001143836372469176,
                   0.0010536706747964156,
                   0.004933022967287505},
                  {{{0.003, 0.006}, {1, 2}, 0.008995},
                   0.00014139188492408178,
                   0.0001000000000000153,
                   0.0029877903757716535,
                   0.0003770450264642181,
                   0.0006682949091212755,
                   1.0473429952447695e-05,
                   0.0007785831428041266,
                   0.0007908136068368263,
                   0.003910525300025773},
                  {{{0.00483, 0.00483}, {2000, 2000}, 0.0096117},
                   0.0004823958721838265,
                   0.0003415325753131003,
                   0.003206895003328241,
                   1.929583488735306,
                   3.4200976852525935,
                   0.1521201787492086,
                   0.003706968424058489,
                   0.0037067606587983526,
                   0.004751721382302063}};
enum { REFERENCE_COUNT = sizeof REFERENCES / sizeof REFERENCES[0], MODELS = 9 };
static const char *const MODEL_NAMES[MODELS] = {"geometric", "hertz",     "face",      "batchelor", "liggghts",
                                                "pipe",      "voronoi_a", "voronoi_b", "layer"};

static void models_meet_the_reference_values(void **state) {
  (void)state;
  double worst[MODELS] = {0};
  for (int n = 0; n < REFERENCE_COUNT; n++) {
    const struct Reference *r = &REFERENCES[n];
    const double circle = grain_radius_geometric(&r->pair), face = grain_face_radius(&r->pair, 0.4);
    const double values[MODELS] = {circle,
                                   grain_radius_hertz(&r->pair),
                                   face,
                                   grain_direct_batchelor(&r->pair, circle),
                                   grain_direct_liggghts(&r->pair, circle),
                                   grain_direct_pipe(&r->pair, circle),
                                   grain_indirect_voronoi_a(&r->pair, face, 0.026),
                                   grain_indirect_voronoi_b(&r->pair, face, 0.026, 0.5),
                                   grain_indirect_layer(&r->pair, 0.026, 0.4, 2.75e-8)};
    const double wanted[MODELS] = {r->geometric, r->hertz,     r->face,      r->batchelor, r->liggghts,
                                   r->pipe,      r->voronoi_a, r->voronoi_b, r->layer};
    for (int m = 0; m < MODELS; m++) {
      if (wanted[m] == 0.0) assert_true(values[m] == 0.0);
      else note(&worst[m], values[m], wanted[m]);
    }
  }
  for (int m = 0; m < MODELS; m++) {
    printf("grain heat, %s: %.1e from the reference\n", MODEL_NAMES[m], worst[m]);
    AT_MOST(worst[m], 1e-10);
  }
}

static void impacts_meet_the_reference_values(void **state) {
  (void)state;
  const struct {
    double radius[2], young, speed, density[2], specific[2], conductivity[2], radius_max, duration, h;
  } cases[] = {{{0.005, 0.005},
                1e8,
                0.1,
                {2500, 2500},
                {800, 800},
                {1, 1},
                0.00023375788188955085,
                0.000643322262284117,
                0.00431813449591898},
               {{0.005, 0.005},
                1e8,
                0.1,
                {2500, 7800},
                {800, 460},
                {1, 50},
                0.0002539941640866773,
                0.0007595275473899475,
                0.008234940043306275},
               {{0.001, 0.003},
                5e7,
                1.0,
                {1000, 2500},
                {1000, 800},
                {0.2, 1},
                0.00015127926280553494,
                8.981184081877794e-05,
                0.002250385280367298}};
  double worst = 0.0;
  for (size_t n = 0; n < sizeof cases / sizeof cases[0]; n++) {
    GrainPair pair = {.distance = 1.0};
    GrainImpact impact;
    double mass[2];
    for (int g = 0; g < 2; g++) {
      pair.radius[g] = cases[n].radius[g], pair.conductivity[g] = cases[n].conductivity[g];
      mass[g] = 4.0 / 3.0 * PI * pow(pair.radius[g], 3) * cases[n].density[g];
      impact.heat_capacity[g] = cases[n].density[g] * cases[n].specific[g];
    }
    grain_impact_hertz(&pair, mass, cases[n].young / (2.0 * (1.0 - 0.09)), cases[n].speed, &impact.radius_max,
                       &impact.duration);
    note(&worst, impact.radius_max, cases[n].radius_max);
    note(&worst, impact.duration, cases[n].duration);
    note(&worst, grain_direct_collisional(&pair, &impact), cases[n].h);
  }
  printf("grain heat, collisional: %.1e from the reference\n", worst);
  AT_MOST(worst, 1e-13);
}

/* The factor C by ratio of heat capacities (0.5548: where the printed form is 0/0) and Fourier number. */
static void collision_factors_meet_the_table(void **state) {
  (void)state;
  const double ratios[6] = {0.1, 0.25, 0.5, 0.5548, 0.8, 1.0}, fouriers[2] = {0.01, 1.0};
  const double wanted[6][2] = {{0.8647124936851754, 0.9234274425664339}, {0.8674780838717312, 0.9364260544724758},
                               {0.873893229048495, 0.9666039793858168},  {0.8757330792847969, 0.9751518993248841},
                               {0.8871446469683175, 1.0256263599536524}, {0.9031335102958672, 1.085935921552228}};
  double worst = 0.0;
  for (int a = 0; a < 6; a++)
    for (int f = 0; f < 2; f++) {
      /* Second grain: unit capacity and conductivity. First: Fourier number f with radius 1 in time 1. */
      const GrainPair pair = {.radius = {1, 1}, .conductivity = {fouriers[f] * ratios[a], 1}, .distance = 2};
      const GrainImpact impact = {.radius_max = 1, .duration = 1, .heat_capacity = {ratios[a], 1}};
      const double resistance = 1.0 / (ratios[a] * sqrt(fouriers[f])) + 1.0;
      /* At equal heat capacities the worse conductor counts: the first here. */
      note(&worst, grain_direct_collisional(&pair, &impact) * resistance / PI, wanted[a][f]);
    }
  AT_MOST(worst, 1e-13);
}

/* ---------------------------------------------------------------------------------------- own quadratures */
typedef struct Sweep {
  GrainPair pair;
  double face, fluid, core, layer, minimum_gap;
} Sweep;

typedef long double (*Integrand)(const Sweep *, long double);

/* tanh-sinh rule on (a, b), halving its step until two results agree. Long double throughout. */
static long double integrate(Integrand f, const Sweep *sweep, long double a, long double b) {
  long double step = 0.5L, sum = 0.0L, before = 0.0L;
  const long double middle = 0.5L * (a + b), half = 0.5L * (b - a), quarter = 0.5L * (long double)PI;
  for (int level = 0; level < 9; level++, step *= 0.5L) {
    const int first = level == 0 ? 0 : 1, stride = level == 0 ? 1 : 2;
    for (int k = first; k * step < 3.4L; k += stride)
      for (int sign = k == 0 ? 1 : -1; sign <= 1; sign += 2) {
        const long double u = quarter * sinhl(sign * k * step),
                          weight = quarter * coshl(k * step) / (coshl(u) * coshl(u));
        sum += weight * f(sweep, middle + half * tanhl(u));
      }
    const long double now = sum * step * half;
    if (level > 2 && fabsl(now - before) <= 1e-13L * fabsl(now)) return now;
    before = now;
  }
  fail_msg("the quadrature of the test does not converge");
  return 0.0L;
}

/* On panels that grow from `a` by a factor of 8: the integrands vary on all scales there. */
static double integrate_graded(Integrand f, const Sweep *sweep, long double a, long double b) {
  long double total = 0.0L, low = a;
  for (int n = 9; n >= 0; n--) {
    const long double high = n ? a + (b - a) * powl(0.125L, n) : b;
    total += integrate(f, sweep, low, high);
    low = high;
  }
  return (double)total;
}

static long double height(long double radius, long double r) { return sqrtl(fmaxl((radius - r) * (radius + r), 0.0L)); }

static long double circle_of(const GrainPair *pair, long double d) {
  const long double a = pair->radius[0], b = pair->radius[1];
  return d >= a + b ? 0.0L : height(a, (a * a - b * b + d * d) / (2.0L * d));
}

/* Parallel paths at distance r from the axis; grain 0 is the smaller one. */
static long double voronoi_a_path(const Sweep *s, long double r) {
  const long double a = s->pair.radius[0], b = s->pair.radius[1], d = s->pair.distance, face = s->face;
  const long double h1 = (a * a - b * b + d * d) / (2.0L * d), outer = a * face / hypotl(face, h1);
  const long double cone2 = outer / height(b, outer), b1 = height(a, r), b2 = height(b, r);
  return 2.0L * (long double)PI * r /
         ((b1 - r * h1 / face) / s->pair.conductivity[0] + (b2 - r / cone2) / s->pair.conductivity[1] +
          (d - b1 - b2) / s->fluid);
}

/* Radial paths through the circle of radius r on the surface that is equally far from both spheres: solid angles by
 * central differences would lose digits, so they are written out: d(omega) = 2 pi sin(theta) d(theta). */
static long double voronoi_b_path(const Sweep *s, long double r) {
  const long double a = s->pair.radius[0], b = s->pair.radius[1], d = s->pair.distance;
  const long double major = 0.5L * (b - a),
                    minor2 = 0.25L * d * d - major * major; /* hyperbola u^2/major^2 - r^2/minor^2 */
  const long double root = sqrtl(1.0L + r * r / minor2);
  /* Along the axis from the middle: negative, nearer to the smaller sphere's centre. */
  const long double u = -major * root, slope = -major * r / (minor2 * root);
  const long double z[2] = {0.5L * d + u, 0.5L * d - u}, dz[2] = {slope, -slope}, radius[2] = {a, b};
  long double resistance = 0.0L;
  for (int g = 0; g < 2; g++) {
    const long double far = hypotl(z[g], r), angle_rate = (z[g] - r * dz[g]) / (far * far);
    const long double solid = (1.0L / s->core - 1.0L) / (radius[g] * s->pair.conductivity[g]);
    const long double wet = (1.0L / radius[g] - 1.0L / far) / s->fluid;
    resistance += (solid + wet) / (2.0L * (long double)PI * (r / far) * angle_rate);
  }
  return 1.0L / resistance;
}

static long double layer_path(const Sweep *s, long double r) {
  const long double gap = s->pair.distance - height(s->pair.radius[0], r) - height(s->pair.radius[1], r);
  return s->fluid * 2.0L * (long double)PI * r / fmaxl(s->minimum_gap, gap);
}

static double layer_by_quadrature(const Sweep *s) {
  const long double a = s->pair.radius[0], b = s->pair.radius[1], d = s->pair.distance, outer = b * (1.0L + s->layer);
  if (d >= a + outer) return 0.0;
  const long double plane = (a * a - outer * outer + d * d) / (2.0L * d), edge = plane <= 0.0L ? a : height(a, plane);
  const long double start = circle_of(&s->pair, d), inner = circle_of(&s->pair, d - s->minimum_gap);
  if (inner >= edge) return integrate_graded(layer_path, s, start, edge);
  return (inner > start ? integrate_graded(layer_path, s, start, inner) : 0.0) +
         integrate_graded(layer_path, s, inner, edge);
}

static double voronoi_by_quadrature(Integrand path, const Sweep *s) {
  const long double a = s->pair.radius[0], b = s->pair.radius[1], d = s->pair.distance, face = s->face;
  const long double start = circle_of(&s->pair, d), h1 = (a * a - b * b + d * d) / (2.0L * d);
  if (face <= start) return 0.0;
  return integrate_graded(path, s, start, path == voronoi_a_path ? a * face / hypotl(face, h1) : face);
}

/* Size ratio 1 to 20, gap -35 % to 30 % of the mean radius, conductivities 1e-1 to 1e5 of the fluid's. */
static void indirect_models_meet_own_quadratures(void **state) {
  (void)state;
  const double ratios[4] = {1.0, 0.999, 0.4, 0.05}, gaps[7] = {-0.35, -0.03, -1e-4, -1e-7, 0.0, 1e-3, 0.3};
  const double conductivities[4][2] = {{0.1, 0.3}, {1, 1}, {5000, 40}, {1e5, 1e5}}, porosities[2] = {0.26, 0.8};
  double worst[3] = {0};
  for (int n = 0; n < 4 * 7 * 4 * 2; n++) {
    const double small = ratios[n % 4], mean = 0.5 * (1.0 + small), *k = conductivities[n / 28 % 4];
    Sweep s = {.pair = {.radius = {small, 1.0}, .conductivity = {k[0], k[1]}},
               .fluid = 1.0,
               .core = 0.5,
               .layer = 0.4,
               .minimum_gap = 1e-5};
    s.pair.distance = (1.0 + small) + gaps[n / 4 % 7] * fmin(mean, small);
    s.face = grain_face_radius(&s.pair, porosities[n / 112]);
    const double wanted[3] = {voronoi_by_quadrature(voronoi_a_path, &s), voronoi_by_quadrature(voronoi_b_path, &s),
                              layer_by_quadrature(&s)};
    const double found[3] = {grain_indirect_voronoi_a(&s.pair, s.face, s.fluid),
                             grain_indirect_voronoi_b(&s.pair, s.face, s.fluid, s.core),
                             grain_indirect_layer(&s.pair, s.fluid, s.layer, s.minimum_gap)};
    for (int m = 0; m < 3; m++) {
      assert_true(wanted[m] > 0.0);
      note(&worst[m], found[m], wanted[m]);
    }
  }
  printf("grain heat: voronoi_a %.1e, voronoi_b %.1e, layer %.1e from own quadratures\n", worst[0], worst[1], worst[2]);
  for (int m = 0; m < 3; m++) AT_MOST(worst[m], 1e-10);
}

/* Paths to a plane at the distance of the pair from the centre of grain 0; the plane is isothermal. */
static long double voronoi_a_wall_path(const Sweep *s, long double r) {
  const long double b = height(s->pair.radius[0], r), d = s->pair.distance;
  return 2.0L * (long double)PI * r / ((b - r * d / s->face) / s->pair.conductivity[0] + (d - b) / s->fluid);
}

/* Through the circle of radius r on the plane. */
static long double voronoi_b_wall_path(const Sweep *s, long double r) {
  const long double radius = s->pair.radius[0], d = s->pair.distance, far = hypotl(d, r);
  const long double solid = (1.0L / s->core - 1.0L) / (radius * s->pair.conductivity[0]);
  return 2.0L * (long double)PI * (r / far) * (d / (far * far)) / (solid + (1.0L / radius - 1.0L / far) / s->fluid);
}

static long double layer_wall_path(const Sweep *s, long double r) {
  const long double gap = s->pair.distance - height(s->pair.radius[0], r);
  return s->fluid * 2.0L * (long double)PI * r / fmaxl(s->minimum_gap, gap);
}

static double layer_wall_by_quadrature(const Sweep *s) {
  const long double R = s->pair.radius[0], d = s->pair.distance;
  const long double edge = fminl(R, height(R * (1.0L + (long double)s->layer), d));
  const long double start = d < R ? height(R, d) : 0.0L, near = d - s->minimum_gap;
  const long double inner = near < R ? height(R, near) : 0.0L;
  if (inner >= edge) return integrate_graded(layer_wall_path, s, start, edge);
  return (inner > start ? integrate_graded(layer_wall_path, s, start, inner) : 0.0) +
         integrate_graded(layer_wall_path, s, inner, edge);
}

static void walls_meet_own_quadratures(void **state) {
  (void)state;
  const double gaps[8] = {-0.2, -0.03, -1e-4, -1e-7, 0.0, 1e-6, 1e-3, 0.2}, conductivities[4] = {0.1, 1, 5000, 1e5};
  const double porosities[2] = {0.26, 0.8};
  double worst[3] = {0};
  for (int n = 0; n < 8 * 4 * 2; n++) {
    Sweep s = {.pair = {.radius = {0.7, 0.7}, .conductivity = {conductivities[n / 8 % 4], 1}},
               .fluid = 1.0,
               .core = 0.5,
               .layer = 0.4,
               .minimum_gap = 1e-5};
    const double R = s.pair.radius[0], porosity = porosities[n / 32], d = s.pair.distance = R * (1.0 + gaps[n % 8]);
    s.face = 0.56 * R / cbrt(1.0 - porosity);
    const long double start = d < R ? height(R, d) : 0.0L;
    const double wanted[3] = {integrate_graded(voronoi_a_wall_path, &s, start, R * s.face / hypotl(s.face, d)),
                              integrate_graded(voronoi_b_wall_path, &s, start, s.face), layer_wall_by_quadrature(&s)};
    for (int m = 0; m < 3; m++) {
      GrainHeat model = grain_heat_default();
      model.indirect = (GrainIndirect)(GRAIN_INDIRECT_VORONOI_A + m), model.fluid = s.fluid;
      model.porosity = porosity, model.core = s.core, model.layer = s.layer, model.minimum_gap = s.minimum_gap;
      assert_true(wanted[m] > 0.0);
      note(&worst[m], grain_heat_wall_indirect(&model, R, s.pair.conductivity[0], d), wanted[m]);
      assert_true(grain_heat_wall_indirect(&model, R, 1.0, R * (1.0 + (1.0 + 1e-12) * grain_heat_wall_reach(&model))) ==
                  0.0);
    }
  }
  printf("grain heat at walls: voronoi_a %.1e, voronoi_b %.1e, layer %.1e from own quadratures\n", worst[0], worst[1],
         worst[2]);
  for (int m = 0; m < 3; m++) AT_MOST(worst[m], 1e-10);
}

/* ------------------------------------------------------------------------------------- symmetry and limits */
static GrainHeat make_model(GrainDirect direct, GrainIndirect indirect, GrainArea area) {
  GrainHeat model = grain_heat_default();
  model.direct = direct, model.indirect = indirect, model.area = area, model.fluid = 0.026;
  OK(grain_heat_check(&model));
  return model;
}

static void both_sides_of_a_pair_see_the_same_bits(void **state) {
  (void)state;
  uint64_t seed = 3;
  int conducting = 0;
  for (int n = 0; n < 20000; n++) {
    const GrainHeat model = make_model((GrainDirect)(1 + n % 3), (GrainIndirect)(n / 3 % 4),
                                       n & 1 ? GRAIN_AREA_HERTZ : GRAIN_AREA_GEOMETRIC);
    const double a = 0.001 + 0.009 * base_random(&seed), b = n % 5 ? 0.001 + 0.009 * base_random(&seed) : a;
    const double ka = base_random(&seed), kb = base_random(&seed), d = (a + b) * (0.8 + 0.4 * base_random(&seed));
    const double one = grain_heat_conductance(&model, &(GrainPair){{a, b}, {ka, kb}, d});
    const double other = grain_heat_conductance(&model, &(GrainPair){{b, a}, {kb, ka}, d});
    assert_true(one == other && one >= 0.0 && isfinite(one));
    conducting += one > 0.0;
  }
  assert_true(conducting > 10000);
}

static void nothing_conducts_beyond_the_reach(void **state) {
  (void)state;
  uint64_t seed = 4;
  for (int indirect = 0; indirect < 4; indirect++) {
    const GrainHeat model = make_model(GRAIN_DIRECT_PIPE, (GrainIndirect)indirect, GRAIN_AREA_GEOMETRIC);
    const double reach = grain_heat_reach(&model, 1.0);
    for (int n = 0; n < 1000; n++) {
      const double b = pow(10.0, -3.0 * base_random(&seed));
      assert_true(grain_heat_conductance(&model, &(GrainPair){{1, b}, {1, 1}, 1 + b + (1.0 + 1e-12) * reach}) == 0.0);
    }
    assert_true(grain_heat_conductance(&model, &(GrainPair){{1, 1}, {1, 1}, 2.0 + reach - 1e-9}) > 0.0);
  }
}

static void deep_overlaps_and_insulators_give_finite_values(void **state) {
  (void)state;
  for (int indirect = 0; indirect < 4; indirect++) {
    const GrainHeat model = make_model(GRAIN_DIRECT_BATCHELOR, (GrainIndirect)indirect, GRAIN_AREA_GEOMETRIC);
    for (int n = 1; n < 1100; n++) {
      const double h = grain_heat_conductance(&model, &(GrainPair){{1, 0.1}, {1, 2}, 0.001 * n});
      assert_true(isfinite(h) && h > 0.0);
    }
    const double insulated = grain_heat_conductance(&model, &(GrainPair){{1, 1}, {0, 5}, 1.99});
    if (indirect == GRAIN_INDIRECT_LAYER) assert_true(insulated > 0.0);
    else assert_true(insulated == 0.0);
  }
}

static void wrong_models_are_refused(void **state) {
  (void)state;
  GrainHeat model = grain_heat_default();
  assert_int_equal(grain_heat_check(&model), BASE_ERROR_ARGUMENT);
  model.indirect = GRAIN_INDIRECT_VORONOI_B;
  assert_int_equal(grain_heat_check(&model), BASE_ERROR_ARGUMENT); /* no fluid */
  model.fluid = 0.026;
  OK(grain_heat_check(&model));
  double *const values[] = {&model.fluid, &model.porosity, &model.core, &model.reach};
  for (size_t k = 0; k < sizeof values / sizeof values[0]; k++) {
    const double wrong[] = {-1.0, 0.0, NAN}, kept = *values[k];
    for (int w = 0; w < 3; w++) {
      *values[k] = wrong[w];
      assert_int_equal(grain_heat_check(&model), BASE_ERROR_ARGUMENT);
    }
    *values[k] = kept;
  }
  model.indirect = GRAIN_INDIRECT_LAYER, model.minimum_gap = 0.0;
  assert_int_equal(grain_heat_check(&model), BASE_ERROR_ARGUMENT);
}

static void impacts_end_in_steady_conduction(void **state) {
  (void)state;
  const GrainHeat model = make_model(GRAIN_DIRECT_COLLISIONAL, GRAIN_INDIRECT_NONE, GRAIN_AREA_GEOMETRIC);
  const GrainPair pair = {.radius = {1, 2}, .conductivity = {1, 5}, .distance = 2.9};
  GrainImpact impact = {.radius_max = 0.1, .duration = 1e-3, .heat_capacity = {1, 3}};
  const double steady = grain_heat_conductance(&model, &pair), mean = grain_direct_collisional(&pair, &impact);
  assert_true(mean > 0.0 && steady == grain_direct_batchelor(&pair, grain_radius_geometric(&pair)));
  double worst = 0.0;
  note(&worst, grain_heat_impact_conductance(&model, &pair, &impact, 0.0, 2e-4), mean);
  note(&worst, grain_heat_impact_conductance(&model, &pair, &impact, 9.5e-4, 2e-4), 0.25 * mean + 0.75 * steady);
  note(&worst, grain_heat_impact_conductance(&model, &pair, &impact, 1e-3, 2e-4), steady);
  AT_MOST(worst, 1e-12);
  const GrainPair other = {.radius = {2, 1}, .conductivity = {5, 1}, .distance = 2.9};
  const GrainImpact turned = {.radius_max = 0.1, .duration = 1e-3, .heat_capacity = {3, 1}};
  assert_true(grain_heat_impact_conductance(&model, &pair, &impact, 0.0, 1e-4) ==
              grain_heat_impact_conductance(&model, &other, &turned, 0.0, 1e-4));
  impact.duration = 1.0; /* Fourier number 100: the fit has no value */
  assert_true(grain_heat_impact_conductance(&model, &pair, &impact, 0.0, 1e-4) == steady);
}

/* --------------------------------------------------------------------------------------------------- walls */
static void a_wall_is_a_grain_of_infinite_radius(void **state) {
  (void)state;
  const double radius = 0.005, huge = 1e6 * radius, k[2] = {20.0, 90.0};
  double worst = 0.0;
  for (int n = 0; n < 40; n++) {
    const double overlap = radius * ldexp(0.75, -(n % 8));
    const GrainDirect direct = n & 1 ? GRAIN_DIRECT_BATCHELOR : GRAIN_DIRECT_LIGGGHTS;
    const GrainHeat model =
        make_model(direct, GRAIN_INDIRECT_NONE, n < 20 ? GRAIN_AREA_HERTZ : GRAIN_AREA_GEOMETRIC);
    const double wall = grain_heat_wall_conductance(&model, radius, k, radius - overlap);
    const GrainPair pair = {{radius, huge}, {k[0], k[1]}, radius + huge - overlap};
    assert_true(wall > 0.0);
    note(&worst, grain_heat_conductance(&model, &pair), wall);
  }
  AT_MOST(worst, 2e-6);
  const GrainHeat pipe = make_model(GRAIN_DIRECT_PIPE, GRAIN_INDIRECT_NONE, GRAIN_AREA_GEOMETRIC);
  worst = 0.0;
  note(&worst, grain_heat_wall_conductance(&pipe, 5.0, k, 4.0), PI * 9.0 * 20.0 / 4.0);
  AT_MOST(worst, 1e-14);
  assert_true(grain_heat_wall_conductance(&pipe, 5.0, k, 5.0) == 0.0);
  assert_true(grain_heat_wall_conductance(&pipe, 5.0, (double[2]){20.0, 0.0}, 4.0) == 0.0);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(models_meet_the_reference_values),
      cmocka_unit_test(impacts_meet_the_reference_values),
      cmocka_unit_test(collision_factors_meet_the_table),
      cmocka_unit_test(indirect_models_meet_own_quadratures),
      cmocka_unit_test(walls_meet_own_quadratures),
      cmocka_unit_test(both_sides_of_a_pair_see_the_same_bits),
      cmocka_unit_test(nothing_conducts_beyond_the_reach),
      cmocka_unit_test(deep_overlaps_and_insulators_give_finite_values),
      cmocka_unit_test(wrong_models_are_refused),
      cmocka_unit_test(a_wall_is_a_grain_of_infinite_radius),
      cmocka_unit_test(impacts_end_in_steady_conduction),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
