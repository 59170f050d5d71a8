// SPDX-License-Identifier: GPL-2.0-or-later

#include "models/body.hh"

#include <algorithm>
#include <cmath>
#include <limits>

#include "geometry/trigonometry.hh"
#include "grid/outline.hh"
#include "messages/assert.hh"
#include "models/exact_rasterization.hh"
#include "models/host.hh"
#include "models/model.hh"
#include "models/state_exchange.hh"
#include "models/warn_about.hh"
#include "sensing/scene.hh"

namespace Stg {

// ---- BlockGroup ---------------------------------------------------------------------------------

void BlockGroup::NoteChange() {
  version_++;
  owner_.scene().body_changes++;
  owner_.NoteOutlineChange();
}

/// Makes the fitted shape of the blocks the source of later fitting.
void BlockGroup::AdoptFittedShape() {
  SaveLoadedShape();
  if (frozen_) return;
  frozen_ = true;
  for (const auto& block : blocks_) {
    block->source_points_ = block->points_;
    block->source_z_ = block->z_;
  }
  if (!has_frame()) return;
  const Size size = owner_.GetGeom().size;
  const double x = std::fabs(size.x) / 2, y = std::fabs(size.y) / 2;
  frame_x_ = Bounds(-x, x);
  frame_y_ = Bounds(-y, y);
}

void BlockGroup::Add(std::vector<point_t> points, Bounds z_range) {
  Erase();
  AdoptFittedShape();
  NoteChange();
  WidenRadius(points);
  blocks_.push_back(std::make_unique<Block>(std::move(points), z_range));
}

void BlockGroup::WidenRadius(const std::vector<point_t>& points) {
  for (const point_t& p : points) radius_ = std::max(radius_, std::sqrt(p.x * p.x + p.y * p.y));
}

void BlockGroup::AddRectangle(double x, double y, double dx, double dy, Bounds z_range) {
  Add({{x, y}, {x + dx, y}, {x + dx, y + dy}, {x, y + dy}}, z_range);
}

void BlockGroup::ChangeRectangle(size_t index, const bounds3d_t& box) {
  STAGE_ASSERT(index < blocks_.size());
  AdoptFittedShape();
  NoteChange();
  Block& block = *blocks_[index];
  block.source_points_ = {{box.x.min, box.y.min},
                          {box.x.max, box.y.min},
                          {box.x.max, box.y.max},
                          {box.x.min, box.y.max}};
  block.source_z_ = box.z;
  block.points_ = block.source_points_;
  WidenRadius(block.points_);
  block.z_ = block.source_z_;
}

void BlockGroup::Clear() {
  SaveLoadedShape();
  Erase();
  blocks_.clear();
  frame_x_ = frame_y_ = Bounds();
  radius_ = 0;
  times_cleared_++;
  NoteChange();
}

namespace {

void Widen(Bounds* bounds, double value) {
  bounds->min = std::min(bounds->min, value);
  bounds->max = std::max(bounds->max, value);
}

bounds3d_t EmptyBox() {
  const double far = std::numeric_limits<double>::infinity();
  return bounds3d_t(Bounds(far, -far), Bounds(far, -far), Bounds(far, -far));
}

double Extent(const Bounds& bounds) { return bounds.max - bounds.min; }

/// Factor that scales an extent to `size`; `otherwise` if the extent is almost zero.
double Scale(double extent, double size, double otherwise) {
  return extent < std::numeric_limits<double>::epsilon() ? otherwise : size / extent;
}

}  // namespace

bounds3d_t BlockGroup::BoundingBox() const {
  bounds3d_t box = EmptyBox();
  for (const auto& block : blocks_) {
    for (const point_t& p : block->points_) {
      Widen(&box.x, p.x);
      Widen(&box.y, p.y);
    }
    Widen(&box.z, block->z_.min);
    Widen(&box.z, block->z_.max);
  }
  return blocks_.empty() ? bounds3d_t() : box;
}

void BlockGroup::Fit(const Size& size) {
  SaveLoadedShape();
  bounds3d_t box = EmptyBox();
  if (has_frame()) {
    box.x = frame_x_;
    box.y = frame_y_;
  }
  for (const auto& block : blocks_) {
    for (const point_t& p : block->source_points_) {
      Widen(&box.x, p.x);
      Widen(&box.y, p.y);
    }
    Widen(&box.z, block->source_z_.min);
    Widen(&box.z, block->source_z_.max);
  }
  frozen_ = blocks_.empty();
  warned_too_large_ = false;
  const double dx = Extent(box.x), dy = Extent(box.y);
  // Axes without extent are centred; without height, z is kept.
  const double scale_x = Scale(dx, size.x, 0), scale_y = Scale(dy, size.y, 0);
  const double scale_z = Scale(Extent(box.z), size.z, 1);
  const double centre_x = box.x.min + dx / 2.0, centre_y = box.y.min + dy / 2.0;
  radius_ = 0;
  NoteChange();
  for (const auto& block : blocks_) {
    for (size_t i = 0; i < block->points_.size(); i++) {
      const point_t& p = block->source_points_[i];
      block->points_[i] = point_t((p.x - centre_x) * scale_x, (p.y - centre_y) * scale_y);
    }
    block->z_ = Bounds(block->source_z_.min * scale_z, block->source_z_.max * scale_z);
    WidenRadius(block->points_);
  }
}

// ---- state --------------------------------------------------------------------------------------

struct BlockGroup::Shape {
  std::vector<point_t> source_points, points;
  Bounds source_z, z;

  bool operator==(const Shape& o) const {
    const auto same = [](const point_t& a, const point_t& b) { return a.x == b.x && a.y == b.y; };
    return std::ranges::equal(source_points, o.source_points, same) &&
           std::ranges::equal(points, o.points, same) && source_z.min == o.source_z.min &&
           source_z.max == o.source_z.max && z.min == o.z.min && z.max == o.z.max;
  }
  bool IsFinite() const {
    const auto is_finite = [](const point_t& p) {
      return std::isfinite(p.x) && std::isfinite(p.y);
    };
    return points.size() == source_points.size() && std::ranges::all_of(points, is_finite) &&
           std::ranges::all_of(source_points, is_finite) && std::isfinite(z.min) &&
           std::isfinite(z.max) && std::isfinite(source_z.min) && std::isfinite(source_z.max);
  }
  void ExchangeState(StateExchange& x) { x(source_points, points, source_z, z); }
};

struct BlockGroup::Shapes {
  std::vector<Shape> blocks;
  double radius;
  bool frozen;
  Bounds frame_x, frame_y;

  /// Bodies without a frame keep the state hash that they had before frames were introduced.
  void ExchangeState(StateExchange& x) {
    x(blocks, radius, frozen);
    if (!x.hashing() || frame_x.max > frame_x.min) x(frame_x, frame_y);
  }
  bool IsFinite() const {
    return std::ranges::all_of(blocks, &Shape::IsFinite) && std::isfinite(frame_x.min) &&
           std::isfinite(frame_x.max) && std::isfinite(frame_y.min) && std::isfinite(frame_y.max);
  }
};

BlockGroup::BlockGroup(Model& owner) : owner_(owner) {}

BlockGroup::~BlockGroup() { Erase(); }

BlockGroup::Shapes BlockGroup::CopyShapes() const {
  Shapes shapes{{}, radius_, frozen_, frame_x_, frame_y_};
  for (const auto& block : blocks_)
    shapes.blocks.push_back({block->source_points_, block->points_, block->source_z_, block->z_});
  return shapes;
}

/// If the blocks differ, replaces them, erases the body from the grid and returns true.
bool BlockGroup::ReplaceShapes(const Shapes& shapes) {
  radius_ = shapes.radius;
  frozen_ = shapes.frozen;
  frame_x_ = shapes.frame_x;
  frame_y_ = shapes.frame_y;
  if (CopyShapes().blocks == shapes.blocks) return false;
  Erase();
  blocks_.clear();
  for (const Shape& shape : shapes.blocks) {
    blocks_.push_back(std::make_unique<Block>(shape.source_points, shape.source_z));
    Block& block = *blocks_.back();
    block.points_ = shape.points;
    block.z_ = shape.z;
  }
  NoteChange();
  return true;
}

/// Call it before blocks change.
void BlockGroup::SaveLoadedShape() {
  if (!is_as_loaded_) return;
  if (!as_loaded_) as_loaded_ = std::make_unique<const Shapes>(CopyShapes());
  is_as_loaded_ = false;
}

bool BlockGroup::RestoreLoadedShape(StateExchange* exchange) {
  if (is_as_loaded_) return false;
  if (!as_loaded_) {
    exchange->Fail("found a reference to the loaded body of a model that was not loaded");
    return false;
  }
  const bool other_body = ReplaceShapes(*as_loaded_);
  is_as_loaded_ = true;
  return other_body;
}

bool BlockGroup::ExchangeState(StateExchange& exchange) {
  if (!exchange.hashing()) {
    bool as_loaded = is_as_loaded_;
    exchange(as_loaded);
    if (as_loaded)
      return exchange.restoring() && !exchange.failed() && RestoreLoadedShape(&exchange);
  }
  Shapes shapes = CopyShapes();
  exchange(shapes);
  if (!exchange.restoring() || exchange.failed()) return false;
  if (!shapes.IsFinite()) {
    exchange.Fail("found a body that is not finite");
    return false;
  }
  SaveLoadedShape();
  return ReplaceShapes(shapes);
}

// ---- rasterization ------------------------------------------------------------------------------

void BlockGroup::Erase() {
  if (!rasterized_ || owner_.scene().tearing_down) return;
  rasterized_ = false;
  for (const auto& block : blocks_) {
    if (!block->rasterized_) continue;
    grid::Grid& grid = owner_.scene().grid;
    STAGE_ASSERT(grid.body(block->body_).model == &owner_);
    if (block->exact_) block->exact_->Erase(&grid);
    grid.Rasterize(block->body_, block->cells_, {});
    grid.RemoveBody(block->body_);
    block->cells_.clear();
    block->corners_.clear();
    block->rasterized_ = false;
  }
}

std::vector<BlockGroup::Rasterization> BlockGroup::Rasterizations() const {
  std::vector<Rasterization> rasterizations;
  for (const auto& block : blocks_)
    rasterizations.push_back(
        {block->corners_, block->cells_, block->body_, block->loading_stamp_, block->rasterized_});
  return rasterizations;
}

void BlockGroup::AdoptRasterizations(const std::vector<Rasterization>& rasterizations) {
  STAGE_ASSERT(rasterizations.size() == blocks_.size() && !rasterized_);
  for (size_t i = 0; i < blocks_.size(); i++) {
    Block& block = *blocks_[i];
    block.corners_ = rasterizations[i].corners;
    block.cells_ = rasterizations[i].cells;
    block.body_ = rasterizations[i].body;
    block.loading_stamp_ = rasterizations[i].loading_stamp;
    block.rasterized_ = rasterizations[i].rasterized;
    rasterized_ = rasterized_ || block.rasterized_;
  }
}

void BlockGroup::AppendRasterizations(grid::Rasterizations* rasterizations, bool exact) const {
  for (const auto& block : blocks_) {
    if (exact && block->exact_) block->exact_->AppendRasterizations(rasterizations);
    if (!exact && !block->cells_.empty()) rasterizations->of_bodies.push_back(&block->cells_);
  }
}

void BlockGroup::RefreshVisibility(bool ranger_visible) {
  grid::Grid& grid = owner_.scene().grid;
  for (const auto& block : blocks_) {
    if (!block->rasterized_) continue;
    grid::Body body = grid.body(block->body_);
    STAGE_ASSERT(body.model == &owner_);
    if (body.ranger_visible == ranger_visible) continue;
    body.ranger_visible = ranger_visible;
    grid.ChangeBody(block->body_, body, block->cells_);
    if (block->exact_) block->exact_->Change(&grid, body);
  }
}

}  // namespace Stg
