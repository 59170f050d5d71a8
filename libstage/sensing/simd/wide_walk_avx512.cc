// SPDX-License-Identifier: GPL-2.0-or-later
//
// For x86-64 processors with AVX-512 (F, DQ, VL). Must not be called on others.

#ifdef STAGE_WALK_AVX512

// GCC 12 warns of vectors that its own header leaves uninitialized on purpose.
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC diagnostic ignored "-Wuninitialized"
#pragma GCC diagnostic ignored "-Wmaybe-uninitialized"
#endif
#include <immintrin.h>

#include "sensing/simd/wide_walk_lanes.hh"

namespace Stg::internal::sensing {

namespace {

/// 64-bit lanes, for the work before and after the walk.
struct Eight {
  using Number = int64_t;
  using V = __m512i;
  using D = __m512d;
  using M = __mmask8;
  static constexpr int kCount = 8;

  static V All(int64_t n) { return _mm512_set1_epi64(n); }
  static V Load(const int64_t* p) { return _mm512_loadu_si512(p); }
  static V Load(const uint32_t* p) {
    return _mm512_cvtepu32_epi64(
        _mm256_loadu_si256(static_cast<const __m256i*>(static_cast<const void*>(p))));
  }
  static V Load(const int32_t* p) {
    return _mm512_cvtepi32_epi64(
        _mm256_loadu_si256(static_cast<const __m256i*>(static_cast<const void*>(p))));
  }
  static D Load(const double* p) { return _mm512_loadu_pd(p); }
  static void Store(int64_t* p, V v) { _mm512_storeu_si512(p, v); }
  static void Store(double* p, D d) { _mm512_storeu_pd(p, d); }
  /// Stores the lower halves.
  static void Store(uint32_t* p, V v) {
    _mm256_storeu_si256(static_cast<__m256i*>(static_cast<void*>(p)), _mm512_cvtepi64_epi32(v));
  }
  static void Store(int32_t* p, V v) {
    _mm256_storeu_si256(static_cast<__m256i*>(static_cast<void*>(p)), _mm512_cvtepi64_epi32(v));
  }
  static void Store(float* p, D d) { _mm256_storeu_ps(p, _mm512_cvtpd_ps(d)); }
  /// Loads up to eight pairs of 32-bit numbers into lower halves of lanes, as for Multiply().
  static void LoadPairs(const void* pairs, uint32_t count, V* first, V* second) {
    *first = _mm512_maskz_loadu_epi64(FirstOf(count), pairs);
    *second = _mm512_srli_epi64(*first, 32);
  }
  /// Loads up to eight pairs of doubles.
  static void LoadPairs(const void* pairs, uint32_t count, D* first, D* second) {
    const double* numbers = static_cast<const double*>(pairs);
    const D low = _mm512_maskz_loadu_pd(FirstOf(2 * count), numbers);
    const M above = count > 4 ? FirstOf(2 * count - kCount) : None();
    const D high = _mm512_maskz_loadu_pd(above, numbers + kCount);
    const V even = _mm512_set_epi64(14, 12, 10, 8, 6, 4, 2, 0);
    *first = _mm512_permutex2var_pd(low, even, high);
    *second = _mm512_permutex2var_pd(low, Add(even, All(1)), high);
  }

  static V Add(V a, V b) { return _mm512_add_epi64(a, b); }
  static V Subtract(V a, V b) { return _mm512_sub_epi64(a, b); }
  /// Products of signed 32-bit numbers.
  static V Multiply(V a, V b) { return _mm512_mul_epi32(a, b); }
  static V LowHalf(V a) { return And(a, All(0xffffffff)); }
  static V And(V a, V b) { return _mm512_and_si512(a, b); }
  static V Or(V a, V b) { return _mm512_or_si512(a, b); }
  static V Xor(V a, V b) { return _mm512_xor_si512(a, b); }
  /// a & ~b.
  static V Without(V a, V b) { return _mm512_andnot_si512(b, a); }
  template <int kBits>
  static V Left(V a) {
    return _mm512_slli_epi64(a, kBits);
  }
  template <int kBits>
  static V Right(V a) {
    return _mm512_srai_epi64(a, kBits);
  }
  /// Bit (`bits` modulo 64) of each word, as the lowest bit. The other bits are unspecified.
  static V BitOf(V a, V bits) { return _mm512_rorv_epi64(a, bits); }
  static V SignOf(V a) { return _mm512_srai_epi64(a, 63); }
  static V Absolute(V a) { return _mm512_abs_epi64(a); }

  static M Greater(V a, V b) { return _mm512_cmpgt_epi64_mask(a, b); }
  /// Unsigned a < b.
  static M Below(V a, V b) { return _mm512_cmplt_epu64_mask(a, b); }
  static M Equal(V a, V b) { return _mm512_cmpeq_epi64_mask(a, b); }
  static M Differ(V a, V b) { return _mm512_cmpneq_epi64_mask(a, b); }
  static M Odd(V a) { return _mm512_test_epi64_mask(a, All(1)); }
  static M None() { return 0; }
  static M And(M a, M b) { return _kand_mask8(a, b); }
  static M Or(M a, M b) { return _kor_mask8(a, b); }
  static M AndNot(M a, M b) { return _kandn_mask8(b, a); }
  static M Not(M a) { return _knot_mask8(a); }
  static bool Any(M m) { return !_kortestz_mask8_u8(m, m); }
  static uint64_t BitsOf(M m) { return m; }
  /// The first `count` lanes.
  static M FirstOf(uint32_t count) {
    return count >= kCount ? M{0xff} : static_cast<M>((1u << count) - 1);
  }
  static V Select(M m, V a, V b) { return _mm512_mask_blend_epi64(m, b, a); }
  static D Select(M m, D a, D b) { return _mm512_mask_blend_pd(m, b, a); }

  static V Gather(const int32_t* p, V i) {
    return _mm512_cvtepi32_epi64(_mm512_i64gather_epi32(i, p, 4));
  }
  static V Gather(const uint32_t* p, V i) {
    return _mm512_cvtepu32_epi64(_mm512_i64gather_epi32(i, p, 4));
  }
  static V Gather(const uint64_t* p, V i) { return _mm512_i64gather_epi64(i, p, 8); }
  /// Lanes outside m are 0.
  static V Gather(M m, const uint32_t* p, V i) {
    return _mm512_cvtepu32_epi64(_mm512_mask_i64gather_epi32(_mm256_setzero_si256(), m, i, p, 4));
  }
  static V Gather(M m, const uint64_t* p, V i) {
    return _mm512_mask_i64gather_epi64(_mm512_setzero_si512(), m, i, p, 8);
  }
  /// table[i & 15].
  static V LookUp16(const int64_t* table, V i) {
    return _mm512_permutex2var_epi64(Load(table), i, Load(table + 8));
  }
  static void Store(M m, double* p, D a) { _mm512_mask_storeu_pd(p, m, a); }

  static D ToDouble(V a) { return _mm512_cvtepi64_pd(a); }
  /// Rounds towards 0. The results must fit in 32 bits.
  static V ToInteger(D a) { return _mm512_cvttpd_epi64(a); }
  static D AllOf(double d) { return _mm512_set1_pd(d); }
  static D Plus(D a, D b) { return _mm512_add_pd(a, b); }
  static D Minus(D a, D b) { return _mm512_sub_pd(a, b); }
  static D Times(D a, D b) { return _mm512_mul_pd(a, b); }
  static D Divide(D a, D b) { return _mm512_div_pd(a, b); }
  static D DivideOr0(D a, D b) {
    return _mm512_maskz_div_pd(_mm512_cmp_pd_mask(b, _mm512_setzero_pd(), _CMP_NEQ_OQ), a, b);
  }
  /// Returns b if both are zeros.
  static D Larger(D a, D b) { return _mm512_max_pd(a, b); }
  static D Smaller(D a, D b) { return _mm512_min_pd(a, b); }
  static D Magnitude(D a) { return _mm512_abs_pd(a); }
  static M Below(D a, D b) { return _mm512_cmp_pd_mask(a, b, _CMP_LT_OQ); }
  static M Zero(D a) { return _mm512_cmp_pd_mask(a, _mm512_setzero_pd(), _CMP_EQ_OQ); }
};

/// 32-bit lanes, for the walk.
struct Sixteen {
  using Number = int32_t;
  using V = __m512i;
  using F = __m512;
  using M = __mmask16;
  static constexpr int kCount = 16;
  /// One 64-bit word per lane, as lower and upper halves.
  struct Words {
    V low, high;
  };
  /// The lanes that receive consecutive numbers in Expand().
  using Places = M;

  static V All(int32_t n) { return _mm512_set1_epi32(n); }
  static V Load(const int32_t* p) { return _mm512_loadu_si512(p); }
  static F Load(const float* p) { return _mm512_loadu_ps(p); }
  static void Store(int32_t* p, V v) { _mm512_storeu_si512(p, v); }

  static V Add(V a, V b) { return _mm512_add_epi32(a, b); }
  static V AddWhere(M m, V a, V b) { return _mm512_mask_add_epi32(a, m, a, b); }
  static V Subtract(V a, V b) { return _mm512_sub_epi32(a, b); }
  static V Multiply(V a, V b) { return _mm512_mullo_epi32(a, b); }
  /// max(a - 1, 0).
  static V DecrementOr0(V a) {
    return _mm512_max_epi32(_mm512_sub_epi32(a, All(1)), _mm512_setzero_si512());
  }
  static V LowHalf(V a) { return a; }
  static V And(V a, V b) { return _mm512_and_si512(a, b); }
  static V Or(V a, V b) { return _mm512_or_si512(a, b); }
  static V Xor(V a, V b) { return _mm512_xor_si512(a, b); }
  /// a & ~b.
  static V Without(V a, V b) { return _mm512_andnot_si512(b, a); }
  static Words Without(const Words& a, const Words& b) {
    return {Without(a.low, b.low), Without(a.high, b.high)};
  }
  /// (a & 1) | b.
  static V OddOr(V a, V b) { return _mm512_ternarylogic_epi32(a, All(1), b, 0xea); }
  template <int kBits>
  static V Left(V a) {
    return _mm512_slli_epi32(a, kBits);
  }
  template <int kBits>
  static V Right(V a) {
    return _mm512_srai_epi32(a, kBits);
  }
  static V ShiftLeft(V a, V bits) { return _mm512_sllv_epi32(a, bits); }
  static V ShiftRight(V a, V bits) { return _mm512_srav_epi32(a, bits); }
  /// Bit (`bits` modulo 64) of each word, as the lowest bit. The other bits are unspecified.
  static V BitOf(const Words& a, V bits) {
    const M upper = _mm512_test_epi32_mask(bits, All(32));
    return _mm512_rorv_epi32(_mm512_mask_blend_epi32(upper, a.low, a.high), bits);
  }
  static V SignOf(V a) { return _mm512_srai_epi32(a, 31); }
  static V Absolute(V a) { return _mm512_abs_epi32(a); }
  static V Larger(V a, V b) { return _mm512_max_epi32(a, b); }

  static M Greater(V a, V b) { return _mm512_cmpgt_epi32_mask(a, b); }
  /// Unsigned a < b.
  static M Below(V a, V b) { return _mm512_cmplt_epu32_mask(a, b); }
  static M Equal(V a, V b) { return _mm512_cmpeq_epi32_mask(a, b); }
  static M Differ(V a, V b) { return _mm512_cmpneq_epi32_mask(a, b); }
  static M Odd(V a) { return _mm512_test_epi32_mask(a, All(1)); }
  static M MaskOf(V all_ones_or_none) { return _mm512_movepi32_mask(all_ones_or_none); }
  static M Zero(V a) { return _mm512_testn_epi32_mask(a, a); }
  static M Zero(const Words& a) { return Zero(Or(a.low, a.high)); }
  static M None() { return 0; }
  static M And(M a, M b) { return _kand_mask16(a, b); }
  static M Or(M a, M b) { return _kor_mask16(a, b); }
  static M AndNot(M a, M b) { return _kandn_mask16(b, a); }
  static M Not(M a) { return _knot_mask16(a); }
  static bool Any(M m) { return !_kortestz_mask16_u8(m, m); }
  static int CountOf(M m) { return __builtin_popcount(m); }
  /// The first `count` lanes of m.
  static M First(M m, int count) { return static_cast<M>(_pdep_u32((1u << count) - 1, m)); }
  static V Select(M m, V a, V b) { return _mm512_mask_blend_epi32(m, b, a); }
  static F Select(M m, F a, F b) { return _mm512_mask_blend_ps(m, b, a); }
  static Words Select(M m, const Words& a, const Words& b) {
    return {Select(m, a.low, b.low), Select(m, a.high, b.high)};
  }

  template <typename Integer>
  static V Gather(const Integer* p, V i) {
    return _mm512_i32gather_epi32(i, p, 4);
  }
  static Words Gather(const uint64_t* p, V i) { return Gather(M{0xffff}, p, i); }
  /// Lanes outside m are 0.
  static Words Gather(M m, const uint64_t* p, V i) {
    const auto lanes = [&](int half) {
      const __m256i places = half ? _mm512_extracti64x4_epi64(i, 1) : _mm512_castsi512_si256(i);
      const V wide = _mm512_cvtepu32_epi64(places);
      return _mm512_mask_i64gather_epi64(_mm512_setzero_si512(),
                                         static_cast<__mmask8>(m >> (8 * half)), wide, p, 8);
    };
    const V first = lanes(0), second = lanes(1);
    const V even = _mm512_set_epi32(30, 28, 26, 24, 22, 20, 18, 16, 14, 12, 10, 8, 6, 4, 2, 0);
    return {_mm512_permutex2var_epi32(first, even, second),
            _mm512_permutex2var_epi32(first, Add(even, All(1)), second)};
  }
  /// table[i & 15].
  static V LookUp16(const int32_t* table, V i) { return _mm512_permutexvar_epi32(i, Load(table)); }
  /// 64-bit table entries, given as tables of lower and upper halves.
  static Words LookUp16(const int32_t* low, const int32_t* high, V i) {
    return {LookUp16(low, i), LookUp16(high, i)};
  }
  static void Scatter(M m, uint32_t* p, V i, V a) { _mm512_mask_i32scatter_epi32(p, m, i, a, 4); }
  static Places PlacesOf(M m) { return m; }
  /// Loads consecutive numbers from p into these lanes; other lanes keep `other`.
  static V Expand(M m, Places, const int32_t* p, V other) {
    return _mm512_mask_expand_epi32(other, m, Load(p));
  }
  static F Expand(M m, Places, const float* p, F other) {
    return _mm512_mask_expand_ps(other, m, Load(p));
  }
  /// Returns first, first + 1, ... in these lanes.
  static V Rank(Places places, uint32_t first) {
    const V ranks = _mm512_set_epi32(15, 14, 13, 12, 11, 10, 9, 8, 7, 6, 5, 4, 3, 2, 1, 0);
    return Add(_mm512_maskz_expand_epi32(places, ranks), All(static_cast<int32_t>(first)));
  }

  /// Lower halves of (a * b - c * d) >> bits, with bits at most 32.
  static V ProductsRight(V a, V b, V c, V d, V bits) {
    const Pair difference = Difference(a, b, c, d);
    const V even =
        _mm512_srlv_epi64(difference.even, _mm512_and_si512(bits, _mm512_set1_epi64(0xffffffff)));
    const V odd = _mm512_srlv_epi64(difference.odd, _mm512_srli_epi64(bits, 32));
    return _mm512_mask_blend_epi32(kOdd, even, _mm512_slli_epi64(odd, 32));
  }
  /// a * b < c * d, or <= where `ties`.
  static M ProductsBelow(V a, V b, V c, V d, M ties) {
    const Pair behind = Difference(a, b, c, d);
    const V signs = _mm512_mask_blend_epi32(kOdd, _mm512_srli_epi64(behind.even, 32), behind.odd);
    // A difference is 0 if both of its halves are 0.
    const V rest = _mm512_mask_blend_epi32(kOdd, behind.even, _mm512_slli_epi64(behind.odd, 32));
    const V any = Or(signs, rest);
    return static_cast<M>(_mm512_movepi32_mask(signs) | (ties & Zero(any)));
  }
  static F ToFloat(V a) { return _mm512_cvtepi32_ps(a); }
  /// Rounds towards 0.
  static V ToInteger(F a) { return _mm512_cvttps_epi32(a); }
  static F AllOf(float f) { return _mm512_set1_ps(f); }
  static F Times(F a, F b) { return _mm512_mul_ps(a, b); }
  static F Smaller(F a, F b) { return _mm512_min_ps(a, b); }

 private:
  static constexpr M kOdd = 0xaaaa;
  /// 64 bits per lane: the even and the odd lanes.
  struct Pair {
    V even, odd;
  };
  /// a * b - c * d.
  static Pair Difference(V a, V b, V c, V d) {
    const auto odd = [](V of) { return _mm512_srli_epi64(of, 32); };
    return {_mm512_sub_epi64(_mm512_mul_epi32(a, b), _mm512_mul_epi32(c, d)),
            _mm512_sub_epi64(_mm512_mul_epi32(odd(a), odd(b)), _mm512_mul_epi32(odd(c), odd(d)))};
  }
};

}  // namespace

extern const WideWalk kWalkAvx512;
const WideWalk kWalkAvx512{"avx512", WalkInLanes<Eight, Sixteen>, EvaluateInLanes<Eight>,
                           MeetInLanes<Eight>};

}  // namespace Stg::internal::sensing

#endif
