// SPDX-License-Identifier: GPL-2.0-or-later
#ifndef STAGE_WORLDFILE_FIND_FILE_HH
#define STAGE_WORLDFILE_FIND_FILE_HH

#include <string>

namespace Stg {
namespace worldfile {

/// Returns `name` if it starts with '/' or '~' (not expanded) or if `directory` is empty, otherwise
/// `directory`/`name`.
std::string CompletePath(const std::string& directory, const std::string& name);

/// Absolute directory of a file, without following links; the current directory for "".
std::string DirectoryOf(const std::string& file);

/// Finds a readable file. Tries CompletePath(directory, name); the last component of `name` in each
/// directory of the environment variable STAGEPATH (separated by `:`); and shipped files if `name`
/// is relative (see FindShipped()). Returns the path, or "" and in *reason (if not null) why the
/// first path could not be opened.
std::string FindFile(const std::string& directory, const std::string& name,
                     std::string* reason = nullptr);

/// Path of a shipped file, or "". `name` is the name of a world, include or picture, possibly
/// prefixed with its folder, `worlds/` or `bitmaps/`. Files of `robots/` need that prefix. A
/// leading
/// `../` is ignored, because worlds written for the folders of older Stages use it.
std::string FindShipped(const std::string& name);

/// Suggestion for the end of a message that `name` was not found: ", did you mean ...?" if there is
/// a file with a similar name, with or without `ending` (such as ".world"), in `directory` or among
/// the shipped files; otherwise "".
std::string AdviceForMissing(const std::string& directory, const std::string& name,
                             const std::string& ending);

}  // namespace worldfile
}  // namespace Stg

#endif
