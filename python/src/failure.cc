// SPDX-License-Identifier: GPL-2.0-or-later

#include "failure.hh"

#include <atomic>
#include <exception>
#include <mutex>
#include <utility>

#include "messages/log.hh"
#include "messages/report.hh"
#include "text.hh"

namespace Stg::python {

namespace {

thread_local ErrorCollector* current_collector = nullptr;

struct Message {
  LogLevel level;
  std::string line;
};
/// Guards the queue of messages. Threads without the GIL cannot log, so they queue messages here.
std::mutex mutex;
std::vector<Message>& Queue() {
  static std::vector<Message>& waiting = *new std::vector<Message>;  // leaked for late threads
  return waiting;
}
std::atomic<bool> has_messages{false};
constexpr size_t kMaxQueued = 1000;

void OnMessage(LogLevel level, const std::string& line) {
  if (level == LogLevel::kProgress) return;
  if (current_collector && (level == LogLevel::kError || current_collector->warnings))
    return current_collector->lines.push_back(line);
  const std::lock_guard<std::mutex> lock(mutex);
  if (Queue().size() < kMaxQueued) Queue().push_back({level, line});
  has_messages = true;
}

const char* NameOf(Kind kind) {
  switch (kind) {
    case Kind::kWorld:
      return "WorldError";
    case Kind::kGone:
      return "GoneError";
    case Kind::kStage:
      break;
  }
  return "StageError";
}

void Translate(const std::exception_ptr& thrown, void*) {
  try {
    std::rethrow_exception(thrown);
  } catch (const Failure& failure) {
    const nb::object type = nb::module_::import_("stagesim.errors").attr(NameOf(failure.kind));
    PyErr_SetObject(type.ptr(), nb::cast(failure.text).ptr());
  }
}

}  // namespace

ErrorCollector::ErrorCollector(bool with_warnings)
    : warnings(with_warnings), outer_(std::exchange(current_collector, this)) {}
ErrorCollector::~ErrorCollector() { current_collector = outer_; }

void LogMessages() {
  if (!has_messages.load(std::memory_order_relaxed)) return;
  std::vector<Message> messages;
  {
    const std::lock_guard<std::mutex> lock(mutex);
    messages.swap(Queue());
    has_messages = false;
  }
  const nb::object logger = nb::module_::import_("logging").attr("getLogger")("stagesim");
  for (const Message& message : messages)
    logger.attr(message.level == LogLevel::kError ? "error" : "warning")("%s", message.line);
}

void BindFailures(nb::module_&) {
  SetLogSink(OnMessage);
  nb::register_exception_translator(Translate);
}

}  // namespace Stg::python
