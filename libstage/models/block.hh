// SPDX-License-Identifier: GPL-2.0-or-later
//
// Bodies: a model's body is a group of blocks, each a polygon with a height interval. Only their
// outlines are drawn in the grid.

#ifndef STAGE_MODELS_BLOCK_HH
#define STAGE_MODELS_BLOCK_HH

#include <memory>
#include <span>
#include <vector>

#include "geometry/geometry.hh"
#include "grid/grid.hh"
#include "models/exact_drawing.hh"

namespace Stg {

class Model;
class StateExchange;
struct SineCosine;

namespace internal {
namespace sensing {
struct Scene;
}
}  // namespace internal

/// How many cells the outlines of all bodies of a world may pass, each time counted, when its file
/// is loaded. They take some 75 bytes each; a hospital in cells of 5 mm has 9 million.
inline constexpr double kMostCells = 16'000'000, kMostCellsPerModel = 1000;
/// So many times as many may be drawn later. An outline passes up to 1.42 times as many cells when
/// it is turned: no world that was loaded comes to this limit, unless bodies are added or grow.
inline constexpr double kDrawnToLoaded = 2;

class Block {
 public:
  Block(std::vector<point_t> points, Bounds z_range);
  ~Block();

  /// Corners in the model's frame, counter-clockwise as a rule, after fitting.
  const std::vector<point_t>& points() const { return points_; }
  const Bounds& z_range() const { return z_; }  ///< after fitting

  // How it is drawn in the grid, but for the exact ray model.
  bool drawn() const { return drawn_; }
  grid::BodyId body() const { return body_; }
  const std::vector<grid::TilePart>& cells() const { return cells_; }
  /// The stamp that the body had when the world had been loaded, see grid::Grid::Stamp(); 0 if it
  /// was not there.
  uint64_t loading_stamp() const { return loading_stamp_; }
  void NoteLoadingStamp(uint64_t stamp) { loading_stamp_ = stamp; }

 private:
  friend class BlockGroup;
  friend class Placement;

  // As they came, and as they are after fitting to the model's size.
  std::vector<point_t> source_points_, points_;
  Bounds source_z_, z_;
  bool fills_height_ = false;  // while it is loaded: see BlockGroup::FillHeights()

  // What is drawn in the grid now.
  std::unique_ptr<ExactDrawing> exact_;  // only if some sensor wants it
  bool drawn_ = false;
  grid::BodyId body_ = 0;
  uint64_t loading_stamp_ = 0;
  std::vector<point_int_t> corners_;
  std::vector<grid::TilePart> cells_;
};

/// Puts a polygon in the order that Stage wants: if the sum of its turning angles is not positive,
/// it is reversed. The same on every processor.
void OrientPolygon(std::vector<point_t>* points);

class BlockGroup {
 public:
  explicit BlockGroup(Model& owner);
  ~BlockGroup();
  BlockGroup(const BlockGroup&) = delete;
  BlockGroup& operator=(const BlockGroup&) = delete;

  bool empty() const { return blocks_.empty(); }
  /// It has blocks, none of which is drawn.
  bool IsUndrawn() const { return !blocks_.empty() && !drawn_; }
  const std::vector<std::unique_ptr<Block>>& blocks() const { return blocks_; }

  /// New blocks are in the frame that the fitted ones are in. The group must be fitted and drawn
  /// again afterwards.
  void Add(std::vector<point_t> points, Bounds z_range);
  void AddRectangle(double x, double y, double dx, double dy, Bounds z_range);
  /// Adds a block without heights of its own, which FillHeights() gives it.
  void AddWithoutHeights(std::vector<point_t> points);
  /// Blocks without heights get those of the whole body, from 0 on at least; [0 1] if no block has
  /// any. To be called when all blocks are there, before the body is fitted.
  void FillHeights();
  /// The rectangle counts as part of the body in plan when that is fitted, but nothing of it is
  /// drawn: the paper that a picture was painted on.
  void SetFrame(Bounds x, Bounds y);
  bool has_frame() const { return frame_x_.max > frame_x_.min; }
  /// Changes a block that is a rectangle, as AddRectangle() makes them. Draw it again afterwards.
  void ChangeRectangle(size_t index, const bounds3d_t& box);
  /// Erases the body from the grid and forgets it.
  void Clear();
  /// How often it was cleared: tells whether blocks that one has added are still there.
  unsigned times_cleared() const { return times_cleared_; }
  /// Another number after each change of the blocks: tells whether a picture of them is still good.
  unsigned version() const { return version_; }

  /// Stretches and centres the body in plan to fill size.x by size.y; heights are scaled to
  /// size.z in all, and not shifted. A body without extent along x or y lies in the middle there;
  /// one without height stays at the height that it has.
  void Fit(const Size& size);
  bounds3d_t BoundingBox() const;
  /// The body has blocks, and all of them are at one height: rangers see it there alone.
  bool IsFlat() const;
  /// Of a circle about the origin of the body's frame that all blocks lie in, seen from above.
  double radius() const { return radius_; }

  /// Takes the body off the grid.
  void Erase();
  /// For the last time: the model is going. Takes no memory.
  void EraseForGood() {
    Erase();
    NoteChange();
  }
  /// The cells of those blocks that are drawn; `exact`: for the exact ray model.
  void AppendDrawings(grid::Drawings* drawings, bool exact) const;
  /// Calls f(grid::BodyId, const std::vector<grid::TilePart>&) for all that is drawn of it.
  template <typename F>
  void ForEachBody(F f) const;
  /// Some of it may have been drawn since the world was loaded, or a snapshot says that it was.
  bool drawn_since_loading() const { return drawn_since_loading_; }
  void NoteDrawnSinceLoading(bool drawn) { drawn_since_loading_ = drawn; }
  /// The blocks are those that the model was loaded with: until they change, ExchangeState() saves
  /// no more than that.
  void NoteLoaded() { is_as_loaded_ = true; }
  bool is_as_loaded() const { return is_as_loaded_; }
  /// Restoring other blocks than there are takes the body off the grid; true then.
  bool ExchangeState(StateExchange& exchange);
  /// How the blocks are drawn, for a copy of the grid: see AdoptDrawings().
  struct Drawing {
    std::vector<point_int_t> corners;
    std::vector<grid::TilePart> cells;
    grid::BodyId body = 0;
    uint64_t loading_stamp = 0;
    bool drawn = false;
  };
  std::vector<Drawing> Drawings() const;
  /// The grid has become a copy of one that a group with as many blocks was drawn in so: this one
  /// is, too. To be drawn again afterwards, which only takes time where it has to lie elsewhere.
  void AdoptDrawings(const std::vector<Drawing>& drawings);
  /// To be called when the owner's visibility to rangers changed.
  void RefreshVisibility(bool ranger_visible);

 private:
  friend class Placement;

  struct Shape;
  struct Shapes;

  void NoteChange();
  Shapes CopyShapes() const;
  bool TakeShapes(const Shapes& shapes);
  void KeepLoaded();
  bool ReturnToLoaded(StateExchange* exchange);
  void FreezeShape();
  void WidenRadius(const std::vector<point_t>& points);

  Model& owner_;
  std::vector<std::unique_ptr<Block>> blocks_;
  double radius_ = 0;
  Bounds frame_x_, frame_y_;  // see SetFrame(), in the frame of the source points; none: both 0
  bool frozen_ = true;        // the blocks are as they came; so are those that are added
  bool drawn_ = false;        // some of them
  bool drawn_since_loading_ = true;
  bool is_as_loaded_ = false;
  std::unique_ptr<const Shapes> as_loaded_;  // once it has been changed
  bool told_too_large_ = false;              // of the body that it is since it was fitted
  unsigned times_cleared_ = 0;
  unsigned version_ = 0;
};

template <typename F>
void BlockGroup::ForEachBody(F f) const {
  for (const auto& block : blocks_) {
    if (!block->drawn_) continue;
    f(block->body_, block->cells_);
    if (block->exact_) block->exact_->ForEachBody(f);
  }
}

/// Where the bodies of a model and its descendants would lie in the grid, with the poses that the
/// models have at the moment of Plan(). They can be tested and drawn there.
class Placement {
 public:
  /// `with_children`: also the bodies of all descendants.
  void Plan(Model& model, bool with_children);

  /// The first model that a body would run into: one that is an obstacle, not related, of
  /// overlapping height, and drawn in one of the cells. The ground, where a body reaches below z 0.
  Model* Collision(Model* ground) const;
  /// How many cells the outlines pass, each time counted, those of bodies that are too large too.
  double CountCells() const { return cells_; }
  /// Moves the drawings there. A body that is too large is not drawn, with a message. `edit`: for
  /// one of several threads at once, see MayShareEdit().
  void Commit(grid::Grid::Edit* edit = nullptr);
  /// Draws the outlines for the exact ray model, of those bodies that are drawn, and nothing else.
  void AddExactDrawings();

  /// So many cells are drawn in that a move could be refused for it: the order of moves matters.
  static bool IsNearlyFull(const Model& model);
  /// The drawings can be moved in a shared edit of the grid (see Grid::BeginSharedEdit()): each is
  /// there already.
  bool MayShareEdit() const;
  /// All cells that Collision() and Commit() may look at or change.
  grid::CellBox Cells() const;
  /// The cells that bodies would be drawn in anew. Without slots, which a shared edit needs.
  std::span<grid::TilePart> NewParts() { return parts_; }
  /// In how many parts they would be drawn for the exact model at most, in so many tiles.
  size_t MostExactParts(size_t tiles) const;
  size_t body_count() const { return items_.size(); }

 private:
  struct Item {
    Model* model;
    Block* block;
    size_t first_corner;  // there are none if it is not to be drawn
    size_t first_part;    // of the cells that it will be drawn in; none if it stays where it is
    Bounds z;
    bool moved;            // it will be drawn in other cells than now
    double refused_cells;  // of its body, if that is too large; else 0
  };
  void PlanModel(Model& model, const Pose& global, bool with_children);
  void PlanBody(Model& model, const Pose& global);
  void Refuse(size_t first_item, double cells);
  void PlanCells(size_t first_item);
  void AppendCorners(const Block& block, const Pose& frame, const SineCosine& turn,
                     const internal::sensing::Scene& scene);
  double CellsOfOutline(size_t first_corner, size_t end) const;
  static double MostCells(const Model& model);
  Model* CollisionOf(const Item& item) const;
  std::span<const point_int_t> CornersOf(const Item& item) const;
  std::span<grid::TilePart> PartsOf(const Item& item);
  std::span<const grid::TilePart> PartsOf(const Item& item) const;
  void CommitItem(const Item& item, grid::Grid::Edit* edit);
  void DrawExactly(const Item& item, const grid::Body& body, grid::Grid::Edit* edit);
  static void TellTooLarge(const Item& item);

  std::vector<Item> items_;
  std::vector<point_int_t> corners_;
  std::vector<grid::TilePart> parts_;
  std::vector<point_t> exact_corners_;  // the corners, global metres; only for the exact drawing
  double cells_ = 0;                    // see CountCells()
  double growth_ = 0;                   // by how many cells more than now will be drawn
};

}  // namespace Stg

#endif
