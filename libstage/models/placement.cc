// SPDX-License-Identifier: GPL-2.0-or-later

#include "models/placement.hh"

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
  const double models = static_cast<double>(model.host().models.size());
  return kRasterizedToLoaded * (kMaxCells + kMaxCellsPerModel * models);
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
