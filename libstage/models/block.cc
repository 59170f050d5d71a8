// SPDX-License-Identifier: GPL-2.0-or-later

#include "models/block.hh"

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
#include "world/world.hh"

namespace Stg {

Block::Block(std::vector<point_t> points, Bounds z_range)
    : source_points_(std::move(points)), points_(source_points_), source_z_(z_range), z_(z_range) {}

Block::~Block() = default;

namespace {

/// True for headings in (0, pi].
bool HeadsUp(const point_t& edge) { return edge.y > 0 || (edge.y == 0 && edge.x < 0); }

/// Vector between two points; an edge without length counts as one along x.
point_t Edge(const point_t& from, const point_t& to) {
  const point_t edge(to.x - from.x, to.y - from.y);
  return edge.x == 0 && edge.y == 0 ? point_t(1, 0) : edge;
}

}  // namespace

/// The turns at all corners add up to a whole number of full turns: the number of times that the
/// heading crosses the negative x axis counter-clockwise minus clockwise. Counting needs only
/// comparisons; a sum of angles would have rounding errors, and its sign would be arbitrary for
/// figures of eight. U-turns cross nothing.
void OrientPolygon(std::vector<point_t>* points) {
  const size_t n = points->size();
  int full_turns = 0;
  for (size_t i = 0; i < n; i++) {
    const point_t &a = (*points)[i], &b = (*points)[(i + 1) % n], &c = (*points)[(i + 2) % n];
    const point_t in = Edge(a, b), out = Edge(b, c);
    if (HeadsUp(in) && !HeadsUp(out) && in.x * out.y > in.y * out.x) full_turns++;
    if (!HeadsUp(in) && HeadsUp(out) && in.x * out.y < in.y * out.x) full_turns--;
  }
  if (full_turns <= 0) std::reverse(points->begin(), points->end());
}

// ---- BlockGroup ---------------------------------------------------------------------------------

void BlockGroup::NoteChange() {
  version_++;
  owner_.scene().body_changes++;
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

// ---- rasterization
// ------------------------------------------------------------------------------------

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
    body.ranger_visible = ranger_visible;
    grid.ChangeBody(block->body_, body, block->cells_);
    if (block->exact_) block->exact_->Change(&grid, body);
  }
}

// ---- Placement ----------------------------------------------------------------------------------

void Placement::Propose(Model& model, bool with_children) {
  STAGE_ASSERT(!model.scene().tearing_down);
  items_.clear();
  corners_.clear();
  sets_.clear();
  exact_corners_.clear();
  cells_ = growth_ = 0;
  ProposeModel(model, model.GetGlobalPose(), with_children);
}

void Placement::ProposeModel(Model& model, const Pose& global, bool with_children) {
  if (!model.blockgroup->empty()) ProposeBody(model, global);
  if (!with_children) return;
  for (Model* child : model.GetChildren())
    ProposeModel(*child, model.ChildGlobalPose(global, *child), true);
}

void Placement::ProposeBody(Model& model, const Pose& global) {
  const size_t first_item = items_.size();
  const Pose frame = global + model.geom.pose;
  const SineCosine turn = SinCos(frame.a);
  const double lift = global.z + model.geom.pose.z;
  double cells = 0, rasterized = 0;  // cells of this body: planned, and rasterized now
  for (const auto& block : model.blockgroup->blocks()) {
    items_.push_back({&model, block.get(), corners_.size(), sets_.size(),
                      Bounds(block->z_.min + lift, block->z_.max + lift), true, 0});
    AppendCorners(*block, frame, turn, model.scene());
    Item& item = items_.back();
    const std::vector<point_int_t>& now = block->corners_;
    item.moved = !block->rasterized_ || now.size() != corners_.size() - item.first_corner ||
                 !std::equal(now.begin(), now.end(),
                             corners_.begin() + static_cast<long>(item.first_corner));
    const double cells_now = static_cast<double>(grid::CountCells(block->cells_));
    cells += item.moved ? CellsOfOutline(item.first_corner, corners_.size()) : cells_now;
    rasterized += cells_now;
  }
  cells_ += cells;
  growth_ += cells - rasterized;
  const double in_all = static_cast<double>(model.scene().grid.rasterized_cells()) + growth_;
  if (cells > rasterized && in_all > MaxCells(model)) RejectOversized(first_item, cells);
  ProposeCells(first_item);
}

/// Computes the cells of all items from `first_item` on.
void Placement::ProposeCells(size_t first_item) {
  for (size_t i = first_item; i < items_.size(); i++) {
    items_[i].first_set = sets_.size();
    const std::span<const point_int_t> corners = CornersOf(items_[i]);
    if (items_[i].moved) grid::AppendOutline(corners.data(), corners.size(), &sets_);
  }
}

/// Rejects the last body, which has `cells` cells, and removes its corners.
void Placement::RejectOversized(size_t first_item, double cells) {
  STAGE_ASSERT(first_item < items_.size() && cells > 0);
  growth_ -= cells;
  const size_t first_corner = items_[first_item].first_corner;
  corners_.resize(first_corner);
  if (!exact_corners_.empty()) exact_corners_.resize(first_corner);
  for (size_t i = first_item; i < items_.size(); i++) {
    Item& item = items_[i];
    item.first_corner = first_corner;
    item.moved = !item.block->rasterized_ || !item.block->corners_.empty();
    item.rejected_cells = cells;
  }
}

/// Appends the corners of a block, or none if it exceeds the grid.
void Placement::AppendCorners(const Block& block, const Pose& frame, const SineCosine& turn,
                              const sensing::Scene& scene) {
  const size_t first = corners_.size();
  for (const point_t& p : block.points_) {
    const double x = frame.x + p.x * turn.cosine - p.y * turn.sine;
    const double y = frame.y + p.x * turn.sine + p.y * turn.cosine;
    const double cx = std::floor(x * scene.cells_per_metre);
    const double cy = std::floor(y * scene.cells_per_metre);
    if (!(std::fabs(cx) < grid::kMaxCell && std::fabs(cy) < grid::kMaxCell)) {
      corners_.resize(first);
      if (scene.exact_rasterization) exact_corners_.resize(first);
      return;
    }
    corners_.emplace_back(static_cast<int>(cx), static_cast<int>(cy));
    if (scene.exact_rasterization) exact_corners_.emplace_back(x, y);
  }
}

/// Number of cells that the outline with these corners crosses.
double Placement::CellsOfOutline(size_t first_corner, size_t end) const {
  double cells = 0;
  for (size_t c = first_corner; c < end; c++) {
    const point_int_t &from = corners_[c], &to = corners_[c + 1 < end ? c + 1 : first_corner];
    cells += std::fabs(double{1} * to.x - from.x) + std::fabs(double{1} * to.y - from.y);
  }
  return cells;
}

/// Maximum number of cells that may be rasterized in the model's world.
double Placement::MaxCells(const Model& model) {
  const double models = static_cast<double>(model.world->host().models.size());
  return kRasterizedToLoaded * (kMaxCells + kMaxCellsPerModel * models);
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
    if (other.tree == tree || !other.model->vis.obstacle_return) return false;
    if (other.z_min > item.z.max || other.z_max < item.z.min) return false;
    hit = other.model;
    return true;
  };

  const auto probe = [&](uint32_t slot, uint64_t cells) {
    grid::ForEachCell({.slot = slot, .cells = cells}, [&](grid::CellRef cell) {
      if (hit == nullptr) grid.AnyIn(cell, runs_into);
    });
  };

  // In cells where the body already is, only those with several bodies matter.
  const std::vector<grid::CellSet>& now = item.block->cells_;
  if (!item.moved) {
    for (const grid::CellSet& set : now) probe(set.slot, grid.Crowded(set));
    return hit;
  }
  auto next = now.begin();
  for (const grid::CellSet& set : NewCellsOf(item)) {
    while (next != now.end() && next->ComesBefore(set)) ++next;
    if (next != now.end() && next->SameTile(set))
      probe(next->slot, set.cells & ~(next->cells & ~grid.Crowded(*next)));
    else
      probe(set.slot != 0 ? set.slot : grid.FindTileSlot(set), set.cells);
    if (hit != nullptr) return hit;
  }
  return nullptr;
}

namespace {

void Include(grid::CellBox* box, const point_int_t& p) {
  if (box->empty()) *box = {p.x, p.y, p.x, p.y};
  *box = {std::min(box->min_x, p.x), std::min(box->min_y, p.y), std::max(box->max_x, p.x),
          std::max(box->max_y, p.y)};
}

}  // namespace

bool Placement::IsNearlyFull(const Model& model) {
  // Turning a body changes its number of cells, but less than twofold.
  return static_cast<double>(model.scene().grid.rasterized_cells()) > MaxCells(model) / 2;
}

bool Placement::CanJoinConcurrentEdit() const {
  return std::all_of(items_.begin(), items_.end(), [&](const Item& item) {
    const Block& block = *item.block;
    if (!block.rasterized_ || item.rejected_cells > 0 || !item.model->is_registered_or_visible())
      return false;
    if (!item.model->scene().exact_rasterization) return true;
    return block.exact_ && block.exact_->CanJoinConcurrentEdit(CornersOf(item).size());
  });
}

bool Placement::IsInPlace() const {
  return std::ranges::none_of(
      items_, [](const Item& item) { return item.moved && item.rejected_cells == 0; });
}

size_t Placement::MaxExactSets(size_t tiles) const {
  size_t sets = 0;
  if (!exact_corners_.empty())
    for (const Item& item : items_)
      sets += ExactRasterization::MaxSets(CornersOf(item).size(), tiles);
  return sets;
}

/// An outline stays within the box of its corners. The exact rasterization includes adjacent cells.
grid::CellBox Placement::Cells() const {
  grid::CellBox box;
  for (const Item& item : items_) {
    if (item.moved)
      for (const point_int_t& corner : CornersOf(item)) Include(&box, corner);
    for (const point_int_t& corner : item.block->corners_) Include(&box, corner);
  }
  if (!exact_corners_.empty() && !box.empty())
    box = {box.min_x - 1, box.min_y - 1, box.max_x + 1, box.max_y + 1};
  return box;
}

void Placement::Commit(grid::Grid::Edit* edit) {
  for (const Item& item : items_) {
    CommitItem(item, edit);
    if (item.rejected_cells > 0) WarnTooLarge(item);
  }
}

void Placement::WarnTooLarge(const Item& item) {
  bool& warned = item.model->blockgroup->warned_too_large_;
  if (warned) return;
  warned = true;
  WarnAbout(*item.model,
            "found bodies whose outlines cross more than %.0f cells of the grid, %.0f of them this "
            "one's, expected smaller bodies or a coarser resolution; this one is not drawn",
            MaxCells(*item.model), item.rejected_cells);
}

std::span<const point_int_t> Placement::CornersOf(const Item& item) const {
  STAGE_ASSERT(&item >= items_.data() && &item <= &items_.back());
  const bool is_last = &item == &items_.back();
  const size_t end = is_last ? corners_.size() : (&item + 1)->first_corner;
  STAGE_ASSERT(item.first_corner <= end && end <= corners_.size());
  return std::span(corners_).subspan(item.first_corner, end - item.first_corner);
}

std::span<grid::CellSet> Placement::NewCellsOf(const Item& item) {
  const bool is_last = &item == &items_.back();
  const size_t end = is_last ? sets_.size() : (&item + 1)->first_set;
  STAGE_ASSERT(item.first_set <= end && end <= sets_.size());
  return std::span(sets_).subspan(item.first_set, end - item.first_set);
}

std::span<const grid::CellSet> Placement::NewCellsOf(const Item& item) const {
  return const_cast<Placement*>(this)->NewCellsOf(item);
}

void Placement::CommitItem(const Item& item, grid::Grid::Edit* edit) {
  STAGE_ASSERT(!edit || (item.block->rasterized_ && item.rejected_cells == 0 &&
                         item.model->is_registered_or_visible()));
  item.model->RegisterIfHidden();
  item.model->blockgroup->SetRasterizedSinceLoading(true);
  Block& block = *item.block;
  grid::Grid& grid = item.model->scene().grid;
  const grid::Body body{.z_min = item.z.min,
                        .z_max = item.z.max,
                        .model = item.model,
                        .tree = item.model->Root(),
                        .ranger_visible = !(item.model->vis.ranger_return < 0),
                        .drives = item.model->Root()->Drives(),
                        .number = item.model->GetId()};
  const std::span<const point_int_t> corners = CornersOf(item);
  if (item.model->scene().exact_rasterization) RasterizeExactly(item, body, edit);
  if (block.rasterized_) {
    grid.ChangeBody(block.body_, body, block.cells_);
  } else {
    block.body_ = grid.AddBody(body);
    block.rasterized_ = item.model->blockgroup->rasterized_ = true;
  }
  if (!item.moved) return;
  const std::span<grid::CellSet> sets = NewCellsOf(item);
  STAGE_ASSERT(grid::AreSorted(sets) && (sets.empty() || !corners.empty()));
  // Allocates first, so that the block always matches what is rasterized.
  block.cells_.reserve(sets.size());
  block.corners_.reserve(corners.size());
  grid.Rasterize(block.body_, block.cells_, sets, edit);
  block.cells_.assign(sets.begin(), sets.end());
  block.corners_.assign(corners.begin(), corners.end());
}

void Placement::AddExactRasterizations() {
  for (const Item& item : items_) {
    if (!item.block->rasterized_) continue;
    const grid::Body body = item.model->scene().grid.body(item.block->body_);
    RasterizeExactly(item, body, nullptr);
  }
}

/// `body` holds the properties of the block in the grid.
void Placement::RasterizeExactly(const Item& item, const grid::Body& body, grid::Grid::Edit* edit) {
  Block& block = *item.block;
  sensing::Scene& scene = item.model->scene();
  STAGE_ASSERT(scene.exact_rasterization && exact_corners_.size() == corners_.size());
  if (!block.exact_) block.exact_ = std::make_unique<ExactRasterization>();
  block.exact_->Rasterize(
      &scene.grid, body,
      std::span(exact_corners_).subspan(item.first_corner, CornersOf(item).size()),
      scene.cells_per_metre, edit);
}

}  // namespace Stg
