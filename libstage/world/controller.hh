// SPDX-License-Identifier: GPL-2.0-or-later
//
// Controllers: plug-ins that drive models.

#ifndef STAGE_WORLD_CONTROLLER_HH
#define STAGE_WORLD_CONTROLLER_HH

#include <string>

namespace Stg {

class Model;

/// Loads the plug-in that is the first word of `text` and registers its Init() as a callback of
/// type CB_INIT. Throws LoadError with status 255.
void LoadController(Model* model, const std::string& text);

}  // namespace Stg

#endif
