// SPDX-License-Identifier: GPL-2.0-or-later
//
// A model's body: a group of blocks. Only outlines are rasterized in the grid.

#ifndef STAGE_MODELS_BODY_HH
#define STAGE_MODELS_BODY_HH

#include <memory>
#include <vector>

#include "geometry/geometry.hh"
#include "grid/grid.hh"
#include "models/block.hh"

namespace Stg {

class Model;
class StateExchange;

class BlockGroup {
 public:
  explicit BlockGroup(Model& owner);
  ~BlockGroup();
  BlockGroup(const BlockGroup&) = delete;
  BlockGroup& operator=(const BlockGroup&) = delete;

  bool empty() const { return blocks_.empty(); }
  /// True if the group has blocks, none of which is rasterized.
  bool IsUnrasterized() const { return !blocks_.empty() && !rasterized_; }
  const std::vector<std::unique_ptr<Block>>& blocks() const { return blocks_; }

  /// Adds a block in the frame of the fitted blocks. Fit and rasterize the group again afterwards.
  void Add(std::vector<point_t> points, Bounds z_range);
  void AddRectangle(double x, double y, double dx, double dy, Bounds z_range);
  /// Adds a block without a height interval; FillHeights() sets it.
  void AddWithoutHeights(std::vector<point_t> points);
  /// Gives blocks without heights the height interval of the whole body, extended to 0, or [0 1] if
  /// no block has one. Call it after adding all blocks, before fitting.
  void FillHeights();
  /// Sets a rectangle that counts as part of the body in fitting but is not rasterized, such as the
  /// margins of a picture.
  void SetFrame(Bounds x, Bounds y);
  const Bounds& frame_x() const { return frame_x_; }
  const Bounds& frame_y() const { return frame_y_; }
  bool has_frame() const { return frame_x_.max > frame_x_.min; }
  /// Changes a block made by AddRectangle(). Rasterize the group again afterwards.
  void ChangeRectangle(size_t index, const bounds3d_t& box);
  /// Erases the body from the grid and deletes all blocks.
  void Clear();
  /// Number of calls of Clear(): tells whether added blocks still exist.
  unsigned times_cleared() const { return times_cleared_; }
  /// Changes with each change of the blocks: tells whether a picture of them is up to date.
  unsigned version() const { return version_; }

  /// Scales and centres the body in plan to fill size.x by size.y. Scales heights to size.z without
  /// shifting them. A body without extent along an axis is centred on it; one without height keeps
  /// its z.
  void Fit(const Size& size);
  bounds3d_t BoundingBox() const;
  /// True if the body has blocks, all at one height: rangers see it only at that height.
  bool IsFlat() const;
  /// Radius of a circle around the origin of the body's frame that contains all blocks in plan.
  double radius() const { return radius_; }

  /// Removes the body from the grid.
  void Erase();
  /// Final Erase() by the model's destructor. Does not allocate.
  void EraseFinally() {
    Erase();
    NoteChange();
  }
  /// Appends the rasterizations of rasterized blocks; `exact`: those for the exact ray model.
  void AppendRasterizations(grid::Rasterizations* rasterizations, bool exact) const;
  /// Calls f(grid::BodyId, const std::vector<grid::CellSet>&) for each rasterized body of the
  /// group.
  template <typename F>
  void ForEachBody(F f) const;
  /// True if some block may have been rasterized since loading, in this world or a restored
  /// snapshot.
  bool rasterized_since_loading() const { return rasterized_since_loading_; }
  void SetRasterizedSinceLoading(bool rasterized) { rasterized_since_loading_ = rasterized; }
  /// Marks the blocks as loaded: until they change, ExchangeState() saves only a flag.
  void NoteLoaded() { is_as_loaded_ = true; }
  bool is_as_loaded() const { return is_as_loaded_; }
  /// Restoring other blocks erases the body from the grid. Returns true in that case.
  bool ExchangeState(StateExchange& exchange);
  /// Rasterization of a block, for a copy of the grid: see AdoptRasterizations().
  struct Rasterization {
    std::vector<point_int_t> corners;
    std::vector<grid::CellSet> cells;
    grid::BodyId body = 0;
    uint64_t loading_stamp = 0;
    bool rasterized = false;
  };
  std::vector<Rasterization> Rasterizations() const;
  /// Adopts the rasterizations of a group with equally many blocks, after the grid has become a
  /// copy of its grid. Rasterize the group afterwards, which is fast for blocks that stay in place.
  void AdoptRasterizations(const std::vector<Rasterization>& rasterizations);
  /// Call it when the owner's visibility to rangers has changed.
  void RefreshVisibility(bool ranger_visible);

 private:
  friend class Placement;

  struct Shape;
  struct Shapes;

  void NoteChange();
  Shapes CopyShapes() const;
  bool ReplaceShapes(const Shapes& shapes);
  void SaveLoadedShape();
  bool RestoreLoadedShape(StateExchange* exchange);
  void AdoptFittedShape();
  void WidenRadius(const std::vector<point_t>& points);

  Model& owner_;
  std::vector<std::unique_ptr<Block>> blocks_;
  double radius_ = 0;
  Bounds frame_x_, frame_y_;  // see SetFrame(); in the frame of the source points; no frame: both
                              // empty
  bool frozen_ = true;        // source and current shape agree: blocks may be added
  bool rasterized_ = false;   // at least one block is rasterized
  bool rasterized_since_loading_ = true;
  bool is_as_loaded_ = false;
  std::unique_ptr<const Shapes> as_loaded_;  // set when the body has changed since loading
  bool warned_too_large_ = false;            // since the last fit
  unsigned times_cleared_ = 0;
  unsigned version_ = 0;
};

template <typename F>
void BlockGroup::ForEachBody(F f) const {
  for (const auto& block : blocks_) {
    if (!block->rasterized_) continue;
    f(block->body_, block->cells_);
    if (block->exact_) block->exact_->ForEachBody(f);
  }
}

}  // namespace Stg

#endif
