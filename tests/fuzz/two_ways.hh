// SPDX-License-Identifier: GPL-2.0-or-later
#ifndef STAGE_TESTS_FUZZ_TWO_WAYS_HH
#define STAGE_TESTS_FUZZ_TWO_WAYS_HH

#include <cstdio>
#include <cstdlib>
#include <string>

#include "stage.hh"

/// Fuzzers run each world in two ways, which must give the same results.
namespace two_ways {

/// Sets how later worlds run: with `plain` one thread and separate rays, otherwise two threads, ray
/// batches and as much sharing as possible; and what stops their bodies, unless it is the default.
inline void Choose(bool plain, Stg::ContactModel contacts = Stg::ContactModel::kDefault) {
  static const bool ready = [] {
    setenv("STAGE_VALIDATE", "1", 1);  // after each phase, in builds with assertions
    Stg::Init(nullptr, nullptr);
    return true;
  }();
  (void)ready;
  Stg::RunOptions& options = Stg::World::run_options;
  options.threads = plain ? 1 : 2;
  options.batch = !plain;
  options.share_from = plain ? 16 : 2;
  options.contacts = contacts;
}

/// Prints `what` and aborts if `holds` is false.
inline void Check(bool holds, const char* what) {
  if (holds) return;
  std::fprintf(stderr, "found otherwise: %s\n", what);
  std::abort();
}

/// Ends the program if the parts of the world do not agree.
inline void CheckValid(const Stg::World& world) {
  const std::string fault = world.Validate();
  Check(fault.empty(), fault.c_str());
}

}  // namespace two_ways

#endif
