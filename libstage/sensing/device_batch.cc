// SPDX-License-Identifier: GPL-2.0-or-later

#include "sensing/device_batch.hh"

#include <algorithm>
#include <atomic>
#include <bit>
#include <utility>

#include "messages/assert.hh"

namespace Stg::internal::sensing {

namespace {

constexpr uint32_t kNoGroup = 0xffffffffu;

// Number of fans that one thread sorts at a time.
constexpr std::size_t kBlock = 64;
std::size_t CountBlocks(std::size_t fans) { return (fans + kBlock - 1) / kBlock; }

/// Calls f(block, first, end) for each block of fans, on all threads.
template <typename F>
void ForEachBlock(std::size_t fans, threads::WorkerPool* workers, F f) {
  workers->Run(CountBlocks(fans), 1, [&](std::size_t begin, std::size_t end, unsigned) {
    for (std::size_t block = begin; block < end; block++)
      f(block, block * kBlock, std::min((block + 1) * kBlock, fans));
  });
}

ray_range_record_t RangeRecordOf(const Fan& fan) {
  const auto bits = [](double number) { return std::bit_cast<uint64_t>(number); };
  return {.x = bits(fan.x),
          .y = bits(fan.y),
          .cosine = bits(fan.heading.cosine),
          .sine = bits(fan.heading.sine),
          .range = bits(fan.range),
          .tree = reinterpret_cast<uintptr_t>(fan.sees_all_but)};
}

}  // namespace

/// Groups fans by layer, result and number of samples and keeps their order within a group. There
/// are few kinds of sensors, so there are few groups, mostly the same from batch to batch.
void DeviceBatch::Sort(const RayBatch& batch, threads::WorkerPool* workers) {
  if (!CountGroups(batch, workers)) {
    FindGroups(batch);
    CountGroups(batch, workers);
  }
  fan_count_ = 0;
  has_ranges_ = false;
  for (std::size_t g = 0; g < groups_.size(); g++) {
    groups_[g].first_fan = static_cast<uint32_t>(fan_count_);
    for (std::size_t i = g; i < counts_or_next_.size(); i += groups_.size())
      fan_count_ += std::exchange(counts_or_next_[i], static_cast<uint32_t>(fan_count_));
    groups_[g].fans = static_cast<uint32_t>(fan_count_) - groups_[g].first_fan;
    has_ranges_ |= groups_[g].fans > 0 && groups_[g].result != DeviceResult::kHits;
  }
  mask_words_ = batch.mask_words().size();
  NameLayers();
}

/// Counts the fans of each group. Returns false if a fan belongs to no known group.
bool DeviceBatch::CountGroups(const RayBatch& batch, threads::WorkerPool* workers) {
  const std::span<const DeviceFan> fans = batch.device_fans();
  group_of_fan_.resize(fans.size());
  counts_or_next_.assign(CountBlocks(fans.size()) * groups_.size(), 0);
  std::atomic<bool> all_known{true};
  ForEachBlock(fans.size(), workers, [&](std::size_t block, std::size_t first, std::size_t end) {
    uint32_t* const counts = counts_or_next_.data() + block * groups_.size();
    uint32_t last = 0;
    for (std::size_t i = first; i < end; i++) {
      group_of_fan_[i] = kNoGroup;
      if (!fans[i].fits) continue;
      last = GroupOf(fans[i], batch.ResultOf(fans[i]), last);
      if (last == kNoGroup) return all_known.store(false, std::memory_order_relaxed);
      group_of_fan_[i] = last;
      counts[last]++;
    }
  });
  return all_known;
}

/// Rebuilds the list of groups.
void DeviceBatch::FindGroups(const RayBatch& batch) {
  groups_.clear();
  uint32_t last = 0;
  for (const DeviceFan& fan : batch.device_fans()) {
    if (!fan.fits) continue;
    const DeviceResult result = batch.ResultOf(fan);
    last = GroupOf(fan, result, last);
    if (last != kNoGroup) continue;
    last = static_cast<uint32_t>(groups_.size());
    groups_.push_back({fan.layer, result, fan.record.samples, 0, 0});
  }
}

/// Index of the fan's group, or kNoGroup. Tests `likely` first: neighbours are mostly alike.
uint32_t DeviceBatch::GroupOf(const DeviceFan& fan, DeviceResult result, uint32_t likely) const {
  const auto fits = [&](const Group& group) {
    return group.layer == fan.layer && group.samples == fan.record.samples &&
           group.result == result;
  };
  if (likely < groups_.size() && fits(groups_[likely])) return likely;
  const auto found = std::find_if(groups_.begin(), groups_.end(), fits);
  return found == groups_.end() ? kNoGroup : static_cast<uint32_t>(found - groups_.begin());
}

bool DeviceBatch::Has(DeviceResult result) const {
  return std::ranges::any_of(
      groups_, [&](const Group& group) { return group.fans > 0 && group.result == result; });
}

void DeviceBatch::NameLayers() {
  layers_.clear();
  for (const Group& group : groups_)
    if (group.fans > 0 && std::count(layers_.begin(), layers_.end(), group.layer) == 0)
      layers_.push_back(group.layer);
}

void DeviceBatch::PlanLaunches(std::span<const double> fractions, std::size_t work_group,
                               bool one_for_each_group,
                               const std::function<LayerPlace(grid::LayerIndex)>& place_of) {
  STAGE_ASSERT(!fractions.empty() && fractions.back() == 1 && work_group > 0);
  PlanParts(fractions);
  launches_.clear();
  group_records_.clear();
  for (std::size_t chunk = 0; chunk < chunks_.size(); chunk++)
    for (std::size_t group = 0; group < groups_.size(); group++)
      PlanGroup(group, chunk, work_group, one_for_each_group, place_of(groups_[group].layer));
  std::erase_if(launches_, [](const Launch& launch) { return launch.items == 0; });
}

/// Parts start at block borders, because the destination of each block is known.
void DeviceBatch::PlanParts(std::span<const double> fractions) {
  const std::size_t fans = group_of_fan_.size(), blocks = CountBlocks(fans);
  chunks_.clear();
  std::size_t first = 0;
  for (const double fraction : fractions) {
    STAGE_ASSERT(fraction > 0 && fraction <= 1);
    const auto block = static_cast<std::size_t>(static_cast<double>(blocks) * fraction);
    const std::size_t end = std::min(block * kBlock, fans);
    STAGE_ASSERT(first <= end);
    chunks_.push_back({first, end});
    first = end;
  }
}

/// Index, among sorted fans, of the first fan of the group in the part that starts at `fan`.
uint32_t DeviceBatch::FirstOfGroup(std::size_t group, std::size_t fan) const {
  STAGE_ASSERT(fan <= group_of_fan_.size() && (fan % kBlock == 0 || fan == group_of_fan_.size()));
  const Group& g = groups_[group];
  if (fan == group_of_fan_.size()) return g.first_fan + g.fans;
  return counts_or_next_[fan / kBlock * groups_.size() + group];
}

/// Plans the fans of a group that are in the part.
void DeviceBatch::PlanGroup(std::size_t group, std::size_t chunk, std::size_t work_group,
                            bool one_for_each_group, LayerPlace place) {
  constexpr std::size_t kMaxItems = 0xffffffffu;
  const std::size_t g = group_records_.size();
  const uint32_t samples = groups_[group].samples;
  const uint32_t first_fan = FirstOfGroup(group, chunks_[chunk].first_fan);
  const uint32_t fans = FirstOfGroup(group, chunks_[chunk].end_fan) - first_fan;
  const std::size_t items = std::size_t{fans} * samples;
  const std::size_t padded = (items + work_group - 1) / work_group * work_group;
  const bool first = launches_.empty() || launches_.back().chunk != chunk ||
                     launches_.back().items + padded > kMaxItems ||
                     launches_.back().result != groups_[group].result;
  if (first || (one_for_each_group && items > 0))
    launches_.push_back({g, g, 0, chunk, groups_[group].result});
  Launch& launch = launches_.back();
  group_records_.push_back({.first_item = static_cast<uint32_t>(launch.items),
                            .fans = fans,
                            .samples = samples,
                            .first_fan = static_cast<uint32_t>(first_fan_record()) + first_fan,
                            .region_maps = place.region_maps,
                            .tile_maps = place.tile_maps,
                            .tiles = place.tiles,
                            .layer = groups_[group].layer});
  launch.items += padded;
  STAGE_ASSERT(launch.items <= kMaxItems && launch.items % work_group == 0);
  launch.end_group = g + 1;
}

void DeviceBatch::Write(const RayBatch& batch, void* memory, threads::WorkerPool* workers) {
  const std::span<const DeviceFan> fans = batch.device_fans();
  const std::vector<uint64_t>& masks = batch.mask_words();
  STAGE_ASSERT(!chunks_.empty());  // after PlanLaunches()
  STAGE_ASSERT(fans.size() == group_of_fan_.size() && masks.size() == mask_words_);  // as in Sort()
  STAGE_ASSERT(reinterpret_cast<uintptr_t>(memory) % alignof(ray_group_record_t) == 0);
  auto* const groups = static_cast<ray_group_record_t*>(memory);
  auto* const records = static_cast<FanRecord*>(memory) + first_fan_record();
  auto* const for_ranges =
      static_cast<ray_range_record_t*>(memory) + first_fan_record() + to_range_record();
  auto* const words = static_cast<uint64_t*>(memory) + first_mask();
  std::copy(group_records_.begin(), group_records_.end(), groups);
  const std::size_t blocks = CountBlocks(fans.size());
  ForEachBlock(fans.size(), workers, [&](std::size_t block, std::size_t first, std::size_t end) {
    uint32_t* const next = counts_or_next_.data() + block * groups_.size();
    for (std::size_t i = first; i < end; i++) {
      if (group_of_fan_[i] == kNoGroup) continue;
      STAGE_ASSERT(fans[i].fits && next[group_of_fan_[i]] < fan_count_);
      const uint32_t place = next[group_of_fan_[i]]++;
      records[place] = fans[i].record;
      if (has_ranges_) for_ranges[place] = RangeRecordOf(batch.fans()[i]);
    }
    const std::size_t word = masks.size() * block / blocks;  // plus a slice of the self-masks
    std::copy(masks.data() + word, masks.data() + masks.size() * (block + 1) / blocks,
              words + word);
  });
}

}  // namespace Stg::internal::sensing
