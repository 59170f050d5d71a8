// SPDX-License-Identifier: GPL-2.0-or-later

#include "world/copy_source.hh"

#include "world/world_handle.hh"

namespace Stg {

CopySource::CopySource(const World& original, bool share_device)
    : image_(original.Image()), options_(original.options()) {
  const bool has_device = options_.opencl;
  options_.threads = 1;
  options_.opencl = false;  // otherwise each copy would open the device again
  options_.listed = false;
  if (!image_ || !share_device || !has_device) return;
  const auto device = std::make_shared<World>(options_);
  device->UseDeviceOf(original);
  device_ = device;
}

std::unique_ptr<World> CopySource::Make(const RunOptions& options) const {
  auto world = std::make_unique<World>(options);
  const WorldHandle handle(world.get());
  if (device_) world->UseDeviceOf(*device_);
  const bool loaded = world->LoadCopy(image_);
  if (!handle) static_cast<void>(world.release());
  return loaded && handle ? std::move(world) : nullptr;
}

}  // namespace Stg
