// SPDX-License-Identifier: GPL-2.0-or-later
//
// Loads backends: plug-ins that provide a prefilter. The core does not depend on them.

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

/// Name of the OpenCL plug-in.
inline constexpr char kOpenClPlugin[] = "stage_cl";

/// Creates the prefilter of a device. `plugin` is the name or file of a backend, see OpenPlugin();
/// `choice` selects a device, empty for the best; for OpenCL it is the text after --opencl=.
/// Returns null and a message if none is found or the backend is of another version or build.
std::unique_ptr<sensing::Prefilter> LoadPrefilter(const std::string& plugin,
                                                  const std::string& choice, std::string* message);

/// Lists the devices, one per line, or says why there are none.
std::string ListDevices(const std::string& plugin);

}  // namespace Stg

#endif
