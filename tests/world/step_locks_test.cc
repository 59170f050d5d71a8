// SPDX-License-Identifier: GPL-2.0-or-later
//
// Steps of different worlds have no lock in common, for which a batch of thousands of worlds would
// wait. This program replaces the C library's function, so it sees all locks.

#include <dlfcn.h>
#include <gtest/gtest.h>
#include <pthread.h>

#include <algorithm>
#include <iterator>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "support/model_testing.hh"
#include "support/sanitized.hh"
#include "support/shipped_worlds.hh"

namespace {

using Mutexes = std::multiset<const void*>;

/// The set that collects the mutexes locked by the noting thread; null: none.
Mutexes* locked = nullptr;
thread_local bool noting = false;

}  // namespace

// Sanitizers replace this function themselves.
#if !defined(__SANITIZE_THREAD__) && !defined(__SANITIZE_ADDRESS__)
extern "C" int pthread_mutex_lock(pthread_mutex_t* mutex) noexcept {
  using Lock = int (*)(pthread_mutex_t*);
  static const Lock next = reinterpret_cast<Lock>(dlsym(RTLD_NEXT, "pthread_mutex_lock"));
  if (noting && locked) {
    noting = false;  // the set allocates
    locked->insert(mutex);
    noting = true;
  }
  return next(mutex);
}
#endif

namespace Stg {
namespace {

/// The mutexes that f() locks in this thread.
template <typename F>
Mutexes LockedBy(F f) {
  Mutexes mutexes;
  locked = &mutexes;
  noting = true;
  f();
  noting = false;
  locked = nullptr;
  return mutexes;
}

Mutexes InCommon(const Mutexes& a, const Mutexes& b) {
  Mutexes both;
  std::ranges::set_intersection(a, b, std::inserter(both, both.end()));
  return both;
}

RunOptions OptionsOf(bool listed) {
  RunOptions options;
  options.threads = 1;
  options.listed = listed;
  return options;
}

class StepLocks : public testing::Test {
 protected:
  static void SetUpTestSuite() { InitLibrary(); }
  void SetUp() override {
    if (kSanitized) GTEST_SKIP() << "sanitizers intercept locks themselves";
  }
};

TEST_F(StepLocks, LocksAreSeen) {
  pthread_mutex_t mutex = PTHREAD_MUTEX_INITIALIZER;
  const auto seen = LockedBy([&] {
    pthread_mutex_lock(&mutex);
    pthread_mutex_unlock(&mutex);
  });
  EXPECT_EQ(seen.count(&mutex), 1u);
  World world(OptionsOf(false));
  EXPECT_FALSE(LockedBy([&] { World::Exists(&world); }).empty());
}

TEST_F(StepLocks, StepsOfAllShippedWorldsHaveNoneInCommon) {
  for (const bool listed : {false, true})
    for (const std::string& file : ShippedWorlds()) {
      World first(OptionsOf(listed)), second(OptionsOf(listed));
      ASSERT_TRUE(first.Load(file) && second.Load(file)) << file;
      const auto steps_of = [](World* world) {
        for (int i = 0; i < 3; i++) world->Update();  // controllers create shared tables first
        return LockedBy([&] {
          for (int i = 0; i < 5; i++) world->Update();
        });
      };
      EXPECT_TRUE(InCommon(steps_of(&first), steps_of(&second)).empty()) << file;
    }
}

/// Controllers create and delete models in the middle of a step.
TEST_F(StepLocks, MakingAndDeletingModelsHasNoneInCommon) {
  for (const bool listed : {false, true}) {
    World first(OptionsOf(listed)), second(OptionsOf(listed));
    const auto changes_of = [](World* world) {
      return LockedBy([&] {
        const Model* const made = world->CreateModel(nullptr, "model");
        world->Update();
        delete made;
      });
    };
    changes_of(&first);  // creates global data, such as the table of types
    EXPECT_TRUE(InCommon(changes_of(&first), changes_of(&second)).empty()) << listed;
  }
}

/// A round locks the list of all worlds only once, for any number of worlds.
TEST_F(StepLocks, RoundsLookAtTheListOnce) {
  std::vector<std::unique_ptr<World>> worlds;
  for (int i = 0; i < 20; i++) worlds.push_back(std::make_unique<World>(OptionsOf(true)));
  EXPECT_LE(LockedBy([] { World::UpdateAll(); }).size(), 1u);
}

TEST_F(StepLocks, ExistsKnowsAllWorlds) {
  World* gone = nullptr;
  for (const bool listed : {false, true}) {
    const auto world = std::make_unique<World>(OptionsOf(listed));
    EXPECT_TRUE(World::Exists(world.get()));
    gone = world.get();
  }
  EXPECT_FALSE(World::Exists(gone));
  EXPECT_FALSE(World::Exists(nullptr));
}

}  // namespace
}  // namespace Stg
