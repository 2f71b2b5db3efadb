/* SPDX-License-Identifier: GPL-2.0-or-later */
/* An RVE's state as bytes: the arena as it is, behind a header. */
#include <string.h>

#include "rve_backend.h"
#include "rve_contacts.h"

typedef struct StateHeader {
  char magic[8];
  uint32_t version, head_bytes;
  uint64_t scene_hash, payload_bytes;
  RveCounts counts;
  RveAnswer last;
  RveConduction conduction;
  uint64_t checksum; /* of all above and the payload */
} StateHeader;

static const char magic[8] = "dempmRVE";
enum { STATE_VERSION = 2 };

static uint64_t checksum_of(const StateHeader *header, const void *payload) {
  uint64_t hash = base_hash(header, offsetof(StateHeader, checksum), BASE_HASH_SEED);
  /* Eight bytes at a time, in four chains: FNV over single bytes would cost more than the step it saves. */
  const unsigned char *byte = payload;
  uint64_t chain[4] = {hash, hash ^ 1, hash ^ 2, hash ^ 3};
  const size_t whole = (size_t)header->payload_bytes / 32 * 32;
  for (size_t k = 0; k < whole; k += 32)
    for (size_t c = 0; c < 4; c++) {
      uint64_t word;
      memcpy(&word, byte + k + 8 * c, sizeof word);
      chain[c] = (chain[c] ^ word) * UINT64_C(1099511628211);
      chain[c] ^= chain[c] >> 29;
    }
  hash = base_hash(chain, sizeof chain, hash);
  return base_hash(byte + whole, (size_t)header->payload_bytes - whole, hash);
}

size_t rve_record_state_bytes(const RveRecord *record) { return sizeof(StateHeader) + record->bytes; }

BaseStatus rve_record_pack(const RveRecord *record, uint64_t scene_hash, void *bytes, size_t *written) {
  StateHeader header;
  memset(&header, 0, sizeof header);
  memcpy(header.magic, magic, sizeof header.magic);
  header.version = STATE_VERSION;
  header.head_bytes = sizeof(RveHead);
  header.scene_hash = scene_hash;
  header.payload_bytes = record->bytes;
  header.counts = record->counts;
  header.last = record->last;
  header.conduction = record->conduction;
  /* The gap behind the last field is no state: the bytes must not depend on what the stack held. */
  const size_t end = offsetof(RveAnswer, flew) + sizeof header.last.flew;
  memset((char *)&header.last + end, 0, sizeof header.last - end);
  header.checksum = checksum_of(&header, record->arena);
  memcpy(bytes, &header, sizeof header);
  memcpy((char *)bytes + sizeof header, record->arena, record->bytes);
  *written = sizeof header + record->bytes;
  return BASE_OK;
}

static BaseStatus check_header(const StateHeader *header, uint64_t scene_hash, const void *bytes, size_t size) {
  if (memcmp(header->magic, magic, sizeof magic) != 0) return base_error(BASE_ERROR_FORMAT, "not the state of an RVE");
  if (header->version != STATE_VERSION || header->head_bytes != sizeof(RveHead))
    return base_error(BASE_ERROR_FORMAT, "state of an RVE: version %u (allowed: %d)", header->version, STATE_VERSION);
  if (header->payload_bytes != size - sizeof *header)
    return base_error(BASE_ERROR_FORMAT, "state of an RVE: truncated, %zu bytes instead of %zu", size,
                      (size_t)header->payload_bytes + sizeof *header);
  if (checksum_of(header, (const char *)bytes + sizeof *header) != header->checksum)
    return base_error(BASE_ERROR_FORMAT, "state of an RVE: altered, the checksum differs");
  if (header->scene_hash != scene_hash)
    return base_error(BASE_ERROR_FORMAT,
                      "state of an RVE: it belongs to another scene (dimension, grain, thickness, density, thermal, "
                      "bonds, friction)");
  RveArrays arrays;
  const RveCounts *n = &header->counts;
  if (n->grains < 1 || n->lanes < 1 || n->blocks != (n->grains + n->lanes - 1) / n->lanes ||
      (n->dimension != 2 && n->dimension != 3) || rve_layout(n, NULL, &arrays) != header->payload_bytes)
    return base_error(BASE_ERROR_FORMAT, "state of an RVE: its counts contradict its size");
  return BASE_OK;
}

/* Grains by id and contacts by ids. */
BaseStatus rve_record_convert(const RveKernels *kernels, const RveRecord *from, RveRecord *to) {
  RveCounts n = rve_counts_for(kernels, from->counts.dimension, from->counts.grains);
  const RveArrays *a = &from->arrays, *b = &to->arrays;
  RveContacts contacts;
  RveSlot slot;
  int rows = 0;
  BaseStatus status;
  memset(to, 0, sizeof *to);
  TRY(rve_contacts_create(from->counts.slot_rows * from->counts.lanes, &contacts));
  for (rve_slot_start(from, &slot); rve_slot_next(&slot);) {
    RveContact *contact = &contacts.contact[contacts.count++];
    memset(contact, 0, sizeof *contact);
    contact->pair[0] = a->id[slot.i], contact->pair[1] = a->id[slot.j];
    memcpy(contact->image, slot.image, sizeof slot.image);
    contact->bond = (*slot.image_word & RVE_IMAGE_BOND) != 0;
    for (int k = 0; k < (n.dimension == 2 ? 1 : 3); k++) contact->shear[k] = a->shear[k][slot.slot];
  }
  TRY_GOTO(rve_contacts_rows(&contacts, NULL, &n, &rows), status, done);
  if (rows > n.slot_rows) n.slot_rows = rows;
  TRY_GOTO(rve_record_alloc(&n, to), status, done);
  *rve_head(to->arena) = *rve_head(from->arena);
  rve_head(to->arena)->list_due = RVE_LIST_ABSENT;
  to->last = from->last;
  to->conduction = from->conduction;
  for (int i = 0; i < n.blocks * n.lanes; i++) b->id[i] = -1;
  for (int q = 0; q < n.grains; q++) {
    const int i = a->id[q];
    b->id[i] = i;
    for (int k = 0; k < n.dimension; k++) {
      b->position[k][i] = a->position[k][q];
      b->position_at_list[k][i] = a->position_at_list[k][q];
      b->velocity[k][i] = a->velocity[k][q];
    }
    for (int k = 0; k < (n.dimension == 2 ? 1 : 3); k++) b->spin[k][i] = a->spin[k][q];
    b->radius[i] = a->radius[q], b->reference_radius[i] = a->reference_radius[q];
    b->mass[i] = a->mass[q], b->inverse_mass[i] = a->inverse_mass[q], b->inverse_inertia[i] = a->inverse_inertia[q];
  }
  status = rve_contacts_place(&contacts, NULL, to);
done:
  rve_contacts_destroy(&contacts);
  if (status != BASE_OK) rve_record_destroy(to);
  return status;
}

static int ids_are_a_permutation(const RveRecord *record) {
  for (int q = 0; q < record->counts.grains; q++)
    if (record->arrays.id[q] < 0 || record->arrays.id[q] >= record->counts.grains) return 0;
  return 1;
}

BaseStatus rve_record_unpack(const RveKernels *kernels, uint64_t scene_hash, const void *bytes, size_t size,
                             RveRecord *record, int *canonical) {
  StateHeader header;
  RveRecord fresh, converted;
  if (size < sizeof header) return base_error(BASE_ERROR_FORMAT, "state of an RVE: truncated, %zu bytes", size);
  memcpy(&header, bytes, sizeof header);
  TRY(check_header(&header, scene_hash, bytes, size));
  TRY(rve_record_alloc(&header.counts, &fresh));
  memcpy(fresh.arena, (const char *)bytes + sizeof header, fresh.bytes);
  fresh.last = header.last;
  fresh.conduction = header.conduction;
  const int dim = header.counts.dimension - 2;
  *canonical = header.counts.lanes != kernels->lanes || header.counts.row != kernels->row[dim] ||
               header.counts.reaction != kernels->reaction[dim] ||
               fresh.arrays.slot_first[header.counts.blocks] >= header.counts.slot_rows; /* once there could be no row behind */
  if (*canonical) {
    BaseStatus status = ids_are_a_permutation(&fresh)
                            ? rve_record_convert(kernels, &fresh, &converted)
                            : base_error(BASE_ERROR_FORMAT, "state of an RVE: ids are out of range");
    rve_record_destroy(&fresh);
    TRY(status);
    fresh = converted;
  }
  rve_record_destroy(record);
  *record = fresh;
  return BASE_OK;
}
