/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Copies of foreign points over MPI. Whom to send what follows from bounding boxes alone, anew at every begin(): points
 * move, and ranks may own any set of them. */
#include <math.h>

#include "../mpm/mpm.h"
#include "rank_agree.h"
#include "rve_law.h"

typedef struct PointHalo {
  MPI_Comm comm;
  int rank, ranks, dimension;
  double period[3];
  MPI_Datatype point_type;
  double *box;        /* [ranks][6] low and high corner of each rank's points, m; low > high without points */
  int *send_count;    /* [ranks] points */
  int *send_start;    /* [ranks] */
  int *receive_count; /* [ranks] */
  int *receive_start; /* [ranks] */
  int sends, receives;
  int send_room, receive_room;
  int *send_index;      /* [sends] index of own point, by destination, then shift, then own order */
  MpmPoint *send_point; /* [sends]; forward() uses the same memory for its values */
  MpmPoint *received;   /* [receives] by source rank, then that rank's send order */
} PointHalo;

static BaseStatus reserve(int needed, int *room, MpmPoint **points, int **index) {
  if (needed <= *room) return BASE_OK;
  const size_t wanted = (size_t)needed + (size_t)needed / 2;
  const size_t larger = wanted < INT32_MAX ? wanted : INT32_MAX;
  const size_t kept = (size_t)*room;
  /* Room for the points last: *room counts only what both arrays have. */
  if (index) TRY(BASE_GROW(kept, larger, index));
  TRY(BASE_GROW(kept, larger, points));
  *room = (int)larger;
  return BASE_OK;
}

/* Box of own points. NaN positions leave it alone (comparisons fail): such a point is sent to nobody, its owner
 * reports it. */
static void bounding_box(const MpmPoint *own, int own_count, int dimension, double box[6]) {
  for (int i = 0; i < 3; i++) box[i] = INFINITY, box[3 + i] = -INFINITY;
  for (int p = 0; p < own_count; p++)
    for (int i = 0; i < dimension; i++) {
      if (own[p].position[i] < box[i]) box[i] = own[p].position[i];
      if (own[p].position[i] > box[3 + i]) box[3 + i] = own[p].position[i];
    }
}

typedef struct Image {
  int destination;
  double shift[3]; /* m, added to own positions */
} Image;

/* The 3^periodic images of a rank's points that may interest `destination`, in a fixed order; without the identity
 * for the rank itself. Returns their number. */
static int list_images(const PointHalo *halo, int destination, Image image[27]) {
  int count = 0, reach[3];
  for (int i = 0; i < 3; i++) reach[i] = i < halo->dimension && halo->period[i] > 0.0;
  for (int c = -reach[2]; c <= reach[2]; c++)
    for (int b = -reach[1]; b <= reach[1]; b++)
      for (int a = -reach[0]; a <= reach[0]; a++) {
        if (destination == halo->rank && a == 0 && b == 0 && c == 0) continue;
        image[count++] =
            (Image){destination, {a * halo->period[0], b * halo->period[1], c * halo->period[2]}};
      }
  return count;
}

static int is_inside(const double position[3], const double shift[3], const double box[6], double reach,
                     int dimension) {
  for (int i = 0; i < dimension; i++) {
    const double x = position[i] + shift[i];
    if (!(x >= box[i] - reach && x <= box[3 + i] + reach)) return 0;
  }
  return 1;
}

/* Nothing of this rank's box can lie in the other's: most pairs of ranks and images end here. */
static int boxes_apart(const double own[6], const double shift[3], const double other[6], double reach, int dimension) {
  for (int i = 0; i < dimension; i++)
    if (!(own[i] + shift[i] <= other[3 + i] + reach && own[3 + i] + shift[i] >= other[i] - reach)) return 1;
  return 0;
}

/* Appends the points of one image to the send list. */
static BaseStatus select_points(PointHalo *halo, const Image *image, const MpmPoint *own, int own_count, double reach) {
  const double *box = halo->box + 6 * image->destination;
  if (boxes_apart(halo->box + 6 * halo->rank, image->shift, box, reach, halo->dimension)) return BASE_OK;
  for (int p = 0; p < own_count; p++) {
    if (!is_inside(own[p].position, image->shift, box, reach, halo->dimension)) continue;
    if (halo->sends == INT32_MAX) return base_error(BASE_ERROR_MEMORY, "more than %d halo points", INT32_MAX);
    TRY(reserve(halo->sends + 1, &halo->send_room, &halo->send_point, &halo->send_index));
    MpmPoint *copy = &halo->send_point[halo->sends];
    halo->send_index[halo->sends++] = p;
    *copy = own[p];
    for (int i = 0; i < 3; i++) copy->position[i] += image->shift[i];
  }
  return BASE_OK;
}

static BaseStatus select_all(PointHalo *halo, const MpmPoint *own, int own_count, double reach) {
  BaseStatus status = BASE_OK;
  halo->sends = 0;
  for (int r = 0; r < halo->ranks; r++) {
    Image image[27];
    const int images = list_images(halo, r, image);
    halo->send_start[r] = halo->sends;
    for (int k = 0; k < images && status == BASE_OK; k++)
      status = select_points(halo, &image[k], own, own_count, reach);
    halo->send_count[r] = halo->sends - halo->send_start[r];
  }
  return status;
}

/* Starts and total of the incoming points from their counts; room for them. */
static BaseStatus prepare_receives(PointHalo *halo) {
  int64_t total = 0;
  for (int r = 0; r < halo->ranks; r++) {
    halo->receive_start[r] = (int)total;
    total += halo->receive_count[r];
    if (total > INT32_MAX) return base_error(BASE_ERROR_MEMORY, "more than %d halo points", INT32_MAX);
  }
  halo->receives = (int)total;
  return reserve(halo->receives, &halo->receive_room, &halo->received, NULL);
}

static BaseStatus halo_begin(void *content, const MpmPoint *own, int own_count, double reach, const MpmPoint **foreign,
                             int *foreign_count) {
  PointHalo *halo = content;
  double box[6];
  bounding_box(own, own_count, halo->dimension, box);
  MPI_Allgather(box, 6, MPI_DOUBLE, halo->box, 6, MPI_DOUBLE, halo->comm);

  BaseStatus selected = select_all(halo, own, own_count, reach);
  MPI_Alltoall(halo->send_count, 1, MPI_INT, halo->receive_count, 1, MPI_INT, halo->comm);
  /* Two places where memory may be short, one agreement. */
  if (selected == BASE_OK) selected = prepare_receives(halo);
  TRY(rank_agree(halo->comm, selected, halo->rank));

  MPI_Alltoallv(halo->send_point, halo->send_count, halo->send_start, halo->point_type, halo->received,
                halo->receive_count, halo->receive_start, halo->point_type, halo->comm);
  *foreign = halo->received;
  *foreign_count = halo->receives;
  return BASE_OK;
}

static BaseStatus halo_forward(void *content, int width, const double *value, double *foreign_value) {
  PointHalo *halo = content;
  const int most = (int)(sizeof(MpmPoint) / sizeof(double));
  if (width < 1 || width > most)
    return base_error(BASE_ERROR_ARGUMENT, "%d values per halo point: 1 to %d are possible", width, most);
  double *packed = (double *)halo->send_point;
  for (int s = 0; s < halo->sends; s++)
    for (int k = 0; k < width; k++)
      packed[(size_t)s * width + k] = value[(size_t)halo->send_index[s] * width + k];

  MPI_Datatype values;
  MPI_Type_contiguous(width, MPI_DOUBLE, &values);
  MPI_Type_commit(&values);
  MPI_Alltoallv(packed, halo->send_count, halo->send_start, values, foreign_value, halo->receive_count,
                halo->receive_start, values, halo->comm);
  MPI_Type_free(&values);
  return BASE_OK;
}

static void halo_destroy(void *content) {
  PointHalo *halo = content;
  if (!halo) return;
  base_free(halo->box);
  base_free(halo->send_count);
  base_free(halo->send_start);
  base_free(halo->receive_count);
  base_free(halo->receive_start);
  base_free(halo->send_index);
  base_free(halo->send_point);
  base_free(halo->received);
  if (halo->point_type != MPI_DATATYPE_NULL) MPI_Type_free(&halo->point_type);
  if (halo->comm != MPI_COMM_NULL) MPI_Comm_free(&halo->comm);
  base_free(halo);
}

static BaseStatus check_arguments(int dimension, const double period[3]) {
  if (dimension != 2 && dimension != 3)
    return base_error(BASE_ERROR_ARGUMENT, "halo of points: dimension is %d, allowed are 2 and 3", dimension);
  for (int i = 0; i < 3; i++)
    if (!(period[i] >= 0.0 && isfinite(period[i])))
      return base_error(BASE_ERROR_ARGUMENT, "halo of points: period %d is %g, must be finite and >= 0", i, period[i]);
  return BASE_OK;
}

static BaseStatus allocate(PointHalo *halo) {
  const size_t ranks = (size_t)halo->ranks;
  TRY(BASE_ALLOC(6 * ranks, &halo->box));
  TRY(BASE_ALLOC(ranks, &halo->send_count));
  TRY(BASE_ALLOC(ranks, &halo->send_start));
  TRY(BASE_ALLOC(ranks, &halo->receive_count));
  return BASE_ALLOC(ranks, &halo->receive_start);
}

BaseStatus point_halo_create(MPI_Comm comm, int dimension, const double period[3], MpmHalo *result) {
  int rank;
  MPI_Comm_rank(comm, &rank);
  PointHalo *halo = NULL;
  BaseStatus status = check_arguments(dimension, period);
  if (status == BASE_OK) status = BASE_ALLOC(1, &halo);
  TRY_GOTO(rank_agree(comm, status, rank), status, fail);

  halo->rank = rank;
  halo->dimension = dimension;
  for (int i = 0; i < 3; i++) halo->period[i] = period[i];
  halo->point_type = MPI_DATATYPE_NULL;
  MPI_Comm_dup(comm, &halo->comm);
  MPI_Comm_size(comm, &halo->ranks);
  TRY_GOTO(rank_agree(comm, allocate(halo), rank), status, fail);
  MPI_Type_contiguous((int)sizeof(MpmPoint), MPI_BYTE, &halo->point_type);
  MPI_Type_commit(&halo->point_type);
  *result = (MpmHalo){halo, halo_begin, halo_forward, halo_destroy};
  return BASE_OK;

fail:
  if (halo && halo->ranks > 0) halo_destroy(halo);
  else base_free(halo);
  return status;
}
