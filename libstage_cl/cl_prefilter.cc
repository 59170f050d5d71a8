// SPDX-License-Identifier: GPL-2.0-or-later

#include "libstage_cl/cl_prefilter.hh"

#include <unistd.h>

#include <algorithm>
#include <span>
#include <string>
#include <type_traits>
#include <utility>

#include "libstage_cl/environment.hh"
#include "messages/assert.hh"
#include "sensing/range_check.hh"
#include "threads/wall_clock.hh"

namespace Stg::cl {

namespace {

using threads::WallClock;

// Rays per work-group. A CPU runs groups one after the other, with some overhead per group; a GPU
// balances small groups better.
constexpr std::size_t kWorkGroupCpu = 256, kWorkGroupGpu = 64;

// Cumulative fractions of fans in the parts of a large batch. While the host traces one part, the
// device walks the next. Each part costs some launches and waiting, so there are few, and only one
// in batches that the device walks quickly.
constexpr double kChunks[] = {0.125, 0.375, 1};
constexpr std::size_t kRaysWorthParts = 500'000;

/// Waits for an event. A null event means that there was nothing to do.
void WaitForEvent(const ::cl::Event& event) {
  if (event() != nullptr) event.wait();
}

/// Asks the device, unless the environment variable STAGE_CL_MEMORY overrides it.
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

ClPrefilter::ClPrefilter(std::shared_ptr<const OpenDevice> device, uint32_t hits_per_ray,
                         std::optional<sensing::RangeModels> tested)
    : device_(std::move(device)),
      is_cpu_(device_->found.kind == "cpu"),
      per_ray_(hits_per_ray),
      queue_(device_->context, device_->found.device),
      memory_(device_->context, queue_, SharesMemory(device_->found.device), &statistics_),
      batch_(&memory_),
      directions_(&memory_),
      unit_vectors_(&memory_),
      hits_(&memory_) {
  calls::SetDriver(device_->found.platform);
  walk_ = ::cl::Kernel(device_->program, "walk_fans");
  const std::size_t max_work_group =
      walk_.getWorkGroupInfo<CL_KERNEL_WORK_GROUP_SIZE>(device_->found.device);
  work_group_ = std::min(is_cpu_ ? kWorkGroupCpu : kWorkGroupGpu, max_work_group);
  if (device_->finds_ranges && per_ray_ == 1 && (!tested || tested->cell)) PrepareRanges();
  const ::cl::Kernel update(device_->program, "update_words");
  const auto forget_grid = [&] {
    grid_ = std::make_unique<DeviceGrid>(&memory_, update, work_group_);
    directions_sent_ = 0;
  };
  forget_grid();
  statistics_.compile_seconds = device_->compile_seconds;
  statistics_.shared_memory = memory_.shared;
  const sensing::PrefilterStatistics before = statistics_;
  WarmUp();
  forget_grid();
  if (ranges_.cell && !tested) {
    if (!sensing::FindsRangesOfHost(this)) ranges_ = {};
    forget_grid();
  }
  statistics_ = before;
}

void ClPrefilter::PrepareRanges() {
  find_cell_ranges_ = ::cl::Kernel(device_->program, "find_cell_ranges");
  find_exact_ranges_ = ::cl::Kernel(device_->program, "find_exact_ranges");
  for (const ::cl::Kernel* const kernel : {&find_cell_ranges_, &find_exact_ranges_})
    work_group_ = std::min<std::size_t>(
        work_group_, kernel->getWorkGroupInfo<CL_KERNEL_WORK_GROUP_SIZE>(device_->found.device));
  ranges_ = {.cell = true, .exact = true};
}

/// Walks a dummy scene while the world loads: the first use of each function of a driver may take a
/// thousand times as long as a step with few robots.
void ClPrefilter::WarmUp() {
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
  for (int32_t x = 0; x < 2; x++) {  // first the whole grid, then changes
    grid::CellSet cell{.cells = uint64_t{1} << x};
    grid.Rasterize(body, {}, std::span(&cell, 1));
    Walk(grid, tables, batch, &workers);
  }
}

std::string ClPrefilter::DeviceName() const {
  const FoundDevice& found = device_->found;
  return found.kind + " " + found.name + " (" + found.platform + ")";
}

std::unique_ptr<sensing::Prefilter> ClPrefilter::CloneForWorld() const {
  try {
    CheckProcess();
    return std::make_unique<ClPrefilter>(device_, per_ray_, ranges_);
  } catch (const sensing::PrefilterError&) {
  } catch (const ::cl::Error&) {
  }
  return nullptr;  // opening the device again reports the error
}

sensing::HitLists ClPrefilter::Walk(grid::Grid& grid, const sensing::DirectionTables& tables,
                                    const sensing::RayBatch& batch,
                                    threads::WorkerPool* workers) try {
  CheckProcess();
  const double start = WallClock();
  calls::SetDriver(device_->found.platform);  // the thread may use other drivers too
  if (in_progress_) Finish();
  hits_.Unmap();
  memory_.from_device.Reset();
  STAGE_ASSERT(batch.FitsDevice());
  sorted_.Sort(batch, workers);
  SendGrid(grid);
  if (sorted_.Has(sensing::DeviceResult::kExactRanges))
    CountSent(grid_->SendOutlines(grid, workers));
  SendBatch(batch, workers);
  SendDirections(tables, batch);
  hits_.Reserve(BytesOf(batch.ray_count()));

  const double sent = WallClock();
  const uint32_t* hits = nullptr;
  progress_.clear();
  progress_.resize(sorted_.chunks().size());
  STAGE_ASSERT(!progress_.empty() && sorted_.chunks().back().end_fan == batch.fans().size());
  in_progress_ = true;
  for (std::size_t chunk = 0; chunk < progress_.size(); chunk++)
    hits = EnqueueChunk(grid, batch, chunk);
  statistics_.send_seconds += sent - start;
  statistics_.bytes_fetched += BytesOf(batch.ray_count());
  WaitForEvent(progress_[0].walked);
  statistics_.walk_seconds += WallClock() - sent;
  WaitFor(batch, 0);
  return {hits, per_ray_};
} catch (const ::cl::Error& error) {
  throw AsPrefilterError(error);
}

std::size_t ClPrefilter::WaitFor(const sensing::RayBatch& batch, std::size_t fan) try {
  if (!in_progress_) return batch.fans().size();
  const double start = WallClock();
  const std::vector<sensing::DeviceBatch::Chunk>& chunks = sorted_.chunks();
  STAGE_ASSERT(fan < batch.fans().size() && progress_.size() == chunks.size());
  std::size_t chunk = 0;
  while (chunk + 1 < chunks.size() && chunks[chunk].end_fan <= fan) chunk++;
  WaitForEvent(progress_[chunk].fetched);
  if (chunk + 1 == chunks.size()) Finish();
  statistics_.fetch_seconds += WallClock() - start;
  return chunks[chunk].end_fan;
} catch (const ::cl::Error& error) {
  throw AsPrefilterError(error);
}

/// Waits for the whole batch and frees pinned memory.
void ClPrefilter::Finish() {
  queue_.finish();
  memory_.to_device.Reset();
  sent_ahead_ = in_progress_ = false;
}

void ClPrefilter::SendAhead(grid::Grid& grid) try {
  CheckProcess();
  if (sent_ahead_) return;  // pinned memory is not free until a batch has been walked
  const double start = WallClock();
  SendGrid(grid);
  queue_.flush();
  sent_ahead_ = true;
  statistics_.send_seconds += WallClock() - start;
} catch (const ::cl::Error& error) {
  throw AsPrefilterError(error);
}

/// A forked process lacks the driver's threads and would wait for them.
void ClPrefilter::CheckProcess() const {
  if (IsForked()) throw sensing::PrefilterError("this process has been forked");
}

/// Sends the parts of the grid that the walks need.
void ClPrefilter::SendGrid(const grid::Grid& grid) {
  CountSent(grid_->Send(grid, sorted_.layers()));
}

void ClPrefilter::SendBatch(const sensing::RayBatch& batch, threads::WorkerPool* workers) {
  // A CPU is faster with one launch per group.
  const bool in_parts = !memory_.shared && batch.ray_count() >= kRaysWorthParts;
  const std::span<const double> shares = in_parts ? std::span(kChunks) : std::span(kChunks).last(1);
  sorted_.PlanLaunches(shares, work_group_, is_cpu_,
                       [this](grid::LayerIndex layer) { return grid_->layers().PlaceOf(layer); });
  sorted_.Write(batch, batch_.MapForWriting(sorted_.bytes()), workers);
  batch_.Unmap();
  CountSent(sorted_.bytes());
}

void ClPrefilter::SendDirections(const sensing::DirectionTables& tables,
                                 const sensing::RayBatch& batch) {
  const std::size_t shared = tables.all().size();
  const bool has_own = !batch.own_directions().empty();
  if (!has_own && directions_sent_ == shared && generation_sent_ == tables.generation()) return;
  const auto send = [&](const auto& of_tables, const auto& own, Buffer* buffer) {
    const std::size_t bytes = (of_tables.size() + own.size()) * sizeof(of_tables[0]);
    auto* const to =
        static_cast<std::remove_cvref_t<decltype(of_tables[0])>*>(buffer->MapForWriting(bytes));
    std::copy(own.begin(), own.end(), std::copy(of_tables.begin(), of_tables.end(), to));
    buffer->Unmap();
    CountSent(bytes);
  };
  send(tables.all(), batch.own_directions(), &directions_);
  if (ranges_.exact) send(tables.unit_vectors(), batch.own_unit_vectors(), &unit_vectors_);
  directions_sent_ = has_own ? 0 : shared;
  generation_sent_ = tables.generation();
}

/// Starts to walk the rays of a part and to fetch their lists. Returns the address where the lists
/// of the batch's first ray will be.
const uint32_t* ClPrefilter::EnqueueChunk(const grid::Grid& grid, const sensing::RayBatch& batch,
                                          std::size_t chunk) {
  for (const sensing::DeviceBatch::Launch& launch : sorted_.launches())
    if (launch.chunk == chunk) Enqueue(grid, launch, &progress_[chunk].walked);
  const std::span<const sensing::Fan> fans = batch.fans();
  const auto bytes_before = [&](std::size_t fan) {
    return BytesOf(fan < fans.size() ? fans[fan].record.first_ray : batch.ray_count());
  };
  const auto& [first_fan, end_fan] = sorted_.chunks()[chunk];
  const void* hits = hits_.StartReading(BytesOf(batch.ray_count()), bytes_before(first_fan),
                                        bytes_before(end_fan), &progress_[chunk].fetched);
  queue_.flush();
  return static_cast<const uint32_t*>(hits);
}

void ClPrefilter::Enqueue(const grid::Grid& grid, const sensing::DeviceBatch::Launch& launch,
                          ::cl::Event* done) {
  const ray_grid_t view = grid.View(grid::kEverything);
  const cl_int4 box = {{view.min_x, view.min_y, view.max_x, view.max_y}};
  STAGE_ASSERT(launch.items > 0 && launch.items % work_group_ == 0);
  STAGE_ASSERT(launch.first_group < launch.end_group);
  using enum sensing::DeviceResult;
  ::cl::Kernel& kernel = launch.result == kHits         ? walk_
                         : launch.result == kCellRanges ? find_cell_ranges_
                                                        : find_exact_ranges_;
  cl_uint i = 0;
  const auto give = [&](const auto& argument) { kernel.setArg(i++, argument); };
  const auto give_number = [&](std::size_t number) { give(static_cast<cl_uint>(number)); };
  give(grid_->directory());
  give_number(view.directory_mask);
  give(grid_->regions());
  give(grid_->words());
  give(box);
  give(batch_.memory());  // group records
  give_number(launch.first_group);
  give_number(launch.end_group);
  give(batch_.memory());  // fan records
  give(directions_.memory());
  give(batch_.memory());  // self-masks
  give_number(sorted_.first_mask());
  if (launch.result == kHits) {
    give_number(per_ray_);
  } else {
    give(batch_.memory());  // records for ranges
    give_number(sorted_.to_range_record());
  }
  give(hits_.memory());
  if (launch.result == kExactRanges) {
    give(unit_vectors_.memory());
    give(grid_->outline_words());
    give_number(grid_->outlines().first_body());
    give_number(grid_->outlines().first_outline());
  }
  queue_.enqueueNDRangeKernel(kernel, ::cl::NullRange, ::cl::NDRange(launch.items),
                              ::cl::NDRange(work_group_), nullptr, done);
}

}  // namespace Stg::cl
