// SPDX-License-Identifier: GPL-2.0-or-later
//
// A buffer for data that may grow too large for memory. Beyond a few megabytes the data goes to an
// unnamed file, which the system deletes when it is closed.

#ifndef STAGE_FILES_SCRATCH_FILE_HH
#define STAGE_FILES_SCRATCH_FILE_HH

#include <functional>
#include <string>
#include <string_view>

namespace Stg::files {

class ScratchFile {
 public:
  /// Creates the unnamed file in `folder`. Without one, all data stays in memory.
  explicit ScratchFile(const std::string& folder);
  ~ScratchFile();
  ScratchFile(const ScratchFile&) = delete;
  ScratchFile& operator=(const ScratchFile&) = delete;

  /// Appends data. If the disk is full, the data stays in memory.
  void Add(std::string_view part);
  /// Calls take(part) for all data in the order in which it was added. Returns 0 or an error
  /// number.
  int ReadBack(const std::function<void(std::string_view)>& take) const;

 private:
  int file_ = -1;
  size_t written_ = 0;
  std::string waiting_;
};

}  // namespace Stg::files

#endif
