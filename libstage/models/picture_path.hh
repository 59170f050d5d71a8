// SPDX-License-Identifier: GPL-2.0-or-later
#ifndef STAGE_MODELS_PICTURE_PATH_HH
#define STAGE_MODELS_PICTURE_PATH_HH

#include <string>

namespace Stg {

class Host;
class Worldfile;

namespace picture {
struct Samples;
}

/// Path of the picture `name`, the value of a property of an entity. Searches the folder of the
/// world file, STAGEPATH, and the pictures installed with Stage.
std::string PathOfPicture(Worldfile* wf, int entity, const char* property, const std::string& name);

/// Content of the picture `name` if the world has it in memory (RunOptions::pictures); otherwise
/// null.
const std::string* PictureInMemory(const Host& host, const std::string& name);

/// The key of the picture in Host::outlines_of_pictures: its name in memory, or its path.
std::string KeyOfPicture(const Host& host, Worldfile* wf, int entity, const char* property,
                         const std::string& name);

/// The pixels of a PNG or PGM picture, which models share. Throws LoadError with the property's
/// place.
const picture::Samples& SamplesOfPicture(Host* host, Worldfile* wf, int entity,
                                         const char* property, const std::string& name);

}  // namespace Stg

#endif
