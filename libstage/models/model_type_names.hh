// SPDX-License-Identifier: GPL-2.0-or-later
//
// Model::name_map, for worlds that load in several threads while others register types.

#ifndef STAGE_MODELS_MODEL_TYPE_NAMES_HH
#define STAGE_MODELS_MODEL_TYPE_NAMES_HH

#include <string>
#include <vector>

#include "models/model.hh"

namespace Stg {

/// Null if there is none.
creator_t FindCreator(const std::string& type);
std::vector<std::string> ModelTypeNames();
/// Puts all types into Model::name_map that have been registered, and from now on each that is.
void NameModelTypes();

}  // namespace Stg

#endif
