// SPDX-License-Identifier: GPL-2.0-or-later
//
// A world that goes back to a snapshot goes on as if nothing had happened since: the same state
// hashes after further steps, in place and in another world of the same file.

#include "world/snapshot.hh"

#include <gtest/gtest.h>

#include <functional>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include "stage.hh"
#include "support/model_testing.hh"
#include "support/sanitized.hh"
#include "support/shipped_worlds.hh"

namespace Stg {
namespace {

constexpr int kSteps = kSanitized ? 10 : 60;

RunOptions OptionsOf(uint64_t seed) {
  RunOptions options;
  options.seed = seed;
  options.listed = false;
  return options;
}

std::unique_ptr<World> LoadFile(const std::string& file, uint64_t seed) {
  auto world = std::make_unique<World>(OptionsOf(seed));
  EXPECT_TRUE(world->Load(file)) << file;
  return world;
}

uint64_t HashAfter(World* world, int steps) {
  for (int i = 0; i < steps; i++) world->Update();
  return world->StateHash();
}

class SnapshotTest : public testing::Test {
 protected:
  static void SetUpTestSuite() { Init(nullptr, nullptr); }
};

TEST_F(SnapshotTest, ShippedWorldsGoOnAsIfNothingHadHappened) {
  for (const std::string& file : ShippedWorlds()) {
    SCOPED_TRACE(file);
    const std::unique_ptr<World> world = LoadFile(file, 1);
    HashAfter(world.get(), kSteps);
    const uint64_t hash = world->StateHash();
    Snapshot snapshot;
    ASSERT_TRUE(world->Take(&snapshot));
    EXPECT_EQ(snapshot.time(), world->SimTimeNow());
    EXPECT_EQ(world->StateHash(), hash) << "taking it changes nothing";
    const uint64_t later = HashAfter(world.get(), kSteps);

    for (int round = 0; round < 2; round++) {
      ASSERT_TRUE(world->Restore(snapshot));
      EXPECT_EQ(world->StateHash(), hash);
      Snapshot again;
      ASSERT_TRUE(world->Take(&again));
      EXPECT_EQ(again.hash(), snapshot.hash());
      EXPECT_EQ(HashAfter(world.get(), kSteps), later) << "in place, " << round;
    }
    for (const int steps : {0, 7}) {
      const std::unique_ptr<World> other = LoadFile(file, 2);  // with another past
      HashAfter(other.get(), steps);
      ASSERT_TRUE(other->Restore(snapshot));
      EXPECT_EQ(other->StateHash(), hash) << steps;
      Snapshot again;
      ASSERT_TRUE(other->Take(&again));
      EXPECT_EQ(again.hash(), snapshot.hash()) << steps;
      EXPECT_EQ(HashAfter(other.get(), kSteps), later) << "in another world, " << steps;
    }
  }
}

TEST_F(SnapshotTest, TakingAndGoingBackInEachStepChangesNothing) {
  for (const std::string& file : ShippedWorlds()) {
    const uint64_t undisturbed = HashAfter(LoadFile(file, 3).get(), kSteps / 2);
    const std::unique_ptr<World> world = LoadFile(file, 3);
    for (int i = 0; i < kSteps / 2; i++) {
      Snapshot snapshot;
      ASSERT_TRUE(world->Take(&snapshot));
      HashAfter(world.get(), i % 3);
      ASSERT_TRUE(world->Restore(snapshot)) << file;
      world->Update();
    }
    EXPECT_EQ(world->StateHash(), undisturbed) << file;
  }
}

}  // namespace
}  // namespace Stg
