/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "rve_store.h"

#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

/* The engine's batches have a fixed size. RVEs that come later get a batch of their own; when there are too many
 * batches, all living RVEs are moved into one. */
enum { MOST_BATCHES = 8 };

typedef struct Slot {
  int batch; /* -1: unused, `rve` is then the next unused slot or -1 */
  int rve;
  RveStoreItem item;
} Slot;

struct RveStore {
  RveScene scene;
  RveBackend backend;
  int keep_states;
  int packing_count;
  RvePacking *packing;
  RveBatch *batch[MOST_BATCHES];
  int batches;
  int slots, unused; /* length of slot[]; first unused slot or -1 */
  Slot *slot;
  int64_t particle_steps, calls;
  double seconds;
  /* One step, sorted by batch. */
  int room;
  int *index;    /* [room] RVE in its batch */
  int *asked;    /* [room] handle */
  RveInput *input;
  RveAnswer *answer;
};

/* -- packings -------------------------------------------------------------------------------------------------- */

static BaseStatus copy_array(const void *from, size_t bytes, void **to) {
  *to = NULL;
  if (!from || bytes == 0) return BASE_OK;
  TRY(base_alloc(bytes, 1, to));
  memcpy(*to, from, bytes);
  return BASE_OK;
}

static BaseStatus copy_packing(const RvePacking *from, RvePacking *to) {
  const size_t grains = (size_t)from->grains, contacts = from->contacts > 0 ? (size_t)from->contacts : 0;
  *to = *from;
  to->position = to->radius = to->velocity = to->spin = to->contact_shear = NULL;
  to->contact_pair = to->contact_image = NULL;
  TRY(copy_array(from->position, 3 * grains * sizeof(double), (void **)&to->position));
  TRY(copy_array(from->radius, grains * sizeof(double), (void **)&to->radius));
  TRY(copy_array(from->velocity, 3 * grains * sizeof(double), (void **)&to->velocity));
  TRY(copy_array(from->spin, 3 * grains * sizeof(double), (void **)&to->spin));
  TRY(copy_array(from->contact_pair, 2 * contacts * sizeof(int), (void **)&to->contact_pair));
  TRY(copy_array(from->contact_image, 3 * contacts * sizeof(int), (void **)&to->contact_image));
  return copy_array(from->contact_shear, 3 * contacts * sizeof(double), (void **)&to->contact_shear);
}

static BaseStatus copy_packings(RveStore *store, const RvePacking *packings, int count) {
  if (count < 1) return base_error(BASE_ERROR_ARGUMENT, "%d packings given, at least 1 is needed", count);
  TRY(BASE_ALLOC((size_t)count, &store->packing));
  store->packing_count = count;
  for (int k = 0; k < count; k++) {
    BaseStatus status = rve_packing_check(&packings[k]);
    if (status != BASE_OK) return base_error_context(status, "packing %d: ", k + 1);
    TRY(copy_packing(&packings[k], &store->packing[k]));
  }
  return BASE_OK;
}

BaseStatus rve_store_create(const RveScene *scene, const RvePacking *packings, int packing_count, RveBackend backend,
                            RveStore **result) {
  RveStore *store = NULL;
  BaseStatus status;
  *result = NULL;
  TRY(rve_scene_check(scene));
  TRY(BASE_ALLOC(1, &store));
  store->scene = *scene;
  store->backend = backend;
  store->unused = -1;
  TRY_GOTO(copy_packings(store, packings, packing_count), status, fail);
  *result = store;
  return BASE_OK;

fail:
  rve_store_destroy(store);
  return status;
}

void rve_store_destroy(RveStore *store) {
  if (!store) return;
  for (int b = 0; b < store->batches; b++) rve_batch_destroy(store->batch[b]);
  for (int k = 0; k < store->packing_count; k++) rve_packing_destroy(&store->packing[k]);
  base_free(store->packing);
  base_free(store->slot);
  base_free(store->index);
  base_free(store->asked);
  base_free(store->input);
  base_free(store->answer);
  base_free(store);
}

/* -- RVEs come and go ------------------------------------------------------------------------------------------ */

static BaseStatus reserve_slots(RveStore *store, int n) {
  int free_slots = 0;
  for (int s = store->unused; s >= 0; s = store->slot[s].rve) free_slots++;
  if (free_slots >= n) return BASE_OK;
  const int64_t larger = (int64_t)store->slots + (n - free_slots);
  if (larger > INT32_MAX) return base_error(BASE_ERROR_MEMORY, "more than %d RVEs on a rank", INT32_MAX);
  TRY(BASE_GROW((size_t)store->slots, (size_t)larger, &store->slot));
  /* Backwards, so that handles are handed out in ascending order. */
  for (int s = (int)larger - 1; s >= store->slots; s--) {
    store->slot[s].batch = -1;
    store->slot[s].rve = store->unused;
    store->unused = s;
  }
  store->slots = (int)larger;
  return BASE_OK;
}

/* Moves one RVE's state; memory grows as needed. */
static BaseStatus move_state(const RveBatch *from, int rve, RveBatch *to, int target, size_t *room, void **bytes) {
  const size_t needed = rve_batch_state_bytes(from, rve);
  size_t written;
  if (needed > *room) {
    TRY(base_grow(0, needed, 1, bytes));
    *room = needed;
  }
  TRY(rve_batch_pack(from, rve, *bytes, &written));
  return rve_batch_unpack(to, target, *bytes, written);
}

static BaseStatus move_all(const RveStore *store, RveBatch *merged) {
  void *bytes = NULL;
  size_t room = 0;
  int target = 0;
  BaseStatus status = BASE_OK;
  for (int s = 0; s < store->slots && status == BASE_OK; s++) {
    const Slot *slot = &store->slot[s];
    if (slot->batch >= 0) status = move_state(store->batch[slot->batch], slot->rve, merged, target++, &room, &bytes);
  }
  base_free(bytes);
  return status;
}

/* All living RVEs into one batch. Unchanged after an error. */
static BaseStatus merge_batches(RveStore *store) {
  int *packing, living = 0;
  RveBatch *merged = NULL;
  TRY(BASE_ALLOC((size_t)store->slots, &packing));
  for (int s = 0; s < store->slots; s++)
    if (store->slot[s].batch >= 0) packing[living++] = store->slot[s].item.packing;
  BaseStatus status = BASE_OK;
  if (living > 0)
    status = rve_batch_create(&store->scene, store->packing, store->packing_count, packing, living, store->backend,
                              &merged);
  base_free(packing);
  if (status == BASE_OK && living > 0) status = move_all(store, merged);
  if (status != BASE_OK) {
    rve_batch_destroy(merged);
    return status;
  }
  for (int b = 0; b < store->batches; b++) rve_batch_destroy(store->batch[b]);
  store->batches = living > 0;
  store->batch[0] = merged;
  if (merged) rve_batch_keep_states(merged, store->keep_states);
  for (int s = 0, target = 0; s < store->slots; s++)
    if (store->slot[s].batch >= 0) store->slot[s].batch = 0, store->slot[s].rve = target++;
  return BASE_OK;
}

BaseStatus rve_store_add(RveStore *store, int n, const int64_t *tag, const int *packing, int *handle) {
  if (n < 1) return BASE_OK;
  RveBatch *batch = NULL;
  if (store->batches == MOST_BATCHES) TRY(merge_batches(store));
  TRY(reserve_slots(store, n));
  TRY(rve_store_reserve(store, n));
  TRY(rve_batch_create(&store->scene, store->packing, store->packing_count, packing, n, store->backend, &batch));
  /* The first answers, so that volume and energies are known before the first step. */
  memset(store->input, 0, (size_t)n * sizeof *store->input);
  BaseStatus status = rve_batch_step(batch, n, NULL, store->input, 0.0, store->answer);
  if (status != BASE_OK) {
    rve_batch_destroy(batch);
    return status;
  }
  for (int k = 0; k < n; k++) {
    Slot *slot = &store->slot[store->unused];
    handle[k] = store->unused;
    store->unused = slot->rve;
    slot->batch = store->batches;
    slot->rve = k;
    slot->item = (RveStoreItem){.tag = tag[k], .packing = packing[k], .grains = store->packing[packing[k]].grains,
                                .scale = NAN, .answer = store->answer[k]};
    rve_rest_wake(&slot->item.rest, &store->scene, &slot->item.answer, store->scene.reference_temperature);
  }
  rve_batch_keep_states(batch, store->keep_states);
  store->batch[store->batches++] = batch;
  return BASE_OK;
}

void rve_store_release(RveStore *store, int handle) {
  store->slot[handle].batch = -1;
  store->slot[handle].rve = store->unused;
  store->unused = handle;
}

RveStoreItem *rve_store_item(RveStore *store, int handle) { return &store->slot[handle].item; }

int rve_store_next(const RveStore *store, int handle) {
  for (int s = handle + 1; s < store->slots; s++)
    if (store->slot[s].batch >= 0) return s;
  return -1;
}

const RveScene *rve_store_scene(const RveStore *store) { return &store->scene; }

const RvePacking *rve_store_packings(const RveStore *store, int *count) {
  *count = store->packing_count;
  return store->packing;
}

/* -- steps ----------------------------------------------------------------------------------------------------- */

BaseStatus rve_store_reserve(RveStore *store, int n) {
  if (n <= store->room) return BASE_OK;
  TRY(BASE_GROW(0, (size_t)n, &store->index));
  TRY(BASE_GROW(0, (size_t)n, &store->asked));
  TRY(BASE_GROW(0, (size_t)n, &store->input));
  TRY(BASE_GROW(0, (size_t)n, &store->answer));
  store->room = n;
  return BASE_OK;
}

/* Sorts the RVEs asked for by batch (stable); count[b] of each. */
static void sort_by_batch(RveStore *store, int n, const int *handle, const RveInput *input, int count[MOST_BATCHES]) {
  int start[MOST_BATCHES] = {0};
  memset(count, 0, MOST_BATCHES * sizeof *count);
  for (int k = 0; k < n; k++) count[store->slot[handle[k]].batch]++;
  for (int b = 1; b < MOST_BATCHES; b++) start[b] = start[b - 1] + count[b - 1];
  for (int k = 0; k < n; k++) {
    const Slot *slot = &store->slot[handle[k]];
    const int place = start[slot->batch]++;
    store->index[place] = slot->rve;
    store->asked[place] = handle[k];
    store->input[place] = input[k];
  }
}

static void keep_answer(RveStore *store, RveStoreItem *item, const RveAnswer *answer, double duration) {
  const RveAnswer *before = &item->answer;
  const double work =
      (answer->friction_work - before->friction_work) + (answer->damping_work - before->damping_work);
  if (duration > 0.0) {
    item->dissipation = work / (answer->volume * duration);
    store->particle_steps += (answer->steps - before->steps) * item->grains;
    store->calls++;
  }
  item->answer = *answer;
}

BaseStatus rve_store_step(RveStore *store, int n, const int *handle, const RveInput *input, double duration,
                          int *unstable) {
  int count[MOST_BATCHES];
  BaseStatus result = BASE_OK;
  const double start = base_seconds();
  *unstable = -1;
  TRY(rve_store_reserve(store, n));
  sort_by_batch(store, n, handle, input, count);
  for (int b = 0, first = 0; b < store->batches; first += count[b++]) {
    if (count[b] == 0) continue;
    BaseStatus status = rve_batch_step(store->batch[b], count[b], store->index + first, store->input + first, duration,
                                       store->answer + first);
    if (status != BASE_OK && status != BASE_ERROR_UNSTABLE) return status;
    if (status != BASE_OK) result = status;
  }
  for (int k = 0; k < n; k++) {
    RveStoreItem *item = rve_store_item(store, store->asked[k]);
    keep_answer(store, item, &store->answer[k], duration);
    if (item->answer.status == 0) continue;
    if (*unstable < 0 || item->tag < rve_store_item(store, *unstable)->tag) *unstable = store->asked[k];
  }
  if (duration > 0.0) store->seconds += base_seconds() - start;
  return result;
}

void rve_store_keep_states(RveStore *store) {
  store->keep_states = 1;
  for (int b = 0; b < store->batches; b++) rve_batch_keep_states(store->batch[b], 1);
}

BaseStatus rve_store_failure(const RveStore *store, int handle, RveFailure *failure) {
  return rve_batch_failure(store->batch[store->slot[handle].batch], store->slot[handle].rve, failure);
}

BaseStatus rve_store_write_replay(const RveStore *store, int handle, const char *file) {
  const Slot *slot = &store->slot[handle];
  char name[RVE_NAME_BYTES];
  snprintf(name, sizeof name, "of material point %" PRId64, slot->item.tag);
  return rve_batch_write_replay(store->batch[slot->batch], slot->rve, name, file);
}

BaseStatus rve_store_refresh(RveStore *store) {
  int *handle, n = 0, unstable;
  RveInput *input = NULL;
  TRY(BASE_ALLOC((size_t)store->slots, &handle));
  BaseStatus status = BASE_ALLOC((size_t)store->slots, &input);
  for (int s = 0; s < store->slots && status == BASE_OK; s++)
    if (store->slot[s].batch >= 0) handle[n++] = s;
  if (status == BASE_OK) status = rve_store_step(store, n, handle, input, 0.0, &unstable);
  for (int k = 0; k < n && status == BASE_OK; k++) rve_store_item(store, handle[k])->rest.calm = 0;
  base_free(handle);
  base_free(input);
  return status;
}

BaseStatus rve_store_set_scene(RveStore *store, const RveScene *scene) {
  TRY(rve_scene_check(scene));
  for (int b = 0; b < store->batches; b++) TRY(rve_batch_set_scene(store->batch[b], scene));
  store->scene = *scene;
  return BASE_OK;
}

BaseStatus rve_store_install_bonds(RveStore *store) {
  for (int b = 0; b < store->batches; b++)
    TRY(rve_batch_install_bonds(store->batch[b], rve_batch_count(store->batch[b]), NULL));
  return rve_store_refresh(store);
}

BaseStatus rve_store_rest(RveStore *store) {
  for (int b = 0; b < store->batches; b++)
    TRY(rve_batch_rest(store->batch[b], rve_batch_count(store->batch[b]), NULL));
  return rve_store_refresh(store);
}

/* -- single RVEs ----------------------------------------------------------------------------------------------- */

size_t rve_store_state_bytes(const RveStore *store, int handle) {
  return rve_batch_state_bytes(store->batch[store->slot[handle].batch], store->slot[handle].rve);
}

BaseStatus rve_store_pack(const RveStore *store, int handle, void *bytes, size_t *written) {
  return rve_batch_pack(store->batch[store->slot[handle].batch], store->slot[handle].rve, bytes, written);
}

BaseStatus rve_store_unpack(RveStore *store, int handle, const void *bytes, size_t size) {
  return rve_batch_unpack(store->batch[store->slot[handle].batch], store->slot[handle].rve, bytes, size);
}

BaseStatus rve_store_view(const RveStore *store, int handle, RveView *view) {
  return rve_batch_view(store->batch[store->slot[handle].batch], store->slot[handle].rve, view);
}

void rve_store_totals(const RveStore *store, RveStoreTotals *totals) {
  *totals = (RveStoreTotals){.particle_steps = store->particle_steps, .calls = store->calls, .seconds = store->seconds};
  for (int b = 0; b < store->batches; b++) {
    int64_t solved, kept;
    rve_batch_network_counts(store->batch[b], &solved, &kept);
    totals->shared += rve_batch_shared(store->batch[b]), totals->solved += solved, totals->kept += kept;
    totals->flown += rve_batch_flown(store->batch[b]);
  }
  for (int s = 0; s < store->slots; s++)
    if (store->slot[s].batch >= 0) totals->grains += store->slot[s].item.grains;
}

int rve_store_left_device(const RveStore *store) {
  if (store->backend == RVE_BACKEND_CPU) return 0;
  for (int b = 0; b < store->batches; b++)
    if (!rve_batch_is_on_device(store->batch[b])) return 1;
  return 0;
}

BaseStatus rve_store_leave_device(RveStore *store) {
  for (int b = 0; b < store->batches; b++) TRY(rve_batch_leave_device(store->batch[b]));
  store->backend = RVE_BACKEND_CPU;
  return BASE_OK;
}

const char *rve_store_backend_name(const RveStore *store) {
  return store->batches ? rve_batch_backend_name(store->batch[0]) : "";
}
