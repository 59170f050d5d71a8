// SPDX-License-Identifier: GPL-2.0-or-later
//
// A file that grows part by part, and is good after each: what is there when the process is killed
// is a beginning of it. Functions return 0 or the number of an error, as in <cerrno>.

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

  /// Makes the file, or empties the one that is there. A symbolic link to such a file stays one; a
  /// link that leads nowhere gives way to the file. EEXIST: what is there is not ours.
  int Open(const std::string& name, IsOurs ours);
  /// Adds the part whole; or, as far as the system allows, nothing of it.
  int Append(std::string_view part);
  int Close();
  uint64_t size() const { return size_; }

 private:
  int file_ = -1;
  uint64_t size_ = 0;
};

}  // namespace Stg::files

#endif
