// SPDX-License-Identifier: GPL-2.0-or-later
//
// Counts all allocations of the program. To be included by one file of a test, because it replaces
// the operators new and delete.

#ifndef STAGE_TESTS_SUPPORT_COUNTED_ALLOCATIONS_HH
#define STAGE_TESTS_SUPPORT_COUNTED_ALLOCATIONS_HH

#include <atomic>
#include <cstddef>
#include <cstdlib>
#include <new>

namespace test {
inline std::atomic<long> allocations{0};
}  // namespace test

// Not inlined, because compilers would warn of the pair new and free().
[[gnu::noinline]] void* operator new(std::size_t size) {
  test::allocations++;
  if (void* memory = std::malloc(size > 0 ? size : 1)) return memory;
  throw std::bad_alloc();
}
// The nothrow version is replaced, too, because that of the sanitizers does not call the one above.
[[gnu::noinline]] void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
  test::allocations++;
  return std::malloc(size > 0 ? size : 1);
}
[[gnu::noinline]] void operator delete(void* memory) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }

#endif
