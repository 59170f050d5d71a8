// SPDX-License-Identifier: GPL-2.0-or-later
//
// Bytes that are kept for later and may become too many for memory: a file without a name, which is
// gone when it is closed, takes what is more than a few megabytes.

#ifndef STAGE_FILES_SCRATCH_FILE_HH
#define STAGE_FILES_SCRATCH_FILE_HH

#include <functional>
#include <string>
#include <string_view>

namespace Stg::files {

class ScratchFile {
 public:
  /// Of a folder on whose disk there is room.
  explicit ScratchFile(const std::string& folder);
  ~ScratchFile();
  ScratchFile(const ScratchFile&) = delete;
  ScratchFile& operator=(const ScratchFile&) = delete;

  /// What finds no room there stays in memory.
  void Add(std::string_view part);
  /// Calls take(part) for all that was added, in its order, part by part. 0 or the number of an
  /// error.
  int ReadBack(const std::function<void(std::string_view)>& take) const;

 private:
  int file_ = -1;
  size_t written_ = 0;
  std::string waiting_;
};

}  // namespace Stg::files

#endif
