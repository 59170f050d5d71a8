// SPDX-License-Identifier: GPL-2.0-or-later
//
// Controllers that are linked into the program instead of being plug-ins. Part of <stage.hh>;
// C++11.

#ifndef STAGE_WORLD_CONTROLLERS_HH
#define STAGE_WORLD_CONTROLLERS_HH

#include <string>

namespace Stg {

class BatchController;
class Model;
struct CtrlArgs;

/// The type of Init(), which plug-ins export.
typedef int (*ControllerInit)(Model* model, CtrlArgs* arguments);

/// Worlds that are loaded from now on call `init` for models with the property `ctrl "NAME ..."`,
/// instead of loading a plug-in of that name. Can be called from any thread. Returns false with a
/// message if the name is registered already.
bool RegisterController(const std::string& name, ControllerInit init);

/// Registers a batch controller in the same way. It must exist until the program ends.
bool RegisterBatchController(const std::string& name, const BatchController* controller);

}  // namespace Stg

#endif
