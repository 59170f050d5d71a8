// SPDX-License-Identifier: GPL-2.0-or-later
//
// The broad phase against a comparison of all bodies with all others.

#include "motion/nearby.hh"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "motion/separation.hh"
#include "support/motion_world.hh"

namespace {

using Stg::motion::Island;
using Stg::motion::kNoGroup;
using Stg::motion::kTouch;
using Stg::motion::Nearby;
using Stg::motion::NearPair;
using test::MotionWorld;
using test::Numbers;
using test::Vector;

using Pairs = std::vector<std::pair<uint32_t, uint32_t>>;

/// Small, large and huge bodies, some of which stand and many of which can be pushed.
MotionWorld RandomField(uint64_t seed) {
  MotionWorld world;
  Numbers random(seed);
  const double half = random.Between(2.0, 30.0), speed = random.Between(0.0, 5.0);
  const int count = 5 + static_cast<int>(60.0 * random());
  for (int i = 0; i < count; i++) {
    const double kind = random();
    const double size = kind < 0.1 ? half : kind < 0.2 ? 0.3 * half : random.Between(0.01, 0.5);
    const uint32_t shape = world.AddRectangle(size, random.Between(0.2, 1.0) * size);
    const double x = random.Between(-half, half), y = random.Between(-half, half);
    const size_t body = random() < 0.5 ? world.AddBox(shape, x, y, 1.0)
                                       : world.AddRobot(shape, x, y, random.Between(-3.0, 3.0));
    if (random() < 0.4)
      world.Command(body, speed * random(), speed * random.Between(-0.5, 0.5),
                    random.Between(0, 2));
    if (random() < 0.2) world.bodies.group[body] = static_cast<uint32_t>(3.0 * random());
  }
  for (int i = 0; i < 20; i++) {
    const Vector ends[] = {{random.Between(-half, half), random.Between(-half, half)},
                           {random.Between(-half, half), random.Between(-half, half)}};
    world.walls.Add(ends, false, {}, 0.0, random() < 0.3 ? 1 : kNoGroup);
  }
  world.walls.Index();
  world.dt = 1.0;
  world.SetTargets();
  return world;
}

bool SameGroup(uint32_t a, uint32_t b) { return a == b && a != kNoGroup; }

bool AreNear(const MotionWorld& world, const std::vector<double>& reach, size_t a, size_t b) {
  if (reach[a] == 0.0 && reach[b] == 0.0) return false;
  if (SameGroup(world.bodies.group[a], world.bodies.group[b])) return false;
  const auto bound = [&](size_t i) { return world.shapes.shapes[world.bodies.shape[i]].bound; };
  return Length(world.PositionOf(a) - world.PositionOf(b)) <
         bound(a) + bound(b) + reach[a] + reach[b] + kTouch;
}

/// The reaches, from those that the movers have by themselves.
std::vector<double> SpreadReaches(const MotionWorld& world, std::vector<double> reach) {
  const size_t n = reach.size();
  std::vector<double> push;
  for (const double own : reach) push.push_back(2.0 * own);
  for (bool changed = true; changed;) {
    changed = false;
    for (size_t a = 0; a < n; a++)
      for (size_t b = 0; b < n; b++) {
        if (a == b || !world.bodies.pushable[b] || push[a] <= push[b]) continue;
        if (!AreNear(world, reach, a, b)) continue;
        reach[b] = push[b] = push[a];
        changed = true;
      }
  }
  return reach;
}

/// The reach of each body if it was alone.
std::vector<double> OwnReaches(const MotionWorld& world) {
  std::vector<double> reach;
  for (size_t i = 0; i < world.bodies.size(); i++) {
    MotionWorld alone;
    alone.shapes = world.shapes;
    alone.AddRobot(world.bodies.shape[i], world.bodies.x[i], world.bodies.y[i]);
    alone.bodies.target_x[0] = world.bodies.target_x[i];
    alone.bodies.target_y[0] = world.bodies.target_y[i];
    alone.bodies.turn[0] = world.bodies.turn[i];
    Nearby nearby;
    nearby.Find(alone.shapes, alone.walls, alone.bodies);
    reach.push_back(nearby.reach[0]);
  }
  return reach;
}

Pairs Sorted(const std::vector<NearPair>& found) {
  Pairs pairs;
  for (const NearPair& pair : found) pairs.emplace_back(pair.a, pair.b);
  std::ranges::sort(pairs);
  return pairs;
}

double DistanceToEdge(Vector p, const Stg::motion::WallEdge& edge) {
  const Vector along = edge.ends[1] - edge.ends[0];
  const double t = std::clamp(Dot(p - edge.ends[0], along) / Dot(along, along), 0.0, 1.0);
  return Length(p - edge.ends[0] - t * along);
}

TEST(Nearby, FindsAllPairsThatMayTouchAndGivesReachesToWhatIsPushed) {
  size_t found = 0, spread = 0;
  for (uint64_t seed = 1; seed <= 400; seed++) {
    SCOPED_TRACE(seed);
    const MotionWorld world = RandomField(seed);
    const size_t n = world.bodies.size();
    Nearby nearby;
    nearby.Find(world.shapes, world.walls, world.bodies);
    const std::vector<double> own = OwnReaches(world);
    const std::vector<double> reach = SpreadReaches(world, own);
    ASSERT_EQ(nearby.reach, reach);
    Pairs pairs, walls;
    for (uint32_t a = 0; a < n; a++) {
      spread += reach[a] > own[a];
      for (uint32_t b = a + 1; b < n; b++)
        if (AreNear(world, reach, a, b)) pairs.emplace_back(a, b);
      const double far = world.shapes.shapes[world.bodies.shape[a]].bound + reach[a] + kTouch;
      for (uint32_t k = 0; k < world.walls.edges().size() && reach[a] > 0.0; k++)
        if (DistanceToEdge(world.PositionOf(a), world.walls.edges()[k]) < far &&
            !SameGroup(world.bodies.group[a], world.walls.edges()[k].group))
          walls.emplace_back(a, k);
    }
    ASSERT_EQ(Sorted(nearby.pairs), pairs);
    ASSERT_EQ(Sorted(nearby.walls), walls);
    found += pairs.size();
  }
  EXPECT_GT(found, 20000u);
  EXPECT_GT(spread, 2000u);
}

TEST(Nearby, IslandsAreTheConnectedBodiesThatCanMove) {
  size_t islands = 0;
  for (uint64_t seed = 1; seed <= 200; seed++) {
    SCOPED_TRACE(seed);
    const MotionWorld world = RandomField(seed);
    Nearby nearby;
    nearby.Find(world.shapes, world.walls, world.bodies);
    std::vector<uint32_t> island_of(world.bodies.size(), Nearby::kNone);
    uint32_t smallest_before = 0;
    for (uint32_t k = 0; k < nearby.islands.size(); k++) {
      const Island& island = nearby.islands[k];
      ASSERT_LT(island.first_member, island.last_member);
      const uint32_t smallest = nearby.members[island.first_member];
      EXPECT_TRUE(k == 0 || smallest > smallest_before);
      smallest_before = smallest;
      for (uint32_t m = island.first_member; m < island.last_member; m++) {
        const uint32_t body = nearby.members[m];
        EXPECT_EQ(nearby.place[body], m - island.first_member);
        EXPECT_TRUE(m == island.first_member || body > nearby.members[m - 1]);
        EXPECT_GT(nearby.reach[body], 0.0);
        island_of[body] = k;
      }
      for (uint32_t m = island.first_wall; m < island.last_wall; m++)
        EXPECT_EQ(island_of[nearby.walls[m].a], k);
    }
    // Each pair is in the island of the bodies that can move, which is the same for both.
    for (uint32_t k = 0; k < nearby.islands.size(); k++)
      for (uint32_t m = nearby.islands[k].first_pair; m < nearby.islands[k].last_pair; m++)
        for (const uint32_t body : {nearby.pairs[m].a, nearby.pairs[m].b})
          EXPECT_EQ(island_of[body], nearby.reach[body] > 0.0 ? k : Nearby::kNone);
    islands += nearby.islands.size();
  }
  EXPECT_GT(islands, 200u);
}

}  // namespace
