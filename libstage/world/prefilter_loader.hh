// SPDX-License-Identifier: GPL-2.0-or-later
//
// Loads the OpenCL plug-in. The core knows nothing else of OpenCL.

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

/// The prefilter of a device; `choice` is the text after --opencl=, empty or "auto" for the best
/// one. Null and a message if there is none.
std::unique_ptr<sensing::Prefilter> LoadPrefilter(const std::string& choice, std::string* message);

/// One line for each device, or why there is none.
std::string ListDevices();

}  // namespace Stg

#endif
