// SPDX-License-Identifier: GPL-2.0-or-later
//
// Failures become Python exceptions; libstage's messages become records of the logger "stagesim".

#ifndef STAGE_PYTHON_FAILURE_HH
#define STAGE_PYTHON_FAILURE_HH

#include <nanobind/nanobind.h>

#include <string>
#include <type_traits>
#include <vector>

namespace Stg::python {

namespace nb = nanobind;

/// Selects the exception class in stagesim.errors: StageError, WorldError or GoneError.
enum class Kind { kStage, kWorld, kGone };

/// The exception that bindings throw. The thrower need not hold the GIL.
struct Failure {
  Kind kind;
  std::string text;
};

/// Installs the log sink and the translation of Failure into Python exceptions.
void BindFailures(nb::module_& module);

/// Collects the errors that this thread logs while the object lives, for use in an exception. If
/// several are nested, the innermost one gets them.
class ErrorCollector {
 public:
  /// `warnings`: collect warnings, too.
  explicit ErrorCollector(bool warnings = false);
  ~ErrorCollector();
  ErrorCollector(const ErrorCollector&) = delete;
  ErrorCollector& operator=(const ErrorCollector&) = delete;

  /// The last line, which names the cause of the failure; `otherwise` if there is none.
  std::string Last(const std::string& otherwise) const {
    return lines.empty() ? otherwise : lines.back();
  }
  std::vector<std::string> lines;
  const bool warnings;

 private:
  ErrorCollector* outer_;
};

/// Passes the messages since the last call to Python's logger. The caller holds the GIL.
void LogMessages();

/// Calls f, then logs the messages of that time, even if f throws.
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
    } catch (...) {  // the exception of f matters more
    }
    throw;
  }
}

}  // namespace Stg::python

#endif
