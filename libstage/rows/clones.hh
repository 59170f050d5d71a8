// SPDX-License-Identifier: GPL-2.0-or-later
//
// Functions that are compiled for several generations of x86-64 processors; the dynamic linker
// chooses one. All have the same results, because products and sums are never fused.

#ifndef STAGE_ROWS_CLONES_HH
#define STAGE_ROWS_CLONES_HH

#if defined(__x86_64__) && defined(__linux__) && defined(__GNUC__) && !defined(__clang__) && \
    !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define STAGE_CLONES __attribute__((target_clones("default", "arch=x86-64-v3", "arch=x86-64-v4")))
#else
#define STAGE_CLONES
#endif

/// For functions that are part of such a function.
#if defined(__GNUC__)
#define STAGE_INLINE inline __attribute__((always_inline))
#else
#define STAGE_INLINE inline
#endif

#endif
