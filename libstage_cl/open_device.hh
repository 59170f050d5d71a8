// SPDX-License-Identifier: GPL-2.0-or-later
//
// A device that is open: its context, and the kernels compiled for it. Prefilters of several worlds
// share one. What particular drivers need is in open_device.cc and nowhere else.

#ifndef STAGE_CL_OPEN_DEVICE_HH
#define STAGE_CL_OPEN_DEVICE_HH

#include <memory>

#include "libstage_cl/device.hh"
#include "libstage_cl/driver_watch.hh"
#include "libstage_cl/opencl.hh"

namespace Stg::cl {

struct OpenDevice {
  /// Compiles the kernels; throws cl::Error, or sensing::PrefilterError with the first lines of the
  /// compiler's log. STAGE_CL_OPTIONS in the environment adds options for the compiler. `watch`:
  /// of the driver, for as long as the device is open; may be null.
  OpenDevice(const FoundDevice& device, std::unique_ptr<DriverWatch> watch);

  std::unique_ptr<DriverWatch> watch;  ///< the last to go
  FoundDevice found;
  double compile_seconds;
  ::cl::Context context;
  ::cl::Program program;
};

}  // namespace Stg::cl

#endif
