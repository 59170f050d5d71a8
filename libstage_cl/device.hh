// SPDX-License-Identifier: GPL-2.0-or-later
//
// Finds the OpenCL devices and selects one.

#ifndef STAGE_CL_DEVICE_HH
#define STAGE_CL_DEVICE_HH

#include <string>
#include <vector>

#include "libstage_cl/opencl.hh"

namespace Stg::cl {

struct FoundDevice {
  ::cl::Device device;
  std::string kind;  ///< "gpu", "cpu" or "accelerator"
  std::string name, platform, version;
  unsigned compute_units = 0;
  unsigned megabytes = 0;
};

/// All devices of all platforms, best first: GPUs before accelerators before CPUs, larger before
/// smaller ones. Empty, with a reason, if there are none. Searches once per process; drivers may
/// end the process (see probe.hh).
const std::vector<FoundDevice>& FindDevices(std::string* reason);

/// The devices that match a choice: "" or "auto" all; "gpu", "cpu" or "accelerator" those of that
/// kind; otherwise those whose name or platform contains the text, ignoring case. A suffix ":N"
/// selects the N-th match, from 0.
std::vector<FoundDevice> MatchingDevices(const std::vector<FoundDevice>& devices,
                                         const std::string& choice);

/// True if the device has only OpenCL's embedded profile, a subset of the full one.
bool IsEmbedded(const ::cl::Device& device);

/// Returns "gpu: NAME (PLATFORM, VERSION, N compute units, M MiB)".
std::string Describe(const FoundDevice& device);
/// One indented line per device.
std::string DescribeAll(const std::vector<FoundDevice>& devices);

}  // namespace Stg::cl

#endif
