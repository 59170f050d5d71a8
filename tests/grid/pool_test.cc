// SPDX-License-Identifier: GPL-2.0-or-later

#include "grid/pool.hh"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <set>
#include <thread>
#include <vector>

namespace Stg::internal::grid {
namespace {

TEST(Pool, IndicesAreUnique) {
  Pool<int> pool;
  std::set<uint32_t> in_use;
  for (int i = 0; i < 1000; i++) EXPECT_TRUE(in_use.insert(pool.Take()).second);
  EXPECT_EQ(*in_use.rbegin(), 999u);
  pool.Give(17);
  pool.Give(500);
  EXPECT_EQ(std::set({pool.Take(), pool.Take()}), std::set({17u, 500u}));
  EXPECT_EQ(pool.Take(), 1000u);
}

TEST(Pool, GrowthKeepsElements) {
  Pool<uint32_t> pool;
  for (uint32_t i = 0; i < 10000; i++) pool[pool.Take()] = 3 * i;
  pool.BeginConcurrentUse(100000, 4);
  pool.EndConcurrentUse();
  for (uint32_t i = 0; i < 10000; i++) ASSERT_EQ(pool[i], 3 * i);
}

TEST(Pool, UnusedReservationsDoNotCount) {
  Pool<uint32_t> pool;
  pool.Take();
  const size_t before = pool.bytes();
  PoolCache cache;
  pool.BeginConcurrentUse(1000000, 1);
  pool.EndConcurrentUse();
  pool.ReturnCache(&cache);
  EXPECT_EQ(pool.bytes(), before);
}

/// Threads take, give back and take again, starting with different numbers of free items.
TEST(Pool, ThreadsGetDistinctIndices) {
  constexpr size_t kThreads = 4, kEach = 1000;
  for (const uint32_t free : {0u, 1u, 63u, 64u, 65u, 500u, 10000u}) {
    Pool<uint32_t> pool;
    std::set<uint32_t> in_use;
    for (int i = 0; i < 100; i++) in_use.insert(pool.Take());
    std::vector<uint32_t> to_give;
    for (uint32_t i = 0; i < free; i++) to_give.push_back(pool.Take());
    for (const uint32_t number : to_give) pool.Give(number);

    std::vector<PoolCache> caches(kThreads);
    std::vector<std::vector<uint32_t>> taken(kThreads);
    pool.BeginConcurrentUse(kThreads * kEach, kThreads);
    std::vector<std::thread> threads;
    for (size_t t = 0; t < kThreads; t++)
      threads.emplace_back([&, t] {
        for (size_t i = 0; i < kEach; i++) {
          taken[t].push_back(pool.Take(&caches[t]));
          pool[taken[t].back()] = static_cast<uint32_t>(t);
          if (i % 3 != 0) continue;
          pool.Give(taken[t].back(), &caches[t]);
          taken[t].pop_back();
        }
      });
    for (std::thread& thread : threads) thread.join();
    pool.EndConcurrentUse();
    for (auto& cache : caches) pool.ReturnCache(&cache);

    for (size_t t = 0; t < kThreads; t++)
      for (const uint32_t number : taken[t]) {
        EXPECT_EQ(pool[number], t);
        EXPECT_TRUE(in_use.insert(number).second) << free;
      }
    // The numbers not taken are exactly the free ones.
    const uint32_t largest = *in_use.rbegin();
    while (in_use.size() <= largest) ASSERT_TRUE(in_use.insert(pool.Take()).second) << free;
    EXPECT_EQ(*in_use.begin(), 0u);
  }
}

}  // namespace
}  // namespace Stg::internal::grid
