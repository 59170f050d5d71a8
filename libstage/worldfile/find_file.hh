// SPDX-License-Identifier: GPL-2.0-or-later
#ifndef STAGE_WORLDFILE_FIND_FILE_HH
#define STAGE_WORLDFILE_FIND_FILE_HH

#include <string>

namespace Stg {
namespace worldfile {

/// `name` as it is if it starts with '/' or '~' (the tilde is not expanded), else
/// `directory`/`name`; `name` for an empty directory.
std::string CompletePath(const std::string& directory, const std::string& name);

/// The absolute directory that a file lies in, links not followed; the current directory for "".
std::string DirectoryOf(const std::string& file);

/// Looks for a file that can be read, in this order: CompletePath(directory, name); the last
/// component of `name` in each directory of the environment variable STAGEPATH (`:` between them),
/// which is left as it is; what comes with Stage, if `name` is relative (see FindShipped). Returns
/// the path found. If there is none returns "", and sets *reason (if given) to why the first path
/// did not open.
std::string FindFile(const std::string& directory, const std::string& name,
                     std::string* reason = nullptr);

/// The path of a file that comes with Stage, or "". `name` is the plain name of a world, an include
/// or a picture, or has the folders before it that these are in: `worlds/`, `bitmaps/`. `../` at
/// its beginning is ignored, as worlds that are laid out in folders like those of older Stages name
/// their neighbours so.
std::string FindShipped(const std::string& name);

/// Ends a message that `name` was not found: ", did you mean ...?" if there is a file
/// of nearly that name, as given or with `ending` (such as ".world") behind it, or among those that
/// come with Stage; else "".
std::string AdviceForMissing(const std::string& directory, const std::string& name,
                             const std::string& ending);

}  // namespace worldfile
}  // namespace Stg

#endif
