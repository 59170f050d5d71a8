// SPDX-License-Identifier: GPL-2.0-or-later
//
// Lanes for wide_walk_lanes.hh in the 256 bits of AVX2. Written with the vectors of GCC and Clang;
// what these say badly or can't say is said in the processor's own words. This is what four lanes
// of 64 bits (four_lanes.hh) and eight of 32 (eight_lanes.hh) have in common. What
// wide_walk_lanes.hh says of code that is compiled for some processors only holds here too.

#ifndef STAGE_SENSING_VECTOR_LANES_HH
#define STAGE_SENSING_VECTOR_LANES_HH

#include <immintrin.h>

#include <cstdint>
#include <type_traits>

namespace Stg::internal::sensing {
namespace {

template <typename Integer>
struct VectorLanes {
  static constexpr int kBytes = 32;
  static constexpr int kCount = kBytes / sizeof(Integer);

  using Number = Integer;
  using V [[gnu::vector_size(kBytes)]] = Integer;
  /// All ones or none in each lane.
  struct M {
    V bits;
  };

  static V All(Integer n) { return V{} + n; }

  static V Add(V a, V b) { return Signed(Bits(a) + Bits(b)); }
  static V Subtract(V a, V b) { return Signed(Bits(a) - Bits(b)); }
  static V And(V a, V b) { return a & b; }
  static V Or(V a, V b) { return a | b; }
  static V Xor(V a, V b) { return a ^ b; }
  /// a & ~b.
  static V Without(V a, V b) { return a & ~b; }
  template <int kBits>
  static V Left(V a) {
    return Signed(Bits(a) << kBits);
  }
  static V SignOf(V a) { return a < All(0); }
  static V Absolute(V a) { return Subtract(Xor(a, SignOf(a)), SignOf(a)); }

  static M Greater(V a, V b) { return {a > b}; }
  /// As unsigned numbers, of which b has no sign.
  static M Below(V a, V b) { return {Without(b > a, SignOf(a))}; }
  static M Equal(V a, V b) { return {a == b}; }
  static M Differ(V a, V b) { return {a != b}; }
  static M Odd(V a) { return {And(a, All(1)) == All(1)}; }
  static M None() { return {All(0)}; }
  static M And(M a, M b) { return {a.bits & b.bits}; }
  static M Or(M a, M b) { return {a.bits | b.bits}; }
  static M AndNot(M a, M b) { return {a.bits & ~b.bits}; }
  static M Not(M a) { return {~a.bits}; }

  static bool Any(M m) { return !_mm256_testz_si256(ToI(m.bits), ToI(m.bits)); }
  static V Select(M m, V a, V b) { return ToV(_mm256_blendv_epi8(ToI(b), ToI(a), ToI(m.bits))); }

 protected:
  using UnsignedV [[gnu::vector_size(kBytes)]] = std::make_unsigned_t<Integer>;

  // The same bits as another type.
  static UnsignedV Bits(V a) { return reinterpret_cast<UnsignedV>(a); }
  static V Signed(UnsignedV a) { return reinterpret_cast<V>(a); }
  static __m256i ToI(V a) { return reinterpret_cast<__m256i>(a); }
  static V ToV(__m256i a) { return reinterpret_cast<V>(a); }

  template <typename Vector>
  static Vector Get(const void* p) {
    Vector vector;
    __builtin_memcpy(&vector, p, sizeof vector);
    return vector;
  }
  template <typename Vector>
  static void Put(void* p, Vector vector) {
    __builtin_memcpy(p, &vector, sizeof vector);
  }
};

}  // namespace
}  // namespace Stg::internal::sensing

#endif
