// SPDX-License-Identifier: GPL-2.0-or-later
//
// Loads backends: plug-ins that bring a prefilter. The core knows nothing else of them.

#ifndef STAGE_WORLD_PREFILTER_LOADER_HH
#define STAGE_WORLD_PREFILTER_LOADER_HH

#include <memory>
#include <string>

namespace Stg {

namespace internal {
namespace sensing {
class Prefilter;
}
}  // namespace internal
namespace sensing = internal::sensing;

/// The plug-in of OpenCL.
inline constexpr char kOpenClPlugin[] = "stage_cl";

/// The prefilter of a device. `plugin`: the name of a backend, or its file, see OpenPlugin().
/// `choice`: which of its devices, empty for the best one; OpenCL's is the text after --opencl=.
/// Null and a message if there is none, or if the plug-in was made for another version or build.
std::unique_ptr<sensing::Prefilter> LoadPrefilter(const std::string& plugin,
                                                  const std::string& choice, std::string* message);

/// One line for each device, or why there is none.
std::string ListDevices(const std::string& plugin);

}  // namespace Stg

#endif
