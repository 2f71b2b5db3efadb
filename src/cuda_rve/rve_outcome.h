/* SPDX-License-Identifier: GPL-2.0-or-later */
#ifndef DEMPM_RVE_OUTCOME_H
#define DEMPM_RVE_OUTCOME_H

typedef enum RveOutcome {
  RVE_DONE,
  RVE_TOO_SMALL, /* the arena must grow (RveHead.need_*); call again, the call goes on where it stopped */
  RVE_UNSTABLE   /* the watchdog spoke; RveHead.failed is set */
} RveOutcome;

#endif
