/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "grain_network.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static int compare_links(const void *a, const void *b) {
  const GrainLink *one = a, *two = b;
  if (one->grain != two->grain) return one->grain < two->grain ? -1 : 1;
  if (one->order != two->order) return one->order < two->order ? -1 : 1;
  if (one->conductance != two->conductance) return one->conductance < two->conductance ? -1 : 1;
  return (one->other > two->other) - (one->other < two->other);
}

static void store_links(GrainNetwork *n, int64_t links, const GrainLink *link) {
  for (int64_t k = 0; k < links; k++) {
    n->first[link[k].grain + 1]++;
    n->other[k] = link[k].other;
    n->conductance[k] = link[k].conductance;
  }
  for (int i = 0; i < n->grains; i++) n->first[i + 1] += n->first[i];
}

BaseStatus grain_network_create(int grains, int copies, int64_t links, GrainLink *link, int baths,
                                const GrainBath *bath, GrainNetwork **network) {
  BaseStatus status;
  *network = NULL;
  if (links > INT32_MAX) return base_error(BASE_ERROR_MEMORY, "%lld links on one rank", (long long)links);
  GrainNetwork *n = NULL;
  TRY(BASE_ALLOC(1, &n));
  n->grains = grains, n->baths = baths;
  TRY_GOTO(BASE_ALLOC((size_t)grains + 1, &n->first), status, failed);
  TRY_GOTO(BASE_ALLOC((size_t)links, &n->other), status, failed);
  TRY_GOTO(BASE_ALLOC((size_t)links, &n->conductance), status, failed);
  TRY_GOTO(BASE_ALLOC((size_t)grains, &n->capacity), status, failed);
  TRY_GOTO(BASE_ALLOC((size_t)grains, &n->radius), status, failed);
  TRY_GOTO(BASE_ALLOC((size_t)baths, &n->bath), status, failed);
  TRY_GOTO(BASE_ALLOC((size_t)grains, &n->own), status, failed);
  /* Solver: a direction with its copies, residual, matrix times direction. */
  TRY_GOTO(BASE_ALLOC(3 * (size_t)grains + (size_t)copies, &n->work), status, failed);
  if (links > 0) qsort(link, (size_t)links, sizeof *link, compare_links);
  store_links(n, links, link);
  if (baths > 0) memcpy(n->bath, bath, (size_t)baths * sizeof *bath);
  *network = n;
  return BASE_OK;
failed:
  grain_network_destroy(n);
  return status;
}

void grain_network_destroy(GrainNetwork *n) {
  if (!n) return;
  base_free(n->first);
  base_free(n->other);
  base_free(n->conductance);
  base_free(n->capacity);
  base_free(n->radius);
  base_free(n->bath);
  base_free(n->own);
  base_free(n->work);
  base_free(n);
}

void grain_network_refresh(GrainNetwork *n, const double *T) {
  for (int b = 0; b < n->baths; b++) n->own[n->bath[b].grain] = 0.0;
  for (int b = 0; b < n->baths; b++) {
    GrainBath *bath = &n->bath[b];
    const int i = bath->grain;
    if (bath->kind == GRAIN_BATH_RADIATION)
      bath->conductance = grain_radiation_conductance(&n->surface, n->radius[i], T[i]);
    n->own[i] += bath->conductance;
  }
}

/* Sum of all conductances of a grain, W/K. */
static double sum_conductances(const GrainNetwork *n, int i) {
  double sum = n->own[i];
  for (int k = n->first[i]; k < n->first[i + 1]; k++) sum += n->conductance[k];
  return sum;
}

double grain_network_time_step(const GrainNetwork *n, int *grain) {
  double least = HUGE_VAL;
  *grain = -1;
  for (int i = 0; i < n->grains; i++) {
    const double sum = sum_conductances(n, i);
    if (n->capacity[i] > 0.0 && sum > 0.0 && n->capacity[i] / sum < least) least = n->capacity[i] / sum, *grain = i;
  }
  return least;
}

/* Knuth's two-sum: `low` collects what each addition to `high` rounds away. */
static void add_exactly(GrainSum *sum, double x) {
  const double total = sum->high + x, part = total - sum->high;
  sum->low += (sum->high - (total - part)) + (x - part);
  sum->high = total;
}

void grain_network_flow(const GrainNetwork *n, const double *T, double *heat, GrainSum *flows) {
  for (int i = 0; i < n->grains; i++) {
    double sum = 0.0;
    for (int k = n->first[i]; k < n->first[i + 1]; k++) sum += n->conductance[k] * (T[n->other[k]] - T[i]);
    heat[i] = sum;
  }
  for (int k = 0; k < GRAIN_BATH_KINDS; k++) flows[k] = (GrainSum){0.0, 0.0};
  for (int b = 0; b < n->baths; b++) {
    const GrainBath *bath = &n->bath[b];
    const double flow = bath->conductance * (bath->temperature - T[bath->grain]);
    heat[bath->grain] += flow;
    add_exactly(&flows[bath->kind], flow);
  }
}

void grain_network_advance(const GrainNetwork *n, double step, const double *heat, const double *source, double *T) {
  for (int i = 0; i < n->grains; i++)
    if (n->capacity[i] > 0.0) T[i] += (heat[i] + source[i]) * step / n->capacity[i];
}

/* ------------------------------------------------------------------------------------------------- implicit */
typedef struct Solver {
  GrainNetwork *network;
  const GrainRanks *ranks;
  double rate;                          /* 1 / step; 0: steady */
  double *direction, *residual, *image; /* the direction has copies */
} Solver;

/* residual = flows + source at T = T0. Returns sum residual^2 / C; *scale: sum of squares / C of the heat that flows
 * into or out of each grain; *noise: the same of what round-off of the temperatures makes of it. */
static double start(Solver *s, const double *source, const double *T, double *scale, double *noise) {
  const GrainNetwork *n = s->network;
  GrainSum sums[3] = {{0.0, 0.0}, {0.0, 0.0}, {0.0, 0.0}}, flows[GRAIN_BATH_KINDS];
  grain_network_flow(n, T, s->residual, flows);
  for (int i = 0; i < n->grains; i++) s->image[i] = fabs(source[i]);
  for (int b = 0; b < n->baths; b++)
    s->image[n->bath[b].grain] += n->bath[b].conductance * fabs(n->bath[b].temperature - T[n->bath[b].grain]);
  for (int i = 0; i < n->grains; i++) {
    s->direction[i] = 0.0;
    if (!(n->capacity[i] > 0.0)) continue;
    double through = s->image[i];
    for (int k = n->first[i]; k < n->first[i + 1]; k++) through += n->conductance[k] * fabs(T[n->other[k]] - T[i]);
    s->residual[i] += source[i];
    const double lost = 2e-16 * (sum_conductances(n, i) * fabs(T[i]) + fabs(source[i]));
    add_exactly(&sums[0], s->residual[i] * s->residual[i] / n->capacity[i]);
    add_exactly(&sums[1], through * through / n->capacity[i]);
    add_exactly(&sums[2], lost * lost / n->capacity[i]);
  }
  s->ranks->sum(s->ranks->context, 3, sums);
  *scale = sums[1].high + sums[1].low;
  *noise = sums[2].high + sums[2].low;
  return sums[0].high + sums[0].low;
}

/* image = (C / step + network) direction; returns direction . image. */
static double apply(Solver *s) {
  const GrainNetwork *n = s->network;
  const double *p = s->direction;
  GrainSum sum = {0.0, 0.0};
  s->ranks->spread(s->ranks->context, s->direction);
  for (int i = 0; i < n->grains; i++) {
    if (!(n->capacity[i] > 0.0)) continue;
    double flow = (n->own[i] + n->capacity[i] * s->rate) * p[i];
    for (int k = n->first[i]; k < n->first[i + 1]; k++) flow += n->conductance[k] * (p[i] - p[n->other[k]]);
    s->image[i] = flow;
    add_exactly(&sum, p[i] * flow);
  }
  s->ranks->sum(s->ranks->context, 1, &sum);
  return sum.high + sum.low;
}

/* T and residual along the direction; returns sum residual^2 / C. */
static double move(Solver *s, double length, double *T) {
  const GrainNetwork *n = s->network;
  GrainSum sum = {0.0, 0.0};
  for (int i = 0; i < n->grains; i++) {
    if (!(n->capacity[i] > 0.0)) continue;
    T[i] += length * s->direction[i];
    s->residual[i] -= length * s->image[i];
    add_exactly(&sum, s->residual[i] * s->residual[i] / n->capacity[i]);
  }
  s->ranks->sum(s->ranks->context, 1, &sum);
  return sum.high + sum.low;
}

BaseStatus grain_network_solve(GrainNetwork *n, const GrainRanks *ranks, double step, double tolerance, int most,
                               const double *source, double *T, GrainSolution *solution) {
  Solver s = {n, ranks, 1.0 / step, n->work + 2 * (size_t)n->grains, n->work, n->work + n->grains};
  double scale, noise, square = start(&s, source, T, &scale, &noise), before = HUGE_VAL;
  const double goal = fmax(tolerance * tolerance * scale, noise);
  int k = 0;
  for (; k < most && square > goal; k++) {
    for (int i = 0; i < n->grains; i++)
      if (n->capacity[i] > 0.0)
        s.direction[i] = s.residual[i] / n->capacity[i] + (k > 0 ? square / before : 0.0) * s.direction[i];
    const double energy = apply(&s);
    if (!(energy > 0.0)) break; /* nothing conducts what the sources bring */
    before = square;
    square = move(&s, before / energy, T);
  }
  ranks->spread(ranks->context, T);
  *solution = (GrainSolution){k, scale > 0.0 ? sqrt(square / scale) : 0.0};
  if (square <= goal) return BASE_OK;
  return base_error(BASE_ERROR_UNSTABLE,
                    "no balance of heat after %d iterations: %.3g of the heat flow is left over, allowed is %.3g; "
                    "grains with a source and no way to a wall, a fluid or surroundings have no steady state",
                    k, solution->residual, tolerance);
}
