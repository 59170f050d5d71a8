// SPDX-License-Identifier: GPL-2.0-or-later

#include "sensing/batch.hh"

#include <algorithm>

namespace Stg::internal::sensing {

void RayBatch::Clear() {
  fan_count_ = 0;
  window_words_.clear();
  own_directions_.clear();
  own_turns_.clear();
  fans_with_own_directions_.clear();
  tables_ = nullptr;
  ray_count_ = 0;
}

void RayBatch::Add(Fan fan, uint32_t samples, const Window& window) {
  const BatchShare before = AddRoom({.rays = samples, .fans = 1});
  Put(before.fans, fan, before.rays, samples, window);
}

BatchShare RayBatch::AddRoom(const BatchShare& share) {
  const BatchShare before{ray_count_, fan_count_, static_cast<uint32_t>(window_words_.size()),
                          static_cast<uint32_t>(fans_with_own_directions_.size()),
                          own_directions_.size()};
  const uint32_t fans = fan_count_ + share.fans;
  if (fans > fans_.size()) fans_.resize(fans);
  if (fans > device_fans_.size()) device_fans_.resize(fans);
  window_words_.resize(before.words + share.words, 0);
  fans_with_own_directions_.resize(before.turned_fans + share.turned_fans);
  own_directions_.resize(before.turns + share.turns);
  own_turns_.resize(before.turns + share.turns);
  fan_count_ = fans;
  ray_count_ += share.rays;
  return before;
}

void RayBatch::Put(uint32_t index, Fan fan, uint64_t first_ray, uint32_t samples,
                   const Window& window) {
  fan.record.window_x = window.x;
  fan.record.window_y = window.y;
  fan.record.window_size = window.width | window.height << 16;
  fan.record.window_first = window.first;
  fan.record.first_ray = static_cast<uint32_t>(first_ray);  // see FitsDevice()
  fan.record.samples = samples;
  fans_[index] = fan;
  device_fans_[index] = {fan.record, fan.layer, fan.single_leg() && samples > 0};
}

void RayBatch::Put(const BatchShare& first, const FanList& list, const FanList::Entry& entry,
                   const Window& window) {
  if (!entry.turned) return Put(first.fans, entry.fan, first.rays, entry.samples, window);
  Fan fan = entry.fan;
  fan.record.first_direction = static_cast<uint32_t>(first.turns);
  const std::span<const SineCosine> turns = list.TurnsOf(entry);
  for (size_t i = 0; i < turns.size(); i++) {
    own_turns_[first.turns + i] = turns[i];
    own_directions_[first.turns + i] = MakeDirection(turns[i]);
  }
  fans_with_own_directions_[first.turned_fans] = first.fans;
  Put(first.fans, fan, first.rays, entry.samples, window);
}

void RayBatch::Close(const DirectionTables& tables) {
  tables_ = &tables;
  const uint32_t first = static_cast<uint32_t>(tables.all().size());
  for (const uint32_t i : fans_with_own_directions_)
    device_fans_[i].record.first_direction = fans_[i].record.first_direction += first;
}

const Direction* RayBatch::DirectionsOf(const Fan& fan) const {
  const uint32_t in_tables = static_cast<uint32_t>(tables_->all().size());
  const uint32_t first = fan.record.first_direction;
  // By data(): a fan without samples may come behind the last one.
  return first < in_tables ? tables_->all().data() + first
                           : own_directions_.data() + (first - in_tables);
}

const SineCosine* RayBatch::TurnsOf(const Fan& fan) const {
  const uint32_t in_tables = static_cast<uint32_t>(tables_->turns().size());
  const uint32_t first = fan.record.first_direction;
  return first < in_tables ? tables_->turns().data() + first
                           : own_turns_.data() + (first - in_tables);
}

ray_window_t RayBatch::WindowOf(const Fan& fan) const {
  const FanRecord& r = fan.record;
  return {window_words_.data() + r.window_first, r.window_x, r.window_y, r.window_size & 0xffff,
          r.window_size >> 16};
}

Window RayBatch::MakeWindow(const grid::Grid& grid, const grid::Drawings& own, const void* tree,
                            bool exact) {
  Window window = PlanWindow(own);
  window.first = AddRoom({.words = window.words()}).words;
  FillWindow(window, grid, own, tree, exact);
  return window;
}

Window RayBatch::PlanWindow(const grid::Drawings& own) {
  grid::CellBox box;  // in tiles
  own.ForEachPart([&](const grid::TilePart& part) {
    if (box.empty()) box = {part.x, part.y, part.x, part.y};
    box = {std::min(box.min_x, part.x), std::min(box.min_y, part.y), std::max(box.max_x, part.x),
           std::max(box.max_y, part.y)};
  });
  if (box.empty()) return Window();
  const int64_t width = int64_t{box.max_x} - box.min_x + 1;
  const int64_t height = int64_t{box.max_y} - box.min_y + 1;
  if (width > kMaxWindowSide || height > kMaxWindowSide) return Window();
  return {box.min_x, box.min_y, static_cast<uint32_t>(width), static_cast<uint32_t>(height), 0};
}

void RayBatch::FillWindow(const Window& window, const grid::Grid& grid, const grid::Drawings& own,
                          const void* tree, bool exact) {
  if (window.words() == 0) return;
  uint64_t* words = &window_words_[window.first];
  const auto is_other = [&](grid::BodyId id) {
    return grid.body(id).tree != tree && grid.body(id).exact() == exact;
  };
  own.ForEachPart([&](const grid::TilePart& part) {
    uint64_t hidden = part.cells;
    grid::TilePart crowded = part;
    crowded.cells = grid.Crowded(part);
    grid::ForEachCell(crowded, [&](grid::CellRef cell) {
      if (grid.AnyIn(cell, is_other)) hidden &= ~(uint64_t{1} << (cell & 63));
    });
    const uint32_t x = static_cast<uint32_t>(part.x - window.x);
    words[static_cast<uint32_t>(part.y - window.y) * window.width + x] |= hidden;
  });
}

}  // namespace Stg::internal::sensing
