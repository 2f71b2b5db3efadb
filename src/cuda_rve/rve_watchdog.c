/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Why an RVE failed. The kernels only notice that it did (a grain that crosses half a small grain in one step, a cell too
 * narrow for a list, an answer that is not finite); the cause is read from the state they left. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "rve_batch_private.h"
#include "rve_contacts.h"
#include "rve_packing_pairs.h"

BaseStatus rve_keep_before(const RveRecord *record, RveWorkspace *workspace) {
  RveRecord *before = &workspace->before;
  if (record->bytes > workspace->room) {
    base_free(before->arena);
    before->arena = NULL, workspace->room = 0;
    TRY(base_alloc(record->bytes, 1, &before->arena));
    workspace->room = record->bytes;
  }
  before->counts = record->counts;
  before->bytes = record->bytes;
  before->last = record->last;
  before->conduction = record->conduction;
  memcpy(before->arena, record->arena, record->bytes);
  return BASE_OK;
}

/* A copy of 160 kB (400 disks) takes 3 to 6 us, as long as one DEM step: nothing beside a hundred of them, 6 to 10 % of
 * ten. So short calls are kept only if something may come of them: a time step near the critical one, at which motion grows
 * by itself; strain or heat of more than 1e-3; or so much motion that one mean grain with all kinetic energy would move more
 * than 1e-2 of the smallest radius per DEM step (a fiftieth of what fails). */
int rve_may_fail(const RveBatch *batch, const RveRecord *record, const RveCall *call) {
  enum { LONG_CALL = 100 };
  static const double stable = 0.9, small = 1e-3, slow = 1e-2;
  const RveHead *head = rve_head(record->arena);
  const RveAnswer *last = &record->last;
  const double mass = batch->scene.density * last->solid_fraction * last->volume / record->counts.grains;
  const double heated = call->expansion * fabs(call->temperature - head->temperature);
  const double moved = sqrt(2.0 * last->kinetic_energy / mass) * call->dt;
  if (call->steps >= LONG_CALL || !(call->dt <= stable * head->critical_time_step)) return 1;
  return !((double)call->steps * log(call->shorten) <= small && heated <= small && moved <= slow * head->radius_min);
}

/* ---------------------------------------------------------------------------------------------------------- causes */

typedef struct Fastest {
  int grain;    /* index in the packing of the fastest one; of the first whose motion is not finite */
  double speed; /* m/s; NAN if a motion is not finite */
} Fastest;

static Fastest find_fastest(const RveRecord *record) {
  const RveArrays *a = &record->arrays;
  const int dim = record->counts.dimension;
  Fastest fastest = {-1, -1.0};
  for (int q = 0; q < record->counts.blocks * record->counts.lanes; q++) {
    double square = 0.0, spin = 0.0;
    if (a->id[q] < 0) continue;
    for (int k = 0; k < dim; k++) square += a->velocity[k][q] * a->velocity[k][q];
    for (int k = 0; k < (dim == 2 ? 1 : 3); k++) spin += a->spin[k][q];
    if (!isfinite(square) || !isfinite(spin)) {
      if (!isnan(fastest.speed) || a->id[q] < fastest.grain) fastest = (Fastest){a->id[q], NAN};
    } else if (!isnan(fastest.speed) && square > fastest.speed * fastest.speed) fastest = (Fastest){a->id[q], sqrt(square)};
    else if (fastest.grain < 0) fastest = (Fastest){a->id[q], sqrt(square)};
  }
  return fastest;
}

static double kinetic_energy(const RveRecord *record) {
  const RveArrays *a = &record->arrays;
  double sum = 0.0;
  for (int q = 0; q < record->counts.blocks * record->counts.lanes; q++)
    for (int k = 0; k < record->counts.dimension && a->id[q] >= 0; k++)
      sum += 0.5 * a->mass[q] * a->velocity[k][q] * a->velocity[k][q];
  return sum;
}

/* Appends the deepest overlap and the energies: they tell a collapse from a time step that is too long. */
static void describe_state(const RveRecord *record, size_t room, char *text) {
  double deepest = 0.0;
  int pair[2] = {-1, -1};
  RveSlot slot;
  for (rve_slot_start(record, &slot); rve_slot_next(&slot);) {
    const double smaller = fmin(record->arrays.radius[slot.i], record->arrays.radius[slot.j]);
    if (!(slot.overlap > deepest * smaller)) continue;
    deepest = slot.overlap / smaller;
    pair[0] = record->arrays.id[slot.i], pair[1] = record->arrays.id[slot.j];
  }
  size_t used = strlen(text);
  if (pair[0] >= 0)
    snprintf(text + used, room - used, "; deepest overlap %.3g of the smaller radius (grains %d and %d)", deepest,
             pair[0] + 1, pair[1] + 1);
  used = strlen(text);
  snprintf(text + used, room - used, "; kinetic energy %.3g J, %.3g J before the call", kinetic_energy(record),
           record->last.kinetic_energy);
}

static void describe_cell(const RveRecord *record, size_t room, char *text) {
  const RveHead *head = rve_head((void *)record->arena);
  double height[3], lowest;
  packing_heights(head->cell, height);
  lowest = fmin(height[0], height[1]);
  if (record->counts.dimension == 3) lowest = fmin(lowest, height[2]);
  snprintf(text, room, "the cell is too narrow for its grains: %.3g m high, the widest grain %.3g m", lowest,
           2.0 * head->radius_max * head->scale);
}

static void describe(const RveRecord *record, const RveCall *call, size_t room, char *text) {
  const RveHead *head = rve_head((void *)record->arena);
  const Fastest fastest = find_fastest(record);
  const double smallest = head->radius_min * head->scale;
  if (isnan(fastest.speed)) {
    snprintf(text, room, "the velocity or spin of grain %d is not finite", fastest.grain + 1);
    return;
  }
  if (!(smallest > 0.0))
    snprintf(text, room, "at temperature %g the smallest grain has the radius %g m", head->temperature, smallest);
  else if (!(fastest.speed * call->dt <= 0.5 * smallest))
    snprintf(text, room,
             "grain %d moves %.3g m in one DEM step of %.3g s; at most half the smallest radius, %.3g m, is allowed",
             fastest.grain + 1, fastest.speed * call->dt, call->dt, 0.5 * smallest);
  else if (head->list_due == RVE_LIST_GOOD) { /* the steps went well, the answer did not */
    snprintf(text, room, "the stress, an energy or another answer is not finite, or the network of conductances has no solution");
    return;
  } else describe_cell(record, room, text);
  describe_state(record, room, text);
}

/* -------------------------------------------------------------------------------------------------------- failures */

void rve_forget_failure(RveBatch *batch, int rve) {
  if (!batch->failed[rve]) return;
  base_free(batch->failed[rve]->state);
  base_free(batch->failed[rve]);
  batch->failed[rve] = NULL;
}

BaseStatus rve_note_failure(RveBatch *batch, int rve, const RveCall *call, const RveInput *input, double duration,
                            const RveWorkspace *workspace) {
  const RveRecord *record = &batch->record[rve];
  const RveHead *head = rve_head(record->arena);
  RveFailed *failed;
  if (batch->failed[rve]) return BASE_OK;
  TRY(BASE_ALLOC(1, &failed));
  batch->failed[rve] = failed;
  failed->scene = batch->scene;
  failed->input = *input;
  failed->duration = duration;
  RveFailure *failure = &failed->failure;
  failure->step = head->steps;
  failure->call_steps = call->steps;
  failure->call_step = head->done > 0 ? head->done : call->steps; /* done is 0 again after the last step */
  describe(record, call, sizeof failure->cause, failure->cause);
  if (!workspace || !workspace->kept) return BASE_OK;
  TRY(base_alloc(rve_record_state_bytes(&workspace->before), 1, &failed->state));
  return rve_record_pack(&workspace->before, rve_scene_hash(&batch->scene), failed->state, &failed->bytes);
}

BaseStatus rve_batch_failure(const RveBatch *batch, int rve, RveFailure *failure) {
  memset(failure, 0, sizeof *failure);
  if (rve < 0 || rve >= batch->count)
    return base_error(BASE_ERROR_ARGUMENT, "RVE %d (allowed: 0 to %d)", rve, batch->count - 1);
  if (batch->failed[rve]) *failure = batch->failed[rve]->failure;
  else if (rve_head(batch->record[rve].arena)->failed) {
    failure->step = rve_head(batch->record[rve].arena)->steps;
    snprintf(failure->cause, sizeof failure->cause, "it had failed before its state was stored");
  } else return base_error(BASE_ERROR_ARGUMENT, "RVE %d has not failed", rve);
  return BASE_OK;
}

BaseStatus rve_failure_error(const RveBatch *batch, int rve) {
  RveFailure failure;
  TRY(rve_batch_failure(batch, rve, &failure));
  return base_error(BASE_ERROR_UNSTABLE, "RVE %d is unstable at DEM step %lld (%lld of %lld of its call): %s", rve,
                    (long long)failure.step, (long long)failure.call_step, (long long)failure.call_steps,
                    failure.cause);
}

void rve_batch_keep_states(RveBatch *batch, int keep) { batch->keep = keep && !batch->device; }
