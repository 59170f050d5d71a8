// SPDX-License-Identifier: GPL-2.0-or-later
//
// Controllers: plug-ins that drive models.

#ifndef STAGE_WORLD_CONTROLLER_HH
#define STAGE_WORLD_CONTROLLER_HH

#include <string>

namespace Stg {

class Model;
class WorldEngine;

/// Loads the plug-in that is the first word of `text` and registers its Init() as a callback of
/// type CB_INIT. Its arguments stay until the world is loaded the next time, or deleted. Throws
/// LoadError with status 255.
void LoadController(Model* model, const std::string& text);

/// The exception that is being handled: "the number 42".
std::string DescribeException();

/// What a callback of type CB_INIT, which got these arguments, has just thrown; to be called in the
/// handler of the exception.
std::string DescribeInitFailure(const std::string& model_name, const void* arguments,
                                const WorldEngine& engine);

}  // namespace Stg

#endif
