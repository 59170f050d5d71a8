// SPDX-License-Identifier: GPL-2.0-or-later
//
// The rasterization of a block for the exact ray model: its outline in metres, and every grid cell
// that the outline touches.

#ifndef STAGE_MODELS_EXACT_RASTERIZATION_HH
#define STAGE_MODELS_EXACT_RASTERIZATION_HH

#include <cstdint>
#include <span>
#include <vector>

#include "geometry/geometry.hh"
#include "grid/grid.hh"

namespace Stg {

class ExactRasterization {
 public:
  /// Replaces the rasterization by the outline with these corners (global, metres); without
  /// corners, nothing is rasterized. `body` holds the block's other properties for the grid.
  /// `edit`: see CanJoinConcurrentEdit().
  void Rasterize(grid::Grid* grid, const grid::Body& body, std::span<const point_t> corners,
                 double cells_per_metre, grid::Grid::Edit* edit = nullptr);
  /// True if an outline with this many corners can be rasterized in a concurrent edit of the grid.
  bool CanJoinConcurrentEdit(size_t corners) const {
    return FragmentCount(corners) == fragments_.size();
  }
  /// Maximum number of cell sets of an outline with `corners` corners that touches `tiles` tiles.
  static size_t MaxSets(size_t corners, size_t tiles) { return FragmentCount(corners) * tiles; }
  /// Changes the properties of the block in the grid.
  void Change(grid::Grid* grid, const grid::Body& body);
  void Erase(grid::Grid* grid);
  void AppendRasterizations(grid::Rasterizations* rasterizations) const;
  /// See BlockGroup::ForEachBody().
  template <typename F>
  void ForEachBody(F f) const {
    for (const Fragment& fragment : fragments_) f(fragment.body, fragment.cells);
  }

 private:
  /// Consecutive edges. Splitting long outlines lets a ray in a cell test only nearby edges.
  struct Fragment {
    grid::BodyId body = 0;
    std::vector<grid::CellSet> cells;
  };
  static constexpr size_t kFragmentEdges = 8;
  static_assert(kFragmentEdges <= grid::Body::kMaxEdges);

  static size_t FragmentCount(size_t corners) {
    return (corners + kFragmentEdges - 1) / kFragmentEdges;
  }
  grid::Body BodyOf(const grid::Body& body, size_t fragment) const;
  void RasterizeFragment(grid::Grid* grid, size_t fragment, double cells_per_metre,
                         grid::Grid::Edit* edit);

  std::vector<point_t> corners_;  // closed: the first corner is repeated at the end
  std::vector<Fragment> fragments_;
};

}  // namespace Stg

#endif
