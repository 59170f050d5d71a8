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
  /// end.
  bool Fill();
  /// One that was taken in.
  std::optional<std::string> Take();

 private:
  int file_;
  std::string text_;
};

/// False if nobody reads.
bool WriteWhole(int file, std::string_view text);

}  // namespace Stg::program

#endif
