// SPDX-License-Identifier: GPL-2.0-or-later
//
// What goes wrong becomes an exception of Python's; what libstage says becomes records of the
// logger "stagesim".

#ifndef STAGE_PYTHON_FAILURE_HH
#define STAGE_PYTHON_FAILURE_HH

#include <nanobind/nanobind.h>

#include <string>
#include <type_traits>
#include <vector>

namespace Stg::python {

namespace nb = nanobind;

/// Which exception of stagesim.errors it becomes.
enum class Kind { kStage, kWorld, kGone };

/// To be thrown, with the GIL or without it.
struct Failure {
  Kind kind;
  std::string text;
};

/// Sends the library's messages here, and makes a Failure an exception.
void BindFailures(nb::module_& module);

/// While it lives, errors that this thread reports are kept here instead of logged: they go into an
/// exception. The innermost one gets them.
class Complaints {
 public:
  /// `warnings`: these too.
  explicit Complaints(bool warnings = false);
  ~Complaints();
  Complaints(const Complaints&) = delete;
  Complaints& operator=(const Complaints&) = delete;

  /// The last one says what it was that failed.
  std::string Last(const std::string& otherwise) const {
    return lines.empty() ? otherwise : lines.back();
  }
  std::vector<std::string> lines;
  const bool warnings;

 private:
  Complaints* outer_;
};

/// Logs what was said since. With the GIL.
void LogMessages();

/// Calls f, and logs what was said meanwhile, whatever f throws.
template <typename F>
auto Logged(F f) {
  try {
    if constexpr (std::is_void_v<decltype(f())>) {
      f();
      LogMessages();
    } else {
      auto result = f();
      LogMessages();
      return result;
    }
  } catch (...) {
    try {
      LogMessages();
    } catch (...) {  // what f has thrown matters more
    }
    throw;
  }
}

/// Who has thrown what, in a handler of it.
std::string DescribeThrown();

}  // namespace Stg::python

#endif
