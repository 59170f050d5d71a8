// SPDX-License-Identifier: GPL-2.0-or-later
//
// An index of boxes by place, for boxes of very different sizes.
//
// A hash table of hierarchical grids: each box is entered once, in the cell of its centre, in the
// grid of its level. The widths of a level differ by less than a factor of 4, and its cells are
// wider than all of its boxes. A search looks through a few cells of each level.

#ifndef STAGE_MOTION_BODY_INDEX_HH
#define STAGE_MOTION_BODY_INDEX_HH

#include <cstddef>
#include <cstdint>
#include <vector>

#include "motion/vector.hh"
#include "threads/worker_pool.hh"

namespace Stg::motion {

/// An axis-parallel box.
struct Box {
  double x0, y0, x1, y1;
};

inline bool Overlap(const Box& a, const Box& b) {
  return a.x0 <= b.x1 && b.x0 <= a.x1 && a.y0 <= b.y1 && b.y0 <= a.y1;
}

class BodyIndex {
 public:
  /// Enters all boxes, which are squares, on the threads of `workers` unless it is null. The number
  /// of a box is that of its body.
  void Fill(const std::vector<Box>& boxes, threads::WorkerPool* workers = nullptr);

  /// Calls f(other) for all boxes that may overlap that of `body`: those of its level with greater
  /// numbers, and those of higher levels. All calls for all bodies together mention each pair once.
  template <typename F>
  void ForEachPartner(uint32_t body, const Box& box, F f) const;

  /// Calls f(other) once for all boxes that may overlap `box`.
  template <typename F>
  void ForEachNear(const Box& box, F f) const;

 private:
  struct Entry {
    int32_t y;
    uint32_t level, body;
  };
  struct Home {
    uint32_t bucket;
    int32_t y;
    uint32_t level;
  };
  struct Level {
    double margin;  // half the width of the widest box, and some more for rounding
    double cell;
  };
  static constexpr uint32_t kLevels = 32, kEndlessLevel = kLevels - 1;

  static double GreatestWidth(const std::vector<Box>& boxes, threads::WorkerPool* workers);
  void SetLevels(double greatest);
  uint32_t LevelOf(double width) const;
  static int32_t CellOf(double position, double cell);
  uint32_t BucketOf(int32_t x, int32_t y, uint32_t level) const;
  Home HomeOf(const Box& box) const;
  template <typename F>
  void SearchLevel(uint32_t number, const Box& box, F f) const;

  uint32_t mask_ = 0, count_ = 0;
  Level levels_[kLevels] = {};    // by decreasing size, except for the endless one
  uint32_t used_levels_ = 0;      // a set of bits
  double scale_ = 0.0;            // 1 / the greatest width
  std::vector<Home> homes_;       // of each body
  std::vector<uint32_t> starts_;  // entries of bucket b: starts_[b] to starts_[b + 1]
  std::vector<Entry> entries_;
};

inline int32_t BodyIndex::CellOf(double position, double cell) {
  constexpr int32_t kFar = 1'000'000'000;
  const double quotient = position / cell;
  if (!(quotient > -kFar)) return -kFar;
  if (quotient > kFar) return kFar;
  const int32_t truncated = static_cast<int32_t>(quotient);
  return truncated - (static_cast<double>(truncated) > quotient ? 1 : 0);
}

/// Adjacent cells of a row have adjacent buckets.
inline uint32_t BodyIndex::BucketOf(int32_t x, int32_t y, uint32_t level) const {
  return (static_cast<uint32_t>(x) + static_cast<uint32_t>(y) * 0x9e3779b1u + level * 0x85ebca77u) &
         mask_;
}

template <typename F>
void BodyIndex::SearchLevel(uint32_t number, const Box& box, F f) const {
  const Level& level = levels_[number];
  const int32_t x0 = CellOf(box.x0 - level.margin, level.cell);
  const int32_t x1 = CellOf(box.x1 + level.margin, level.cell);
  const int32_t y0 = CellOf(box.y0 - level.margin, level.cell);
  const int32_t y1 = CellOf(box.y1 + level.margin, level.cell);
  const int64_t width = int64_t{x1} - x0 + 1, height = int64_t{y1} - y0 + 1;
  // More cells than bodies, or the level of boxes without end, which have no centre.
  if (width > mask_ || height > count_ || number == kEndlessLevel) {
    for (uint32_t body = 0; body < count_; body++)
      if (homes_[body].level == number) f(body);
    return;
  }
  for (int32_t y = y0; y <= y1; y++) {
    const uint32_t first = BucketOf(x0, y, number), last = BucketOf(x1, y, number);
    const auto search = [&](uint32_t from, uint32_t to) {
      for (uint32_t k = starts_[from]; k < starts_[to + 1]; k++)
        if (entries_[k].y == y && entries_[k].level == number) f(entries_[k].body);
    };
    if (first <= last) {
      search(first, last);
    } else {  // around the end of the table
      search(first, mask_);
      search(0, last);
    }
  }
}

template <typename F>
void BodyIndex::ForEachPartner(uint32_t body, const Box& box, F f) const {
  const uint32_t own = homes_[body].level;
  SearchLevel(own, box, [&](uint32_t other) {
    if (other > body) f(other);
  });
  if (own == kEndlessLevel) return;
  for (uint32_t level = 0; level < own; level++)
    if (used_levels_ >> level & 1) SearchLevel(level, box, f);
  if (used_levels_ >> kEndlessLevel & 1) SearchLevel(kEndlessLevel, box, f);
}

template <typename F>
void BodyIndex::ForEachNear(const Box& box, F f) const {
  for (uint32_t level = 0; level < kLevels; level++)
    if (used_levels_ >> level & 1) SearchLevel(level, box, f);
}

}  // namespace Stg::motion

#endif
