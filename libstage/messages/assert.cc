// SPDX-License-Identifier: GPL-2.0-or-later

#include "messages/assert.hh"

#include <atomic>
#include <cstdio>
#include <cstdlib>

namespace Stg {

namespace {

/// Writes directly to standard error, since the memory and the locks of the log may be unusable.
void PrintAndAbort(const char* file, int line, const char* condition) {
  std::fprintf(stderr, "%s:%d: assertion failed: %s\n", file, line, condition);
  std::abort();
}

std::atomic<AssertHandler> handler_in_use{nullptr};  // null: PrintAndAbort

}  // namespace

AssertHandler SetAssertHandler(AssertHandler handler) { return handler_in_use.exchange(handler); }

void internal::FailAssertion(const char* file, int line, const char* condition) {
  const AssertHandler handler = handler_in_use;
  (handler ? handler : PrintAndAbort)(file, line, condition);
}

}  // namespace Stg
