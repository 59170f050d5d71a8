// SPDX-License-Identifier: GPL-2.0-or-later

#ifndef STAGE_TESTS_SUPPORT_EMULATED_HH
#define STAGE_TESTS_SUPPORT_EMULATED_HH

#include <cstdlib>

namespace Stg::test {

/// True if an emulator runs this test, as ctest says. The emulator's memory and threads then count
/// as the test's, and it ignores limits of memory.
inline bool IsEmulated() { return std::getenv("STAGE_EMULATED") != nullptr; }

}  // namespace Stg::test

#endif
