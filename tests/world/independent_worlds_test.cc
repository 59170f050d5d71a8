// SPDX-License-Identifier: GPL-2.0-or-later
//
// Worlds are independent: several threads create, load, run, reset and delete their own worlds at
// the same time, with the same results as alone.

#include <gtest/gtest.h>

#include <algorithm>
#include <clocale>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "support/device.hh"
#include "support/emulated.hh"
#include "support/model_testing.hh"
#include "support/sanitized.hh"
#include "support/shipped_worlds.hh"

namespace Stg {
namespace {

namespace fs = std::filesystem;

constexpr int kSteps = kSanitized ? 4 : 20;

RunOptions OptionsOf(uint64_t seed, bool listed) {
  RunOptions options;
  options.seed = seed;
  options.listed = listed;
  return options;
}

uint64_t HashAfterRun(World* world) {
  for (int i = 0; i < kSteps; i++) world->Update();
  return world->StateHash();
}

uint64_t HashAlone(const std::string& file, uint64_t seed) {
  World world(OptionsOf(seed, false));
  EXPECT_TRUE(world.Load(file)) << file;
  return HashAfterRun(&world);
}

class IndependentWorlds : public testing::Test {
 protected:
  static void SetUpTestSuite() { InitLibrary(); }
};

TEST_F(IndependentWorlds, RunOnEightThreadsAsAlone) {
  const std::vector<std::string> files = ShippedWorlds();
  ASSERT_GT(files.size(), 10u);
  std::vector<uint64_t> alone;
  for (const std::string& file : files) alone.push_back(HashAlone(file, 5));

  constexpr size_t kThreads = 8;
  std::vector<std::vector<uint64_t>> hashes(kThreads, std::vector<uint64_t>(files.size()));
  std::vector<std::vector<uint64_t>> reset = hashes;
  const auto work = [&](size_t thread) {
    for (size_t i = 0; i < files.size(); i++) {
      const size_t file = (i + thread * 3) % files.size();
      World world(OptionsOf(5, thread % 2 == 0));
      if (!world.Load(files[file])) return;
      hashes[thread][file] = HashAfterRun(&world);
      if (!world.Reset(9)) return;
      world.Update();
      if (!world.Reset(5)) return;
      reset[thread][file] = HashAfterRun(&world);
    }
  };
  std::vector<std::thread> threads;
  for (size_t thread = 0; thread < kThreads; thread++) threads.emplace_back(work, thread);
  for (std::thread& thread : threads) thread.join();
  for (size_t thread = 0; thread < kThreads; thread++) {
    EXPECT_EQ(hashes[thread], alone) << thread;
    EXPECT_EQ(reset[thread], alone) << thread;
  }
}

TEST_F(IndependentWorlds, ResetRestoresTheInitialState) {
  for (const std::string& file : ShippedWorlds()) {
    std::map<uint64_t, uint64_t> anew;
    for (const uint64_t seed : {1, 2}) anew[seed] = HashAlone(file, seed);
    World world(OptionsOf(1, true));
    ASSERT_TRUE(world.Load(file));
    std::map<std::string, uint32_t> numbers;
    for (const Model* model : world.GetAllModels()) numbers[model->TokenStr()] = model->GetId();
    world.Update();
    for (const uint64_t seed : {1, 2, 1}) {
      ASSERT_TRUE(world.Reset(seed));
      EXPECT_EQ(world.SimTimeNow(), 0u);
      EXPECT_EQ(world.seed(), seed);
      for (const Model* model : world.GetAllModels())
        EXPECT_EQ(numbers[model->TokenStr()], model->GetId()) << model->TokenStr();
      EXPECT_EQ(HashAfterRun(&world), anew[seed]) << file << " " << seed;
    }
  }
}

std::vector<std::string> ThreadsOfProcess() {
  std::vector<std::string> threads;
  for (const auto& entry : fs::directory_iterator("/proc/self/task"))
    threads.push_back(entry.path().filename());
  std::sort(threads.begin(), threads.end());
  return threads;
}

TEST_F(IndependentWorlds, ResetKeepsTheDeviceAndTheThreads) {
  if (const std::string reason = device::WhyNone(); !reason.empty()) GTEST_SKIP() << reason;
  const std::string file = SourceFile("worlds/cave.world");
  const uint64_t on_host = HashAlone(file, 1);
  RunOptions options = OptionsOf(1, true);
  options.opencl = options.always_on_device = true;
  World world(options);
  ASSERT_TRUE(world.Load(file));
  EXPECT_EQ(HashAfterRun(&world), on_host);
  const uint64_t sent = world.statistics().prefilter.bytes_sent;
  const std::vector<std::string> threads = ThreadsOfProcess();
  for (int i = 0; i < 3; i++) {
    ASSERT_TRUE(world.Reset(1));
    EXPECT_EQ(HashAfterRun(&world), on_host);
    EXPECT_NE(world.statistics().device, "");
  }
  EXPECT_GT(world.statistics().prefilter.bytes_sent, sent) << "another device counts anew";
  EXPECT_EQ(ThreadsOfProcess(), threads);
}

TEST_F(IndependentWorlds, OneUsesTheThreadsAndTheDeviceOfAnother) {
  RunOptions options = OptionsOf(1, true);
  options.threads = 2;
  const bool has_device = device::WhyNone().empty();
  options.opencl = options.always_on_device = has_device;
  auto lender = std::make_unique<World>(options);
  const std::vector<std::string> files = ShippedWorlds();
  ASSERT_TRUE(lender->Load(files.front()));
  HashAfterRun(lender.get());
  const std::vector<std::string> threads = ThreadsOfProcess();
  std::vector<std::unique_ptr<World>> worlds;
  for (const std::string& file : files) {
    worlds.push_back(std::make_unique<World>(OptionsOf(1, true)));
    World& world = *worlds.back();
    world.UseThreadsAndDeviceOf(*lender);
    ASSERT_TRUE(world.Load(file));
    EXPECT_EQ(world.statistics().threads, 2u);
    EXPECT_EQ(world.statistics().device, lender->statistics().device);
    EXPECT_EQ(ThreadsOfProcess(), threads) << file;
  }
  lender.reset();
  for (size_t i = 0; i < files.size(); i++) {
    EXPECT_EQ(HashAfterRun(worlds[i].get()), HashAlone(files[i], 1)) << files[i];
    ASSERT_TRUE(worlds[i]->Reset(1));
    EXPECT_EQ(HashAfterRun(worlds[i].get()), HashAlone(files[i], 1)) << files[i];
    if (has_device && worlds[i]->statistics().trace.rays > 0) {
      EXPECT_GT(worlds[i]->statistics().device_steps, 0u) << files[i];
    }
  }
}

TEST_F(IndependentWorlds, ResetTakesTheFileAsItWasRead) {
  const fs::path path = fs::temp_directory_path() / ("stage-reset-" + std::to_string(getpid()));
  const auto write = [&](const char* text) { std::ofstream(path) << text; };
  write("position( name \"r\" pose [1 2 0 0] )");
  World world(OptionsOf(1, false));
  ASSERT_TRUE(world.Load(path.string()));
  Find(world, "r")->SetPose(Pose(5, 5, 0, 0));
  ASSERT_TRUE(world.Save(nullptr));
  write("nothing that can be read");
  ASSERT_TRUE(world.Reset(1));
  EXPECT_EQ(Find(world, "r")->GetPose(), Pose(1, 2, 0, 0));
  fs::remove(path);
}

TEST_F(IndependentWorlds, ResetNeedsAWorldThatIsAtRest) {
  World world(OptionsOf(1, false));
  EXPECT_NE(ErrorsOf([&] { EXPECT_FALSE(world.Reset(1)); }).find("before it is loaded"),
            std::string::npos);
  ASSERT_TRUE(TryToLoad(&world, "position( name \"r\" alwayson 1 )").loaded);
  Find(world, "r")
      ->AddCallback(
          Model::CB_UPDATE,
          [](Model* model, void*) {
            EXPECT_FALSE(model->GetWorld()->Reset(1));
            return 0;
          },
          nullptr);
  EXPECT_NE(ErrorsOf([&] { Step(world, 2); }).find("by a callback"), std::string::npos);
  EXPECT_TRUE(world.Reset(1));
}

double MemoryKb() {
  std::ifstream in("/proc/self/status");
  for (std::string line; std::getline(in, line);)
    if (line.starts_with("VmRSS:")) return std::atof(line.c_str() + 6);
  return 0;
}

/// A single small allocation that each reset leaves behind takes 32 bytes, 720 kB in all.
TEST_F(IndependentWorlds, TwentyFiveThousandResetsTakeNoMemory) {
  World world(OptionsOf(1, true));
  ASSERT_TRUE(TryToLoad(&world,
                        "model( size [4 0.2 1] pose [2 0 0 90] )\n"
                        "position( name \"r\" joules 100 ctrl \"wander\" localization \"odom\""
                        "  ranger( sensor( range [0 3] fov 90 samples 16 noise [0.1 0.1 1] ) ) )")
                  .loaded);
  constexpr int kResets = kSanitized ? 1000 : 25000;
  double before = 0;
  uint64_t first = 0;
  for (int i = 0; i < kResets; i++) {
    ASSERT_TRUE(world.Reset(3));
    for (int k = 0; k < 2; k++) world.Update();
    if (i == 0) first = world.StateHash();
    if (i == kResets / 10) before = MemoryKb();
  }
  EXPECT_EQ(world.StateHash(), first);
  if (!kSanitized && !test::IsEmulated()) {
    EXPECT_LT(MemoryKb() - before, 500);
  }
}

TEST_F(IndependentWorlds, UnlistedWorldsDoNotAffectOthers) {
  const double stored = PowerPack::global_stored;
  World alone(OptionsOf(1, false)), listed;
  for (World* world : {&alone, &listed})
    ASSERT_TRUE(TryToLoad(world, "model( name \"m\" joules 5 )").loaded);
  EXPECT_TRUE(World::Exists(&alone));
  EXPECT_EQ(Model::LookupId(Find(alone, "m")->GetId()), Find(listed, "m"));
  EXPECT_EQ(alone.energy_totals().stored, 5);
  EXPECT_EQ(listed.energy_totals().stored, 5);
  EXPECT_NEAR(PowerPack::global_stored - stored, 5, 1e-6);
  EXPECT_FALSE(World::UpdateAll());
  EXPECT_EQ(alone.UpdateCount(), 0u);
  EXPECT_EQ(listed.UpdateCount(), 1u);
  listed.QuitAll();
  EXPECT_TRUE(listed.TestQuit());
  EXPECT_FALSE(alone.TestQuit());
  listed.CancelQuitAll();
}

TEST_F(IndependentWorlds, ReportTheirOwnErrors) {
  World world(OptionsOf(1, false)), other(OptionsOf(1, false));
  TryToLoad(&world, "model( poze [1 2 3 4] )");
  ASSERT_EQ(world.LoadMessages().size(), 1u);
  EXPECT_NE(world.LoadMessages()[0].find("t.world:1:8: warning: property \"poze\""),
            std::string::npos);
  TryToLoad(&world, "model( pose [1 x 3 4] )");
  ASSERT_EQ(world.LoadMessages().size(), 1u);
  EXPECT_TRUE(world.LoadMessages()[0].starts_with("t.world:1:")) << world.LoadMessages()[0];
  EXPECT_TRUE(other.LoadMessages().empty());
  TryToLoad(&world, "model( )");
  EXPECT_TRUE(world.LoadMessages().empty());
}

TEST(Process, KeepsItsLocaleAndItsOutput) {
  std::setlocale(LC_ALL, "C.UTF-8");
  const std::string before = std::setlocale(LC_ALL, nullptr);
  EXPECT_NE(before, "C");
  EXPECT_EQ(OutputOf([] {
              Init(nullptr, nullptr);
              World world;
              world.Load(SourceFile("worlds/cave.world"));
              world.ShowClock(true);
              world.Update();
            }),
            "");
  EXPECT_EQ(std::setlocale(LC_ALL, nullptr), before);
  std::setlocale(LC_ALL, "C");
}

}  // namespace
}  // namespace Stg
