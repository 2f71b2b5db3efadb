/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Rows of four fields of a grain or a slot (array of structures), transposed into lanes and back; CUDA reads and writes
 * arrays instead, and so does plain code with grains.
 *
 * Loading rows and transposing them is faster than gathers where four fields are wanted, and they lie in one line of the cache. */
#ifndef DEMPM_RVE_ROWS_H
#define DEMPM_RVE_ROWS_H

#include "rve_team.h"

#ifdef RVE_KERNEL
#if defined(RVE_ISA_AVX512) || defined(RVE_ISA_AVX2)
typedef __m256d RveFour; /* four consecutive fields of a row */
typedef __m128d RveTwo;  /* two */
#else
typedef struct RveFour {
  double f[4];
} RveFour;
typedef struct RveTwo {
  double f[2];
} RveTwo;
#endif

/* RveCounts.row of these kernels. */
RVE_FN int rve_row_doubles(int dimension) { return RVE_CARRIES ? 4 / RVE_PARTS * (dimension - 1) : 0; }

typedef struct RveQuad {
  rve_real f[4];
} RveQuad;

#if defined(RVE_ISA_AVX512)
/* Of quarters a0 a1 a2 a3 and b0 b1 b2 b3: a0 b0 a2 b2, and a1 b1 a3 b3. A permutation of two registers (vpermt2pd)
 * would do the same, but on a Zen 4 keeps a multiplier busy besides a shuffle unit. */
RVE_FN rve_real rve_even_quarters(rve_real a, rve_real b) { return _mm512_mask_permutex_pd(a, 0xcc, b, 0x44); }
RVE_FN rve_real rve_odd_quarters(rve_real a, rve_real b) { return _mm512_mask_permutex_pd(b, 0x33, a, 0xee); }
RVE_FN RveQuad rve_transpose(const RveFour row[RVE_SPAN]) {
  RveQuad q;
  rve_real r[4];
  for (int k = 0; k < 4; k++) r[k] = _mm512_insertf64x4(_mm512_castpd256_pd512(row[k]), row[k + 4], 1);
  const rve_real a = _mm512_unpacklo_pd(r[0], r[1]), b = _mm512_unpackhi_pd(r[0], r[1]);
  const rve_real c = _mm512_unpacklo_pd(r[2], r[3]), d = _mm512_unpackhi_pd(r[2], r[3]);
  q.f[0] = rve_even_quarters(a, c);
  q.f[1] = rve_even_quarters(b, d);
  q.f[2] = rve_odd_quarters(a, c);
  q.f[3] = rve_odd_quarters(b, d);
  return q;
}
/* row[k]: rows k and k + 4. */
RVE_FN void rve_transpose_halves(RveQuad q, rve_real row[4]) {
  const rve_real a = _mm512_unpacklo_pd(q.f[0], q.f[1]), b = _mm512_unpackhi_pd(q.f[0], q.f[1]);
  const rve_real c = _mm512_unpacklo_pd(q.f[2], q.f[3]), d = _mm512_unpackhi_pd(q.f[2], q.f[3]);
  row[0] = rve_even_quarters(a, c), row[1] = rve_even_quarters(b, d);
  row[2] = rve_odd_quarters(a, c), row[3] = rve_odd_quarters(b, d);
}
RVE_FN void rve_transpose_back(RveQuad q, RveFour row[RVE_SPAN]) {
  rve_real r[4];
  rve_transpose_halves(q, r);
  for (int k = 0; k < 4; k++) row[k] = _mm512_castpd512_pd256(r[k]), row[k + 4] = _mm512_extractf64x4_pd(r[k], 1);
}
#elif defined(RVE_ISA_AVX2)
RVE_FN RveQuad rve_transpose(const RveFour row[RVE_SPAN]) {
  RveQuad q;
  const rve_real a = _mm256_unpacklo_pd(row[0], row[1]), b = _mm256_unpackhi_pd(row[0], row[1]);
  const rve_real c = _mm256_unpacklo_pd(row[2], row[3]), d = _mm256_unpackhi_pd(row[2], row[3]);
  q.f[0] = _mm256_permute2f128_pd(a, c, 0x20);
  q.f[1] = _mm256_permute2f128_pd(b, d, 0x20);
  q.f[2] = _mm256_permute2f128_pd(a, c, 0x31);
  q.f[3] = _mm256_permute2f128_pd(b, d, 0x31);
  return q;
}
RVE_FN void rve_transpose_back(RveQuad q, RveFour row[RVE_SPAN]) {
  const RveQuad t = rve_transpose(q.f);
  for (int k = 0; k < 4; k++) row[k] = t.f[k];
}
#endif

#if defined(RVE_ISA_AVX512) || defined(RVE_ISA_AVX2)
RVE_FN RveFour rve_four(const double *at) { return _mm256_load_pd(at); }
RVE_FN void rve_four_store(double *at, RveFour a) { _mm256_store_pd(at, a); }
RVE_FN RveFour rve_four_add(RveFour a, RveFour b) { return _mm256_add_pd(a, b); }
RVE_FN RveTwo rve_two(const double *at) { return _mm_load_pd(at); }
RVE_FN RveTwo rve_two_add(RveTwo a, RveTwo b) { return _mm_add_pd(a, b); }
#elif !defined(__CUDACC__)
RVE_FN RveFour rve_four(const double *at) {
  RveFour a;
  for (int k = 0; k < 4; k++) a.f[k] = at[k];
  return a;
}
RVE_FN void rve_four_store(double *at, RveFour a) {
  for (int k = 0; k < 4; k++) at[k] = a.f[k];
}
RVE_FN RveFour rve_four_add(RveFour a, RveFour b) {
  for (int k = 0; k < 4; k++) a.f[k] += b.f[k];
  return a;
}
RVE_FN RveTwo rve_two(const double *at) {
  const RveTwo a = {{at[0], at[1]}};
  return a;
}
RVE_FN RveTwo rve_two_add(RveTwo a, RveTwo b) {
  for (int k = 0; k < 2; k++) a.f[k] += b.f[k];
  return a;
}
RVE_FN void rve_unpair(const RveTwo pair[1], rve_real sum[2]) {
  for (int k = 0; k < 2; k++) sum[k] = pair[0].f[k];
}
RVE_FN RveQuad rve_transpose(const RveFour row[1]) {
  RveQuad q;
  for (int k = 0; k < 4; k++) q.f[k] = row[0].f[k];
  return q;
}
RVE_FN void rve_transpose_back(RveQuad q, RveFour row[1]) {
  for (int k = 0; k < 4; k++) row[0].f[k] = q.f[k];
}
#endif

#if !defined(__CUDACC__)
/* Four fields of the grains that `offset` names, in doubles, one per lane. */
RVE_FN RveQuad rve_gather(const double *rows, const uint32_t *offset, int lane0) {
  RveFour row[RVE_SPAN];
  offset += lane0;
  for (int l = 0; l < RVE_SPAN; l++) row[l] = rve_four(rows + offset[l]);
  return rve_transpose(row);
}
#endif

/* Writes four fields of RVE_PACK consecutive rows of `stride` doubles (or into four arrays). */
RVE_FN void rve_scatter(double *rows, int stride, double *const field[4], int lane0, RveQuad q) {
#if defined(__CUDACC__)
  (void)rows, (void)stride;
#pragma unroll
  for (int k = 0; k < 4; k++)
    if (field[k]) field[k][lane0 + RVE_LANE] = q.f[k];
#else
  RveFour row[RVE_SPAN];
  (void)field;
  rve_transpose_back(q, row);
  rows += (size_t)lane0 * (size_t)stride;
  for (int l = 0; l < RVE_SPAN; l++) rve_four_store(rows + l * stride, row[l]);
#endif
}

/* Writes four fields of a pack of slots where rve_place says (or into four arrays). */
RVE_FN void rve_scatter_placed(double *rows, double *const field[4], int lane0, RveQuad q) {
#if defined(RVE_ISA_AVX512)
  rve_real row[4];
  (void)field;
  rve_transpose_halves(q, row);
  rows += (size_t)lane0 * 4;
  for (int k = 0; k < 4; k++) rve_store(rows, 8 * k, row[k]);
#else
  rve_scatter(rows, 4, field, lane0, q);
#endif
}

/* Reads what rve_scatter_placed wrote. */
RVE_FN RveQuad rve_read_placed(const double *rows, const double *const field[4], int lane0) {
#if defined(__CUDACC__)
  RveQuad q;
  (void)rows;
#pragma unroll
  for (int k = 0; k < 4; k++) q.f[k] = field[k] ? field[k][lane0 + RVE_LANE] : 0.0;
  return q;
#else
  RveFour row[RVE_SPAN];
  (void)field;
  for (int l = 0; l < RVE_SPAN; l++) row[l] = rve_four(rows + (size_t)rve_place(RVE_PACK, lane0 + l) * 4);
  return rve_transpose(row);
#endif
}

/* The same for rows of two fields. */
RVE_FN void rve_scatter_pairs(double *rows, double *const field[2], int lane0, rve_real a, rve_real b) {
#if defined(__CUDACC__)
  (void)rows;
  field[0][lane0 + RVE_LANE] = a, field[1][lane0 + RVE_LANE] = b;
#elif defined(RVE_ISA_AVX512)
  (void)field;
  rows += (size_t)lane0 * 2;
  const rve_real even = _mm512_unpacklo_pd(a, b), odd = _mm512_unpackhi_pd(a, b);
  rve_store(rows, 0, _mm512_shuffle_f64x2(even, odd, 0x88));
  rve_store(rows, 8, _mm512_shuffle_f64x2(even, odd, 0xdd));
#elif defined(RVE_ISA_AVX2)
  const rve_real even = _mm256_unpacklo_pd(a, b), odd = _mm256_unpackhi_pd(a, b);
  (void)field;
  rve_store(rows, 2 * lane0, _mm256_permute2f128_pd(even, odd, 0x20));
  rve_store(rows, 2 * lane0 + 4, _mm256_permute2f128_pd(even, odd, 0x31));
#else
  (void)field;
  rows[2 * lane0] = a, rows[2 * lane0 + 1] = b;
#endif
}

#if defined(RVE_ISA_AVX512) || defined(RVE_ISA_AVX2)
/* The first and the second numbers of one pair per lane. */
RVE_FN void rve_unpair(const RveTwo pair[RVE_SPAN], rve_real sum[2]) {
#if defined(RVE_ISA_AVX512)
  rve_real half[2]; /* even and odd lanes */
  for (int k = 0; k < 2; k++)
    half[k] = _mm512_insertf64x4(_mm512_castpd256_pd512(_mm256_set_m128d(pair[2 + k], pair[k])),
                                 _mm256_set_m128d(pair[6 + k], pair[4 + k]), 1);
  sum[0] = _mm512_unpacklo_pd(half[0], half[1]), sum[1] = _mm512_unpackhi_pd(half[0], half[1]);
#else
  const rve_real even = _mm256_set_m128d(pair[2], pair[0]), odd = _mm256_set_m128d(pair[3], pair[1]);
  sum[0] = _mm256_unpacklo_pd(even, odd), sum[1] = _mm256_unpackhi_pd(even, odd);
#endif
}
#endif

/* The numbers of an array, one per lane, of the grains that RveArrays.neighbour names: by where their rows of `row` doubles begin (2, 4
 * or 8), or without rows, CUDA and plain code, by themselves (0). */
RVE_FN rve_real rve_pick(const double *field, const uint32_t *neighbour, int lane0, int row) {
#if defined(RVE_ISA_AVX512)
  const __m256i at = _mm256_load_si256((const __m256i *)(const void *)(neighbour + lane0));
  rve_real from = rve_set(0.0);
  rve_mask all = 0xff;
  /* All lanes are overwritten, but the processor waits for what they were: gcc 12 would take any register, last used for the row before. */
  __asm__("" : "+v"(from));
  __asm__("" : "+k"(all));
  return row == 8   ? _mm512_mask_i32gather_pd(from, all, at, field, 1)
         : row == 4 ? _mm512_mask_i32gather_pd(from, all, at, field, 2)
                    : _mm512_mask_i32gather_pd(from, all, at, field, 4);
#elif defined(RVE_ISA_AVX2)
  const __m128i at = _mm_load_si128((const __m128i *)(const void *)(neighbour + lane0));
  const rve_real from = rve_set(0.0), all = _mm256_castsi256_pd(_mm256_set1_epi64x(-1));
  return row == 8 ? _mm256_mask_i32gather_pd(from, field, at, all, 1) : _mm256_mask_i32gather_pd(from, field, at, all, 2);
#else
  rve_real a;
  memcpy(&a, field + neighbour[lane0 + RVE_LANE] / (uint32_t)(row > 0 ? row : 1), sizeof a);
  return a;
#endif
}

/* Until when the rows of slots rest that RveArrays.incoming names. */
RVE_FN rve_real rve_pick_idle(const double *idle_until, const uint32_t *incoming, int lane0) {
#if defined(RVE_ISA_AVX512)
  const __m256i at = _mm256_load_si256((const __m256i *)(const void *)(incoming + lane0));
  return _mm512_i32gather_pd(_mm256_srli_epi32(at, __builtin_ctz(RVE_PACK * RVE_REACTION)), idle_until, 8);
#elif defined(RVE_ISA_AVX2)
  const __m128i at = _mm_load_si128((const __m128i *)(const void *)(incoming + lane0));
  return _mm256_i32gather_pd(idle_until, _mm_srli_epi32(at, __builtin_ctz(RVE_PACK * RVE_REACTION)), 8);
#else
  return idle_until[incoming[lane0 + RVE_LANE] / (RVE_PACK * RVE_REACTION)];
#endif
}

#if defined(RVE_WHOLE_REACTIONS)
/* Two fields of eight consecutive rows of `stride` doubles. */
RVE_FN void rve_scatter_two(double *rows, int stride, int lane0, rve_real a, rve_real b) {
  const rve_real even = _mm512_unpacklo_pd(a, b), odd = _mm512_unpackhi_pd(a, b);
  const __m128d pair[8] = {_mm512_castpd512_pd128(even),       _mm512_castpd512_pd128(odd),
                           _mm512_extractf64x2_pd(even, 1), _mm512_extractf64x2_pd(odd, 1),
                           _mm512_extractf64x2_pd(even, 2), _mm512_extractf64x2_pd(odd, 2),
                           _mm512_extractf64x2_pd(even, 3), _mm512_extractf64x2_pd(odd, 3)};
  rows += (size_t)lane0 * (size_t)stride;
  for (int l = 0; l < 8; l++) _mm_store_pd(rows + l * stride, pair[l]);
}

/* The first six fields of rows of eight, one per lane. */
RVE_FN void rve_transpose_six(const rve_real row[8], rve_real field[6]) {
  RveFour four[8];
  rve_real two[4];
  for (int k = 0; k < 8; k++) four[k] = _mm512_castpd512_pd256(row[k]);
  for (int k = 0; k < 4; k++) two[k] = _mm512_shuffle_f64x2(row[k], row[k + 4], 0xee);
  const RveQuad q = rve_transpose(four);
  for (int k = 0; k < 4; k++) field[k] = q.f[k];
  field[4] = rve_even_quarters(_mm512_unpacklo_pd(two[0], two[1]), _mm512_unpacklo_pd(two[2], two[3]));
  field[5] = rve_even_quarters(_mm512_unpackhi_pd(two[0], two[1]), _mm512_unpackhi_pd(two[2], two[3]));
}
#endif

#endif /* RVE_KERNEL */
#endif
