// SPDX-License-Identifier: GPL-2.0-or-later
//
// The poses of populations, which are the same for loaded, reset and copied worlds.

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include "stage.hh"
#include "support/meddler.hh"
#include "support/model_testing.hh"
#include "support/own_worlds.hh"
#include "support/random_source.hh"
#include "support/sanitized.hh"
#include "support/shipped_worlds.hh"

namespace Stg {
namespace {

constexpr int kSteps = kSanitized ? 5 : 25;

std::unique_ptr<World> LoadText(const std::string& text, uint64_t seed,
                                const std::vector<std::string>& settings = {}) {
  RunOptions options = OptionsOf(seed);
  options.settings = settings;
  auto world = std::make_unique<World>(options);
  std::istringstream content(text);
  EXPECT_TRUE(world->Load(content, "p.world")) << text;
  return world;
}

std::vector<Pose> PosesOf(World* world, const std::string& name, size_t count) {
  std::vector<Pose> poses;
  for (size_t i = 0; i < count; i++) {
    const Model* model = world->GetModel(name + std::to_string(i));
    EXPECT_NE(model, nullptr) << name << i;
    if (model) poses.push_back(model->GetGlobalPose());
  }
  return poses;
}

/// Four walls around the origin.
std::string Room(double side) {
  std::string text;
  for (int i = 0; i < 4; i++) {
    const double x = i == 0   ? side / 2
                     : i == 1 ? -side / 2
                              : 0,
                 y = i == 2   ? side / 2
                     : i == 3 ? -side / 2
                              : 0;
    text += "model( pose [" + std::to_string(x) + " " + std::to_string(y) + " 0 " +
            (i < 2 ? "90" : "0") + "] size [" + std::to_string(side) + " 0.2 1] )\n";
  }
  return text;
}

std::string RandomWorld(uint64_t seed) {
  test::RandomSource random(seed);
  std::string text = "resolution " + std::to_string(random.Real(0.02, 0.1)) + "\n" +
                     "define robot position( size [0.4 0.3 0.3] alwayson 1"
                     "  ranger( alwayson 1 sensor( range [0 4] samples 9 noise [0.1 0 0] ) ) )\n" +
                     (random.OneIn(2) ? Room(12) : "");
  for (int i = random.Int(0, 6); i > 0; i--)
    text += "model( pose [" + std::to_string(random.Real(-5, 5)) + " " +
            std::to_string(random.Real(-5, 5)) + " 0 " + std::to_string(random.Real(0, 360)) +
            "] size [" + std::to_string(random.Real(0.2, 2)) + " 1 1] )\n";
  text += "population( name \"movers\" model \"robot\" count " + std::to_string(random.Int(1, 12)) +
          " area [-5.5 -5.5 5.5 5.5] )\n";
  text += "population( name \"pucks\" model \"puck\" count " + std::to_string(random.Int(0, 9)) +
          " gap 0.2 area [-3 -3 3 3] )\n";
  return "define puck model( size [0.2 0.2 0.1] )\n" + text;
}

class PopulationsTest : public testing::Test {
 protected:
  static void SetUpTestSuite() { Init(nullptr, nullptr); }
};

TEST_F(PopulationsTest, ArePlacedOnFreeGround) {
  for (uint64_t seed = 0; seed < (kSanitized ? 5 : 40); seed++) {
    SCOPED_TRACE(seed);
    const std::unique_ptr<World> world = LoadText(RandomWorld(seed), seed);
    for (Model* model : all_models::ByNumber(world.get())) {
      if (model->TokenStr().rfind("mover", 0) != 0 && model->TokenStr().rfind("puck", 0) != 0)
        continue;
      if (model->Parent()) continue;
      EXPECT_FALSE(model->HasCollision()) << model->TokenStr();
      const Pose pose = model->GetGlobalPose();
      const double reach = model->TokenStr()[0] == 'p' ? 3 : 6;
      EXPECT_LT(std::max(std::abs(pose.x), std::abs(pose.y)), reach);
    }
  }
}

TEST_F(PopulationsTest, DependOnTheSeedAndTheirNameAlone) {
  const std::string text = Room(20) +
                           "population( name \"a\" model \"model\" count 5 )\n"
                           "population( name \"b\" model \"model\" count 5 )\n";
  const auto poses = [&](uint64_t seed, const std::vector<std::string>& settings, size_t count) {
    return PosesOf(LoadText(text, seed, settings).get(), "a", count);
  };
  EXPECT_EQ(poses(3, {}, 5), poses(3, {}, 5));
  EXPECT_NE(poses(3, {}, 5), poses(4, {}, 5));
  std::vector<Pose> more = poses(3, {"a=9"}, 9);
  more.resize(5);
  EXPECT_EQ(poses(3, {}, 5), more) << "a larger population begins with the same places";
  EXPECT_EQ(poses(3, {}, 5), poses(3, {"b=0"}, 5));
  EXPECT_EQ(poses(3, {"a.seed=8"}, 5), poses(4, {"a.seed=8"}, 5));
}

TEST_F(PopulationsTest, FailWithoutEnoughSpace) {
  World world(OptionsOf(1));
  std::istringstream content("population( model \"model\" count 100 area [-1 -1 1 1] )\n" +
                             Room(2));
  const std::string errors = ErrorsOf([&] { EXPECT_FALSE(world.Load(content, "p.world")); });
  EXPECT_EQ(errors.rfind("p.world:1:", 0), 0U) << errors;
  EXPECT_NE(errors.find("of 100 models, expected fewer models, a larger area or a smaller gap"),
            std::string::npos)
      << errors;
}

/// Loaded, reset and copied worlds with the same seed are equal.
TEST_F(PopulationsTest, DoNotDependOnTheHistory) {
  for (uint64_t seed = 0; seed < (kSanitized ? 4 : 40); seed++) {
    SCOPED_TRACE(seed);
    const std::string text = RandomWorld(seed);
    const std::unique_ptr<World> fresh = LoadText(text, seed), other = LoadText(text, seed + 1);
    World copy(OptionsOf(seed));
    ASSERT_TRUE(copy.LoadCopy(*other));
    Go(fresh.get(), seed, 0, kSteps);
    Go(other.get(), seed + 9, 0, kSteps);
    Go(&copy, seed, 0, kSteps);
    EXPECT_EQ(copy.StateHash(), fresh->StateHash()) << "a copy of a world with another seed";
    for (int round = 0; round < 3; round++) {
      ASSERT_TRUE(other->Reset(seed));
      Go(other.get(), seed, 0, kSteps);
      EXPECT_EQ(other->StateHash(), fresh->StateHash()) << "reset, round " << round;
      Go(other.get(), seed + 3, 0, 3);
    }
    World late(OptionsOf(seed));
    ASSERT_TRUE(late.LoadCopy(*other));
    Go(&late, seed, 0, kSteps);
    EXPECT_EQ(late.StateHash(), fresh->StateHash()) << "a copy of a reset world";
  }
}

/// A reset undoes all changes of a world.
TEST_F(PopulationsTest, ResetUndoesAllChanges) {
  for (uint64_t seed = 0; seed < (kSanitized ? 4 : 40); seed++) {
    SCOPED_TRACE(seed);
    const bool exact = seed % 3 == 0;
    const std::unique_ptr<World> fresh = LoadRobotsOfAllTypes(seed, exact),
                                 other = LoadRobotsOfAllTypes(seed + 1, exact);
    Go(fresh.get(), seed, 0, kSteps);
    for (int round = 0; round < 3; round++) {
      Go(other.get(), seed + 5, 0, kSteps);
      ASSERT_TRUE(other->Reset(seed));
      Go(other.get(), seed, 0, kSteps);
      EXPECT_EQ(other->StateHash(), fresh->StateHash()) << "round " << round;
    }
  }
}

TEST_F(PopulationsTest, WithAnyNumberOfThreads) {
  const std::string file = SourceFile("worlds/swarm.world");
  std::vector<uint64_t> hashes;
  for (const int threads : {1, 2, 5}) {
    RunOptions options = OptionsOf(7);
    options.threads = threads;
    options.settings = {"robots=40"};
    World world(options);
    ASSERT_TRUE(world.Load(file));
    for (int i = 0; i < kSteps; i++) world.Update();
    hashes.push_back(world.StateHash());
  }
  EXPECT_EQ(hashes[0], hashes[1]);
  EXPECT_EQ(hashes[0], hashes[2]);
}

}  // namespace
}  // namespace Stg
