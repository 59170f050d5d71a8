// SPDX-License-Identifier: GPL-2.0-or-later
//
// Reads the property `ray_model` of worlds and range sensors.

#ifndef STAGE_MODELS_RAY_MODEL_READER_HH
#define STAGE_MODELS_RAY_MODEL_READER_HH

#include "grid/ray_model.hh"

namespace Stg {

class Worldfile;

/// Reads "cell" or "exact"; returns `fallback` if not given. Fails for other values.
RayModel ReadRayModel(Worldfile* wf, int entity, RayModel fallback);

}  // namespace Stg

#endif
