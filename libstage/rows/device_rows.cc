// SPDX-License-Identifier: GPL-2.0-or-later

#include "rows/device_rows.hh"

#include <algorithm>
#include <array>
#include <initializer_list>
#include <utility>

#include "messages/assert.hh"
#include "rows/device_columns.hh"
#include "rows/device_controls.hh"
#include "world/plugin.hh"
#include "world/prefilter_loader.hh"

namespace Stg::rows {

namespace {

/// Says why a backend cannot be used; empty if it can.
std::string FaultOf(const RowBackend& backend) {
  if (backend.version == kRowBackendVersion && backend.size == sizeof(RowBackend) &&
      backend.layout == RowBackendLayout())
    return "";
  return "it belongs to another build (version " + std::to_string(backend.version) + " of rows)";
}

void KeepText(void* to, const char* text) { *static_cast<std::string*>(to) = text; }

bool Has(ColumnSet columns, int id) { return columns >> id & 1; }

/// See ReplaceRowDevices().
std::function<std::unique_ptr<RowDevice>()>& Replacement() {
  static std::function<std::unique_ptr<RowDevice>()> make;
  return make;
}

}  // namespace

std::unique_ptr<RowDevice> OpenRowDevice(const std::string& choice, uint32_t work_items,
                                         std::string* message) {
  if (Replacement()) return Replacement()();
  void* const plugin = OpenPlugin(kOpenClPlugin, message, Stamp::kNone);
  const auto* const backend = static_cast<const RowBackend*>(
      plugin ? FindSymbol(plugin, "stage_row_backend", message) : nullptr);
  if (!backend) return nullptr;
  *message = FaultOf(*backend);
  if (!message->empty()) return nullptr;
  std::unique_ptr<RowDevice> device(backend->make(choice.c_str(), work_items, KeepText, message));
  if (!device) return nullptr;
  *message = WhyUnfit(device.get());
  return message->empty() ? std::move(device) : nullptr;
}

void ReplaceRowDevices(std::function<std::unique_ptr<RowDevice>()> make) {
  Replacement() = std::move(make);
}

std::string WhyUnfit(RowDevice* device) {
  const std::string wrong = SelfTest(device);
  return wrong.empty() ? "" : device->Name() + " cannot step rows: " + wrong;
}

DeviceRows::DeviceRows(std::shared_ptr<const Scene> scene, size_t worlds,
                       std::shared_ptr<RowDevice> device, uint32_t work_items, size_t contact_bytes)
    : scene_(std::move(scene)),
      worlds_(worlds),
      work_items_(work_items),
      contact_bytes_(contact_bytes),
      map_version_(scene_->map_version),
      image_(MakeDeviceImage(scene_, worlds, contact_bytes)),
      device_(std::move(device)),
      reset_(std::make_unique<Rows>(scene_, std::array{scene_->SomeSeed()})) {
  const auto add = [this](std::initializer_list<int> ids) {
    for (const int id : ids)
      if (image_.scene().row_bytes[id] > 0) own_ |= ColumnSet{1} << id;
  };
  add({ROW_SEED, ROW_ERROR, ROW_RANDOM, ROW_NOISE});
  if (scene_->populations)
    add({ROW_EXTENT, ROW_POSE, ROW_TURN, ROW_SENSED, ROW_ESTIMATE, ROW_BOX, ROW_BITS});
  depends_on_seed_ = own_ != ColumnSet{1} << ROW_SEED;
  if (!scene_->varied.empty())
    add({ROW_VARIED, ROW_PROPERTIES, ROW_RANGE_NOISE, ROW_ERROR, ROW_NOISY_ODOMETRY});
  if (!WhyNotControls(*scene_).empty()) PlanControls();
  Begin();
}

/// Sends the image.
void DeviceRows::Begin() {
  device_->Begin(image_.words, {.movers = image_.scene().movers,
                                .rays = image_.scene().rays,
                                .work_items = work_items_,
                                .worlds = worlds_,
                                .state_bytes = image_.state_bytes,
                                .scratch_bytes = image_.scratch_bytes});
  // Nobody has the lock, and no island waits.
  constexpr std::array<std::byte, ROW_ALIGNMENT> kZeros{};
  device_->Write(image_.scene().lock, kZeros.data(), kZeros.size());
}

bool DeviceRows::Renew() {
  if (map_version_ == scene_->map_version) return false;
  if (const std::string reason = WhyNotOnDevice(scene_); !reason.empty())
    throw RowDeviceError("the map cannot be sent, because " + reason);
  image_ = MakeDeviceImage(scene_, worlds_, contact_bytes_);
  Begin();
  map_version_ = scene_->map_version;
  return true;
}

void DeviceRows::PlanControls() {
  const auto is_noisy = [](const Mover& mover) { return mover.has_noisy_odometry; };
  const bool shares_random = std::ranges::any_of(scene_->movers, is_noisy);
  of_controls_ = {ROW_TIME,     ROW_LAST_UPDATE, ROW_POSE,    ROW_SENSED,
                  ROW_ESTIMATE, ROW_VELOCITY,    ROW_STALLED, ROW_RANGES};
  of_host_ = ColumnSet{1} << ROW_MEMORY;
  if (shares_random)
    of_controls_.push_back(ROW_RANDOM);
  else
    of_host_ |= ColumnSet{1} << ROW_RANDOM;
  size_t bytes = 0;
  for (const int id : of_controls_) {
    places_of_controls_.push_back(bytes);
    bytes += worlds_ * image_.scene().row_bytes[id];
  }
  read_for_controls_ = device_->MakeHostMemory(bytes);
}

void DeviceRows::ReadForControls() {
  for (size_t i = 0; i < of_controls_.size(); i++) {
    const row_scene_t& scene = image_.scene();
    const size_t bytes = worlds_ * scene.row_bytes[of_controls_[i]];
    if (bytes > 0)
      device_->Read(scene.columns[of_controls_[i]],
                    read_for_controls_.get() + places_of_controls_[i], bytes);
  }
}

void DeviceRows::TakeForControls(size_t world, Rows* to) const {
  ForEachDeviceColumn(&to->columns, [&](int id, auto* column) {
    using T = typename std::decay_t<decltype(*column)>::value_type;
    const auto found = std::ranges::find(of_controls_, id);
    const size_t bytes = image_.scene().row_bytes[id], count = bytes / kSizeOnDevice<T>;
    if (found == of_controls_.end() || count == 0) return;
    const size_t place = places_of_controls_[static_cast<size_t>(found - of_controls_.begin())];
    FromDevice(read_for_controls_.get() + place + world * bytes, count,
               column->data() + world * count);
  });
}

void DeviceRows::WriteControls(const Rows& from) {
  ColumnSet columns = ColumnSet{1} << ROW_COMMAND | ColumnSet{1} << ROW_MODE;
  if (!Has(of_host_, ROW_RANDOM)) columns |= ColumnSet{1} << ROW_RANDOM;
  Write(from, columns);
}

void DeviceRows::Write(const Rows& from, ColumnSet columns) {
  STAGE_ASSERT(&from.scene() == scene_.get() && from.size() == worlds_);
  ForEachDeviceColumn(&from.columns, [&](int id, const auto* column) {
    using T = typename std::decay_t<decltype(*column)>::value_type;
    if (!Has(columns, id) || column->empty()) return;
    buffer_.resize(column->size() * kSizeOnDevice<T>);
    ToDevice(column->data(), column->size(), buffer_.data());
    device_->Write(image_.scene().columns[id], buffer_.data(), buffer_.size());
  });
}

void DeviceRows::Read(Rows* to, ColumnSet columns) {
  STAGE_ASSERT(&to->scene() == scene_.get() && to->size() == worlds_);
  ForEachDeviceColumn(&to->columns, [&](int id, auto* column) {
    using T = typename std::decay_t<decltype(*column)>::value_type;
    if (!Has(columns, id) || column->empty()) return;
    buffer_.resize(column->size() * kSizeOnDevice<T>);
    device_->Read(image_.scene().columns[id], buffer_.data(), buffer_.size());
    FromDevice(buffer_.data(), column->size(), column->data());
  });
}

void DeviceRows::Reset(std::span<const uint32_t> worlds, std::span<const uint64_t> seeds,
                       std::span<const std::span<const double>> given) {
  STAGE_ASSERT(worlds.size() == seeds.size() && (given.empty() || given.size() == seeds.size()));
  if (worlds.empty()) return;
  if (own_ == ColumnSet{1} << ROW_SEED) return device_->Reset(worlds, std::as_bytes(seeds), own_);
  buffer_.clear();
  for (size_t i = 0; i < seeds.size(); i++) {
    reset_->Reset(0, seeds[i], given.empty() ? std::span<const double>() : given[i]);
    ForEachDeviceColumn(&reset_->columns, [&](int id, const auto* column) {
      using T = typename std::decay_t<decltype(*column)>::value_type;
      if (!Has(own_, id)) return;
      const size_t end = buffer_.size();
      buffer_.resize(end + column->size() * kSizeOnDevice<T>);
      ToDevice(column->data(), column->size(), buffer_.data() + end);
    });
  }
  device_->Reset(worlds, buffer_, own_);
}

/// Appends the state of a world, as ROW_START has it.
void DeviceRows::AddStart(const Rows& start) {
  STAGE_ASSERT(&start.scene() == scene_.get() && start.size() == 1);
  const size_t first = start_.size();
  ForEachDeviceColumn(&start.columns, [&](int id, const auto* column) {
    using T = typename std::decay_t<decltype(*column)>::value_type;
    const size_t bytes = image_.scene().row_bytes[id], at = first + image_.scene().starts[id];
    start_.resize(std::max(start_.size(), at + bytes));
    ToDevice(column->data(), bytes / kSizeOnDevice<T>, start_.data() + at);
  });
  start_.resize((start_.size() + ROW_ALIGNMENT - 1) / ROW_ALIGNMENT * ROW_ALIGNMENT);
}

void DeviceRows::Restore(std::span<const uint32_t> worlds, std::span<const Rows* const> starts,
                         std::span<const uint32_t> start_of, const Rows& own, ColumnSet of_own) {
  STAGE_ASSERT(&own.scene() == scene_.get() && own.size() == worlds_);
  STAGE_ASSERT(worlds.size() == start_of.size());
  if (worlds.empty()) return;
  start_.clear();
  for (const Rows* start : starts) AddStart(*start);
  size_t own_bytes = 0;
  for (int id = 0; id < ROW_COLUMNS; id++)
    if (Has(of_own, id)) own_bytes += image_.scene().row_bytes[id];
  buffer_.resize(worlds.size() * own_bytes);
  size_t of_columns = 0;
  ForEachDeviceColumn(&own.columns, [&](int id, const auto* column) {
    using T = typename std::decay_t<decltype(*column)>::value_type;
    if (!Has(of_own, id)) return;
    const size_t bytes = image_.scene().row_bytes[id], count = bytes / kSizeOnDevice<T>;
    for (size_t i = 0; i < worlds.size(); i++)
      ToDevice(column->data() + worlds[i] * count, count,
               buffer_.data() + i * own_bytes + of_columns);
    of_columns += bytes;
  });
  device_->Restore(worlds, {start_, start_.size() / starts.size(), start_of}, buffer_, of_own);
}

void DeviceRows::Watch(std::span<const uint32_t> movers, size_t moments) {
  const size_t bytes = worlds_ * kWatchedNumbers * movers.size() * sizeof(double);
  moments = std::clamp<size_t>(kWatchedBytes / std::max<size_t>(1, bytes), 1, moments);
  if (watched_memory_ && std::ranges::equal(movers, watched_) && moments <= moments_) return;
  watched_.assign(movers.begin(), movers.end());
  moments_ = moments;
  const auto elements = static_cast<uint32_t>(kWatchedNumbers * watched_.size());
  RowPart pose, velocity, stalled;
  pose.array = {ROW_NUMBERS, ROW_POSE, elements, 0};
  velocity.array = {ROW_NUMBERS, ROW_VELOCITY, elements, 0};
  stalled.array = {ROW_LOOKED_UP, ROW_STALLED, elements, 0};
  stalled.values = {0, 1};
  for (uint32_t i = 0; i < watched_.size(); i++) {
    const uint32_t first = static_cast<uint32_t>(kWatchedNumbers) * i, mover = watched_[i];
    for (uint32_t k = 0; k < 3; k++) {
      pose.entries.push_back({first + k, 3 * mover + k});
      velocity.entries.push_back({first + 3 + k, 3 * mover + k});
    }
    stalled.entries.push_back({first + 6, mover});
  }
  watched_memory_ = device_->MakeMemory(moments_ * bytes);
  watched_numbers_ = device_->MakeHostMemory(moments_ * bytes);
  device_->SetParts(watched_memory_.get(), {pose, velocity, stalled});
}

void DeviceRows::NoteWatched(std::span<const uint32_t> worlds, size_t moment) {
  STAGE_ASSERT(moment < moments_);
  if (watched_.empty()) return;
  device_->Gather(watched_memory_.get(), RowChoice(worlds),
                  moment * NumbersOfMoment() * sizeof(double));
}

std::span<const double> DeviceRows::ReadWatched(size_t moments) {
  const size_t count = moments * NumbersOfMoment();
  if (count > 0)
    device_->ReadMemory(watched_memory_.get(), watched_numbers_.get(), count * sizeof(double));
  return {reinterpret_cast<const double*>(watched_numbers_.get()), count};
}

}  // namespace Stg::rows
