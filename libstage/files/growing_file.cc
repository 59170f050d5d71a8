// SPDX-License-Identifier: GPL-2.0-or-later

#include "files/growing_file.hh"

#include <unistd.h>

#include <cerrno>
#include <utility>

namespace Stg::files {

GrowingFile::~GrowingFile() { Close(); }

int GrowingFile::Open(const std::string& name, IsOurs ours) {
  file_ = OpenToGrow(name, ours);
  size_ = 0;
  return file_ < 0 ? -std::exchange(file_, -1) : 0;
}

int GrowingFile::Append(std::string_view part) {
  for (std::string_view left = part; !left.empty();) {
    const ssize_t count = write(file_, left.data(), left.size());
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) {
      const int error = errno;
      // If the file cannot be truncated, as a pipe cannot, the bytes written so far stay.
      [[maybe_unused]] const int cut = ftruncate(file_, static_cast<off_t>(size_));
      return error;
    }
    left.remove_prefix(static_cast<size_t>(count));
  }
  size_ += part.size();
  return 0;
}

int GrowingFile::Close() {
  const int file = std::exchange(file_, -1);
  return file >= 0 && close(file) != 0 ? errno : 0;
}

}  // namespace Stg::files
