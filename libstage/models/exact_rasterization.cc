// SPDX-License-Identifier: GPL-2.0-or-later

#include "models/exact_rasterization.hh"

#include <algorithm>
#include <cmath>

#include "grid/cover.hh"
#include "messages/assert.hh"
#include "sensing/device_outlines.hh"

namespace Stg {

namespace {

/// Sets the body's bounding circle.
void Enclose(grid::Body* part) {
  const point_t* begin = part->corners;
  const point_t* end = begin + part->edges + 1;
  const auto [left, right] =
      std::minmax_element(begin, end, [](const point_t& a, const point_t& b) { return a.x < b.x; });
  const auto [low, high] =
      std::minmax_element(begin, end, [](const point_t& a, const point_t& b) { return a.y < b.y; });
  part->x = (left->x + right->x) / 2;
  part->y = (low->y + high->y) / 2;
  double square = 0;
  for (const point_t* p = begin; p != end; p++) {
    const double dx = p->x - part->x, dy = p->y - part->y;
    square = std::max(square, dx * dx + dy * dy);
  }
  part->radius = std::sqrt(square);
}

}  // namespace

void ExactRasterization::Rasterize(grid::Grid* grid, const grid::Body& body,
                                   std::span<const point_t> corners, double cells_per_metre,
                                   grid::Grid::Edit* edit) {
  const size_t count = corners.size();
  const bool same = corners_.size() == (count == 0 ? 0 : count + 1) &&
                    std::equal(corners.begin(), corners.end(), corners_.begin());
  if (same) {
    Change(grid, body);
    return;
  }
  const size_t fragments = FragmentCount(count);
  STAGE_ASSERT(!edit || fragments == fragments_.size());  // see CanJoinConcurrentEdit()
  if (fragments != fragments_.size()) Erase(grid);
  // Exception safety: allocations may fail at any time, but bodies in the grid must never refer to
  // freed corners, and fragments_ must match what is rasterized.
  std::vector<point_t> before;
  if (corners_.capacity() < count + 1) {
    std::swap(before, corners_);
    try {
      corners_.reserve(count + 1);
      fragments_.reserve(fragments);
    } catch (...) {
      std::swap(before, corners_);
      throw;
    }
  }
  corners_.assign(corners.begin(), corners.end());
  if (count > 0) corners_.push_back(corners[0]);
  Change(grid, body);
  while (fragments_.size() < fragments) {
    Fragment fragment;
    fragment.body = grid->AddBody(BodyOf(body, fragments_.size()));
    fragments_.push_back(std::move(fragment));
  }
  STAGE_ASSERT(fragments_.size() == fragments);
  for (size_t i = 0; i < fragments; i++) RasterizeFragment(grid, i, cells_per_metre, edit);
}

grid::Body ExactRasterization::BodyOf(const grid::Body& body, size_t fragment) const {
  static_assert(kFragmentEdges <= internal::sensing::DeviceOutlines::kMaxEdges);
  grid::Body part = body;
  const size_t first = fragment * kFragmentEdges;
  STAGE_ASSERT(first + 1 < corners_.size());
  part.corners = corners_.data() + first;
  part.edges = static_cast<uint32_t>(std::min(kFragmentEdges, corners_.size() - 1 - first));
  Enclose(&part);
  return part;
}

void ExactRasterization::RasterizeFragment(grid::Grid* grid, size_t index, double cells_per_metre,
                                           grid::Grid::Edit* edit) {
  static thread_local std::vector<grid::CellSet> cells;  // static to reuse its memory
  STAGE_ASSERT(index < fragments_.size() && grid->body(fragments_[index].body).exact());
  Fragment& fragment = fragments_[index];
  cells.clear();
  grid::CellSetBuilder maker(&cells);
  const size_t first = index * kFragmentEdges;
  const size_t last = std::min(first + kFragmentEdges, corners_.size() - 1);
  for (size_t i = first; i < last; i++) {
    const point_t from(corners_[i].x * cells_per_metre, corners_[i].y * cells_per_metre);
    const point_t to(corners_[i + 1].x * cells_per_metre, corners_[i + 1].y * cells_per_metre);
    const uint32_t edge = 1u << (i - first);
    grid::ForEachRowNear(from, to, [&](int32_t y, int32_t first_x, int32_t last_x) {
      maker.AddRow(y, first_x, last_x, edge);
    });
  }
  maker.Finish();
  fragment.cells.reserve(
      cells.size());  // allocate first, so that run.cells always matches the grid
  grid->Rasterize(fragment.body, fragment.cells, cells, edit);
  fragment.cells.assign(cells.begin(), cells.end());
}

void ExactRasterization::Change(grid::Grid* grid, const grid::Body& body) {
  for (size_t i = 0; i < fragments_.size(); i++)
    grid->ChangeBody(fragments_[i].body, BodyOf(body, i), fragments_[i].cells);
}

void ExactRasterization::Erase(grid::Grid* grid) {
  for (Fragment& fragment : fragments_) {
    grid->Rasterize(fragment.body, fragment.cells, {});
    grid->RemoveBody(fragment.body);
  }
  fragments_.clear();
  corners_.clear();
}

void ExactRasterization::AppendRasterizations(grid::Rasterizations* rasterizations) const {
  for (const Fragment& fragment : fragments_)
    if (!fragment.cells.empty()) rasterizations->of_bodies.push_back(&fragment.cells);
}

}  // namespace Stg
