// SPDX-License-Identifier: GPL-2.0-or-later

#include "worlds/pool_device.hh"

#include <utility>

#include "messages/assert.hh"

namespace Stg {

void PoolDevice::FetchNow() {
  const std::lock_guard lock(fetching_);
  if (!host_is_old_) return;
  device_rows_->Read(on_device_);
  host_is_old_.store(false, std::memory_order_release);
}

const std::string& PoolDevice::WhyNot(const std::shared_ptr<const rows::Scene>& scene) {
  const auto known = why_not_.find(scene.get());
  if (known != why_not_.end()) return known->second;
  return why_not_[scene.get()] = rows::WhyNotOnDevice(scene);
}

rows::DeviceRows* PoolDevice::Send(rows::Rows* rows) {
  if (rows != on_device_) {
    if (on_device_) Fetch(on_device_);
    Abandon();
    device_rows_ = std::make_unique<rows::DeviceRows>(rows->shared_scene(), rows->size(), device_);
    on_device_ = rows;
    device_is_old_ = true;
  }
  if (device_is_old_) {
    STAGE_ASSERT(!host_is_old_);
    device_rows_->Write(*rows);
    device_is_old_ = false;
  }
  return device_rows_.get();
}

void PoolDevice::Forget(const rows::Rows* rows) {
  if (rows != on_device_) return;
  STAGE_ASSERT(!host_is_old_);
  Abandon();
}

void PoolDevice::Abandon() {
  on_device_ = nullptr;
  device_rows_.reset();
  host_is_old_ = device_is_old_ = false;
}

}  // namespace Stg
