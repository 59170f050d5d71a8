// SPDX-License-Identifier: GPL-2.0-or-later
//
// A branch develops as its world would, independently of the number of branches and threads and of
// what other branches do.

#include "whatif/branches.hh"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <numeric>
#include <random>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "stage.hh"
#include "support/all_models.hh"
#include "support/meddler.hh"
#include "support/model_testing.hh"
#include "support/own_worlds.hh"
#include "support/resident_memory.hh"
#include "support/sanitized.hh"
#include "support/shipped_worlds.hh"

namespace Stg {
namespace {

std::unique_ptr<World> LoadAndStep(const std::string& file, int steps) {
  std::unique_ptr<World> world = LoadFile(file, 1);
  world->SetQuitTime(0);
  for (int i = 0; i < steps; i++) world->Update();
  return world;
}

std::unique_ptr<World> LoadText(const std::string& text) {
  auto world = std::make_unique<World>(OptionsOf(1));
  std::istringstream content(text);
  EXPECT_TRUE(world->Load(content, "text.world"));
  return world;
}

std::unique_ptr<World> CopyIn(const World& other, const Snapshot& state) {
  RunOptions options = OptionsOf(1);
  options.branch = true;
  auto copy = std::make_unique<World>(options);
  EXPECT_TRUE(copy->LoadCopy(other));
  EXPECT_TRUE(copy->Restore(state));
  copy->SetQuitTime(0);
  return copy;
}

BranchOptions With(unsigned threads, Snapshot::Keep keep) {
  BranchOptions options;
  options.threads = threads;
  options.keep = keep;
  return options;
}

ModelPosition* FirstRobot(World* world) {
  for (Model* model : all_models::ByNumber(world))
    if (auto* position = dynamic_cast<ModelPosition*>(model)) return position;
  return nullptr;
}

/// Drives the first robot differently in each branch, and scores the place it reaches.
class Drive : public Scenario {
 public:
  void BeforeStep(World& world, uint32_t branch) override {
    if (ModelPosition* const robot = FirstRobot(&world); robot && branch % 3 == 0)
      robot->SetSpeed(0.1 * (branch % 7), 0, 0.3 - 0.1 * (branch % 5));
  }
  bool AfterStep(World& world, uint32_t branch, double* score) override {
    if (ModelPosition* const robot = FirstRobot(&world))
      *score += robot->GetGlobalPose().x * (branch + 1);
    return branch % 11 == 5 && world.UpdateCount() % 9 == 0;
  }
};

/// Expected result of one branch, computed separately in a new world.
struct Expected {
  uint64_t hash = 0, steps = 0;
  double score = 0;
};
Expected Alone(const World& other, const Snapshot& from, uint32_t branch, uint64_t seed,
               int steps) {
  const std::unique_ptr<World> world = CopyIn(other, from);
  world->Reseed(seed);
  Drive drive;
  Expected expected;
  for (bool ended = false; !ended && expected.steps < static_cast<uint64_t>(steps);) {
    drive.BeforeStep(*world, branch);
    world->Update();
    expected.steps++;
    ended = drive.AfterStep(*world, branch, &expected.score);
  }
  Snapshot state;
  EXPECT_TRUE(world->Take(&state));
  expected.hash = state.hash();
  return expected;
}

class BranchesTest : public testing::Test {
 protected:
  static void SetUpTestSuite() { Init(nullptr, nullptr); }
};

TEST_F(BranchesTest, EqualSingleWorlds) {
  constexpr uint32_t kCount = kSanitized ? 6 : 12;
  constexpr int kSteps = 20;
  for (const std::string& file : ShippedWorlds()) {
    SCOPED_TRACE(file);
    if (kSanitized && file.find("hospital") != std::string::npos) continue;
    const std::unique_ptr<World> world = LoadAndStep(file, 7);
    const uint64_t before = world->StateHash();
    Snapshot now;
    ASSERT_TRUE(world->Take(&now));
    std::vector<Expected> expected;
    for (uint32_t i = 0; i < kCount; i++)
      expected.push_back(Alone(*world, now, i, 100 + i, kSteps));
    for (const unsigned threads : {1u, 3u}) {
      Branches branches(*world, kCount, With(threads, Snapshot::kFull));
      ASSERT_TRUE(branches.IsReady());
      for (uint32_t i = kCount; i-- > 0;) branches.Restore(i, now, 100 + i);
      Drive drive;
      for (int done = 0; done < kSteps; done += 5) branches.Step(5, &drive);
      for (uint32_t i = 0; i < kCount; i++) {
        EXPECT_EQ(branches[i].error, "");
        EXPECT_EQ(branches[i].steps, expected[i].steps) << i;
        EXPECT_EQ(branches[i].score, expected[i].score) << i;
        EXPECT_EQ(branches.StateOf(i).hash(), expected[i].hash) << i << ", " << threads;
      }
    }
    EXPECT_EQ(world->StateHash(), before) << "the prototype stays as it is";
  }
}

/// Creates and deletes models, moves them between parents, throws.
class Wild : public Scenario {
 public:
  void BeforeStep(World& world, uint32_t branch) override {
    if (branch % 5 == 4 && world.UpdateCount() % 8 == 7) throw std::runtime_error("too wild");
    Meddler meddler(&world, branch * 1000 + world.UpdateCount());
    if (branch % 2 == 1)
      for (int k = 0; k < 3; k++) meddler.Do();
  }
};

constexpr uint32_t kWild = kSanitized ? 12 : 64;

/// Runs kWild branches and returns their state hashes.
std::vector<uint64_t> HashesOfWild(const World& world, const BranchOptions& options) {
  Snapshot now;
  EXPECT_TRUE(world.Take(&now));
  Branches branches(world, kWild, options);
  EXPECT_TRUE(branches.IsReady());
  std::vector<uint32_t> order(kWild);
  std::iota(order.begin(), order.end(), 0u);
  std::shuffle(order.begin(), order.end(), std::mt19937(options.threads));
  for (const uint32_t i : order) branches.Restore(i, now, 7 + i);
  Wild wild;
  for (int round = 0; round < 4; round++) branches.Step(5, &wild);
  std::vector<uint64_t> hashes;
  for (uint32_t i = 0; i < kWild; i++) {
    EXPECT_EQ(branches[i].state, i % 5 == 4 ? Branch::kFailed : Branch::kAlive) << i;
    EXPECT_EQ(branches[i].error, i % 5 == 4 ? "an exception: too wild" : "") << i;
    uint64_t hash = 0;
    branches.Visit(i, [&](World& branch) {
      branch.Update();  // lean branches have readings only after a step
      hash = branch.StateHash();
    });
    hashes.push_back(hash);
  }
  return hashes;
}

TEST_F(BranchesTest, DoNotDependOnOtherBranches) {
  const std::unique_ptr<World> world = LoadText(kRobotsOfAllTypes);
  const std::vector<uint64_t> expected = HashesOfWild(*world, With(1, Snapshot::kFull));
  for (const Snapshot::Keep keep : {Snapshot::kFull, Snapshot::kLean})
    for (const unsigned threads : {1u, 2u, 5u, 16u})
      EXPECT_EQ(HashesOfWild(*world, With(threads, keep)), expected) << keep << ", " << threads;
}

TEST_F(BranchesTest, DoNotDependOnADevice) {
  RunOptions options = OptionsOf(1);
  options.opencl = options.always_on_device = true;
  World world(options);
  std::istringstream content(kRobotsOfAllTypes);
  ASSERT_TRUE(world.Load(content, "text.world"));
  if (world.statistics().device.empty()) GTEST_SKIP() << "there is no OpenCL device here";
  const std::unique_ptr<World> host = LoadText(kRobotsOfAllTypes);
  const std::vector<uint64_t> expected = HashesOfWild(*host, With(1, Snapshot::kFull));
  for (const unsigned threads : {1u, 3u}) {
    BranchOptions with = With(threads, Snapshot::kLean);
    with.device = true;
    EXPECT_EQ(HashesOfWild(world, with), expected) << threads;
  }
}

TEST_F(BranchesTest, ExecuteCommandsAndReportOutcomes) {
  const std::unique_ptr<World> world = LoadText(
      "position( name \"r\" alwayson 1 velocity_bounds [-0.5 0.5 0 0 0 0 -90 90] )\n"
      "model( pose [3 0 0 0] size [1 4 1] )\n");
  Snapshot now;
  ASSERT_TRUE(world->Take(&now));
  const uint32_t robot = world->GetModel("r")->GetId();
  BranchOptions options;
  options.watched = {robot};
  Branches branches(*world, 2, options);
  for (uint32_t i : {0u, 1u}) branches.Restore(i, now);
  branches.Give(0, Command(20, robot, Command::kStop));
  branches.Give(0, Command(0, robot, Command::kSetSpeed, 2));
  branches.Give(1, Command(0, robot, Command::kSetSpeed, 0.2));
  branches.Step(40);
  ASSERT_EQ(branches[0].sightings.size(), 40u);
  EXPECT_EQ(branches[0].commands.front().step, 0u);
  EXPECT_EQ(branches[0].sightings[1].velocity.x, 0.5) << "the applied commands";
  EXPECT_EQ(branches[0].sightings[25].velocity.x, 0);
  EXPECT_NEAR(branches[0].sightings[39].pose.x, 1.0, 0.1);
  EXPECT_NEAR(branches[1].sightings[39].pose.x, 0.8, 0.05);
  branches.Step(80);
  EXPECT_FALSE(branches[0].sightings.back().stalled);
  EXPECT_TRUE(branches[1].sightings.back().stalled) << "at the wall";
}

TEST_F(BranchesTest, AreRetiredRestoredAndUsedAgain) {
  const std::unique_ptr<World> world = LoadAndStep(SourceFile("worlds/simple.world"), 5);
  Snapshot now;
  ASSERT_TRUE(world->Take(&now, Snapshot::kLean));
  Branches branches(*world, 3, With(2, Snapshot::kLean));
  EXPECT_EQ(branches[0].state, Branch::kRetired);
  EXPECT_FALSE(branches.Visit(0, [](World&) {}));
  for (uint32_t i : {0u, 1u, 2u}) branches.Restore(i, now);
  branches.Step(10);
  const uint64_t hash = branches.StateOf(0).hash();
  branches.Retire(0);
  branches.Step(10);
  EXPECT_EQ(branches[0].steps, 10u);
  EXPECT_EQ(branches[1].steps, 20u);
  EXPECT_EQ(branches.StateOf(0).hash(), hash);
  branches.Restore(1, now);
  branches.Step(10);
  EXPECT_EQ(branches.StateOf(1).hash(), hash);
  EXPECT_EQ(branches[1].steps, 10u);
  branches.Restore(2, branches.StateOf(0));
  EXPECT_EQ(branches.StateOf(2).hash(), hash);
  branches.Resize(5);
  EXPECT_EQ(branches.StateOf(2).hash(), hash);
  EXPECT_EQ(branches[4].state, Branch::kRetired);
}

TEST_F(BranchesTest, DependOnSeeds) {
  const std::unique_ptr<World> world =
      LoadAndStep(SourceFile("tests/data/controllers/lasernoise.world"), 5);
  Snapshot now;
  ASSERT_TRUE(world->Take(&now));
  Branches branches(*world, 3);
  branches.Restore(0, now, 1);
  branches.Restore(1, now, 2);
  branches.Restore(2, now, 1);
  branches.Step(5);
  EXPECT_NE(branches.StateOf(0).hash(), branches.StateOf(1).hash());
  EXPECT_EQ(branches.StateOf(0).hash(), branches.StateOf(2).hash());
}

TEST_F(BranchesTest, SeedsTakeNoRoomInLeanRows) {
  const std::unique_ptr<World> world = LoadAndStep(SourceFile("worlds/cave.world"), 20);
  Snapshot now;
  ASSERT_TRUE(world->Take(&now, Snapshot::kLean));
  Branches branches(*world, 1, With(1, Snapshot::kLean));
  branches.Restore(0, now, 77);
  branches.Step(10);
  EXPECT_LE(branches.StateOf(0).size(), 160u * 100);
}

int Throw(World*, void*) { throw std::runtime_error("by a callback"); }
int QuitNow(World* world, void*) {
  world->Quit();
  return 0;
}

TEST_F(BranchesTest, KeepErrorsSeparate) {
  const std::unique_ptr<World> world = LoadText(kRobotsOfAllTypes);
  Snapshot now;
  ASSERT_TRUE(world->Take(&now));
  Branches branches(*world, 4);
  for (uint32_t i : {0u, 1u, 2u, 3u}) branches.Restore(i, now);
  EXPECT_TRUE(branches.Visit(1, [](World& branch) { branch.AddUpdateCallback(Throw, nullptr); }));
  branches.Visit(2, [](World& branch) {
    branch.Enqueue(
        0, 1000000, branch.GetGround(), [](Model*, void*) { return 0; }, nullptr);
  });
  EXPECT_EQ(branches[2].state, Branch::kFailed);
  EXPECT_NE(branches[2].error.find("a callback of Enqueue() is pending"), std::string::npos);
  EXPECT_TRUE(branches.StateOf(2).empty());
  Branches others(*world, 1);
  others.Restore(0, Snapshot());
  EXPECT_EQ(others[0].error, "the snapshot was never taken, or World::Take() has refused it");
}

TEST_F(BranchesTest, OneThatQuitsHasEnded) {
  const std::unique_ptr<World> world = LoadText(kRobotsOfAllTypes);
  Snapshot now;
  ASSERT_TRUE(world->Take(&now));
  class Quitter : public Scenario {
    void BeforeStep(World& branch, uint32_t number) override {
      if (number == 1 && branch.UpdateCount() == 3) branch.AddUpdateCallback(QuitNow, nullptr);
    }
    bool AfterStep(World& branch, uint32_t number, double*) override {
      if (number == 1) branch.RemoveUpdateCallback(QuitNow, nullptr);
      return false;
    }
  } quitter;
  Branches branches(*world, 2);
  for (uint32_t i : {0u, 1u}) branches.Restore(i, now);
  branches.Step(10, &quitter);
  EXPECT_EQ(branches[0].steps, 10u);
  EXPECT_EQ(branches[1].state, Branch::kEnded);
  EXPECT_EQ(branches[1].steps, 4u);
}

TEST_F(BranchesTest, AreNotReadyWithoutAWorld) {
  World empty(OptionsOf(1));
  const std::string errors = ErrorsOf([&] { EXPECT_FALSE(Branches(empty, 3).IsReady()); });
  EXPECT_NE(errors.find("no loaded world"), std::string::npos) << errors;
}

TEST_F(BranchesTest, OutliveTheirPrototype) {
  std::unique_ptr<World> world = LoadAndStep(SourceFile("worlds/simple.world"), 5);
  Snapshot now;
  ASSERT_TRUE(world->Take(&now));
  Branches branches(*world, 6, With(3, Snapshot::kFull));
  for (uint32_t i = 0; i < 6; i++) branches.Restore(i, now);
  for (int i = 0; i < 10; i++) world->Update();
  ASSERT_TRUE(world->Take(&now));
  world.reset();
  branches.Step(10);
  for (uint32_t i = 0; i < 6; i++) EXPECT_EQ(branches.StateOf(i).hash(), now.hash()) << i;
}

TEST_F(BranchesTest, AHundredThousandForksTakeNoMoreMemoryThanAFew) {
  constexpr int kForks = kSanitized ? 1000 : 100000, kWarmUp = kForks / 10;
  const std::unique_ptr<World> world = LoadText(
      "resolution 0.1\n"
      "position( alwayson 1 velocity [0.4 0 0 20]\n"
      "  ranger( alwayson 1 sensor( range [0 2] samples 5 noise [0 0.01 0] ) ) )\n"
      "model( size [4 4 1] boundary 1 noblocks 1 )\n");
  Branches branches(*world, 10, With(2, Snapshot::kLean));
  Snapshot now;
  ASSERT_TRUE(world->Take(&now, Snapshot::kLean));
  long start = 0;
  for (int i = 0; i < kForks; i += 10) {
    if (i == kWarmUp) start = ResidentMemory();
    for (uint32_t k = 0; k < 10; k++) {
      const Snapshot neighbour = k % 2 ? Snapshot() : branches.StateOf(k + 1);
      branches.Restore(k, neighbour.empty() ? now : neighbour, static_cast<uint64_t>(i));
    }
    branches.Step(2);
  }
  EXPECT_GT(start, 0);
  EXPECT_EQ(branches[3].steps, 2u);
  if (!kSanitized) {  // sanitizers keep freed memory
    EXPECT_LT(ResidentMemory() - start, 1 << 20);
  }
}

// ---- between steps ------------------------------------------------------------------------------

/// Takes a snapshot during each step.
struct Photographer {
  std::vector<uint64_t> hashes;
  static int Ask(Model* model, void* arg) {
    auto* self = static_cast<Photographer*>(arg);
    model->GetWorld()->CallAfterStep([self](World& world) {
      Snapshot snapshot;
      EXPECT_TRUE(world.Take(&snapshot));
      self->hashes.push_back(snapshot.hash());
    });
    return 0;
  }
};

TEST_F(BranchesTest, CallbacksCanAskForWhatIsDoneBetweenSteps) {
  const std::unique_ptr<World> world = LoadAndStep(SourceFile("worlds/simple.world"), 1);
  Photographer photographer;
  FirstRobot(world.get())->AddCallback(Model::CB_UPDATE, Photographer::Ask, &photographer);
  std::vector<uint64_t> expected;
  for (int i = 0; i < 5; i++) {
    world->Update();
    Snapshot snapshot;
    ASSERT_TRUE(world->Take(&snapshot));
    expected.push_back(snapshot.hash());
  }
  EXPECT_EQ(photographer.hashes, expected);
}

}  // namespace
}  // namespace Stg
