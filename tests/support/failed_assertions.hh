// SPDX-License-Identifier: GPL-2.0-or-later
#ifndef STAGE_TESTS_SUPPORT_FAILED_ASSERTIONS_HH
#define STAGE_TESTS_SUPPORT_FAILED_ASSERTIONS_HH

#include <mutex>
#include <string>

#include "messages/assert.hh"

namespace Stg::test {

/// True if the library was built with assertions.
#if defined(STAGE_ASSERTIONS) && STAGE_ASSERTIONS
inline constexpr bool kAssertions = true;
#else
inline constexpr bool kAssertions = false;
#endif

/// Records failed assertions of all threads during its lifetime, instead of ending the program. At
/// most one object may exist at a time.
class FailedAssertions {
 public:
  FailedAssertions() : before_(SetAssertHandler(Record)) {
    const std::lock_guard<std::mutex> lock(mutex_);
    text_.clear();
  }
  ~FailedAssertions() { SetAssertHandler(before_); }
  FailedAssertions(const FailedAssertions&) = delete;
  FailedAssertions& operator=(const FailedAssertions&) = delete;

  /// One line per failure: "FILE:LINE: CONDITION".
  std::string Text() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return text_;
  }

 private:
  static void Record(const char* file, int line, const char* condition) {
    const std::lock_guard<std::mutex> lock(mutex_);
    text_ += std::string(file) + ":" + std::to_string(line) + ": " + condition + "\n";
  }

  const AssertHandler before_;
  static inline std::mutex mutex_;
  static inline std::string text_;
};

}  // namespace Stg::test

#endif
