// SPDX-License-Identifier: GPL-2.0-or-later
//
// Atomic file writes: a file is written completely or not changed. Stage writes all files this way,
// except those that grow while a world runs (files/growing_file.hh).
//
// The content is written to a temporary file in the same folder and then renamed. Its name is
// random and must not exist yet, so nobody can plant a link there. A symbolic link to a file stays
// a link: its target is replaced. A dangling link is replaced itself; nothing is created at its
// target. The file keeps its mode; a read-only file is not replaced. A device, a pipe or an open
// file (/dev/fd/5) is written to directly.
//
// All functions return 0 or an error number as in <cerrno>.

#ifndef STAGE_FILES_WHOLE_FILE_HH
#define STAGE_FILES_WHOLE_FILE_HH

#include <string>
#include <string_view>

namespace Stg::files {

/// Decides whether a file with this beginning (up to 256 bytes) may be replaced. An empty file may
/// always be replaced.
using IsOurs = bool (*)(std::string_view beginning);
bool AnyFile(std::string_view beginning);

/// When a written file survives a crash of the system, and not only of the program.
enum class Durability {
  kSynced,   ///< when the function returns
  kBuffered  ///< when the system has flushed its buffers; until then the file may be empty
};
/// Creates or replaces the file. Returns EEXIST if an existing file is not ours.
int ReplaceFile(const std::string& name, std::string_view content, IsOurs ours,
                Durability durability = Durability::kSynced);
/// Returns what ReplaceFile() would return, without leaving a file. Programs call it first to learn
/// early whether their output can be written.
int TryReplaceFile(const std::string& name, IsOurs ours);
/// Opens an empty file for writing and returns its descriptor, or a negative error number. The file
/// is a new one, or an existing one that is ours and is truncated. It is never created through a
/// dangling link.
int OpenToGrow(const std::string& name, IsOurs ours);
/// Creates the file. Returns EEXIST if the name is taken.
int MakeFile(const std::string& name, std::string_view content);

/// Absolute path with symbolic links resolved, where the file exists.
std::string AbsolutePath(const std::string& name);

}  // namespace Stg::files

#endif
