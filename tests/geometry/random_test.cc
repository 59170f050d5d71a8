// SPDX-License-Identifier: GPL-2.0-or-later
//
// Streams of random numbers: each world and model has its own, independent of all others.

#include "random/random.hh"

#include <gtest/gtest.h>

#include <set>
#include <string>
#include <thread>
#include <vector>

#include "support/model_testing.hh"

namespace Stg {
namespace {

uint64_t First(Model* model) { return RandomStream(model->random()).Next(); }

/// Loads a world and returns the first random number of each model.
std::vector<uint64_t> FirstNumbers(const std::string& text, uint64_t seed = 1) {
  World::run_options.seed = seed;
  const auto world = LoadText(text);
  World::run_options.seed = 1;
  std::vector<uint64_t> numbers;
  for (Model* child : world->GetChildren()) {
    numbers.push_back(First(child));
    for (Model* grandchild : child->GetChildren()) numbers.push_back(First(grandchild));
  }
  return numbers;
}

// ---- the generator

TEST(RandomStreamTest, ChoosesEachNumberAsOften) {
  RandomStream random(3);
  std::vector<int> counts(7, 0);
  for (int i = 0; i < 70000; i++) counts.at(random.Choose(7))++;
  for (const int count : counts) EXPECT_NEAR(count, 10000, 400);
  EXPECT_EQ(random.Choose(1), 0u);
  EXPECT_EQ(random.Choose(0), 0u);
  for (int i = 0; i < 100; i++) EXPECT_LT(random.Choose(UINT32_MAX), UINT32_MAX);
}

// ---- streams of models

const std::string kRobots =
    "position( name \"a\" ranger( ) ranger( ) )\nposition( ranger( ) )\nmodel( )\n";

TEST(ModelRandomTest, AllModelsDifferAndRunsRepeat) {
  const std::vector<uint64_t> numbers = FirstNumbers(kRobots);
  EXPECT_EQ(std::set<uint64_t>(numbers.begin(), numbers.end()).size(), numbers.size());
  EXPECT_EQ(numbers, FirstNumbers(kRobots)) << "in a second world of the process";
}

TEST(ModelRandomTest, TheSeedChangesThemAll) {
  const std::vector<uint64_t> numbers = FirstNumbers(kRobots), others = FirstNumbers(kRobots, 2);
  for (size_t i = 0; i < numbers.size(); i++) EXPECT_NE(numbers[i], others[i]) << i;
}

TEST(ModelRandomTest, DoesNotDependOnNames) {
  std::string renamed = kRobots;
  renamed.replace(renamed.find("\"a\""), 3, "\"some other name\"");
  EXPECT_EQ(FirstNumbers(renamed), FirstNumbers(kRobots));
}

TEST(ModelRandomTest, ModelsWithEqualNamesDiffer) {
  const std::vector<uint64_t> numbers =
      FirstNumbers("position( name \"a\" ranger( ) ) position( name \"a\" ranger( ) )");
  EXPECT_EQ(std::set<uint64_t>(numbers.begin(), numbers.end()).size(), numbers.size());
}

TEST(ModelRandomTest, ARobotsSensorsChangeNothingForOtherRobots) {
  const auto one = LoadText("position( name \"a\" ) position( name \"b\" )");
  const auto other =
      LoadText("position( name \"a\" ranger( ) blobfinder( ) ) position( name \"b\" )");
  EXPECT_EQ(First(one->GetModel("b")), First(other->GetModel("b")));
}

TEST(ModelRandomTest, RecreatedModelHasNewNumbers) {
  const auto world = EmptyWorld();
  Model* first = world->CreateModel(nullptr, "position");
  const uint64_t number = First(first);
  delete first;
  EXPECT_NE(First(world->CreateModel(nullptr, "position")), number);
}

TEST(ModelRandomTest, DoesNotDependOnOtherModels) {
  const auto quiet = LoadText(kRobots), busy = LoadText(kRobots);
  for (Model* child : busy->GetChildren())
    if (child->TokenStr() != "a") child->random().Next();
  busy->random().Next();
  RandomStream::Current().Next();
  EXPECT_EQ(First(quiet->GetModel("a")), First(busy->GetModel("a")));
}

TEST(ModelRandomTest, ReloadedWorldsBeginAnew) {
  const auto world = LoadText(kRobots);
  const uint64_t number = First(world->GetModel("a")), of_world = world->random().Next();
  world->GetModel("a")->random().Next();
  std::istringstream content(kRobots);
  ASSERT_TRUE(world->Load(content, "t.world"));
  EXPECT_EQ(First(world->GetModel("a")), number);
  EXPECT_EQ(world->random().Next(), of_world);
}

// ---- noise

// Robots copied with their names used to have identical noise.
TEST(NoiseTest, RangersWithEqualNamesDiffer) {
  const std::string robot =
      "] ranger( pose [0 0 -0.5 0] alwayson 1 sensor( range [0 8] samples 1 noise [0.1 0 0] ) ) "
      ")\n";
  const std::string text =
      "model( size [0.2 20 1] pose [3 0 0 0] )\nposition( name \"a\" pose [0 0 0 0" + robot +
      "position( name \"a\" pose [0 3 0 0" + robot;
  const auto world = LoadText(text);
  Step(*world);
  std::vector<double> ranges;
  for (Model* child : world->GetChildren())
    for (Model* below : child->GetChildren())
      ranges.push_back(static_cast<ModelRanger*>(below)->GetSensors()[0].ranges.at(0));
  ASSERT_EQ(ranges.size(), 2u);
  EXPECT_LT(ranges[0], 4) << "the wall";
  EXPECT_LT(ranges[1], 4) << "the wall";
  EXPECT_NE(ranges[0], ranges[1]);
}

// ---- functions without a stream argument

/// Random poses drawn in a callback.
struct Draws {
  std::vector<Pose> poses;
  static int Draw(Model*, void* user) {
    static_cast<Draws*>(user)->poses.push_back(Pose::Random(0, 1, 0, 1));
    return 0;
  }
};

TEST(CurrentRandomTest, IsTheModelsStreamInItsCallbacks) {
  const auto world = LoadText("model( name \"m\" alwayson 1 )");
  Model* model = world->GetModel("m");
  RandomStream expected(model->random());
  Draws draws;
  model->AddCallback(Model::CB_UPDATE, Draws::Draw, &draws);
  Step(*world, 3);
  ASSERT_EQ(draws.poses.size(), 3u);
  for (const Pose& pose : draws.poses) EXPECT_EQ(pose, Pose::Random(expected, 0, 1, 0, 1));
}

TEST(CurrentRandomTest, IsTheModelsStreamInItsEvents) {
  const auto world = LoadText("model( name \"m\" )");
  RandomStream expected(world->GetModel("m")->random());
  Draws draws;
  world->Enqueue(0, 1, world->GetModel("m"), Draws::Draw, &draws);
  Step(*world);
  ASSERT_EQ(draws.poses.size(), 1u);
  EXPECT_EQ(draws.poses[0], Pose::Random(expected, 0, 1, 0, 1));
}

TEST(CurrentRandomTest, IsTheWorldsStreamInItsCallbacks) {
  const auto world = EmptyWorld();
  RandomStream expected(world->random());
  static Color drawn;
  world->AddUpdateCallback(
      [](World*, void*) {
        drawn = Color::RandomColor();
        return 0;
      },
      nullptr);
  Step(*world);
  EXPECT_EQ(drawn, Color::RandomColor(expected));
}

TEST(CurrentRandomTest, ColoursInWorldFilesUseTheModelsStream) {
  const auto world = LoadText("model( name \"a\" color \"random\" ) model( color \"random\" )");
  const auto alone = LoadText("model( name \"a\" color \"random\" )");
  EXPECT_EQ(world->GetModel("a")->GetColor(), alone->GetModel("a")->GetColor());
  EXPECT_NE(world->GetModel("a")->GetColor(), world->GetModel("model:2")->GetColor());
}

TEST(CurrentRandomTest, SurvivesDeletionOfTheModelInACallback) {
  const auto world = LoadText("model( name \"m\" alwayson 1 )");
  RandomStream expected(world->random());
  static double drawn;
  world->GetModel("m")->AddCallback(
      Model::CB_UPDATE,
      [](Model* model, void*) {
        delete model;
        drawn = RandomStream::Current().Uniform();
        return 0;
      },
      nullptr);
  Step(*world);
  EXPECT_EQ(drawn, expected.Uniform()) << "the world's";
}

TEST(CurrentRandomTest, IsTheThreadsStreamOtherwise) {
  RandomStream::SeedThreads(5);
  uint64_t there = 0;
  std::thread([&] { there = RandomStream::Current().Next(); }).join();
  EXPECT_EQ(there, RandomStream(5).Next());
  EXPECT_EQ(RandomStream::Current().Next(), there) << "each thread has its own";
}

// ---- the C library's generator

TEST(LibraryTest, LeavesTheGeneratorsOfTheProcessAlone) {
  srand48(7);
  srandom(7);
  const double first = drand48();
  const long second = random();
  srand48(7);
  srandom(7);
  Init(nullptr, nullptr);
  const auto world =
      LoadText("position( color \"random\" ranger( alwayson 1 sensor( noise [1 1 1] ) ) )");
  Step(*world, 3);
  EXPECT_EQ(drand48(), first);
  EXPECT_EQ(random(), second);
}

}  // namespace
}  // namespace Stg
