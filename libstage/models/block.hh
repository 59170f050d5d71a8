// SPDX-License-Identifier: GPL-2.0-or-later
//
// A block of a body: a polygon with a height interval, and its rasterization in the grid.

#ifndef STAGE_MODELS_BLOCK_HH
#define STAGE_MODELS_BLOCK_HH

#include <cstdint>
#include <memory>
#include <vector>

#include "geometry/geometry.hh"
#include "grid/grid.hh"
#include "models/exact_rasterization.hh"

namespace Stg {

class Block {
 public:
  Block(std::vector<point_t> points, Bounds z_range);
  ~Block();

  /// Corners in the model's frame, usually counter-clockwise, after fitting.
  const std::vector<point_t>& points() const { return points_; }
  const Bounds& z_range() const { return z_; }  ///< after fitting

  // Rasterization for the cell model.
  bool rasterized() const { return rasterized_; }
  grid::BodyId body() const { return body_; }
  const std::vector<grid::CellSet>& cells() const { return cells_; }
  const std::vector<point_int_t>& corners() const { return corners_; }  ///< cells of the corners
  /// Stamp that the body had after loading, see grid::Grid::Stamp(); 0 if it was not rasterized
  /// then.
  uint64_t loading_stamp() const { return loading_stamp_; }
  void NoteLoadingStamp(uint64_t stamp) { loading_stamp_ = stamp; }

 private:
  friend class BlockGroup;
  friend class Placement;

  // Shape before and after fitting to the model's size.
  std::vector<point_t> source_points_, points_;
  Bounds source_z_, z_;
  bool fills_height_ = false;  // while loading: see BlockGroup::FillHeights()

  // Current rasterization in the grid.
  std::unique_ptr<ExactRasterization> exact_;  // null unless a sensor uses the exact ray model
  bool rasterized_ = false;
  grid::BodyId body_ = 0;
  uint64_t loading_stamp_ = 0;
  std::vector<point_int_t> corners_;
  std::vector<grid::CellSet> cells_;
};

/// Reverses a polygon if the sum of its turning angles is not positive, as Stage 4.3 does. Gives
/// the same result on every processor.
void OrientPolygon(std::vector<point_t>* points);

}  // namespace Stg

#endif
