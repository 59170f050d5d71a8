// SPDX-License-Identifier: GPL-2.0-or-later
//
// Where bodies are about to be rasterized, and what they would collide with there.

#ifndef STAGE_MODELS_PLACEMENT_HH
#define STAGE_MODELS_PLACEMENT_HH

#include <span>
#include <vector>

#include "geometry/geometry.hh"
#include "grid/grid.hh"
#include "models/body.hh"

namespace Stg {

class Model;
struct SineCosine;

namespace internal::sensing {
struct Scene;
}

/// Maximum number of outline cells, counted with multiplicity, of all bodies when a world file is
/// loaded. A cell takes about 75 bytes; a hospital with 5 mm cells has 9 million.
inline constexpr double kMaxCells = 16'000'000, kMaxCellsPerModel = 1000;
/// Factor by which more cells may be rasterized later. Turning an outline adds at most 42 % of its
/// cells, so a loaded world reaches this limit only if bodies are added or grow.
inline constexpr double kRasterizedToLoaded = 2;

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
  /// Rasterizes outlines for the exact ray model, but only of bodies that are rasterized already.
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
