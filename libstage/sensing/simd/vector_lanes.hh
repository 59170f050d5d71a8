// SPDX-License-Identifier: GPL-2.0-or-later
//
// Lanes for wide_walk_lanes.hh in 256-bit AVX2 vectors: the common part of four lanes of 64 bits
// (four_lanes.hh) and eight of 32 (eight_lanes.hh). Uses the vector extensions of GCC and Clang,
// and intrinsics where these generate poor code or lack an operation. The rules in
// wide_walk_lanes.hh for code that is compiled for particular processors apply here too.

#ifndef STAGE_SENSING_SIMD_VECTOR_LANES_HH
#define STAGE_SENSING_SIMD_VECTOR_LANES_HH

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
  /// Each lane is all ones or all zeros.
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
  /// Unsigned a < b. The sign bit of b must be 0.
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

  // Reinterprets the bits.
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
