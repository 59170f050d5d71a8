// SPDX-License-Identifier: GPL-2.0-or-later
//
// The work of a pool is proportional to its number of worlds: stepping, resetting and restoring a
// world takes no lock that other worlds take as well, such as that of the list of all worlds of the
// process. This program replaces the C library's function, so it sees all locks.

#include <dlfcn.h>
#include <gtest/gtest.h>
#include <pthread.h>

#include <algorithm>
#include <map>
#include <numeric>
#include <sstream>
#include <vector>

#include "stage.hh"
#include "support/model_testing.hh"
#include "support/own_worlds.hh"
#include "support/sanitized.hh"

namespace {

using Counts = std::map<const void*, size_t>;

/// Counts how often the noting thread locks each mutex; null: not now.
Counts* counts = nullptr;
thread_local bool noting = false;

}  // namespace

// Sanitizers replace this function themselves.
#if !defined(__SANITIZE_THREAD__) && !defined(__SANITIZE_ADDRESS__)
extern "C" int pthread_mutex_lock(pthread_mutex_t* mutex) noexcept {
  using Lock = int (*)(pthread_mutex_t*);
  static const Lock next = reinterpret_cast<Lock>(dlsym(RTLD_NEXT, "pthread_mutex_lock"));
  if (noting && counts) {
    noting = false;  // the map allocates
    ++(*counts)[mutex];
    noting = true;
  }
  return next(mutex);
}
#endif

namespace Stg {
namespace {

constexpr size_t kWorlds = 300;

/// How often f() locks the mutex that it locks most often.
template <typename F>
size_t MostLocksOf(F f) {
  Counts found;
  counts = &found;
  noting = true;
  f();
  noting = false;
  counts = nullptr;
  size_t most = 0;
  for (const auto& [mutex, count] : found) most = std::max(most, count);
  return most;
}

TEST(PoolLocks, StepsResetsAndRestoresTakeNoCommonLock) {
  if (kSanitized) GTEST_SKIP() << "sanitizers intercept locks themselves";
  InitLibrary();
  World prototype(OptionsOf(1));
  std::istringstream text("position( alwayson 1 ranger( alwayson 1 sensor( samples 3 ) ) )");
  ASSERT_TRUE(prototype.Load(text, "t.world"));
  std::vector<uint64_t> seeds(kWorlds);
  std::iota(seeds.begin(), seeds.end(), 1u);
  WorldPool pool(prototype, seeds);
  EXPECT_GE(MostLocksOf([&] {
              for (const uint32_t id : pool.All()) World::Exists(pool.At(id));
            }),
            kWorlds)
      << "locks are counted";
  pool.Reset({0}, {1});  // finds the initial state
  Snapshot now;
  ASSERT_TRUE(pool.Take(0, &now));
  EXPECT_LT(MostLocksOf([&] { pool.Step(pool.All(), 3); }), 20u);
  EXPECT_LT(MostLocksOf([&] { pool.Reset(pool.All(), seeds); }), 20u);
  EXPECT_LT(MostLocksOf([&] { pool.Restore(pool.All(), now); }), 20u);
  EXPECT_LT(MostLocksOf([&] { pool.StateHashes(pool.All()); }), 20u);
  for (const uint32_t id : pool.All()) EXPECT_EQ(pool.times_made(id), 1u);
}

}  // namespace
}  // namespace Stg
