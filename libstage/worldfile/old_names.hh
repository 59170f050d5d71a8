// SPDX-License-Identifier: GPL-2.0-or-later
//
// Names in world files of older Stages, and their successors. All functions return "" for other
// names.
#ifndef STAGE_WORLDFILE_OLD_NAMES_HH
#define STAGE_WORLDFILE_OLD_NAMES_HH

#include <string>
#include <string_view>

namespace Stg::worldfile {

/// Advice for a property in a section of this type ("" for the world), such as "use ranger_return".
/// The property may have an index: `spose[3]`.
std::string SuccessorOf(std::string_view property, std::string_view type);

/// Advice for a section whose type is not, or no longer, a model type.
std::string AdviceOnType(std::string_view type);

/// Names the shipped file with models like those of `file`, which came with older Stages. `file`
/// may include folders.
std::string SuccessorOfInclude(std::string_view file);

/// Guesses the format of a text that is not a valid world file, such as "a Gazebo world (XML)".
std::string KindOfForeignFile(std::string_view text);

}  // namespace Stg::worldfile

#endif
