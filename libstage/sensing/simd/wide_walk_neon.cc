// SPDX-License-Identifier: GPL-2.0-or-later
//
// For 64-bit Arm processors, all of which have NEON.

#ifdef STAGE_WALK_NEON

#include <arm_neon.h>

#include <cstdint>

#include "sensing/simd/wide_walk_lanes.hh"

namespace Stg::internal::sensing {

namespace {

/// 64-bit lanes, for the work before and after the walk.
struct Two {
  using Number = int64_t;
  using V = int64x2_t;
  using D = float64x2_t;
  using M = uint64x2_t;  // each lane is all ones or all zeros
  static constexpr int kCount = 2;

  static V All(int64_t n) { return vdupq_n_s64(n); }
  static V Load(const int64_t* p) { return vld1q_s64(p); }
  static V Load(const uint32_t* p) { return vreinterpretq_s64_u64(vmovl_u32(vld1_u32(p))); }
  static V Load(const int32_t* p) { return vmovl_s32(vld1_s32(p)); }
  static D Load(const double* p) { return vld1q_f64(p); }
  static void Store(int64_t* p, V v) { vst1q_s64(p, v); }
  static void Store(double* p, D d) { vst1q_f64(p, d); }
  /// Stores the lower halves.
  static void Store(uint32_t* p, V v) { vst1_u32(p, vmovn_u64(Bits(v))); }
  static void Store(int32_t* p, V v) { vst1_s32(p, vmovn_s64(v)); }
  static void Store(float* p, D d) { vst1_f32(p, vcvt_f32_f64(d)); }
  /// Loads up to two pairs of 32-bit numbers into lower halves of lanes, as for Multiply().
  static void LoadPairs(const void* pairs, uint32_t count, V* first, V* second) {
    int64_t words[kCount] = {};
    __builtin_memcpy(words, pairs, (count < kCount ? count : kCount) * sizeof words[0]);
    *first = Load(words);
    *second = vreinterpretq_s64_u64(vshrq_n_u64(Bits(*first), 32));
  }
  /// Loads up to two pairs of doubles.
  static void LoadPairs(const void* pairs, uint32_t count, D* first, D* second) {
    double words[2 * kCount] = {};
    __builtin_memcpy(words, pairs, (count < kCount ? count : kCount) * 2 * sizeof words[0]);
    const float64x2x2_t both = vld2q_f64(words);
    *first = both.val[0];
    *second = both.val[1];
  }

  static V Add(V a, V b) { return vaddq_s64(a, b); }
  static V Subtract(V a, V b) { return vsubq_s64(a, b); }
  /// Products of signed 32-bit numbers.
  static V Multiply(V a, V b) { return vmull_s32(vmovn_s64(a), vmovn_s64(b)); }
  static V LowHalf(V a) { return And(a, All(0xffffffff)); }
  static V And(V a, V b) { return vandq_s64(a, b); }
  static V Or(V a, V b) { return vorrq_s64(a, b); }
  static V Xor(V a, V b) { return veorq_s64(a, b); }
  /// a & ~b.
  static V Without(V a, V b) { return vbicq_s64(a, b); }
  template <int kBits>
  static V Left(V a) {
    return vshlq_n_s64(a, kBits);
  }
  template <int kBits>
  static V Right(V a) {
    return vshrq_n_s64(a, kBits);
  }
  /// Bit (`bits` modulo 64) of each word, as the lowest bit. The other bits are unspecified.
  static V BitOf(V a, V bits) {
    return vreinterpretq_s64_u64(vshlq_u64(Bits(a), vnegq_s64(And(bits, All(63)))));
  }
  static V SignOf(V a) { return vshrq_n_s64(a, 63); }
  static V Absolute(V a) { return vabsq_s64(a); }

  static M Greater(V a, V b) { return vcgtq_s64(a, b); }
  /// Unsigned a < b.
  static M Below(V a, V b) { return vcltq_u64(Bits(a), Bits(b)); }
  static M Below(D a, D b) { return vcltq_f64(a, b); }
  static M Equal(V a, V b) { return vceqq_s64(a, b); }
  static M Differ(V a, V b) { return Not(Equal(a, b)); }
  static M Odd(V a) { return vtstq_s64(a, All(1)); }
  static M Zero(D a) { return vceqzq_f64(a); }
  static M None() { return vdupq_n_u64(0); }
  static M And(M a, M b) { return vandq_u64(a, b); }
  static M Or(M a, M b) { return vorrq_u64(a, b); }
  static M AndNot(M a, M b) { return vbicq_u64(a, b); }
  static M Not(M a) { return vreinterpretq_u64_u32(vmvnq_u32(vreinterpretq_u32_u64(a))); }
  static bool Any(M m) { return vmaxvq_u32(vreinterpretq_u32_u64(m)) != 0; }
  static uint64_t BitsOf(M m) { return (vgetq_lane_u64(m, 0) & 1) | (vgetq_lane_u64(m, 1) & 2); }
  /// The first `count` lanes.
  static M FirstOf(uint32_t count) {
    const uint64_t lanes[] = {0, 1};
    return vcltq_u64(vld1q_u64(lanes), vdupq_n_u64(count));
  }
  static V Select(M m, V a, V b) { return vbslq_s64(m, a, b); }
  static D Select(M m, D a, D b) { return vbslq_f64(m, a, b); }

  template <typename Integer>
  static V Gather(const Integer* p, V i) {
    return V{static_cast<int64_t>(p[vgetq_lane_s64(i, 0)]),
             static_cast<int64_t>(p[vgetq_lane_s64(i, 1)])};
  }
  /// Lanes outside m are 0; they may read p[0].
  template <typename Integer>
  static V Gather(M m, const Integer* p, V i) {
    const V mask = vreinterpretq_s64_u64(m);
    return And(mask, Gather(p, And(mask, i)));
  }
  /// table[i & 15].
  static V LookUp16(const int64_t* table, V i) { return Gather(table, And(i, All(15))); }
  static void Store(M m, double* p, D a) {
    if (vgetq_lane_u64(m, 0) != 0) p[0] = vgetq_lane_f64(a, 0);
    if (vgetq_lane_u64(m, 1) != 0) p[1] = vgetq_lane_f64(a, 1);
  }

  static D ToDouble(V a) { return vcvtq_f64_s64(a); }
  /// Rounds towards 0. The results must fit in 32 bits.
  static V ToInteger(D a) { return vcvtq_s64_f64(a); }
  static D AllOf(double d) { return vdupq_n_f64(d); }
  static D Plus(D a, D b) { return vaddq_f64(a, b); }
  static D Minus(D a, D b) { return vsubq_f64(a, b); }
  static D Times(D a, D b) { return vmulq_f64(a, b); }
  static D Divide(D a, D b) { return vdivq_f64(a, b); }
  static D DivideOr0(D a, D b) { return Select(Zero(b), AllOf(0), Divide(a, b)); }
  /// Returns b if both are zeros.
  static D Larger(D a, D b) { return Select(vcgtq_f64(a, b), a, b); }
  static D Smaller(D a, D b) { return Select(vcltq_f64(a, b), a, b); }
  static D Magnitude(D a) { return vabsq_f64(a); }

 private:
  static uint64x2_t Bits(V a) { return vreinterpretq_u64_s64(a); }
};

/// 32-bit lanes, for the walk.
struct Four {
  using Number = int32_t;
  using V = int32x4_t;
  using F = float32x4_t;
  using M = uint32x4_t;  // each lane is all ones or all zeros
  static constexpr int kCount = 4;
  /// One 64-bit word per lane, as lower and upper halves.
  struct Words {
    V low, high;
  };
  /// For each lane, the index of its number in a sequence for Expand().
  using Places = V;

  static V All(int32_t n) { return vdupq_n_s32(n); }
  static V Load(const int32_t* p) { return vld1q_s32(p); }
  static F Load(const float* p) { return vld1q_f32(p); }
  static void Store(int32_t* p, V v) { vst1q_s32(p, v); }

  static V Add(V a, V b) { return vaddq_s32(a, b); }
  static V AddWhere(M m, V a, V b) { return Add(a, And(Signed(m), b)); }
  static V Subtract(V a, V b) { return vsubq_s32(a, b); }
  static V Multiply(V a, V b) { return vmulq_s32(a, b); }
  /// max(a - 1, 0).
  static V DecrementOr0(V a) { return vmaxq_s32(Subtract(a, All(1)), All(0)); }
  static V LowHalf(V a) { return a; }
  static V And(V a, V b) { return vandq_s32(a, b); }
  static V Or(V a, V b) { return vorrq_s32(a, b); }
  static V Xor(V a, V b) { return veorq_s32(a, b); }
  /// a & ~b.
  static V Without(V a, V b) { return vbicq_s32(a, b); }
  static Words Without(const Words& a, const Words& b) {
    return {Without(a.low, b.low), Without(a.high, b.high)};
  }
  /// (a & 1) | b.
  static V OddOr(V a, V b) { return Or(And(a, All(1)), b); }
  template <int kBits>
  static V Left(V a) {
    return vshlq_n_s32(a, kBits);
  }
  template <int kBits>
  static V Right(V a) {
    return vshrq_n_s32(a, kBits);
  }
  static V ShiftLeft(V a, V bits) { return vshlq_s32(a, bits); }
  static V ShiftRight(V a, V bits) { return vshlq_s32(a, vnegq_s32(bits)); }
  /// Bit (`bits` modulo 64) of each word, as the lowest bit. The other bits are unspecified.
  static V BitOf(const Words& a, V bits) {
    const V half = Select(vtstq_s32(bits, All(32)), a.high, a.low);
    return Signed(vshlq_u32(Bits(half), vnegq_s32(And(bits, All(31)))));
  }
  static V SignOf(V a) { return vshrq_n_s32(a, 31); }
  static V Absolute(V a) { return vabsq_s32(a); }
  static V Larger(V a, V b) { return vmaxq_s32(a, b); }

  static M Greater(V a, V b) { return vcgtq_s32(a, b); }
  /// Unsigned a < b.
  static M Below(V a, V b) { return vcltq_u32(Bits(a), Bits(b)); }
  static M Equal(V a, V b) { return vceqq_s32(a, b); }
  static M Differ(V a, V b) { return Not(Equal(a, b)); }
  static M Odd(V a) { return vtstq_s32(a, All(1)); }
  static M MaskOf(V all_ones_or_none) { return Bits(all_ones_or_none); }
  static M Zero(V a) { return vceqzq_s32(a); }
  static M Zero(const Words& a) { return Zero(Or(a.low, a.high)); }
  static M None() { return vdupq_n_u32(0); }
  static M And(M a, M b) { return vandq_u32(a, b); }
  static M Or(M a, M b) { return vorrq_u32(a, b); }
  static M AndNot(M a, M b) { return vbicq_u32(a, b); }
  static M Not(M a) { return vmvnq_u32(a); }
  static bool Any(M m) { return vmaxvq_u32(m) != 0; }
  static int CountOf(M m) { return -vaddvq_s32(Signed(m)); }
  /// The first `count` lanes of m.
  static M First(M m, int count) { return And(m, vcltq_s32(PlacesOf(m), All(count))); }
  static V Select(M m, V a, V b) { return vbslq_s32(m, a, b); }
  static F Select(M m, F a, F b) { return vbslq_f32(m, a, b); }
  static Words Select(M m, const Words& a, const Words& b) {
    return {Select(m, a.low, b.low), Select(m, a.high, b.high)};
  }

  template <typename Integer>
  static V Gather(const Integer* p, V i) {
    const auto at = [&](auto lane) { return static_cast<int32_t>(p[lane]); };
    return V{at(PlaceAt<0>(i)), at(PlaceAt<1>(i)), at(PlaceAt<2>(i)), at(PlaceAt<3>(i))};
  }
  static Words Gather(const uint64_t* p, V i) {
    const uint64x2_t first = {p[PlaceAt<0>(i)], p[PlaceAt<1>(i)]};
    const uint64x2_t second = {p[PlaceAt<2>(i)], p[PlaceAt<3>(i)]};
    const V low = vreinterpretq_s32_u64(first), high = vreinterpretq_s32_u64(second);
    return {vuzp1q_s32(low, high), vuzp2q_s32(low, high)};
  }
  /// Lanes outside m are 0; they may read p[0].
  static Words Gather(M m, const uint64_t* p, V i) {
    const Words words = Gather(p, And(Signed(m), i));
    return {And(Signed(m), words.low), And(Signed(m), words.high)};
  }
  /// table[i & 15].
  static V LookUp16(const int32_t* table, V i) {
    uint8x16x4_t bytes;
    for (int k = 0; k < 4; k++) bytes.val[k] = vreinterpretq_u8_s32(Load(table + 4 * k));
    return vreinterpretq_s32_u8(vqtbl4q_u8(bytes, BytesOf(And(i, All(15)))));
  }
  /// 64-bit table entries, given as tables of lower and upper halves.
  static Words LookUp16(const int32_t* low, const int32_t* high, V i) {
    return {LookUp16(low, i), LookUp16(high, i)};
  }
  static void Scatter(M m, uint32_t* p, V i, V a) {
    uint32_t is[kCount], numbers[kCount];
    int32_t places[kCount];
    vst1q_u32(is, m);
    vst1q_u32(numbers, Bits(a));
    vst1q_s32(places, i);
    for (int k = 0; k < kCount; k++)
      if (is[k] != 0) p[places[k]] = numbers[k];
  }
  /// Assigns consecutive indices to the lanes of m: the number of such lanes before each.
  static Places PlacesOf(M m) {
    const V none = All(0);
    V before = vextq_s32(none, Signed(m), 3);
    before = Add(before, vextq_s32(none, before, 3));
    before = Add(before, vextq_s32(none, vextq_s32(none, Signed(m), 3), 2));
    return vnegq_s32(before);
  }
  static V Expand(M m, Places places, const int32_t* p, V other) {
    const uint8x16_t next = vqtbl1q_u8(vreinterpretq_u8_s32(Load(p)), BytesOf(places));
    return Select(m, vreinterpretq_s32_u8(next), other);
  }
  static F Expand(M m, Places places, const float* p, F other) {
    const uint8x16_t next = vqtbl1q_u8(vreinterpretq_u8_f32(Load(p)), BytesOf(places));
    return Select(m, vreinterpretq_f32_u8(next), other);
  }
  /// Returns first, first + 1, ... in these lanes.
  static V Rank(Places places, uint32_t first) {
    return Add(places, All(static_cast<int32_t>(first)));
  }

  /// Lower halves of (a * b - c * d) >> bits, with bits at most 32.
  static V ProductsRight(V a, V b, V c, V d, V bits) {
    const V left = vnegq_s32(bits);
    const int64x2_t low = vshlq_s64(LowDifference(a, b, c, d), vmovl_s32(vget_low_s32(left)));
    const int64x2_t high = vshlq_s64(HighDifference(a, b, c, d), vmovl_high_s32(left));
    return vmovn_high_s64(vmovn_s64(low), high);
  }
  /// a * b < c * d, or <= where `ties`.
  static M ProductsBelow(V a, V b, V c, V d, M ties) {
    const V less_one = Signed(ties);
    const int64x2_t low = vaddw_s32(LowDifference(a, b, c, d), vget_low_s32(less_one));
    const int64x2_t high = vaddw_high_s32(HighDifference(a, b, c, d), less_one);
    return vmovn_high_u64(vmovn_u64(vcltzq_s64(low)), vcltzq_s64(high));
  }
  static F ToFloat(V a) { return vcvtq_f32_s32(a); }
  /// Rounds towards 0.
  static V ToInteger(F a) { return vcvtq_s32_f32(a); }
  static F AllOf(float f) { return vdupq_n_f32(f); }
  static F Times(F a, F b) { return vmulq_f32(a, b); }
  static F Smaller(F a, F b) { return Select(vcltq_f32(a, b), a, b); }

 private:
  // Reinterprets the bits.
  static uint32x4_t Bits(V a) { return vreinterpretq_u32_s32(a); }
  static V Signed(uint32x4_t a) { return vreinterpretq_s32_u32(a); }

  template <int kLane>
  static uint32_t PlaceAt(V i) {
    return vgetq_lane_u32(Bits(i), kLane);
  }
  /// Byte indices of the 32-bit numbers with these indices, for a table lookup.
  static uint8x16_t BytesOf(V numbers) {
    return vreinterpretq_u8_s32(vmlaq_n_s32(All(0x03020100), numbers, 0x04040404));
  }
  /// a * b - c * d in 64 bits: LowDifference() for lanes 0 and 1, the next one for lanes 2 and 3.
  static int64x2_t LowDifference(V a, V b, V c, V d) {
    return vmlsl_s32(vmull_s32(vget_low_s32(a), vget_low_s32(b)), vget_low_s32(c), vget_low_s32(d));
  }
  static int64x2_t HighDifference(V a, V b, V c, V d) {
    return vmlsl_high_s32(vmull_high_s32(a, b), c, d);
  }
};

}  // namespace

extern const WideWalk kWalkNeon;
const WideWalk kWalkNeon{"neon", WalkInLanes<Two, Four>, EvaluateInLanes<Two>, MeetInLanes<Two>};

}  // namespace Stg::internal::sensing

#endif
