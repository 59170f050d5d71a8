// SPDX-License-Identifier: GPL-2.0-or-later

#include "sensing/batch.hh"

#include <algorithm>
#include <cmath>

#include "messages/assert.hh"

namespace Stg::internal::sensing {

namespace {

/// True if the vector has length 1, apart from rounding.
[[maybe_unused]] bool IsUnit(const SineCosine& v) {
  return std::fabs(v.sine * v.sine + v.cosine * v.cosine - 1) < 1e-9;
}

}  // namespace

void RayBatch::Clear() {
  fan_count_ = 0;
  mask_words_.clear();
  own_directions_.clear();
  own_unit_vectors_.clear();
  fans_with_own_directions_.clear();
  tables_ = nullptr;
  ray_count_ = 0;
  asked_ = RangeModels();
}

void RayBatch::Add(Fan fan, uint32_t samples, const SelfMask& mask) {
  const BatchSpace before = Allocate({.rays = samples, .fans = 1});
  Put(before.fans, fan, before.rays, samples, mask);
}

BatchSpace RayBatch::Allocate(const BatchSpace& space) {
  const BatchSpace before{ray_count_, fan_count_, static_cast<uint32_t>(mask_words_.size()),
                          static_cast<uint32_t>(fans_with_own_directions_.size()),
                          own_directions_.size()};
  STAGE_ASSERT(tables_ == nullptr);  // not closed
  STAGE_ASSERT(space.fans <= UINT32_MAX - fan_count_);
  const uint32_t fans = fan_count_ + space.fans;
  if (fans > fans_.size()) fans_.resize(fans);
  if (fans > device_fans_.size()) device_fans_.resize(fans);
  mask_words_.resize(before.words + space.words, 0);
  fans_with_own_directions_.resize(before.custom_fans + space.custom_fans);
  own_directions_.resize(before.own_directions + space.own_directions);
  own_unit_vectors_.resize(before.own_directions + space.own_directions);
  fan_count_ = fans;
  ray_count_ += space.rays;
  return before;
}

void RayBatch::Put(uint32_t index, Fan fan, uint64_t first_ray, uint32_t samples,
                   const SelfMask& mask) {
  STAGE_ASSERT(tables_ == nullptr && index < fan_count_ && first_ray + samples <= ray_count_);
  STAGE_ASSERT(mask.width <= kMaxMaskSide && mask.height <= kMaxMaskSide);
  STAGE_ASSERT(mask.words() == 0 || mask.first + mask.words() <= mask_words_.size());
  STAGE_ASSERT(fan.layer < grid::kMaxLayers || fan.layer == grid::kNoLayer);
  STAGE_ASSERT(fan.nothing || (fan.leg_cells <= RAY_LEG_CELLS && fan.legs >= 1));
  STAGE_ASSERT(fan.nothing || IsUnit(fan.heading));
  fan.record.mask_x = mask.x;
  fan.record.mask_y = mask.y;
  fan.record.mask_size = mask.width | mask.height << 16;
  fan.record.mask_first = mask.first;
  fan.record.first_ray = static_cast<uint32_t>(first_ray);  // see FitsDevice()
  fan.record.samples = samples;
  fans_[index] = fan;
  device_fans_[index] = {.record = fan.record,
                         .layer = fan.layer,
                         .fits = fan.single_leg() && samples > 0,
                         .exact = fan.exact,
                         .sees_all = fan.sees_all_but != nullptr,
                         .one_height = fan.z_test && !std::isnan(fan.z)};
}

void RayBatch::Put(const BatchSpace& first, const FanList& list, const FanList::Entry& entry,
                   const SelfMask& mask) {
  if (!entry.has_own_directions) return Put(first.fans, entry.fan, first.rays, entry.samples, mask);
  Fan fan = entry.fan;
  fan.record.first_direction = static_cast<uint32_t>(first.own_directions);
  const std::span<const SineCosine> unit_vectors = list.UnitVectorsOf(entry);
  STAGE_ASSERT(first.own_directions + unit_vectors.size() <= own_unit_vectors_.size());
  STAGE_ASSERT(first.custom_fans < fans_with_own_directions_.size());
  for (size_t i = 0; i < unit_vectors.size(); i++) {
    STAGE_ASSERT(IsUnit(unit_vectors[i]));
    own_unit_vectors_[first.own_directions + i] = unit_vectors[i];
    own_directions_[first.own_directions + i] = MakeDirection(unit_vectors[i]);
  }
  fans_with_own_directions_[first.custom_fans] = first.fans;
  Put(first.fans, fan, first.rays, entry.samples, mask);
}

void RayBatch::Close(const DirectionTables& tables) {
  STAGE_ASSERT(tables_ == nullptr);
  STAGE_ASSERT(
      std::ranges::none_of(fans(), [](const Fan& f) { return f.layer == grid::kNoLayer; }));
  tables_ = &tables;
  const uint32_t first = static_cast<uint32_t>(tables.all().size());
  for (const uint32_t i : fans_with_own_directions_) {
    STAGE_ASSERT(i < fan_count_);
    device_fans_[i].record.first_direction = fans_[i].record.first_direction += first;
  }
}

const Direction* RayBatch::DirectionsOf(const Fan& fan) const {
  STAGE_ASSERT(tables_ != nullptr);  // closed
  const uint32_t in_tables = static_cast<uint32_t>(tables_->all().size());
  const uint32_t first = fan.record.first_direction;
  STAGE_ASSERT(first + fan.record.samples <=
               (first < in_tables ? 0 : own_directions_.size()) + in_tables);
  // Uses data(), because a fan without samples may have an index past the end.
  return first < in_tables ? tables_->all().data() + first
                           : own_directions_.data() + (first - in_tables);
}

const SineCosine* RayBatch::UnitVectorsOf(const Fan& fan) const {
  STAGE_ASSERT(tables_ != nullptr);  // closed
  const uint32_t in_tables = static_cast<uint32_t>(tables_->unit_vectors().size());
  const uint32_t first = fan.record.first_direction;
  return first < in_tables ? tables_->unit_vectors().data() + first
                           : own_unit_vectors_.data() + (first - in_tables);
}

ray_mask_t RayBatch::SelfMaskOf(const Fan& fan) const {
  const FanRecord& r = fan.record;
  STAGE_ASSERT(r.mask_size == 0 || r.mask_first < mask_words_.size());
  return {mask_words_.data() + r.mask_first, r.mask_x, r.mask_y, r.mask_size & 0xffff,
          r.mask_size >> 16};
}

SelfMask RayBatch::MakeSelfMask(const grid::Grid& grid, const grid::Rasterizations& own,
                                const void* tree, bool exact) {
  SelfMask mask = SelfMaskBounds(own);
  mask.first = Allocate({.words = mask.words()}).words;
  FillSelfMask(mask, grid, own, tree, exact);
  return mask;
}

SelfMask RayBatch::SelfMaskBounds(const grid::Rasterizations& own) {
  grid::CellBox box;  // in tiles
  own.ForEachSet([&](const grid::CellSet& set) {
    if (box.empty()) box = {set.x, set.y, set.x, set.y};
    box = {std::min(box.min_x, set.x), std::min(box.min_y, set.y), std::max(box.max_x, set.x),
           std::max(box.max_y, set.y)};
  });
  if (box.empty()) return SelfMask();
  const int64_t width = int64_t{box.max_x} - box.min_x + 1;
  const int64_t height = int64_t{box.max_y} - box.min_y + 1;
  if (width > kMaxMaskSide || height > kMaxMaskSide) return SelfMask();
  return {box.min_x, box.min_y, static_cast<uint32_t>(width), static_cast<uint32_t>(height), 0};
}

namespace {

/// Mask of the cell set's cells that also hold bodies of other trees. Adds to *layers those in
/// which a body of the tree is in such a cell, but none of another tree.
uint64_t CellsOfOthers(const grid::Grid& grid, const grid::CellSet& set, const void* tree,
                       uint64_t* layers) {
  uint64_t cells = 0;
  grid::CellSet crowded = set;
  crowded.cells = grid.Crowded(set);
  grid::ForEachCell(crowded, [&](grid::CellRef cell) {
    uint32_t own = 0, others = 0;
    bool has_others = false;
    grid.AnyIn(cell, [&](grid::BodyId id) {
      const grid::Body& body = grid.body(id);
      const bool is_other = body.tree != tree;
      (is_other ? others : own) |= body.layers;
      has_others = has_others || is_other;
      return false;
    });
    if (!has_others) return;
    cells |= uint64_t{1} << (cell & 63);
    *layers |= own & ~others;
  });
  return cells;
}

/// Mask of the cells in the cell set's tile that exact outlines of other trees touch.
uint64_t OutlinesOfOthers(const grid::Grid& grid, const grid::CellSet& set, const void* tree) {
  uint64_t cells = 0;
  grid.ForEachOutline(grid.OutlinesIn(set.slot), [&](const grid::OutlineFragment& outline) {
    if (grid.body(outline.id).tree != tree) cells |= outline.cells;
  });
  return cells;
}

}  // namespace

void RayBatch::FillSelfMask(const SelfMask& mask, const grid::Grid& grid,
                            const grid::Rasterizations& own, const void* tree, bool exact) {
  if (mask.words() == 0) return;
  STAGE_ASSERT(mask.first + mask.words() <= mask_words_.size());
  uint64_t* words = &mask_words_[mask.first];
  own.ForEachSet([&](const grid::CellSet& set) {
    const uint64_t hidden =
        set.cells & ~(exact ? OutlinesOfOthers(grid, set, tree)
                            : CellsOfOthers(grid, set, tree, words + mask.tiles()));
    const uint32_t x = static_cast<uint32_t>(set.x - mask.x);
    STAGE_ASSERT(x < mask.width && static_cast<uint32_t>(set.y - mask.y) < mask.height);
    words[static_cast<uint32_t>(set.y - mask.y) * mask.width + x] |= hidden;
  });
}

}  // namespace Stg::internal::sensing
