/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Motion of attached points from and to the caller's own arrays: all that others see of points between steps. */
#include <math.h>

#include "mpm_core.h"

enum { CHUNK = 1024 /* rows */ };

static int differs(MpmVec a, MpmVec b) { return !mpm_mask_all((MpmMask)a == (MpmMask)b); }

/* Bits of what take_rows() found. */
enum { MOVED = 1, FORCED = 2, NOT_FINITE = 4 };

static int take_rows(Mpm *mpm, const MpmMotion *motion, int first, int end, int dimension) {
  MpmPoints *p = &mpm->points;
  int found = 0;
  for (int k = first; k < end; k++) {
    const int i = motion->index[p->slot[k]];
    const MpmVec position = mpm_vector_of(dimension, p->position[k][0], motion->position[i]);
    const MpmVec velocity = mpm_vector_of(dimension, 1.0, motion->velocity[i]);
    const MpmVec force = mpm_vector_of(dimension, 0.0, motion->force[i]);
    if (differs(position, p->position[k]) || differs(velocity, p->motion[k])) {
      p->position[k] = position, p->motion[k] = velocity;
      found |= MOVED;
    }
    if (!differs(force, p->force[k])) continue;
    p->force[k] = force;
    found |= mpm_mask_all(force - force == 0.0) ? FORCED : FORCED | NOT_FINITE;
  }
  return found;
}

void mpm_take_motion(Mpm *mpm, const MpmMotion *motion) {
  MpmPoints *p = &mpm->points;
  int found = 0;
#pragma omp parallel for num_threads(mpm->threads) if (p->own > MPM_PARALLEL_POINTS) reduction(| : found)
  for (int first = 0; first < p->own; first += CHUNK)
    found |= take_rows(mpm, motion, first, first + CHUNK < p->own ? first + CHUNK : p->own, mpm->scene.dimension);
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

static Extent give_rows(const Mpm *mpm, const MpmMotion *motion, int first, int end, int dimension) {
  const MpmPoints *p = &mpm->points;
  Extent extent = {mpm_vec_all(INFINITY), mpm_vec_all(-INFINITY), 0.0};
  for (int k = first; k < end; k++) {
    const int s = p->slot[k], i = motion->index[s];
    const MpmVec position = p->position[k], velocity = p->motion[k], square = velocity * velocity;
    double work = motion->work[s];
    for (int a = 0; a < dimension; a++) {
      work += p->force[k][1 + a] * (position[1 + a] - motion->position[i][a]);
      motion->position[i][a] = position[1 + a];
      motion->velocity[i][a] = velocity[1 + a];
    }
    motion->work[s] = work;
    widen(&extent, position, position, square[1] + square[2] + square[3]);
  }
  return extent;
}

void mpm_give_motion(Mpm *mpm, const MpmMotion *motion, double low[3], double high[3]) {
  MpmPoints *p = &mpm->points;
  Extent all = {mpm_vec_all(INFINITY), mpm_vec_all(-INFINITY), 0.0};
#pragma omp parallel for num_threads(mpm->threads) if (p->own > MPM_PARALLEL_POINTS)
  for (int first = 0; first < p->own; first += CHUNK) {
    const int end = first + CHUNK < p->own ? first + CHUNK : p->own;
    const Extent part = give_rows(mpm, motion, first, end, mpm->scene.dimension);
#pragma omp critical(mpm_give_motion)
    widen(&all, part.low, part.high, part.square);
  }
  for (int i = 0; i < 3; i++) low[i] = all.low[1 + i], high[i] = all.high[1 + i];
  p->fastest = sqrt(all.square);
}
