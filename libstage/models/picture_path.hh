// SPDX-License-Identifier: GPL-2.0-or-later
#ifndef STAGE_MODELS_PICTURE_PATH_HH
#define STAGE_MODELS_PICTURE_PATH_HH

#include <string>

namespace Stg {

class Worldfile;

/// The path of the picture `name` of an entity: beside the world file, in STAGEPATH, or among those
/// that come with Stage.
std::string PathOfPicture(Worldfile* wf, int entity, const std::string& name);

}  // namespace Stg

#endif
