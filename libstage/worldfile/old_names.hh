// SPDX-License-Identifier: GPL-2.0-or-later
//
// Names that world files of older Stages have, and what has taken their place since. All answers
// are "" for names that are not known to be old.
#ifndef STAGE_WORLDFILE_OLD_NAMES_HH
#define STAGE_WORLDFILE_OLD_NAMES_HH

#include <string>
#include <string_view>

namespace Stg::worldfile {

/// Advice to somebody whose section of that type ("" for the world) has the property, such as "use
/// ranger_return". The property may have an index: `spose[3]`.
std::string SuccessorOf(std::string_view property, std::string_view type);

/// Advice to somebody who has a section of that type, which is no model type (any more).
std::string AdviceOnType(std::string_view type);

/// Tells which shipped file has models like those of a file that came with older Stages. `file` may
/// have folders.
std::string SuccessorOfInclude(std::string_view file);

/// Tells what a text that could not be read as a world file seems to be, such as "a Gazebo world
/// (XML)".
std::string KindOfForeignFile(std::string_view text);

}  // namespace Stg::worldfile

#endif
