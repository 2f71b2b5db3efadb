/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "grain_network_private.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static int compare_links(const void *a, const void *b) {
  const GrainLink *one = a, *two = b;
  if (one->grain != two->grain) return one->grain < two->grain ? -1 : 1;
  if (one->order != two->order) return one->order < two->order ? -1 : 1;
  if (one->conduction != two->conduction) return one->conduction < two->conduction ? -1 : 1;
  if (one->area != two->area) return one->area < two->area ? -1 : 1;
  return (one->other > two->other) - (one->other < two->other);
}

static void store_links(GrainNetwork *n, int64_t links, const GrainLink *link) {
  for (int64_t k = 0; k < links; k++) {
    n->first[link[k].grain + 1]++;
    n->other[k] = link[k].other;
    n->conduction[k] = link[k].conduction;
    n->area[k] = link[k].area;
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
  n->grains = grains, n->copies = copies, n->baths = baths;
  TRY_GOTO(BASE_ALLOC((size_t)grains + 1, &n->first), status, failed);
  TRY_GOTO(BASE_ALLOC((size_t)links, &n->other), status, failed);
  double **const of_links[3] = {&n->conduction, &n->area, &n->conductance};
  double **const of_grains[3] = {&n->capacity, &n->own, &n->slope};
  for (int k = 0; k < 3; k++) {
    TRY_GOTO(BASE_ALLOC((size_t)links, of_links[k]), status, failed);
    TRY_GOTO(BASE_ALLOC((size_t)grains, of_grains[k]), status, failed);
  }
  TRY_GOTO(BASE_ALLOC((size_t)baths, &n->bath), status, failed);
  /* Solver: a direction with its copies, and five values of grains. */
  TRY_GOTO(BASE_ALLOC(6 * (size_t)grains + (size_t)copies + 1, &n->work), status, failed);
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
  base_free(n->conduction);
  base_free(n->area);
  base_free(n->conductance);
  base_free(n->capacity);
  base_free(n->bath);
  base_free(n->own);
  base_free(n->slope);
  base_free(n->work);
  base_free(n);
}

static double radiate(const GrainNetwork *n, double area, double one, double two) {
  return area > 0.0 ? area * grain_emission((double[2]){one, two}, n->absolute_zero) : 0.0;
}

void grain_network_refresh(GrainNetwork *n, const double *T) {
  if (n->change.renew) n->change.renew(n->change.context, n, T);
  for (int i = 0; i < n->grains; i++) {
    n->own[i] = n->slope[i] = 0.0;
    for (int k = n->first[i]; k < n->first[i + 1]; k++)
      n->conductance[k] = n->conduction[k] + radiate(n, n->area[k], T[i], T[n->other[k]]);
  }
  for (int b = 0; b < n->baths; b++) {
    GrainBath *bath = &n->bath[b];
    const int i = bath->grain;
    bath->conductance = bath->conduction + radiate(n, bath->area, T[i], bath->temperature);
    n->own[i] += bath->conductance;
    n->slope[i] += bath->conduction + radiate(n, bath->area, T[i], T[i]);
  }
}

/* Sum of all conductances of a grain, W/K. */
double grain_network_sum(const GrainNetwork *n, int i) {
  double sum = n->own[i];
  for (int k = n->first[i]; k < n->first[i + 1]; k++) sum += n->conductance[k];
  return sum;
}

double grain_network_time_step(const GrainNetwork *n, int *grain) {
  double least = HUGE_VAL;
  *grain = -1;
  for (int i = 0; i < n->grains; i++) {
    const double sum = grain_network_sum(n, i);
    if (n->capacity[i] > 0.0 && sum > 0.0 && n->capacity[i] / sum < least) least = n->capacity[i] / sum, *grain = i;
  }
  return least;
}

void grain_network_add(GrainSum *sum, double x) {
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
    grain_network_add(&flows[bath->kind], flow);
  }
}

double grain_network_warm(const GrainNetwork *n, int i, double T, double heat) {
  return n->change.warm ? n->change.warm(n->change.context, i, T, heat) : T + heat / n->capacity[i];
}

void grain_network_advance(const GrainNetwork *n, double step, const double *heat, const double *source, double *T) {
  for (int i = 0; i < n->grains; i++)
    if (n->capacity[i] > 0.0) T[i] = grain_network_warm(n, i, T[i], (heat[i] + source[i]) * step);
}
