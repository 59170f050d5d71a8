// SPDX-License-Identifier: GPL-2.0-or-later

#include "motion/body_index.hh"

#include <algorithm>
#include <atomic>
#include <cmath>

namespace Stg::motion {

namespace {
// Wider cells hold more boxes that are too far away; a search of narrower ones looks at more cells.
constexpr double kCellWidths = 2.0;
constexpr size_t kBoxGrain = 256;
constexpr double kEndless = 1e18;  // m; boxes as wide as this are compared with all others
}  // namespace

/// The widest box is in level 0, so that boxes of about the same width usually share a level.
void BodyIndex::SetLevels(double greatest) {
  scale_ = greatest > 0.0 ? 1.0 / greatest : 0.0;
  for (uint32_t level = 0; level < kLevels; level++) {
    const double widest = level == kEndlessLevel ? kEndless : greatest;
    levels_[level] = {0.501 * widest, kCellWidths * widest};
    greatest *= 0.25;
  }
}

uint32_t BodyIndex::LevelOf(double width) const {
  if (!(width < kEndless)) return kEndlessLevel;
  int exponent = 0;
  std::frexp(width * scale_, &exponent);  // 1 for the greatest width
  return static_cast<uint32_t>(std::clamp(-exponent / 2, 0, static_cast<int>(kEndlessLevel) - 1));
}

BodyIndex::Home BodyIndex::HomeOf(const Box& box) const {
  const uint32_t level = LevelOf(box.x1 - box.x0);
  const int32_t x = CellOf(0.5 * (box.x0 + box.x1), levels_[level].cell);
  const int32_t y = CellOf(0.5 * (box.y0 + box.y1), levels_[level].cell);
  return {BucketOf(x, y, level), y, level};
}

/// The greatest width of a box that is not endless.
double BodyIndex::GreatestWidth(const std::vector<Box>& boxes, threads::WorkerPool* workers) {
  std::atomic<double> greatest{0.0};
  threads::RunOn(workers, boxes.size(), kBoxGrain, [&](size_t begin, size_t end, unsigned) {
    double found = 0.0;
    for (size_t i = begin; i < end; i++) {
      const double width = boxes[i].x1 - boxes[i].x0;
      if (width > found && width < kEndless) found = width;
    }
    double known = greatest.load(std::memory_order_relaxed);
    while (found > known && !greatest.compare_exchange_weak(known, found)) {
    }
  });
  return greatest;
}

/// A counting sort of the boxes by buckets.
void BodyIndex::Fill(const std::vector<Box>& boxes, threads::WorkerPool* workers) {
  SetLevels(GreatestWidth(boxes, workers));
  count_ = static_cast<uint32_t>(boxes.size());
  uint32_t buckets = 16;
  while (buckets < 2 * count_) buckets *= 2;
  mask_ = buckets - 1;
  homes_.resize(count_);
  threads::RunOn(workers, count_, kBoxGrain, [&](size_t begin, size_t end, unsigned) {
    for (size_t i = begin; i < end; i++) homes_[i] = HomeOf(boxes[i]);
  });
  starts_.assign(size_t{buckets} + 1, 0);
  used_levels_ = 0;
  for (const Home& home : homes_) {
    starts_[home.bucket]++;
    used_levels_ |= 1u << home.level;
  }
  uint32_t sum = 0;
  for (uint32_t& start : starts_) start = sum += start;
  entries_.resize(count_);
  for (uint32_t i = count_; i-- > 0;)
    entries_[--starts_[homes_[i].bucket]] = {homes_[i].y, homes_[i].level, i};
}

}  // namespace Stg::motion
