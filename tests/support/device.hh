// SPDX-License-Identifier: GPL-2.0-or-later
//
// Can OpenCL be tested here?

#ifndef STAGE_TESTS_SUPPORT_DEVICE_HH
#define STAGE_TESTS_SUPPORT_DEVICE_HH

#include <string>

#include "sensing/prefilter.hh"
#include "world/prefilter_loader.hh"

namespace device {

/// Why no device can be used; empty if one can.
inline std::string WhyNone() {
  std::string message;
  return Stg::LoadPrefilter(Stg::kOpenClPlugin, "", &message) ? "" : message;
}

}  // namespace device

#endif
