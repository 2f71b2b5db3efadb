/* SPDX-License-Identifier: GPL-2.0-or-later */
/* XPIC(m): the points get (I - (I - S S+)^m) v_p + dt S a instead of FLIP's v_p + dt S a, S the G2P and S+ the P2G
 * operator (Hammerquist and Nairn 2017). m = 1 is PIC. On the grid: v* = sum_r (-1)^(r+1) C(m, r) (S+ S)^(r-1) v, term
 * by term. */
#include "mpm_core.h"

/* Velocities of all points from a nodal field; foreign ones from their owners. Collective. */
static BaseStatus spread(Mpm *mpm, const MpmVec *field) {
  MpmPoints *p = &mpm->points;
  mpm_g2p_velocity(mpm, field);
  return mpm->halo ? mpm_forward_rows(mpm, p->gathered, NULL) : BASE_OK;
}

BaseStatus mpm_extended_velocity(Mpm *mpm) {
  MpmGrid *grid = &mpm->grid;
  const int m = mpm->scene.xpic_order;
  for (int n = 0; n < grid->nodes; n++) grid->extended[n] = m * grid->state[n];
  for (int r = 2; r <= m; r++) {
    TRY(spread(mpm, r == 2 ? grid->state : grid->term));
    mpm_p2g_momentum(mpm, mpm->points.gathered, 0, 0);
    /* term r = -(m - r + 1) / r (S+ S) term r-1; term 1 = m v. */
    const double factor = -(double)(m - r + 1) / r * (r == 2 ? m : 1);
    for (int n = 0; n < grid->nodes; n++) {
      const double mass = grid->sum[n][0];
      grid->term[n] = mass > 0.0 ? factor / mass * grid->sum[n] : (MpmVec){0.0, 0.0, 0.0, 0.0};
      grid->extended[n] += grid->term[n];
    }
  }
  return BASE_OK;
}
