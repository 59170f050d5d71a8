// SPDX-License-Identifier: GPL-2.0-or-later
//
// A scene in which the cells of one standing model change, such as a robot's belief about what is
// around it.
//
// Set() brings the scene into the state that a scene newly made from a world with that picture has,
// as far as steps, rays and contacts can tell: rows step with equal bits. The picture is drawn as
// one body of the grid instead of one for each outline, and boxes of maps are those of the whole
// picture instead of its occupied part. The prototype keeps its first picture.
//
// Size, resolution and place of the picture are those of the prototype's model. Rows keep what they
// hold: readings are of the former cells until the next update, and the extent of the grid, which
// is a part of the state's hash, until they are reset.

#ifndef STAGE_ROWS_CHANGING_MAP_HH
#define STAGE_ROWS_CHANGING_MAP_HH

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "geometry/geometry.hh"
#include "geometry/trigonometry.hh"
#include "grid/tile_board.hh"
#include "motion/walls.hh"
#include "pictures/picture.hh"
#include "pictures/trace.hh"
#include "rows/scene.hh"

namespace Stg::rows {

/// A model of a world that stands and is a picture of square or rectangular cells.
struct StandingMap {
  const Model* model;
  int columns, rows;                         ///< of cells
  Pose frame;                                ///< of its blocks, global
  Bounds height;                             ///< m, global
  internal::grid::CellBox extent_of_others;  ///< extent of the grid without the map
};

class ChangingMap {
 public:
  /// Takes over a world like RowBridge::MakeScene(). `model` is the name of a model that stands,
  /// with `bitmap_frame "picture"` and at least one occupied cell, as GridMap of the Python package
  /// writes it. Returns null and the reason, in words that follow "because", if it has no such
  /// model, if it is not closed, if a ray is of the exact model, or if there are populations.
  static std::unique_ptr<ChangingMap> Make(std::unique_ptr<World> prototype,
                                           const std::string& model, std::string* reason,
                                           std::span<const VariedNumber> varied = {});

  int columns() const { return map_.columns; }
  int rows() const { return map_.rows; }
  /// The scene, which Set() changes. Rows of it must not be used meanwhile.
  const std::shared_ptr<const Scene>& scene() const { return shared_; }
  /// Another number after each change of the cells, for those who keep a copy, such as devices.
  uint64_t version() const { return scene_->map_version; }

  /// Replaces the cells: `columns` times `rows` bytes, row by row, the lowest row first and the
  /// leftmost cell of it first; 0 is free, all others are occupied. Returns false, and changes
  /// nothing, if they are the present ones. Throws LoadError, and changes nothing, if outlines have
  /// more than picture::kMaxCorners corners. Allocates nothing once there was a grid with as many
  /// corners, and with as many cells in which others stand, too.
  bool Set(std::span<const uint8_t> cells);

 private:
  using CellBox = internal::grid::CellBox;
  /// A map of cells of the scene in which the model shows.
  struct Shown {
    CellMap* map;
    std::vector<uint64_t> others;  ///< by tile of the board, if the map has cells
    std::vector<uint8_t> seeds;    ///< distances: 0 where others are
    const Shown* equal = nullptr;  ///< an earlier one with equal distances
  };

  ChangingMap(std::shared_ptr<Scene> scene, const StandingMap& map);
  std::string Start();
  bool FindCorners();
  picture::Bitmap FirstPicture() const;
  bool IsTraced() const;
  void MergeBodies();
  bool FindShown();
  bool AddShown(CellMap* map, bool with_cells, bool shows,
                std::span<const internal::grid::CellSet> others);
  void SplitWalls();
  void ReadCells(std::span<const uint8_t> cells);
  void Apply();
  void Draw();
  void ChangeGrid();
  void SetExtent();
  void ChangeMaps();
  void MeasureDistances(Shown* shown);
  void ChangeWalls();

  point_t Place(picture::Tracer::Corner corner) const;
  point_int_t CellOf(picture::Tracer::Corner corner) const;
  motion::Vector WallCornerOf(picture::Tracer::Corner corner) const;

  std::shared_ptr<Scene> scene_;
  std::shared_ptr<const Scene> shared_;
  StandingMap map_;

  // Corners between cells: in the frame of the model by column and row, counted from the top; and
  // for maps that are not turned in cells of the grid and in metres.
  SineCosine turn_;
  bool turned_;
  std::vector<double> x_, y_, wall_x_, wall_y_;
  std::vector<int32_t> cell_x_, cell_y_;

  picture::Bitmap now_, next_;
  picture::Tracer tracer_;
  internal::grid::TileBoard board_, before_;
  std::vector<uint32_t> changed_;  // tiles of the board that have other cells than before
  bool fills_other_tiles_ = true;  // some tile has become empty or is no longer so

  internal::grid::BodyId body_ = 0;
  std::vector<uint32_t> slots_;  // of the tiles of the board
  std::vector<Shown> shown_;

  motion::Walls* walls_ = nullptr;  // those that contain the map's; null if it is no obstacle
  motion::Walls walls_before_, walls_after_;
  std::vector<motion::Vector> corners_;                     // of an outline
  std::vector<const Model*> models_before_, models_after_;  // of all walls
};

}  // namespace Stg::rows

#endif
