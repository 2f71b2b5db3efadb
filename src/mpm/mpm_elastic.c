/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Thermo-elastic law, hypoelastic with the Jaumann rate (TM-DEMPM eq. 50-51 corrected). The old stress is turned by the
 * rotation of the step (Cayley form of the spin, so that it keeps its principal values), the increment C : (D - beta T'
 * I) dt is added. */
#include <math.h>
#include <string.h>

#include "../base/tensor.h"
#include "mpm_core.h"

typedef struct Elastic {
  MpmElastic given;
  /* sigma = lambda tr(e) I + 2 mu e - thermal dT I on the active components. */
  double lambda, mu; /* Pa */
  double thermal;    /* Pa/K */
} Elastic;

/* sigma <- R sigma R^T with R = (I - W/2)^-1 (I + W/2), W the spin times dt. Four points at once, one per lane, as in
 * all that follows. */
MPM_INLINE void rotate(const MpmVec spin[3], MpmVec stress[6]) {
  /* spin = (W_zy, W_xz, W_yx): the axial vector w with W a = w x a. R = I + 2/(1+q.q) (Q + Q Q), q = w/2. */
  const MpmVec x = 0.5 * spin[0], y = 0.5 * spin[1], z = 0.5 * spin[2];
  const MpmVec s = 2.0 / (1.0 + (x * x + y * y + z * z));
  const MpmVec r[9] = {1.0 - s * (y * y + z * z), s * (x * y - z), s * (x * z + y),
                       s * (x * y + z), 1.0 - s * (x * x + z * z), s * (y * z - x),
                       s * (x * z - y), s * (y * z + x), 1.0 - s * (x * x + y * y)};
  const MpmVec full[9] = {stress[TENSOR_XX], stress[TENSOR_XY], stress[TENSOR_XZ],
                          stress[TENSOR_XY], stress[TENSOR_YY], stress[TENSOR_YZ],
                          stress[TENSOR_XZ], stress[TENSOR_YZ], stress[TENSOR_ZZ]};
  MpmVec left[9];
#pragma GCC unroll 9
  for (int k = 0; k < 9; k++) {
    const MpmVec *a = r + 3 * (k / 3), *b = full + k % 3;
    left[k] = a[0] * b[0] + a[1] * b[3] + a[2] * b[6];
  }
#pragma GCC unroll 6
  for (int k = 0; k < 6; k++) {
    const int row = k < 3 ? k : k == 5 ? 1 : 0, column = k < 3 ? k : k == 3 ? 1 : 2;
    const MpmVec *a = left + 3 * row, *b = r + 3 * column;
    stress[k] = a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  }
}

/* D dt and the spin's axial vector times dt from L. */
MPM_INLINE void increments(const MpmVec *l, double dt, MpmVec strain[6], MpmVec spin[3]) {
  strain[TENSOR_XX] = dt * l[0], strain[TENSOR_YY] = dt * l[4], strain[TENSOR_ZZ] = dt * l[8];
  strain[TENSOR_XY] = 0.5 * dt * (l[1] + l[3]), strain[TENSOR_XZ] = 0.5 * dt * (l[2] + l[6]);
  strain[TENSOR_YZ] = 0.5 * dt * (l[5] + l[7]);
  spin[0] = 0.5 * dt * (l[7] - l[5]), spin[1] = 0.5 * dt * (l[2] - l[6]), spin[2] = 0.5 * dt * (l[3] - l[1]);
}

MPM_INLINE void update_stress(const Elastic *law, MpmElasticMode mode, const MpmVec *l, double dt, double heating,
                              MpmVec stress[6]) {
  MpmVec strain[6], spin[3];
  const MpmVec zero = mpm_vec_all(0.0);
  increments(l, dt, strain, spin);
  if (mode == MPM_ELASTIC_BAR) {
    stress[TENSOR_XX] += law->given.young * strain[TENSOR_XX] - law->thermal * heating;
#pragma GCC unroll 6
    for (int k = 1; k < 6; k++) stress[k] = zero;
    return;
  }
  const int is_plane_stress = mode == MPM_ELASTIC_PLANE_STRESS;
  rotate(spin, stress);
  const MpmVec trace = strain[TENSOR_XX] + strain[TENSOR_YY] + (is_plane_stress ? zero : strain[TENSOR_ZZ]);
  const MpmVec all = law->lambda * trace - law->thermal * heating;
#pragma GCC unroll 6
  for (int k = 0; k < 6; k++) stress[k] += k < 3 ? 2.0 * law->mu * strain[k] + all : 2.0 * law->mu * strain[k];
  if (is_plane_stress) stress[TENSOR_ZZ] = stress[TENSOR_XZ] = stress[TENSOR_YZ] = zero;
}

/* 1/2 sigma : C^-1 : sigma, J/m3. One form serves all modes: stress components that a mode frees are 0. */
static double energy_density(const MpmElastic *e, const double s[6]) {
  const double trace = s[0] + s[1] + s[2];
  const double square = s[0] * s[0] + s[1] * s[1] + s[2] * s[2] + 2.0 * (s[3] * s[3] + s[4] * s[4] + s[5] * s[5]);
  return ((1.0 + e->poisson) * square - e->poisson * trace * trace) / (2.0 * e->young);
}

static double wave_modulus(const Elastic *law) {
  return law->given.mode == MPM_ELASTIC_BAR ? law->given.young : law->lambda + 2.0 * law->mu;
}

/* The same in the plane, where xz and yz are 0 and stay so. */
MPM_INLINE void update_plane(const Elastic *law, const MpmVec l[9], double dt, MpmVec s[4]) {
  const MpmVec xx = dt * l[0], yy = dt * l[4], xy = 0.5 * dt * (l[1] + l[3]), q = 0.25 * dt * (l[3] - l[1]);
  const MpmVec twice = 2.0 / (1.0 + q * q), c = 1.0 - twice * (q * q), r = twice * q;
  const MpmVec left[4] = {c * s[0] - r * s[3], c * s[3] - r * s[1], r * s[0] + c * s[3], r * s[3] + c * s[1]};
  const MpmVec all = law->lambda * (xx + yy);
  const double mu = 2.0 * law->mu;
  s[0] = left[0] * c - left[1] * r + (mu * xx + all);
  s[1] = left[2] * r + left[3] * c + (mu * yy + all);
  s[2] = law->given.mode == MPM_ELASTIC_PLANE_STRESS ? mpm_vec_all(0.0) : s[2] + all;
  s[3] = left[0] * r + left[1] * c + mu * xy;
}

MPM_INLINE void advance_four(const Elastic *law, MpmElasticMode mode, const MpmLawRows *rows, int p, int is_plane,
                             int n) {
  MpmVec l[9], s[6];
#pragma GCC unroll 9
  for (int k = 0; k < 9; k++)
    l[k] = is_plane && !(k < 5 && k != 2) ? mpm_vec_all(0.0) : mpm_vec_load(rows->velocity_gradient[k] + p, n);
#pragma GCC unroll 6
  for (int k = 0; k < 6; k++) s[k] = mpm_vec_load(rows->stress[k] + p, n);
  if (is_plane && mode != MPM_ELASTIC_BAR) update_plane(law, l, rows->dt, s);
  else update_stress(law, mode, l, rows->dt, 0.0, s);
#pragma GCC unroll 6
  for (int k = 0; k < 6; k++)
    if (k < 4 || !is_plane || mode == MPM_ELASTIC_BAR) mpm_vec_store(s[k], rows->stress[k] + p, n);
}

MPM_INLINE void advance_mode(const Elastic *law, MpmElasticMode mode, const MpmLawRows *rows, int is_plane) {
  int p = 0;
  for (; p + 4 <= rows->n; p += 4) advance_four(law, mode, rows, p, is_plane, 4);
  if (p < rows->n) advance_four(law, mode, rows, p, is_plane, rows->n - p);
}

MPM_CLONES static void elastic_advance(const void *content, const MpmLawRows *rows) {
  const Elastic *law = content;
  const MpmElasticMode mode = law->given.mode;
  if (mode == MPM_ELASTIC_BAR) advance_mode(law, MPM_ELASTIC_BAR, rows, rows->dimension == 2);
  else if (rows->dimension == 2) advance_mode(law, MPM_ELASTIC_PLANE_STRAIN, rows, 1);
  else if (mode == MPM_ELASTIC_PLANE_STRESS) advance_mode(law, MPM_ELASTIC_PLANE_STRESS, rows, 0);
  else advance_mode(law, MPM_ELASTIC_3D, rows, 0);
}

static void elastic_describe(const void *content, const double stress[6], double *modulus,
                             double scalars[MPM_LAW_SCALARS]) {
  const Elastic *law = content;
  *modulus = wave_modulus(law);
  for (int k = 0; k < MPM_LAW_SCALARS; k++) scalars[k] = 0.0;
  scalars[MPM_LAW_ENERGY_DENSITY] = energy_density(&law->given, stress);
}

/* One point, in all lanes. */
static void update_point(const Elastic *law, const double l[9], double dt, double heating, double stress[6]) {
  MpmVec gradient[9], s[6];
  for (int k = 0; k < 9; k++) gradient[k] = mpm_vec_all(l[k]);
  for (int k = 0; k < 6; k++) s[k] = mpm_vec_all(stress[k]);
  update_stress(law, law->given.mode, gradient, dt, heating, s);
  for (int k = 0; k < 6; k++) stress[k] = s[k][0];
}

static BaseStatus elastic_update(void *content, MpmLawBatch *batch) {
  const Elastic *law = content;
  const int n = batch->n;
#pragma omp parallel for if (n > 4000)
  for (int p = 0; p < n; p++) {
    const double heating = law->given.thermal ? batch->temperature_rate[p] * batch->dt : 0.0;
    double *stress = batch->stress + 6 * (size_t)p, *scalars = batch->scalars + MPM_LAW_SCALARS * (size_t)p;
    if (batch->dt > 0.0) update_point(law, batch->velocity_gradient + 9 * (size_t)p, batch->dt, heating, stress);
    elastic_describe(law, stress, &batch->modulus[p], scalars);
    if (!law->given.thermal) continue;
    batch->heat[p] = 0.0;
    memcpy(batch->conductivity + 6 * (size_t)p, law->given.conductivity, sizeof law->given.conductivity);
  }
  return BASE_OK;
}

static BaseStatus check(const MpmElastic *e) {
  if ((int)e->mode < MPM_ELASTIC_3D || e->mode > MPM_ELASTIC_BAR)
    return base_error(BASE_ERROR_ARGUMENT, "elastic law: mode is %d; allowed: 0 to 3", (int)e->mode);
  if (!(e->young > 0.0 && isfinite(e->young)))
    return base_error(BASE_ERROR_ARGUMENT, "elastic law: young is %g; allowed: finite and > 0", e->young);
  if (e->mode == MPM_ELASTIC_BAR && e->poisson != 0.0)
    return base_error(BASE_ERROR_ARGUMENT, "elastic law: poisson is %g; a bar allows 0 only", e->poisson);
  if (!(e->poisson > -1.0 && e->poisson < 0.5))
    return base_error(BASE_ERROR_ARGUMENT, "elastic law: poisson is %g; allowed: > -1 and < 0.5", e->poisson);
  if (!(e->expansion >= 0.0 && isfinite(e->expansion)))
    return base_error(BASE_ERROR_ARGUMENT, "elastic law: expansion is %g; allowed: finite and >= 0", e->expansion);
  if (!e->thermal) return BASE_OK;
  const double *k = e->conductivity;
  for (int i = 0; i < 6; i++)
    if (!isfinite(k[i]))
      return base_error(BASE_ERROR_ARGUMENT, "elastic law: conductivity[%d] is %g; it must be finite", i, k[i]);
  /* Leading minors of a positive semi-definite tensor; heat must not flow from cold to hot. */
  const double full[9] = {k[0], k[3], k[4], k[3], k[1], k[5], k[4], k[5], k[2]};
  const double slack = -1e-12 * (fabs(k[0]) + fabs(k[1]) + fabs(k[2]));
  if (k[0] < 0.0 || k[1] < 0.0 || k[2] < 0.0 || k[0] * k[1] - k[3] * k[3] < slack * fabs(k[0] + k[1]) ||
      k[0] * k[2] - k[4] * k[4] < slack * fabs(k[0] + k[2]) || k[1] * k[2] - k[5] * k[5] < slack * fabs(k[1] + k[2]) ||
      tensor_determinant(full) < slack * (k[0] + k[1] + k[2]) * (k[0] + k[1] + k[2]))
    return base_error(BASE_ERROR_ARGUMENT,
                      "elastic law: conductivity (%g %g %g %g %g %g) has a negative principal value", k[0], k[1], k[2],
                      k[3], k[4], k[5]);
  return BASE_OK;
}

static void elastic_destroy(void *content) { base_free(content); }

BaseStatus mpm_elastic_create(const MpmElastic *elastic, MpmLaw *law) {
  TRY(check(elastic));
  Elastic *content;
  TRY(BASE_ALLOC(1, &content));
  const double young = elastic->young, poisson = elastic->poisson, beta = elastic->expansion;
  content->given = *elastic;
  content->mu = 0.5 * young / (1.0 + poisson);
  if (elastic->mode == MPM_ELASTIC_PLANE_STRESS) {
    content->lambda = young * poisson / (1.0 - poisson * poisson);
    content->thermal = young * beta / (1.0 - poisson);
  } else if (elastic->mode == MPM_ELASTIC_BAR) {
    content->thermal = young * beta;
  } else {
    content->lambda = young * poisson / ((1.0 + poisson) * (1.0 - 2.0 * poisson));
    content->thermal = young * beta / (1.0 - 2.0 * poisson);
  }
  *law = (MpmLaw){"elastic", content, elastic->thermal, elastic_update, elastic_destroy, elastic_advance,
                  elastic_describe};
  return BASE_OK;
}
