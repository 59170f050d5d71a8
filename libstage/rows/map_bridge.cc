// SPDX-License-Identifier: GPL-2.0-or-later
//
// Finds the model of a world whose cells a ChangingMap changes.

#include <cmath>
#include <string>

#include "messages/report.hh"
#include "models/body.hh"
#include "rows/changing_map.hh"
#include "rows/model_kinds.hh"
#include "rows/row_bridge.hh"
#include "world/engine.hh"

namespace Stg {

namespace grid = internal::grid;

namespace {

/// Whole number of pixels of a frame; 0: it is none of a picture.
int PixelsOf(const Bounds& frame) {
  const double pixels = frame.max - frame.min;
  const bool whole = pixels == std::floor(pixels) && pixels >= 1 && pixels <= picture::kMaxSide;
  return whole ? static_cast<int>(pixels) : 0;
}

/// Says why blocks are not the outlines of a picture with all its margins.
std::string WhyNoPicture(const Model& model, const rows::StandingMap& map) {
  const auto& blocks = model.body().blocks();
  if (blocks.empty() || map.columns == 0 || map.rows == 0)
    return " has no bitmap with an occupied cell and bitmap_frame \"picture\"";
  for (const auto& block : blocks)
    if (block->z_range().min != blocks[0]->z_range().min ||
        block->z_range().max != blocks[0]->z_range().max || !block->rasterized())
      return " has blocks of other heights, or outside of the grid";
  const Size size = model.GetGeom().size;
  return size.x > 0 && size.y > 0 ? "" : " has no size";
}

}  // namespace

std::string RowBridge::FindMap(World* world, const std::string& name, rows::StandingMap* map) {
  const Model* const model = world->GetModel(name);
  if (!model) return "no model has the name " + messages::Quoted(name);
  if (world->engine_->populations)
    return "there are populations, whose places depend on the cells of " + rows::Named(*model);
  if (model->Parent() || !model->GetChildren().empty() || rows::IsOfMover(*model))
    return rows::Named(*model) + " moves, is placed by each world, or is part of a tree";
  if (model->round_ == 1) return rows::Named(*model) + " is round";
  map->model = model;
  map->columns = PixelsOf(model->body().frame_x());
  map->rows = PixelsOf(model->body().frame_y());
  if (std::string reason = WhyNoPicture(*model, *map); !reason.empty())
    return rows::Named(*model) + reason;
  const Pose global = model->GetGlobalPose();
  const double lift = global.z + model->geom.pose.z;
  const Bounds z = model->body().blocks()[0]->z_range();
  map->frame = global + model->geom.pose;
  map->height = Bounds(z.min + lift, z.max + lift);
  grid::Grid& cells = world->engine_->scene.grid;
  const grid::CellBox extent = cells.extent();
  cells.SetExtent(grid::CellBox());
  for (const Model* other : world->engine_->models) {
    if (other == model) continue;
    other->body().ForEachBody([&](grid::BodyId id, const std::vector<grid::CellSet>& sets) {
      if (!cells.body(id).exact()) cells.WidenExtent(sets);
    });
  }
  map->extent_of_others = cells.extent();
  cells.SetExtent(extent);
  return "";
}

}  // namespace Stg
