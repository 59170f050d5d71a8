// SPDX-License-Identifier: GPL-2.0-or-later
//
// Files that are written whole or not at all. All that Stage writes goes through here, but for what
// grows while a world runs: see files/growing_file.hh.
//
// A file is written beside its place first, under a name that nobody can guess and that nothing
// has, so that no link can be put in its way; then it is renamed. A symbolic link to a file stays
// one: what it points to is replaced. A link that leads nowhere is replaced itself: nothing is made
// where it points. A file keeps its mode, and one that may not be written is not replaced.
// A device, a pipe, or what is open already (/dev/fd/5) is written to.
//
// All functions return 0 or the number of an error, as in <cerrno>.

#ifndef STAGE_FILES_WHOLE_FILE_HH
#define STAGE_FILES_WHOLE_FILE_HH

#include <string>
#include <string_view>

namespace Stg::files {

/// Whether a file may be replaced that begins so: with these bytes, up to 256 of them. One without
/// content always may.
using IsOurs = bool (*)(std::string_view beginning);
bool AnyFile(std::string_view beginning);

/// When a file that was written is safe from a crash of the system, not of the program alone.
enum class Lasts {
  kAtOnce,  ///< when the function returns
  kSoon     ///< when the system has written out what it holds; until then it may be empty
};
/// Makes the file or replaces it. EEXIST: there is one that is not ours.
int ReplaceFile(const std::string& name, std::string_view content, IsOurs ours,
                Lasts lasts = Lasts::kAtOnce);
/// Returns what ReplaceFile() would, and leaves no trace: a run that ends with an output asks at
/// its beginning.
int TryReplaceFile(const std::string& name, IsOurs ours);
/// A descriptor of an empty file of that name, to be written to, or minus the number of an error.
/// The file is a new one, or the one that was there and is ours; in no case one that is made where
/// a symbolic link points.
int OpenToGrow(const std::string& name, IsOurs ours);
/// Makes the file. EEXIST: there is one, or something else of that name.
int MakeFile(const std::string& name, std::string_view content);

/// Without symbolic links, where the file exists, and whatever the current directory will be.
std::string PlaceOf(const std::string& name);

}  // namespace Stg::files

#endif
