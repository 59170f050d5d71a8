// SPDX-License-Identifier: GPL-2.0-or-later

#include "sensing/outline_rays.hh"

#include <algorithm>
#include <cstdlib>
#include <iterator>

#include "sensing/crossing.hh"

namespace Stg::internal::sensing {

namespace {

/// A leg as it goes along one axis.
struct Axis {
  int32_t cell;      // that it begins in
  int fraction;      // and where in there, Q16
  int displacement;  // Q16 cells
};

/// True if the leg's walk, which ends after this share of it, does not leave the tile of the cell
/// that lies so many borders away.
bool StaysInTile(const Axis& axis, int borders, double share) {
  constexpr int kSide = 1 << RAY_TILE_SHIFT;
  const bool back = axis.displacement < 0;
  const int offset = back ? 65536 - axis.fraction : axis.fraction;
  const int32_t reached = back ? ~(axis.cell - borders) : axis.cell + borders;
  const int next_tile = borders + kSide - (reached & (kSide - 1));
  return (next_tile << 16) - offset > LimitOf(share, std::abs(axis.displacement));
}

}  // namespace

void MeetOneByOne(const OutlineRays& rays, const OutlineEdges& edges, double* ranges) {
  for (uint32_t i = 0; i < rays.count; i++)
    ranges[i] = FirstCrossing(LineOf(*rays.fan, rays.turns[i]), edges.corners, edges.edges);
}

void SettleOneByOne(const OutlineRays& rays, const double* ranges, SettledRays* settled) {
  const Fan& fan = *rays.fan;
  const FanRecord& record = fan.record;
  std::fill(std::begin(settled->words), std::end(settled->words), 0);
  for (uint32_t i = 0; i < rays.count; i++) {
    if (!(ranges[i] <= fan.range)) continue;
    const Direction& d = rays.directions[i];
    const double share = ShareOfLeg(ranges[i], fan.leg_length);
    const Axis x{record.x, static_cast<int>(record.fraction & 0xffff),
                 ray_rotate_x(record.cosine, record.sine, d.cosine, d.sine)};
    const Axis y{record.y, static_cast<int>(record.fraction >> 16),
                 ray_rotate_y(record.cosine, record.sine, d.cosine, d.sine)};
    const bool stays = StaysInTile(x, ray_packed_u(rays.hits[i]), share) &&
                       StaysInTile(y, ray_packed_v(rays.hits[i]), share);
    settled->words[i / 64] |= uint64_t{stays} << i % 64;
  }
}

}  // namespace Stg::internal::sensing
