// SPDX-License-Identifier: GPL-2.0-or-later
//
// Where the library's warnings and errors go, and names made fit for them.

#ifndef STAGE_MESSAGES_LOG_HH
#define STAGE_MESSAGES_LOG_HH

#include <stdio.h>

#include <functional>
#include <string>

namespace Stg {

/// kProgress: what is being done: files that are read while a world is loaded, "[Image
/// "cave.png"]", and the clock of worlds that show theirs, "[Stage: 1m 02s 000msec]".
enum class LogLevel { kWarning, kError, kProgress };

/// Gets one message: one line without a line end, and without control characters. May be called by
/// several threads at once, and must not throw.
typedef std::function<void(LogLevel level, const std::string& line)> LogSink;

/// Sends all messages of the library there. An empty sink, as at the start, is standard error, for
/// warnings and errors alone. The library writes nothing to standard output but what Print()
/// functions are asked for.
void SetLogSink(const LogSink& sink);

/// Hands a line to the sink, made printable, and cut if it is absurdly long: for controllers.
void Tell(LogLevel level, const std::string& line);

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
