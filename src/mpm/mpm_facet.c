/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Facets of surfaces: normals, which edges are on the rim, nearest points. */
#include "mpm_facet.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static double dot(const double a[3], const double b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

static void subtract(const double a[3], const double b[3], double result[3]) {
  for (int i = 0; i < 3; i++) result[i] = a[i] - b[i];
}

static void cross(const double a[3], const double b[3], double result[3]) {
  for (int i = 0; i < 3; i++) result[i] = a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3];
}

/* -------------------------------------------------------------------------------------------------------- normals */

static BaseStatus turn_one(MpmFacet *facet, int dimension, int index, int count) {
  double first[3], second[3] = {0.0, 0.0, 1.0}, longest = 0.0;
  for (int n = 0; n < dimension; n++)
    for (int i = 0; i < 3; i++)
      if (!isfinite(facet->node[n][i]) || !isfinite(facet->velocity[n][i]))
        return base_error(BASE_ERROR_ARGUMENT,
                          "facet %d of %d: node %d is at %g with velocity %g (axis %d); both must be finite", index + 1,
                          count, n + 1, facet->node[n][i], facet->velocity[n][i], i);
  subtract(facet->node[1], facet->node[0], first);
  if (dimension == 3) {
    subtract(facet->node[2], facet->node[0], second);
    cross(first, second, facet->normal);
    longest = fmax(dot(first, first), dot(second, second));
  } else
    cross(second, first, facet->normal), longest = 1.0;
  const double length = sqrt(dot(facet->normal, facet->normal));
  if (!(length > 1e-12 * longest) || length == 0.0)
    return base_error(BASE_ERROR_ARGUMENT, "facet %d of %d at (%g, %g, %g) has no %s", index + 1, count,
                      facet->node[0][0], facet->node[0][1], facet->node[0][2], dimension == 3 ? "area" : "length");
  for (int i = 0; i < 3; i++) facet->normal[i] /= length;
  return BASE_OK;
}

BaseStatus mpm_facets_turn(MpmFacet *facets, int count, int dimension) {
  for (int f = 0; f < count; f++) TRY(turn_one(&facets[f], dimension, f, count));
  return BASE_OK;
}

/* ------------------------------------------------------------------------------------------------------------ rim */

typedef struct Corner {
  double along; /* a generic direction: few corners that differ agree in it */
  int slot;     /* facet x dimension + node */
} Corner;

typedef struct Edge {
  int low, high; /* identities of its nodes */
  int slot;
} Edge;

static int compare_corners(const void *a, const void *b) {
  const Corner *left = a, *right = b;
  if (left->along != right->along) return left->along < right->along ? -1 : 1;
  return left->slot - right->slot;
}

static int compare_edges(const void *a, const void *b) {
  const Edge *left = a, *right = b;
  if (left->low != right->low) return left->low - right->low;
  return left->high != right->high ? left->high - right->high : left->slot - right->slot;
}

/* identity[slot]: the same number for corners at the same place. */
static void identify(const MpmFacet *facets, int dimension, int corners, Corner *corner, int *identity) {
  static const double GENERIC[3] = {0.5377, 0.6133, 0.5787};
  double low = INFINITY, high = -INFINITY;
  for (int c = 0; c < corners; c++) {
    corner[c] = (Corner){dot(facets[c / dimension].node[c % dimension], GENERIC), c};
    low = fmin(low, corner[c].along), high = fmax(high, corner[c].along);
    identity[c] = -1;
  }
  const double tolerance = 1e-8 * (high - low);
  qsort(corner, (size_t)corners, sizeof *corner, compare_corners);
  for (int c = 0; c < corners; c++) {
    const int slot = corner[c].slot;
    if (identity[slot] >= 0) continue;
    identity[slot] = slot;
    for (int d = c + 1; d < corners && corner[d].along - corner[c].along <= tolerance; d++) {
      const int other = corner[d].slot;
      double offset[3];
      subtract(facets[other / dimension].node[other % dimension], facets[slot / dimension].node[slot % dimension],
               offset);
      if (dot(offset, offset) <= tolerance * tolerance) identity[other] = slot;
    }
  }
}

/* 2D: an end that is alone. */
static void mark_ends(MpmFacet *facets, int corners, const int *identity, int *uses) {
  for (int c = 0; c < corners; c++) uses[identity[c]]++;
  for (int c = 0; c < corners; c++)
    if (uses[identity[c]] == 1) facets[c / 2].free_nodes |= (unsigned char)(1 << c % 2);
}

/* 3D: an edge that is alone, and the nodes on such edges. */
static void mark_edges(MpmFacet *facets, int corners, const int *identity, int *is_free, Edge *edge) {
  for (int c = 0; c < corners; c++) {
    const int one = identity[c], other = identity[c / 3 * 3 + (c + 1) % 3];
    edge[c] = (Edge){one < other ? one : other, one < other ? other : one, c};
  }
  qsort(edge, (size_t)corners, sizeof *edge, compare_edges);
  for (int c = 0; c < corners; c++) {
    const int same_before = c > 0 && edge[c - 1].low == edge[c].low && edge[c - 1].high == edge[c].high;
    const int same_after = c + 1 < corners && edge[c + 1].low == edge[c].low && edge[c + 1].high == edge[c].high;
    if (same_before || same_after) continue;
    facets[edge[c].slot / 3].free_edges |= (unsigned char)(1 << edge[c].slot % 3);
    is_free[edge[c].low] = is_free[edge[c].high] = 1;
  }
  for (int c = 0; c < corners; c++)
    if (is_free[identity[c]]) facets[c / 3].free_nodes |= (unsigned char)(1 << c % 3);
}

BaseStatus mpm_facets_prepare(MpmFacet *facets, int count, int dimension) {
  TRY(mpm_facets_turn(facets, count, dimension));
  const int corners = dimension * count;
  Corner *corner = NULL;
  Edge *edge = NULL;
  int *identity = NULL, *scratch = NULL;
  BaseStatus status = BASE_ALLOC((size_t)corners, &corner);
  if (status == BASE_OK) status = BASE_ALLOC((size_t)corners, &edge);
  if (status == BASE_OK) status = BASE_ALLOC((size_t)corners, &identity);
  if (status == BASE_OK) status = BASE_ALLOC((size_t)corners, &scratch);
  if (status == BASE_OK) {
    identify(facets, dimension, corners, corner, identity);
    for (int f = 0; f < count; f++) facets[f].free_nodes = facets[f].free_edges = 0;
    if (dimension == 2) mark_ends(facets, corners, identity, scratch);
    else mark_edges(facets, corners, identity, scratch, edge);
  }
  base_free(corner);
  base_free(edge);
  base_free(identity);
  base_free(scratch);
  return status;
}

/* -------------------------------------------------------------------------------------------------- nearest points */

/* Nearest point of the edge from node n to the next; returns the part of the way, outside of [0, 1] beyond the ends. */
static double along_edge(const MpmFacet *facet, int n, int next, const double x[3], double *length) {
  double edge[3], offset[3];
  subtract(facet->node[next], facet->node[n], edge);
  subtract(x, facet->node[n], offset);
  const double square = dot(edge, edge);
  *length = sqrt(square);
  return dot(edge, offset) / square;
}

static void set_nearest(const MpmFacet *facet, int dimension, const double x[3], const double weight[3],
                        MpmFacetNearest *nearest) {
  double square = 0.0;
  for (int i = 0; i < 3; i++) {
    nearest->point[i] = nearest->velocity[i] = 0.0;
    for (int n = 0; n < dimension; n++) {
      nearest->point[i] += weight[n] * facet->node[n][i];
      nearest->velocity[i] += weight[n] * facet->velocity[n][i];
    }
    square += (x[i] - nearest->point[i]) * (x[i] - nearest->point[i]);
  }
  nearest->distance = sqrt(square);
}

static void nearest_of_edge(const MpmFacet *facet, int dimension, int n, const double x[3], double tolerance,
                            MpmFacetNearest *nearest) {
  const int next = (n + 1) % dimension;
  double length, weight[3] = {0.0, 0.0, 0.0};
  const double raw = along_edge(facet, n, next, x, &length), part = fmin(1.0, fmax(0.0, raw));
  weight[n] = 1.0 - part, weight[next] = part;
  set_nearest(facet, dimension, x, weight, nearest);
  const int is_end = raw < 0.0 || raw > 1.0;
  nearest->is_inside = dimension == 2 && raw * length >= -tolerance && (raw - 1.0) * length <= tolerance;
  nearest->is_rim = !nearest->is_inside &&
                    (is_end ? facet->free_nodes >> (raw > 1.0 ? next : n) & 1 : facet->free_edges >> n & 1);
}

/* In-plane distances from the three edges, > 0 inside; over the heights of the triangle they are its weights. */
static void nearest_of_triangle(const MpmFacet *facet, const double x[3], double tolerance, MpmFacetNearest *nearest) {
  double weight[3], least = INFINITY;
  for (int n = 0; n < 3; n++) {
    double edge[3], offset[3], other[3], inward[3];
    subtract(facet->node[(n + 1) % 3], facet->node[n], edge);
    subtract(x, facet->node[n], offset);
    subtract(facet->node[(n + 2) % 3], facet->node[n], other);
    cross(facet->normal, edge, inward);
    weight[(n + 2) % 3] = dot(inward, offset) / dot(inward, other);
    least = fmin(least, dot(inward, offset) / sqrt(dot(edge, edge)));
  }
  if (least >= 0.0) {
    set_nearest(facet, 3, x, weight, nearest);
    nearest->is_inside = 1, nearest->is_rim = 0;
    return;
  }
  MpmFacetNearest trial;
  nearest->distance = INFINITY;
  for (int n = 0; n < 3; n++) {
    nearest_of_edge(facet, 3, n, x, tolerance, &trial);
    if (trial.distance < nearest->distance) *nearest = trial;
  }
  nearest->is_inside = least >= -tolerance;
  if (nearest->is_inside) nearest->is_rim = 0;
}

void mpm_facet_nearest(const MpmFacet *facet, int dimension, const double x[3], double tolerance,
                       MpmFacetNearest *nearest) {
  double offset[3];
  subtract(x, facet->node[0], offset);
  if (dimension == 3) nearest_of_triangle(facet, x, tolerance, nearest);
  else nearest_of_edge(facet, 2, 0, x, tolerance, nearest);
  nearest->height = dot(offset, facet->normal);
}
