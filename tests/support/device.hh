// SPDX-License-Identifier: GPL-2.0-or-later
//
// Tells whether OpenCL can be tested on this machine.

#ifndef STAGE_TESTS_SUPPORT_DEVICE_HH
#define STAGE_TESTS_SUPPORT_DEVICE_HH

#include <string>

#include "sensing/prefilter.hh"
#include "world/prefilter_loader.hh"

namespace device {

/// The reason why no OpenCL device can be used; empty if there is one.
inline std::string WhyNone() {
  std::string message;
  return Stg::LoadPrefilter(Stg::kOpenClPlugin, "", &message) ? "" : message;
}

}  // namespace device

#endif
