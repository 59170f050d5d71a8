// SPDX-License-Identifier: GPL-2.0-or-later

#include "sensing/outline_rays.hh"

#include <algorithm>
#include <cstdlib>
#include <iterator>
#include <limits>

#include "messages/assert.hh"
#include "sensing/crossing.hh"

namespace Stg::internal::sensing {

namespace {

constexpr int kSide = 1 << RAY_TILE_SHIFT;

/// One axis of a leg, seen from a cell that lies `borders` borders from its start.
class Axis {
 public:
  Axis(int32_t start, uint32_t fraction, int displacement, int borders)
      : displacement_(displacement),
        offset_(static_cast<int>(displacement < 0 ? 65536 - fraction : fraction)),
        cell_(displacement < 0 ? start - borders : start + borders),
        next_tile_(borders + kSide - ((displacement < 0 ? ~cell_ : cell_) & (kSide - 1))) {}

  int32_t cell() const { return cell_; }
  /// A cell of the next tile.
  int32_t behind() const { return displacement_ < 0 ? cell_ - kSide : cell_ + kSide; }
  /// Number of further tiles (at most 2) that the leg reaches if it ends after this fraction of it.
  uint32_t TilesBehind(double leg_fraction) const {
    const int limit = BorderLimit(leg_fraction, std::abs(displacement_));
    if ((next_tile_ << 16) - offset_ > limit) return 0;
    return ((next_tile_ + kSide) << 16) - offset_ > limit ? 1 : 2;
  }

 private:
  int displacement_, offset_;
  int32_t cell_;
  int next_tile_;  // index of the border to the next tile
};

}  // namespace

LegEnd FindLegEnd(const FanRecord& fan, const Direction& d, uint32_t hit, double leg_fraction) {
  STAGE_ASSERT(leg_fraction >= 0 && leg_fraction <= 1 && hit != RAY_NO_HIT);
  const Displacement way = DisplacementOf(fan, d);
  const Axis x(fan.x, fan.fraction & 0xffff, way.x, ray_packed_u(hit));
  const Axis y(fan.y, fan.fraction >> 16, way.y, ray_packed_v(hit));
  const uint32_t in_x = x.TilesBehind(leg_fraction), in_y = y.TilesBehind(leg_fraction);
  return {std::min(in_x + in_y, 2u), in_x == 1 ? x.behind() : x.cell(),
          in_y == 1 ? y.behind() : y.cell()};
}

namespace {

/// Finds the nearest outline of one ray: stores its range and index.
void MeetOne(const OutlineRays& rays, uint32_t ray, const Outlines& outlines, OutlineHits* found) {
  const Line line = LineOf(*rays.fan, rays.unit_vectors[ray]);
  double& nearest = found->ranges[ray] = std::numeric_limits<double>::infinity();
  uint32_t& which = found->which[ray] = 0;
  for (uint32_t i = 0; i < outlines.count; i++) {
    const OutlineEdges& some = outlines.edges[i];
    STAGE_ASSERT(some.corners && some.edges != 0);
    const double range = FirstCrossing(line, some.corners, some.edges);
    if (!(range < nearest)) continue;
    nearest = range;
    which = i;
  }
}

}  // namespace

void MeetOneByOne(const OutlineRays& rays, const Outlines& outlines, OutlineHits* found) {
  const Fan& fan = *rays.fan;
  std::fill(std::begin(found->resolved.words), std::end(found->resolved.words), 0);
  for (uint32_t i = 0; i < rays.count; i++) {
    MeetOne(rays, i, outlines, found);
    const double range = found->ranges[i];
    if (!(range <= fan.range)) continue;
    const double leg_fraction = FractionOfLeg(range, fan.leg_length);
    const LegEnd end = FindLegEnd(fan.record, rays.directions[i], rays.hits[i], leg_fraction);
    found->resolved.words[i / 64] |= uint64_t{end.tiles == 0} << i % 64;
  }
}

}  // namespace Stg::internal::sensing
