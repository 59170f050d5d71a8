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

thread_local Complaints* innermost = nullptr;

struct Message {
  LogLevel level;
  std::string line;
};
/// Guards the queue of messages. Threads without the GIL cannot log, so they queue messages here.
std::mutex mutex;
std::vector<Message>& Waiting() {
  static std::vector<Message>& waiting = *new std::vector<Message>;  // leaked for late threads
  return waiting;
}
std::atomic<bool> any_waiting{false};
constexpr size_t kMost = 1000;

void TakeMessage(LogLevel level, const std::string& line) {
  if (level == LogLevel::kProgress) return;
  if (innermost && (level == LogLevel::kError || innermost->warnings))
    return innermost->lines.push_back(line);
  const std::lock_guard<std::mutex> lock(mutex);
  if (Waiting().size() < kMost) Waiting().push_back({level, line});
  any_waiting = true;
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

Complaints::Complaints(bool with_warnings)
    : warnings(with_warnings), outer_(std::exchange(innermost, this)) {}
Complaints::~Complaints() { innermost = outer_; }

void LogMessages() {
  if (!any_waiting.load(std::memory_order_relaxed)) return;
  std::vector<Message> messages;
  {
    const std::lock_guard<std::mutex> lock(mutex);
    messages.swap(Waiting());
    any_waiting = false;
  }
  const nb::object logger = nb::module_::import_("logging").attr("getLogger")("stagesim");
  for (const Message& message : messages)
    logger.attr(message.level == LogLevel::kError ? "error" : "warning")("%s", message.line);
}

void BindFailures(nb::module_&) {
  SetLogSink(TakeMessage);
  nb::register_exception_translator(Translate);
}

}  // namespace Stg::python
