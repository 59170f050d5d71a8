// SPDX-License-Identifier: GPL-2.0-or-later

#include "libstage_cl/cl_prefilter.hh"

#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <bit>
#include <chrono>
#include <string>
#include <utility>

#include "libstage_cl/environment.hh"
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

/// As the device says, unless STAGE_CL_MEMORY in the environment says otherwise.
bool SharesMemory(const ::cl::Device& device) {
  const std::string wanted = FromEnvironment("STAGE_CL_MEMORY");
  if (wanted == "own" || wanted == "shared") return wanted == "shared";
  if (!wanted.empty())
    throw sensing::PrefilterError("STAGE_CL_MEMORY is \"" + wanted + "\", expected own or shared");
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
      platform_(device.platform),
      is_cpu_(device.kind == "cpu"),
      per_ray_(hits_per_ray),
      context_(device.device),
      queue_(context_, device.device),
      memory_(context_, queue_, SharesMemory(device.device)),
      batch_(&memory_),
      directions_(&memory_),
      hits_(&memory_) {
  calls::SetDriver(platform_);
  const double start = Now();
  const ::cl::Program program = BuildProgram(context_, device.device);
  walk_ = ::cl::Kernel(program, "walk_fans");
  const std::size_t most = walk_.getWorkGroupInfo<CL_KERNEL_WORK_GROUP_SIZE>(device.device);
  work_group_ = std::min(is_cpu_ ? kWorkGroupCpu : kWorkGroupGpu, most);
  const ::cl::Kernel update(program, "update_words");
  const auto forget_grid = [&] {
    grid_ = std::make_unique<DeviceGrid>(&memory_, update, work_group_);
    directions_sent_ = 0;
  };
  forget_grid();
  statistics_.compile_seconds = Now() - start;
  WarmUp();
  forget_grid();
}

/// Drivers do much when something happens for the first time, a thousand times what a step takes
/// with few robots: it happens now, while the world is loaded, on a scene that nobody needs.
void ClPrefilter::WarmUp() {
  const sensing::PrefilterStatistics before = statistics_;
  grid::Grid grid;
  grid.TrackChanges(true);
  const grid::BodyId body = grid.AddBody({});
  sensing::DirectionTables tables;
  sensing::RayBatch batch;
  sensing::Fan fan;
  fan.layer = grid::kEverything;
  fan.record.first_direction = sensing::DirectionTables::kAhead;
  constexpr double kRange = 10;  // cells
  sensing::PlaceFan(&fan, Pose(), kRange, 1);
  batch.Add(fan, 1, {});
  batch.Close(tables);
  threads::WorkerPool workers(1);
  for (int32_t x = 0; x < 2; x++) {  // all of the grid, then what has changed
    grid::TilePart cell{.cells = uint64_t{1} << x};
    grid.Redraw(body, {}, std::span(&cell, 1));
    Walk(grid, tables, batch, &workers);
  }
  statistics_ = before;
}

sensing::HitLists ClPrefilter::Walk(grid::Grid& grid, const sensing::DirectionTables& tables,
                                    const sensing::RayBatch& batch,
                                    threads::WorkerPool* workers) try {
  CheckProcess();
  const double start = Now();
  calls::SetDriver(platform_);  // the thread may have others
  hits_.Unmap();
  memory_.from_device.Reset();
  MakeGroups(batch, workers);
  SendGrid(grid);
  SendBatch(batch, workers);
  SendDirections(tables, batch);
  const std::size_t hit_bytes = std::size_t{batch.ray_count()} * per_ray_ * sizeof(uint32_t);
  hits_.Reserve(hit_bytes);

  const double sent = Now();
  ::cl::Event done;
  for (const Launch& launch : launches_) Enqueue(grid, launch, &done);
  // The device goes on to hand the lists over without being asked again.
  const auto* hits = static_cast<const uint32_t*>(hits_.StartReading(hit_bytes));
  if (!launches_.empty()) done.wait();
  const double walked = Now();
  queue_.finish();
  memory_.to_device.Reset();
  sent_ahead_ = false;
  statistics_.send_seconds += sent - start;
  statistics_.walk_seconds += walked - sent;
  statistics_.fetch_seconds += Now() - walked;
  statistics_.bytes_fetched += hit_bytes;
  return {hits, per_ray_};
} catch (const ::cl::Error& error) {
  throw AsPrefilterError(error);
}

void ClPrefilter::SendAhead(grid::Grid& grid) try {
  CheckProcess();
  if (sent_ahead_) return;  // pinned memory is free again when a batch has been walked
  const double start = Now();
  SendGrid(grid);
  queue_.flush();
  sent_ahead_ = true;
  statistics_.send_seconds += Now() - start;
} catch (const ::cl::Error& error) {
  throw AsPrefilterError(error);
}

/// A process that was forked has none of the driver's threads, and would wait for them.
void ClPrefilter::CheckProcess() const {
  if (getpid() != process_) throw sensing::PrefilterError("this process has been forked");
}

/// Fans that the device can walk, by layer and number of samples; within these in their own order.
/// There are few kinds of sensors, so few groups, and mostly the same ones from batch to batch.
void ClPrefilter::MakeGroups(const sensing::RayBatch& batch, threads::WorkerPool* workers) {
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
void ClPrefilter::ForEachBlock(std::size_t fans, threads::WorkerPool* workers, F f) {
  workers->Run(CountBlocks(fans), 1, [&](std::size_t begin, std::size_t end, unsigned) {
    for (std::size_t block = begin; block < end; block++)
      f(block, block * kBlock, std::min((block + 1) * kBlock, fans));
  });
}

/// False if there is a fan of none of the groups.
bool ClPrefilter::CountGroups(std::span<const sensing::DeviceFan> fans,
                              threads::WorkerPool* workers) {
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
  wanted_.clear();
  for (const Group& group : groups_)
    if (group.fans > 0 && std::count(wanted_.begin(), wanted_.end(), group.layer) == 0)
      wanted_.push_back(group.layer);
  CountSent(grid_->Send(grid, wanted_));
}

/// One launch for all groups, unless there are more rays than numbers for them. A processor does
/// better with one for each.
void ClPrefilter::PlanLaunches() {
  constexpr std::size_t kMostItems = 0xffffffffu;
  const auto first_fan = static_cast<uint32_t>(2 * groups_.size());  // in int4, see the kernel
  launches_.clear();
  group_records_.clear();
  for (const Group& group : groups_) {
    const std::size_t g = group_records_.size();
    const std::size_t items = std::size_t{group.fans} * group.samples;
    const std::size_t room = (items + work_group_ - 1) / work_group_ * work_group_;
    const bool first = launches_.empty() || launches_.back().items + room > kMostItems;
    if (first || (is_cpu_ && items > 0)) launches_.push_back({g, g, 0});
    Launch& launch = launches_.back();
    const DeviceGrid::Place place = grid_->PlaceOf(group.layer);
    group_records_.push_back({.first_item = static_cast<uint32_t>(launch.items),
                              .fans = group.fans,
                              .samples = group.samples,
                              .first_fan = first_fan + 3 * group.first_fan,
                              .tile_maps = place.tile_maps,
                              .tiles = place.tiles});
    launch.items += room;
    launch.end_group = g + 1;
  }
  std::erase_if(launches_, [](const Launch& launch) { return launch.items == 0; });
}

/// The records of the groups and of their fans, and the windows.
void ClPrefilter::SendBatch(const sensing::RayBatch& batch, threads::WorkerPool* workers) {
  const std::span<const sensing::DeviceFan> fans = batch.device_fans();
  const std::vector<uint64_t>& windows = batch.window_words();
  PlanLaunches();
  const std::size_t bytes = WindowsAt() + windows.size() * sizeof(uint64_t);
  auto* const data = static_cast<char*>(batch_.MapForWriting(bytes));
  auto* const groups = reinterpret_cast<GroupRecord*>(data);
  auto* const records = reinterpret_cast<sensing::FanRecord*>(groups + groups_.size());
  auto* const words = reinterpret_cast<uint64_t*>(data + WindowsAt());
  std::copy(group_records_.begin(), group_records_.end(), groups);
  const std::size_t blocks = CountBlocks(fans.size());
  ForEachBlock(fans.size(), workers, [&](std::size_t block, std::size_t first, std::size_t end) {
    uint32_t* const next = next_in_group_.data() + block * groups_.size();
    for (std::size_t i = first; i < end; i++)
      if (group_of_fan_[i] != kNoGroup) records[next[group_of_fan_[i]]++] = fans[i].record;
    const std::size_t word = windows.size() * block / blocks;  // and a share of the windows
    std::copy(windows.data() + word, windows.data() + windows.size() * (block + 1) / blocks,
              words + word);
  });
  batch_.Unmap();
  CountSent(bytes);
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

void ClPrefilter::Enqueue(const grid::Grid& grid, const Launch& launch, ::cl::Event* done) {
  const ray_grid_t view = grid.View(grid::kEverything);
  const cl_int4 box = {{view.min_x, view.min_y, view.max_x, view.max_y}};
  cl_uint i = 0;
  walk_.setArg(i++, grid_->directory());
  walk_.setArg(i++, static_cast<cl_uint>(view.directory_mask));
  walk_.setArg(i++, grid_->regions());
  walk_.setArg(i++, grid_->words());
  walk_.setArg(i++, box);
  walk_.setArg(i++, batch_.memory());
  walk_.setArg(i++, static_cast<cl_uint>(launch.first_group));
  walk_.setArg(i++, static_cast<cl_uint>(launch.end_group));
  walk_.setArg(i++, directions_.memory());
  walk_.setArg(i++, batch_.memory());
  walk_.setArg(i++, static_cast<cl_uint>(WindowsAt() / sizeof(uint64_t)));
  walk_.setArg(i++, static_cast<cl_uint>(per_ray_));
  walk_.setArg(i++, hits_.memory());
  queue_.enqueueNDRangeKernel(walk_, ::cl::NullRange, ::cl::NDRange(launch.items),
                              ::cl::NDRange(work_group_), nullptr, done);
}

}  // namespace Stg::cl
