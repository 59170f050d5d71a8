// SPDX-License-Identifier: GPL-2.0-or-later
//
// Eight lanes of 32 bits for wide_walk_lanes.hh; see vector_lanes.hh.

#ifndef STAGE_SENSING_SIMD_EIGHT_LANES_HH
#define STAGE_SENSING_SIMD_EIGHT_LANES_HH

#include <cstdint>

#include "sensing/simd/vector_lanes.hh"

namespace Stg::internal::sensing {
namespace {

struct EightLanes : VectorLanes<int32_t> {
  using F [[gnu::vector_size(kBytes)]] = float;
  /// One 64-bit word per lane, as lower and upper halves.
  struct Words {
    V low, high;
  };
  /// For each lane, the index of its number in a sequence for Expand().
  using Places = V;

  static V Load(const int32_t* p) { return Get<V>(p); }
  static F Load(const float* p) { return Get<F>(p); }
  static void Store(int32_t* p, V v) { Put(p, v); }

  static V AddWhere(M m, V a, V b) { return Add(a, And(m.bits, b)); }
  static V Multiply(V a, V b) { return Signed(Bits(a) * Bits(b)); }
  /// max(a - 1, 0).
  static V DecrementOr0(V a) { return And(Add(a, All(-1)), a > All(0)); }
  static V LowHalf(V a) { return a; }
  using VectorLanes::Without;
  static Words Without(const Words& a, const Words& b) {
    return {Without(a.low, b.low), Without(a.high, b.high)};
  }
  /// (a & 1) | b.
  static V OddOr(V a, V b) { return (a & All(1)) | b; }
  template <int kBits>
  static V Right(V a) {
    return a >> kBits;
  }
  static V Larger(V a, V b) { return Select(Greater(a, b), a, b); }

  static M MaskOf(V all_ones_or_none) { return {all_ones_or_none}; }
  static M Zero(V a) { return {a == All(0)}; }
  static M Zero(const Words& a) { return Zero(Or(a.low, a.high)); }
  static int CountOf(M m) { return __builtin_popcount(BitsOf(m)); }
  /// The first `count` lanes of m.
  static M First(M m, int count) {
    for (int i = 0; i < kCount; i++)
      if (m.bits[i] != 0 && count-- <= 0) m.bits[i] = 0;
    return m;
  }
  using VectorLanes::Select;
  static Words Select(M m, const Words& a, const Words& b) {
    return {Select(m, a.low, b.low), Select(m, a.high, b.high)};
  }

  template <typename Integer>
  static V Gather(const Integer* p, V i) {
    return V{Number(p[uint32_t(i[0])]), Number(p[uint32_t(i[1])]), Number(p[uint32_t(i[2])]),
             Number(p[uint32_t(i[3])]), Number(p[uint32_t(i[4])]), Number(p[uint32_t(i[5])]),
             Number(p[uint32_t(i[6])]), Number(p[uint32_t(i[7])])};
  }
  /// Lanes outside m are 0; they may read p[0].
  static Words Gather(M m, const uint64_t* p, V i) {
    const Words words = Gather(p, And(m.bits, i));
    return {And(m.bits, words.low), And(m.bits, words.high)};
  }
  static void Scatter(M m, uint32_t* p, V i, V a) {
    for (unsigned lanes = BitsOf(m); lanes != 0; lanes &= lanes - 1) {
      const int lane = __builtin_ctz(lanes);
      p[i[lane]] = static_cast<uint32_t>(a[lane]);
    }
  }
  /// Assigns consecutive indices to the lanes of m.
  static Places PlacesOf(M m) {
    Places places = All(0);
    int next = 0;
    for (int i = 0; i < kCount; i++) {
      places[i] = next;
      next -= m.bits[i];
    }
    return places;
  }
  /// Returns first, first + 1, ... in these lanes.
  static V Rank(const Places& places, uint32_t first) {
    return Add(places, All(static_cast<int32_t>(first)));
  }

  static V ShiftLeft(V a, V bits) { return ToV(_mm256_sllv_epi32(ToI(a), ToI(bits))); }
  static V ShiftRight(V a, V bits) { return ToV(_mm256_srav_epi32(ToI(a), ToI(bits))); }
  static unsigned BitsOf(M m) {
    return static_cast<unsigned>(_mm256_movemask_ps(_mm256_castsi256_ps(ToI(m.bits))));
  }
  static F Select(M m, F a, F b) {
    return _mm256_blendv_ps(b, a, _mm256_castsi256_ps(ToI(m.bits)));
  }
  /// Bit (`bits` modulo 64) of each word, as the lowest bit. The other bits are unspecified.
  static V BitOf(const Words& a, V bits) {
    const __m256 upper = _mm256_castsi256_ps(ToI(Left<26>(bits)));
    const __m256 half =
        _mm256_blendv_ps(_mm256_castsi256_ps(ToI(a.low)), _mm256_castsi256_ps(ToI(a.high)), upper);
    return ToV(_mm256_srlv_epi32(_mm256_castps_si256(half), ToI(And(bits, All(31)))));
  }

  static Words Gather(const uint64_t* p, V i) {
    const auto half = [&](int first) {
      return _mm256_setr_epi64x(int64_t(p[uint32_t(i[first])]), int64_t(p[uint32_t(i[first + 1])]),
                                int64_t(p[uint32_t(i[first + 4])]),
                                int64_t(p[uint32_t(i[first + 5])]));
    };
    // Lanes 0 1 4 5 and 2 3 6 7: the order in which the 256-bit shuffle interleaves them correctly.
    const __m256 even = _mm256_castsi256_ps(half(0)), odd = _mm256_castsi256_ps(half(2));
    return {ToV(_mm256_castps_si256(_mm256_shuffle_ps(even, odd, 0x88))),
            ToV(_mm256_castps_si256(_mm256_shuffle_ps(even, odd, 0xdd)))};
  }
  /// table[i & 15].
  static V LookUp16(const int32_t* table, V i) {
    const __m256 first = _mm256_permutevar8x32_ps(Get<F>(table), ToI(i));
    const __m256 second = _mm256_permutevar8x32_ps(Get<F>(table + 8), ToI(i));
    const __m256 upper = _mm256_castsi256_ps(ToI(Left<28>(i)));
    return ToV(_mm256_castps_si256(_mm256_blendv_ps(first, second, upper)));
  }
  static V Expand(M m, const Places& places, const int32_t* p, V other) {
    const __m256i next = _mm256_permutevar8x32_epi32(ToI(Get<V>(p)), ToI(places));
    return Select(m, ToV(next), other);
  }
  static F Expand(M m, const Places& places, const float* p, F other) {
    return Select(m, F(_mm256_permutevar8x32_ps(Get<F>(p), ToI(places))), other);
  }

  /// Lower halves of (a * b - c * d) >> bits, with bits at most 32.
  static V ProductsRight(V a, V b, V c, V d, V bits) {
    const Pair difference = Difference(a, b, c, d);
    const __m256i low = _mm256_set1_epi64x(0xffffffff);
    const __m256i even = _mm256_srlv_epi64(difference.even, _mm256_and_si256(ToI(bits), low));
    const __m256i odd = _mm256_srlv_epi64(difference.odd, _mm256_srli_epi64(ToI(bits), 32));
    return ToV(_mm256_blend_epi32(even, _mm256_slli_epi64(odd, 32), 0xaa));
  }
  /// a * b < c * d, or <= where `ties`.
  static M ProductsBelow(V a, V b, V c, V d, M ties) {
    const Pair behind = Difference(a, b, c, d);
    const V signs = ToV(_mm256_blend_epi32(_mm256_srli_epi64(behind.even, 32), behind.odd, 0xaa));
    const V zeros =
        ToV(_mm256_blend_epi32(_mm256_cmpeq_epi64(behind.even, _mm256_setzero_si256()),
                               _mm256_cmpeq_epi64(behind.odd, _mm256_setzero_si256()), 0xaa));
    return {Or(SignOf(signs), And(zeros, ties.bits))};
  }
  static F ToFloat(V a) { return _mm256_cvtepi32_ps(ToI(a)); }
  /// Rounds towards 0.
  static V ToInteger(F a) { return ToV(_mm256_cvttps_epi32(a)); }
  static F Smaller(F a, F b) { return _mm256_min_ps(a, b); }
  /// 64-bit table entries, given as tables of lower and upper halves.
  static Words LookUp16(const int32_t* low, const int32_t* high, V i) {
    return {LookUp16(low, i), LookUp16(high, i)};
  }
  static F AllOf(float f) { return F{f, f, f, f, f, f, f, f}; }
  static F Times(F a, F b) { return a * b; }

 private:
  /// 64 bits per lane: lanes 0, 2, 4, 6 and lanes 1, 3, 5, 7.
  struct Pair {
    __m256i even, odd;
  };
  /// a * b - c * d.
  static Pair Difference(V a, V b, V c, V d) {
    const auto even = [](V x, V y) { return _mm256_mul_epi32(ToI(x), ToI(y)); };
    const auto odd = [](V x, V y) {
      return _mm256_mul_epi32(_mm256_srli_epi64(ToI(x), 32), _mm256_srli_epi64(ToI(y), 32));
    };
    return {_mm256_sub_epi64(even(a, b), even(c, d)), _mm256_sub_epi64(odd(a, b), odd(c, d))};
  }
};

}  // namespace
}  // namespace Stg::internal::sensing

#endif
