// SPDX-License-Identifier: GPL-2.0-or-later

#include "models/block.hh"

#include <algorithm>
#include <cmath>
#include <limits>

#include "geometry/trigonometry.hh"
#include "grid/outline.hh"
#include "models/exact_drawing.hh"
#include "models/model.hh"
#include "sensing/scene.hh"

namespace Stg {

Block::Block(std::vector<point_t> points, Bounds z_range)
    : source_points_(std::move(points)), points_(source_points_), source_z_(z_range), z_(z_range) {}

Block::~Block() = default;

void OrientPolygon(std::vector<point_t>* points) {
  const size_t n = points->size();
  double turned = 0;
  for (size_t i = 0; i < n; i++) {
    const point_t &a = (*points)[i], &b = (*points)[(i + 1) % n], &c = (*points)[(i + 2) % n];
    turned += normalize(std::atan2(c.y - b.y, c.x - b.x) - std::atan2(b.y - a.y, b.x - a.x));
  }
  if (!(turned > 0)) std::reverse(points->begin(), points->end());
}

// ---- BlockGroup ---------------------------------------------------------------------------------

void BlockGroup::NoteChange() {
  version_++;
  owner_.scene().body_changes++;
}

/// The blocks as they are fitted now become what later fitting starts from.
void BlockGroup::FreezeShape() {
  if (frozen_) return;
  frozen_ = true;
  for (const auto& block : blocks_) {
    block->source_points_ = block->points_;
    block->source_z_ = block->z_;
  }
}

void BlockGroup::Add(std::vector<point_t> points, Bounds z_range) {
  Erase();
  FreezeShape();
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
  FreezeShape();
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
  Erase();
  blocks_.clear();
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

/// An extent to divide by: never zero.
double Extent(const Bounds& bounds) {
  const double extent = bounds.max - bounds.min;
  const double smallest = std::numeric_limits<double>::epsilon();
  return std::fabs(extent) < smallest ? smallest : extent;
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
  bounds3d_t box = EmptyBox();
  for (const auto& block : blocks_) {
    for (const point_t& p : block->source_points_) {
      Widen(&box.x, p.x);
      Widen(&box.y, p.y);
    }
    Widen(&box.z, block->source_z_.min);
    Widen(&box.z, block->source_z_.max);
  }
  frozen_ = blocks_.empty();
  const double dx = Extent(box.x), dy = Extent(box.y), dz = Extent(box.z);
  const double scale_x = size.x / dx, scale_y = size.y / dy, scale_z = size.z / dz;
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

void BlockGroup::Erase() {
  if (!drawn_) return;
  drawn_ = false;
  for (const auto& block : blocks_) {
    if (!block->drawn_) continue;
    grid::Grid& grid = owner_.scene().grid;
    if (block->exact_) block->exact_->Erase(&grid);
    for (const grid::CellRef cell : block->cells_) grid.Remove(cell, block->body_);
    grid.RemoveBody(block->body_);
    block->cells_.clear();
    block->corners_.clear();
    block->drawn_ = false;
  }
}

void BlockGroup::AppendCells(grid::CellLists* cells, bool exact) const {
  for (const auto& block : blocks_) {
    if (exact && block->exact_) block->exact_->AppendCells(cells);
    if (!exact && !block->cells_.empty()) cells->lists.push_back(&block->cells_);
  }
}

void BlockGroup::RefreshVisibility(bool ranger_visible) {
  grid::Grid& grid = owner_.scene().grid;
  for (const auto& block : blocks_) {
    if (!block->drawn_) continue;
    grid::Body body = grid.body(block->body_);
    body.ranger_visible = ranger_visible;
    grid.ChangeBody(block->body_, body, block->cells_);
    if (block->exact_) block->exact_->Change(&grid, body);
  }
}

// ---- Placement ----------------------------------------------------------------------------------

void Placement::Plan(Model& model, bool with_children) {
  items_.clear();
  corners_.clear();
  exact_corners_.clear();
  PlanModel(model, model.GetGlobalPose(), with_children);
}

void Placement::PlanModel(Model& model, const Pose& global, bool with_children) {
  const BlockGroup& group = *model.blockgroup;
  if (!group.empty()) {
    const Pose frame = global + model.geom.pose;
    const SineCosine turn = SinCos(frame.a);
    const double cells_per_metre = model.scene().cells_per_metre;
    const bool exact = model.scene().exact_drawing;
    const double lift = global.z + model.geom.pose.z;
    for (const auto& block : group.blocks()) {
      Item item{
          &model, block.get(), corners_.size(), Bounds(block->z_.min + lift, block->z_.max + lift),
          true,   false};
      for (const point_t& p : block->points_) {
        const double x = frame.x + p.x * turn.cosine - p.y * turn.sine;
        const double y = frame.y + p.x * turn.sine + p.y * turn.cosine;
        const double cx = std::floor(x * cells_per_metre), cy = std::floor(y * cells_per_metre);
        item.drawable &= std::fabs(cx) < grid::kMaxCell && std::fabs(cy) < grid::kMaxCell;
        if (!item.drawable) break;
        corners_.emplace_back(static_cast<int>(cx), static_cast<int>(cy));
        if (exact) exact_corners_.emplace_back(x, y);
      }
      if (!item.drawable) {
        corners_.resize(item.first_corner);
        if (exact) exact_corners_.resize(item.first_corner);
      }
      const std::vector<point_int_t>& now = block->corners_;
      item.moved = !block->drawn_ || now.size() != corners_.size() - item.first_corner ||
                   !std::equal(now.begin(), now.end(),
                               corners_.begin() + static_cast<long>(item.first_corner));
      items_.push_back(item);
    }
  }
  if (!with_children) return;
  for (Model* child : model.GetChildren())
    PlanModel(*child, model.ChildGlobalPose(global, *child), true);
}

Model* Placement::Collision(Model* ground) const {
  for (const Item& item : items_) {
    if (!item.model->vis.obstacle_return) continue;
    if (item.z.min < 0) return ground;
    if (Model* hit = CollisionOf(item)) return hit;
  }
  return nullptr;
}

Model* Placement::CollisionOf(const Item& item) const {
  const grid::Grid& grid = item.model->scene().grid;
  const void* tree = item.model->Root();
  Model* hit = nullptr;
  const auto runs_into = [&](grid::BodyId id) {
    const grid::Body& other = grid.body(id);
    if (other.exact() || other.tree == tree || !other.model->vis.obstacle_return) return false;
    if (other.z_min > item.z.max || other.z_max < item.z.min) return false;
    hit = other.model;
    return true;
  };

  if (!item.moved) {
    for (const grid::CellRef cell : item.block->cells_)
      if (grid.AnyIn(cell, runs_into)) return hit;
    return nullptr;
  }
  grid::CellReader reader(grid);
  grid::ForEachCellOfOutline(&corners_[item.first_corner], EndOf(item) - item.first_corner,
                             [&](int32_t x, int32_t y) {
                               if (hit == nullptr) reader.AnyAt(x, y, runs_into);
                             });
  return hit;
}

double Placement::CountCells() const {
  double cells = 0;
  for (size_t i = 0; i < items_.size(); i++) {
    const size_t begin = items_[i].first_corner;
    const size_t end = i + 1 < items_.size() ? items_[i + 1].first_corner : corners_.size();
    for (size_t c = begin; c < end; c++) {
      const point_int_t &from = corners_[c], &to = corners_[c + 1 < end ? c + 1 : begin];
      cells += std::fabs(double{1} * to.x - from.x) + std::fabs(double{1} * to.y - from.y);
    }
  }
  return cells;
}

void Placement::Commit() {
  for (const Item& item : items_) CommitItem(item);
}

/// Behind the item's last corner.
size_t Placement::EndOf(const Item& item) const {
  const size_t next = static_cast<size_t>(&item - items_.data()) + 1;
  return next < items_.size() ? items_[next].first_corner : corners_.size();
}

void Placement::CommitItem(const Item& item) {
  item.model->NoteDrawn();
  Block& block = *item.block;
  grid::Grid& grid = item.model->scene().grid;
  const grid::Body body{.z_min = item.z.min,
                        .z_max = item.z.max,
                        .model = item.model,
                        .tree = item.model->Root(),
                        .ranger_visible = !(item.model->vis.ranger_return < 0)};
  if (item.model->scene().exact_drawing) {
    if (!block.exact_) block.exact_ = std::make_unique<ExactDrawing>();
    block.exact_->Draw(&grid, body, exact_corners_.data() + item.first_corner,
                       EndOf(item) - item.first_corner, item.model->scene().cells_per_metre);
  }
  if (!item.moved) {
    grid.ChangeBody(block.body_, body, block.cells_);
    return;
  }
  if (block.drawn_) {
    for (const grid::CellRef cell : block.cells_) grid.Remove(cell, block.body_);
    grid.ChangeBody(block.body_, body, {});
  } else {
    block.body_ = grid.AddBody(body);
    block.drawn_ = item.model->blockgroup->drawn_ = true;
  }
  block.corners_.assign(corners_.begin() + static_cast<long>(item.first_corner),
                        corners_.begin() + static_cast<long>(EndOf(item)));
  block.cells_.clear();
  grid::ForEachCellOfOutline(
      block.corners_.data(), block.corners_.size(),
      [&](int32_t x, int32_t y) { block.cells_.push_back(grid.Insert(x, y, block.body_)); });
}

}  // namespace Stg
