// SPDX-License-Identifier: GPL-2.0-or-later
//
// Where the library's warnings and errors go, and names made fit for them.

#ifndef STAGE_MESSAGES_LOG_HH
#define STAGE_MESSAGES_LOG_HH

#include <stdio.h>

#include <functional>
#include <string>

namespace Stg {

enum class LogLevel { kWarning, kError };

/// Gets one message: one line without a line end, and without control characters. May be called by
/// several threads at once, and must not throw.
typedef std::function<void(LogLevel level, const std::string& line)> LogSink;

/// Sends all warnings and errors of the library there; an empty sink is standard error, as at the
/// start.
void SetLogSink(const LogSink& sink);

/// The text as one line that a terminal shows and doesn't obey: control characters, bytes that are
/// not UTF-8 and marks that turn the direction of writing come out as \n, \t, \x1b. What it made
/// stays as it is when it is given again. For names that come from files. Longer ones than that
/// many bytes lose something in the middle.
std::string Printable(const std::string& text, std::size_t longest = std::string::npos);

namespace internal {

/// For the macros of models/messages.hh: "TAG: TEXT (FILE FUNCTION)", or without the place where
/// `file` is null. Made printable but for the tag and for line ends.
__attribute__((format(printf, 5, 6))) void PrintMessage(FILE* stream, const char* tag,
                                                        const char* file, const char* function,
                                                        const char* format, ...);

}  // namespace internal

}  // namespace Stg

#endif
