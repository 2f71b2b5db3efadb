/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "rve_packing_pairs.h"

#include <math.h>

#include "../base/tensor.h"

static const double pi = 3.14159265358979323846;
enum { IMAGE_RANGE = 8 };

BaseStatus packing_create(int dimension, int grains, int motion, RvePacking *packing) {
  *packing = (RvePacking){.dimension = dimension, .grains = grains};
  tensor_identity(packing->cell);
  const size_t n = (size_t)grains;
  BaseStatus status;
  TRY_GOTO(BASE_ALLOC(3 * n, &packing->position), status, failed);
  TRY_GOTO(BASE_ALLOC(n, &packing->radius), status, failed);
  if (motion) {
    TRY_GOTO(BASE_ALLOC(3 * n, &packing->velocity), status, failed);
    TRY_GOTO(BASE_ALLOC(3 * n, &packing->spin), status, failed);
  }
  return BASE_OK;
failed:
  rve_packing_destroy(packing);
  return status;
}

void packing_heights(const double cell[9], double height[3]) {
  double inverse[9];
  tensor_inverse(cell, inverse);
  for (int k = 0; k < 3; k++) {
    const double *row = inverse + 3 * k;
    height[k] = 1.0 / sqrt(row[0] * row[0] + row[1] * row[1] + row[2] * row[2]);
  }
}

double packing_cell_measure(const RvePacking *packing) { return tensor_determinant(packing->cell); }

double packing_grain_measure(const RvePacking *packing) {
  double sum = 0.0;
  for (int k = 0; k < packing->grains; k++) {
    const double r = packing->radius[k];
    sum += packing->dimension == 2 ? pi * r * r : 4.0 / 3.0 * pi * r * r * r;
  }
  return sum;
}

double packing_largest_radius(const RvePacking *packing) {
  double largest = 0.0;
  for (int k = 0; k < packing->grains; k++) largest = fmax(largest, packing->radius[k]);
  return largest;
}

double packing_wrap(double fraction) {
  fraction -= floor(fraction + 0.5);
  return fraction >= 0.5 ? -0.5 : fraction; /* floor's argument may round up to the next integer */
}

typedef struct PairSearch {
  const RvePacking *packing;
  double margin;
  PackingVisit visit;
  void *context;
  int bins[3]; /* along each cell vector */
  int *first;  /* [bins + 1] start of each bin's grains in `order` */
  int *order;  /* [grains] */
} PairSearch;

/* Visits the image of the pair whose fractional branch is s, if near enough. */
static BaseStatus visit_image(const PairSearch *search, int i, int j, const double s[3], const int image[3]) {
  const double *h = search->packing->cell, *radius = search->packing->radius;
  double branch[3];
  for (int k = 0; k < 3; k++) branch[k] = h[3 * k] * s[0] + h[3 * k + 1] * s[1] + h[3 * k + 2] * s[2];
  const double distance = sqrt(branch[0] * branch[0] + branch[1] * branch[1] + branch[2] * branch[2]);
  if (!(distance < radius[i] + radius[j] + search->margin)) return BASE_OK;
  return search->visit(search->context, i, j, image, branch, distance);
}

static BaseStatus visit_nearest(const PairSearch *search, int i, int j) {
  const double *si = search->packing->position + 3 * (size_t)i, *sj = search->packing->position + 3 * (size_t)j;
  double s[3];
  int image[3];
  for (int k = 0; k < 3; k++) {
    const double shift = -rint(sj[k] - si[k]);
    image[k] = (int)shift;
    s[k] = sj[k] - si[k] + shift;
  }
  return visit_image(search, i, j, s, image);
}

/* Few grains: every image within reach, and a grain's own images (one of each +/- pair). */
static BaseStatus visit_all_images(const PairSearch *search) {
  const RvePacking *packing = search->packing;
  const double reach = 2.0 * packing_largest_radius(packing) + search->margin;
  double height[3];
  int range[3] = {0, 0, 0};
  packing_heights(packing->cell, height);
  for (int k = 0; k < packing->dimension; k++) {
    if (!(reach / height[k] < IMAGE_RANGE - 1))
      return base_error(BASE_ERROR_ARGUMENT, "the cell is too flat: height %g m along direction %d, grains %g m wide",
                        height[k], k + 1, reach);
    range[k] = (int)(reach / height[k]) + 2;
  }
  for (int i = 0; i < packing->grains; i++)
    for (int j = i; j < packing->grains; j++)
      for (int a = -range[0]; a <= range[0]; a++)
        for (int b = -range[1]; b <= range[1]; b++)
          for (int c = -range[2]; c <= range[2]; c++) {
            if (i == j && (a < 0 || (a == 0 && b < 0) || (a == 0 && b == 0 && c <= 0))) continue;
            const int image[3] = {a, b, c};
            double s[3];
            for (int k = 0; k < 3; k++)
              s[k] = packing->position[3 * j + k] - packing->position[3 * i + k] + (double)image[k];
            TRY(visit_image(search, i, j, s, image));
          }
  return BASE_OK;
}

static void bin_of(const PairSearch *search, int grain, int bin[3]) {
  for (int k = 0; k < 3; k++) {
    const int n = search->bins[k];
    const int b = (int)((search->packing->position[3 * (size_t)grain + k] + 0.5) * n);
    bin[k] = b < 0 ? 0 : b >= n ? n - 1 : b;
  }
}

static size_t bin_index(const PairSearch *search, const int bin[3]) {
  return ((size_t)bin[2] * (size_t)search->bins[1] + (size_t)bin[1]) * (size_t)search->bins[0] + (size_t)bin[0];
}

static BaseStatus fill_bins(PairSearch *search) {
  const RvePacking *packing = search->packing;
  const double reach = 2.0 * packing_largest_radius(packing) + search->margin;
  const double most = ceil(pow(packing->grains, 1.0 / packing->dimension)) + 1.0;
  double height[3];
  packing_heights(packing->cell, height);
  size_t bins = 1;
  for (int k = 0; k < 3; k++) {
    search->bins[k] = k < packing->dimension ? (int)fmax(1.0, fmin(most, height[k] / reach)) : 1;
    bins *= (size_t)search->bins[k];
  }
  TRY(BASE_ALLOC(bins + 2, &search->first));
  TRY(BASE_ALLOC((size_t)packing->grains, &search->order));
  int bin[3];
  for (int i = 0; i < packing->grains; i++) bin_of(search, i, bin), search->first[bin_index(search, bin) + 2]++;
  for (size_t k = 2; k < bins + 2; k++) search->first[k] += search->first[k - 1];
  for (int i = 0; i < packing->grains; i++)
    bin_of(search, i, bin), search->order[search->first[bin_index(search, bin) + 1]++] = i;
  return BASE_OK;
}

/* The distinct neighbours of a bin along one direction, itself included: 1, 2 or 3 of them. */
static int neighbours_along(int bin, int bins, int neighbour[3]) {
  const int count = bins < 3 ? bins : 3;
  for (int k = 0; k < count; k++) neighbour[k] = bins < 3 ? k : (bin + k - 1 + bins) % bins;
  return count;
}

static BaseStatus visit_bins(const PairSearch *search) {
  for (int i = 0; i < search->packing->grains; i++) {
    int bin[3], near[3][3], count[3];
    bin_of(search, i, bin);
    for (int k = 0; k < 3; k++) count[k] = neighbours_along(bin[k], search->bins[k], near[k]);
    for (int c = 0; c < count[2]; c++)
      for (int b = 0; b < count[1]; b++)
        for (int a = 0; a < count[0]; a++) {
          const size_t other = bin_index(search, (const int[3]){near[0][a], near[1][b], near[2][c]});
          for (int k = search->first[other]; k < search->first[other + 1]; k++)
            if (search->order[k] > i) TRY(visit_nearest(search, i, search->order[k]));
        }
  }
  return BASE_OK;
}

/* Whether a pair may be near through more than its nearest image. */
static int is_narrow(const RvePacking *packing, double margin) {
  double height[3];
  packing_heights(packing->cell, height);
  for (int k = 0; k < packing->dimension; k++)
    if (height[k] < 2.0 * (2.0 * packing_largest_radius(packing) + margin)) return 1;
  return 0;
}

BaseStatus packing_visit_pairs(const RvePacking *packing, double margin, PackingVisit visit, void *context) {
  PairSearch search = {.packing = packing, .margin = margin, .visit = visit, .context = context};
  if (packing->grains <= PACKING_CRYSTAL_GRAINS || is_narrow(packing, margin)) return visit_all_images(&search);
  BaseStatus status;
  TRY_GOTO(fill_bins(&search), status, done);
  status = visit_bins(&search);
done:
  base_free(search.first);
  base_free(search.order);
  return status;
}
