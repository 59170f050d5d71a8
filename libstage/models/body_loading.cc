// SPDX-License-Identifier: GPL-2.0-or-later
//
// World-file properties of whole bodies: missing heights, and the frame of a picture.

#include <algorithm>
#include <limits>
#include <utility>

#include "models/body.hh"

namespace Stg {

void BlockGroup::AddWithoutHeights(std::vector<point_t> points) {
  Add(std::move(points), Bounds(0, 1));
  blocks_.back()->fills_height_ = true;
}

void BlockGroup::FillHeights() {
  Bounds z(0, 0);
  for (const auto& block : blocks_) {
    if (block->fills_height_) continue;
    z.min = std::min(z.min, block->source_z_.min);
    z.max = std::max(z.max, block->source_z_.max);
  }
  if (!(z.max > z.min)) z.max = 1;
  for (const auto& block : blocks_) {
    if (block->fills_height_) block->source_z_ = block->z_ = z;
    block->fills_height_ = false;
  }
}

void BlockGroup::SetFrame(Bounds x, Bounds y) {
  NoteChange();
  frame_x_ = x;
  frame_y_ = y;
}

bool BlockGroup::IsFlat() const {
  const bounds3d_t box = BoundingBox();
  return !blocks_.empty() && !(box.z.max - box.z.min > std::numeric_limits<double>::epsilon());
}

}  // namespace Stg
