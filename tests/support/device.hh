// SPDX-License-Identifier: GPL-2.0-or-later
//
// Can OpenCL be tested here?

#ifndef STAGE_TESTS_SUPPORT_DEVICE_HH
#define STAGE_TESTS_SUPPORT_DEVICE_HH

#include <string>

#include "sensing/prefilter.hh"
#include "world/prefilter_loader.hh"

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define STAGE_TEST_SANITIZED 1
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define STAGE_TEST_SANITIZED 1
#endif
#endif

namespace device {

/// Why no device can be used; empty if one can.
inline std::string WhyNone() {
  std::string message;
  return Stg::LoadPrefilter("", &message) ? "" : message;
}

}  // namespace device

#endif
