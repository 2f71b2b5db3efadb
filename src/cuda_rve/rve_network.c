/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "rve_network.h"

#include <math.h>
#include <string.h>

static const double residual_ratio = 1e-12; /* in the norm of the preconditioner */

void rve_network_destroy(RveNetwork *network) {
  base_free(network->link);
  base_free(network->first), base_free(network->column);
  base_free(network->weight), base_free(network->inverse_diagonal);
  for (int k = 0; k < 3; k++) base_free(network->rise[k]);
  for (int k = 0; k < 4; k++) base_free(network->work[k]);
  memset(network, 0, sizeof *network);
}

BaseStatus rve_network_add(RveNetwork *network, const RveLink *link) {
  if (network->links == network->link_room) {
    const int room = network->link_room ? 2 * network->link_room : 256;
    TRY(BASE_GROW((size_t)network->link_room, (size_t)room, &network->link));
    network->link_room = room;
  }
  network->link[network->links++] = *link;
  return BASE_OK;
}

/* -------------------------------------------------------------------------------------------------------- tensors */

/* k = (1/V) sum h d (x) d, d = branch, plus the difference of the rises where there are any. */
static void sum_links(const RveNetwork *network, int dimension, double volume, double *const rise[3], double k[6]) {
  static const int row[6] = {0, 1, 2, 0, 0, 1}, column[6] = {0, 1, 2, 1, 2, 2};
  double sum[6] = {0.0};
  for (int l = 0; l < network->links; l++) {
    const RveLink *link = &network->link[l];
    double d[3] = {0.0, 0.0, 0.0};
    for (int a = 0; a < dimension; a++)
      d[a] = link->branch[a] + (rise ? rise[a][link->pair[1]] - rise[a][link->pair[0]] : 0.0);
    for (int m = 0; m < 6; m++) sum[m] += link->conductance * d[row[m]] * d[column[m]];
  }
  for (int m = 0; m < 6; m++) k[m] = sum[m] / volume;
}

void rve_network_affine(const RveNetwork *network, int dimension, double volume, double k[6]) {
  sum_links(network, dimension, volume, NULL, k);
}

/* ------------------------------------------------------------------------------------------------------ Laplacian */

static BaseStatus reserve(RveNetwork *network, int grains) {
  const int entries = 2 * network->links;
  if (grains > network->grain_room) {
    TRY(BASE_GROW(0, (size_t)grains + 1, &network->first));
    TRY(BASE_GROW(0, (size_t)grains, &network->inverse_diagonal));
    for (int k = 0; k < 3; k++) TRY(BASE_GROW(0, (size_t)grains, &network->rise[k]));
    for (int k = 0; k < 4; k++) TRY(BASE_GROW(0, (size_t)grains, &network->work[k]));
    network->grain_room = grains;
  }
  if (entries > network->entry_room) {
    TRY(BASE_GROW(0, (size_t)entries, &network->column));
    TRY(BASE_GROW(0, (size_t)entries, &network->weight));
    network->entry_room = entries;
  }
  return BASE_OK;
}

/* Rows of -(off-diagonal part), in the order of the links; links of a grain with itself carry no difference of rises. */
static void fill_rows(RveNetwork *network, int grains) {
  int32_t *first = network->first;
  double *diagonal = network->inverse_diagonal;
  memset(first, 0, ((size_t)grains + 1) * sizeof *first);
  memset(diagonal, 0, (size_t)grains * sizeof *diagonal);
  for (int l = 0; l < network->links; l++) {
    const RveLink *link = &network->link[l];
    if (link->pair[0] == link->pair[1]) continue;
    for (int side = 0; side < 2; side++) first[link->pair[side]]++, diagonal[link->pair[side]] += link->conductance;
  }
  int32_t end = 0;
  for (int i = 0; i <= grains; i++) {
    const int32_t count = i < grains ? first[i] : 0;
    first[i] = end, end += count;
  }
  for (int l = 0; l < network->links; l++) {
    const RveLink *link = &network->link[l];
    if (link->pair[0] == link->pair[1]) continue;
    for (int side = 0; side < 2; side++) {
      const int32_t at = first[link->pair[side]]++;
      network->column[at] = link->pair[1 - side];
      network->weight[at] = link->conductance;
    }
  }
  memmove(first + 1, first, (size_t)grains * sizeof *first); /* each start had moved on to the next one's */
  first[0] = 0;
  for (int i = 0; i < grains; i++) diagonal[i] = diagonal[i] > 0.0 ? 1.0 / diagonal[i] : 0.0;
}

/* supply: the heat that the affine temperatures of a unit gradient along `axis` bring to each grain, W m/K; gross: the same
 * without signs. Returns the square of gross in the norm of the preconditioner: in a crystal the supply is nothing but
 * round-off of it. */
static double fill_supply(const RveNetwork *network, int grains, int axis, double *supply, double *gross) {
  double square = 0.0;
  memset(supply, 0, (size_t)grains * sizeof *supply);
  memset(gross, 0, (size_t)grains * sizeof *gross);
  for (int l = 0; l < network->links; l++) {
    const RveLink *link = &network->link[l];
    if (link->pair[0] == link->pair[1]) continue;
    const double flow = link->conductance * link->branch[axis];
    supply[link->pair[0]] += flow, supply[link->pair[1]] -= flow;
    gross[link->pair[0]] += fabs(flow), gross[link->pair[1]] += fabs(flow);
  }
  for (int i = 0; i < grains; i++) square += network->inverse_diagonal[i] * gross[i] * gross[i];
  return square;
}

/* y = Laplacian x; returns x.y */
static double apply(const RveNetwork *network, int grains, const double *x, double *y) {
  double product = 0.0;
  for (int i = 0; i < grains; i++) {
    double sum = 0.0;
    for (int32_t at = network->first[i]; at < network->first[i + 1]; at++)
      sum += network->weight[at] * (x[i] - x[network->column[at]]);
    y[i] = sum;
    product += x[i] * sum;
  }
  return product;
}

static double precondition(const RveNetwork *network, int grains, const double *r, double *z) {
  double product = 0.0;
  for (int i = 0; i < grains; i++) z[i] = network->inverse_diagonal[i] * r[i], product += z[i] * r[i];
  return product;
}

/* Conjugate gradients: Laplacian x = work[0], which is used up. goal: square of the residual, in the preconditioner's norm. */
static BaseStatus solve(RveNetwork *network, int grains, double goal, double *x) {
  double *r = network->work[0], *z = network->work[1], *p = network->work[2], *q = network->work[3];
  memset(x, 0, (size_t)grains * sizeof *x);
  double rho = precondition(network, grains, r, z);
  const int most = 100 + 20 * grains;
  memcpy(p, z, (size_t)grains * sizeof *p);
  for (int round = 0; rho > goal; round++) {
    const double curvature = apply(network, grains, p, q);
    if (round == most || !(curvature > 0.0))
      return base_error(BASE_ERROR_UNSTABLE, "the network's residual is still %.2g times the one allowed after %d iterations",
                        sqrt(rho / goal), round);
    const double step = rho / curvature;
    for (int i = 0; i < grains; i++) x[i] += step * p[i], r[i] -= step * q[i];
    const double next = precondition(network, grains, r, z), turn = next / rho;
    for (int i = 0; i < grains; i++) p[i] = z[i] + turn * p[i];
    rho = next;
  }
  return rho <= goal ? BASE_OK : base_error(BASE_ERROR_UNSTABLE, "a conductance of the network is not finite");
}

BaseStatus rve_network_solve(RveNetwork *network, int grains, int dimension, double volume, double k[6]) {
  TRY(reserve(network, grains));
  fill_rows(network, grains);
  for (int axis = 0; axis < dimension; axis++) {
    const double gross = fill_supply(network, grains, axis, network->work[0], network->work[1]);
    TRY(solve(network, grains, residual_ratio * residual_ratio * gross, network->rise[axis]));
  }
  sum_links(network, dimension, volume, network->rise, k);
  return BASE_OK;
}
