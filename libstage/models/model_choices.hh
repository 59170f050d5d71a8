// SPDX-License-Identifier: GPL-2.0-or-later
//
// The names of ray models and of contact models, and their properties `ray_model` and `contacts`.

#ifndef STAGE_MODELS_MODEL_CHOICES_HH
#define STAGE_MODELS_MODEL_CHOICES_HH

#include <array>

#include "grid/ray_model.hh"
#include "motion/contact_model.hh"

namespace Stg {

class Worldfile;

// In the order of the values, without kDefault, which comes first.
using ChoiceNames = std::array<const char*, 2>;
constexpr ChoiceNames kRayModels = {"cell", "exact"};
constexpr ChoiceNames kContactModels = {"cells", "outlines"};

/// Reads "cell" or "exact"; returns `fallback` if not given. Fails for other values.
RayModel ReadRayModel(Worldfile* wf, int entity, RayModel fallback);

/// Reads "cells" or "outlines" of the world; returns kDefault if not given. Fails for other values.
ContactModel ReadContactModel(Worldfile* wf);

}  // namespace Stg

#endif
