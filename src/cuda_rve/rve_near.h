/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The numbers in which contacts are computed ("near"): the kernels' own, or with RVE_MIXED FP32 on twice the lanes.
 *
 * Mixed precision keeps positions in fixed point and motion and sums in FP64, but for those over the few contacts of a grain.
 * Branches come from differences of positions and are carried along to 48 bits, so that what enters a contact has a relative error of
 * 6e-8 wherever the grains are. */
#ifndef DEMPM_RVE_NEAR_H
#define DEMPM_RVE_NEAR_H

#include "rve_rows.h"
#include "rve_state.h"

#ifndef RVE_MIXED

typedef rve_real rve_near;
typedef rve_int near_image;
typedef rve_mask near_mask;
#define near_set rve_set
#define near_load rve_load
#define near_store rve_store
#define near_load_image rve_load_short
#define near_store_image rve_store_short
#define near_image_any(image, bits) rve_int_any_bit(image, rve_set_int(bits))
#define near_image_clear(mask, image, bits) rve_int_clear(mask, image, rve_set_int(bits))
#define near_sqrt rve_sqrt
#define near_fma rve_fma
#define near_fms rve_fms
#define near_fnma rve_fnma
#define near_inverse_sqrt rve_inverse_sqrt
#define near_min rve_min
#define near_abs rve_abs
#define near_limit rve_limit
#define near_less rve_less
#define near_and rve_and
#define near_or rve_or
#define near_and_not rve_and_not
#define near_any rve_any
#define near_largest rve_largest
#define near_select rve_select
#define near_keep rve_keep
#define near_sum_wide(a) (a)
#define NearQuad RveQuad
#define near_gather rve_gather
#define near_pick rve_pick
#if RVE_CARRIES
/* Writes four fields of the rows of a span. */
RVE_FN void near_scatter(double *rows, int stride, RveQuad q) {
  double *const none[4] = {0, 0, 0, 0};
  rve_scatter(rows, stride, none, 0, q);
}
#endif
#define NearFour RveFour
#define NearTwo RveTwo
#define near_four rve_four
#define near_two rve_two
#define near_four_add rve_four_add
#define near_two_add rve_two_add
#define near_transpose rve_transpose
#define near_unpair rve_unpair

#else /* 16 lanes of FP32 beside 8 of FP64 */

typedef __m512 rve_near;
typedef __m256i near_image; /* 16 uint16 */
typedef __mmask16 near_mask;

RVE_FN rve_near near_set(double a) { return _mm512_set1_ps((float)a); }
RVE_FN rve_near near_join(__m256 low, __m256 high) {
  return _mm512_insertf32x8(_mm512_castps256_ps512(low), high, 1);
}
RVE_FN rve_near near_load(const double *a, int lane0) {
  return near_join(_mm512_cvtpd_ps(rve_load(a, lane0)), _mm512_cvtpd_ps(rve_load(a, lane0 + 8)));
}
RVE_FN rve_real near_half(rve_near a, int half) {
  return _mm512_cvtps_pd(half ? _mm512_extractf32x8_ps(a, 1) : _mm512_castps512_ps256(a));
}
RVE_FN void near_store(double *a, int lane0, rve_near b) {
  rve_store(a, lane0, near_half(b, 0));
  rve_store(a, lane0 + 8, near_half(b, 1));
}
RVE_FN near_image near_load_image(const uint16_t *a, int lane0) {
  return _mm256_load_si256((const __m256i *)(const void *)(a + lane0));
}
RVE_FN void near_store_image(uint16_t *a, int lane0, near_image b) {
  _mm256_store_si256((__m256i *)(void *)(a + lane0), b);
}
RVE_FN near_mask near_image_any(near_image a, int bits) {
  return _mm256_test_epi16_mask(a, _mm256_set1_epi16((short)bits));
}
RVE_FN near_image near_image_clear(near_mask m, near_image a, int bits) {
  return _mm256_mask_mov_epi16(a, m, _mm256_andnot_si256(_mm256_set1_epi16((short)bits), a));
}
RVE_FN rve_near near_sqrt(rve_near a) { return _mm512_sqrt_ps(a); }
RVE_FN rve_near near_fma(rve_near a, rve_near b, rve_near c) { return _mm512_fmadd_ps(a, b, c); }
RVE_FN rve_near near_fms(rve_near a, rve_near b, rve_near c) { return _mm512_fmsub_ps(a, b, c); }
RVE_FN rve_near near_fnma(rve_near a, rve_near b, rve_near c) { return _mm512_fnmadd_ps(a, b, c); }
RVE_FN rve_near near_inverse_sqrt(rve_near a) {
  const rve_near y = _mm512_rsqrt14_ps(a);
  return y * (near_set(1.5) - near_set(0.5) * a * y * y);
}
RVE_FN rve_near near_min(rve_near a, rve_near b) { return _mm512_min_ps(a, b); }
RVE_FN rve_near near_abs(rve_near a) { return _mm512_abs_ps(a); }
RVE_FN rve_near near_limit(rve_near a, rve_near most) { return _mm512_range_ps(a, most, 2); }
RVE_FN near_mask near_less(rve_near a, rve_near b) { return _mm512_cmp_ps_mask(a, b, _CMP_LT_OQ); }
RVE_FN near_mask near_and(near_mask a, near_mask b) { return (near_mask)(a & b); }
RVE_FN near_mask near_or(near_mask a, near_mask b) { return (near_mask)(a | b); }
RVE_FN near_mask near_and_not(near_mask a, near_mask b) { return (near_mask)(a & ~b); }
RVE_FN int near_any(near_mask a) { return a != 0; }
RVE_FN double near_largest(rve_near a) { return (double)_mm512_reduce_max_ps(a); }
RVE_FN rve_near near_select(near_mask m, rve_near a, rve_near b) { return _mm512_mask_blend_ps(m, b, a); }
RVE_FN rve_near near_keep(near_mask m, rve_near a) { return _mm512_maskz_mov_ps(m, a); }
/* Both halves of a sum in FP64, on the lanes of one. */
RVE_FN rve_real near_sum_wide(rve_near a) { return near_half(a, 0) + near_half(a, 1); }

/* Four FP32 fields of one row. */
RVE_FN __m128 near_row(const double *at) { return _mm_castpd_ps(_mm_load_pd(at)); }

/* The image shifts of eight slots. */
RVE_FN rve_int near_image_half(near_image image, int half) {
  return _mm512_cvtepu16_epi64(half ? _mm256_extracti128_si256(image, 1) : _mm256_castsi256_si128(image));
}

/* An FP64 number as the sum of two in FP32, to 48 bits. */
RVE_FN void near_split(rve_real low, rve_real high, rve_near *first, rve_near *rest) {
  const __m256 l = _mm512_cvtpd_ps(low), h = _mm512_cvtpd_ps(high);
  *first = near_join(l, h);
  *rest = near_join(_mm512_cvtpd_ps(low - _mm512_cvtps_pd(l)), _mm512_cvtpd_ps(high - _mm512_cvtps_pd(h)));
}
/* Such sums where 16 FP64 numbers have room. */
RVE_FN void near_load_sum(const double *a, int lane0, rve_near *first, rve_near *rest) {
  *first = _mm512_load_ps(a + lane0), *rest = _mm512_load_ps(a + lane0 + 8);
}
RVE_FN void near_store_sum(double *a, int lane0, rve_near first, rve_near rest) {
  _mm512_store_ps(a + lane0, first), _mm512_store_ps(a + lane0 + 8, rest);
}

typedef struct NearQuad {
  rve_near f[4];
} NearQuad;
/* Four FP32 fields of the grains that `offset` names, in doubles, one per lane. */
RVE_FN NearQuad near_gather(const double *rows, const uint32_t *offset, int lane0) {
  NearQuad q;
  rve_near row[4]; /* 128-bit lane q of row[k] is that of slot 4 q + k */
  offset += lane0;
  for (int k = 0; k < 4; k++) {
    row[k] = _mm512_castps128_ps512(near_row(rows + offset[k]));
    row[k] = _mm512_insertf32x4(row[k], near_row(rows + offset[4 + k]), 1);
    row[k] = _mm512_insertf32x4(row[k], near_row(rows + offset[8 + k]), 2);
    row[k] = _mm512_insertf32x4(row[k], near_row(rows + offset[12 + k]), 3);
  }
  const rve_real a = _mm512_castps_pd(_mm512_unpacklo_ps(row[0], row[1]));
  const rve_real b = _mm512_castps_pd(_mm512_unpackhi_ps(row[0], row[1]));
  const rve_real c = _mm512_castps_pd(_mm512_unpacklo_ps(row[2], row[3]));
  const rve_real d = _mm512_castps_pd(_mm512_unpackhi_ps(row[2], row[3]));
  q.f[0] = _mm512_castpd_ps(_mm512_unpacklo_pd(a, c)), q.f[1] = _mm512_castpd_ps(_mm512_unpackhi_pd(a, c));
  q.f[2] = _mm512_castpd_ps(_mm512_unpacklo_pd(b, d)), q.f[3] = _mm512_castpd_ps(_mm512_unpackhi_pd(b, d));
  return q;
}
RVE_FN rve_near near_pick(const double *field, const uint32_t *neighbour, int lane0, int row) {
  return near_join(_mm512_cvtpd_ps(rve_pick(field, neighbour, lane0, row)),
                   _mm512_cvtpd_ps(rve_pick(field, neighbour, lane0 + RVE_SPAN, row)));
}
/* Writes four fields of the rows of a span, as FP32. */
RVE_FN void near_scatter(double *rows, int stride, RveQuad q) {
  const __m256 a = _mm512_cvtpd_ps(q.f[0]), b = _mm512_cvtpd_ps(q.f[1]);
  const __m256 c = _mm512_cvtpd_ps(q.f[2]), d = _mm512_cvtpd_ps(q.f[3]);
  const __m256d ab0 = _mm256_castps_pd(_mm256_unpacklo_ps(a, b)), ab1 = _mm256_castps_pd(_mm256_unpackhi_ps(a, b));
  const __m256d cd0 = _mm256_castps_pd(_mm256_unpacklo_ps(c, d)), cd1 = _mm256_castps_pd(_mm256_unpackhi_ps(c, d));
  /* halves of row[k] are rows k and k + 4 */
  const __m256d row[4] = {_mm256_unpacklo_pd(ab0, cd0), _mm256_unpackhi_pd(ab0, cd0), _mm256_unpacklo_pd(ab1, cd1),
                          _mm256_unpackhi_pd(ab1, cd1)};
  for (int k = 0; k < 4; k++) {
    _mm_store_pd(rows + k * stride, _mm256_castpd256_pd128(row[k]));
    _mm_store_pd(rows + (4 + k) * stride, _mm256_extractf128_pd(row[k], 1));
  }
}
/* Writes four FP32 fields of a pack of slots where rve_place says. */
RVE_FN void near_scatter_placed(double *rows, int lane0, const rve_near field[4]) {
  const rve_real a = _mm512_castps_pd(_mm512_unpacklo_ps(field[0], field[1]));
  const rve_real b = _mm512_castps_pd(_mm512_unpackhi_ps(field[0], field[1]));
  const rve_real c = _mm512_castps_pd(_mm512_unpacklo_ps(field[2], field[3]));
  const rve_real d = _mm512_castps_pd(_mm512_unpackhi_ps(field[2], field[3]));
  /* 128-bit lane q of row[k] is row 4 q + k */
  const rve_real row[4] = {_mm512_unpacklo_pd(a, c), _mm512_unpackhi_pd(a, c), _mm512_unpacklo_pd(b, d),
                           _mm512_unpackhi_pd(b, d)};
  for (int k = 0; k < 4; k++) rve_store(rows, 2 * lane0 + 8 * k, row[k]);
}
/* The same for two fields. */
RVE_FN void near_scatter_pairs(double *rows, int lane0, rve_near a, rve_near b) {
  const __m512i first = _mm512_setr_epi32(0, 16, 4, 20, 8, 24, 12, 28, 1, 17, 5, 21, 9, 25, 13, 29);
  const __m512i second = _mm512_add_epi32(first, _mm512_set1_epi32(2));
  rve_store(rows, lane0, _mm512_castps_pd(_mm512_permutex2var_ps(a, first, b)));
  rve_store(rows, lane0 + 8, _mm512_castps_pd(_mm512_permutex2var_ps(a, second, b)));
}
/* Two FP32 fields of one row, behind which there is another; the sum of some; the first and the second fields of eight. */
typedef __m128 NearTwo;
RVE_FN NearTwo near_two(const double *at) { return _mm_castpd_ps(_mm_loadu_pd(at)); }
RVE_FN NearTwo near_two_add(NearTwo a, NearTwo b) { return _mm_add_ps(a, b); }
RVE_FN void near_unpair(const NearTwo pair[8], rve_real sum[2]) {
  __m128 half[2][2]; /* fields of pairs 0 to 3, 4 to 7 */
  for (int h = 0; h < 2; h++) {
    const __m128 even = _mm_unpacklo_ps(pair[4 * h], pair[4 * h + 1]), odd = _mm_unpacklo_ps(pair[4 * h + 2], pair[4 * h + 3]);
    half[0][h] = _mm_movelh_ps(even, odd), half[1][h] = _mm_movehl_ps(odd, even);
  }
  for (int k = 0; k < 2; k++) sum[k] = _mm512_cvtps_pd(_mm256_set_m128(half[k][1], half[k][0]));
}
/* The same for four. */
typedef __m128 NearFour;
RVE_FN NearFour near_four(const double *at) { return near_row(at); }
RVE_FN NearFour near_four_add(NearFour a, NearFour b) { return _mm_add_ps(a, b); }
RVE_FN RveQuad near_transpose(const NearFour row[8]) {
  RveQuad q;
  __m256 r[4];
  for (int k = 0; k < 4; k++) r[k] = _mm256_set_m128(row[4 + k], row[k]);
  const __m256d a = _mm256_castps_pd(_mm256_unpacklo_ps(r[0], r[1])), b = _mm256_castps_pd(_mm256_unpackhi_ps(r[0], r[1]));
  const __m256d c = _mm256_castps_pd(_mm256_unpacklo_ps(r[2], r[3])), d = _mm256_castps_pd(_mm256_unpackhi_ps(r[2], r[3]));
  q.f[0] = _mm512_cvtps_pd(_mm256_castpd_ps(_mm256_unpacklo_pd(a, c)));
  q.f[1] = _mm512_cvtps_pd(_mm256_castpd_ps(_mm256_unpackhi_pd(a, c)));
  q.f[2] = _mm512_cvtps_pd(_mm256_castpd_ps(_mm256_unpacklo_pd(b, d)));
  q.f[3] = _mm512_cvtps_pd(_mm256_castpd_ps(_mm256_unpackhi_pd(b, d)));
  return q;
}

#endif
#endif
