// SPDX-License-Identifier: GPL-2.0-or-later
//
// What the plug-in exports.

#include <charconv>

#include "libstage_cl/cl_prefilter.hh"
#include "libstage_cl/environment.hh"

namespace {

/// STAGE_CL_HITS: how many potential hits a ray's list holds.
uint32_t HitsPerRay() {
  constexpr uint32_t kUsual = 1, kMost = 16;
  const std::string text = Stg::cl::FromEnvironment("STAGE_CL_HITS");
  if (text.empty()) return kUsual;
  uint32_t hits = 0;
  const char* const text_end = text.data() + text.size();
  const auto [end, error] = std::from_chars(text.data(), text_end, hits);
  if (error != std::errc() || end != text_end || hits < 1 || hits > kMost)
    throw Stg::internal::sensing::PrefilterError("STAGE_CL_HITS is \"" + text +
                                                 "\", expected 1 to " + std::to_string(kMost));
  return hits;
}

}  // namespace

extern "C" Stg::internal::sensing::Prefilter* stage_make_prefilter(const char* choice,
                                                                   std::string* message) {
  using namespace Stg::cl;
  std::string reason;
  const std::vector<FoundDevice>& devices = FindDevices(&reason);
  if (devices.empty()) {
    *message = "no OpenCL device: " + reason;
    return nullptr;
  }
  const std::vector<FoundDevice> matching = MatchingDevices(devices, choice);
  if (matching.empty()) {
    *message = std::string("no OpenCL device matches \"") + choice + "\"; there are:\n" +
               DescribeAll(devices);
    return nullptr;
  }
  try {
    return new ClPrefilter(matching.front(), HitsPerRay());
  } catch (const Stg::internal::sensing::PrefilterError& error) {
    *message = Describe(matching.front()) + ": " + error.what();
  } catch (const ::cl::Error& error) {
    *message =
        Describe(matching.front()) + ": " + error.what() + ", error " + std::to_string(error.err());
  }
  return nullptr;
}

extern "C" void stage_list_devices(std::string* text) {
  std::string reason;
  const std::vector<Stg::cl::FoundDevice>& devices = Stg::cl::FindDevices(&reason);
  *text = devices.empty() ? "no OpenCL device: " + reason + "\n" : Stg::cl::DescribeAll(devices);
}
