// SPDX-License-Identifier: GPL-2.0-or-later
//
// The destination of the library's warnings and errors, and a function that makes text printable.

#ifndef STAGE_MESSAGES_LOG_HH
#define STAGE_MESSAGES_LOG_HH

#include <stdio.h>

#include <functional>
#include <string>

namespace Stg {

/// kProgress reports what the library does: files read while a world is loaded (`[Image
/// "cave.png"]`), and the clock of worlds that show it (`[Stage: 1m 02s 000msec]`).
enum class LogLevel { kWarning, kError, kProgress };

/// Receives one message: one line without a line end or control characters. Several threads may
/// call it at once, and it must not throw.
typedef std::function<void(LogLevel level, const std::string& line)> LogSink;

/// Sends all messages of the library to `sink`. An empty sink, the default, prints warnings and
/// errors on standard error. The library writes to standard output only in Print() functions.
void SetLogSink(const LogSink& sink);

/// Hands a line to the sink, made printable and shortened to 1000 bytes. Intended for controllers.
void Tell(LogLevel level, const std::string& line);

/// Returns the text as one line that is safe to print on a terminal. Control characters, bytes that
/// are not UTF-8 and marks that change the writing direction become escapes such as \n, \t and
/// \x1b. Applying it twice changes nothing. If the result exceeds `longest` bytes, its middle is
/// replaced by "...".
std::string Printable(const std::string& text, std::size_t longest = std::string::npos);

namespace internal {

/// Implements the macros of models/messages.hh. Prints "TAG: TEXT (FILE FUNCTION)", without the
/// place if `file` is null. The text is made printable; its line ends are kept.
__attribute__((format(printf, 5, 6))) void PrintMessage(FILE* stream, const char* tag,
                                                        const char* file, const char* function,
                                                        const char* format, ...);

}  // namespace internal

}  // namespace Stg

#endif
