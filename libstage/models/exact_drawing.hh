// SPDX-License-Identifier: GPL-2.0-or-later
//
// A block as the exact ray model sees it: its outline in metres, and in the grid every cell that
// the outline touches.

#ifndef STAGE_MODELS_EXACT_DRAWING_HH
#define STAGE_MODELS_EXACT_DRAWING_HH

#include <cstdint>
#include <span>
#include <vector>

#include "geometry/geometry.hh"
#include "grid/grid.hh"

namespace Stg {

class ExactDrawing {
 public:
  /// Draws the outline with these corners (global, metres) instead of what was drawn
  /// before; none of them: nothing. `body` says what else the grid wants to know of the block.
  /// `edit`: see MayShareEdit().
  void Draw(grid::Grid* grid, const grid::Body& body, std::span<const point_t> corners,
            double cells_per_metre, grid::Grid::Edit* edit = nullptr);
  /// Outlines of so many corners can be drawn in a shared edit of the grid.
  bool MayShareEdit(size_t corners) const { return RunsOf(corners) == runs_.size(); }
  /// Into how many parts outlines of so many corners fall at most, if they touch so many tiles.
  static size_t MostParts(size_t corners, size_t tiles) { return RunsOf(corners) * tiles; }
  /// Changes what the grid knows of the block.
  void Change(grid::Grid* grid, const grid::Body& body);
  void Erase(grid::Grid* grid);
  void AppendDrawings(grid::Drawings* drawings) const;
  /// See BlockGroup.
  template <typename F>
  void ForEachBody(F f) const {
    for (const Run& run : runs_) f(run.body, run.cells);
  }

 private:
  /// Consecutive edges: a ray that comes to a cell need not look at the whole of a long outline.
  struct Run {
    grid::BodyId body = 0;
    std::vector<grid::TilePart> cells;
  };
  static constexpr size_t kRunEdges = 8;
  static_assert(kRunEdges <= grid::Body::kMaxEdges);

  static size_t RunsOf(size_t corners) { return (corners + kRunEdges - 1) / kRunEdges; }
  grid::Body BodyOf(const grid::Body& body, size_t run) const;
  void DrawRun(grid::Grid* grid, size_t run, double cells_per_metre, grid::Grid::Edit* edit);

  std::vector<point_t> corners_;  // the first one again at the end
  std::vector<Run> runs_;
};

}  // namespace Stg

#endif
