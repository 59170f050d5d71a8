// SPDX-License-Identifier: GPL-2.0-or-later
//
// Thread-safe access to Model::name_map, for worlds loaded in parallel with registrations.

#ifndef STAGE_MODELS_MODEL_TYPE_NAMES_HH
#define STAGE_MODELS_MODEL_TYPE_NAMES_HH

#include <string>
#include <vector>

#include "models/model.hh"

namespace Stg {

/// Returns null if the type is unknown.
creator_t FindCreator(const std::string& type);
std::vector<std::string> ModelTypeNames();
/// Copies all registered types to Model::name_map, and keeps it up to date from now on.
void NameModelTypes();

}  // namespace Stg

#endif
