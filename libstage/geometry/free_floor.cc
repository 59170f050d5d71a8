// SPDX-License-Identifier: GPL-2.0-or-later

#include "geometry/free_floor.hh"

#include <algorithm>
#include <cmath>

namespace Stg::geometry {

namespace {

/// Hash key of a grid cell. Distant cells may share a key, which only costs time.
uint64_t KeyOf(int64_t column, int64_t row) {
  return static_cast<uint64_t>(column) * 0x9e3779b97f4a7c15u + static_cast<uint64_t>(row);
}

/// Index of the grid cell that contains x. Clamped, so that far coordinates cannot overflow.
int64_t IndexOf(double x, double cell) {
  return static_cast<int64_t>(std::clamp(std::floor(x / cell), -0x1p62, 0x1p62));
}

double Squared(double x) { return x * x; }

}  // namespace

void FreeFloor::AddBody(const std::vector<std::vector<point_t>>& outlines) {
  for (const std::vector<point_t>& outline : outlines) {
    for (size_t i = 0; i < outline.size(); i++)
      edges_.push_back({outline[i], outline[(i + 1) % outline.size()], bodies_});
  }
  bodies_++;
}

bounds3d_t FreeFloor::Bounds() const {
  bounds3d_t box;
  box.x.min = box.x.max = edges_[0].from.x;
  box.y.min = box.y.max = edges_[0].from.y;
  for (const Edge& edge : edges_) {
    box.x.min = std::min(box.x.min, edge.from.x);
    box.x.max = std::max(box.x.max, edge.from.x);
    box.y.min = std::min(box.y.min, edge.from.y);
    box.y.max = std::max(box.y.max, edge.from.y);
  }
  return box;
}

void FreeFloor::BuildIndex(double reach) {
  constexpr double kMaxCells = 1e6, kMaxRows = 4096;
  if (empty()) return;
  const bounds3d_t box = Bounds();
  const double width = box.x.max - box.x.min, height = box.y.max - box.y.min;
  cell_ = std::max(reach, std::sqrt(width * height / kMaxCells));
  first_row_ = box.y.min;
  rows_.resize(static_cast<size_t>(std::min(kMaxRows, std::floor(height / cell_))) + 1);
  row_height_ = height / static_cast<double>(rows_.size());
  for (uint32_t i = 0; i < edges_.size(); i++) {
    const auto [low_x, high_x] = std::minmax(edges_[i].from.x, edges_[i].to.x);
    const auto [low_y, high_y] = std::minmax(edges_[i].from.y, edges_[i].to.y);
    for (int64_t x = IndexOf(low_x - reach, cell_); x <= IndexOf(high_x + reach, cell_); x++) {
      for (int64_t y = IndexOf(low_y - reach, cell_); y <= IndexOf(high_y + reach, cell_); y++)
        near_[KeyOf(x, y)].push_back(i);
    }
    for (size_t row = RowOf(low_y); row <= RowOf(high_y); row++) rows_[row].push_back(i);
  }
}

size_t FreeFloor::RowOf(double y) const {
  if (!(row_height_ > 0)) return 0;
  const double row = std::floor((y - first_row_) / row_height_);
  return static_cast<size_t>(std::clamp(row, 0.0, static_cast<double>(rows_.size() - 1)));
}

bool FreeFloor::IsClear(const point_t& point, double clearance) const {
  if (empty()) return true;
  const auto cell = near_.find(KeyOf(IndexOf(point.x, cell_), IndexOf(point.y, cell_)));
  if (cell != near_.end()) {
    for (const uint32_t edge : cell->second)
      if (IsNear(edges_[edge], point, clearance)) return false;
  }
  return !IsSolid(point);
}

bool FreeFloor::IsNear(const Edge& edge, const point_t& point, double clearance) const {
  const double dx = edge.to.x - edge.from.x, dy = edge.to.y - edge.from.y;
  const double length2 = dx * dx + dy * dy;
  double along = 0;
  if (length2 > 0) along = ((point.x - edge.from.x) * dx + (point.y - edge.from.y) * dy) / length2;
  along = std::clamp(along, 0.0, 1.0);
  return Squared(edge.from.x + along * dx - point.x) + Squared(edge.from.y + along * dy - point.y) <
         Squared(clearance);
}

/// Even-odd rule with a ray to the right, body by body: the edges of a body are stored together.
bool FreeFloor::IsSolid(const point_t& point) const {
  uint32_t body = 0;
  bool odd = false;
  for (const uint32_t i : rows_[RowOf(point.y)]) {
    const Edge& edge = edges_[i];
    if (edge.body != body) {
      if (odd) return true;
      body = edge.body;
    }
    if ((edge.from.y > point.y) == (edge.to.y > point.y)) continue;
    const double x = edge.from.x + (point.y - edge.from.y) / (edge.to.y - edge.from.y) *
                                       (edge.to.x - edge.from.x);
    odd ^= x > point.x;
  }
  return odd;
}

Discs::Discs(double largest_radius, double gap)
    : gap_(gap), cell_(std::max(2 * largest_radius + gap, 1e-6)) {}

bool Discs::AddIfClear(const point_t& centre, double radius) {
  const int64_t column = IndexOf(centre.x, cell_), row = IndexOf(centre.y, cell_);
  for (int64_t x = column - 1; x <= column + 1; x++) {
    for (int64_t y = row - 1; y <= row + 1; y++) {
      const auto found = discs_.find(KeyOf(x, y));
      if (found == discs_.end()) continue;
      for (const Disc& disc : found->second) {
        const double apart2 = Squared(disc.centre.x - centre.x) + Squared(disc.centre.y - centre.y);
        if (apart2 < Squared(disc.radius + radius + gap_)) return false;
      }
    }
  }
  discs_[KeyOf(column, row)].push_back({centre, radius});
  return true;
}

}  // namespace Stg::geometry
