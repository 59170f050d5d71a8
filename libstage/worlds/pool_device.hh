// SPDX-License-Identifier: GPL-2.0-or-later
//
// The device that makes whole steps of a pool's rows. At any time it has the rows of one scene. The
// newest state is there, on the host, or on both; it is copied when the other side needs it.

#ifndef STAGE_WORLDS_POOL_DEVICE_HH
#define STAGE_WORLDS_POOL_DEVICE_HH

#include <atomic>
#include <map>
#include <memory>
#include <mutex>
#include <string>

#include "rows/device_rows.hh"
#include "rows/rows.hh"

namespace Stg {

class PoolDevice {
 public:
  explicit PoolDevice(std::shared_ptr<rows::RowDevice> device) : device_(std::move(device)) {}

  std::string Name() const { return device_->Name(); }

  // All of the following functions throw rows::RowDeviceError. Several threads may call these two:

  /// Copies the state of rows to the host if that on the device is newer.
  void Fetch(rows::Rows* rows) {
    if (rows == on_device_ && host_is_old_.load(std::memory_order_acquire)) FetchNow();
  }
  /// Call it before rows are changed on the host, after Fetch().
  void NoteChange(const rows::Rows* rows) {
    if (rows == on_device_ && !device_is_old_.load(std::memory_order_relaxed))
      device_is_old_ = true;
  }

  // No other thread may call anything during a call of these:

  /// Why the device cannot step rows, see rows::WhyNotOnDevice().
  const std::string& WhyNot(const std::shared_ptr<const rows::Scene>& scene);
  /// Copies rows to the device, unless it has their newest state. They can be stepped there.
  rows::DeviceRows* Send(rows::Rows* rows);
  /// Call it when the state on the device has changed.
  void NoteSteps() { host_is_old_ = true; }
  void Finish() { device_->Finish(); }
  /// Forgets rows, whose state is on the host, before they are deleted or get another size.
  void Forget(const rows::Rows* rows);
  /// Forgets all rows after an error; what only the device had is lost.
  void Abandon();

 private:
  void FetchNow();

  const std::shared_ptr<rows::RowDevice> device_;
  rows::Rows* on_device_ = nullptr;  // null: none
  std::unique_ptr<rows::DeviceRows> device_rows_;
  std::atomic<bool> host_is_old_{false}, device_is_old_{false};
  std::map<const rows::Scene*, std::string> why_not_;
  std::mutex fetching_;
};

}  // namespace Stg

#endif
