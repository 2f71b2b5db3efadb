/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Replay files: one failed RVE as it was before the call, and what the call asked for. Raw structures of this build behind
 * sizes and a checksum: a file is read by the program that wrote it. */
#include "rve_replay.h"

#include <stdio.h>
#include <string.h>

#include "../base/base_file.h"
#include "rve_batch_private.h"
#include "rve_packing.h"

typedef struct ReplayHeader {
  char magic[8];
  uint32_t version, header_bytes;
  uint64_t state_bytes;
  RveScene scene;
  RveInput input;
  double duration;
  RveFailure failure;
  char name[RVE_NAME_BYTES];
  char backend[RVE_BACKEND_BYTES];
  uint64_t checksum; /* of all above and the state */
} ReplayHeader;

static const char magic[8] = "dempmRPL";
enum { REPLAY_VERSION = 3, MOST_BYTES = 1 << 30 };

static uint64_t checksum_of(const ReplayHeader *header, const void *state) {
  const uint64_t hash = base_hash(header, offsetof(ReplayHeader, checksum), BASE_HASH_SEED);
  return base_hash(state, (size_t)header->state_bytes, hash);
}

BaseStatus rve_batch_write_replay(const RveBatch *batch, int rve, const char *name, const char *file) {
  RveFailure unused;
  ReplayHeader header;
  TRY(rve_batch_failure(batch, rve, &unused));
  const RveFailed *failed = batch->failed[rve];
  if (!failed || !failed->state)
    return base_error(BASE_ERROR_ARGUMENT, "RVE %d: no state was kept from before the failure%s", rve,
                      batch->device ? " (the CPU backend keeps it)" : batch->keep ? ": the packing was calm" : "");
  memset(&header, 0, sizeof header);
  memcpy(header.magic, magic, sizeof magic);
  header.version = REPLAY_VERSION;
  header.header_bytes = sizeof header;
  header.state_bytes = failed->bytes;
  header.scene = failed->scene;
  header.input = failed->input;
  header.duration = failed->duration;
  header.failure = failed->failure;
  if (name) snprintf(header.name, sizeof header.name, "%s", name);
  memcpy(header.backend, batch->name, sizeof header.backend);
  header.checksum = checksum_of(&header, failed->state);
  return base_file_replace(file, &header, sizeof header, failed->state, failed->bytes);
}

static BaseStatus check_header(const char *file, const char *bytes, size_t size, ReplayHeader *header) {
  if (size < sizeof magic || memcmp(bytes, magic, sizeof magic) != 0)
    return base_error(BASE_ERROR_FORMAT, "%s is no replay file of dempm", file);
  if (size < sizeof *header) return base_error(BASE_ERROR_FORMAT, "replay file %s: truncated, %zu bytes", file, size);
  memcpy(header, bytes, sizeof *header);
  if (header->version != REPLAY_VERSION || header->header_bytes != sizeof *header)
    return base_error(BASE_ERROR_FORMAT, "replay file %s: written by another version of dempm", file);
  if (header->state_bytes != size - sizeof *header)
    return base_error(BASE_ERROR_FORMAT, "replay file %s: truncated, %zu bytes instead of %zu", file, size,
                      (size_t)header->state_bytes + sizeof *header);
  if (checksum_of(header, bytes + sizeof *header) != header->checksum)
    return base_error(BASE_ERROR_FORMAT, "replay file %s: altered, the checksum differs", file);
  if (rve_scene_check(&header->scene) != BASE_OK) return base_error_context(BASE_ERROR_FORMAT, "replay file %s: ", file);
  return BASE_OK;
}

BaseStatus rve_replay_read(const char *file, RveReplay *replay) {
  char *bytes;
  size_t size;
  ReplayHeader header;
  memset(replay, 0, sizeof *replay);
  TRY(base_file_read(file, "replay file", MOST_BYTES, &bytes, &size));
  BaseStatus status = check_header(file, bytes, size, &header);
  if (status == BASE_OK) status = base_alloc((size_t)header.state_bytes, 1, &replay->state);
  if (status == BASE_OK) {
    replay->scene = header.scene;
    replay->input = header.input;
    replay->duration = header.duration;
    replay->failure = header.failure;
    memcpy(replay->name, header.name, sizeof replay->name);
    memcpy(replay->backend, header.backend, sizeof replay->backend);
    replay->name[sizeof replay->name - 1] = replay->backend[sizeof replay->backend - 1] = '\0';
    replay->failure.cause[RVE_CAUSE_BYTES - 1] = '\0';
    replay->bytes = (size_t)header.state_bytes;
    memcpy(replay->state, bytes + sizeof header, replay->bytes);
  }
  base_free(bytes);
  return status;
}

void rve_replay_destroy(RveReplay *replay) {
  if (!replay) return;
  base_free(replay->state);
  memset(replay, 0, sizeof *replay);
}

/* A batch starts from a packing; one grain holds the place until the stored state takes it. */
BaseStatus rve_replay_start(const RveReplay *replay, const RveScene *scene, RveBatch **batch) {
  RvePacking grain;
  *batch = NULL;
  TRY(rve_packing_lattice(scene->dimension == 2 ? RVE_SQUARE : RVE_SIMPLE_CUBIC, 1.0, 0.0, &grain));
  BaseStatus status = rve_batch_create(scene, &grain, 1, NULL, 1, RVE_BACKEND_CPU, batch);
  rve_packing_destroy(&grain);
  if (status == BASE_OK) status = rve_batch_unpack(*batch, 0, replay->state, replay->bytes);
  if (status == BASE_OK) return BASE_OK;
  rve_batch_destroy(*batch);
  *batch = NULL;
  return status;
}
