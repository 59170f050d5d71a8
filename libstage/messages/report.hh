// SPDX-License-Identifier: GPL-2.0-or-later
//
// All messages of the library and of the program pass through Report(). The public interface of
// this module is messages/log.hh.

#ifndef STAGE_MESSAGES_REPORT_HH
#define STAGE_MESSAGES_REPORT_HH

#include <cstdarg>
#include <string>
#include <string_view>
#include <vector>

#include "messages/log.hh"

namespace Stg::messages {

/// Returns the text that printf() would print.
[[gnu::format(printf, 1, 2)]] std::string Format(const char* format, ...);
std::string Formatted(const char* format, std::va_list arguments);

/// Hands a line to the sink after making it printable and shortening it to 1000 bytes.
void Report(LogLevel level, const std::string& line);

/// Reports "stage: warning: TEXT".
void Warn(const std::string& text);

/// Reports what the program is doing. The default sink does not print it.
void Progress(const std::string& text);

/// Collects the warnings and errors that this thread reports during the collector's lifetime, at
/// most 1000. The sink still gets them. If collectors are nested, only the innermost collects.
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

/// Keeps the errors that this thread reports during the trap's lifetime from the sink. Traps may be
/// nested; the innermost one gets the errors. Collectors get them, too.
class ErrorTrap {
 public:
  ErrorTrap();
  ~ErrorTrap();
  ErrorTrap(const ErrorTrap&) = delete;
  ErrorTrap& operator=(const ErrorTrap&) = delete;

  /// The last line, which names the cause of a failure; `otherwise` if there is none.
  std::string Last(const std::string& otherwise) const { return last.empty() ? otherwise : last; }

  std::string last;

 private:
  ErrorTrap* outer_;
};

inline constexpr std::size_t kMaxNameBytes = 80;     // bytes of a name that a message shows
inline constexpr std::size_t kMaxDetailBytes = 200;  // bytes of a path or foreign message

/// Makes the text printable and cuts out its middle if it is longer than `longest` bytes.
std::string Shortened(std::string_view text, std::size_t longest = kMaxNameBytes);

/// Returns the shortened text in double quotes, such as `"pose"`.
std::string Quoted(std::string_view text);

/// Makes each line of the text printable and keeps the line ends.
std::string PrintableLines(const std::string& text);

}  // namespace Stg::messages

#endif
