// SPDX-License-Identifier: GPL-2.0-or-later
//
// Which OpenCL devices there are, and which one to take.

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

/// All devices of all platforms, the best first: GPUs before accelerators before CPUs, and large
/// ones before small ones. Empty, with a reason, if there are none. They are looked for once in the
/// life of the process; drivers may end it (see probe.hh).
const std::vector<FoundDevice>& FindDevices(std::string* reason);

/// The devices that a choice means: "" or "auto" all of them; "gpu", "cpu" those of the kind;
/// otherwise those whose name or platform contains the text, in any case. ":N" behind it leaves the
/// N-th of these, from 0.
std::vector<FoundDevice> MatchingDevices(const std::vector<FoundDevice>& devices,
                                         const std::string& choice);

/// It has OpenCL's embedded profile, a part of the full one.
bool IsEmbedded(const ::cl::Device& device);

/// One line: "gpu: NAME (PLATFORM, VERSION, N compute units, M MiB)".
std::string Describe(const FoundDevice& device);
/// A line for each, indented.
std::string DescribeAll(const std::vector<FoundDevice>& devices);

}  // namespace Stg::cl

#endif
