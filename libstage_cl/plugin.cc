// SPDX-License-Identifier: GPL-2.0-or-later
//
// The exports of the plug-in. Everything that calls drivers is first tried in a child process.

#include <algorithm>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <stdexcept>
#include <string>
#include <utility>

#include "libstage_cl/cl_prefilter.hh"
#include "libstage_cl/driver_watch.hh"
#include "libstage_cl/environment.hh"
#include "libstage_cl/pocl_cache.hh"
#include "libstage_cl/probe.hh"
#include "libstage_cl/row_device.hh"
#include "rows/device_rows.hh"
#include "rows/row_backend.hh"
#include "sensing/backend.hh"

namespace Stg::cl {

namespace {

/// STAGE_CL_HITS: number of potential hits per ray's list; 0 if it is not set.
uint32_t HitsPerRay() { return NumberFromEnvironment("STAGE_CL_HITS", 0, 1, 16); }

/// STAGE_CL_TIMEOUT: time limit of a call in seconds.
uint32_t Timeout() { return NumberFromEnvironment("STAGE_CL_TIMEOUT", 120, 0, 100000); }

/// Returns make(device) for the device of this choice. Returns null and sets *message if there is
/// no such device or it cannot be used.
template <typename MakeOf>
auto MakeFor(const std::string& choice, std::string* message, MakeOf make)
    -> decltype(make(FoundDevice())) {
  std::string reason;
  const std::vector<FoundDevice>& devices = FindDevices(&reason);
  if (devices.empty()) {
    *message = "no OpenCL device: " + reason;
    return nullptr;
  }
  const std::vector<FoundDevice> matching = MatchingDevices(devices, choice);
  if (matching.empty()) {
    *message =
        "no OpenCL device matches \"" + choice + "\"; available devices:\n" + DescribeAll(devices);
    return nullptr;
  }
  const FoundDevice& device = matching.front();
  try {
    return make(device);
  } catch (const std::runtime_error& error) {  // sensing::PrefilterError, rows::RowDeviceError
    *message = error.what();
  } catch (const ::cl::Error& error) {
    *message = std::string(error.what()) + ", error " + std::to_string(error.err());
  }
  *message = Describe(device) + ": " + *message + WhyPoclCantWrite(device.platform);
  return nullptr;
}

// True after drivers were called in this process: a forked child would lack their threads and hang.
bool g_drivers_called = false;
std::mutex g_mutex;  // guards g_drivers_called and the search for devices

/// Tries `task` in a child process before it is done in this one. Returns the error, or an empty
/// string. Costs time only for the first world: errors are cached under `key`, and after a success
/// drivers are called directly.
std::string ProbeOnce(const std::string& key, const std::function<std::string()>& task,
                      uint32_t timeout) {
  static auto* const errors = new std::map<std::string, std::string>;
  if (g_drivers_called) return "";
  const auto known = errors->find(key);
  if (known != errors->end()) return known->second;
  std::string wrong = Probe(task, timeout);
  if (!wrong.empty()) (*errors)[key] = wrong;
  g_drivers_called = wrong.empty();
  return wrong;
}

/// Calls make(watch, message), first in a child process and without a watch, where test(object)
/// returns what is wrong with the result. `key` names all that the results of the calls depend on.
template <typename Make, typename Test>
auto MakeProbed(const std::string& key, std::string* message, Make make, Test test)
    -> decltype(make(nullptr, message)) {
  const uint32_t timeout = Timeout();
  const std::lock_guard lock(g_mutex);
  KeepPoclCachePrivate();
  const auto task = [&] {
    std::string wrong;
    const auto made = make(nullptr, &wrong);
    return made ? test(made.get()) : wrong;
  };
  std::string whole_key = key;
  for (const char* const name : {"STAGE_CL_OPTIONS", "STAGE_CL_MEMORY", "STAGE_CL_CUDA"})
    whole_key += '\n' + FromEnvironment(name);
  *message = ProbeOnce(whole_key, task, timeout);
  if (!message->empty()) return nullptr;
  auto watch = std::make_unique<DriverWatch>(timeout);
  const SetUpWatch set_up;
  return make(std::move(watch), message);
}

std::unique_ptr<sensing::Prefilter> MakePrefilter(const std::string& choice, std::string* message) {
  const uint32_t hits_per_ray = HitsPerRay();
  const auto make = [&](std::unique_ptr<DriverWatch> watch, std::string* wrong) {
    return MakeFor(choice, wrong, [&](const FoundDevice& device) {
      const Kernels kernels = hits_per_ray == 0 ? Kernels::kRanges : Kernels::kWalks;
      return std::make_unique<ClPrefilter>(
          std::make_shared<OpenDevice>(device, std::move(watch), kernels),
          std::max(hits_per_ray, 1u));
    });
  };
  const auto test = [](sensing::Prefilter*) { return std::string(); };
  const std::string kind = hits_per_ray == 0 ? "ranges " : "walks ";
  return MakeProbed(kind + choice, message, make, test);
}

std::unique_ptr<rows::RowDevice> MakeRowDevice(const std::string& choice, uint32_t work_items,
                                               std::string* message) {
  const auto make = [&](std::unique_ptr<DriverWatch> watch, std::string* wrong) {
    return MakeFor(
        choice, wrong, [&](const FoundDevice& device) -> std::unique_ptr<rows::RowDevice> {
          auto made = std::make_unique<ClRowDevice>(device, std::move(watch), work_items);
          auto by_cuda = made->ForCuda();
          return by_cuda ? std::move(by_cuda) : std::move(made);
        });
  };
  const auto test = [](rows::RowDevice* device) { return rows::WhyUnfit(device); };
  return MakeProbed("rows " + choice, message, make, test);
}

/// One line per device, or the reason why there is none.
std::string ListDevices() {
  const uint32_t timeout = Timeout();
  const std::lock_guard lock(g_mutex);
  KeepPoclCachePrivate();
  std::string reason;
  const auto task = [&] {
    FindDevices(&reason);
    return reason;
  };
  reason = ProbeOnce("list", task, timeout);
  if (reason.empty()) {
    const DriverWatch watch(timeout);
    const SetUpWatch set_up;
    const std::vector<FoundDevice>& devices = FindDevices(&reason);
    if (reason.empty()) return DescribeAll(devices);
  }
  return "no OpenCL device: " + reason + "\n";
}

}  // namespace

}  // namespace Stg::cl

STAGE_EXPORT_BACKEND(Stg::cl::MakePrefilter, Stg::cl::ListDevices);
STAGE_EXPORT_ROW_BACKEND(Stg::cl::MakeRowDevice);
