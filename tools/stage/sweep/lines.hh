// SPDX-License-Identifier: GPL-2.0-or-later
//
// Lines through pipes.

#ifndef STAGE_TOOLS_STAGE_SWEEP_LINES_HH
#define STAGE_TOOLS_STAGE_SWEEP_LINES_HH

#include <optional>
#include <string>
#include <string_view>

namespace Stg::program {

class LineReader {
 public:
  explicit LineReader(int file) : file_(file) {}

  /// Waits for it. Nothing at the end of the file.
  std::optional<std::string> Next();
  /// Takes in what is there; waits if there is nothing, unless the file doesn't block. False at its
  /// end, and behind 64 kB that nobody has taken: no line is so long.
  bool Fill();
  /// One that was taken in.
  std::optional<std::string> Take();
  /// Whether Fill() has given up since nobody takes so much.
  bool is_full() const { return text_.size() > kMostWaiting; }

 private:
  static constexpr size_t kMostWaiting = 1 << 16;  // bytes
  int file_;
  std::string text_;
};

/// False if nobody reads, or if a file that doesn't block takes no more.
bool WriteWhole(int file, std::string_view text);

}  // namespace Stg::program

#endif
