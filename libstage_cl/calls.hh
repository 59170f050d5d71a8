// SPDX-License-Identifier: GPL-2.0-or-later
//
// Records which OpenCL call each thread executes, so that a hanging or fatal call can be named.

#ifndef STAGE_CL_CALLS_HH
#define STAGE_CL_CALLS_HH

#include <pthread.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <string>

namespace Stg::cl::calls {

/// State of one thread. Read by other threads, signal handlers and the parent of a forked process.
struct Record {
  std::atomic<bool> taken{false};  ///< a thread uses it
  std::atomic<pthread_t> thread{};
  std::atomic<const char*> call{nullptr};  ///< call in progress; points to a string literal
  std::atomic<uint32_t> call_count{0};     ///< number of calls so far
  std::array<std::atomic<char>, 128> driver{};
};

/// The records of all threads. If all are taken, further threads are not recorded.
std::array<Record, 64>& Records();
/// The record of the calling thread.
Record& RecordOfThisThread();
/// Redirects the calling thread to this record, for a process that has just been forked.
void RedirectThisThread(Record* record);

/// Names the driver that the calling thread calls from now on, such as "NVIDIA CUDA".
void SetDriver(const std::string& name);
/// Copies the name of the driver, zero-terminated.
void CopyDriver(const Record& record, char (*name)[128]);

/// If not null, called after each OpenCL call.
inline std::atomic<void (*)()> g_after_call{nullptr};

/// Marks a call as in progress during its lifetime.
class Mark {
 public:
  explicit Mark(const char* call) : record_(RecordOfThisThread()) {
    record_.call_count.store(record_.call_count.load(std::memory_order_relaxed) + 1,
                             std::memory_order_relaxed);
    record_.call.store(call, std::memory_order_release);
  }
  ~Mark() {
    record_.call.store(nullptr, std::memory_order_release);
    if (const auto after = g_after_call.load(std::memory_order_relaxed)) after();
  }
  Mark(const Mark&) = delete;
  Mark& operator=(const Mark&) = delete;

 private:
  Record& record_;
};

template <std::size_t size>
struct Name {
  // NOLINTNEXTLINE(google-explicit-constructor): converts string literals
  constexpr Name(const char (&literal)[size]) { std::copy_n(literal, size, text); }
  char text[size] = {};
};

/// Marked<"clFinish", &clFinish>::Call is clFinish() with a Mark.
template <Name name, auto function>
struct Marked;
template <Name name, typename Result, typename... Arguments, Result (*function)(Arguments...)>
struct Marked<name, function> {
  static Result Call(Arguments... arguments) {
    const Mark mark(name.text);
    return function(arguments...);
  }
};

}  // namespace Stg::cl::calls

#endif
