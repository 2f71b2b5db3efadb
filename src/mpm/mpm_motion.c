/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Motion of attached points from and to the caller's own arrays: all that others see of points between steps. */
#include <math.h>
#include <string.h>

#include "mpm_core.h"

enum { CHUNK = 1024 /* rows */ };

/* 0 if the three (2D: two) numbers of both have the same bits. */
MPM_INLINE uint64_t difference(const MpmVec *row, const double x[3], int dimension) {
  uint64_t a[4], b[3], result = 0;
  memcpy(a, row, sizeof a);
  memcpy(b, x, sizeof b);
  for (int i = 0; i < dimension; i++) result |= a[1 + i] ^ b[i];
  return result;
}

/* Bits of what take_rows() found. */
enum { MOVED = 1, FORCED = 2, NOT_FINITE = 4 };

MPM_INLINE int take_body(Mpm *mpm, const MpmMotion *motion, int first, int end, int dimension) {
  MpmPoints *p = &mpm->points;
  int found = 0;
  for (int k = first; k < end; k++) {
    const int i = motion->index[p->slot[k]];
    const double *position = motion->position[i], *velocity = motion->velocity[i], *force = motion->force[i];
    if (difference(&p->position[k], position, dimension) | difference(&p->motion[k], velocity, dimension)) {
      p->position[k] = mpm_vector_of(dimension, p->position[k][0], position);
      p->motion[k] = mpm_vector_of(dimension, 1.0, velocity);
      found |= MOVED;
    }
    if (!difference(&p->force[k], force, dimension)) continue;
    p->force[k] = mpm_vector_of(dimension, 0.0, force);
    found |= mpm_mask_all(p->force[k] - p->force[k] == 0.0) ? FORCED : FORCED | NOT_FINITE;
  }
  return found;
}

MPM_CLONES static int take_rows(Mpm *mpm, const MpmMotion *motion, int first, int end) {
  return mpm->scene.dimension == 2 ? take_body(mpm, motion, first, end, 2) : take_body(mpm, motion, first, end, 3);
}

void mpm_take_motion(Mpm *mpm, const MpmMotion *motion) {
  MpmPoints *p = &mpm->points;
  int found = 0;
#pragma omp parallel for num_threads(mpm->threads) if (p->own > MPM_PARALLEL_POINTS) reduction(| : found)
  for (int first = 0; first < p->own; first += CHUNK)
    found |= take_rows(mpm, motion, first, first + CHUNK < p->own ? first + CHUNK : p->own);
  if (found & FORCED) p->uniform_known = 0;
  if (found & (MOVED | NOT_FINITE)) mpm_points_forget_movers(mpm); /* who looks for them names what is not finite, too */
  if (found & MOVED) p->fastest = INFINITY;
}

typedef struct Extent {
  MpmVec low, high; /* lanes 1 to 3, m */
  double square;    /* (m/s)^2, largest */
} Extent;

MPM_INLINE void widen(Extent *extent, MpmVec low, MpmVec high, double square) {
  extent->low = mpm_vec_select(low < extent->low, low, extent->low);
  extent->high = mpm_vec_select(high > extent->high, high, extent->high);
  if (square > extent->square) extent->square = square;
}

MPM_INLINE void give_body(const Mpm *mpm, const MpmMotion *motion, int first, int end, int dimension, Extent *result) {
  const MpmPoints *p = &mpm->points;
  Extent extent = *result;
  for (int k = first; k < end; k++) {
    const int s = p->slot[k], i = motion->index[s];
    const MpmVec position = p->position[k], velocity = p->motion[k], force = p->force[k], square = velocity * velocity;
    double work = motion->work[s];
    for (int a = 0; a < dimension; a++) {
      work += force[1 + a] * (position[1 + a] - motion->position[i][a]);
      motion->position[i][a] = position[1 + a];
      motion->velocity[i][a] = velocity[1 + a];
    }
    motion->work[s] = work;
    widen(&extent, position, position, square[1] + square[2] + square[3]);
  }
  *result = extent;
}

MPM_CLONES static void give_rows(const Mpm *mpm, const MpmMotion *motion, int first, int end, Extent *extent) {
  if (mpm->scene.dimension == 2) give_body(mpm, motion, first, end, 2, extent);
  else give_body(mpm, motion, first, end, 3, extent);
}

void mpm_give_motion(Mpm *mpm, const MpmMotion *motion, double low[3], double high[3]) {
  MpmPoints *p = &mpm->points;
  Extent all = {mpm_vec_all(INFINITY), mpm_vec_all(-INFINITY), 0.0};
#pragma omp parallel for num_threads(mpm->threads) if (p->own > MPM_PARALLEL_POINTS)
  for (int first = 0; first < p->own; first += CHUNK) {
    const int end = first + CHUNK < p->own ? first + CHUNK : p->own;
    Extent part = {mpm_vec_all(INFINITY), mpm_vec_all(-INFINITY), 0.0};
    give_rows(mpm, motion, first, end, &part);
#pragma omp critical(mpm_give_motion)
    widen(&all, part.low, part.high, part.square);
  }
  for (int i = 0; i < 3; i++) low[i] = all.low[1 + i], high[i] = all.high[1 + i];
  p->fastest = sqrt(all.square);
}
