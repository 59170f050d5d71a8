// SPDX-License-Identifier: GPL-2.0-or-later

#include "libstage_cl/cl_prefilter.hh"

#include <algorithm>
#include <atomic>
#include <bit>
#include <chrono>
#include <cstdlib>
#include <string>
#include <utility>

#include "libstage_cl/program.hh"

namespace Stg::cl {

namespace {

// Rays in a work-group. A CPU takes one group after the other and pays for each; on a GPU small
// groups spread better.
constexpr std::size_t kWorkGroupCpu = 256, kWorkGroupGpu = 64;

double Now() {
  using Clock = std::chrono::steady_clock;
  return std::chrono::duration<double>(Clock::now().time_since_epoch()).count();
}

::cl::NDRange RoundedUp(std::size_t count, std::size_t work_group) {
  return ::cl::NDRange((count + work_group - 1) / work_group * work_group);
}

/// STAGE_CL_MEMORY in the environment says otherwise: "own" or "shared".
bool SharesMemory(const ::cl::Device& device) {
  const char* choice = std::getenv("STAGE_CL_MEMORY");
  const std::string wanted = choice ? choice : "";
  if (!wanted.empty()) return wanted != "own";
  cl_bool shared = CL_FALSE;
  device.getInfo(CL_DEVICE_HOST_UNIFIED_MEMORY, &shared);
  return shared != CL_FALSE;
}

sensing::PrefilterError AsPrefilterError(const ::cl::Error& error) {
  return sensing::PrefilterError(std::string(error.what()) + ", error " +
                                 std::to_string(error.err()));
}

}  // namespace

ClPrefilter::ClPrefilter(const FoundDevice& device, uint32_t hits_per_ray)
    : name_(device.kind + " " + device.name + " (" + device.platform + ")"),
      is_cpu_(device.kind == "cpu"),
      per_ray_(hits_per_ray),
      context_(device.device),
      queue_(context_, device.device),
      memory_(context_, queue_, SharesMemory(device.device)),
      directory_(&memory_),
      regions_(&memory_),
      fans_(&memory_),
      directions_(&memory_),
      windows_(&memory_),
      hits_(&memory_),
      places_(&memory_),
      words_(&memory_) {
  const double start = Now();
  const ::cl::Program program = BuildProgram(context_, device.device);
  walk_ = ::cl::Kernel(program, "walk_fans");
  update_ = ::cl::Kernel(program, "update_words");
  const std::size_t most = walk_.getWorkGroupInfo<CL_KERNEL_WORK_GROUP_SIZE>(device.device);
  work_group_ = std::min(is_cpu_ ? kWorkGroupCpu : kWorkGroupGpu, most);
  statistics_.compile_seconds = Now() - start;
}

sensing::HitLists ClPrefilter::Walk(grid::Grid& grid, const sensing::DirectionTables& tables,
                                    const sensing::RayBatch& batch,
                                    sensing::WorkerPool* workers) try {
  const double start = Now();
  hits_.Unmap();
  memory_.from_device.Reset();
  MakeGroups(batch, workers);
  SendGrid(grid);
  SendFans(batch, workers);
  SendDirections(tables, batch);
  const std::size_t hit_bytes = std::size_t{batch.ray_count()} * per_ray_ * sizeof(uint32_t);
  hits_.Reserve(hit_bytes);

  const double sent = Now();
  for (const Group& group : groups_)
    if (group.fans > 0) Launch(grid, group);
  queue_.finish();
  memory_.to_device.Reset();
  sent_ahead_ = false;
  const double walked = Now();
  const auto* hits = static_cast<const uint32_t*>(hits_.MapForReading(hit_bytes));
  statistics_.send_seconds += sent - start;
  statistics_.walk_seconds += walked - sent;
  statistics_.fetch_seconds += Now() - walked;
  statistics_.bytes_fetched += hit_bytes;
  return {hits, per_ray_};
} catch (const ::cl::Error& error) {
  throw AsPrefilterError(error);
}

void ClPrefilter::SendAhead(grid::Grid& grid) try {
  if (sent_ahead_) return;  // pinned memory is free again when a batch has been walked
  const double start = Now();
  SendGrid(grid);
  queue_.flush();
  sent_ahead_ = true;
  statistics_.send_seconds += Now() - start;
} catch (const ::cl::Error& error) {
  throw AsPrefilterError(error);
}

/// Fans that the device can walk, by layer and number of samples; within these in their own order.
/// There are few kinds of sensors, so few groups, and mostly the same ones from batch to batch.
void ClPrefilter::MakeGroups(const sensing::RayBatch& batch, sensing::WorkerPool* workers) {
  const std::span<const sensing::DeviceFan> fans = batch.device_fans();
  if (!CountGroups(fans, workers)) {
    FindGroups(fans);
    CountGroups(fans, workers);
  }
  fan_count_ = 0;
  for (std::size_t g = 0; g < groups_.size(); g++) {
    groups_[g].first_fan = static_cast<uint32_t>(fan_count_);
    for (std::size_t i = g; i < next_in_group_.size(); i += groups_.size())
      fan_count_ += std::exchange(next_in_group_[i], static_cast<uint32_t>(fan_count_));
    groups_[g].fans = static_cast<uint32_t>(fan_count_) - groups_[g].first_fan;
  }
}

/// Calls f(block, first, end) for each block of so many fans, on all threads.
template <typename F>
void ClPrefilter::ForEachBlock(std::size_t fans, sensing::WorkerPool* workers, F f) {
  workers->Run(CountBlocks(fans), 1, [&](std::size_t begin, std::size_t end, unsigned) {
    for (std::size_t block = begin; block < end; block++)
      f(block, block * kBlock, std::min((block + 1) * kBlock, fans));
  });
}

/// False if there is a fan of none of the groups.
bool ClPrefilter::CountGroups(std::span<const sensing::DeviceFan> fans,
                              sensing::WorkerPool* workers) {
  group_of_fan_.resize(fans.size());
  next_in_group_.assign(CountBlocks(fans.size()) * groups_.size(), 0);
  std::atomic<bool> all_known{true};
  ForEachBlock(fans.size(), workers, [&](std::size_t block, std::size_t first, std::size_t end) {
    uint32_t* const counts = next_in_group_.data() + block * groups_.size();
    uint32_t last = 0;
    for (std::size_t i = first; i < end; i++) {
      group_of_fan_[i] = kNoGroup;
      if (!fans[i].fits) continue;
      last = GroupOf(fans[i], last);
      if (last == kNoGroup) return all_known.store(false, std::memory_order_relaxed);
      group_of_fan_[i] = last;
      counts[last]++;
    }
  });
  return all_known;
}

/// Makes the groups anew.
void ClPrefilter::FindGroups(std::span<const sensing::DeviceFan> fans) {
  groups_.clear();
  uint32_t last = 0;
  for (const sensing::DeviceFan& fan : fans) {
    if (!fan.fits) continue;
    last = GroupOf(fan, last);
    if (last != kNoGroup) continue;
    last = static_cast<uint32_t>(groups_.size());
    groups_.push_back({fan.layer, fan.record.samples, 0, 0});
  }
}

/// kNoGroup if there is none. `likely` is looked at first: neighbours are of one kind.
uint32_t ClPrefilter::GroupOf(const sensing::DeviceFan& fan, uint32_t likely) const {
  const auto fits = [&](const Group& group) {
    return group.layer == fan.layer && group.samples == fan.record.samples;
  };
  if (likely < groups_.size() && fits(groups_[likely])) return likely;
  const auto found = std::find_if(groups_.begin(), groups_.end(), fits);
  return found == groups_.end() ? kNoGroup : static_cast<uint32_t>(found - groups_.begin());
}

/// What the groups' walks need of it.
void ClPrefilter::SendGrid(const grid::Grid& grid) {
  SendStructure(grid);
  for (uint32_t i = 0; i < grid.layer_count(); i++) {
    const bool wanted = std::any_of(groups_.begin(), groups_.end(), [i](const Group& group) {
      return group.fans > 0 && group.layer == i;
    });
    if (wanted) SendLayer(grid, i);
  }
}

void ClPrefilter::SendStructure(const grid::Grid& grid) {
  if (grid.structure_version() == structure_version_) return;
  structure_version_ = grid.structure_version();
  const auto send = [this](Buffer* buffer, const auto& data) {
    const std::size_t bytes = data.size() * sizeof(data[0]);
    buffer->Write(data.data(), bytes);
    CountSent(bytes);
  };
  send(&directory_, grid.directory());
  send(&regions_, grid.region_tables());
}

void ClPrefilter::SendLayer(const grid::Grid& grid, uint32_t index) {
  while (layers_.size() <= index) layers_.push_back(std::make_unique<Layer>(&memory_));
  Layer& layer = *layers_[index];
  const grid::Occupancy& cells = grid.occupancy(index);
  const std::size_t map_bytes = cells.tile_maps().size() * sizeof(uint64_t);
  const std::size_t tile_bytes = cells.tiles().size() * sizeof(uint64_t);
  const bool maps_grew = layer.tile_maps.Reserve(map_bytes);
  const bool tiles_grew = layer.tiles.Reserve(tile_bytes);
  // Everything, if it is new or if much of it has changed.
  if (maps_grew || tiles_grew || layer.made != cells.made() ||
      cells.CountChangedTiles() * 4 > cells.tiles().size()) {
    layer.tile_maps.Write(cells.tile_maps().data(), map_bytes);
    layer.tiles.Write(cells.tiles().data(), tile_bytes);
    CountSent(map_bytes + tile_bytes);
  } else {
    SendChanges(cells, &layer);
  }
  layer.regions = cells.tile_maps().size();
  layer.made = cells.made();
  cells.ForgetChanges();
}

void ClPrefilter::SendChanges(const grid::Occupancy& cells, Layer* layer) {
  tile_places_.clear();
  tile_words_.clear();
  map_places_.clear();
  map_words_.clear();
  for (uint32_t region = 0; region < cells.changed_tiles().size(); region++) {
    const bool is_new = region >= layer->regions;
    uint64_t changed = is_new ? ~uint64_t{0} : cells.changed_tiles()[region];
    if (changed == 0) continue;
    map_places_.push_back(region);
    map_words_.push_back(cells.tile_maps()[region]);
    for (; changed != 0; changed &= changed - 1) {
      const uint32_t place =
          region * grid::kTilesPerRegion + static_cast<uint32_t>(std::countr_zero(changed));
      tile_places_.push_back(place);
      tile_words_.push_back(cells.tiles()[place]);
    }
  }
  Update(&layer->tile_maps, map_places_, map_words_);
  Update(&layer->tiles, tile_places_, tile_words_);
}

void ClPrefilter::Update(Buffer* target, const std::vector<uint32_t>& places,
                         const std::vector<uint64_t>& words) {
  if (places.empty()) return;
  places_.Write(places.data(), places.size() * sizeof(uint32_t));
  words_.Write(words.data(), words.size() * sizeof(uint64_t));
  CountSent(places.size() * (sizeof(uint32_t) + sizeof(uint64_t)));
  update_.setArg(0, target->memory());
  update_.setArg(1, places_.memory());
  update_.setArg(2, words_.memory());
  update_.setArg(3, static_cast<cl_uint>(places.size()));
  queue_.enqueueNDRangeKernel(update_, ::cl::NullRange, RoundedUp(places.size(), work_group_),
                              ::cl::NDRange(work_group_));
}

/// The records of the groups' fans, and the windows.
void ClPrefilter::SendFans(const sensing::RayBatch& batch, sensing::WorkerPool* workers) {
  const std::span<const sensing::DeviceFan> fans = batch.device_fans();
  const std::vector<uint64_t>& windows = batch.window_words();
  const std::size_t fan_bytes = fan_count_ * sizeof(sensing::FanRecord);
  const std::size_t window_bytes = windows.size() * sizeof(uint64_t);
  auto* const records = static_cast<sensing::FanRecord*>(fans_.MapForWriting(fan_bytes));
  auto* const words = static_cast<uint64_t*>(windows_.MapForWriting(window_bytes));
  const std::size_t blocks = CountBlocks(fans.size());
  ForEachBlock(fans.size(), workers, [&](std::size_t block, std::size_t first, std::size_t end) {
    uint32_t* const next = next_in_group_.data() + block * groups_.size();
    for (std::size_t i = first; i < end; i++)
      if (group_of_fan_[i] != kNoGroup) records[next[group_of_fan_[i]]++] = fans[i].record;
    const std::size_t word = windows.size() * block / blocks;  // and a share of the windows
    std::copy(windows.data() + word, windows.data() + windows.size() * (block + 1) / blocks,
              words + word);
  });
  fans_.Unmap();
  windows_.Unmap();
  CountSent(fan_bytes + window_bytes);
}

void ClPrefilter::SendDirections(const sensing::DirectionTables& tables,
                                 const sensing::RayBatch& batch) {
  const std::vector<sensing::Direction>&shared = tables.all(), &own = batch.own_directions();
  if (own.empty() && directions_sent_ == shared.size() && generation_sent_ == tables.generation())
    return;
  const std::size_t bytes = (shared.size() + own.size()) * sizeof(sensing::Direction);
  auto* directions = static_cast<sensing::Direction*>(directions_.MapForWriting(bytes));
  std::copy(own.begin(), own.end(), std::copy(shared.begin(), shared.end(), directions));
  directions_.Unmap();
  directions_sent_ = own.empty() ? shared.size() : 0;
  generation_sent_ = tables.generation();
  CountSent(bytes);
}

void ClPrefilter::Launch(const grid::Grid& grid, const Group& group) {
  const ray_grid_t view = grid.View(group.layer);
  const cl_int4 box = {{view.min_x, view.min_y, view.max_x, view.max_y}};
  const Layer& layer = *layers_[group.layer];
  cl_uint i = 0;
  walk_.setArg(i++, directory_.memory());
  walk_.setArg(i++, static_cast<cl_uint>(view.directory_mask));
  walk_.setArg(i++, regions_.memory());
  walk_.setArg(i++, layer.tile_maps.memory());
  walk_.setArg(i++, layer.tiles.memory());
  walk_.setArg(i++, box);
  walk_.setArg(i++, fans_.memory());
  walk_.setArg(i++, static_cast<cl_uint>(group.first_fan));
  walk_.setArg(i++, static_cast<cl_uint>(group.fans));
  walk_.setArg(i++, static_cast<cl_uint>(group.samples));
  walk_.setArg(i++, directions_.memory());
  walk_.setArg(i++, windows_.memory());
  walk_.setArg(i++, static_cast<cl_uint>(per_ray_));
  walk_.setArg(i++, hits_.memory());
  queue_.enqueueNDRangeKernel(walk_, ::cl::NullRange,
                              RoundedUp(std::size_t{group.fans} * group.samples, work_group_),
                              ::cl::NDRange(work_group_));
}

}  // namespace Stg::cl
