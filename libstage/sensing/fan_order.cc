// SPDX-License-Identifier: GPL-2.0-or-later

#include "sensing/fan_order.hh"

#include <algorithm>

#include "messages/assert.hh"
#include "sensing/ray_group.hh"

namespace Stg::internal::sensing {

namespace {

/// Inserts a zero bit after each bit of the number.
uint64_t Spread(uint32_t number) {
  uint64_t bits = number;
  bits = (bits | bits << 16) & 0x0000ffff0000ffff;
  bits = (bits | bits << 8) & 0x00ff00ff00ff00ff;
  bits = (bits | bits << 4) & 0x0f0f0f0f0f0f0f0f;
  bits = (bits | bits << 2) & 0x3333333333333333;
  return (bits | bits << 1) & 0x5555555555555555;
}

}  // namespace

/// Index of the cell's tile on the Z-order curve (G. M. Morton, 1966).
uint64_t PlaceKeyOf(int32_t cell_x, int32_t cell_y) {
  constexpr uint32_t kSign = 0x80000000u;
  const uint32_t x = static_cast<uint32_t>(cell_x) ^ kSign;
  const uint32_t y = static_cast<uint32_t>(cell_y) ^ kSign;
  return Spread(x >> RAY_TILE_SHIFT) | Spread(y >> RAY_TILE_SHIFT) << 1;
}

const std::vector<FanInterval>& FanOrder::Of(const RayBatch& batch) {
  Update(batch);
  return order_;
}

const std::vector<FanInterval>& FanOrder::InBatch(const RayBatch& batch) {
  Update(batch);
  return in_batch_;
}

void FanOrder::Update(const RayBatch& batch) {
  constexpr unsigned kMaxAge = 50;
  const std::span<const Fan> fans = batch.fans();
  if (fans_ == fans.size() && ++age_ < kMaxAge) return;
  age_ = 0;
  fans_ = static_cast<uint32_t>(fans.size());
  MakeIntervals(fans);
  Sort(fans);
}

void FanOrder::MakeIntervals(std::span<const Fan> fans) {
  in_batch_.clear();
  uint32_t rays = 0;
  for (uint32_t i = 0; i < fans.size(); i++) {
    const uint32_t samples = fans[i].record.samples;
    if (!in_batch_.empty() && fans[i].finder == fans[i - 1].finder &&
        rays + samples <= RayGroup::kMaxRays) {
      in_batch_.back().count++;
      rays += samples;
      continue;
    }
    in_batch_.push_back({i, 1});
    rays = samples;
  }
  STAGE_ASSERT(in_batch_.empty() || in_batch_.back().first + in_batch_.back().count == fans.size());
}

void FanOrder::Sort(std::span<const Fan> fans) {
  keyed_.clear();
  for (const FanInterval& interval : in_batch_) {
    const FanRecord& first = fans[interval.first].record;
    keyed_.push_back({PlaceKeyOf(first.x, first.y), interval});
  }
  std::sort(keyed_.begin(), keyed_.end(), [](const Keyed& a, const Keyed& b) {
    return a.key != b.key ? a.key < b.key : a.interval.first < b.interval.first;
  });
  order_.clear();
  for (const Keyed& keyed : keyed_) order_.push_back(keyed.interval);
  STAGE_ASSERT(order_.size() == in_batch_.size());
}

}  // namespace Stg::internal::sensing
