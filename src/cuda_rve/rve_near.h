/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The numbers in which contacts are computed ("near"): the kernels' own, or with RVE_MIXED FP32 on twice the lanes.
 *
 * Mixed precision keeps positions in fixed point and motion and all sums in FP64. Differences of positions are taken
 * before they become FP32, so that a branch has a relative error of 6e-8 wherever the grains are. */
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
#define near_four rve_four
#define near_two rve_two

#else /* 16 lanes of FP32 beside 8 of FP64 */

typedef __m512 rve_near;
typedef struct near_int {
  rve_int half[2];
} near_int;
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
RVE_FN near_int near_load_int(const int64_t *a, int lane0) {
  const near_int b = {{rve_load_int(a, lane0), rve_load_int(a, lane0 + 8)}};
  return b;
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

/* Two FP32 numbers share 8 bytes, the first in the low half. */
RVE_FN rve_real near_pair(rve_real a, rve_real b) {
  const rve_int low = _mm512_cvtepu32_epi64(_mm256_castps_si256(_mm512_cvtpd_ps(a)));
  const rve_int high = _mm512_cvtepu32_epi64(_mm256_castps_si256(_mm512_cvtpd_ps(b)));
  return rve_bits_from_int(_mm512_or_si512(low, _mm512_slli_epi64(high, 32)));
}
RVE_FN rve_real near_pair_part(rve_real pair, int second) {
  const rve_int bits = rve_int_from_bits(pair);
  return _mm512_cvtps_pd(_mm256_castsi256_ps(_mm512_cvtepi64_epi32(second ? _mm512_srli_epi64(bits, 32) : bits)));
}
/* One part of the pairs of 16 lanes. */
RVE_FN rve_near near_unpair(rve_real low, rve_real high, int second) {
  const __m512i first = _mm512_setr_epi32(0, 2, 4, 6, 8, 10, 12, 14, 16, 18, 20, 22, 24, 26, 28, 30);
  const __m512i pick = second ? _mm512_add_epi32(first, _mm512_set1_epi32(1)) : first;
  return _mm512_permutex2var_ps(_mm512_castpd_ps(low), pick, _mm512_castpd_ps(high));
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
/* Two FP32 fields of one row, as FP64; four. */
RVE_FN RveTwo near_two(const double *at) { return _mm_cvtps_pd(_mm_castpd_ps(_mm_load_sd(at))); }
RVE_FN RveFour near_four(const double *at) { return _mm256_cvtps_pd(_mm_castpd_ps(_mm_load_pd(at))); }

#endif
#endif
