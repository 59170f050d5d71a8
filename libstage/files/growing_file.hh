// SPDX-License-Identifier: GPL-2.0-or-later
//
// A file that is valid after each append: if the process is killed, the file holds a prefix of the
// appended data. Functions return 0 or an error number as in <cerrno>.

#ifndef STAGE_FILES_GROWING_FILE_HH
#define STAGE_FILES_GROWING_FILE_HH

#include <cstdint>
#include <string>
#include <string_view>

#include "files/whole_file.hh"

namespace Stg::files {

class GrowingFile {
 public:
  GrowingFile() = default;
  ~GrowingFile();
  GrowingFile(const GrowingFile&) = delete;
  GrowingFile& operator=(const GrowingFile&) = delete;

  /// Creates the file or truncates an existing one. A symbolic link to a file is followed; a
  /// dangling one is replaced by the file. Returns EEXIST if an existing file is not ours.
  int Open(const std::string& name, IsOurs ours);
  /// Appends all of `part`, or removes what was written of it if the system allows.
  int Append(std::string_view part);
  int Close();
  uint64_t size() const { return size_; }

 private:
  int file_ = -1;
  uint64_t size_ = 0;
};

}  // namespace Stg::files

#endif
