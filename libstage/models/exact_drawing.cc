// SPDX-License-Identifier: GPL-2.0-or-later

#include "models/exact_drawing.hh"

#include <algorithm>
#include <cmath>

#include "grid/cover.hh"
#include "messages/assert.hh"

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

void ExactDrawing::Draw(grid::Grid* grid, const grid::Body& body, std::span<const point_t> corners,
                        double cells_per_metre, grid::Grid::Edit* edit) {
  const size_t count = corners.size();
  const bool same = corners_.size() == (count == 0 ? 0 : count + 1) &&
                    std::equal(corners.begin(), corners.end(), corners_.begin());
  if (same) {
    Change(grid, body);
    return;
  }
  const size_t runs = RunsOf(count);
  STAGE_ASSERT(!edit || runs == runs_.size());  // see MayShareEdit()
  if (runs != runs_.size()) Erase(grid);
  // Exception safety: allocations may fail at any time, but bodies in the grid must never refer to
  // freed corners, and runs_ must match what is drawn.
  std::vector<point_t> before;
  if (corners_.capacity() < count + 1) {
    std::swap(before, corners_);
    try {
      corners_.reserve(count + 1);
      runs_.reserve(runs);
    } catch (...) {
      std::swap(before, corners_);
      throw;
    }
  }
  corners_.assign(corners.begin(), corners.end());
  if (count > 0) corners_.push_back(corners[0]);
  Change(grid, body);
  while (runs_.size() < runs) {
    Run run;
    run.body = grid->AddBody(BodyOf(body, runs_.size()));
    runs_.push_back(std::move(run));
  }
  STAGE_ASSERT(runs_.size() == runs);
  for (size_t i = 0; i < runs; i++) DrawRun(grid, i, cells_per_metre, edit);
}

grid::Body ExactDrawing::BodyOf(const grid::Body& body, size_t run) const {
  grid::Body part = body;
  const size_t first = run * kRunEdges;
  STAGE_ASSERT(first + 1 < corners_.size());
  part.corners = corners_.data() + first;
  part.edges = static_cast<uint32_t>(std::min(kRunEdges, corners_.size() - 1 - first));
  Enclose(&part);
  return part;
}

void ExactDrawing::DrawRun(grid::Grid* grid, size_t index, double cells_per_metre,
                           grid::Grid::Edit* edit) {
  static thread_local std::vector<grid::TilePart> cells;  // static to reuse its memory
  STAGE_ASSERT(index < runs_.size() && grid->body(runs_[index].body).exact());
  Run& run = runs_[index];
  cells.clear();
  grid::PartsMaker maker(&cells);
  const size_t first = index * kRunEdges;
  const size_t last = std::min(first + kRunEdges, corners_.size() - 1);
  for (size_t i = first; i < last; i++) {
    const point_t from(corners_[i].x * cells_per_metre, corners_[i].y * cells_per_metre);
    const point_t to(corners_[i + 1].x * cells_per_metre, corners_[i + 1].y * cells_per_metre);
    const uint32_t edge = 1u << (i - first);
    grid::ForEachRowNear(from, to, [&](int32_t y, int32_t first_x, int32_t last_x) {
      maker.AddRow(y, first_x, last_x, edge);
    });
  }
  maker.Finish();
  run.cells.reserve(cells.size());  // allocate first, so that run.cells always matches the grid
  grid->Redraw(run.body, run.cells, cells, edit);
  run.cells.assign(cells.begin(), cells.end());
}

void ExactDrawing::Change(grid::Grid* grid, const grid::Body& body) {
  for (size_t i = 0; i < runs_.size(); i++)
    grid->ChangeBody(runs_[i].body, BodyOf(body, i), runs_[i].cells);
}

void ExactDrawing::Erase(grid::Grid* grid) {
  for (Run& run : runs_) {
    grid->Redraw(run.body, run.cells, {});
    grid->RemoveBody(run.body);
  }
  runs_.clear();
  corners_.clear();
}

void ExactDrawing::AppendDrawings(grid::Drawings* drawings) const {
  for (const Run& run : runs_)
    if (!run.cells.empty()) drawings->of_bodies.push_back(&run.cells);
}

}  // namespace Stg
