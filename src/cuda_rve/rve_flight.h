/* SPDX-License-Identifier: GPL-2.0-or-later */
/* A call in which no two grains can meet, in closed form. Without forces the steps of rve_step.h are linear maps that
 * commute, as all are functions of L: with A = 1 - L dt and E = exp(L dt), n steps are
 *
 *   v <- A^n v,   H <- E^n H,   s <- s + H^-1 M v,   M = dt A sum_(j < n) (E^-1 A)^j,
 *
 * the same as stepping but for round-off. Powers and sum by doubling, as differences from the unit matrix. */
#ifndef DEMPM_RVE_FLIGHT_H
#define DEMPM_RVE_FLIGHT_H

#include "rve_kernel.h"
#include "rve_neighbour.h"

typedef struct RveFlight {
  double decay[9];   /* A^n - 1 */
  double stretch[9]; /* E^n - 1 */
  double drift[9];   /* M, s */
  double duration;   /* n dt, s */
  double grow;       /* >= the largest stretch of a velocity, and of M / (n dt) */
  double shorten;    /* >= the largest shortening of a length */
  double squeeze;    /* <= the least stretch of a length, <= 1 */
  double scale_max;  /* of the radii, during the call */
} RveFlight;

RVE_FN void rve_multiply(const double a[9], const double b[9], double c[9]) {
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++)
      c[3 * i + j] = a[3 * i] * b[j] + a[3 * i + 1] * b[3 + j] + a[3 * i + 2] * b[6 + j];
}

/* power = (1 + x)^n - 1, and sum = sum of (1 + x)^j over j < n, from the highest bit of n down. */
RVE_FN void rve_power(const double x[9], int64_t n, double power[9], double sum[9]) {
  double product[9];
  for (int k = 0; k < 9; k++) power[k] = sum[k] = 0.0;
  for (int bit = 62; bit >= 0; bit--) {
    if (n >> bit == 0) continue;
    rve_multiply(power, sum, product); /* m -> 2 m */
    for (int k = 0; k < 9; k++) sum[k] = 2.0 * sum[k] + product[k];
    rve_multiply(power, power, product);
    for (int k = 0; k < 9; k++) power[k] = 2.0 * power[k] + product[k];
    if (!(n >> bit & 1)) continue;
    for (int k = 0; k < 9; k++) sum[k] += power[k] + (k % 4 == 0 ? 1.0 : 0.0);
    rve_multiply(power, x, product);
    for (int k = 0; k < 9; k++) power[k] += x[k] + product[k];
  }
}

/* Least eigenvalue of D from below, by Gershgorin's discs. */
RVE_FN double rve_least_rate(int dim, const double rate[9]) {
  double least = 0.0;
  for (int i = 0; i < dim; i++) {
    double low = rate[4 * i];
    for (int j = 0; j < dim; j++) low -= j == i ? 0.0 : fabs(rate[3 * i + j]);
    least = low < least ? low : least;
  }
  return least;
}

RVE_PART void rve_plan_flight(int dim, const RveCall *call, const RveHead *head, double scale, RveFlight *flight) {
  double e[9], inverse[9], a[9], b[9], unused[9], sum[9], norm = 0.0, strain = 0.0;
  for (int k = 0; k < 9; k++) {
    const double unit = k % 4 == 0 ? 1.0 : 0.0;
    a[k] = -call->gradient[k] * call->dt; /* A - 1 */
    e[k] = unit + call->step_map[k];
    norm += call->gradient[k] * call->gradient[k];
    strain += call->rate[k] * call->rate[k];
  }
  rve_invert(e, inverse);
  /* E^-1 A - 1 = E^-1 ((A - 1) - (E - 1)) */
  for (int k = 0; k < 9; k++) unused[k] = a[k] - call->step_map[k];
  rve_multiply(inverse, unused, b);
  rve_power(b, call->steps, unused, sum);
  rve_multiply(a, sum, flight->drift);
  for (int k = 0; k < 9; k++) flight->drift[k] = call->dt * (sum[k] + flight->drift[k]);
  rve_power(a, call->steps, flight->decay, unused);
  rve_power(call->step_map, call->steps, flight->stretch, unused);
  flight->duration = (double)call->steps * call->dt;
  flight->grow = exp(2.0 * sqrt(norm) * flight->duration);
  flight->shorten = exp(sqrt(strain) * flight->duration);
  flight->squeeze = exp(rve_least_rate(dim, call->rate) * flight->duration);
  flight->scale_max = scale > head->scale ? scale : head->scale;
}

/* 1 if some pair of the list may touch: its nearest approach on a straight line, less what M is off the line, and squeezed. */
RVE_FN int rve_may_meet(RveFeatures ft, const RveTeam *team, const RveFlight *flight, const RveHead *head, const RveCounts *n,
                        const RveArrays *a) {
  const RveFeatures all = {ft.dimension, 0, 1, 0}; /* velocities are needed below */
  const int dim = ft.dimension;
  /* A part in a million more: FP32 forces reach as far as their rounding. */
  const rve_real growth = rve_set(flight->scale_max / head->scale * (1.0 + 1e-6) / flight->squeeze);
  const rve_real end = rve_set(flight->duration), off = rve_set((flight->grow - 1.0) * flight->duration), zero = rve_set(0.0);
  rve_real h[9], met = zero;
  for (int k = 0; k < 9; k++) h[k] = rve_set(head->cell[k] * RVE_UNIT);
  for (int span = team->pack; span < n->blocks * RVE_PARTS; span += team->packs) {
    const int block = span / RVE_PARTS, part = span % RVE_PARTS * RVE_SPAN;
    const RveBody own = rve_own_body(all, a, span * RVE_SPAN);
    for (int row = a->slot_first[block]; row < a->slot_first[block + 1]; row++) {
      const int lane0 = row * RVE_PACK + part;
      const RveBody other = rve_neighbour_body(all, a, lane0);
      rve_real d[3], w[3];
      rve_branch(dim, h, own.s, other.s, rve_load_short(a->image, lane0), d);
      for (int k = 0; k < dim; k++) w[k] = other.v[k] - own.v[k];
      const rve_real square = rve_dot(dim, w, w);
      const rve_real when = (zero - rve_dot(dim, d, w)) / (square + rve_set(1e-300));
      const rve_real nearest = rve_min(rve_max(when, zero), end);
      for (int k = 0; k < dim; k++) d[k] = d[k] + nearest * w[k];
      const rve_real gap = rve_sqrt(rve_dot(dim, d, d)) - off * rve_sqrt(square) - growth * (own.r + other.r);
      met = rve_max(met, rve_select(rve_less(zero, gap), zero, rve_set(1.0))); /* also where a value is not finite */
    }
  }
  return rve_team_max(team, met) > 0.0;
}

/* Largest v, m/s; NaN is lost, but fails rve_may_meet() or the answer. */
RVE_FN double rve_fastest(int dim, const RveTeam *team, const RveCounts *n, const RveArrays *a) {
  rve_real fastest = rve_set(0.0);
  for (int span = team->pack; span < n->blocks * RVE_PARTS; span += team->packs) {
    rve_real v[3];
    for (int k = 0; k < dim; k++) v[k] = rve_load(a->velocity[k], span * RVE_SPAN);
    fastest = rve_max(fastest, rve_dot(dim, v, v));
  }
  return sqrt(rve_team_max(team, fastest));
}

/* Where the list stands after the flight, by the bounds that steps would have taken. */
RVE_FN RveHead rve_head_after(const RveFlight *flight, const RveHead *head, double fastest) {
  RveHead after = *head;
  after.stretch = head->stretch / flight->shorten;
  after.reach = (head->reach + fastest * flight->grow * flight->duration) * flight->shorten;
  after.scale = flight->scale_max;
  return after;
}

RVE_FN void rve_move_freely(RveFeatures ft, const RveTeam *team, const RveCall *call, const RveFlight *flight, const RveHead *head,
                            double scale, const RveCounts *n, const RveArrays *a) {
  const int dim = ft.dimension;
  rve_real drift[9], decay[9];
  double m[9];
  rve_multiply(head->inverse, flight->drift, m);
  for (int k = 0; k < 9; k++) drift[k] = rve_set(m[k] * (double)RVE_ONE), decay[k] = rve_set(flight->decay[k]);
  for (int span = team->pack; span < n->blocks * RVE_PARTS; span += team->packs) {
    const int lane0 = span * RVE_SPAN;
    rve_real v[3];
    for (int k = 0; k < dim; k++) v[k] = rve_load(a->velocity[k], lane0);
    for (int k = 0; k < dim; k++) {
      rve_real step = drift[3 * k] * v[0] + drift[3 * k + 1] * v[1], change = decay[3 * k] * v[0] + decay[3 * k + 1] * v[1];
      if (dim == 3) step = step + drift[3 * k + 2] * v[2], change = change + decay[3 * k + 2] * v[2];
      rve_store_int(a->position[k], lane0, rve_int_add(rve_load_int(a->position[k], lane0), rve_int_from_real(step)));
      rve_store(a->velocity[k], lane0, v[k] + change);
    }
    if (call->thermal) rve_store(a->radius, lane0, rve_load(a->reference_radius, lane0) * rve_set(scale));
  }
}

/* 1: the call is done (rows excepted). 0: it must be stepped; nothing has changed. */
RVE_PART int rve_fly(RveFeatures ft, const RveTeam *team, const RveCall *call, RveHead *head, double scale, const RveCounts *n,
                     const RveArrays *a) {
  RveFlight flight;
  if (!call->flight || call->steps < 2 || !(scale > 0.0)) return 0;
  if (head->done > 0 || head->list_due != RVE_LIST_GOOD || !head->apart) return 0;
  rve_plan_flight(ft.dimension, call, head, scale, &flight);
  const double fastest = rve_fastest(ft.dimension, team, n, a);
  const RveHead after = rve_head_after(&flight, head, fastest);
  const double least = scale < head->scale ? scale : head->scale;
  /* The watchdog's limit, and a list that holds to the end. */
  if (!(fastest * flight.grow * call->dt <= 0.5 * head->radius_min * least) || rve_list_is_spent(&after)) return 0;
  if (rve_may_meet(ft, team, &flight, head, n, a)) return 0;
  rve_move_freely(ft, team, call, &flight, head, scale, n, a);
  rve_sync(); /* all have read the head */
  if (team->leader) {
    double deformed[9];
    rve_multiply(flight.stretch, head->cell, deformed);
    for (int k = 0; k < 9; k++) head->cell[k] += deformed[k], head->rate[k] = call->rate[k];
    rve_invert(head->cell, head->inverse);
    head->stretch = after.stretch;
    head->reach = after.reach;
    head->approach += 2.0 * head->radius_max * flight.scale_max; /* no row rests longer than that: all are looked at again */
    head->temperature = call->temperature;
    head->scale = scale;
    head->steps += call->steps;
  }
  return 1;
}

#endif
