// SPDX-License-Identifier: GPL-2.0-or-later

#include "sensing/fan_order.hh"

#include <gtest/gtest.h>

#include <vector>

#include "sensing/ray_group.hh"
#include "support/random_source.hh"

namespace Stg::internal::sensing {
namespace {

using test::RandomSource;

char finders[100];  // only their addresses are used
const Model* FinderOf(int i) { return reinterpret_cast<const Model*>(&finders[i]); }

class Batch {
 public:
  void Add(int finder, int32_t x, int32_t y, uint32_t samples) {
    Fan fan;
    fan.record.x = x;
    fan.record.y = y;
    fan.finder = FinderOf(finder);
    batch_.Add(fan, samples, SelfMask());
  }
  void Clear() { batch_.Clear(); }
  const RayBatch& Close() {
    batch_.Close(tables_);
    return batch_;
  }

 private:
  DirectionTables tables_;
  RayBatch batch_;
};

/// Adds robots at random places with some fans each.
void Fill(RandomSource* random, Batch* batch) {
  batch->Clear();
  const int robots = random->Int(0, 60);
  for (int robot = 0; robot < robots; robot++) {
    const int32_t x = random->Int(-grid::kMaxCell, grid::kMaxCell);
    const int32_t y = random->Int(-grid::kMaxCell, grid::kMaxCell);
    const int fans = random->Int(1, 20);
    for (int i = 0; i < fans; i++)
      batch->Add(robot, x, y, static_cast<uint32_t>(random->Int(0, random->OneIn(5) ? 300 : 60)));
  }
}

/// The number of occurrences of each fan in the intervals.
std::vector<int> TimesOf(const std::vector<FanInterval>& intervals, size_t fans) {
  std::vector<int> times(fans, 0);
  for (const FanInterval& interval : intervals) {
    EXPECT_GT(interval.count, 0u);
    for (uint32_t i = interval.first; i < interval.first + interval.count; i++) times.at(i)++;
  }
  return times;
}

TEST(FanOrder, ContainsEachFanOnce) {
  RandomSource random(1);
  FanOrder order;  // used for batches of very different sizes
  Batch batch;
  for (int round = 0; round < 300; round++) {
    Fill(&random, &batch);
    const RayBatch& closed = batch.Close();
    const size_t fans = closed.fans().size();
    // Request the order repeatedly, as in steps with few changes.
    const int steps = random.OneIn(10) ? 120 : 2;
    for (int step = 0; step < steps; step++)
      ASSERT_EQ(TimesOf(order.Of(closed), fans), std::vector<int>(fans, 1));
  }
}

TEST(FanOrder, IntervalsHaveOneFinderAndLimitedLength) {
  RandomSource random(2);
  Batch batch;
  size_t longer = 0;
  for (int round = 0; round < 300; round++) {
    Fill(&random, &batch);
    const RayBatch& closed = batch.Close();
    const std::span<const Fan> fans = closed.fans();
    FanOrder order;
    for (const FanInterval& interval : order.Of(closed)) {
      uint32_t rays = 0;
      for (uint32_t i = interval.first; i < interval.first + interval.count; i++) {
        EXPECT_EQ(fans[i].finder, fans[interval.first].finder);
        rays += fans[i].record.samples;
      }
      EXPECT_TRUE(interval.count == 1 || rays <= RayGroup::kMaxRays) << rays;
      // An interval must not be too short, either.
      const uint32_t next = interval.first + interval.count;
      if (next < fans.size() && fans[next].finder == fans[interval.first].finder) {
        EXPECT_GT(rays + fans[next].record.samples, RayGroup::kMaxRays);
      }
      longer += interval.count > 1;
    }
  }
  EXPECT_GT(longer, 1000u);
}

TEST(FanOrder, NeighboursAreAdjacent) {
  Batch batch;
  // Robots alternate between two clusters on both sides of the origin.
  for (int i = 0; i < 40; i++) {
    const int32_t heap = i % 2 == 0 ? 5000 : -5000;
    batch.Add(i, heap + i, heap - i, 8);
  }
  FanOrder order;
  const std::vector<FanInterval>& intervals = order.Of(batch.Close());
  ASSERT_EQ(intervals.size(), 40u);
  for (size_t i = 1; i < 20; i++) {
    EXPECT_EQ(intervals[i].first % 2, intervals[0].first % 2);
    EXPECT_EQ(intervals[20 + i].first % 2, intervals[20].first % 2);
  }
  EXPECT_NE(intervals[0].first % 2, intervals[20].first % 2);
}

TEST(FanOrder, IsRenewedAfterAWhile) {
  FanOrder order;
  Batch batch;
  const auto first_after = [&](int32_t x0, int32_t x1) {
    batch.Clear();
    batch.Add(0, x0, 0, 1);
    batch.Add(1, x1, 0, 1);
    return order.Of(batch.Close())[0].first;
  };
  EXPECT_EQ(first_after(0, 1000), 0u);
  int batches = 1;
  while (first_after(1000, 0) == 0 && batches < 1000) batches++;
  EXPECT_GT(batches, 10) << "sorting is expensive";
  EXPECT_LT(batches, 1000);
}

}  // namespace
}  // namespace Stg::internal::sensing
