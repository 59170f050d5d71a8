// SPDX-License-Identifier: GPL-2.0-or-later
//
// The property `ray_model` of worlds and of range sensors.

#ifndef STAGE_MODELS_RAY_MODEL_READER_HH
#define STAGE_MODELS_RAY_MODEL_READER_HH

#include "grid/ray_model.hh"

namespace Stg {

class Worldfile;

/// "cell", "exact", or `fallback` if the entity doesn't say; fails for anything else.
RayModel ReadRayModel(Worldfile* wf, int entity, RayModel fallback);

}  // namespace Stg

#endif
