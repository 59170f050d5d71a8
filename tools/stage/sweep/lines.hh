// SPDX-License-Identifier: GPL-2.0-or-later
//
// Reads and writes lines through pipes.

#ifndef STAGE_TOOLS_STAGE_SWEEP_LINES_HH
#define STAGE_TOOLS_STAGE_SWEEP_LINES_HH

#include <optional>
#include <string>
#include <string_view>

namespace Stg::program {

class LineReader {
 public:
  explicit LineReader(int file) : file_(file) {}

  /// Waits for the next line. Returns nothing at the end of the file.
  std::optional<std::string> Next();
  /// Reads available bytes; blocks if there are none, unless the file is non-blocking. Returns
  /// false at the end of the file, and while more than 64 kB are unclaimed: no line is that long.
  bool ReadAvailable();
  /// Returns a line that was read already, if there is one.
  std::optional<std::string> NextBuffered();
  /// True if ReadAvailable() stopped because too much is unclaimed.
  bool is_full() const { return text_.size() > kMaxUnclaimed; }

 private:
  static constexpr size_t kMaxUnclaimed = 1 << 16;  // bytes
  int file_;
  std::string text_;
};

/// Returns false if nobody reads, or if a non-blocking file accepts no more.
bool WriteWhole(int file, std::string_view text);

}  // namespace Stg::program

#endif
