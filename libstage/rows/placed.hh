// SPDX-License-Identifier: GPL-2.0-or-later

#ifndef STAGE_ROWS_PLACED_HH
#define STAGE_ROWS_PLACED_HH

#include <bit>
#include <cmath>
#include <cstdint>

#include "geometry/geometry.hh"
#include "geometry/trigonometry.hh"

namespace Stg::rows {

/// normalize() without a call for angles that are in range.
inline double Normalized(double a) { return a >= -M_PI && a <= M_PI ? a : normalize(a); }

/// Sines and cosines of angles that were asked for lately: robots that do not turn, also those of
/// other worlds, have the same headings.
class TurnMemory {
 public:
  const SineCosine& Of(double angle) {
    const auto bits = std::bit_cast<uint64_t>(angle);
    Entry& entry = entries_[bits * 0x9e3779b97f4a7c15u >> (64 - kLogEntries)];
    if (entry.bits != bits) entry = {bits, SinCos(angle)};
    return entry.turn;
  }

 private:
  static constexpr int kLogEntries = 5;
  struct Entry {
    uint64_t bits = 0;  // those of 0.0
    SineCosine turn = SinCos(0.0);
  };
  Entry entries_[1 << kLogEntries];
};

/// A pose in the plane with the sine and cosine of its heading. Sums have the bits of sums of Pose;
/// sines are computed only if the heading changes.
struct Placed {
  double x, y, a;
  SineCosine turn;

  Placed operator+(const Pose& p) const {
    return Plus(p, [](double angle) { return SinCos(angle); });
  }
  /// The sum, with the sine and cosine that turn_of(angle) returns.
  template <typename F>
  Placed Plus(const Pose& p, F turn_of) const {
    Placed sum{x + p.x * turn.cosine - p.y * turn.sine, y + p.x * turn.sine + p.y * turn.cosine,
               Normalized(a + p.a), turn};
    if (std::bit_cast<uint64_t>(sum.a) != std::bit_cast<uint64_t>(a)) sum.turn = turn_of(sum.a);
    return sum;
  }
};

/// Placed with sines from a memory.
struct RememberedPlaced {
  Placed place;
  TurnMemory* memory;

  RememberedPlaced operator+(const Pose& p) const {
    return {place.Plus(p, [&](double angle) { return memory->Of(angle); }), memory};
  }
};

}  // namespace Stg::rows

#endif
