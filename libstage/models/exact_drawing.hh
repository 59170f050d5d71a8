// SPDX-License-Identifier: GPL-2.0-or-later
//
// The drawing of a block for the exact ray model: its outline in metres, and every grid cell that
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
  /// Replaces the drawing by the outline with these corners (global, metres); without corners,
  /// nothing is drawn. `body` holds the block's other properties for the grid. `edit`: see
  /// MayShareEdit().
  void Draw(grid::Grid* grid, const grid::Body& body, std::span<const point_t> corners,
            double cells_per_metre, grid::Grid::Edit* edit = nullptr);
  /// True if an outline with this many corners can be drawn in a shared edit of the grid.
  bool MayShareEdit(size_t corners) const { return RunsOf(corners) == runs_.size(); }
  /// Maximum number of tile parts of an outline with `corners` corners that touches `tiles` tiles.
  static size_t MostParts(size_t corners, size_t tiles) { return RunsOf(corners) * tiles; }
  /// Changes the properties of the block in the grid.
  void Change(grid::Grid* grid, const grid::Body& body);
  void Erase(grid::Grid* grid);
  void AppendDrawings(grid::Drawings* drawings) const;
  /// See BlockGroup::ForEachBody().
  template <typename F>
  void ForEachBody(F f) const {
    for (const Run& run : runs_) f(run.body, run.cells);
  }

 private:
  /// Consecutive edges. Splitting long outlines lets a ray in a cell test only nearby edges.
  struct Run {
    grid::BodyId body = 0;
    std::vector<grid::TilePart> cells;
  };
  static constexpr size_t kRunEdges = 8;
  static_assert(kRunEdges <= grid::Body::kMaxEdges);

  static size_t RunsOf(size_t corners) { return (corners + kRunEdges - 1) / kRunEdges; }
  grid::Body BodyOf(const grid::Body& body, size_t run) const;
  void DrawRun(grid::Grid* grid, size_t run, double cells_per_metre, grid::Grid::Edit* edit);

  std::vector<point_t> corners_;  // closed: the first corner is repeated at the end
  std::vector<Run> runs_;
};

}  // namespace Stg

#endif
