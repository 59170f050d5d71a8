// SPDX-License-Identifier: GPL-2.0-or-later

#include "files/scratch_file.hh"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <vector>

namespace Stg::files {

namespace {
constexpr size_t kMaxBuffered = 4 << 20;
}  // namespace

ScratchFile::ScratchFile(const std::string& folder)
    : file_(open(folder.c_str(), O_TMPFILE | O_RDWR | O_CLOEXEC, 0600)) {}

ScratchFile::~ScratchFile() {
  if (file_ >= 0) close(file_);
}

void ScratchFile::Add(std::string_view part) {
  waiting_ += part;
  if (file_ < 0 || waiting_.size() < kMaxBuffered) return;
  size_t done = 0;
  while (done < waiting_.size()) {
    const ssize_t count = pwrite(file_, waiting_.data() + done, waiting_.size() - done,
                                 static_cast<off_t>(written_ + done));
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) return;
    done += static_cast<size_t>(count);
  }
  written_ += done;
  waiting_.clear();
}

int ScratchFile::ReadBack(const std::function<void(std::string_view)>& take) const {
  std::vector<char> part(std::min(written_, kMaxBuffered));
  for (size_t at = 0; at < written_;) {
    const ssize_t count =
        pread(file_, part.data(), std::min(part.size(), written_ - at), static_cast<off_t>(at));
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) return count < 0 ? errno : EIO;
    take({part.data(), static_cast<size_t>(count)});
    at += static_cast<size_t>(count);
  }
  take(waiting_);
  return 0;
}

}  // namespace Stg::files
