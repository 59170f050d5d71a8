// SPDX-License-Identifier: GPL-2.0-or-later
#ifndef STAGE_TESTS_SUPPORT_SANITIZED_HH
#define STAGE_TESTS_SUPPORT_SANITIZED_HH

// Clang has __has_feature, GCC has the macros.
#ifndef __has_feature
#define __has_feature(feature) 0
#endif
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__) || \
    __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
/// True with AddressSanitizer or ThreadSanitizer, which need more time and memory.
constexpr bool kSanitized = true;
#else
constexpr bool kSanitized = false;
#endif

/// Whether the compiler optimised; otherwise times tell nothing.
#if defined(__OPTIMIZE__)
constexpr bool kOptimized = true;
#else
constexpr bool kOptimized = false;
#endif

#endif
