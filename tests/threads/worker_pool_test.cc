// SPDX-License-Identifier: GPL-2.0-or-later

#include "threads/worker_pool.hh"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <cstdlib>
#include <thread>
#include <vector>

#include "support/emulated.hh"
#include "support/random_source.hh"

namespace Stg::threads {
namespace {

/// Runs a job and checks that it gets each index exactly once.
void ExpectOnceEach(WorkerPool* pool, size_t count, size_t grain) {
  std::vector<std::atomic<int>> times(count);
  std::atomic<bool> good{true};
  pool->Run(count, grain, [&](size_t begin, size_t end, unsigned thread) {
    if (begin >= end || end > count || thread >= pool->threads()) good = false;
    for (size_t i = begin; i < end; i++) times[i].fetch_add(1);
  });
  ASSERT_TRUE(good);
  for (size_t i = 0; i < count; i++) ASSERT_EQ(times[i], 1) << i << " of " << count;
}

TEST(WorkerPool, VisitsEveryIndexOnce) {
  for (const unsigned threads : {0u, 1u, 2u, 3u, 8u, 33u}) {
    WorkerPool pool(threads);
    EXPECT_EQ(pool.threads(), threads == 0 ? 1 : threads);
    for (const size_t count : {0, 1, 2, 7, 31, 32, 33, 64, 100, 1000, 10007})
      for (const size_t grain : {0, 1, 3, 32, 1000, 100000})
        ASSERT_NO_FATAL_FAILURE(ExpectOnceEach(&pool, count, grain));
  }
}

TEST(WorkerPool, TheCallerMayDoSomethingElseFirst) {
  for (const unsigned threads : {1u, 2u, 4u}) {
    WorkerPool pool(threads);
    const std::thread::id caller = std::this_thread::get_id();
    std::atomic<size_t> done{0};
    int calls = 0;
    const auto first = [&] {
      EXPECT_EQ(std::this_thread::get_id(), caller);
      calls++;
      // The other threads don't wait for it; they do the whole job.
      while (done < 100) std::this_thread::yield();
    };
    const auto job = [&](size_t begin, size_t end, unsigned) { done += end - begin; };
    pool.RunAlongside(first, 100, 1, job);
    EXPECT_EQ(done, 100u);
    EXPECT_EQ(calls, threads > 1 ? 1 : 0);
    pool.RunAlongside(first, 5, 10, job);  // too small to be shared
    EXPECT_EQ(calls, threads > 1 ? 1 : 0);
  }
}

TEST(WorkerPool, LosesNoWakeUp) {
  for (const unsigned threads : {2u, 4u, 9u}) {
    WorkerPool pool(threads);
    std::atomic<uint64_t> sum{0};
    for (int i = 0; i < 2000; i++) {
      const size_t count = 1 + static_cast<size_t>(i) % 17;
      pool.Run(count, 1, [&](size_t begin, size_t end, unsigned) { sum += end - begin; });
    }
    uint64_t expected = 0;
    for (int i = 0; i < 2000; i++) expected += 1 + static_cast<uint64_t>(i) % 17;
    EXPECT_EQ(sum, expected);
  }
}

TEST(WorkerPool, HoldsProcessorsOrNot) {
  for (const unsigned threads : {1u, 2u, 8u}) {
    WorkerPool pool(threads);
    for (int i = 0; i < 200; i++) {  // while threads spin or sleep
      pool.AllowSpinning(i % 3 == 0);
      ASSERT_NO_FATAL_FAILURE(ExpectOnceEach(&pool, 100, 1));
      if (i % 50 == 0) std::this_thread::sleep_for(std::chrono::milliseconds(3));
    }
  }
}

TEST(WorkerPool, AllIsDoneWhenRunReturns) {
  WorkerPool pool(4);
  std::vector<int> data(5000, 0);  // not atomic: Run() must synchronize
  for (int round = 1; round <= 200; round++) {
    pool.Run(data.size(), 16, [&](size_t begin, size_t end, unsigned) {
      for (size_t i = begin; i < end; i++) data[i]++;
    });
    for (const int value : data) ASSERT_EQ(value, round);
  }
}

TEST(WorkerPool, ThreadsOfTheirOwnNumber) {
  WorkerPool pool(4);
  // Each thread writes to its own counter, as ray tracing does.
  std::vector<uint64_t> counters(pool.threads(), 0);
  for (int i = 0; i < 500; i++)
    pool.Run(64, 1,
             [&](size_t begin, size_t end, unsigned thread) { counters[thread] += end - begin; });
  uint64_t sum = 0;
  for (const uint64_t counter : counters) sum += counter;
  EXPECT_EQ(sum, 500u * 64u);
}

TEST(WorkerPool, SmallJobsStayWithTheCaller) {
  WorkerPool pool(4);
  const std::thread::id caller = std::this_thread::get_id();
  int calls = 0;
  pool.Run(32, 32, [&](size_t begin, size_t end, unsigned thread) {
    calls++;
    EXPECT_EQ(std::this_thread::get_id(), caller);
    EXPECT_EQ(begin, 0u);
    EXPECT_EQ(end, 32u);
    EXPECT_EQ(thread, 0u);
  });
  EXPECT_EQ(calls, 1);
}

TEST(WorkerPool, CanBeCreatedAndDestroyedRepeatedly) {
  for (int i = 0; i < 200; i++) {
    WorkerPool pool(3);
    if (i % 2) {
      ASSERT_NO_FATAL_FAILURE(ExpectOnceEach(&pool, 10, 1));
    }
  }
}

// ---- FindFirst() -------------------------------------------------------------------------------

TEST(FindFirst, EqualsASequentialSearch) {
  test::RandomSource random(1);
  for (unsigned threads = 1; threads <= 8; threads++) {
    WorkerPool pool(threads);
    for (int round = 0; round < 150; round++) {
      // Small counts are searched by the caller alone; large ones give each thread many grains.
      const auto count = static_cast<size_t>(random.Pick<int>(
          {0, 1, 2, 63, 64, 65, 999, 1000, 1001, random.Int(1000, 3000), random.Int(0, 20000)}));
      const auto rarity = uint64_t{1} << random.Int(0, 16);
      std::vector<char> is(count);
      for (char& is_so : is) is_so = random.OneIn(rarity);
      const auto expected = std::find(is.begin(), is.end(), 1) - is.begin();
      ASSERT_EQ(pool.FindFirst(count, [&](size_t i) { return is.at(i) != 0; }),
                static_cast<size_t>(expected))
          << count << " with " << threads << " threads";
    }
  }
}

TEST(FindFirst, ExaminesAllBeforeTheFirstOnce) {
  for (const unsigned threads : {1u, 4u}) {
    WorkerPool pool(threads);
    for (const size_t first : {0, 1, 1500, 4999, 5000}) {
      std::vector<std::atomic<int>> looks(5000);
      const auto is_so = [&](size_t i) {
        looks[i]++;
        return i == first || i == first + 100;
      };
      ASSERT_EQ(pool.FindFirst(looks.size(), is_so), first);
      for (size_t i = 0; i < looks.size(); i++)
        ASSERT_TRUE(looks[i] == 1 || (i > first && looks[i] == 0)) << i;
    }
  }
}

// ---- shares -------------------------------------------------------------------------------------

// The other threads take over the share of a thread that is delayed.
TEST(WorkerPool, ThreadsHelpOneAnother) {
  WorkerPool pool(3);
  std::atomic<int> done{0};
  pool.Run(300, 1, [&](size_t begin, size_t end, unsigned) {
    // The first call waits for the rest of its thread's share too.
    while (begin == 0 && done < 299) std::this_thread::yield();
    done += static_cast<int>(end - begin);
  });
  EXPECT_EQ(done, 300);
}

// With more threads than cores, they sleep at once; with pauses between jobs they always sleep.
TEST(WorkerPool, SleepersAreWoken) {
  const unsigned cores = std::max(std::thread::hardware_concurrency(), 1u);
  for (const unsigned threads : {2u, cores, cores + 1, 2 * cores + 3}) {
    WorkerPool pool(threads);
    for (int round = 0; round < 20; round++) {
      std::this_thread::sleep_for(std::chrono::milliseconds(round % 3));
      // All threads wait until each of them has arrived, so each has to be woken.
      std::atomic<unsigned> here{0};
      pool.Run(pool.threads(), 1, [&](size_t begin, size_t end, unsigned) {
        here += static_cast<unsigned>(end - begin);
        while (here < pool.threads()) std::this_thread::yield();
      });
      EXPECT_EQ(here, pool.threads());
    }
  }
}

// ---- exceptions ---------------------------------------------------------------------------------

// If several indices throw, Run() throws the exception of the lowest, whatever its type and thread.
// All lower indices are done, and the threads can run the next job.
TEST(WorkerPool, ThrowsTheFirstException) {
  test::RandomSource random(1);
  for (const unsigned threads : {1u, 2u, 4u, 9u}) {
    WorkerPool pool(threads);
    for (int round = 0; round < 200; round++) {
      const auto count = static_cast<size_t>(random.Int(1, 300));
      const auto first = static_cast<size_t>(random.Int(0, static_cast<int>(count) - 1));
      std::vector<std::atomic<int>> times(count);
      const auto job = [&](size_t begin, size_t end, unsigned) {
        for (size_t i = begin; i < end; i++) {
          if (i >= first && (i - first) % 3 == 0) throw i;
          times[i]++;
        }
      };
      try {
        pool.Run(count, static_cast<size_t>(random.Int(1, 20)), job);
        ADD_FAILURE() << "nothing thrown";
      } catch (const size_t thrown) {
        ASSERT_EQ(thrown, first);
      }
      for (size_t i = 0; i < count; i++)
        ASSERT_TRUE(times[i] == 1 || (i >= first && times[i] == 0)) << i << " of " << count;
      ASSERT_NO_FATAL_FAILURE(ExpectOnceEach(&pool, count, 1));
    }
  }
}

TEST(WorkerPool, WaitsForTheOthersIfTheCallerThrows) {
  WorkerPool pool(4);
  for (int round = 0; round < 50; round++) {
    std::atomic<size_t> done{0};
    const auto job = [&](size_t begin, size_t end, unsigned) { done += end - begin; };
    EXPECT_THROW(pool.RunAlongside([] { throw 42; }, 1000, 1, job), int);
    EXPECT_EQ(done, 1000u);
  }
}

// The memory limit leaves no room for some of the threads' stacks.
TEST(WorkerPool, WorksWithFewerThreadsIfNoneCanBeCreated) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "sanitizers reserve more memory than a limit would leave";
#endif
  if (test::IsEmulated()) GTEST_SKIP() << "the emulator ignores memory limits";
  const auto work_with_little_memory = [] {
    rlimit limit{};
    getrlimit(RLIMIT_AS, &limit);
    limit.rlim_cur = rlim_t{1} << 30;
    setrlimit(RLIMIT_AS, &limit);
    WorkerPool pool(1000);
    ExpectOnceEach(&pool, 10000, 1);
    std::exit(pool.threads() < 1000 && !testing::Test::HasFailure() ? 0 : 1);
  };
  EXPECT_EXIT(work_with_little_memory(), testing::ExitedWithCode(0), "");
}

}  // namespace
}  // namespace Stg::threads
