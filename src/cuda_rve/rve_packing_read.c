/* SPDX-License-Identifier: GPL-2.0-or-later */
#define _POSIX_C_SOURCE 200809L
#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>

#include "rve_packing_file.h"
#include "rve_packing_pairs.h"

static const int64_t largest_file = INT64_C(1) << 30; /* bytes; a packing of a million grains has about 1e8 */

/* The whole file; free with base_free(). Only regular files have a size to trust. */
static BaseStatus load(const char *name, char **bytes, size_t *size) {
  struct stat about;
  *bytes = NULL;
  FILE *file = fopen(name, "rb");
  if (!file) return base_error(BASE_ERROR_FILE, "cannot open packing file %s: %s", name, strerror(errno));
  BaseStatus status = BASE_OK;
  if (fstat(fileno(file), &about) != 0 || !S_ISREG(about.st_mode))
    status = base_error(BASE_ERROR_FILE, "packing file %s is not a regular file", name);
  else if (about.st_size == 0 || about.st_size > largest_file)
    status = base_error(BASE_ERROR_FORMAT, "packing file %s has %lld bytes; 1 to %lld are allowed", name,
                        (long long)about.st_size, (long long)largest_file);
  if (status == BASE_OK) {
    *size = (size_t)about.st_size;
    status = BASE_ALLOC(*size, bytes);
  }
  if (status == BASE_OK && fread(*bytes, 1, *size, file) != *size)
    status = base_error(BASE_ERROR_FILE, "cannot read packing file %s", name);
  fclose(file);
  if (status == BASE_OK) return BASE_OK;
  base_free(*bytes);
  *bytes = NULL;
  return status;
}

static BaseStatus check_box(const PackingFile *file, const PackingBox *box, int dimension) {
  for (int k = 0; k < dimension; k++)
    if (!isfinite(box->low[k]) || !isfinite(box->high[k]) || !(box->high[k] > box->low[k]))
      return base_error(BASE_ERROR_FORMAT, "packing file %s: the box goes from %g to %g along %c; need lo < hi",
                        file->name, box->low[k], box->high[k], 'x' + k);
  for (int k = 0; k < 3; k++)
    if (!isfinite(box->tilt[k]))
      return base_error(BASE_ERROR_FORMAT, "packing file %s: a tilt factor is not finite", file->name);
  for (int i = 0; i < box->grains; i++)
    for (int k = 0; k < 3; k++)
      if (!isfinite(box->position[3 * (size_t)i + (size_t)k]))
        return base_error(BASE_ERROR_FORMAT, "packing file %s: the position of grain %d is not finite", file->name,
                          i + 1);
  return BASE_OK;
}

/* Reading with dimension 2 drops z: the grains must lie in one layer, through the periodic z if it is one. */
static BaseStatus check_layer(const PackingFile *file, const PackingBox *box) {
  const double depth = box->high[2] - box->low[2];
  double smallest = INFINITY;
  for (int i = 0; i < box->grains; i++) smallest = fmin(smallest, box->radius[i]);
  for (int i = 1; i < box->grains; i++) {
    double distance = box->position[3 * (size_t)i + 2] - box->position[2];
    if (depth > 0.0 && isfinite(depth)) distance -= depth * rint(distance / depth);
    if (fabs(distance) > smallest)
      return base_error(BASE_ERROR_FORMAT,
                        "packing file %s: grains are not in one layer (z differs by %g m, smallest radius %g m); read "
                        "it with dimension 3",
                        file->name, distance, smallest);
  }
  return BASE_OK;
}

/* Fractional position of x in the box's edges (lx,0,0), (xy,ly,0), (xz,yz,lz), the box's middle at 0. */
static void fractional(const PackingBox *box, int dimension, const double x[3], double s[3]) {
  double edge[3], from_low[3];
  for (int k = 0; k < 3; k++) edge[k] = box->high[k] - box->low[k], from_low[k] = x[k] - box->low[k];
  const double c = dimension == 3 ? from_low[2] / edge[2] : 0.0;
  const double b = (from_low[1] - (dimension == 3 ? box->tilt[2] * c : 0.0)) / edge[1];
  const double a = (from_low[0] - box->tilt[0] * b - (dimension == 3 ? box->tilt[1] * c : 0.0)) / edge[0];
  s[0] = packing_wrap(a - 0.5);
  s[1] = packing_wrap(b - 0.5);
  s[2] = dimension == 3 ? packing_wrap(c - 0.5) : 0.0;
}

/* A drift of the whole packing would count as kinetic stress: the mean velocity (by R^dimension, as the masses) goes.
 */
static void copy_motion(const PackingBox *box, const int *order, RvePacking *packing) {
  const int dimension = packing->dimension;
  double sum[3] = {0, 0, 0}, weights = 0.0;
  for (int i = 0; i < packing->grains; i++) {
    const double weight = pow(packing->radius[i], dimension);
    weights += weight;
    for (int k = 0; k < dimension; k++) sum[k] += weight * box->velocity[3 * (size_t)order[i] + (size_t)k];
  }
  for (int i = 0; i < packing->grains; i++)
    for (int k = 0; k < 3; k++) {
      const size_t from = 3 * (size_t)order[i] + (size_t)k, to = 3 * (size_t)i + (size_t)k;
      packing->velocity[to] = k < dimension ? box->velocity[from] - sum[k] / weights : 0.0;
      packing->spin[to] = dimension == 3 || k == 2 ? box->spin[from] : 0.0;
    }
}

/* Nearest image of a pair that overlaps; grains a restart calls partners. */
static int touch(const RvePacking *packing, int i, int j, int image[3]) {
  const double *si = packing->position + 3 * (size_t)i, *sj = packing->position + 3 * (size_t)j, *h = packing->cell;
  double s[3], distance2 = 0.0;
  for (int k = 0; k < 3; k++) {
    const double shift = -rint(sj[k] - si[k]);
    image[k] = (int)shift;
    s[k] = sj[k] - si[k] + shift;
  }
  for (int k = 0; k < packing->dimension; k++) {
    const double b = h[3 * k] * s[0] + h[3 * k + 1] * s[1] + h[3 * k + 2] * s[2];
    distance2 += b * b;
  }
  return sqrt(distance2) < packing->radius[i] + packing->radius[j];
}

/* LIGGGHTS notes each contact with both grains, with opposite signs: the one of the lower index is taken. */
static BaseStatus copy_history(const PackingBox *box, const int *order, double stiffness, RvePacking *packing) {
  int *rank = NULL;
  BaseStatus status;
  TRY_GOTO(BASE_ALLOC((size_t)box->grains, &rank), status, done);
  TRY_GOTO(BASE_ALLOC(2 * (size_t)box->histories, &packing->contact_pair), status, done);
  TRY_GOTO(BASE_ALLOC(3 * (size_t)box->histories, &packing->contact_image), status, done);
  TRY_GOTO(BASE_ALLOC(3 * (size_t)box->histories, &packing->contact_shear), status, done);
  for (int i = 0; i < box->grains; i++) rank[order[i]] = i;
  for (int k = 0; k < box->histories; k++) {
    const PackingHistory *history = box->history + k;
    const int partner = packing_find_id(box, order, history->partner), i = rank[history->owner];
    const int j = partner >= 0 ? rank[partner] : -1;
    const size_t c = (size_t)packing->contacts;
    if (j <= i || !touch(packing, i, j, packing->contact_image + 3 * c)) continue;
    packing->contact_pair[2 * c] = i, packing->contact_pair[2 * c + 1] = j;
    for (int d = 0; d < packing->dimension; d++)
      packing->contact_shear[3 * c + (size_t)d] = -stiffness * history->displacement[d];
    packing->contacts++;
  }
done:
  base_free(rank);
  return status;
}

BaseStatus packing_from_box(const PackingFile *file, PackingBox *box, int dimension, double tangential_stiffness,
                            RvePacking *packing) {
  int *order = NULL;
  BaseStatus status;
  TRY(check_box(file, box, dimension));
  if (dimension == 2) TRY(check_layer(file, box));
  if (box->id) TRY(packing_sort_ids(file, box, &order));
  else {
    TRY(BASE_ALLOC((size_t)box->grains, &order));
    for (int i = 0; i < box->grains; i++) order[i] = i;
  }
  TRY_GOTO(packing_create(dimension, box->grains, box->velocity != NULL, packing), status, done);
  for (int k = 0; k < dimension; k++) packing->cell[4 * k] = box->high[k] - box->low[k];
  packing->cell[1] = box->tilt[0];
  if (dimension == 3) packing->cell[2] = box->tilt[1], packing->cell[5] = box->tilt[2];
  for (int i = 0; i < packing->grains; i++) {
    fractional(box, dimension, box->position + 3 * (size_t)order[i], packing->position + 3 * (size_t)i);
    packing->radius[i] = box->radius[order[i]];
  }
  if (box->velocity) copy_motion(box, order, packing);
  if (box->histories > 0 && box->id && tangential_stiffness > 0.0)
    status = copy_history(box, order, tangential_stiffness, packing);
done:
  base_free(order);
  return status;
}

static BaseStatus read_liggghts(const PackingFile *file, int dimension, double tangential_stiffness,
                                RvePacking *packing) {
  PackingBox box = {0};
  BaseStatus status;
  if (packing_is_dump(file)) status = packing_read_dump(file, dimension, &box);
  else if (packing_is_restart(file)) status = packing_read_restart(file, dimension, &box);
  else status = packing_read_data(file, dimension, &box);
  if (status == BASE_OK) status = packing_from_box(file, &box, dimension, tangential_stiffness, packing);
  packing_box_destroy(&box);
  return status;
}

static BaseStatus read_any(const PackingFile *file, int dimension, double tangential_stiffness, RvePacking *packing) {
  static const unsigned char gzip[2] = {0x1f, 0x8b};
  if (file->size >= 2 && memcmp(file->bytes, gzip, 2) == 0)
    return base_error(BASE_ERROR_FORMAT, "packing file %s is compressed; unpack it with gunzip", file->name);
  if (packing_is_text(file)) {
    TRY(packing_read_text(file, packing));
    if (packing->dimension != dimension)
      return base_error(BASE_ERROR_FORMAT, "packing file %s holds a packing of dimension %d; need dimension %d",
                        file->name, packing->dimension, dimension);
  } else TRY(read_liggghts(file, dimension, tangential_stiffness, packing));
  if (rve_packing_check(packing) != BASE_OK)
    return base_error_context(BASE_ERROR_FORMAT, "packing file %s: ", file->name);
  return BASE_OK;
}

static BaseStatus check_dimension(const PackingFile *file, int dimension) {
  if (dimension == 2 || dimension == 3) return BASE_OK;
  return base_error(BASE_ERROR_ARGUMENT, "packing file %s: dimension %d; 2 or 3 is allowed", file->name, dimension);
}

BaseStatus packing_read_bytes(const PackingFile *file, int dimension, double tangential_stiffness,
                              RvePacking *packing) {
  *packing = (RvePacking){0};
  TRY(check_dimension(file, dimension));
  const BaseStatus status = read_any(file, dimension, tangential_stiffness, packing);
  if (status != BASE_OK) rve_packing_destroy(packing);
  return status;
}

BaseStatus rve_packing_read_history(const char *name, int dimension, double tangential_stiffness, RvePacking *packing) {
  char *bytes = NULL;
  PackingFile file = {.name = name};
  *packing = (RvePacking){0};
  TRY(check_dimension(&file, dimension));
  TRY(load(name, &bytes, &file.size));
  file.bytes = bytes;
  const BaseStatus status = packing_read_bytes(&file, dimension, tangential_stiffness, packing);
  base_free(bytes);
  return status;
}

BaseStatus rve_packing_read(const char *name, int dimension, RvePacking *packing) {
  return rve_packing_read_history(name, dimension, 0.0, packing);
}
