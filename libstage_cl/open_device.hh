// SPDX-License-Identifier: GPL-2.0-or-later
//
// An open device: its context and the compiled kernels. Prefilters of several worlds share it. All
// code for particular drivers is in open_device.cc.

#ifndef STAGE_CL_OPEN_DEVICE_HH
#define STAGE_CL_OPEN_DEVICE_HH

#include <memory>

#include "libstage_cl/device.hh"
#include "libstage_cl/driver_watch.hh"
#include "libstage_cl/opencl.hh"

namespace Stg::cl {

/// The programs: walks of rays (prefilter.cl); the same, and ranges (ranges.cl) if the device has
/// doubles; or steps of rows (row_step.cl), which need doubles, and the islands of their contacts
/// (islands.cl).
enum class Kernels { kWalks, kRanges, kRows, kSmallIslands, kLargeIslands };

struct OpenDevice {
  /// Compiles the kernels. Throws cl::Error, or sensing::PrefilterError with the start of the
  /// compiler's log. The environment variable STAGE_CL_OPTIONS adds compiler options. `watch`
  /// watches the driver while the device is open; may be null.
  OpenDevice(const FoundDevice& device, std::unique_ptr<DriverWatch> watch,
             Kernels kernels = Kernels::kWalks);

  /// Compiles another program. Throws as the constructor does.
  ::cl::Program Compile(Kernels kernels) const;

  std::unique_ptr<DriverWatch> watch;  ///< destroyed last
  FoundDevice found;
  double compile_seconds;
  ::cl::Context context;
  ::cl::Program program;
  bool finds_ranges = false;  ///< whether the program has the kernels of ranges.cl
};

}  // namespace Stg::cl

#endif
