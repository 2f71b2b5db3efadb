/* SPDX-License-Identifier: GPL-2.0-or-later */
/* What the ranks of an RveLaw bring together for output: totals, and the view of one RVE. */
#include <inttypes.h>
#include <stdlib.h>

#include "rank_agree.h"
#include "rve_law_private.h"

/* -- totals ---------------------------------------------------------------------------------------------------- */

/* One RVE's share of the sums, J of the material. */
typedef struct Share {
  int64_t tag;
  double friction, damping, stored;
} Share;

static int by_tag(const void *a, const void *b) {
  const int64_t left = ((const Share *)a)->tag, right = ((const Share *)b)->tag;
  return (left > right) - (left < right);
}

static int own_shares(const RveLaw *law, Share *share) {
  int n = 0;
  for (int h = rve_store_next(law->store, -1); h >= 0; h = rve_store_next(law->store, h)) {
    const RveStoreItem *item = rve_store_item(law->store, h);
    const RveAnswer *answer = &item->answer;
    share[n++] = (Share){item->tag, item->scale * answer->friction_work, item->scale * answer->damping_work,
                         item->scale * (answer->elastic_energy + answer->kinetic_energy)};
  }
  return n;
}

/* Sums in the order of tags, on rank 0: alike for any number of ranks. count, start: [ranks] on rank 0. */
static void sum_shares(const RveLaw *law, Share *own, Share *all, int *count, int *start, double sum[3]) {
  int n = own_shares(law, own), total = 0;
  MPI_Datatype item;
  MPI_Type_contiguous((int)sizeof(Share), MPI_BYTE, &item);
  MPI_Type_commit(&item);
  MPI_Gather(&n, 1, MPI_INT, count, 1, MPI_INT, 0, law->comm);
  for (int r = 0; r < law->ranks && law->rank == 0; r++) start[r] = total, total += count[r];
  MPI_Gatherv(own, n, item, all, count, start, item, 0, law->comm);
  MPI_Type_free(&item);
  if (total) qsort(all, (size_t)total, sizeof *all, by_tag);
  sum[0] = sum[1] = sum[2] = 0.0;
  for (int k = 0; k < total; k++) {
    sum[0] += all[k].friction;
    sum[1] += all[k].damping;
    sum[2] += all[k].stored;
  }
  MPI_Bcast(sum, 3, MPI_DOUBLE, 0, law->comm);
}

BaseStatus rve_law_totals(RveLaw *law, RveLawTotals *totals) {
  Share *own = NULL, *all = NULL;
  int *count = NULL, *start = NULL;
  const int64_t *tags;
  int *handles;
  const int on_root = law->rank == 0;
  BaseStatus status = BASE_ALLOC((size_t)rve_farm_own(law->farm, &tags, &handles), &own);
  if (status == BASE_OK) status = BASE_ALLOC(on_root ? (size_t)rve_farm_size(law->farm) : 0, &all);
  if (status == BASE_OK) status = BASE_ALLOC(on_root ? (size_t)law->ranks : 0, &count);
  if (status == BASE_OK) status = BASE_ALLOC(on_root ? (size_t)law->ranks : 0, &start);
  TRY_GOTO(rank_agree(law->comm, status, law->rank), status, done);

  double sum[3];
  sum_shares(law, own, all, count, start, sum);
  RveStoreTotals local;
  rve_store_totals(law->store, &local);
  int64_t counted[8] = {local.grains, local.particle_steps, law->rves_run, local.calls, local.shared, law->rested, local.solved,
                        local.kept};
  double largest[2] = {law->worst_unbalanced, local.seconds};
  MPI_Allreduce(MPI_IN_PLACE, counted, 8, MPI_INT64_T, MPI_SUM, law->comm);
  MPI_Allreduce(MPI_IN_PLACE, largest, 2, MPI_DOUBLE, MPI_MAX, law->comm);
  *totals = (RveLawTotals){.rves = rve_farm_size(law->farm), .grains = counted[0], .particle_steps = counted[1],
                           .rves_run = counted[2], .calls = counted[3], .shared = counted[4],
                           .rested = counted[5], .networks_solved = counted[6],
                           .networks_kept = counted[7], .worst_unbalanced = largest[0], .seconds = largest[1],
                           .friction_work = sum[0], .damping_work = sum[1], .stored_energy = sum[2]};
done:
  base_free(own);
  base_free(all);
  base_free(count);
  base_free(start);
  return status;
}

/* -- view ------------------------------------------------------------------------------------------------------ */

enum { VIEW_ARRAYS = 10, VIEW_MESSAGE = 1 };

typedef struct ViewArray {
  void **memory;
  size_t count, size;
} ViewArray;

static void list_arrays(RveView *view, ViewArray array[VIEW_ARRAYS]) {
  const size_t grains = (size_t)view->grains, contacts = (size_t)view->contacts;
  const ViewArray list[VIEW_ARRAYS] = {
      {(void **)&view->position, 3 * grains, sizeof(double)}, {(void **)&view->radius, grains, sizeof(double)},
      {(void **)&view->velocity, 3 * grains, sizeof(double)}, {(void **)&view->spin, 3 * grains, sizeof(double)},
      {(void **)&view->pair, 2 * contacts, sizeof(int)},      {(void **)&view->image, 3 * contacts, sizeof(int)},
      {(void **)&view->branch, 3 * contacts, sizeof(double)}, {(void **)&view->force_normal, contacts, sizeof(double)},
      {(void **)&view->force_shear, 3 * contacts, sizeof(double)}, {(void **)&view->bond, contacts, sizeof(int)}};
  for (int k = 0; k < VIEW_ARRAYS; k++) array[k] = list[k];
}

static BaseStatus allocate_arrays(RveView *view) {
  ViewArray array[VIEW_ARRAYS];
  list_arrays(view, array);
  for (int k = 0; k < VIEW_ARRAYS; k++) TRY(base_alloc(array[k].count, array[k].size, array[k].memory));
  return BASE_OK;
}

/* Sends a view from `owner`, where `view` is complete, to rank 0, where it is made. Frees it on the owner. */
static BaseStatus transfer_view(RveLaw *law, int owner, RveView *view) {
  struct {
    int grains, contacts;
    double cell[9];
  } head = {view->grains, view->contacts, {0}};
  BaseStatus status = BASE_OK;
  ViewArray array[VIEW_ARRAYS];
  for (int k = 0; k < 9; k++) head.cell[k] = view->cell[k];
  MPI_Bcast(&head, (int)sizeof head, MPI_BYTE, owner, law->comm);
  if (law->rank == 0) {
    view->grains = head.grains;
    view->contacts = head.contacts;
    for (int k = 0; k < 9; k++) view->cell[k] = head.cell[k];
    status = allocate_arrays(view);
  }
  status = rank_agree(law->comm, status, law->rank);
  list_arrays(view, array);
  for (int k = 0; k < VIEW_ARRAYS && status == BASE_OK; k++) {
    const int bytes = (int)(array[k].count * array[k].size);
    if (law->rank == owner) MPI_Send(*array[k].memory, bytes, MPI_BYTE, 0, VIEW_MESSAGE, law->comm);
    if (law->rank == 0)
      MPI_Recv(*array[k].memory, bytes, MPI_BYTE, owner, VIEW_MESSAGE, law->comm, MPI_STATUS_IGNORE);
  }
  if (law->rank == owner || status != BASE_OK) rve_view_destroy(view);
  return status;
}

BaseStatus rve_law_view(RveLaw *law, int64_t tag, RveView *view) {
  const int owner = rve_farm_owner(law->farm, tag); /* alike on all ranks */
  if (owner < 0) return base_error(BASE_ERROR_ARGUMENT, "no material point with an RVE has the tag %" PRId64, tag);
  RveView found = {0};
  BaseStatus status = BASE_OK;
  if (law->rank == owner) {
    const int handle = rve_farm_handle(law->farm, tag);
    if (handle >= 0) status = rve_store_view(law->store, handle, &found);
    else status = base_error(BASE_ERROR_ARGUMENT, "the RVE of material point %" PRId64 " was never created", tag);
  }
  TRY(rank_agree(law->comm, status, law->rank));
  if (owner != 0) TRY(transfer_view(law, owner, &found));
  if (law->rank == 0) *view = found;
  return BASE_OK;
}
