// SPDX-License-Identifier: GPL-2.0-or-later
//
// Lanes for sensing/simd/wide_walk_lanes.hh as plain arrays, for any processor. They allow to test
// the vectorized walk on processors without vectors, with any number of lanes, and with sanitizers,
// which check each read.
//
// Operations wrap as those of vectors do, because the unused results of inactive lanes must not be
// undefined behaviour.

#ifndef STAGE_TESTS_SUPPORT_PORTABLE_LANES_HH
#define STAGE_TESTS_SUPPORT_PORTABLE_LANES_HH

#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <type_traits>

namespace Stg::test {

/// kLanes lanes of 64 bits, or of 32 bits with Integer = int32_t.
template <int kLanes, typename Integer = int64_t>
struct PortableLanes {
  using Number = Integer;
  using Unsigned = std::make_unsigned_t<Number>;
  static constexpr int kNumberBits = 8 * sizeof(Number);
  struct V {
    Number n[kLanes];
  };
  struct D {
    double n[kLanes];
  };
  struct F {
    float n[kLanes];
  };
  struct M {
    bool is[kLanes];
  };
  static constexpr int kCount = kLanes;

  static V All(Number n) {
    return Make<V>([&](int) { return n; });
  }
  template <typename Other>
  static V Load(const Other* p) {
    return Make<V>([&](int i) { return static_cast<Number>(p[i]); });
  }
  static D Load(const double* p) {
    return Make<D>([&](int i) { return p[i]; });
  }
  static void Store(uint32_t* p, V v) {
    for (int i = 0; i < kLanes; i++) p[i] = static_cast<uint32_t>(Bits(v.n[i]));
  }
  static void Store(int32_t* p, V v) {
    for (int i = 0; i < kLanes; i++) p[i] = static_cast<int32_t>(v.n[i]);
  }
  static void Store(int64_t* p, V v) { std::memcpy(p, v.n, sizeof(v.n)); }
  static void Store(float* p, D d) {
    for (int i = 0; i < kLanes; i++) p[i] = static_cast<float>(d.n[i]);
  }
  static void Store(double* p, D d) { std::memcpy(p, d.n, sizeof(d.n)); }
  /// The upper halves of lanes are filled with garbage, because callers must not use them.
  static void LoadPairs(const void* pairs, uint32_t count, V* first, V* second) {
    *first = *second = All(0);
    for (uint32_t i = 0; i < count && i < kLanes; i++) {
      uint32_t pair[2];
      std::memcpy(pair, static_cast<const char*>(pairs) + i * sizeof(pair), sizeof(pair));
      first->n[i] = Signed(uint64_t{pair[1]} << 32 | pair[0]);
      second->n[i] = Signed(uint64_t{0xabcdef01} << 32 | pair[1]);
    }
  }
  static void LoadPairs(const void* pairs, uint32_t count, D* first, D* second) {
    *first = *second = AllOf(0);
    for (uint32_t i = 0; i < count && i < kLanes; i++) {
      double pair[2];
      std::memcpy(pair, static_cast<const char*>(pairs) + i * sizeof(pair), sizeof(pair));
      first->n[i] = pair[0];
      second->n[i] = pair[1];
    }
  }

  static V Add(V a, V b) {
    return Make<V>([&](int i) { return Signed(Bits(a.n[i]) + Bits(b.n[i])); });
  }
  static V AddWhere(M m, V a, V b) { return Select(m, Add(a, b), a); }
  static V Subtract(V a, V b) {
    return Make<V>([&](int i) { return Signed(Bits(a.n[i]) - Bits(b.n[i])); });
  }
  static V DecrementOr0(V a) { return Larger(Subtract(a, All(1)), All(0)); }
  /// Products of signed 32-bit numbers.
  static V Multiply(V a, V b) {
    return Make<V>([&](int i) { return static_cast<Number>(Product(a.n[i], b.n[i])); });
  }
  static V LowHalf(V a) {
    return Make<V>([&](int i) { return static_cast<Number>(Bits(a.n[i]) & 0xffffffff); });
  }
  static V And(V a, V b) {
    return Make<V>([&](int i) { return a.n[i] & b.n[i]; });
  }
  static V Or(V a, V b) {
    return Make<V>([&](int i) { return a.n[i] | b.n[i]; });
  }
  static V Xor(V a, V b) {
    return Make<V>([&](int i) { return a.n[i] ^ b.n[i]; });
  }
  static V Without(V a, V b) {
    return Make<V>([&](int i) { return a.n[i] & ~b.n[i]; });
  }
  static V OddOr(V a, V b) { return Or(And(a, All(1)), b); }
  template <int kBits>
  static V Left(V a) {
    return ShiftLeft(a, All(kBits));
  }
  template <int kBits>
  static V Right(V a) {
    return ShiftRight(a, All(kBits));
  }
  static V ShiftLeft(V a, V bits) {
    return Make<V>([&](int i) {
      return Bits(bits.n[i]) < kNumberBits ? Signed(Bits(a.n[i]) << bits.n[i]) : 0;
    });
  }
  static V ShiftRight(V a, V bits) {
    return Make<V>([&](int i) {
      return a.n[i] >> (Bits(bits.n[i]) < kNumberBits ? bits.n[i] : kNumberBits - 1);
    });
  }
  /// Only bit 0 is valid. The others are garbage, all ones or all zeros in turn.
  static V BitOf(V a, V bits) {
    return Make<V>([&](int i) {
      const int64_t others = i % 2 == 0 ? ~int64_t{1} : 0;
      return (Bits(a.n[i]) >> (bits.n[i] & 63) & 1) == 1 ? others | 1 : others;
    });
  }
  static V SignOf(V a) { return Right<kNumberBits - 1>(a); }
  static V Absolute(V a) {
    return Make<V>([&](int i) { return a.n[i] < 0 ? Signed(0 - Bits(a.n[i])) : a.n[i]; });
  }
  static V Larger(V a, V b) { return Select(Greater(a, b), a, b); }

  static M Greater(V a, V b) {
    return Mask([&](int i) { return a.n[i] > b.n[i]; });
  }
  static M Below(V a, V b) {
    return Mask([&](int i) { return Bits(a.n[i]) < Bits(b.n[i]); });
  }
  static M Below(D a, D b) {
    return Mask([&](int i) { return a.n[i] < b.n[i]; });
  }
  static M Equal(V a, V b) {
    return Mask([&](int i) { return a.n[i] == b.n[i]; });
  }
  static M Differ(V a, V b) { return Not(Equal(a, b)); }
  static M Odd(V a) {
    return Mask([&](int i) { return (a.n[i] & 1) != 0; });
  }
  static M MaskOf(V all_ones_or_none) { return Greater(All(0), all_ones_or_none); }
  static M Zero(V a) { return Equal(a, All(0)); }
  static M Zero(D a) {
    return Mask([&](int i) { return a.n[i] == 0; });
  }
  static M None() {
    return Mask([](int) { return false; });
  }
  static M And(M a, M b) {
    return Mask([&](int i) { return a.is[i] && b.is[i]; });
  }
  static M Or(M a, M b) {
    return Mask([&](int i) { return a.is[i] || b.is[i]; });
  }
  static M AndNot(M a, M b) { return And(a, Not(b)); }
  static M Not(M a) {
    return Mask([&](int i) { return !a.is[i]; });
  }
  static bool Any(M m) { return CountOf(m) != 0; }
  static uint64_t BitsOf(M m) {
    uint64_t bits = 0;
    for (int i = 0; i < kLanes; i++) bits |= uint64_t{m.is[i]} << i;
    return bits;
  }
  static int CountOf(M m) {
    int count = 0;
    for (const bool is : m.is) count += is;
    return count;
  }
  static M FirstOf(uint32_t count) {
    return Mask([&](int i) { return static_cast<uint32_t>(i) < count; });
  }
  static M First(M m, int count) {
    return Mask([&](int i) { return m.is[i] && count-- > 0; });
  }
  static V Select(M m, V a, V b) {
    return Make<V>([&](int i) { return m.is[i] ? a.n[i] : b.n[i]; });
  }
  static D Select(M m, D a, D b) {
    return Make<D>([&](int i) { return m.is[i] ? a.n[i] : b.n[i]; });
  }

  template <typename Other>
  static V Gather(const Other* p, V places) {
    return Make<V>([&](int i) { return static_cast<Number>(p[places.n[i]]); });
  }
  template <typename Other>
  static V Gather(M m, const Other* p, V places) {
    return Make<V>([&](int i) { return m.is[i] ? static_cast<Number>(p[places.n[i]]) : 0; });
  }
  static V LookUp16(const Number* table, V i) {
    return Make<V>([&](int k) { return table[i.n[k] & 15]; });
  }
  static void Scatter(M m, uint32_t* p, V places, V a) {
    for (int i = 0; i < kLanes; i++)
      if (m.is[i]) p[places.n[i]] = static_cast<uint32_t>(a.n[i]);
  }
  static void Store(M m, double* p, D a) {
    for (int i = 0; i < kLanes; i++)
      if (m.is[i]) p[i] = a.n[i];
  }
  static D ToDouble(V a) {
    return Make<D>([&](int i) { return static_cast<double>(a.n[i]); });
  }
  /// Values that don't fit become the smallest integer.
  static V ToInteger(D a) {
    return Make<V>([&](int i) {
      const bool fits = a.n[i] > -0x1p63 && a.n[i] < 0x1p63;
      return fits ? static_cast<int64_t>(a.n[i]) : std::numeric_limits<int64_t>::min();
    });
  }
  static D AllOf(double d) {
    return Make<D>([&](int) { return d; });
  }
  static D Plus(D a, D b) {
    return Make<D>([&](int i) { return a.n[i] + b.n[i]; });
  }
  static D Minus(D a, D b) {
    return Make<D>([&](int i) { return a.n[i] - b.n[i]; });
  }
  static D Magnitude(D a) {
    return Make<D>([&](int i) { return std::fabs(a.n[i]); });
  }
  static D Times(D a, D b) {
    return Make<D>([&](int i) { return a.n[i] * b.n[i]; });
  }
  static D Divide(D a, D b) {
    return Make<D>([&](int i) { return a.n[i] / b.n[i]; });
  }
  static D DivideOr0(D a, D b) {
    return Make<D>([&](int i) { return b.n[i] == 0 ? 0 : a.n[i] / b.n[i]; });
  }
  static D Larger(D a, D b) {
    return Make<D>([&](int i) { return a.n[i] > b.n[i] ? a.n[i] : b.n[i]; });
  }
  static D Smaller(D a, D b) {
    return Make<D>([&](int i) { return a.n[i] < b.n[i] ? a.n[i] : b.n[i]; });
  }

 private:
  static Unsigned Bits(Number n) { return static_cast<Unsigned>(n); }
  static Number Signed(Unsigned bits) { return static_cast<Number>(bits); }
  static int64_t Product(Number a, Number b) {
    return int64_t{static_cast<int32_t>(a)} * static_cast<int32_t>(b);
  }
  /// Makes lanes from f(0), f(1), ..., called in this order.
  template <typename Numbers, typename F>
  static Numbers Make(F f) {
    Numbers numbers;
    for (int i = 0; i < kLanes; i++) numbers.n[i] = f(i);
    return numbers;
  }
  template <typename F>
  static M Mask(F f) {
    M mask;
    for (int i = 0; i < kLanes; i++) mask.is[i] = f(i);
    return mask;
  }
};

/// Lanes of 32 bits, with the additional operations that only these need.
template <int kLanes>
struct PortableNarrowLanes : PortableLanes<kLanes, int32_t> {
  using Base = PortableLanes<kLanes, int32_t>;
  using Base::BitOf;
  using Base::Gather;
  using Base::Load;
  using Base::LookUp16;
  using Base::Select;
  using Base::Without;
  using Base::Zero;
  using typename Base::F;
  using typename Base::M;
  using typename Base::V;
  struct Words {
    uint64_t n[kLanes];
  };
  /// For each active lane, the number of active lanes before it.
  struct Places {
    int n[kLanes];
  };

  static F Load(const float* p) {
    return Each<F>([&](int i) { return p[i]; });
  }
  static Words Without(const Words& a, const Words& b) {
    return Each<Words>([&](int i) { return a.n[i] & ~b.n[i]; });
  }
  static M Zero(const Words& a) {
    M mask;
    for (int i = 0; i < kLanes; i++) mask.is[i] = a.n[i] == 0;
    return mask;
  }
  static Words Select(M m, const Words& a, const Words& b) {
    return Each<Words>([&](int i) { return m.is[i] ? a.n[i] : b.n[i]; });
  }
  static F Select(M m, F a, F b) {
    return Each<F>([&](int i) { return m.is[i] ? a.n[i] : b.n[i]; });
  }
  /// Only bit 0 is valid. The others are garbage, all ones or all zeros in turn.
  static V BitOf(const Words& a, V bits) {
    return Each<V>([&](int i) {
      const int32_t others = i % 2 == 0 ? ~1 : 0;
      return (a.n[i] >> (bits.n[i] & 63) & 1) == 1 ? others | 1 : others;
    });
  }
  /// Looks up table[i], 0 <= i <= 15, in a table of 64-bit words whose halves are `low` and `high`.
  static Words LookUp16(const int32_t* low, const int32_t* high, V places) {
    return Each<Words>([&](int i) {
      const int place = places.n[i] & 15;
      return uint64_t{static_cast<uint32_t>(low[place])} |
             uint64_t{static_cast<uint32_t>(high[place])} << 32;
    });
  }
  static Words Gather(const uint64_t* p, V places) {
    return Each<Words>([&](int i) { return p[static_cast<uint32_t>(places.n[i])]; });
  }
  static Words Gather(M m, const uint64_t* p, V places) {
    return Each<Words>([&](int i) { return m.is[i] ? p[static_cast<uint32_t>(places.n[i])] : 0; });
  }
  static Places PlacesOf(M m) {
    int next = 0;
    return Each<Places>([&](int i) { return m.is[i] ? next++ : 0; });
  }
  static V Expand(M m, const Places& places, const int32_t* p, V other) {
    return Each<V>([&](int i) { return m.is[i] ? p[places.n[i]] : other.n[i]; });
  }
  static F Expand(M m, const Places& places, const float* p, F other) {
    return Each<F>([&](int i) { return m.is[i] ? p[places.n[i]] : other.n[i]; });
  }
  static V Rank(const Places& places, uint32_t first) {
    return Each<V>([&](int i) { return places.n[i] + static_cast<int32_t>(first); });
  }
  /// (a * b - c * d) >> bits. It wraps, as vectors do in inactive lanes.
  static V ProductsRight(V a, V b, V c, V d, V bits) {
    return Each<V>([&](int i) {
      const uint64_t difference = Product(a.n[i], b.n[i]) - Product(c.n[i], d.n[i]);
      return static_cast<int32_t>(difference >> (bits.n[i] & 63));
    });
  }
  static M ProductsBelow(V a, V b, V c, V d, M ties) {
    M mask;
    for (int i = 0; i < kLanes; i++) {
      const uint64_t behind = Product(a.n[i], b.n[i]) - Product(c.n[i], d.n[i]);
      mask.is[i] = static_cast<int64_t>(behind) < 0 || (behind == 0 && ties.is[i]);
    }
    return mask;
  }
  static F ToFloat(V a) {
    return Each<F>([&](int i) { return static_cast<float>(a.n[i]); });
  }
  /// Values that don't fit become the smallest integer.
  static V ToInteger(F a) {
    return Each<V>([&](int i) {
      const bool fits = a.n[i] > -0x1p31f && a.n[i] < 0x1p31f;
      return fits ? static_cast<int32_t>(a.n[i]) : std::numeric_limits<int32_t>::min();
    });
  }
  static F AllOf(float f) {
    return Each<F>([&](int) { return f; });
  }
  static F Times(F a, F b) {
    return Each<F>([&](int i) { return a.n[i] * b.n[i]; });
  }
  static F Smaller(F a, F b) {
    return Each<F>([&](int i) { return a.n[i] < b.n[i] ? a.n[i] : b.n[i]; });
  }

 private:
  static uint64_t Product(int32_t a, int32_t b) { return static_cast<uint64_t>(int64_t{a} * b); }
  template <typename Numbers, typename F1>
  static Numbers Each(F1 f) {
    Numbers numbers;
    for (int i = 0; i < kLanes; i++) numbers.n[i] = f(i);
    return numbers;
  }
};

}  // namespace Stg::test

#endif
