/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "rve_farm.h"

#include <inttypes.h>
#include <stdlib.h>
#include <string.h>

#include "rank_agree.h"

/* All tags that have an RVE somewhere. */
typedef struct Directory {
  int count;
  int64_t *tag; /* [count] ascending */
  int *owner;   /* [count] rank */
  int own_count;
  int64_t *own_tag; /* [own_count] ascending */
  int *own_handle;  /* [own_count] */
} Directory;

/* Points by owner of their RVE, and the requests that arrive here. Counts and starts are per rank, in points. */
typedef struct Plan {
  int valid;
  int points, requests;
  int point_room, request_room;
  int64_t *point_tag;    /* [points] as given to rve_farm_plan() */
  int64_t *sent_tag;     /* [points] by owner, then in the caller's order */
  int *position;         /* [points] where point p stands in that order */
  double *buffer;        /* [points][RVE_FARM_WIDTH] */
  int64_t *request_tag;  /* [requests] by asking rank, then in its order */
  int *request_handle;   /* [requests] */
  int *send_count, *send_start, *receive_count, *receive_start; /* [ranks] */
} Plan;

struct RveFarm {
  MPI_Comm comm;
  int rank, ranks;
  Directory directory;
  Plan plan;
};

static void directory_clear(Directory *directory) {
  base_free(directory->tag);
  base_free(directory->owner);
  base_free(directory->own_tag);
  base_free(directory->own_handle);
  *directory = (Directory){0};
}

static int find_tag(const int64_t *tags, int count, int64_t tag) {
  int low = 0, high = count;
  while (low < high) {
    const int middle = low + (high - low) / 2;
    if (tags[middle] < tag) low = middle + 1;
    else high = middle;
  }
  return low < count && tags[low] == tag ? low : -1;
}

static int by_tag(const void *a, const void *b) {
  const int64_t left = *(const int64_t *)a, right = *(const int64_t *)b;
  return (left > right) - (left < right);
}

static BaseStatus allocate(RveFarm *farm) {
  const size_t ranks = (size_t)farm->ranks;
  TRY(BASE_ALLOC(ranks, &farm->plan.send_count));
  TRY(BASE_ALLOC(ranks, &farm->plan.send_start));
  TRY(BASE_ALLOC(ranks, &farm->plan.receive_count));
  return BASE_ALLOC(ranks, &farm->plan.receive_start);
}

BaseStatus rve_farm_create(MPI_Comm comm, RveFarm **result) {
  int rank;
  MPI_Comm_rank(comm, &rank);
  RveFarm *farm;
  BaseStatus status = BASE_ALLOC(1, &farm);
  if (status == BASE_OK) {
    farm->comm = comm;
    farm->rank = rank;
    MPI_Comm_size(comm, &farm->ranks);
    status = allocate(farm);
  }
  status = rank_agree(comm, status, rank);
  if (status != BASE_OK) rve_farm_destroy(farm), farm = NULL;
  *result = farm;
  return status;
}

void rve_farm_destroy(RveFarm *farm) {
  if (!farm) return;
  Plan *plan = &farm->plan;
  directory_clear(&farm->directory);
  base_free(plan->point_tag);
  base_free(plan->sent_tag);
  base_free(plan->position);
  base_free(plan->buffer);
  base_free(plan->request_tag);
  base_free(plan->request_handle);
  base_free(plan->send_count);
  base_free(plan->send_start);
  base_free(plan->receive_count);
  base_free(plan->receive_start);
  base_free(farm);
}

/* -- directory ------------------------------------------------------------------------------------------------- */

/* Starts of consecutive blocks of count[r]; BASE_ERROR_MEMORY beyond what an int counts. */
static BaseStatus block_starts(int ranks, const int *count, int *start, int *total) {
  int64_t sum = 0;
  for (int r = 0; r < ranks; r++) {
    start[r] = (int)sum;
    sum += count[r];
    if (sum > INT32_MAX) return base_error(BASE_ERROR_MEMORY, "more than %d material points", INT32_MAX);
  }
  *total = (int)sum;
  return BASE_OK;
}

static BaseStatus check_tags(const int64_t *tag, int count) {
  for (int t = 0; t < count; t++) {
    if (tag[t] < 1)
      return base_error(BASE_ERROR_ARGUMENT, "material point has tag %" PRId64 ", must be > 0", tag[t]);
    if (t > 0 && tag[t] == tag[t - 1])
      return base_error(BASE_ERROR_ARGUMENT, "two material points have the tag %" PRId64, tag[t]);
  }
  return BASE_OK;
}

/* All ranks' tags, ascending, alike on all ranks. Uses the plan's arrays per rank. */
static BaseStatus gather_tags(RveFarm *farm, int n, const int64_t *tags, int64_t **all, int *total) {
  Plan *plan = &farm->plan;
  plan->valid = 0;
  *all = NULL;
  MPI_Allgather(&n, 1, MPI_INT, plan->receive_count, 1, MPI_INT, farm->comm);
  TRY(block_starts(farm->ranks, plan->receive_count, plan->receive_start, total)); /* alike on all ranks */
  TRY(rank_agree(farm->comm, BASE_ALLOC((size_t)*total, all), farm->rank));
  MPI_Allgatherv(tags, n, MPI_INT64_T, *all, plan->receive_count, plan->receive_start, MPI_INT64_T, farm->comm);
  if (*total) qsort(*all, (size_t)*total, sizeof **all, by_tag);
  return check_tags(*all, *total);
}

/* Union of the old directory (kept == 0: only where `tag` names it too) and `tag`; owner -1 where new. */
static void merge_tags(const Directory *old, int keep, const int64_t *tag, int count, Directory *fresh) {
  int o = 0, t = 0;
  fresh->count = 0;
  while (o < old->count || t < count) {
    const int take_old = t == count || (o < old->count && old->tag[o] <= tag[t]);
    const int take_new = o == old->count || (t < count && tag[t] <= old->tag[o]);
    if (take_new || keep) {
      fresh->tag[fresh->count] = take_new ? tag[t] : old->tag[o];
      fresh->owner[fresh->count++] = take_old ? old->owner[o] : -1;
    }
    o += take_old;
    t += take_new;
  }
}

/* quota[r]: how many of `fresh` new tags rank r gets so that ranks holding held[r] end as even as possible. */
static void share_out(int ranks, const int *held, int fresh, int *quota) {
  int64_t low = 0, high = INT32_MAX; /* largest level up to which `fresh` tags fill all ranks */
  while (low < high) {
    const int64_t level = (low + high + 1) / 2;
    int64_t needed = 0;
    for (int r = 0; r < ranks; r++) needed += level > held[r] ? level - held[r] : 0;
    if (needed <= fresh) low = level;
    else high = level - 1;
  }
  int64_t left = fresh;
  for (int r = 0; r < ranks; r++) {
    quota[r] = low > held[r] ? (int)(low - held[r]) : 0;
    left -= quota[r];
  }
  for (int r = 0; r < ranks && left > 0; r++)
    if (held[r] + quota[r] == low) quota[r]++, left--;
}

/* Owners for the tags that have none. held, quota: [ranks] scratch. */
static void choose_owners(Directory *directory, int ranks, int *held, int *quota) {
  int fresh = 0;
  memset(held, 0, (size_t)ranks * sizeof *held);
  for (int t = 0; t < directory->count; t++)
    if (directory->owner[t] >= 0) held[directory->owner[t]]++;
    else fresh++;
  share_out(ranks, held, fresh, quota);
  int r = 0;
  for (int t = 0; t < directory->count; t++) {
    if (directory->owner[t] >= 0) continue;
    while (quota[r] == 0) r++;
    directory->owner[t] = r;
    quota[r]--;
  }
}

/* The own part of a directory whose owners are known, handles taken over from the old one. */
static BaseStatus list_own(const Directory *old, int rank, Directory *directory) {
  int own = 0;
  for (int t = 0; t < directory->count; t++) own += directory->owner[t] == rank;
  TRY(BASE_ALLOC((size_t)own, &directory->own_tag));
  TRY(BASE_ALLOC((size_t)own, &directory->own_handle));
  for (int t = 0; t < directory->count; t++) {
    if (directory->owner[t] != rank) continue;
    const int before = find_tag(old->own_tag, old->own_count, directory->tag[t]);
    directory->own_tag[directory->own_count] = directory->tag[t];
    directory->own_handle[directory->own_count++] = before >= 0 ? old->own_handle[before] : -1;
  }
  return BASE_OK;
}

/* Local: the directory that follows from the old one and all ranks' tags. */
static BaseStatus next_directory(RveFarm *farm, const int64_t *all, int total, int keep, Directory *next) {
  const Directory *old = &farm->directory;
  const size_t room = (size_t)total + (size_t)old->count;
  if (room > INT32_MAX) return base_error(BASE_ERROR_MEMORY, "more than %d material points", INT32_MAX);
  TRY(BASE_ALLOC(room, &next->tag));
  TRY(BASE_ALLOC(room, &next->owner));
  merge_tags(old, keep, all, total, next);
  choose_owners(next, farm->ranks, farm->plan.send_count, farm->plan.send_start);
  return list_own(old, farm->rank, next);
}

BaseStatus rve_farm_assign(RveFarm *farm, int n, const int64_t *tags, int forget) {
  int64_t *all = NULL;
  int total = 0;
  Directory next = {0};
  BaseStatus status = gather_tags(farm, n, tags, &all, &total);
  if (status == BASE_OK) /* alike on all ranks so far */
    status = rank_agree(farm->comm, next_directory(farm, all, total, !forget, &next), farm->rank);
  base_free(all);
  if (status != BASE_OK) {
    directory_clear(&next);
    return status;
  }
  directory_clear(&farm->directory);
  farm->directory = next;
  return BASE_OK;
}

int rve_farm_own(const RveFarm *farm, const int64_t **tags, int **handles) {
  *tags = farm->directory.own_tag;
  *handles = farm->directory.own_handle;
  return farm->directory.own_count;
}

int rve_farm_size(const RveFarm *farm) { return farm->directory.count; }

int rve_farm_owner(const RveFarm *farm, int64_t tag) {
  const int t = find_tag(farm->directory.tag, farm->directory.count, tag);
  return t < 0 ? -1 : farm->directory.owner[t];
}

int rve_farm_handle(const RveFarm *farm, int64_t tag) {
  const int t = find_tag(farm->directory.own_tag, farm->directory.own_count, tag);
  return t < 0 ? -1 : farm->directory.own_handle[t];
}

/* -- plan ------------------------------------------------------------------------------------------------------ */

static size_t with_reserve(int needed) { return (size_t)needed + (size_t)needed / 4; }

static BaseStatus reserve_points(Plan *plan, int n) {
  if (n <= plan->point_room) return BASE_OK;
  const size_t room = with_reserve(n);
  TRY(BASE_GROW(0, room, &plan->point_tag));
  TRY(BASE_GROW(0, room, &plan->sent_tag));
  TRY(BASE_GROW(0, room, &plan->position));
  TRY(BASE_GROW(0, room * RVE_FARM_WIDTH, &plan->buffer));
  plan->point_room = room < INT32_MAX ? (int)room : INT32_MAX;
  return BASE_OK;
}

static BaseStatus reserve_requests(Plan *plan, int n) {
  if (n <= plan->request_room) return BASE_OK;
  const size_t room = with_reserve(n);
  TRY(BASE_GROW(0, room, &plan->request_tag));
  TRY(BASE_GROW(0, room, &plan->request_handle));
  plan->request_room = room < INT32_MAX ? (int)room : INT32_MAX;
  return BASE_OK;
}

static RveFarmNews compare_with_plan(const RveFarm *farm, int n, const int64_t *tags) {
  const Plan *plan = &farm->plan;
  if (plan->valid && n == plan->points && (n == 0 || memcmp(tags, plan->point_tag, (size_t)n * sizeof *tags) == 0))
    return RVE_FARM_SAME;
  for (int p = 0; p < n; p++)
    if (rve_farm_owner(farm, tags[p]) < 0) return RVE_FARM_UNKNOWN;
  return RVE_FARM_PLANNED;
}

/* Local: sorts this rank's points by owner (stable). All owners are known. */
static void order_points(RveFarm *farm, int n, const int64_t *tags) {
  Plan *plan = &farm->plan;
  memset(plan->send_count, 0, (size_t)farm->ranks * sizeof *plan->send_count);
  for (int p = 0; p < n; p++) {
    plan->position[p] = rve_farm_owner(farm, tags[p]);
    plan->send_count[plan->position[p]]++;
  }
  int start = 0;
  for (int r = 0; r < farm->ranks; r++) plan->send_start[r] = start, start += plan->send_count[r];
  for (int p = 0; p < n; p++) {
    plan->position[p] = plan->send_start[plan->position[p]]++;
    plan->sent_tag[plan->position[p]] = tags[p];
  }
  for (int r = 0; r < farm->ranks; r++) plan->send_start[r] -= plan->send_count[r];
  if (n) memcpy(plan->point_tag, tags, (size_t)n * sizeof *tags);
  plan->points = n;
}

/* Local: handles of the requests. An RVE that is asked twice would be stepped twice. */
static BaseStatus look_up_requests(RveFarm *farm) {
  Plan *plan = &farm->plan;
  const Directory *directory = &farm->directory;
  unsigned char *asked;
  TRY(BASE_ALLOC((size_t)directory->own_count, &asked));
  BaseStatus status = BASE_OK;
  for (int q = 0; q < plan->requests && status == BASE_OK; q++) {
    const int64_t tag = plan->request_tag[q];
    const int own = find_tag(directory->own_tag, directory->own_count, tag);
    if (own < 0 || directory->own_handle[own] < 0)
      status = base_error(BASE_ERROR_ARGUMENT, "the RVE of material point %" PRId64 " was never created", tag);
    else if (asked[own]++)
      status = base_error(BASE_ERROR_ARGUMENT, "two material points have the tag %" PRId64, tag);
    else
      plan->request_handle[q] = directory->own_handle[own];
  }
  base_free(asked);
  return status;
}

BaseStatus rve_farm_plan(RveFarm *farm, int n, const int64_t *tags, RveFarmNews *news) {
  Plan *plan = &farm->plan;
  int mine = (int)compare_with_plan(farm, n, tags), all;
  MPI_Allreduce(&mine, &all, 1, MPI_INT, MPI_MAX, farm->comm);
  *news = (RveFarmNews)all;
  if (*news != RVE_FARM_PLANNED) return BASE_OK;

  plan->valid = 0;
  TRY(rank_agree(farm->comm, reserve_points(plan, n), farm->rank));
  order_points(farm, n, tags);
  MPI_Alltoall(plan->send_count, 1, MPI_INT, plan->receive_count, 1, MPI_INT, farm->comm);
  BaseStatus status = block_starts(farm->ranks, plan->receive_count, plan->receive_start, &plan->requests);
  if (status == BASE_OK) status = reserve_requests(plan, plan->requests);
  TRY(rank_agree(farm->comm, status, farm->rank));
  MPI_Alltoallv(plan->sent_tag, plan->send_count, plan->send_start, MPI_INT64_T, plan->request_tag,
                plan->receive_count, plan->receive_start, MPI_INT64_T, farm->comm);
  TRY(rank_agree(farm->comm, look_up_requests(farm), farm->rank));
  plan->valid = 1;
  return BASE_OK;
}

void rve_farm_drop_plan(RveFarm *farm) { farm->plan.valid = 0; }

int rve_farm_requests(const RveFarm *farm, const int64_t **tags, const int **handles) {
  *tags = farm->plan.request_tag;
  *handles = farm->plan.request_handle;
  return farm->plan.requests;
}

void rve_farm_send(RveFarm *farm, int width, const double *of_points, double *of_requests) {
  const Plan *plan = &farm->plan;
  const size_t w = (size_t)width;
  MPI_Datatype item;
  for (int p = 0; p < plan->points; p++)
    memcpy(plan->buffer + w * (size_t)plan->position[p], of_points + w * (size_t)p, w * sizeof *of_points);
  MPI_Type_contiguous(width, MPI_DOUBLE, &item);
  MPI_Type_commit(&item);
  MPI_Alltoallv(plan->buffer, plan->send_count, plan->send_start, item, of_requests, plan->receive_count,
                plan->receive_start, item, farm->comm);
  MPI_Type_free(&item);
}

void rve_farm_reply(RveFarm *farm, int width, const double *of_requests, double *of_points) {
  const Plan *plan = &farm->plan;
  const size_t w = (size_t)width;
  MPI_Datatype item;
  MPI_Type_contiguous(width, MPI_DOUBLE, &item);
  MPI_Type_commit(&item);
  MPI_Alltoallv(of_requests, plan->receive_count, plan->receive_start, item, plan->buffer, plan->send_count,
                plan->send_start, item, farm->comm);
  MPI_Type_free(&item);
  for (int p = 0; p < plan->points; p++)
    memcpy(of_points + w * (size_t)p, plan->buffer + w * (size_t)plan->position[p], w * sizeof *of_points);
}
