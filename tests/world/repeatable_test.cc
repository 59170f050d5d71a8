// SPDX-License-Identifier: GPL-2.0-or-later
//
// Runs are reproducible whatever else the process does: all shipped worlds, and a world for each
// stock controller (tests/data/controllers).

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "stage.hh"

namespace {

namespace fs = std::filesystem;

/// The number of steps to run; fewer for worlds whose robots plan ahead, which is slow.
int StepsOf(const fs::path& file) {
  return file.stem() == "corridor" || file.stem() == "what_if" ? 100 : 300;
}

/// The worlds whose state hash depends on random numbers.
const std::set<std::string> kRandom = {
    "corridor",  "dynamic", "fasr",     "fasr2",      "flocking",         "forage",
    "transport", "chain",   "foraging", "lasernoise", "pioneer_flocking", "leave",
    "simple",    "swarm",   "door",     "trail",      "wander",           "wander_accel",
    "what_if",   "zoo"};

fs::path Source() {
  const char* folder = std::getenv("STAGE_SOURCE_DIR");
  return folder ? folder : "..";
}

std::vector<fs::path> FilesIn(const fs::path& folder, const std::string& extension) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(Source() / folder))
    if (entry.path().extension() == extension) files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  return files;
}

std::vector<fs::path> AllWorlds() {
  std::vector<fs::path> worlds = FilesIn("worlds", ".world");
  const std::vector<fs::path> more = FilesIn("tests/data/controllers", ".world");
  worlds.insert(worlds.end(), more.begin(), more.end());
  return worlds;
}

std::unique_ptr<Stg::World> Run(const fs::path& file, uint64_t seed) {
  Stg::Init(nullptr, nullptr);
  Stg::RunOptions options;
  options.seed = seed;
  auto world = std::make_unique<Stg::World>(options);
  const bool loaded = world->Load(file.string());
  for (int i = 0; loaded && i < StepsOf(file); i++) world->Update();
  EXPECT_TRUE(loaded) << file;
  return world;
}

uint64_t HashOf(const fs::path& file) { return Run(file, 1)->StateHash(); }

/// The final poses and readings. The state hash is not used, because it covers the seed itself.
std::vector<double> ResultOf(const fs::path& file, uint64_t seed) {
  const auto world = Run(file, seed);
  std::vector<double> result;
  world->ForEachDescendant(
      [](Stg::Model* model, void* user) {
        auto* numbers = static_cast<std::vector<double>*>(user);
        const Stg::Pose pose = model->GetGlobalPose();
        numbers->insert(numbers->end(), {pose.x, pose.y, pose.z, pose.a});
        if (const auto* ranger = dynamic_cast<Stg::ModelRanger*>(model))
          for (const auto& sensor : ranger->GetSensors())
            numbers->insert(numbers->end(), sensor.ranges.begin(), sensor.ranges.end());
        return 0;
      },
      &result);
  return result;
}

/// A thread that continuously draws numbers from all accessible random generators.
class Disturbance {
 public:
  Disturbance()
      : thread_([this] {
          while (!done_) {
            sum_ += rand() + static_cast<double>(random()) + drand48();
            sum_ += Stg::Pose::Random(0, 1, 0, 1).x + Stg::Color::RandomColor().r;
          }
        }) {}
  ~Disturbance() {
    done_ = true;
    thread_.join();
  }

 private:
  std::atomic<bool> done_{false};
  double sum_ = 0;
  std::thread thread_;
};

class Repeatable : public testing::TestWithParam<fs::path> {};

TEST_P(Repeatable, DoesNotDependOnGlobalGenerators) {
  const uint64_t expected = HashOf(GetParam());
  const Disturbance disturbance;
  EXPECT_EQ(HashOf(GetParam()), expected);
}

TEST_P(Repeatable, OnlyTheSeedMakesADifference) {
  const bool differs = ResultOf(GetParam(), 1) != ResultOf(GetParam(), 2);
  EXPECT_EQ(differs, kRandom.contains(GetParam().stem()));
}

INSTANTIATE_TEST_SUITE_P(Worlds, Repeatable, testing::ValuesIn(AllWorlds()), [](const auto& file) {
  const std::string folder = file.param.parent_path().filename().string();
  return folder + "_" + file.param.stem().string();
});

TEST(RepeatableWorlds, ThereIsOneForEachStockController) {
  std::set<std::string> controllers, worlds;
  for (const fs::path& file : FilesIn("examples/ctrl", ".cc")) controllers.insert(file.stem());
  for (const fs::path& file : FilesIn("tests/data/controllers", ".world"))
    worlds.insert(file.stem());
  EXPECT_EQ(worlds, controllers);
}

}  // namespace
