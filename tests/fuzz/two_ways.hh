// SPDX-License-Identifier: GPL-2.0-or-later
#ifndef STAGE_TESTS_FUZZ_TWO_WAYS_HH
#define STAGE_TESTS_FUZZ_TWO_WAYS_HH

#include <cstdio>
#include <cstdlib>

#include "stage.hh"

/// What fuzzers run is run in two ways, which have to come out the same.
namespace two_ways {

/// Of worlds that are made from now on: one thread and each ray on its own, or two threads, batches
/// and everything shared that can be.
inline void Choose(bool plain) {
  static const bool ready = [] {
    Stg::Init(nullptr, nullptr);
    return true;
  }();
  (void)ready;
  Stg::RunOptions& options = Stg::World::run_options;
  options.threads = plain ? 1 : 2;
  options.batch = !plain;
  options.share_from = plain ? 16 : 2;
}

/// Ends the program if a condition does not hold.
inline void Check(bool holds, const char* what) {
  if (holds) return;
  std::fprintf(stderr, "found otherwise: %s\n", what);
  std::abort();
}

}  // namespace two_ways

#endif
