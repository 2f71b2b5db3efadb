/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The restart record of an RveLaw: a header, a table of all RVEs in the order of tags, their states in the same order.
 * All numbers are 8 bytes wide, in the machine's own byte order. */
#include <inttypes.h>
#include <stdlib.h>
#include <string.h>

#include "rank_agree.h"
#include "rve_law_private.h"

enum { RECORD_VERSION = 2, STATE_MESSAGE = 2 };
static const char record_magic[8] = "DEMPMRVE";
static const size_t largest_message = (size_t)1 << 30; /* bytes; MPI counts in int */

typedef struct Header {
  char magic[8];
  uint64_t version;
  uint64_t size;     /* of the whole record, bytes */
  uint64_t checksum; /* of the whole record with this field 0 */
  uint64_t rves;
  /* What must be as it is in the scene that reads the record. */
  uint64_t dimension, grain, rotation, thermal, bonds;
  uint64_t packings;
  uint64_t packings_hash; /* grain counts and radii */
} Header;

/* Table entry: one RVE. */
typedef struct Entry {
  int64_t tag;
  uint64_t size; /* of its state, bytes; the state takes padded(size) */
  double scale, dissipation;
  RveRest rest;
} Entry;

static size_t padded(size_t size) { return (size + 7) / 8 * 8; }

static Header expected_header(RveLaw *law) {
  const RveScene *scene = rve_store_scene(law->store);
  int count;
  const RvePacking *packing = rve_store_packings(law->store, &count);
  Header header = {.version = RECORD_VERSION, .dimension = (uint64_t)scene->dimension, .grain = (uint64_t)scene->grain,
                   .rotation = (uint64_t)scene->rotation, .thermal = (uint64_t)scene->thermal,
                   .bonds = (uint64_t)scene->bonds, .packings = (uint64_t)count, .packings_hash = BASE_HASH_SEED};
  memcpy(header.magic, record_magic, sizeof header.magic);
  for (int k = 0; k < count; k++) {
    const size_t grains = (size_t)packing[k].grains;
    header.packings_hash = base_hash(&packing[k].grains, sizeof packing[k].grains, header.packings_hash);
    header.packings_hash = base_hash(packing[k].radius, grains * sizeof(double), header.packings_hash);
  }
  return header;
}

static uint64_t record_checksum(Header header, const void *bytes, size_t size) {
  header.checksum = 0;
  const uint64_t start = base_hash(&header, sizeof header, BASE_HASH_SEED);
  return base_hash((const char *)bytes + sizeof header, size - sizeof header, start);
}

/* -- pack ------------------------------------------------------------------------------------------------------ */

/* This rank's part: entries in ascending order of tags, states one after the other. */
typedef struct Part {
  int count;
  Entry *entry; /* [count] */
  char *states;
  uint64_t bytes; /* of states */
} Part;

static void part_clear(Part *part) {
  base_free(part->entry);
  base_free(part->states);
  *part = (Part){0};
}

static BaseStatus pack_part(RveLaw *law, Part *part) {
  const int64_t *tags;
  int *handles;
  const int own = rve_farm_own(law->farm, &tags, &handles);
  size_t room = 0;
  for (int k = 0; k < own; k++) {
    if (handles[k] < 0)
      return base_error(BASE_ERROR_ARGUMENT, "the RVE of material point %" PRId64 " was never created", tags[k]);
    room += padded(rve_store_state_bytes(law->store, handles[k]));
  }
  TRY(BASE_ALLOC((size_t)own, &part->entry));
  TRY(BASE_ALLOC(room, &part->states));
  for (int k = 0; k < own; k++) {
    const RveStoreItem *item = rve_store_item(law->store, handles[k]);
    size_t written;
    TRY(rve_store_pack(law->store, handles[k], part->states + part->bytes, &written));
    part->entry[part->count++] =
        (Entry){item->tag, written, item->scale, item->dissipation, item->rest};
    part->bytes += padded(written);
  }
  return BASE_OK;
}

/* What rank 0 needs to put the record together. */
typedef struct Assembly {
  int *count, *start; /* [ranks] entries of each rank */
  Entry *entry;       /* [rves] by rank, then tag */
  int *order;         /* [rves] indices into entry, by tag */
  size_t *offset;     /* [rves] of entry's state in the record */
  char *buffer;       /* states of one rank on their way */
  char *record;
  size_t size;
} Assembly;

static void assembly_clear(Assembly *assembly) {
  base_free(assembly->count);
  base_free(assembly->start);
  base_free(assembly->entry);
  base_free(assembly->order);
  base_free(assembly->offset);
  base_free(assembly->buffer);
  base_free(assembly->record);
  *assembly = (Assembly){0};
}

static BaseStatus assembly_create(const RveLaw *law, Assembly *assembly) {
  if (law->rank != 0) return BASE_OK;
  const size_t rves = (size_t)rve_farm_size(law->farm), ranks = (size_t)law->ranks;
  TRY(BASE_ALLOC(ranks, &assembly->count));
  TRY(BASE_ALLOC(ranks, &assembly->start));
  TRY(BASE_ALLOC(rves, &assembly->entry));
  TRY(BASE_ALLOC(rves, &assembly->order));
  return BASE_ALLOC(rves, &assembly->offset);
}

static void gather_entries(const RveLaw *law, const Part *part, Assembly *assembly) {
  MPI_Datatype item;
  MPI_Type_contiguous((int)sizeof(Entry), MPI_BYTE, &item);
  MPI_Type_commit(&item);
  MPI_Gather(&part->count, 1, MPI_INT, assembly->count, 1, MPI_INT, 0, law->comm);
  for (int r = 1; r < law->ranks && law->rank == 0; r++)
    assembly->start[r] = assembly->start[r - 1] + assembly->count[r - 1];
  MPI_Gatherv(part->entry, part->count, item, assembly->entry, assembly->count, assembly->start, item, 0, law->comm);
  MPI_Type_free(&item);
}

/* Each rank's entries are ascending: a merge of the lists. cursor: [ranks] entries taken. */
static void merge_entries(const RveLaw *law, Assembly *assembly, int *cursor) {
  const int rves = rve_farm_size(law->farm);
  for (int k = 0; k < rves; k++) {
    int best = -1;
    for (int r = 0; r < law->ranks; r++) {
      const int e = assembly->start[r] + cursor[r];
      if (cursor[r] < assembly->count[r] &&
          (best < 0 || assembly->entry[e].tag < assembly->entry[assembly->start[best] + cursor[best]].tag))
        best = r;
    }
    assembly->order[k] = assembly->start[best] + cursor[best]++;
  }
}

/* Rank 0: places of all states, the record with header (but checksum) and table, room for one rank's states. */
static BaseStatus lay_out(RveLaw *law, Assembly *assembly) {
  const int rves = rve_farm_size(law->farm);
  int *cursor;
  TRY(BASE_ALLOC((size_t)law->ranks, &cursor));
  merge_entries(law, assembly, cursor);
  base_free(cursor);
  size_t end = sizeof(Header) + (size_t)rves * sizeof(Entry), largest = 0;
  for (int k = 0; k < rves; k++) {
    assembly->offset[assembly->order[k]] = end;
    end += padded(assembly->entry[assembly->order[k]].size);
  }
  for (int r = 1; r < law->ranks; r++) {
    size_t bytes = 0;
    for (int k = 0; k < assembly->count[r]; k++) bytes += padded(assembly->entry[assembly->start[r] + k].size);
    if (bytes > largest) largest = bytes;
  }
  TRY(BASE_ALLOC(largest, &assembly->buffer));
  TRY(BASE_ALLOC(end, &assembly->record));
  assembly->size = end;
  Header header = expected_header(law);
  header.size = end;
  header.rves = (uint64_t)rves;
  memcpy(assembly->record, &header, sizeof header);
  for (int k = 0; k < rves; k++)
    memcpy(assembly->record + sizeof header + (size_t)k * sizeof(Entry), &assembly->entry[assembly->order[k]],
           sizeof(Entry));
  return BASE_OK;
}

/* Rank 0: the states of one rank, one after the other at `states`, to their places. */
static void place_states(Assembly *assembly, int rank, const char *states) {
  for (int k = 0; k < assembly->count[rank]; k++) {
    const int e = assembly->start[rank] + k;
    memcpy(assembly->record + assembly->offset[e], states, padded(assembly->entry[e].size));
    states += padded(assembly->entry[e].size);
  }
}

static void transfer_states(const RveLaw *law, Part *part, Assembly *assembly) {
  if (law->rank != 0) {
    for (size_t done = 0; done < part->bytes; done += largest_message) {
      const size_t left = part->bytes - done;
      MPI_Send(part->states + done, (int)(left < largest_message ? left : largest_message), MPI_BYTE, 0, STATE_MESSAGE,
               law->comm);
    }
    return;
  }
  place_states(assembly, 0, part->states);
  for (int r = 1; r < law->ranks; r++) {
    size_t bytes = 0;
    for (int k = 0; k < assembly->count[r]; k++) bytes += padded(assembly->entry[assembly->start[r] + k].size);
    for (size_t done = 0; done < bytes; done += largest_message) {
      const size_t left = bytes - done;
      MPI_Recv(assembly->buffer + done, (int)(left < largest_message ? left : largest_message), MPI_BYTE, r,
               STATE_MESSAGE, law->comm, MPI_STATUS_IGNORE);
    }
    place_states(assembly, r, assembly->buffer);
  }
}

BaseStatus rve_law_pack(RveLaw *law, void **bytes, size_t *size) {
  Part part = {0};
  Assembly assembly = {0};
  *bytes = NULL;
  *size = 0;
  BaseStatus status = pack_part(law, &part);
  if (status == BASE_OK) status = assembly_create(law, &assembly);
  TRY_GOTO(rank_agree(law->comm, status, law->rank), status, done);
  gather_entries(law, &part, &assembly);
  if (law->rank == 0) status = lay_out(law, &assembly);
  TRY_GOTO(rank_agree(law->comm, status, law->rank), status, done);
  transfer_states(law, &part, &assembly);
  if (law->rank == 0) {
    Header header;
    memcpy(&header, assembly.record, sizeof header);
    header.checksum = record_checksum(header, assembly.record, assembly.size);
    memcpy(assembly.record, &header, sizeof header);
    *bytes = assembly.record;
    *size = assembly.size;
    assembly.record = NULL;
  }
done:
  part_clear(&part);
  assembly_clear(&assembly);
  return status;
}

/* -- unpack ---------------------------------------------------------------------------------------------------- */

static BaseStatus check_header(const Header *header, const Header *expected, size_t size) {
  if (memcmp(header->magic, record_magic, sizeof record_magic) != 0)
    return base_error(BASE_ERROR_FORMAT, "RVE restart record: does not start as one (DEMPMRVE)");
  if (header->version != RECORD_VERSION)
    return base_error(BASE_ERROR_FORMAT, "RVE restart record: version %" PRIu64 ", only %d can be read",
                      header->version, RECORD_VERSION);
  if (header->size != size)
    return base_error(BASE_ERROR_FORMAT, "RVE restart record: truncated, %zu bytes of %" PRIu64, size, header->size);
  const struct {
    const char *name;
    uint64_t is, wanted;
  } items[] = {{"dimension", header->dimension, expected->dimension},
               {"grain shape", header->grain, expected->grain},
               {"rotation flag", header->rotation, expected->rotation},
               {"thermal flag", header->thermal, expected->thermal},
               {"bonds flag", header->bonds, expected->bonds},
               {"number of packings", header->packings, expected->packings}};
  for (size_t k = 0; k < sizeof items / sizeof items[0]; k++)
    if (items[k].is != items[k].wanted)
      return base_error(BASE_ERROR_FORMAT, "RVE restart record: belongs to another scene, its %s is %" PRIu64
                        " and that of the scene %" PRIu64, items[k].name, items[k].is, items[k].wanted);
  if (header->packings_hash != expected->packings_hash)
    return base_error(BASE_ERROR_FORMAT, "RVE restart record: belongs to other packings (their grains differ)");
  return BASE_OK;
}

static Entry entry_of(const char *bytes, uint64_t k) {
  Entry entry;
  memcpy(&entry, bytes + sizeof(Header) + k * sizeof entry, sizeof entry);
  return entry;
}

/* Everything that can be said without restoring an RVE. */
static BaseStatus check_record(RveLaw *law, const char *bytes, size_t size, Header *header) {
  const Header expected = expected_header(law);
  if (!bytes || size < sizeof *header)
    return base_error(BASE_ERROR_FORMAT, "RVE restart record: truncated, %zu bytes are less than its header", size);
  memcpy(header, bytes, sizeof *header);
  TRY(check_header(header, &expected, size));
  if (header->checksum != record_checksum(*header, bytes, size))
    return base_error(BASE_ERROR_FORMAT, "RVE restart record: altered, its checksum does not hold");
  /* Beyond here only a record that was written wrong fails. */
  if (header->rves > INT32_MAX || header->rves > (size - sizeof *header) / sizeof(Entry))
    return base_error(BASE_ERROR_FORMAT, "RVE restart record: its table does not fit");
  size_t left = size - sizeof *header - header->rves * sizeof(Entry);
  for (uint64_t k = 0; k < header->rves; k++) {
    const Entry entry = entry_of(bytes, k);
    if (entry.size > left || padded(entry.size) > left)
      return base_error(BASE_ERROR_FORMAT, "RVE restart record: the state of material point %" PRId64
                        " does not fit", entry.tag);
    left -= padded(entry.size);
  }
  return BASE_OK;
}

/* Alike on all ranks, or refused: directories must not differ. */
static BaseStatus check_same(const RveLaw *law, uint64_t checksum) {
  uint64_t low, high;
  MPI_Allreduce(&checksum, &low, 1, MPI_UINT64_T, MPI_MIN, law->comm);
  MPI_Allreduce(&checksum, &high, 1, MPI_UINT64_T, MPI_MAX, law->comm);
  if (low != high) return base_error(BASE_ERROR_FORMAT, "RVE restart record: ranks were given different records");
  return BASE_OK;
}

static BaseStatus assign_tags(RveLaw *law, const char *bytes, const Header *header, RveFarm *farm) {
  const uint64_t rves = law->rank == 0 ? header->rves : 0; /* each tag is to be named once */
  int64_t *tags;
  BaseStatus status = BASE_ALLOC((size_t)rves, &tags);
  for (uint64_t k = 0; k < rves && status == BASE_OK; k++) tags[k] = entry_of(bytes, k).tag;
  status = rank_agree(law->comm, status, law->rank);
  if (status == BASE_OK) status = rve_farm_assign(farm, (int)rves, tags, 1);
  base_free(tags);
  return status;
}

/* States of this rank's RVEs. */
static BaseStatus restore_states(const char *bytes, const Header *header, RveFarm *farm, RveStore *store) {
  const char *state = bytes + sizeof *header + header->rves * sizeof(Entry);
  for (uint64_t k = 0; k < header->rves; k++) {
    const Entry entry = entry_of(bytes, k);
    const int handle = rve_farm_handle(farm, entry.tag);
    if (handle >= 0) {
      BaseStatus status = rve_store_unpack(store, handle, state, entry.size);
      if (status != BASE_OK)
        return base_error_context(status, "RVE restart record, material point %" PRId64 ": ", entry.tag);
      rve_store_item(store, handle)->scale = entry.scale;
    }
    state += padded(entry.size);
  }
  TRY(rve_store_refresh(store));
  for (uint64_t k = 0; k < header->rves; k++) {
    const Entry entry = entry_of(bytes, k);
    const int handle = rve_farm_handle(farm, entry.tag);
    if (handle < 0) continue;
    rve_store_item(store, handle)->dissipation = entry.dissipation;
    rve_store_item(store, handle)->rest = entry.rest;
  }
  return BASE_OK;
}

BaseStatus rve_law_unpack(RveLaw *law, const void *bytes, size_t size) {
  Header header = {0};
  RveFarm *farm = NULL;
  RveStore *store = NULL;
  int packing_count;
  TRY(rank_agree(law->comm, check_record(law, bytes, size, &header), law->rank));
  TRY(check_same(law, header.checksum));
  const RvePacking *packings = rve_store_packings(law->store, &packing_count);
  BaseStatus status =
      rve_store_create(rve_store_scene(law->store), packings, packing_count, law->backend, &store);
  TRY_GOTO(rank_agree(law->comm, status, law->rank), status, fail);
  TRY_GOTO(rve_farm_create(law->comm, &farm), status, fail);
  TRY_GOTO(assign_tags(law, bytes, &header, farm), status, fail);
  TRY_GOTO(rve_law_create_missing(law->comm, farm, store), status, fail);
  TRY_GOTO(rank_agree(law->comm, restore_states(bytes, &header, farm, store), law->rank), status, fail);

  rve_farm_destroy(law->farm);
  rve_store_destroy(law->store);
  law->farm = farm;
  law->store = store;
  if (law->replay_directory) rve_store_keep_states(store);
  return rve_law_agree_on_device(law);

fail:
  rve_farm_destroy(farm);
  rve_store_destroy(store);
  return status;
}
