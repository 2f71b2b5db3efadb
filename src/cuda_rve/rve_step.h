/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The steps of one call, and what surrounds them: cell, temperature, neighbour list, watchdog. */
#ifndef DEMPM_RVE_STEP_H
#define DEMPM_RVE_STEP_H

#include "rve_flight.h"
#include "rve_outcome.h"

RVE_FN double rve_radius_factor(const RveCall *call, double temperature) {
  return call->thermal ? 1.0 + call->expansion * (temperature - call->reference_temperature) : 1.0;
}

/* Deforms the cell and bounds how far grains can have moved since the list was built. */
RVE_FN void rve_advance_cell(const RveCall *call, RveHead *head, double temperature, double fastest) {
  if (call->moving) {
    double h[9];
    for (int i = 0; i < 3; i++)
      for (int j = 0; j < 3; j++)
        h[3 * i + j] = head->cell[3 * i + j] +
                       (call->step_map[3 * i] * head->cell[j] + call->step_map[3 * i + 1] * head->cell[3 + j] +
                        call->step_map[3 * i + 2] * head->cell[6 + j]);
    for (int k = 0; k < 9; k++) head->cell[k] = h[k];
    rve_invert(h, head->inverse);
    head->stretch /= call->shorten;
  }
  const double scale = rve_radius_factor(call, temperature), grown = scale > head->scale ? scale - head->scale : 0.0;
  head->reach = head->reach * call->shorten + sqrt(fastest) * call->dt;
  /* Gaps that count are narrower than a large grain's radius: no branch is longer than three. */
  head->approach += (2.0 * call->shorten * sqrt(fastest) * call->dt +
                     head->radius_max * (3.0 * scale * (call->shorten - 1.0) + 2.0 * grown)) *
                    (1.0 + 1e-9);
  head->temperature = temperature;
  head->scale = scale;
  head->steps++;
  head->done++;
  head->list_due = rve_list_is_spent(head) ? RVE_LIST_CHECK : RVE_LIST_GOOD;
  /* A grain that crosses half a small grain in one step is out of control, whatever the scene. NaN fails the test too.
   */
  if (!(sqrt(fastest) * call->dt <= 0.5 * head->radius_min * head->scale)) head->failed = BASE_ERROR_UNSTABLE;
}

/* Rows of all grains, after the list has moved them or at the start. */
RVE_FN void rve_refresh_rows(RveFeatures ft, const RveTeam *team, const RveCounts *n, const RveArrays *a) {
  const int spans = n->row ? n->blocks * RVE_PARTS : 0;
  for (int span = team->pack; span < spans; span += team->packs) {
    RveBody b = rve_own_body(ft, a, span * RVE_SPAN);
    if (!ft.tangential)
      for (int k = 0; k < rve_spins(ft); k++) b.w[k] = rve_load(a->spin[k], span * RVE_SPAN);
    if (!ft.viscous) b.m = rve_set(0.0);
    rve_write_rows(ft.dimension, a, span * RVE_SPAN, &b);
  }
}

/* Looks whether the list is really spent (the running bound is a sum of maxima); if so, builds the next. */
RVE_FN RveOutcome rve_renew_list(RveFeatures ft, const RveTeam *team, const RveCall *call, RveHead *head,
                                 const RveCounts *n, const RveArrays *a, RveScratch *s) {
  const int check = head->list_due == RVE_LIST_CHECK && head->need_pairs == 0;
  rve_sync(); /* all have read the head before the leader changes it */
  if (check) {
    const double farthest = rve_farthest(ft.dimension, team, head, n, a);
    if (team->leader) {
      head->stretch = rve_least_stretch(head);
      head->reach = farthest * (1.0 + 1e-9);
      if (2.0 * head->reach <= 0.85 * rve_room(head)) head->list_due = RVE_LIST_GOOD;
    }
    rve_sync();
    const int good = head->list_due == RVE_LIST_GOOD;
    rve_sync();
    if (good) return RVE_DONE;
  }
  if (team->leader) {
    const int built = rve_build_list(call, head, n, a, s);
    if (built == RVE_LIST_FAILED) head->failed = BASE_ERROR_UNSTABLE;
  }
  rve_sync();
  if (head->failed) return RVE_UNSTABLE;
  if (head->list_due) return RVE_TOO_SMALL;
  rve_refresh_rows(ft, team, n, a);
  rve_sync();
  return RVE_DONE;
}

/* Runs call->steps steps, or goes on with them. call->steps = 0: forces of the present state (after a change from
 * outside). */
RVE_FN RveOutcome rve_run(RveFeatures ft, const RveTeam *team, const RveCall *call, RveHead *head, const RveCounts *n,
                          const RveArrays *a, RveScratch *s) {
  const double from = head->temperature, steps = (double)(call->steps - head->done);
  const int64_t done0 = head->done;
  rve_real slip = rve_set(0.0), dash = rve_set(0.0), damping = rve_set(0.0);
  RveOutcome outcome = RVE_DONE;
  int resumed = head->list_due || call->steps == 0;
  rve_spread_ahead(s, (call->steps - done0) * n->blocks);
  rve_sync();
  const int flew = rve_fly(ft, team, call, head, rve_radius_factor(call, call->temperature), n, a);
  rve_sync();
  if (team->leader) head->flew = flew;
  if (flew || (resumed && call->steps == 0)) rve_refresh_rows(ft, team, n, a);
  rve_sync();
  if (flew) return RVE_DONE;
  for (int64_t step = done0; step < call->steps || resumed; step++) {
    double dt = call->dt;
    if (!resumed) {
      const double part = (double)(step + 1 - done0) / steps;
      const double temperature = call->thermal ? from + (call->temperature - from) * part : from;
      rve_real fastest = rve_set(0.0);
      rve_move_pass(ft, team, call, head, rve_radius_factor(call, temperature), n, a, &fastest, &damping);
      const double v2 = rve_team_max(team, fastest);
      if (team->leader) rve_advance_cell(call, head, temperature, v2);
    } else {
      if (call->steps == 0) dt = 0.0;
      step--; /* this round only makes up for the contact pass that was put off */
      resumed = 0;
    }
    rve_sync();
    if (head->failed) outcome = RVE_UNSTABLE;
    else if (head->list_due) outcome = rve_renew_list(ft, team, call, head, n, a, s);
    if (outcome != RVE_DONE) break;
    rve_contact_pass(ft, team, call, head, dt, n, a, s, &slip, &dash);
    if (RVE_CARRIES) head->carried = 1;
    rve_sync();
  }
  const double kt = call->tangential_stiffness;
  const double slid = rve_team_sum(team, slip), dashed = rve_team_sum(team, dash), damped = rve_team_sum(team, damping);
  if (team->leader) {
    for (int k = 0; k < 9; k++) head->rate[k] = call->rate[k];
    head->friction_work += kt > 0.0 ? slid / kt : 0.0;
    head->damping_work += (dashed + 0.5 * damped) * call->dt;
    if (outcome == RVE_DONE) head->done = 0;
  }
  rve_sync();
  return outcome;
}

#endif
