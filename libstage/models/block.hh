// SPDX-License-Identifier: GPL-2.0-or-later
//
// A model's body: a group of blocks, each a polygon with a height interval. Only outlines are
// rasterized in the grid.

#ifndef STAGE_MODELS_BLOCK_HH
#define STAGE_MODELS_BLOCK_HH

#include <memory>
#include <span>
#include <vector>

#include "geometry/geometry.hh"
#include "grid/grid.hh"
#include "models/exact_rasterization.hh"

namespace Stg {

class Model;
class StateExchange;
struct SineCosine;

namespace internal {
namespace sensing {
struct Scene;
}
}  // namespace internal

/// Maximum number of outline cells, counted with multiplicity, of all bodies when a world file is
/// loaded. A cell takes about 75 bytes; a hospital with 5 mm cells has 9 million.
inline constexpr double kMaxCells = 16'000'000, kMaxCellsPerModel = 1000;
/// Factor by which more cells may be rasterized later. Turning an outline adds at most 42 % of its
/// cells, so a loaded world reaches this limit only if bodies are added or grow.
inline constexpr double kRasterizedToLoaded = 2;

class Block {
 public:
  Block(std::vector<point_t> points, Bounds z_range);
  ~Block();

  /// Corners in the model's frame, usually counter-clockwise, after fitting.
  const std::vector<point_t>& points() const { return points_; }
  const Bounds& z_range() const { return z_; }  ///< after fitting

  // Drawing in the grid, except that for the exact ray model.
  bool rasterized() const { return rasterized_; }
  grid::BodyId body() const { return body_; }
  const std::vector<grid::CellSet>& cells() const { return cells_; }
  /// Draw-order stamp that the body had after loading, see grid::Grid::Stamp(); 0 if it was not
  /// rasterized then.
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

/// Reverses a polygon if the sum of its turning angles is not positive, as Stage does. Gives the
/// same result on every processor.
void OrientPolygon(std::vector<point_t>* points);

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

  /// Adds a block in the frame of the fitted blocks. Fit and draw the group again afterwards.
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
  bool has_frame() const { return frame_x_.max > frame_x_.min; }
  /// Changes a block made by AddRectangle(). Draw the group again afterwards.
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
  /// Marks the blocks as loaded: ExchangeState() saves only a flag until they change.
  void NoteLoaded() { is_as_loaded_ = true; }
  bool is_as_loaded() const { return is_as_loaded_; }
  /// Restoring other blocks erases the body from the grid. Returns true then.
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
  /// copy of its grid. Draw the group afterwards; that is fast for blocks that stay in place.
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

/// Proposed position in the grid of the bodies of a model and its descendants, at the poses at the
/// time of Plan(). They can be tested for collisions and rasterized there.
class Placement {
 public:
  /// `with_children`: include the bodies of all descendants.
  void Propose(Model& model, bool with_children);

  /// Returns the first model with which a body would collide: an unrelated obstacle of overlapping
  /// height rasterized in one of its cells, or the ground if a body reaches below z 0.
  Model* Collision(Model* ground) const;
  /// True if all bodies are rasterized where they were planned, apart from those that are too
  /// large.
  bool IsInPlace() const;
  /// Outline cells summed over all bodies, with multiplicity, including rejected oversized bodies.
  double CountCells() const { return cells_; }
  /// Moves the rasterizations to the proposed position. Oversized bodies are not rasterized, with a
  /// message. `edit` is used in a concurrent edit, see CanJoinConcurrentEdit().
  void Commit(grid::Grid::Edit* edit = nullptr);
  /// Draws outlines for the exact ray model, only of bodies that are rasterized.
  void AddExactRasterizations();

  /// True if so many cells are rasterized that a move might be refused: the order of moves matters
  /// then.
  static bool IsNearlyFull(const Model& model);
  /// True if the rasterizations can be moved in a concurrent edit of the grid (see
  /// Grid::BeginConcurrentEdit()): all of them exist already.
  bool CanJoinConcurrentEdit() const;
  /// Box of all cells that Collision() and Commit() may read or change.
  grid::CellBox Cells() const;
  /// Cells in which bodies will be rasterized. Their slots, which a concurrent edit needs, are not
  /// set yet.
  std::span<grid::CellSet> NewCells() { return sets_; }
  /// Maximum number of cell sets of the exact rasterizations if they touch `tiles` tiles.
  size_t MaxExactSets(size_t tiles) const;
  size_t body_count() const { return items_.size(); }

 private:
  struct Item {
    Model* model;
    Block* block;
    size_t first_corner;  // no corners if it is not to be rasterized
    size_t first_set;     // of its new cells; none if it does not move
    Bounds z;
    bool moved;             // its cells will change
    double rejected_cells;  // cells of its body if that is too large; otherwise 0
  };
  void ProposeModel(Model& model, const Pose& global, bool with_children);
  void ProposeBody(Model& model, const Pose& global);
  void RejectOversized(size_t first_item, double cells);
  void ProposeCells(size_t first_item);
  void AppendCorners(const Block& block, const Pose& frame, const SineCosine& turn,
                     const internal::sensing::Scene& scene);
  double CellsOfOutline(size_t first_corner, size_t end) const;
  static double MaxCells(const Model& model);
  Model* CollisionOf(const Item& item) const;
  std::span<const point_int_t> CornersOf(const Item& item) const;
  std::span<grid::CellSet> NewCellsOf(const Item& item);
  std::span<const grid::CellSet> NewCellsOf(const Item& item) const;
  void CommitItem(const Item& item, grid::Grid::Edit* edit);
  void RasterizeExactly(const Item& item, const grid::Body& body, grid::Grid::Edit* edit);
  static void WarnTooLarge(const Item& item);

  std::vector<Item> items_;
  std::vector<point_int_t> corners_;
  std::vector<grid::CellSet> sets_;
  std::vector<point_t>
      exact_corners_;  // global corners in metres; only for the exact rasterization
  double cells_ = 0;   // see CountCells()
  double growth_ = 0;  // number of additional cells that will be rasterized
};

}  // namespace Stg

#endif
