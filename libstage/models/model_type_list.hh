// SPDX-License-Identifier: GPL-2.0-or-later

#ifndef STAGE_MODELS_MODEL_TYPE_LIST_HH
#define STAGE_MODELS_MODEL_TYPE_LIST_HH

#include <vector>

#include "models/model_type.hh"

namespace Stg {

/// All types of this library, bases before derived types. models/types/built_in_types.cc lists
/// them.
std::vector<ModelType> BuiltInModelTypes();

}  // namespace Stg

#endif
