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

/// Looks for a file that can be read: first CompletePath(directory, name), then, with the last
/// component of `name` only, in each directory of the environment variable STAGEPATH (`:` between
/// them), which is left as it is. Returns the path found. If there is none returns "", and sets
/// *reason (if given) to why the first path did not open.
std::string FindFile(const std::string& directory, const std::string& name,
                     std::string* reason = nullptr);

}  // namespace worldfile
}  // namespace Stg

#endif
