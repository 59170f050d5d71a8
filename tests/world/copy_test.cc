// SPDX-License-Identifier: GPL-2.0-or-later
//
// A copy of a world has the state of its newly loaded file, independent of the original's state.

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "stage.hh"
#include "support/all_models.hh"
#include "support/meddler.hh"
#include "support/model_testing.hh"
#include "support/own_worlds.hh"
#include "support/sanitized.hh"
#include "support/shipped_worlds.hh"

namespace Stg {
namespace {

constexpr int kSteps = kSanitized ? 5 : 30;

std::unique_ptr<World> CopyOf(const World& other, uint64_t seed) {
  auto copy = std::make_unique<World>(OptionsOf(seed));
  EXPECT_TRUE(copy->LoadCopy(other));
  return copy;
}

/// The state hashes at the beginning and after each step.
std::vector<uint64_t> HashesOf(World* world, int steps) {
  std::vector<uint64_t> hashes = {world->StateHash()};
  for (int i = 0; i < steps; i++) {
    world->Update();
    hashes.push_back(world->StateHash());
  }
  return hashes;
}

class CopyTest : public testing::Test {
 protected:
  static void SetUpTestSuite() { Init(nullptr, nullptr); }
};

TEST_F(CopyTest, EqualsANewlyLoadedWorld) {
  for (const std::string& file : ShippedWorlds()) {
    SCOPED_TRACE(file);
    const std::vector<uint64_t> expected = HashesOf(LoadFile(file, 5).get(), kSteps);
    std::unique_ptr<World> other = LoadFile(file, 1);
    EXPECT_EQ(HashesOf(CopyOf(*other, 5).get(), kSteps), expected) << "copy of a fresh world";
    HashesOf(other.get(), kSteps);
    const std::unique_ptr<World> copy = CopyOf(*other, 5);
    const std::unique_ptr<World> copy_of_copy = CopyOf(*copy, 5);
    other.reset();
    EXPECT_EQ(HashesOf(copy.get(), kSteps), expected) << "copy of a world after some steps";
    EXPECT_EQ(HashesOf(copy_of_copy.get(), kSteps), expected) << "copy of a copy";
    ASSERT_TRUE(copy->Reset(5));
    EXPECT_EQ(HashesOf(copy.get(), kSteps), expected) << "reset";
  }
}

TEST_F(CopyTest, DoesNotDependOnTheOriginalsState) {
  constexpr uint64_t kWorlds = kSanitized ? 10 : 60;
  for (uint64_t seed = 0; seed < kWorlds; seed++) {
    SCOPED_TRACE(seed);
    const bool exact = seed % 3 == 0;
    const std::unique_ptr<World> fresh = LoadRobotsOfAllTypes(seed, exact),
                                 other = LoadRobotsOfAllTypes(seed + 1, exact),
                                 undisturbed = LoadRobotsOfAllTypes(seed + 1, exact);
    Go(other.get(), seed, 0, 10);
    const std::unique_ptr<World> copy = CopyOf(*other, seed);
    EXPECT_EQ(copy->StateHash(), fresh->StateHash());
    Go(copy.get(), seed + 7, 0, 20);
    Go(fresh.get(), seed + 7, 0, 20);
    EXPECT_EQ(copy->StateHash(), fresh->StateHash()) << "later";
    Go(other.get(), seed, 10, 10);
    Go(undisturbed.get(), seed, 0, 20);
    EXPECT_EQ(other->StateHash(), undisturbed->StateHash()) << "the other world is unaffected";
  }
}

/// Makes many copies at the same time; each modifies data that it shares with the others.
TEST_F(CopyTest, InManyThreads) {
  const std::unique_ptr<World> other = LoadFile(SourceFile("worlds/simple.world"), 1);
  HashesOf(other.get(), 10);
  Snapshot now;
  ASSERT_TRUE(other->Take(&now));
  std::vector<std::vector<uint64_t>> hashes(8);
  std::vector<std::thread> threads;
  for (std::vector<uint64_t>& mine : hashes)
    threads.emplace_back([&] {
      for (int round = 0; round < 3; round++) {
        const std::unique_ptr<World> copy = CopyOf(*other, 1);
        EXPECT_TRUE(copy->Restore(now));
        mine = HashesOf(copy.get(), kSteps);
      }
    });
  for (std::thread& thread : threads) thread.join();
  const std::vector<uint64_t> expected = HashesOf(other.get(), kSteps);
  for (const std::vector<uint64_t>& mine : hashes) EXPECT_EQ(mine, expected);
}

TEST_F(CopyTest, WithoutALoadedWorldIsRefused) {
  World empty(OptionsOf(1)), copy(OptionsOf(1));
  const std::string errors = ErrorsOf([&] { EXPECT_FALSE(copy.LoadCopy(empty)); });
  EXPECT_EQ(errors, "stage: found no loaded world to be copied\n");
}

}  // namespace
}  // namespace Stg
