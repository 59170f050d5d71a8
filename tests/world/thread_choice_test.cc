// SPDX-License-Identifier: GPL-2.0-or-later
//
// The choice of the number of threads for a step, if the user has not set it.

#include "world/phases/thread_choice.hh"

#include <gtest/gtest.h>

#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include "support/model_testing.hh"
#include "support/shipped_worlds.hh"
#include "threads/processors.hh"
#include "world/engine.hh"
#include "world/ray_caster.hh"

namespace Stg {
namespace {

/// The number of steps, out of `steps`, that use all threads.
int CountShared(ThreadChoice* choice, int steps, size_t models, double alone, double shared) {
  int count = 0;
  for (int i = 0; i < steps; i++) {
    const bool all = choice->UseAll(models);
    count += all;
    choice->Report(all ? shared : alone);
  }
  return count;
}

TEST(ThreadChoice, ShortStepsNeverWakeThreads) {
  ThreadChoice choice;
  EXPECT_EQ(CountShared(&choice, 1000, 10, 0.9 * ThreadChoice::kWorthThreads, 1e-9), 0);
}

TEST(ThreadChoice, IgnoresASlowFirstStep) {
  ThreadChoice choice;
  EXPECT_FALSE(choice.UseAll(10));
  choice.Report(1);
  EXPECT_EQ(CountShared(&choice, 1000, 10, 10e-6, 1e-9), 0);
}

TEST(ThreadChoice, LongStepsUseTheFasterChoice) {
  ThreadChoice faster, slower;
  EXPECT_GT(CountShared(&faster, 1000, 10, 1e-3, 0.3e-3), 950);
  EXPECT_LT(CountShared(&slower, 1000, 10, 1e-3, 3e-3), 50);
}

/// Sensors with different intervals alternate large and small steps, which are measured separately.
TEST(ThreadChoice, MeasuresSizesSeparately) {
  ThreadChoice choice;
  int large = 0, small = 0;
  for (int i = 0; i < 500; i++) {
    large += CountShared(&choice, 1, 1000, 1e-3, 0.3e-3);
    small += CountShared(&choice, 1, 10, 20e-6, 1e-9);
  }
  EXPECT_GT(large, 450);
  EXPECT_EQ(small, 0);
}

class ChosenThreads : public testing::Test {
 protected:
  static void SetUpTestSuite() { InitLibrary(); }

  static std::unique_ptr<World> Load(const char* file, int threads) {
    RunOptions options;
    options.threads = threads;
    options.listed = false;
    auto world = std::make_unique<World>(options);
    EXPECT_TRUE(world->Load(SourceFile(std::string("worlds/") + file)));
    return world;
  }
};

TEST_F(ChosenThreads, AreAllProcessorsByDefault) {
  const std::unique_ptr<World> world = Load("hospital.world", 0);
  EXPECT_TRUE(world->engine().chooses_threads());
  EXPECT_EQ(world->engine().max_threads(), threads::CountUsableProcessors());
  EXPECT_EQ(world->engine().threads(), 1u) << "no thread is started before it pays";
  EXPECT_TRUE(Summarize(*world).chooses_threads);
  EXPECT_EQ(Load("hospital.world", 3)->engine().max_threads(), 3u);
  EXPECT_FALSE(Load("hospital.world", 3)->engine().chooses_threads());
}

/// The number of threads in a world file is kept, and is applied again when it is loaded again.
TEST_F(ChosenThreads, WorldFileTakesPrecedence) {
  World world;
  const auto load = [&world](const std::string& text) {
    std::istringstream file(text);
    ASSERT_TRUE(world.Load(file));
  };
  load("threads 2");
  EXPECT_EQ(world.engine().threads(), 2u);
  EXPECT_FALSE(world.engine().chooses_threads());
  load("");
  EXPECT_TRUE(world.engine().chooses_threads());
  load("threads 1");
  EXPECT_FALSE(world.engine().chooses_threads());
  EXPECT_EQ(world.engine().max_threads(), 1u);
}

/// The choice must not change results, even with more threads than processors.
TEST_F(ChosenThreads, ChangeNoResult) {
  for (const char* file : {"simple.world", "cave.world", "hospital.world"}) {
    const std::unique_ptr<World> chosen = Load(file, 0), alone = Load(file, 1);
    chosen->engine().ChooseThreads(7);
    for (int i = 0; i < 40; i++) {
      chosen->Update();
      alone->Update();
      ASSERT_EQ(chosen->StateHash(), alone->StateHash()) << file << ", step " << i;
    }
  }
}

TEST_F(ChosenThreads, ManyRaysAreCastByAll) {
  const std::unique_ptr<World> world = Load("hospital.world", 0);
  world->engine().ChooseThreads(3);
  const std::vector<Pose> poses(200, Pose(100, 60, 0, 0));
  std::vector<double> ranges(poses.size() * 60);
  for (const size_t rays : {3u, 60u}) {
    const std::vector<double> bearings(rays, 0.5);
    ASSERT_TRUE(RayCaster(world.get()).Cast(poses.data(), 200, bearings, 30, ranges.data()));
    EXPECT_EQ(world->engine().threads(), rays == 3 ? 1u : 3u);
  }
}

TEST_F(ChosenThreads, LongStepsTryAllThreads) {
  const std::unique_ptr<World> world = Load("hospital.world", 0);
  world->engine().ChooseThreads(3);
  for (int i = 0; i < 10; i++) world->Update();
  EXPECT_EQ(world->statistics().threads, 3u);
}

}  // namespace
}  // namespace Stg
