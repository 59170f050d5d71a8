// SPDX-License-Identifier: GPL-2.0-or-later
//
// Lanes for sensing/wide_walk_lanes.hh on any processor: plain arrays. With them the walk side by
// side is tested where there are no such vectors, with any number of lanes, and with sanitizers,
// which see each place that is read.
//
// Operations wrap where those of the vectors do: what comes out in lanes that have no ray is not
// used, but it must not be undefined.

#ifndef STAGE_TESTS_SUPPORT_PORTABLE_LANES_HH
#define STAGE_TESTS_SUPPORT_PORTABLE_LANES_HH

#include <bit>
#include <cstdint>
#include <cstring>
#include <limits>

namespace Stg::test {

template <int kLanes>
struct PortableLanes {
  struct V {
    int64_t n[kLanes];
  };
  struct D {
    double n[kLanes];
  };
  struct M {
    bool is[kLanes];
  };
  static constexpr int kCount = kLanes;

  static V All(int64_t n) {
    return Make<V>([&](int) { return n; });
  }
  static V Load(const int64_t* p) {
    return Make<V>([&](int i) { return p[i]; });
  }
  static V Load(const uint32_t* p) {
    return Make<V>([&](int i) { return int64_t{p[i]}; });
  }
  static D Load(const double* p) {
    return Make<D>([&](int i) { return p[i]; });
  }
  static void Store(uint32_t* p, V v) {
    for (int i = 0; i < kLanes; i++) p[i] = static_cast<uint32_t>(Bits(v.n[i]));
  }
  static void Store(int64_t* p, V v) { std::memcpy(p, v.n, sizeof(v.n)); }
  static void Store(double* p, D d) { std::memcpy(p, d.n, sizeof(d.n)); }
  /// The upper halves are filled with something else: nobody may look at them.
  static void LoadPairs(const void* pairs, uint32_t count, V* first, V* second) {
    *first = *second = All(0);
    for (uint32_t i = 0; i < count && i < kLanes; i++) {
      uint32_t pair[2];
      std::memcpy(pair, static_cast<const char*>(pairs) + i * sizeof(pair), sizeof(pair));
      first->n[i] = Signed(uint64_t{pair[1]} << 32 | pair[0]);
      second->n[i] = Signed(uint64_t{0xabcdef01} << 32 | pair[1]);
    }
  }

  static V Add(V a, V b) {
    return Make<V>([&](int i) { return Signed(Bits(a.n[i]) + Bits(b.n[i])); });
  }
  static V AddWhere(M m, V a, V b) { return Select(m, Add(a, b), a); }
  static V Subtract(V a, V b) {
    return Make<V>([&](int i) { return Signed(Bits(a.n[i]) - Bits(b.n[i])); });
  }
  static V LessOne(V a) { return Larger(Subtract(a, All(1)), All(0)); }
  /// Products of signed 32-bit numbers.
  static V Multiply(V a, V b) {
    return Make<V>([&](int i) {
      return int64_t{static_cast<int32_t>(a.n[i])} * static_cast<int32_t>(b.n[i]);
    });
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
    return Make<V>(
        [&](int i) { return Bits(bits.n[i]) < 64 ? Signed(Bits(a.n[i]) << bits.n[i]) : 0; });
  }
  static V ShiftRight(V a, V bits) {
    return Make<V>([&](int i) { return a.n[i] >> (Bits(bits.n[i]) < 64 ? bits.n[i] : 63); });
  }
  /// The others are all ones or none, by turns: nobody may look at them.
  static V BitOf(V a, V bits) {
    return Make<V>([&](int i) {
      const int64_t others = i % 2 == 0 ? ~int64_t{1} : 0;
      return (Bits(a.n[i]) >> (bits.n[i] & 63) & 1) == 1 ? others | 1 : others;
    });
  }
  static V SignOf(V a) { return Right<63>(a); }
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
  static M Equal(V a, V b) {
    return Mask([&](int i) { return a.n[i] == b.n[i]; });
  }
  static M Differ(V a, V b) { return Not(Equal(a, b)); }
  static M Odd(V a) {
    return Mask([&](int i) { return (a.n[i] & 1) != 0; });
  }
  static M MaskOf(V all_ones_or_none) { return Greater(All(0), all_ones_or_none); }
  static M Zero(V a) { return Equal(a, All(0)); }
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

  static V Gather(const int32_t* p, V places) {
    return Make<V>([&](int i) { return int64_t{p[places.n[i]]}; });
  }
  static V Gather(const uint32_t* p, V places) {
    return Make<V>([&](int i) { return int64_t{p[places.n[i]]}; });
  }
  static V Gather(const uint64_t* p, V places) {
    return Make<V>([&](int i) { return Signed(p[places.n[i]]); });
  }
  static V Gather(M m, const uint32_t* p, V places) {
    return Make<V>([&](int i) { return m.is[i] ? int64_t{p[places.n[i]]} : 0; });
  }
  static V Gather(M m, const uint64_t* p, V places) {
    return Make<V>([&](int i) { return m.is[i] ? Signed(p[places.n[i]]) : 0; });
  }
  static V OfSixteen(const int64_t* table, V i) {
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
  static V Expand(M m, const int64_t* p, V other) {
    return Make<V>([&](int i) { return m.is[i] ? *p++ : other.n[i]; });
  }
  static D Expand(M m, const double* p, D other) {
    return Make<D>([&](int i) { return m.is[i] ? *p++ : other.n[i]; });
  }
  static V Rank(M m, uint32_t first) {
    return Make<V>([&](int i) { return m.is[i] ? int64_t{first++} : -1; });
  }

  static D ToDouble(V a) {
    return Make<D>([&](int i) { return static_cast<double>(a.n[i]); });
  }
  /// Of what is too large: the smallest number.
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
  static uint64_t Bits(int64_t n) { return static_cast<uint64_t>(n); }
  static int64_t Signed(uint64_t bits) { return std::bit_cast<int64_t>(bits); }
  /// f(0), f(1) and so on, in this order.
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

}  // namespace Stg::test

#endif
