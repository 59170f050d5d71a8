// SPDX-License-Identifier: GPL-2.0-or-later
//
// The outlines of what stands and never moves, and an index of them by place.

#ifndef STAGE_MOTION_WALLS_HH
#define STAGE_MOTION_WALLS_HH

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "motion/body_index.hh"
#include "motion/columns.hh"
#include "motion/shape.hh"
#include "motion/vector.hh"

namespace Stg::motion {

/// An edge of an outline.
struct WallEdge {
  Vector ends[2];
  // Unit vectors along the edges that continue the outline at each end, away from the end; zero
  // where it ends.
  Vector beyond[2];
  Interval height;
  double friction;
  uint32_t group, outline;
};

class Walls {
 public:
  /// Adds an outline, closed or open. Returns its number. Index() must be called afterwards.
  uint32_t Add(std::span<const Vector> corners, bool closed, Interval height = {-1e9, 1e9},
               double friction = 0.0, uint32_t group = kNoGroup);

  /// Adds all outlines of others. Index() must be called afterwards.
  void Append(const Walls& others);
  /// The edges from number `first` on, before `last`: whole outlines, which are numbered from 0.
  Walls Part(size_t first, size_t last) const;
  void Clear();

  /// Sorts the edges into cells.
  void Index();

  const std::vector<WallEdge>& edges() const { return edges_; }
  uint32_t outlines() const { return outline_count_; }

  /// The index, for devices.
  struct IndexContent {
    Box bounds;
    double cell;            ///< m
    int64_t columns, rows;  ///< of cells
    std::span<const uint32_t> starts, entries;
  };
  IndexContent index() const { return {bounds_, cell_, columns_, rows_, starts_, entries_}; }

  /// Calls f(edge number) once for each edge whose box overlaps `box`, in no particular order.
  template <typename F>
  void ForEachNear(const Box& box, F f) const;

 private:
  struct Cells {
    int32_t x0, y0, x1, y1;
  };
  static void FindBeyond(std::span<WallEdge> outline, bool closed);
  void ChooseCells();
  static Box BoxOf(const WallEdge& edge);
  Cells CellsOf(const Box& box) const;
  int32_t CellOf(double position, double origin, int64_t count) const;

  std::vector<WallEdge> edges_;
  uint32_t outline_count_ = 0;
  Box bounds_{0, 0, 0, 0};
  double cell_ = 1.0;
  int64_t columns_ = 0, rows_ = 0;
  std::vector<uint32_t> starts_, entries_;  // entries of cell c: starts_[c] to starts_[c + 1]
  std::vector<Cells> boxes_;                // of the edges, while they are sorted
};

inline Box Walls::BoxOf(const WallEdge& edge) {
  const Vector a = edge.ends[0], b = edge.ends[1];
  return {Least(a.x, b.x), Least(a.y, b.y), Most(a.x, b.x), Most(a.y, b.y)};
}

inline int32_t Walls::CellOf(double position, double origin, int64_t count) const {
  const double cell = (position - origin) / cell_;
  if (!(cell > 0.0)) return 0;
  return static_cast<int32_t>(cell < static_cast<double>(count) ? static_cast<int64_t>(cell)
                                                                : count - 1);
}

inline Walls::Cells Walls::CellsOf(const Box& box) const {
  return {CellOf(box.x0, bounds_.x0, columns_), CellOf(box.y0, bounds_.y0, rows_),
          CellOf(box.x1, bounds_.x0, columns_), CellOf(box.y1, bounds_.y0, rows_)};
}

template <typename F>
void Walls::ForEachNear(const Box& box, F f) const {
  if (edges_.empty() || !Overlap(box, bounds_)) return;
  const Cells near = CellsOf(box);
  for (int64_t y = near.y0; y <= near.y1; y++)
    for (int64_t x = near.x0; x <= near.x1; x++) {
      const auto cell = static_cast<size_t>(y * columns_ + x);
      for (uint32_t k = starts_[cell]; k < starts_[cell + 1]; k++) {
        const Box edge_box = BoxOf(edges_[entries_[k]]);
        if (!Overlap(box, edge_box)) continue;
        // Told in the first cell that both boxes cover, so that it is told once.
        const Cells own = CellsOf(edge_box);
        const int32_t first_x = own.x0 < near.x0 ? near.x0 : own.x0;
        const int32_t first_y = own.y0 < near.y0 ? near.y0 : own.y0;
        if (first_x == x && first_y == y) f(entries_[k]);
      }
    }
}

}  // namespace Stg::motion

#endif
