// SPDX-License-Identifier: GPL-2.0-or-later

#include "motion/walls.hh"

#include "messages/assert.hh"

namespace Stg::motion {
namespace {

constexpr double kMaxIndexCells = 4e6;

Vector Direction(Vector from, Vector to) {
  const Vector difference = to - from;
  const double length = Length(difference);
  return length > 0.0 ? (1.0 / length) * difference : Vector{};
}

}  // namespace

uint32_t Walls::Add(std::span<const Vector> corners, bool closed, Interval height, double friction,
                    uint32_t group) {
  const size_t n = corners.size(), first = edges_.size();
  const size_t count = closed ? n : n - 1;
  for (size_t i = 0; i < count; i++) {
    const Vector from = corners[i], to = corners[i + 1 < n ? i + 1 : 0];
    edges_.push_back(
        {{from, to}, {Direction(from, to), {}}, height, friction, group, outline_count_});
  }
  if (count > 0) FindBeyond(std::span(edges_).subspan(first), closed);
  return outline_count_++;
}

/// Finds the directions beyond the ends of the edges, which hold their own ones in `beyond[0]`.
void Walls::FindBeyond(std::span<WallEdge> outline, bool closed) {
  // Subtracted, so that zeros stay positive.
  const auto back = [](Vector direction) { return Vector{} - direction; };
  const Vector first = closed ? outline.front().beyond[0] : Vector{};
  Vector before = closed ? back(outline.back().beyond[0]) : Vector{};
  for (size_t i = 0; i < outline.size(); i++) {
    const Vector own = outline[i].beyond[0];
    outline[i].beyond[0] = before;
    outline[i].beyond[1] = i + 1 < outline.size() ? outline[i + 1].beyond[0] : first;
    before = back(own);
  }
}

Walls Walls::Part(size_t first, size_t last) const {
  STAGE_ASSERT(first <= last && last <= edges_.size());
  Walls part;
  if (first == last) return part;
  part.edges_.assign(edges_.begin() + static_cast<std::ptrdiff_t>(first),
                     edges_.begin() + static_cast<std::ptrdiff_t>(last));
  const uint32_t before = part.edges_.front().outline;
  for (WallEdge& edge : part.edges_) edge.outline -= before;
  part.outline_count_ = part.edges_.back().outline + 1;
  return part;
}

void Walls::Append(const Walls& others) {
  const size_t before = edges_.size();
  edges_.insert(edges_.end(), others.edges_.begin(), others.edges_.end());
  for (size_t i = before; i < edges_.size(); i++) edges_[i].outline += outline_count_;
  outline_count_ += others.outline_count_;
}

void Walls::Clear() {
  edges_.clear();
  outline_count_ = 0;
}

/// Chooses the size and the number of the cells of the index.
void Walls::ChooseCells() {
  bounds_ = BoxOf(edges_[0]);
  double length = 0.0;
  for (const WallEdge& edge : edges_) {
    const Box box = BoxOf(edge);
    bounds_ = {Least(bounds_.x0, box.x0), Least(bounds_.y0, box.y0), Most(bounds_.x1, box.x1),
               Most(bounds_.y1, box.y1)};
    length += Most(box.x1 - box.x0, box.y1 - box.y0);
  }
  const double width = bounds_.x1 - bounds_.x0, height = bounds_.y1 - bounds_.y0;
  cell_ = Clamp(length / static_cast<double>(edges_.size()), 0.25, 4.0);
  while ((width / cell_ + 1.0) * (height / cell_ + 1.0) > kMaxIndexCells) cell_ *= 2.0;
  columns_ = static_cast<int64_t>(width / cell_) + 1;
  rows_ = static_cast<int64_t>(height / cell_) + 1;
}

void Walls::Index() {
  starts_.clear();
  entries_.clear();
  if (edges_.empty()) return;
  ChooseCells();
  // A counting sort: count, sum up, and fill in from the back.
  starts_.assign(static_cast<size_t>(columns_ * rows_) + 1, 0);
  boxes_.resize(edges_.size());
  for (size_t i = 0; i < edges_.size(); i++) boxes_[i] = CellsOf(BoxOf(edges_[i]));
  const auto for_each_cell = [&](const Cells& cells, auto f) {
    for (int32_t y = cells.y0; y <= cells.y1; y++)
      for (int32_t x = cells.x0; x <= cells.x1; x++)
        f(static_cast<size_t>(y) * static_cast<size_t>(columns_) + static_cast<size_t>(x));
  };
  for (const Cells& cells : boxes_) for_each_cell(cells, [&](size_t cell) { starts_[cell]++; });
  uint32_t sum = 0;
  for (uint32_t& start : starts_) start = sum += start;
  entries_.resize(sum);
  for (size_t i = edges_.size(); i-- > 0;)
    for_each_cell(boxes_[i],
                  [&](size_t cell) { entries_[--starts_[cell]] = static_cast<uint32_t>(i); });
}

}  // namespace Stg::motion
