// SPDX-License-Identifier: GPL-2.0-or-later

#include "rows/device_rows.hh"

#include <array>
#include <initializer_list>
#include <utility>

#include "messages/assert.hh"
#include "rows/device_columns.hh"
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

}  // namespace

std::unique_ptr<RowDevice> OpenRowDevice(const std::string& choice, uint32_t work_items,
                                         std::string* message) {
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

std::string WhyUnfit(RowDevice* device) {
  const std::string wrong = SelfTest(device);
  return wrong.empty() ? "" : device->Name() + " cannot step rows: " + wrong;
}

DeviceRows::DeviceRows(std::shared_ptr<const Scene> scene, size_t worlds,
                       std::shared_ptr<RowDevice> device, uint32_t work_items)
    : scene_(std::move(scene)),
      worlds_(worlds),
      image_(MakeDeviceImage(scene_, worlds)),
      device_(std::move(device)),
      reset_(std::make_unique<Rows>(scene_, std::array{scene_->SomeSeed()})) {
  const auto add = [this](std::initializer_list<int> ids) {
    for (const int id : ids)
      if (image_.scene().row_bytes[id] > 0) seeded_ |= ColumnSet{1} << id;
  };
  add({ROW_SEED, ROW_ERROR, ROW_RANDOM, ROW_NOISE});
  if (scene_->populations)
    add({ROW_EXTENT, ROW_POSE, ROW_TURN, ROW_SENSED, ROW_ESTIMATE, ROW_BOX, ROW_BITS});
  device_->Begin(image_.words,
                 {.movers = scene_->movers.size(),
                  .work_items = work_items,
                  .worlds = worlds,
                  .state_bytes = image_.state_bytes,
                  .scratch_bytes = worlds * static_cast<size_t>(image_.scene().scratch_bytes)});
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

void DeviceRows::Reset(std::span<const uint32_t> worlds, std::span<const uint64_t> seeds) {
  STAGE_ASSERT(worlds.size() == seeds.size());
  if (worlds.empty()) return;
  if (!DependsOnSeed()) return device_->Reset(worlds, std::as_bytes(seeds), seeded_);
  buffer_.clear();
  for (const uint64_t seed : seeds) {
    reset_->Reset(0, seed);
    ForEachDeviceColumn(&reset_->columns, [&](int id, const auto* column) {
      using T = typename std::decay_t<decltype(*column)>::value_type;
      if (!Has(seeded_, id)) return;
      const size_t end = buffer_.size();
      buffer_.resize(end + column->size() * kSizeOnDevice<T>);
      ToDevice(column->data(), column->size(), buffer_.data() + end);
    });
  }
  device_->Reset(worlds, buffer_, seeded_);
}

}  // namespace Stg::rows
