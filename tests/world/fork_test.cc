// SPDX-License-Identifier: GPL-2.0-or-later
//
// Programs that fork: the child process has none of the parent's threads.

#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <thread>

#include "models/host.hh"
#include "support/emulated.hh"
#include "support/model_testing.hh"
#include "threads/worker_pool.hh"

namespace Stg {
namespace {

/// ThreadSanitizer confuses the threads of a child with those of its parent.
#if defined(__SANITIZE_THREAD__)
#define SKIP_WITH_THREAD_SANITIZER() GTEST_SKIP() << "ThreadSanitizer needs the parent process"
#else
#define SKIP_WITH_THREAD_SANITIZER()
#endif

/// Runs is_so() in a child process. Returns true if it returns true in time.
template <typename F>
bool InChild(F is_so) {
  const pid_t child = fork();
  if (child == 0) _exit(is_so() ? 0 : 1);
  for (int i = 0; i < 3000; i++) {
    int status = 0;
    if (waitpid(child, &status, WNOHANG) == child) return status == 0;
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  kill(child, SIGKILL);
  waitpid(child, nullptr, 0);
  ADD_FAILURE() << "the child hangs";
  return false;
}

std::unique_ptr<World> CrowdedWorld() {
  World::run_options.threads = 3;
  World::run_options.share_from = 2;
  std::string text;
  for (int i = 0; i < 100; i++)
    text += "position( pose [" + std::to_string(i % 10) + " " + std::to_string(i / 10) +
            " 0 0] velocity [0.1 0 0 20] alwayson 1 ranger( alwayson 1 sensor( samples 20 ) ) )\n";
  auto world = LoadText(text);
  World::run_options = RunOptions();
  return world;
}

uint64_t HashAfter(World* world, int steps) {
  for (int i = 0; i < steps; i++) world->Update();
  return world->StateHash();
}

TEST(Fork, TheChildStepsAsTheParentDoes) {
  SKIP_WITH_THREAD_SANITIZER();
  const auto world = CrowdedWorld(), same = CrowdedWorld();
  HashAfter(world.get(), 3);
  const uint64_t expected = HashAfter(same.get(), 8);
  EXPECT_TRUE(InChild([&] { return HashAfter(world.get(), 5) == expected; }));
  EXPECT_EQ(HashAfter(world.get(), 5), expected) << "the parent continues, too";
}

TEST(Fork, TheChildHasThreadsOfItsOwn) {
  SKIP_WITH_THREAD_SANITIZER();
  if (test::IsEmulated()) GTEST_SKIP() << "the emulator has one more";
  const auto world = CrowdedWorld();
  EXPECT_TRUE(InChild([&] {
    world->Update();
    int threads = 0;
    for ([[maybe_unused]] const auto& entry :
         std::filesystem::directory_iterator("/proc/self/task"))
      threads++;
    return threads == 3;
  }));
}

TEST(Fork, TheChildDeletesTheWorld) {
  SKIP_WITH_THREAD_SANITIZER();
  auto world = CrowdedWorld();
  EXPECT_TRUE(InChild([&] {
    world.reset();
    return true;
  }));
  EXPECT_TRUE(InChild([&] {
    world->Update();
    world.reset();
    const auto another = CrowdedWorld();
    return !another->Update();
  }));
}

// Forks in the middle of a step.
TEST(Fork, InACallback) {
  const auto world = CrowdedWorld();
  static bool good;
  good = false;
  static World* forked;
  forked = world.get();
  world->Enqueue(
      0, 0, world->GetGround(),
      [](Model*, void*) {
        good = InChild([] {
          // Do the rest of the step explicitly.
          forked->host().TraceBatch();
          return true;
        });
        return 1;
      },
      nullptr);
  Step(*world, 2);
  EXPECT_TRUE(good);
}

TEST(Fork, PoolWorksOnTheRemainingThread) {
  threads::WorkerPool pool(4);
  EXPECT_TRUE(pool.IsUsable());
  const auto sum_of = [&] {
    std::atomic<size_t> sum{0};
    pool.Run(1000, 10, [&](size_t begin, size_t end, unsigned) {
      for (size_t i = begin; i < end; i++) sum += i;
    });
    return sum.load();
  };
  EXPECT_TRUE(InChild([&] { return !pool.IsUsable() && sum_of() == 499500; }));
  EXPECT_EQ(sum_of(), 499500u);
}

TEST(Fork, WorldPoolsCanBeUsedAndDeleted) {
  const auto prototype = CrowdedWorld();
  WorldPoolOptions options;
  options.threads = 4;
  auto pool = std::make_unique<WorldPool>(*prototype, std::vector<uint64_t>{1, 2, 3}, options);
  pool->Step(pool->All(), 2);
  EXPECT_TRUE(InChild([&] {
    pool->Step(pool->All(), 2);
    const bool good = pool->At(2)->UpdateCount() == 4;
    pool.reset();
    return good;
  }));
  EXPECT_EQ(pool->At(2)->UpdateCount(), 2u);
}

}  // namespace
}  // namespace Stg
