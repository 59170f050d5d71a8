// SPDX-License-Identifier: GPL-2.0-or-later

#include "stage/sweep/lines.hh"

#include <unistd.h>

#include <cerrno>

namespace Stg::program {

std::optional<std::string> LineReader::Next() {
  for (;;) {
    if (std::optional<std::string> line = NextBuffered()) return line;
    if (!ReadAvailable()) return std::nullopt;
  }
}

bool LineReader::ReadAvailable() {
  char bytes[4096];
  if (is_full()) return false;
  const ssize_t count = read(file_, bytes, sizeof bytes);
  if (count > 0) text_.append(bytes, static_cast<size_t>(count));
  return count > 0 || (count < 0 && (errno == EINTR || errno == EAGAIN));
}

std::optional<std::string> LineReader::NextBuffered() {
  const size_t end = text_.find('\n');
  if (end == std::string::npos) return std::nullopt;
  std::string line = text_.substr(0, end);
  text_.erase(0, end + 1);
  return line;
}

bool WriteWhole(int file, std::string_view text) {
  while (!text.empty()) {
    const ssize_t count = write(file, text.data(), text.size());
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) return false;
    text.remove_prefix(static_cast<size_t>(count));
  }
  return true;
}

}  // namespace Stg::program
