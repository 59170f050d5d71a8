// SPDX-License-Identifier: GPL-2.0-or-later
//
// What each thread is doing in a driver: every call of OpenCL leaves a mark while it runs. Whoever
// finds that a call doesn't come back, or that it ends the process, can say which one it was.

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

/// Of one thread, read by others: also by signal handlers, and by the parent of a process that has
/// been forked.
struct Record {
  std::atomic<bool> taken{false};  ///< by a thread
  std::atomic<pthread_t> thread{};
  std::atomic<const char*> call{nullptr};  ///< under way; a literal, so that it lasts
  std::atomic<uint32_t> begun{0};          ///< calls so far
  std::array<std::atomic<char>, 128> driver{};
};

/// All threads'. A thread that finds all of them taken goes without marks.
std::array<Record, 64>& Records();
/// That of the calling thread.
Record& OfThisThread();
/// From now on the marks of the calling thread go there. For a process that has just been forked.
void MoveThisThread(Record* record);

/// Whose calls the calling thread makes from now on, such as "NVIDIA CUDA".
void SetDriver(const std::string& name);
/// Copies it from there, with a zero behind it.
void CopyDriver(const Record& record, char (*name)[128]);

/// If not null, called after each call.
inline std::atomic<void (*)()> g_after_call{nullptr};

/// Marks a call as long as it lives.
class Mark {
 public:
  explicit Mark(const char* call) : record_(OfThisThread()) {
    record_.begun.store(record_.begun.load(std::memory_order_relaxed) + 1,
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
  // NOLINTNEXTLINE(google-explicit-constructor): a literal is to become one
  constexpr Name(const char (&literal)[size]) { std::copy_n(literal, size, text); }
  char text[size] = {};
};

/// Marked<"clFinish", &clFinish>::Call is clFinish with a mark.
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
