// SPDX-License-Identifier: GPL-2.0-or-later
//
// Four lanes of 64 bits for wide_walk_lanes.hh; see vector_lanes.hh.

#ifndef STAGE_SENSING_SIMD_FOUR_LANES_HH
#define STAGE_SENSING_SIMD_FOUR_LANES_HH

#include <cstdint>

#include "sensing/simd/vector_lanes.hh"

namespace Stg::internal::sensing {
namespace {

struct FourLanes : VectorLanes<int64_t> {
  using D [[gnu::vector_size(kBytes)]] = double;

  static V Load(const int64_t* p) { return Get<V>(p); }
  static V Load(const uint32_t* p) { return V{p[0], p[1], p[2], p[3]}; }
  static V Load(const int32_t* p) { return __builtin_convertvector(Get<Halves>(p), V); }
  static D Load(const double* p) { return Get<D>(p); }
  static void Store(int64_t* p, V v) { Put(p, v); }
  static void Store(double* p, D d) { Put(p, d); }
  /// Stores the lower halves.
  static void Store(uint32_t* p, V v) { Put(p, __builtin_convertvector(v, Halves)); }
  static void Store(int32_t* p, V v) { Put(p, __builtin_convertvector(v, Halves)); }
  static void Store(float* p, D d) { Put(p, __builtin_convertvector(d, Floats)); }
  /// Loads up to four pairs of 32-bit numbers into lower halves of lanes, as for Multiply().
  static void LoadPairs(const void* pairs, uint32_t count, V* first, V* second) {
    if (count >= kCount) {
      *first = Get<V>(pairs);
    } else {
      *first = All(0);
      __builtin_memcpy(first, pairs, count * sizeof(int64_t));
    }
    *second = Logical<32>(*first);
  }
  /// Loads up to four pairs of doubles.
  static void LoadPairs(const void* pairs, uint32_t count, D* first, D* second) {
    D halves[2] = {};
    __builtin_memcpy(halves, pairs, (count < kCount ? count : kCount) * 2 * sizeof(double));
    *first = D{halves[0][0], halves[0][2], halves[1][0], halves[1][2]};
    *second = D{halves[0][1], halves[0][3], halves[1][1], halves[1][3]};
  }

  static V LowHalf(V a) { return And(a, All(0xffffffff)); }
  /// The first `count` lanes.
  static M FirstOf(uint32_t count) { return {V{0, 1, 2, 3} < All(count)}; }

  static V Gather(const int32_t* p, V i) { return V{p[i[0]], p[i[1]], p[i[2]], p[i[3]]}; }
  static V Gather(const uint32_t* p, V i) { return V{p[i[0]], p[i[1]], p[i[2]], p[i[3]]}; }
  static V Gather(const uint64_t* p, V i) {
    return Signed(UnsignedV{p[i[0]], p[i[1]], p[i[2]], p[i[3]]});
  }
  /// Lanes outside m are 0; they may read p[0].
  template <typename Number>
  static V Gather(M m, const Number* p, V i) {
    return And(m.bits, Gather(p, And(m.bits, i)));
  }
  /// table[i & 15].
  static V LookUp16(const int64_t* table, V i) {
    i &= All(15);
    return V{table[i[0]], table[i[1]], table[i[2]], table[i[3]]};
  }
  static void Store(M m, double* p, D a) {
    for (int i = 0; i < kCount; i++)
      if (m.bits[i] != 0) p[i] = a[i];
  }

  static D AllOf(double d) { return D{d, d, d, d}; }
  static D Plus(D a, D b) { return a + b; }
  static D Minus(D a, D b) { return a - b; }
  static D Times(D a, D b) { return a * b; }
  static D Divide(D a, D b) { return a / b; }
  static D DivideOr0(D a, D b) { return AsD(And(AsV(a / b), b != AllOf(0))); }

  /// Rounds towards 0. The results must fit in 32 bits.
  static V ToInteger(D a) { return __builtin_convertvector(__builtin_convertvector(a, Halves), V); }
  static D Magnitude(D a) { return AsD(And(AsV(a), All(INT64_MAX))); }
  using VectorLanes::Below;
  static M Below(D a, D b) { return {a < b}; }
  static M Zero(D a) { return {a == AllOf(0)}; }

  using VectorLanes::Select;
  /// Products of signed 32-bit numbers.
  static V Multiply(V a, V b) { return ToV(_mm256_mul_epi32(ToI(a), ToI(b))); }
  template <int kBits>
  static V Right(V a) {
    const V sign = All(int64_t{1} << (63 - kBits));
    return Subtract(Xor(Logical<kBits>(a), sign), sign);
  }
  static uint64_t BitsOf(M m) {
    return static_cast<uint64_t>(_mm256_movemask_pd(_mm256_castsi256_pd(ToI(m.bits))));
  }
  static D Select(M m, D a, D b) {
    return _mm256_blendv_pd(b, a, _mm256_castsi256_pd(ToI(m.bits)));
  }
  /// The numbers must be within 2^51 of 0.
  static D ToDouble(V a) { return AsD(Add(a, AsV(AllOf(kToBits)))) - AllOf(kToBits); }
  /// Returns b if both are zeros.
  static D Larger(D a, D b) { return _mm256_max_pd(a, b); }
  static D Smaller(D a, D b) { return _mm256_min_pd(a, b); }

  /// Bit (`bits` modulo 64) of each word, as the lowest bit. The other bits are unspecified.
  static V BitOf(V a, V bits) { return Signed(Bits(a) >> Bits(And(bits, All(63)))); }

 private:
  using Halves [[gnu::vector_size(kBytes / 2)]] = int32_t;
  using Floats [[gnu::vector_size(kBytes / 2)]] = float;

  // Reinterprets the bits.
  static V AsV(D a) { return reinterpret_cast<V>(a); }
  static D AsD(V a) { return reinterpret_cast<D>(a); }
  /// The low mantissa bits of kToBits + n are those of the integer n.
  static constexpr double kToBits = 0x1p52 + 0x1p51;

  /// Shifts in zeros.
  template <int kBits>
  static V Logical(V a) {
    return Signed(Bits(a) >> kBits);
  }
};

}  // namespace
}  // namespace Stg::internal::sensing

#endif
