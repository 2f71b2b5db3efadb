/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "rve_packing.h"

#include <limits.h>
#include <math.h>
#include <string.h>

#include "../base/tensor.h"
#include "rve_packing_pairs.h"

static const double deepest_overlap = 0.3; /* of the smaller radius: beyond it linear contacts mean nothing */

void rve_packing_destroy(RvePacking *packing) {
  if (!packing) return;
  base_free(packing->position);
  base_free(packing->radius);
  base_free(packing->velocity);
  base_free(packing->spin);
  base_free(packing->contact_pair);
  base_free(packing->contact_image);
  base_free(packing->contact_shear);
  *packing = (RvePacking){0};
}

static BaseStatus check_finite(const double *value, int rows, int columns, const char *what) {
  if (!value) return BASE_OK;
  for (int i = 0; i < rows; i++)
    for (int k = 0; k < columns; k++)
      if (!isfinite(value[(size_t)i * (size_t)columns + (size_t)k]))
        return base_error(BASE_ERROR_ARGUMENT, "packing: %s %d is not finite", what, i + 1);
  return BASE_OK;
}

static BaseStatus check_cell(const RvePacking *packing) {
  const double *h = packing->cell;
  TRY(check_finite(h, 1, 9, "the cell's entry set"));
  if (packing->dimension == 2 && (h[2] != 0.0 || h[5] != 0.0 || h[6] != 0.0 || h[7] != 0.0 || h[8] != 1.0))
    return base_error(BASE_ERROR_ARGUMENT,
                      "packing: in 2D the cell's third row and column must be those of the unit tensor");
  double edges = 1.0;
  for (int k = 0; k < 3; k++) edges *= sqrt(h[k] * h[k] + h[3 + k] * h[3 + k] + h[6 + k] * h[6 + k]);
  const double volume = tensor_determinant(h);
  if (!(volume > 1e-9 * edges) || !isfinite(1.0 / volume))
    return base_error(BASE_ERROR_ARGUMENT,
                      "packing: the cell is singular or left-handed: its determinant is %g, edges multiply to %g",
                      volume, edges);
  return BASE_OK;
}

static BaseStatus check_grains(const RvePacking *packing) {
  for (int i = 0; i < packing->grains; i++) {
    const double *s = packing->position + 3 * (size_t)i, r = packing->radius[i];
    if (!(r > 0.0) || !isfinite(r))
      return base_error(BASE_ERROR_ARGUMENT, "packing: grain %d has radius %g m; it must be positive", i + 1, r);
    for (int k = 0; k < 3; k++)
      if (!(s[k] >= -0.5 && s[k] < 0.5))
        return base_error(BASE_ERROR_ARGUMENT,
                          "packing: grain %d has fractional position %g; it must be in [-0.5, 0.5)", i + 1, s[k]);
    if (packing->dimension == 2 && s[2] != 0.0)
      return base_error(BASE_ERROR_ARGUMENT, "packing: grain %d has z = %g; a 2D packing has one layer at 0", i + 1,
                        s[2]);
  }
  TRY(check_finite(packing->velocity, packing->grains, 3, "the velocity of grain"));
  return check_finite(packing->spin, packing->grains, 3, "the spin of grain");
}

static BaseStatus check_contacts(const RvePacking *packing) {
  if (packing->contacts < 0) return base_error(BASE_ERROR_ARGUMENT, "packing: %d contacts", packing->contacts);
  if (packing->contacts == 0) return BASE_OK;
  if (!packing->contact_pair || !packing->contact_image || !packing->contact_shear)
    return base_error(BASE_ERROR_ARGUMENT, "packing: %d contacts without pairs, images or forces", packing->contacts);
  for (int c = 0; c < packing->contacts; c++) {
    const int *pair = packing->contact_pair + 2 * (size_t)c, *image = packing->contact_image + 3 * (size_t)c;
    if (pair[0] < 0 || pair[0] >= packing->grains || pair[1] < 0 || pair[1] >= packing->grains)
      return base_error(BASE_ERROR_ARGUMENT, "packing: contact %d joins grains %d and %d of %d", c + 1, pair[0],
                        pair[1], packing->grains);
    for (int k = 0; k < 3; k++)
      if (image[k] < -1000 || image[k] > 1000 || (k >= packing->dimension && image[k] != 0))
        return base_error(BASE_ERROR_ARGUMENT, "packing: contact %d has cell shift %d", c + 1, image[k]);
  }
  return check_finite(packing->contact_shear, packing->contacts, 3, "the tangential force of contact");
}

static BaseStatus refuse_deep(void *context, int i, int j, const int image[3], const double branch[3],
                              double distance) {
  const RvePacking *packing = context;
  (void)image, (void)branch;
  const double ri = packing->radius[i], rj = packing->radius[j], overlap = ri + rj - distance;
  if (overlap <= deepest_overlap * fmin(ri, rj)) return BASE_OK;
  return base_error(
      BASE_ERROR_ARGUMENT,
      "packing: grains %d and %d (radii %g and %g m) overlap by %g m; at most %g of the smaller radius is allowed",
      i + 1, j + 1, ri, rj, overlap, deepest_overlap);
}

static BaseStatus check_width(const RvePacking *packing) {
  if (packing->grains <= PACKING_CRYSTAL_GRAINS) return BASE_OK;
  const double width = 2.0 * packing_largest_radius(packing);
  double height[3];
  packing_heights(packing->cell, height);
  for (int k = 0; k < packing->dimension; k++)
    if (!(width <= 0.5 * height[k]))
      return base_error(BASE_ERROR_ARGUMENT,
                        "packing: the largest grain is %g m wide, more than half the cell's height of %g m along "
                        "direction %d: use more "
                        "grains%s",
                        width, height[k], k + 1, k == 2 ? " (one layer of spheres is read with dimension 2)" : "");
  return BASE_OK;
}

BaseStatus rve_packing_check(const RvePacking *packing) {
  if (!packing) return base_error(BASE_ERROR_ARGUMENT, "packing: NULL");
  if (packing->dimension != 2 && packing->dimension != 3)
    return base_error(BASE_ERROR_ARGUMENT, "packing: dimension %d; 2 or 3 is allowed", packing->dimension);
  if (packing->grains < 1 || !packing->position || !packing->radius)
    return base_error(BASE_ERROR_ARGUMENT, "packing: %d grains; at least 1 is needed", packing->grains);
  TRY(check_cell(packing));
  TRY(check_grains(packing));
  TRY(check_contacts(packing));
  TRY(check_width(packing));
  return packing_visit_pairs(packing, 0.0, refuse_deep, (void *)packing);
}

/* Copy number of a grain: its cell in the block, counted along x fastest. */
static int copy_index(const int at[3], const int copies[3]) { return (at[2] * copies[1] + at[1]) * copies[0] + at[0]; }

static void replicate_grains(const RvePacking *packing, const int copies[3], const int at[3], RvePacking *result) {
  const size_t n = (size_t)packing->grains, to = (size_t)copy_index(at, copies) * n;
  for (size_t i = 0; i < n; i++)
    for (int k = 0; k < packing->dimension; k++)
      result->position[3 * (to + i) + (size_t)k] =
          packing_wrap((packing->position[3 * i + (size_t)k] + 0.5 + at[k]) / copies[k] - 0.5);
  memcpy(result->radius + to, packing->radius, n * sizeof *result->radius);
  if (packing->velocity) memcpy(result->velocity + 3 * to, packing->velocity, 3 * n * sizeof *result->velocity);
  if (packing->spin) memcpy(result->spin + 3 * to, packing->spin, 3 * n * sizeof *result->spin);
}

static void replicate_contacts(const RvePacking *packing, const int copies[3], const int at[3], RvePacking *result) {
  const int n = packing->grains, here = copy_index(at, copies);
  for (int c = 0; c < packing->contacts; c++) {
    const size_t to = (size_t)here * (size_t)packing->contacts + (size_t)c;
    int cell[3];
    for (int k = 0; k < 3; k++) {
      const int far = at[k] + packing->contact_image[3 * (size_t)c + (size_t)k];
      const int shift = far >= 0 ? far / copies[k] : -((-far + copies[k] - 1) / copies[k]);
      cell[k] = far - shift * copies[k];
      result->contact_image[3 * to + (size_t)k] = shift;
      result->contact_shear[3 * to + (size_t)k] = packing->contact_shear[3 * (size_t)c + (size_t)k];
    }
    result->contact_pair[2 * to] = here * n + packing->contact_pair[2 * (size_t)c];
    result->contact_pair[2 * to + 1] = copy_index(cell, copies) * n + packing->contact_pair[2 * (size_t)c + 1];
  }
}

BaseStatus rve_packing_replicate(const RvePacking *packing, const int copies[3], RvePacking *result) {
  *result = (RvePacking){0};
  TRY(rve_packing_check(packing));
  int64_t cells = 1;
  for (int k = 0; k < 3; k++) {
    if (copies[k] < 1 || copies[k] > 10000 || (k >= packing->dimension && copies[k] != 1))
      return base_error(BASE_ERROR_ARGUMENT,
                        "packing: %d copies along direction %d; 1 to 10000 are allowed, 1 along z in 2D", copies[k],
                        k + 1);
    cells *= copies[k];
    if (cells * ((int64_t)packing->grains + packing->contacts) > INT_MAX / 128)
      return base_error(BASE_ERROR_ARGUMENT, "packing: %lld copies of %d grains are too many", (long long)cells,
                        packing->grains);
  }
  BaseStatus status;
  const size_t contacts = (size_t)cells * (size_t)packing->contacts;
  TRY(packing_create(packing->dimension, (int)cells * packing->grains, packing->velocity || packing->spin, result));
  TRY_GOTO(BASE_ALLOC(2 * contacts, &result->contact_pair), status, failed);
  TRY_GOTO(BASE_ALLOC(3 * contacts, &result->contact_image), status, failed);
  TRY_GOTO(BASE_ALLOC(3 * contacts, &result->contact_shear), status, failed);
  result->contacts = (int)contacts;
  for (int i = 0; i < 3; i++)
    for (int k = 0; k < 3; k++) result->cell[3 * i + k] = packing->cell[3 * i + k] * copies[k];
  int at[3];
  for (at[2] = 0; at[2] < copies[2]; at[2]++)
    for (at[1] = 0; at[1] < copies[1]; at[1]++)
      for (at[0] = 0; at[0] < copies[0]; at[0]++) {
        replicate_grains(packing, copies, at, result);
        replicate_contacts(packing, copies, at, result);
      }
  return BASE_OK;
failed:
  rve_packing_destroy(result);
  return status;
}

/* Primitive cells of nearest-neighbour distance 1, columns are cell vectors. */
static void primitive_cell(RveLattice lattice, double cell[9]) {
  const double h = sqrt(3.0) / 2.0, b = 1.0 / sqrt(3.0), f = sqrt(0.5);
  const double hexagonal[9] = {1, 0.5, 0, 0, h, 0, 0, 0, 1};
  const double bcc[9] = {-b, b, b, b, -b, b, b, b, -b};
  const double fcc[9] = {0, f, f, f, 0, f, f, f, 0};
  tensor_identity(cell);
  if (lattice == RVE_HEXAGONAL) memcpy(cell, hexagonal, sizeof hexagonal);
  if (lattice == RVE_BCC) memcpy(cell, bcc, sizeof bcc);
  if (lattice == RVE_FCC) memcpy(cell, fcc, sizeof fcc);
}

BaseStatus rve_packing_lattice(RveLattice lattice, double radius, double overlap, RvePacking *packing) {
  *packing = (RvePacking){0};
  if (lattice < RVE_SQUARE || lattice > RVE_FCC)
    return base_error(BASE_ERROR_ARGUMENT, "lattice %d is unknown", (int)lattice);
  if (!(radius > 0.0) || !isfinite(radius))
    return base_error(BASE_ERROR_ARGUMENT, "lattice: radius %g m; it must be positive", radius);
  if (!(overlap > -1.0 && overlap <= 0.5 * deepest_overlap))
    return base_error(BASE_ERROR_ARGUMENT,
                      "lattice: overlap %g; the branch length is 2 R (1 - overlap), -1 < overlap <= %g", overlap,
                      0.5 * deepest_overlap);
  const int dimension = lattice <= RVE_HEXAGONAL ? 2 : 3;
  TRY(packing_create(dimension, 1, 0, packing));
  primitive_cell(lattice, packing->cell);
  for (int i = 0; i < dimension; i++)
    for (int k = 0; k < dimension; k++) packing->cell[3 * i + k] *= 2.0 * radius * (1.0 - overlap);
  packing->radius[0] = radius;
  return BASE_OK;
}
