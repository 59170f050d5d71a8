// SPDX-License-Identifier: GPL-2.0-or-later
//
// All messages of the library and of the program go through Report(). What clients see of this room
// is in messages/log.hh.

#ifndef STAGE_MESSAGES_REPORT_HH
#define STAGE_MESSAGES_REPORT_HH

#include <cstdarg>
#include <string>
#include <string_view>
#include <vector>

#include "messages/log.hh"

namespace Stg::messages {

/// As vprintf() would print it.
std::string Formatted(const char* format, std::va_list arguments);

/// Hands a line to the sink, made printable, and cut if it is absurdly long.
void Report(LogLevel level, const std::string& line);

/// Reports "stage: warning: TEXT".
void Warn(const std::string& text);

/// Reports what is being done.
void Progress(const std::string& text);

/// While it lives, keeps the warnings and errors that this thread reports, beside the sink; those
/// of the innermost one alone, and a thousand at most.
class Collector {
 public:
  Collector();
  ~Collector();
  Collector(const Collector&) = delete;
  Collector& operator=(const Collector&) = delete;

  std::vector<std::string> lines;

 private:
  Collector* outer_;
};

inline constexpr std::size_t kLongestName = 80;     // bytes of it that a message shows
inline constexpr std::size_t kLongestDetail = 200;  // of a path, of somebody else's message

/// Printable, and with something left out in the middle if it is longer than that many bytes.
std::string Shortened(std::string_view text, std::size_t longest = kLongestName);

/// `"pose"` and the like: shortened, in quotes.
std::string Quoted(std::string_view text);

/// Printable line by line: line ends stay.
std::string PrintableLines(const std::string& text);

}  // namespace Stg::messages

#endif
