// SPDX-License-Identifier: GPL-2.0-or-later

#include "motion/body_index.hh"

#include <algorithm>
#include <cmath>

namespace Stg::motion {

namespace {
// Wider cells hold more boxes that are too far away; a search of narrower ones looks at more cells.
constexpr double kCellWidths = 2.0;
constexpr double kEndless = 1e18;  // m; boxes as wide as this are compared with all others
}  // namespace

/// Finds the levels that are used, and the level of each box. The widest box is in level 0, so that
/// boxes of about the same width usually share a level.
void BodyIndex::FindLevels(const std::vector<Box>& boxes) {
  double greatest = 0.0;
  for (const Box& box : boxes) {
    const double width = box.x1 - box.x0;
    if (width < kEndless && width > greatest) greatest = width;
  }
  constexpr double kUnused = -1.0;
  double widest[kLevels];
  std::fill(widest, widest + kLevels, kUnused);
  level_of_.resize(boxes.size());
  const double scale = greatest > 0.0 ? 1.0 / greatest : 0.0;
  for (size_t i = 0; i < boxes.size(); i++) {
    const double width = boxes[i].x1 - boxes[i].x0;
    uint32_t level = kEndlessLevel;
    if (width < kEndless) {
      int exponent = 0;
      std::frexp(width * scale, &exponent);
      level = static_cast<uint32_t>(std::clamp(-exponent / 2, 0, static_cast<int>(kLevels) - 2));
      widest[level] = Most(widest[level], width);
    } else {
      widest[level] = kEndless;
    }
    level_of_[i] = static_cast<uint8_t>(level);
  }
  levels_.clear();
  uint8_t place[kLevels] = {};
  for (uint32_t k = 0; k < kLevels; k++) {
    const uint32_t level = kLevels - 1 - (k + 1) % kLevels;  // by increasing size, the endless last
    if (widest[level] == kUnused) continue;
    place[level] = static_cast<uint8_t>(levels_.size());
    levels_.push_back({level, 0.501 * widest[level], kCellWidths * widest[level]});
  }
  for (uint8_t& level : level_of_) level = place[level];
}

BodyIndex::Home BodyIndex::HomeOf(const Box& box, const Level& level) const {
  const int32_t x = CellOf(0.5 * (box.x0 + box.x1), level.cell);
  const int32_t y = CellOf(0.5 * (box.y0 + box.y1), level.cell);
  return {BucketOf(x, y, level.number), y};
}

/// A counting sort of the boxes by buckets.
void BodyIndex::Fill(const std::vector<Box>& boxes) {
  FindLevels(boxes);
  count_ = static_cast<uint32_t>(boxes.size());
  uint32_t buckets = 16;
  while (buckets < 2 * count_) buckets *= 2;
  mask_ = buckets - 1;
  starts_.assign(size_t{buckets} + 1, 0);
  homes_.resize(count_);
  for (uint32_t i = 0; i < count_; i++) {
    homes_[i] = HomeOf(boxes[i], levels_[level_of_[i]]);
    starts_[homes_[i].bucket]++;
  }
  uint32_t sum = 0;
  for (uint32_t& start : starts_) start = sum += start;
  entries_.resize(count_);
  for (uint32_t i = count_; i-- > 0;)
    entries_[--starts_[homes_[i].bucket]] = {homes_[i].y, levels_[level_of_[i]].number, i};
}

}  // namespace Stg::motion
