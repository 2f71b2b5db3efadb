/* SPDX-License-Identifier: GPL-2.0-or-later */
#include <math.h>

#include "grain_network_private.h"

enum { MOST_RENEWALS = 100, MOST_HALVINGS = 40 };

typedef struct Solver {
  GrainNetwork *network;
  const GrainRanks *ranks;
  const double *source;
  double *T;
  double rate;               /* 1 / step; 0: steady */
  double *direction;         /* with copies */
  double *residual, *image;  /* image: matrix times direction */
  double *change;            /* correction of T by one linearisation */
  double *start;             /* T0 */
  double *heat;              /* that takes T0 to T, J */
  double tolerance;
  double through, noise;     /* squares at T, as of the residual: heat through the grains, its round-off */
  double most_through;       /* largest of the temperatures taken */
  int iterations, most;
} Solver;

static double total(GrainSum sum) { return sum.high + sum.low; }

/* residual = flows at T + source - heat / step, with the conductances at T. Returns sum residual^2 / C. */
static double balance(Solver *s) {
  GrainNetwork *n = s->network;
  const double *T = s->T;
  GrainSum sums[3] = {{0.0, 0.0}, {0.0, 0.0}, {0.0, 0.0}}, flows[GRAIN_BATH_KINDS];
  grain_network_refresh(n, T);
  grain_network_flow(n, T, s->residual, flows);
  for (int i = 0; i < n->grains; i++) s->image[i] = fabs(s->source[i]);
  for (int b = 0; b < n->baths; b++)
    s->image[n->bath[b].grain] += n->bath[b].conductance * fabs(n->bath[b].temperature - T[n->bath[b].grain]);
  for (int i = 0; i < n->grains; i++) {
    if (!(n->capacity[i] > 0.0)) continue;
    double through = s->image[i];
    for (int k = n->first[i]; k < n->first[i + 1]; k++) through += n->conductance[k] * fabs(T[n->other[k]] - T[i]);
    s->residual[i] += s->source[i] - s->heat[i] * s->rate;
    const double lost = 2e-16 * (grain_network_sum(n, i) * fabs(T[i]) + fabs(s->source[i]) + fabs(s->heat[i]) * s->rate);
    grain_network_add(&sums[0], s->residual[i] * s->residual[i] / n->capacity[i]);
    grain_network_add(&sums[1], through * through / n->capacity[i]);
    grain_network_add(&sums[2], lost * lost / n->capacity[i]);
  }
  s->ranks->sum(s->ranks->context, 3, sums);
  s->through = total(sums[1]), s->noise = total(sums[2]);
  return total(sums[0]);
}

static double find_goal(const Solver *s, double through) {
  return fmax(s->tolerance * s->tolerance * through, s->noise);
}

/* image = (C / step + network) direction; returns direction . image. */
static double apply(Solver *s) {
  const GrainNetwork *n = s->network;
  const double *p = s->direction;
  GrainSum sum = {0.0, 0.0};
  s->ranks->spread(s->ranks->context, s->direction);
  for (int i = 0; i < n->grains; i++) {
    if (!(n->capacity[i] > 0.0)) continue;
    double flow = (n->slope[i] + n->capacity[i] * s->rate) * p[i];
    for (int k = n->first[i]; k < n->first[i + 1]; k++) flow += n->conductance[k] * (p[i] - p[n->other[k]]);
    s->image[i] = flow;
    grain_network_add(&sum, p[i] * flow);
  }
  s->ranks->sum(s->ranks->context, 1, &sum);
  return total(sum);
}

/* Change and residual along the direction; returns sum residual^2 / C. */
static double move(Solver *s, double length) {
  const GrainNetwork *n = s->network;
  GrainSum sum = {0.0, 0.0};
  for (int i = 0; i < n->grains; i++) {
    if (!(n->capacity[i] > 0.0)) continue;
    s->change[i] += length * s->direction[i];
    s->residual[i] -= length * s->image[i];
    grain_network_add(&sum, s->residual[i] * s->residual[i] / n->capacity[i]);
  }
  s->ranks->sum(s->ranks->context, 1, &sum);
  return total(sum);
}

/* The change that makes the residual of the linearisation fall from `square` to `goal`; returns what it falls to. */
static double linearise(Solver *s, double square, double goal) {
  const GrainNetwork *n = s->network;
  double before = HUGE_VAL;
  for (int i = 0; i < n->grains; i++) s->direction[i] = s->change[i] = 0.0;
  for (int k = 0; s->iterations < s->most && square > goal; k++) {
    for (int i = 0; i < n->grains; i++)
      if (n->capacity[i] > 0.0)
        s->direction[i] = s->residual[i] / n->capacity[i] + (k > 0 ? square / before : 0.0) * s->direction[i];
    const double energy = apply(s);
    if (!(energy > 0.0)) break; /* nothing conducts what the sources bring */
    before = square;
    square = move(s, before / energy);
    s->iterations++;
  }
  /* As heat: what a capacity over temperature makes of a change of temperature would not add up to nothing. */
  for (int i = 0; i < n->grains; i++) s->change[i] *= n->capacity[i];
  return square;
}

/* `share` of the change, as heat, into the grains. */
static void warm(Solver *s, double share) {
  const GrainNetwork *n = s->network;
  for (int i = 0; i < n->grains; i++) {
    if (!(n->capacity[i] > 0.0)) continue;
    s->heat[i] += share * s->change[i];
    s->T[i] = grain_network_warm(n, i, s->start[i], s->heat[i]);
  }
  s->ranks->spread(s->ranks->context, s->T);
}

/* The largest of the shares 1, 1/2, 1/4... with which the residual falls below `square`; what it falls to. */
static double correct(Solver *s, double square) {
  double now, share = 1.0;
  warm(s, share);
  for (int k = 0; !((now = balance(s)) < square) && !(now <= find_goal(s, s->through)) && k < MOST_HALVINGS; k++) {
    share *= 0.5;
    warm(s, -share);
  }
  return now;
}

static BaseStatus report(const Solver *s, double square, bool solved, int renewals, GrainSolution *solution) {
  *solution = (GrainSolution){s->iterations, renewals, s->most_through > 0.0 ? sqrt(square / s->most_through) : 0.0};
  /* A group that ends with one temperature has no flows to compare with but those before. */
  if (square <= find_goal(s, s->most_through)) return BASE_OK;
  if (!solved)
    return base_error(BASE_ERROR_UNSTABLE,
                      "no balance of heat after %d iterations: %.3g of the heat flow is left over, allowed is %.3g; "
                      "grains with a source and no way to a wall, a fluid or surroundings have no steady state",
                      s->iterations, solution->residual, s->tolerance);
  return base_error(BASE_ERROR_UNSTABLE,
                    "temperatures and what depends on them (tables, radiation) do not agree after %d corrections: %.3g "
                    "of the heat flow is left over, allowed is %.3g; smoother tables or a smaller time step help",
                    renewals, solution->residual, s->tolerance);
}

BaseStatus grain_network_solve(GrainNetwork *n, const GrainRanks *ranks, double step, double tolerance, int most,
                               const double *source, double *T, GrainSolution *solution) {
  double *const rest = n->work + n->grains + n->copies;
  const size_t grains = (size_t)n->grains;
  Solver s = {n, ranks, source, T, 1.0 / step, n->work, rest, rest + grains, rest + 2 * grains, rest + 3 * grains,
              rest + 4 * grains, tolerance, 0.0, 0.0, 0.0, 0, most};
  for (size_t i = 0; i < grains; i++) s.start[i] = T[i], s.heat[i] = 0.0;
  bool solved = true, falls = true;
  int renewals = 0;
  double square = balance(&s);
  s.most_through = s.through;
  for (; square > find_goal(&s, s.through) && solved && falls && renewals < MOST_RENEWALS; renewals++) {
    const double before = square, end = find_goal(&s, s.through);
    /* Conductances of the last temperatures are not worth more than a thousandth of the residual. */
    const double goal = n->varies ? fmax(1e-6 * before, 0.25 * end) : end;
    square = linearise(&s, before, goal);
    solved = square <= goal;
    if (!solved || !n->varies) {
      warm(&s, 1.0), renewals++;
      break;
    }
    square = correct(&s, before), falls = square < before;
    s.most_through = fmax(s.most_through, s.through);
  }
  return report(&s, square, solved, renewals, solution);
}
