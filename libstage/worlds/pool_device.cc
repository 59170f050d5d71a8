// SPDX-License-Identifier: GPL-2.0-or-later

#include "worlds/pool_device.hh"

#include <utility>

#include "messages/assert.hh"

namespace Stg {

void PoolDevice::FetchNow(Copy* copy) {
  const std::lock_guard lock(fetching_);
  if (!copy->host_is_old) return;
  copy->on_device->Read(copy->rows, rows::kAllColumns & ~copy->on_device->of_host());
  copy->host_is_old.store(false, std::memory_order_release);
}

const std::string& PoolDevice::WhyNot(const std::shared_ptr<const rows::Scene>& scene) {
  const auto known = why_not_.find(scene.get());
  if (known != why_not_.end()) return known->second;
  return why_not_[scene.get()] = rows::WhyNotOnDevice(scene);
}

rows::DeviceRows* PoolDevice::Send(rows::Rows* rows) {
  Copy* copy = Find(rows);
  if (!copy) {
    auto made = std::make_unique<Copy>();
    made->rows = rows;
    made->on_device =
        std::make_unique<rows::DeviceRows>(rows->shared_scene(), rows->size(), device_->Another());
    copy = copies_.emplace_back(std::move(made)).get();
  }
  if (copy->device_has != kNewestStates) {
    STAGE_ASSERT(!copy->host_is_old);
    copy->on_device->Renew();
    if (copy->device_has == kOldStates) copy->on_device->Write(*rows);
    copy->device_has = kNewestStates;
  }
  return copy->on_device.get();
}

void PoolDevice::ForgetStates() {
  for (const auto& copy : copies_) {
    copy->host_is_old = false;
    if (copy->device_has == kNewestStates) copy->device_has = kForgottenStates;
  }
}

void PoolDevice::Forget(const rows::Rows* rows) {
  std::erase_if(copies_, [&](const auto& copy) { return copy->rows == rows; });
}

}  // namespace Stg
