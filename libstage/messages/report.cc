// SPDX-License-Identifier: GPL-2.0-or-later

#include "messages/report.hh"

#include <cstdarg>
#include <cstdio>
#include <mutex>

namespace Stg {
namespace {

std::mutex mutex;
LogSink& Sink() {
  static LogSink& sink = *new LogSink;  // never deleted: messages may come during program exit
  return sink;
}

thread_local messages::Collector* innermost_collector = nullptr;
thread_local messages::ErrorTrap* innermost_trap = nullptr;

/// Writes the line with one call, so that lines of different threads do not mix.
void PrintOnStandardError(const std::string& line) {
  const std::string text = line + "\n";
  std::fwrite(text.data(), 1, text.size(), stderr);
}

}  // namespace

void SetLogSink(const LogSink& sink) {
  const std::lock_guard<std::mutex> lock(mutex);
  Sink() = sink;
}

void Tell(LogLevel level, const std::string& line) { messages::Report(level, line); }

void internal::PrintMessage(FILE* stream, const char* tag, const char* file, const char* function,
                            const char* format, ...) {
  std::va_list arguments;
  va_start(arguments, format);
  const std::string text = messages::Formatted(format, arguments);
  va_end(arguments);
  const std::string place = file ? std::string(" (") + file + " " + function + ")" : "";
  const std::string line = std::string(tag) + ": " + messages::PrintableLines(text) + place + "\n";
  std::fwrite(line.data(), 1, line.size(), stream);
}

namespace messages {

std::string Formatted(const char* format, std::va_list arguments) {
  std::va_list again;
  va_copy(again, arguments);
  const int length = std::vsnprintf(nullptr, 0, format, arguments);
  std::string text(length > 0 ? static_cast<std::size_t>(length) + 1 : 1, '\0');
  std::vsnprintf(text.data(), text.size(), format, again);
  va_end(again);
  text.pop_back();
  return text;
}

std::string Format(const char* format, ...) {
  std::va_list arguments;
  va_start(arguments, format);
  std::string text = Formatted(format, arguments);
  va_end(arguments);
  return text;
}

void Report(LogLevel level, const std::string& line) {
  constexpr std::size_t kLongest = 1000;  // bytes: room for a long path in a long message
  constexpr std::size_t kMaxCollected = 1000;
  const std::string shown = Shortened(line, kLongest);
  Collector* const collector = level == LogLevel::kProgress ? nullptr : innermost_collector;
  if (collector && collector->lines.size() < kMaxCollected) collector->lines.push_back(shown);
  if (level == LogLevel::kError && innermost_trap) {
    innermost_trap->last = shown;
    return;
  }
  LogSink sink;
  {
    const std::lock_guard<std::mutex> lock(mutex);
    sink = Sink();  // called after the lock is released: the sink may report a message itself
  }
  if (sink)
    sink(level, shown);
  else if (level != LogLevel::kProgress)
    PrintOnStandardError(shown);
}

Collector::Collector() : outer_(innermost_collector) { innermost_collector = this; }
Collector::~Collector() { innermost_collector = outer_; }

ErrorTrap::ErrorTrap() : outer_(innermost_trap) { innermost_trap = this; }
ErrorTrap::~ErrorTrap() { innermost_trap = outer_; }

void Progress(const std::string& text) { Report(LogLevel::kProgress, text); }
void Warn(const std::string& text) { Report(LogLevel::kWarning, "stage: warning: " + text); }

}  // namespace messages
}  // namespace Stg
