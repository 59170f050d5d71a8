// SPDX-License-Identifier: GPL-2.0-or-later
//
// The device that makes whole steps of a pool's rows: those of each scene have buffers of their
// own there. The newest state of rows is on the device, on the host, or on both; it is copied when
// the other side needs it.

#ifndef STAGE_WORLDS_POOL_DEVICE_HH
#define STAGE_WORLDS_POOL_DEVICE_HH

#include <atomic>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

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
    Copy* const copy = Find(rows);
    if (copy && copy->host_is_old.load(std::memory_order_acquire)) FetchNow(copy);
  }
  /// Call it before rows are changed on the host, after Fetch().
  void NoteChange(const rows::Rows* rows) {
    Copy* const copy = Find(rows);
    if (copy && copy->device_has.load(std::memory_order_relaxed) != kOldStates)
      copy->device_has = kOldStates;
  }

  // No other thread may call anything during a call of these:

  /// Why the device cannot step rows, see rows::WhyNotOnDevice().
  const std::string& WhyNot(const std::shared_ptr<const rows::Scene>& scene);
  /// Copies rows to the device, unless it has their newest state. They can be stepped there.
  rows::DeviceRows* Send(rows::Rows* rows);
  /// Call it when the state of rows on the device has changed.
  void NoteSteps(const rows::Rows* rows) { Find(rows)->host_is_old = true; }
  void Finish() { device_->Finish(); }
  /// True if only the device has the newest state of rows.
  bool IsAhead(const rows::Rows* rows) const {
    const Copy* const copy = Find(rows);
    return copy && copy->host_is_old;
  }
  /// Forgets rows before they are deleted or get another size.
  void Forget(const rows::Rows* rows);
  /// Forgets why scenes can't be stepped, before one of them is deleted.
  void ForgetReasons() { why_not_.clear(); }
  /// Forgets states of rows that the device has: they are not specified, also on the host, until
  /// somebody writes them. Send() sends scenes whose maps have changed.
  void ForgetStates();
  /// Forgets all rows after an error; what only the device had is lost.
  void Abandon() { copies_.clear(); }

 private:
  enum DeviceHas { kNewestStates, kOldStates, kForgottenStates };
  /// Rows that are on the device, too.
  struct Copy {
    rows::Rows* rows;
    std::unique_ptr<rows::DeviceRows> on_device;
    std::atomic<bool> host_is_old{false};
    std::atomic<DeviceHas> device_has{kOldStates};
  };
  Copy* Find(const rows::Rows* rows) const {
    for (const auto& copy : copies_)
      if (copy->rows == rows) return copy.get();
    return nullptr;
  }
  void FetchNow(Copy* copy);

  const std::shared_ptr<rows::RowDevice> device_;
  std::vector<std::unique_ptr<Copy>> copies_;
  std::map<const rows::Scene*, std::string> why_not_;
  std::mutex fetching_;
};

}  // namespace Stg

#endif
