/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Who computes an RVE, and on how many lanes: the only file that asks which compiler reads it.
 *
 * The kernels are written once over `rve_real`, a span of RVE_SPAN grains. On a CPU it is one vector register and a
 * team is one thread; in CUDA it is one number per thread, a span is a warp and a team is a thread block. Lists are
 * laid out for packs of RVE_PACK grains: a span, or RVE_PARTS of them in mixed precision (rve_near.h).
 *
 * SIMD kernels also keep what a neighbour must know of a grain in one row (array of structures), see rve_rows.h. CUDA and plain
 * code read the arrays themselves. */
#ifndef DEMPM_RVE_TEAM_H
#define DEMPM_RVE_TEAM_H

#include <math.h>
#include <stdint.h>
#include <string.h>

typedef struct RveTeam {
  int pack, packs; /* this pack's number, and how many packs work side by side */
  int leader;      /* 1 for the one thread that runs the serial parts */
  double *shared;  /* CUDA: one double per warp, for reductions */
} RveTeam;

/* RVE_ANY: host and device; RVE_FN: inlined part of a kernel; RVE_PART: a kernel's part worth a call of its own. */
#if defined(__CUDACC__)
#define RVE_ANY static inline __host__ __device__
#define RVE_FN static __device__ __forceinline__
#define RVE_PART static __device__ __noinline__
#define RVE_KERNEL 1
#else
#define RVE_ANY static inline
#define RVE_FN static inline __attribute__((always_inline, unused))
#define RVE_PART static __attribute__((noinline, unused))
#if defined(RVE_ISA_AVX512) || defined(RVE_ISA_AVX2) || defined(RVE_ISA_PLAIN)
#define RVE_KERNEL 1
#endif
#endif

/* Doubles of a 3D reaction that has a line of the cache to itself, of RveCounts.reaction. */
enum { RVE_WHOLE = 8 };

/* Where the reaction of a slot stands, if not whole: what the registers of a transposed pack hold, written as it is. */
RVE_ANY int rve_place(int pack, int slot) {
  if (pack == 8) return (slot & ~7) + 2 * (slot & 3) + (slot >> 2 & 1);
  if (pack == 16) return (slot & ~15) + 4 * (slot & 3) + (slot >> 2 & 3);
  return slot;
}

#ifdef RVE_KERNEL /* the rest is for kernels: host code that only stores RVEs has no lanes */
#if defined(RVE_ISA_AVX512) || defined(RVE_ISA_AVX2)
#include <immintrin.h>
#endif

/* ------------------------------------------------------------------------------------------------ numbers, one per
 * lane */
#if defined(RVE_ISA_AVX512)

enum { RVE_SPAN = 8 };
typedef __m512d rve_real;
typedef __m512i rve_int; /* int64 */
typedef __mmask8 rve_mask;

RVE_FN rve_real rve_set(double a) { return _mm512_set1_pd(a); }
RVE_FN rve_real rve_load(const double *a, int lane0) { return _mm512_load_pd(a + lane0); }
RVE_FN void rve_store(double *a, int lane0, rve_real b) { _mm512_store_pd(a + lane0, b); }
RVE_FN rve_int rve_load_int(const int64_t *a, int lane0) { return _mm512_load_si512((const void *)(a + lane0)); }
RVE_FN void rve_store_int(int64_t *a, int lane0, rve_int b) { _mm512_store_si512((void *)(a + lane0), b); }
RVE_FN rve_int rve_load_short(const uint16_t *a, int lane0) {
  return _mm512_cvtepu16_epi64(_mm_load_si128((const __m128i *)(const void *)(a + lane0)));
}
RVE_FN void rve_store_short(uint16_t *a, int lane0, rve_int b) {
  _mm_store_si128((__m128i *)(void *)(a + lane0), _mm512_cvtepi64_epi16(b));
}
RVE_FN rve_int rve_set_int(int64_t a) { return _mm512_set1_epi64(a); }
RVE_FN rve_int rve_int_add(rve_int a, rve_int b) { return _mm512_add_epi64(a, b); }
RVE_FN rve_int rve_int_subtract(rve_int a, rve_int b) { return _mm512_sub_epi64(a, b); }
RVE_FN rve_int rve_int_and(rve_int a, rve_int b) { return _mm512_and_si512(a, b); }
#define rve_int_shift_left(a, bits) _mm512_slli_epi64((a), (bits))
RVE_FN rve_mask rve_int_any_bit(rve_int a, rve_int bits) { return _mm512_test_epi64_mask(a, bits); }
RVE_FN rve_int rve_int_clear(rve_mask m, rve_int a, rve_int bits) { return _mm512_mask_andnot_epi64(a, m, bits, a); }
RVE_FN rve_real rve_real_from_int(rve_int a) { return _mm512_cvtepi64_pd(a); }
RVE_FN rve_int rve_int_from_real(rve_real a) { return _mm512_cvtpd_epi64(a); }
RVE_FN rve_int rve_int_from_bits(rve_real a) { return _mm512_castpd_si512(a); }
RVE_FN rve_real rve_bits_from_int(rve_int a) { return _mm512_castsi512_pd(a); }
RVE_FN rve_real rve_sqrt(rve_real a) { return _mm512_sqrt_pd(a); }
RVE_FN rve_real rve_fma(rve_real a, rve_real b, rve_real c) { return _mm512_fmadd_pd(a, b, c); }
RVE_FN rve_real rve_fms(rve_real a, rve_real b, rve_real c) { return _mm512_fmsub_pd(a, b, c); }
RVE_FN rve_real rve_fnma(rve_real a, rve_real b, rve_real c) { return _mm512_fnmadd_pd(a, b, c); }
RVE_FN rve_real rve_min(rve_real a, rve_real b) { return _mm512_min_pd(a, b); }
RVE_FN rve_real rve_max(rve_real a, rve_real b) { return _mm512_max_pd(a, b); }
RVE_FN rve_real rve_abs(rve_real a) { return _mm512_abs_pd(a); }
RVE_FN rve_real rve_copy_sign(rve_real a, rve_real sign) { /* a >= 0 */
  const __m512i top = _mm512_set1_epi64(INT64_MIN), s = _mm512_castpd_si512(sign), b = _mm512_castpd_si512(a);
  return _mm512_castsi512_pd(_mm512_ternarylogic_epi64(top, s, b, 0xca));
}
/* a, or +-most where it is further from 0; most >= 0. */
RVE_FN rve_real rve_limit(rve_real a, rve_real most) { return _mm512_range_pd(a, most, 2); }
RVE_FN rve_mask rve_less(rve_real a, rve_real b) { return _mm512_cmp_pd_mask(a, b, _CMP_LT_OQ); }
RVE_FN rve_mask rve_and(rve_mask a, rve_mask b) { return (rve_mask)(a & b); }
RVE_FN rve_mask rve_or(rve_mask a, rve_mask b) { return (rve_mask)(a | b); }
RVE_FN rve_mask rve_and_not(rve_mask a, rve_mask b) { return (rve_mask)(a & ~b); }
RVE_FN int rve_any(rve_mask a) { return a != 0; }
RVE_FN double rve_largest(rve_real a) { return _mm512_reduce_max_pd(a); }
RVE_FN rve_real rve_select(rve_mask m, rve_real a, rve_real b) { return _mm512_mask_blend_pd(m, b, a); }
RVE_FN rve_real rve_keep(rve_mask m, rve_real a) { return _mm512_maskz_mov_pd(m, a); }

#elif defined(RVE_ISA_AVX2)

enum { RVE_SPAN = 4 };
typedef __m256d rve_real;
typedef __m256i rve_int;
typedef __m256d rve_mask; /* all bits of a lane set, or none */

RVE_FN rve_real rve_set(double a) { return _mm256_set1_pd(a); }
RVE_FN rve_real rve_load(const double *a, int lane0) { return _mm256_load_pd(a + lane0); }
RVE_FN void rve_store(double *a, int lane0, rve_real b) { _mm256_store_pd(a + lane0, b); }
RVE_FN rve_int rve_load_int(const int64_t *a, int lane0) {
  return _mm256_load_si256((const __m256i *)(const void *)(a + lane0));
}
RVE_FN void rve_store_int(int64_t *a, int lane0, rve_int b) { _mm256_store_si256((__m256i *)(void *)(a + lane0), b); }
RVE_FN rve_int rve_load_short(const uint16_t *a, int lane0) {
  return _mm256_cvtepu16_epi64(_mm_loadl_epi64((const __m128i *)(const void *)(a + lane0)));
}
RVE_FN void rve_store_short(uint16_t *a, int lane0, rve_int b) {
  int64_t wide[4];
  _mm256_storeu_si256((__m256i *)(void *)wide, b);
  for (int l = 0; l < 4; l++) a[lane0 + l] = (uint16_t)wide[l];
}
RVE_FN rve_int rve_set_int(int64_t a) { return _mm256_set1_epi64x(a); }
RVE_FN rve_int rve_int_add(rve_int a, rve_int b) { return _mm256_add_epi64(a, b); }
RVE_FN rve_int rve_int_subtract(rve_int a, rve_int b) { return _mm256_sub_epi64(a, b); }
RVE_FN rve_int rve_int_and(rve_int a, rve_int b) { return _mm256_and_si256(a, b); }
#define rve_int_shift_left(a, bits) _mm256_slli_epi64((a), (bits))
RVE_FN rve_mask rve_int_any_bit(rve_int a, rve_int bits) {
  const __m256i none = _mm256_cmpeq_epi64(_mm256_and_si256(a, bits), _mm256_setzero_si256());
  return _mm256_castsi256_pd(_mm256_xor_si256(none, _mm256_set1_epi64x(-1)));
}
RVE_FN rve_int rve_int_clear(rve_mask m, rve_int a, rve_int bits) {
  return _mm256_andnot_si256(_mm256_and_si256(_mm256_castpd_si256(m), bits), a);
}
/* AVX2 has no 64-bit conversions: the high and the low 32 bits go through the mantissa of a large number; one rounding.
 */
RVE_FN rve_real rve_real_from_int(rve_int a) {
  __m256i high = _mm256_blend_epi16(_mm256_srai_epi32(a, 16), _mm256_setzero_si256(), 0x33);
  high = _mm256_add_epi64(high, _mm256_castpd_si256(_mm256_set1_pd(0x3p67)));
  const __m256i low = _mm256_blend_epi16(a, _mm256_castpd_si256(_mm256_set1_pd(0x1p52)), 0x88);
  return _mm256_add_pd(_mm256_sub_pd(_mm256_castsi256_pd(high), _mm256_set1_pd(0x3p67 + 0x1p52)),
                       _mm256_castsi256_pd(low));
}
RVE_FN rve_int rve_int_from_real(rve_real a) {
  const __m256d magic = _mm256_set1_pd(0x1.8p52);
  const __m256d high = _mm256_add_pd(_mm256_mul_pd(a, _mm256_set1_pd(0x1p-32)), magic);
  const __m256d rest = _mm256_fnmadd_pd(_mm256_sub_pd(high, magic), _mm256_set1_pd(0x1p32), a);
  const __m256i bias = _mm256_castpd_si256(magic);
  const __m256i top = _mm256_slli_epi64(_mm256_sub_epi64(_mm256_castpd_si256(high), bias), 32);
  return _mm256_add_epi64(top, _mm256_sub_epi64(_mm256_castpd_si256(_mm256_add_pd(rest, magic)), bias));
}
RVE_FN rve_int rve_int_from_bits(rve_real a) { return _mm256_castpd_si256(a); }
RVE_FN rve_real rve_bits_from_int(rve_int a) { return _mm256_castsi256_pd(a); }
RVE_FN rve_real rve_sqrt(rve_real a) { return _mm256_sqrt_pd(a); }
RVE_FN rve_real rve_fma(rve_real a, rve_real b, rve_real c) { return _mm256_fmadd_pd(a, b, c); }
RVE_FN rve_real rve_fms(rve_real a, rve_real b, rve_real c) { return _mm256_fmsub_pd(a, b, c); }
RVE_FN rve_real rve_fnma(rve_real a, rve_real b, rve_real c) { return _mm256_fnmadd_pd(a, b, c); }
RVE_FN rve_real rve_min(rve_real a, rve_real b) { return _mm256_min_pd(a, b); }
RVE_FN rve_real rve_max(rve_real a, rve_real b) { return _mm256_max_pd(a, b); }
RVE_FN rve_real rve_abs(rve_real a) { return _mm256_andnot_pd(_mm256_set1_pd(-0.0), a); }
RVE_FN rve_real rve_copy_sign(rve_real a, rve_real sign) { /* a >= 0 */
  return _mm256_or_pd(_mm256_and_pd(_mm256_set1_pd(-0.0), sign), a);
}
RVE_FN rve_mask rve_less(rve_real a, rve_real b) { return _mm256_cmp_pd(a, b, _CMP_LT_OQ); }
RVE_FN rve_mask rve_and(rve_mask a, rve_mask b) { return _mm256_and_pd(a, b); }
RVE_FN rve_mask rve_or(rve_mask a, rve_mask b) { return _mm256_or_pd(a, b); }
RVE_FN rve_mask rve_and_not(rve_mask a, rve_mask b) { return _mm256_andnot_pd(b, a); }
RVE_FN int rve_any(rve_mask a) { return _mm256_movemask_pd(a) != 0; }
RVE_FN double rve_largest(rve_real a) {
  const __m128d b = _mm_max_pd(_mm256_castpd256_pd128(a), _mm256_extractf128_pd(a, 1));
  return _mm_cvtsd_f64(_mm_max_pd(b, _mm_unpackhi_pd(b, b)));
}
RVE_FN rve_real rve_select(rve_mask m, rve_real a, rve_real b) { return _mm256_blendv_pd(b, a, m); }
RVE_FN rve_real rve_keep(rve_mask m, rve_real a) { return _mm256_and_pd(m, a); }

#else /* one lane: plain C, or one CUDA thread */

#if defined(__CUDACC__)
enum { RVE_SPAN = 32 };
#define RVE_LANE ((int)(threadIdx.x & 31u))
#else
enum { RVE_SPAN = 1 };
#define RVE_LANE 0
#endif
typedef double rve_real;
typedef int64_t rve_int;
typedef int rve_mask;

RVE_FN rve_real rve_set(double a) { return a; }
RVE_FN rve_real rve_load(const double *a, int lane0) { return a[lane0 + RVE_LANE]; }
RVE_FN void rve_store(double *a, int lane0, rve_real b) { a[lane0 + RVE_LANE] = b; }
RVE_FN rve_int rve_load_int(const int64_t *a, int lane0) { return a[lane0 + RVE_LANE]; }
RVE_FN void rve_store_int(int64_t *a, int lane0, rve_int b) { a[lane0 + RVE_LANE] = b; }
RVE_FN rve_int rve_load_short(const uint16_t *a, int lane0) { return a[lane0 + RVE_LANE]; }
RVE_FN void rve_store_short(uint16_t *a, int lane0, rve_int b) { a[lane0 + RVE_LANE] = (uint16_t)b; }
RVE_FN rve_int rve_set_int(int64_t a) { return a; }
/* Unsigned inside: an RVE that runs away wraps around until the watchdog sees it, without undefined behaviour. */
RVE_FN rve_int rve_int_add(rve_int a, rve_int b) { return (int64_t)((uint64_t)a + (uint64_t)b); }
RVE_FN rve_int rve_int_subtract(rve_int a, rve_int b) { return (int64_t)((uint64_t)a - (uint64_t)b); }
RVE_FN rve_int rve_int_and(rve_int a, rve_int b) { return a & b; }
RVE_FN rve_int rve_int_shift_left(rve_int a, int bits) { return (int64_t)((uint64_t)a << bits); }
RVE_FN rve_mask rve_int_any_bit(rve_int a, rve_int bits) { return (a & bits) != 0; }
RVE_FN rve_int rve_int_clear(rve_mask m, rve_int a, rve_int bits) { return m ? a & ~bits : a; }
RVE_FN rve_real rve_real_from_int(rve_int a) { return (double)a; }
#if defined(__CUDACC__)
RVE_FN rve_int rve_int_from_real(rve_real a) { return __double2ll_rn(a); }
RVE_FN rve_int rve_int_from_bits(rve_real a) { return __double_as_longlong(a); }
RVE_FN rve_real rve_bits_from_int(rve_int a) { return __longlong_as_double(a); }
#else
RVE_FN rve_int rve_int_from_real(rve_real a) { return fabs(a) < 0x1p63 ? llrint(a) : INT64_MIN; }
RVE_FN rve_int rve_int_from_bits(rve_real a) {
  rve_int b;
  memcpy(&b, &a, sizeof b);
  return b;
}
RVE_FN rve_real rve_bits_from_int(rve_int a) {
  rve_real b;
  memcpy(&b, &a, sizeof b);
  return b;
}
#endif
RVE_FN rve_real rve_sqrt(rve_real a) { return sqrt(a); }
RVE_FN rve_real rve_fma(rve_real a, rve_real b, rve_real c) { return a * b + c; }
RVE_FN rve_real rve_fms(rve_real a, rve_real b, rve_real c) { return a * b - c; }
RVE_FN rve_real rve_fnma(rve_real a, rve_real b, rve_real c) { return c - a * b; }
RVE_FN rve_real rve_min(rve_real a, rve_real b) { return a < b ? a : b; }
RVE_FN rve_real rve_max(rve_real a, rve_real b) { return a > b ? a : b; }
RVE_FN rve_real rve_abs(rve_real a) { return fabs(a); }
RVE_FN rve_real rve_copy_sign(rve_real a, rve_real sign) { return copysign(a, sign); }
RVE_FN rve_mask rve_less(rve_real a, rve_real b) { return a < b; }
RVE_FN rve_mask rve_and(rve_mask a, rve_mask b) { return a & b; }
RVE_FN rve_mask rve_or(rve_mask a, rve_mask b) { return a | b; }
RVE_FN rve_mask rve_and_not(rve_mask a, rve_mask b) { return a & !b; }
#if defined(__CUDACC__)
RVE_FN int rve_any(rve_mask a) { return __any_sync(0xffffffffu, a); }
RVE_FN double rve_largest(rve_real a) {
  for (int distance = 16; distance > 0; distance /= 2) a = rve_max(a, __shfl_xor_sync(0xffffffffu, a, distance));
  return a;
}
#else
RVE_FN int rve_any(rve_mask a) { return a; }
RVE_FN double rve_largest(rve_real a) { return a; }
#endif
RVE_FN rve_real rve_select(rve_mask m, rve_real a, rve_real b) { return m ? a : b; }
RVE_FN rve_real rve_keep(rve_mask m, rve_real a) { return m ? a : 0.0; }

#endif

#if !defined(RVE_ISA_AVX512)
RVE_FN rve_real rve_limit(rve_real a, rve_real most) { return rve_min(rve_max(a, rve_set(0.0) - most), most); }
#endif

#ifdef RVE_MIXED
enum { RVE_PARTS = 2 };
#else
enum { RVE_PARTS = 1 };
#endif
enum { RVE_PACK = RVE_PARTS * RVE_SPAN };
/* Doubles from one slot to the next in RveArrays.incoming, 3D. */
#if defined(__CUDACC__)
enum { RVE_REACTION = 1 };
#elif defined(RVE_WHOLE_REACTIONS)
enum { RVE_REACTION = RVE_WHOLE };
#else
enum { RVE_REACTION = 4 / RVE_PARTS };
#endif

/* Rows of slots whose contacts are computed part by part, see RveRow. */
#if defined(__CUDACC__)
enum { RVE_CHUNK = 1, RVE_AHEAD = 0 };
#else
enum { RVE_CHUNK = 4, RVE_AHEAD = 1 /* see RveRows */ };
#endif
/* Spans whose reactions are summed before they move, 2D. */
#if defined(RVE_WHOLE_REACTIONS)
enum { RVE_SUM_AHEAD = 1 };
#else
enum { RVE_SUM_AHEAD = RVE_CHUNK };
#endif
/* 1 where branches are carried along from step to step, see near_find_branch(), and positions give them anew every RVE_FRESH steps. */
#if defined(RVE_ISA_AVX512) || defined(RVE_ISA_AVX2)
#define RVE_CARRIES 1
#else
#define RVE_CARRIES 0
#endif
enum { RVE_FRESH = 64 };

/* 1/sqrt(a) to round-off. */
#if defined(RVE_ISA_AVX512)
RVE_FN rve_real rve_inverse_sqrt(rve_real a) { /* 14 bits, and four terms of a series: half the time of a root and a division */
  const rve_real y = _mm512_rsqrt14_pd(a), e = rve_set(1.0) - a * y * y;
  return y + y * e * (rve_set(0.5) + e * (rve_set(0.375) + e * rve_set(0.3125)));
}
#else
RVE_FN rve_real rve_inverse_sqrt(rve_real a) { return rve_set(1.0) / rve_sqrt(a); }
#endif

/* ------------------------------------------------------------------------------------------------------- reductions */
#if defined(__CUDACC__)
RVE_FN void rve_sync(void) { __syncthreads(); }
RVE_FN double rve_team_reduce(const RveTeam *team, rve_real a, int want_max) {
  for (int distance = 16; distance > 0; distance /= 2) {
    const double b = __shfl_xor_sync(0xffffffffu, a, distance);
    a = want_max ? (a > b ? a : b) : a + b;
  }
  __syncthreads();
  if (RVE_LANE == 0) team->shared[team->pack] = a;
  __syncthreads();
  double all = team->shared[0];
  for (int p = 1; p < team->packs; p++)
    all = want_max ? (all > team->shared[p] ? all : team->shared[p]) : all + team->shared[p];
  return all;
}
#else
RVE_FN void rve_sync(void) {}
RVE_FN double rve_team_reduce(const RveTeam *team, rve_real a, int want_max) {
  double lane[RVE_SPAN] __attribute__((aligned(64)));
  (void)team;
  rve_store(lane, 0, a);
  double all = lane[0];
  for (int l = 1; l < RVE_SPAN; l++) all = want_max ? (all > lane[l] ? all : lane[l]) : all + lane[l];
  return all;
}
#endif
/* Over all lanes of the team, in a fixed order; every thread gets the result. A NaN may hide in a maximum, never in a
 * sum. */
RVE_FN double rve_team_sum(const RveTeam *team, rve_real a) { return rve_team_reduce(team, a, 0); }
RVE_FN double rve_team_max(const RveTeam *team, rve_real a) { return rve_team_reduce(team, a, 1); }

#endif /* RVE_KERNEL */
#endif
