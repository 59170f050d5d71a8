// SPDX-License-Identifier: GPL-2.0-or-later
//
// Assertions: conditions that hold unless the code has a mistake. Part of <stage.hh>.
//
// Like <assert.h>, this header has no include guard around the macro: each inclusion follows the
// present value of STAGE_ASSERTIONS. The CMake option of that name sets it for the whole project.

#ifndef STAGE_MESSAGES_ASSERT_HH
#define STAGE_MESSAGES_ASSERT_HH

namespace Stg {

/// Handles an assertion that does not hold. `file` is relative to the project's folder, `condition`
/// is the text of the condition. The strings are valid during the call only.
///
/// A handler may be called by several threads at once, and by a thread that holds locks of the
/// library, so it must not call the library. It may end the process, stop in a debugger, record the
/// failure and return, or throw. After it has returned, the program continues with the mistake,
/// which may crash it. An exception leaves the world unusable except for its destructor, and ends
/// the process if the assertion is in a destructor or another function that must not throw.
typedef void (*AssertHandler)(const char* file, int line, const char* condition);

/// Sets the handler of the process and returns the previous one. Null is the default handler, which
/// prints "FILE:LINE: assertion failed: CONDITION" on standard error and calls abort().
/// Thread-safe.
AssertHandler SetAssertHandler(AssertHandler handler);

namespace internal {

/// Calls the handler.
void FailAssertion(const char* file, int line, const char* condition);

}  // namespace internal
}  // namespace Stg

#endif

/// STAGE_ASSERT(condition) calls the handler if the condition is false. The condition must have no
/// side effects: without STAGE_ASSERTIONS it is compiled but never evaluated, and costs nothing.
#undef STAGE_ASSERT
#if defined(STAGE_ASSERTIONS) && STAGE_ASSERTIONS
#define STAGE_ASSERT(...)               \
  ((__VA_ARGS__) ? static_cast<void>(0) \
                 : ::Stg::internal::FailAssertion(__FILE__, __LINE__, #__VA_ARGS__))
#else
#define STAGE_ASSERT(...) static_cast<void>(sizeof((__VA_ARGS__) ? 1 : 0))
#endif
