// SPDX-License-Identifier: GPL-2.0-or-later
//
// MeetOneByOne() in the lanes of a vector, bit-equal. The rules in wide_walk_lanes.hh for code that
// is compiled for particular processors apply here too.

#ifndef STAGE_SENSING_SIMD_WIDE_OUTLINES_HH
#define STAGE_SENSING_SIMD_WIDE_OUTLINES_HH

#include <cstdint>

#include "sensing/crossing.hh"
#include "sensing/outline_rays.hh"
#include "sensing/simd/wide_rays.hh"

namespace Stg::internal::sensing {
namespace {

/// FirstCrossing() for several lines with a common start.
template <class Lanes>
class LineLanes {
 public:
  using D = typename Lanes::D;
  using M = typename Lanes::M;

  LineLanes(double x, double y, D sines, D cosines)
      : x_(x), y_(y), sines_(sines), cosines_(cosines) {}

  D FirstCrossing(const OutlineEdges& some) const {
    D nearest = All(kNone);
    Corner to{};
    int located = 0;  // index of the corner in `to`
    for (uint32_t edges = some.edges; edges != 0; edges &= edges - 1) {
      const int i = __builtin_ctz(edges);
      const Corner from = i == located && i != 0 ? to : Locate(some.corners[i]);
      located = i + 1;
      to = Locate(some.corners[located]);
      const M meet = Meet(from, to);
      if (Lanes::Any(meet))
        nearest =
            Lanes::Smaller(Lanes::Select(meet, Crossing(meet, from, to), All(kNone)), nearest);
    }
    return nearest;
  }

 private:
  static constexpr double kNone = __builtin_inf();
  static D All(double number) { return Lanes::AllOf(number); }

  /// A corner relative to the lines, see crossing.cc.
  struct Corner {
    D along, side;
    double error_bound;  // equal for all lines
  };

  Corner Locate(const point_t& p) const {
    const double error_bound = RoundingAt(p, x_, y_);
    const D dx = All(p.x - x_), dy = All(p.y - y_);
    const D side = Lanes::Minus(Lanes::Times(cosines_, dy), Lanes::Times(sines_, dx));
    const D along = Lanes::Plus(Lanes::Times(cosines_, dx), Lanes::Times(sines_, dy));
    const M far = Lanes::Below(All(error_bound), Lanes::Magnitude(side));
    return {along, Lanes::Select(far, side, All(0)), error_bound};
  }

  /// Lines that have the corners on different sides, or pass through one.
  static M Meet(const Corner& a, const Corner& b) {
    const M left = Lanes::And(Lanes::Below(All(0), a.side), Lanes::Below(All(0), b.side));
    const M right = Lanes::And(Lanes::Below(a.side, All(0)), Lanes::Below(b.side, All(0)));
    return Lanes::Not(Lanes::Or(left, right));
  }

  static D Crossing(M meet, const Corner& a, const Corner& b) {
    const M on_a = Lanes::Zero(a.side), on_b = Lanes::Zero(b.side);
    const D fraction = Lanes::Divide(a.side, Lanes::Minus(a.side, b.side));
    const D between = Lanes::Plus(a.along, Lanes::Times(Lanes::Minus(b.along, a.along), fraction));
    const D nearer = Lanes::Smaller(b.along, a.along);
    const D along = Lanes::Select(on_a, Lanes::Select(on_b, nearer, a.along),
                                  Lanes::Select(on_b, b.along, between));
    const M behind = Lanes::Below(along, All(0));
    if (!Lanes::Any(Lanes::And(meet, behind))) return along;
    return Lanes::Select(behind, Behind(along, a, b), along);
  }

  /// Handles crossings behind the start.
  static D Behind(D along, const Corner& a, const Corner& b) {
    const D error_bound = All(a.error_bound > b.error_bound ? a.error_bound : b.error_bound),
            none = All(0);
    const D across = Lanes::Magnitude(Lanes::Minus(a.side, b.side));
    const D length = Lanes::Plus(across, Lanes::Magnitude(Lanes::Minus(a.along, b.along)));
    const D farther = Lanes::Larger(a.along, b.along);
    const M off_edge = Lanes::Below(farther, Lanes::Minus(none, error_bound));
    const M off = Lanes::Below(Lanes::Times(error_bound, length),
                               Lanes::Times(Lanes::Minus(none, along), across));
    const M along_edge = Lanes::Zero(across);
    const M missed = Lanes::Or(Lanes::And(along_edge, off_edge), Lanes::AndNot(off, along_edge));
    return Lanes::Select(missed, All(kNone), none);
  }

  const double x_, y_;
  const D sines_, cosines_;
};

/// One axis of several legs.
template <class Lanes>
struct LegLanes {
  using V = typename Lanes::V;
  using D = typename Lanes::D;
  using M = typename Lanes::M;

  V cell;          // start cell
  V offset;        // offset of the start in it, in the direction of travel
  V displacement;  // Q16 cells

  /// Lanes that stay in the tile of the cell `borders` away within this fraction of the leg.
  M StayInTile(V borders, D fraction) const {
    const V back = Lanes::SignOf(displacement);
    const V reached = Lanes::Xor(Reached<Lanes>(cell, borders, back), back);
    const V gone = Lanes::And(reached, All(kSide - 1));  // from the tile's near side
    const V border = Lanes::Subtract(Lanes::Add(borders, All(kSide)), gone);
    const D size = Lanes::ToDouble(Lanes::Absolute(displacement));
    const V limit = Lanes::Add(Lanes::ToInteger(Lanes::Times(fraction, size)), All(1));
    return Lanes::Greater(Lanes::Subtract(Lanes::template Left<16>(border), offset), limit);
  }

 private:
  static constexpr int kSide = 1 << RAY_TILE_SHIFT;
  static V All(int64_t number) { return Lanes::All(number); }
};

/// Lanes of the rays from `first` on for which the outline at `ranges` is certainly the nearest.
template <class Lanes>
typename Lanes::M ResolvedLanes(const OutlineRays& rays, uint32_t first, typename Lanes::D ranges) {
  using V = typename Lanes::V;
  const FanRecord& fan = rays.fan->record;
  const auto beyond = Lanes::Below(Lanes::AllOf(rays.fan->range), ranges);
  const auto fraction =
      Lanes::Smaller(Lanes::Divide(ranges, Lanes::AllOf(rays.fan->leg_length)), Lanes::AllOf(1.0));
  V dx, dy;
  Displace<Lanes>(fan, rays.directions + first, rays.count - first, &dx, &dy);
  const V hits = Lanes::Load(rays.hits + first);
  const V u = Lanes::And(hits, Lanes::All(0xffff)), v = Lanes::template Right<16>(hits);
  const LegLanes<Lanes> x{Lanes::All(fan.x), OffsetOf<Lanes>(fan.fraction & 0xffff, dx), dx};
  const LegLanes<Lanes> y{Lanes::All(fan.y), OffsetOf<Lanes>(fan.fraction >> 16, dy), dy};
  return Lanes::AndNot(Lanes::And(x.StayInTile(u, fraction), y.StayInTile(v, fraction)), beyond);
}

template <class Lanes>
void MeetInLanes(const OutlineRays& rays, const Outlines& outlines, OutlineHits* found) {
  static_assert(64 % Lanes::kCount == 0, "vectors must divide a word of settled rays evenly");
  using D = typename Lanes::D;
  using V = typename Lanes::V;
  const Fan& fan = *rays.fan;
  const D sine = Lanes::AllOf(fan.heading.sine), cosine = Lanes::AllOf(fan.heading.cosine);
  for (uint64_t& word : found->resolved.words) word = 0;
  for (uint32_t first = 0; first < rays.count; first += Lanes::kCount) {
    D sines, cosines;
    Lanes::LoadPairs(rays.unit_vectors + first, rays.count - first, &sines, &cosines);
    // LineOf() in lanes.
    const LineLanes<Lanes> lines(
        fan.x, fan.y, Lanes::Plus(Lanes::Times(sine, cosines), Lanes::Times(cosine, sines)),
        Lanes::Minus(Lanes::Times(cosine, cosines), Lanes::Times(sine, sines)));
    D nearest = Lanes::AllOf(__builtin_inf());
    V which = Lanes::All(0);
    for (uint32_t k = 0; k < outlines.count; k++) {
      const D ranges = lines.FirstCrossing(outlines.edges[k]);
      which = Lanes::Select(Lanes::Below(ranges, nearest), Lanes::All(int64_t{k}), which);
      nearest = Lanes::Smaller(ranges, nearest);
    }
    Lanes::Store(found->ranges + first, nearest);
    Lanes::Store(found->which + first, which);
    found->resolved.words[first / 64] |= Lanes::BitsOf(ResolvedLanes<Lanes>(rays, first, nearest))
                                         << first % 64;
  }
}

}  // namespace
}  // namespace Stg::internal::sensing

#endif
