// SPDX-License-Identifier: GPL-2.0-or-later

#include "motion/walls.hh"

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
  const size_t n = corners.size(), count = closed ? n : n - 1;
  for (size_t i = 0; i < count; i++) {
    const Vector from = corners[i], to = corners[(i + 1) % n];
    WallEdge edge{{from, to}, {{}, {}}, height, friction, group, outline_count_};
    if (closed || i > 0) edge.beyond[0] = Direction(from, corners[(i + n - 1) % n]);
    if (closed || i + 1 < count) edge.beyond[1] = Direction(to, corners[(i + 2) % n]);
    edges_.push_back(edge);
  }
  return outline_count_++;
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

void Walls::Index() {
  starts_.clear();
  entries_.clear();
  if (edges_.empty()) return;
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

  // A counting sort: count, sum up, and fill in from the back.
  starts_.assign(static_cast<size_t>(columns_ * rows_) + 1, 0);
  const auto for_each_cell = [&](const WallEdge& edge, auto f) {
    const Cells cells = CellsOf(BoxOf(edge));
    for (int64_t y = cells.y0; y <= cells.y1; y++)
      for (int64_t x = cells.x0; x <= cells.x1; x++) f(static_cast<size_t>(y * columns_ + x));
  };
  for (const WallEdge& edge : edges_) for_each_cell(edge, [&](size_t cell) { starts_[cell]++; });
  uint32_t sum = 0;
  for (uint32_t& start : starts_) start = sum += start;
  entries_.resize(sum);
  for (size_t i = edges_.size(); i-- > 0;)
    for_each_cell(edges_[i],
                  [&](size_t cell) { entries_[--starts_[cell]] = static_cast<uint32_t>(i); });
}

}  // namespace Stg::motion
