// SPDX-License-Identifier: GPL-2.0-or-later
//
// The way a world is run must not change its results: neither the number of threads, nor batches of
// rays, nor a device, nor earlier runs in the same process.

#include <gtest/gtest.h>

#include <cinttypes>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "stage.hh"
#include "support/device.hh"
#include "support/random_world.hh"
#include "support/sanitized.hh"

namespace {

using random_world::Outcome;
using random_world::WorldText;
using Stg::RunOptions;

constexpr uint64_t kWorlds = kSanitized ? 30 : 40;

std::string FromEnvironment(const char* name) {
  const char* value = std::getenv(name);
  return value ? value : "";
}

/// The reference for all comparisons: one thread, batches, no device.
RunOptions Plain() {
  RunOptions options;
  options.threads = 1;
  return options;
}

RunOptions WithThreads(int threads) {
  RunOptions options = Plain();
  options.threads = threads;
  options.share_from = 1;  // use all threads although these worlds are small
  return options;
}

RunOptions RayByRay() {
  RunOptions options = Plain();
  options.batch = false;
  return options;
}

RunOptions OnDevice() {
  RunOptions options = Plain();
  options.opencl = options.always_on_device = true;
  return options;
}

/// The first step after which two runs differ; 0: at the beginning; -1: none.
int FirstDifference(const Outcome& a, const Outcome& b) {
  if (a.hashes.size() != b.hashes.size()) return 0;
  for (size_t i = 0; i < a.hashes.size(); i++)
    if (a.hashes[i] != b.hashes[i]) return static_cast<int>(i);
  return -1;
}

/// Writes the text of a world that failed to a file, and returns its description.
std::string Keep(const WorldText& world) {
  const std::string path =
      testing::TempDir() + "stage-exactness-" + std::to_string(world.seed()) + ".world";
  std::ofstream(path) << world.text();
  return "seed " + std::to_string(world.seed()) + ", world file " + path;
}

void ExpectSame(const WorldText& world, const Outcome& expected, const Outcome& found) {
  const int step = FirstDifference(expected, found);
  if (step != -1) ADD_FAILURE() << "differs after step " << step << "; " << Keep(world);
}

// ---- random worlds ------------------------------------------------------------------------------

struct Mode {
  const char* name;
  RunOptions options;
};

/// Runs random worlds with Plain() options and in all these modes, and compares the results.
void CompareRandomWorlds(uint64_t worlds, const std::vector<Mode>& modes, bool early) {
  uint64_t hits = 0;
  for (uint64_t seed = 1; seed <= worlds && !testing::Test::HasFailure(); seed++) {
    const WorldText world(seed);
    const Outcome expected = RunWorld(world, Plain(), early);
    for (const Mode& mode : modes) {
      SCOPED_TRACE(mode.name);
      ExpectSame(world, expected, RunWorld(world, mode.options, early));
    }
    hits += expected.hits;
  }
  EXPECT_GT(hits, 1000 * worlds) << "too little to be seen in these worlds";
}

TEST(ExactnessTest, OnTheHost) {
  // The mode "again" runs after other worlds in the same process.
  CompareRandomWorlds(kWorlds,
                      {{"2 threads", WithThreads(2)},
                       {"4 threads", WithThreads(4)},
                       {"ray by ray", RayByRay()},
                       {"again", Plain()}},
                      false);
}

TEST(ExactnessTest, PosesSetDuringUpdates) {
  CompareRandomWorlds(kWorlds / 3, {{"ray by ray", RayByRay()}}, true);
}

TEST(ExactnessTest, OnADevice) {
  if (const std::string reason = device::WhyNone(); !reason.empty()) GTEST_SKIP() << reason;
  uint64_t resumed = 0;
  for (uint64_t seed = 1; seed <= kWorlds && !HasFailure(); seed++) {
    const char* lengths[] = {"1", "2", "4"};
    setenv("STAGE_CL_HITS", lengths[seed % 3], 1);
    const WorldText world(seed);
    const Outcome expected = RunWorld(world, Plain());
    const Outcome found = RunWorld(world, OnDevice());
    ExpectSame(world, expected, found);
    EXPECT_EQ(expected.device_steps, 0u);
    EXPECT_EQ(expected.rays, found.rays);
    EXPECT_GT(found.device_steps, 0u) << Keep(world);
    resumed += found.resumed;
  }
  unsetenv("STAGE_CL_HITS");
  EXPECT_GT(resumed, 0u);
}

TEST(ExactnessTest, RangesOfADevice) {
  if (const std::string reason = device::WhyNone(); !reason.empty()) GTEST_SKIP() << reason;
  uint64_t given = 0, others = 0;
  for (uint64_t seed = 1; seed <= 3 * kWorlds && !HasFailure(); seed++) {
    const WorldText world(seed, WorldText::Returns::kUniform);
    const bool early = seed % 4 == 0;
    const Outcome expected = RunWorld(world, Plain(), early);
    RunOptions options = OnDevice();
    options.threads = 1 + static_cast<int>(seed % 3);
    const Outcome found = RunWorld(world, options, early);
    ExpectSame(world, expected, found);
    EXPECT_EQ(expected.ranges_given, 0u);
    EXPECT_EQ(expected.rays, found.rays);
    given += found.ranges_given;
    others += found.rays - found.ranges_given;
  }
  EXPECT_GT(given, 100 * kWorlds);
  EXPECT_GT(others, 100 * kWorlds);
}

// ---- shipped worlds -----------------------------------------------------------------------------

struct Shipped {
  const char* name;
  uint64_t steps;
};

class ShippedWorlds : public testing::TestWithParam<Shipped> {
 protected:
  std::string Path() const {
    return FromEnvironment("STAGE_SOURCE_DIR") + "/worlds/" + GetParam().name;
  }
};

TEST_P(ShippedWorlds, GiveTheSameResultsInAllModes) {
  const uint64_t steps = GetParam().steps;
  const Outcome expected = random_world::RunFile(Path(), steps, Plain());
  EXPECT_GT(expected.hits, 0u);
  for (const RunOptions& options : {WithThreads(2), WithThreads(4), RayByRay()})
    EXPECT_EQ(FirstDifference(expected, random_world::RunFile(Path(), steps, options)), -1);
  if (const std::string reason = device::WhyNone(); !reason.empty()) GTEST_SKIP() << reason;
  for (const char* length : {"1", "2", "4"}) {
    setenv("STAGE_CL_HITS", length, 1);
    const Outcome found = random_world::RunFile(Path(), steps, OnDevice());
    EXPECT_EQ(FirstDifference(expected, found), -1) << length << " hits";
    EXPECT_GT(found.device_steps, 0u);
    EXPECT_EQ(found.ranges_given, 0u);
  }
  unsetenv("STAGE_CL_HITS");
  const Outcome found = random_world::RunFile(Path(), steps, OnDevice());
  EXPECT_EQ(FirstDifference(expected, found), -1) << "ranges";
  EXPECT_GT(found.ranges_given, found.rays / 2);
}

INSTANTIATE_TEST_SUITE_P(All, ShippedWorlds,
                         testing::Values(Shipped{"simple.world", 40}, Shipped{"cave.world", 8},
                                         Shipped{"hospital.world", 8}),
                         [](const auto& param) {
                           const std::string name = param.param.name;
                           return name.substr(0, name.find('.'));
                         });

// ---- readings of batches equal those of single rays ---------------------------------------------

bool StopsRangers(Stg::Model* candidate, const Stg::Model* finder, const void*) {
  return !candidate->IsRelated(finder) && !(candidate->vis.ranger_return < 0);
}

/// The expected readings of a sensor, by World::Raytrace(), which uses neither layers nor
/// self-masks.
struct Expected {
  uint32_t ranger;  // its id
  size_t sensor;
  std::vector<double> ranges, intensities;
};

Expected Foresee(Stg::World* world, const Stg::ModelRanger& ranger, size_t index) {
  const Stg::ModelRanger::Sensor& sensor = ranger.GetSensors()[index];
  Stg::Pose origin = ranger.GetGlobalPose() + ranger.GetGeom().pose + sensor.pose;
  origin.z += sensor.size.z / 2;
  std::vector<Stg::RaytraceResult> results(sensor.sample_count);
  const Stg::RayModel of_world = world->GetRayModel();
  world->SetRayModel(sensor.ray_model);
  world->Raytrace(origin, sensor.range.max, sensor.fov, StopsRangers, &ranger, nullptr, true,
                  results);
  world->SetRayModel(of_world);
  Expected expected{ranger.GetId(), index, {}, {}};
  for (const Stg::RaytraceResult& result : results) {
    expected.ranges.push_back(result.range);
    expected.intensities.push_back(result.mod ? result.mod->vis.ranger_return : 0);
  }
  return expected;
}

std::vector<Stg::ModelRanger*> RangersOf(const Stg::World& world) {
  std::vector<Stg::ModelRanger*> rangers;
  for (Stg::Model* model : world.GetAllModels())
    if (auto* ranger = dynamic_cast<Stg::ModelRanger*>(model)) rangers.push_back(ranger);
  return rangers;
}

int CountUpdate(Stg::Model* model, void* counts) {
  (*static_cast<std::map<uint32_t, int>*>(counts))[model->GetId()]++;
  return 0;
}

bool IsExact(const Stg::ModelRanger::Sensor& s) {
  return s.angle_noise == 0 && s.range_noise == 0 && s.range_noise_const == 0 && !s.blind_near &&
         s.loss == 0 && s.range_step == 0 && s.time_increment == 0 && s.steepest >= M_PI / 2;
}

/// Makes a step and compares readings; returns their number.
size_t CompareStep(Stg::World* world) {
  std::map<uint32_t, int> updates;
  std::vector<Expected> expected;
  for (Stg::ModelRanger* ranger : RangersOf(*world)) {
    ranger->AddCallback(Stg::Model::CB_UPDATE, CountUpdate, &updates);
    for (size_t i = 0; i < ranger->GetSensors().size(); i++) {
      if (IsExact(ranger->GetSensors()[i])) expected.push_back(Foresee(world, *ranger, i));
    }
  }
  {
    const random_world::Quiet quiet;
    world->Update();
  }
  size_t compared = 0;
  for (Stg::ModelRanger* ranger : RangersOf(*world)) {
    ranger->RemoveCallback(Stg::Model::CB_UPDATE, CountUpdate);
    if (updates[ranger->GetId()] == 0) continue;
    for (const Expected& e : expected) {
      if (e.ranger != ranger->GetId()) continue;
      const Stg::ModelRanger::Sensor& s = ranger->GetSensors()[e.sensor];
      EXPECT_EQ(s.ranges, e.ranges) << ranger->TokenStr() << ", sensor " << e.sensor;
      EXPECT_EQ(s.intensities, e.intensities) << ranger->TokenStr() << ", sensor " << e.sensor;
      compared += e.ranges.size();
    }
  }
  return compared;
}

bool LoadQuietly(Stg::World* world, const std::string& text) {
  const random_world::Quiet quiet;
  std::istringstream stream(text);
  return world->Load(stream);
}

TEST(ExactnessTest, ReadingsAreThoseOfSingleRays) {
  Stg::Init(nullptr, nullptr);
  size_t compared = 0;
  for (uint64_t seed = 301; seed <= 300 + kWorlds / 2 && !HasFailure(); seed++) {
    const WorldText text(seed);
    random_world::Driver driver(seed, text.resolution(), false);
    Stg::World world;
    ASSERT_TRUE(LoadQuietly(&world, text.text()));
    driver.Attach(&world);
    for (uint64_t step = 0; step < text.steps() && !HasFailure(); step++)
      compared += CompareStep(&world);
    EXPECT_FALSE(HasFailure()) << Keep(text) << ", step " << world.GetUpdateCount();
  }
  EXPECT_GT(compared, 1000 * kWorlds);
}

// ---- other processes, other seeds ---------------------------------------------------------------

/// The line with the state hash that the program prints for a world.
std::string HashFromProgram(const std::string& world, const std::string& options) {
  const std::string command = FromEnvironment("STAGE_BINARY_DIR") + "/bin/stage -g --state-hash " +
                              options + " '" + world + "'";
  FILE* pipe = popen(command.c_str(), "r");
  if (!pipe) return "";
  std::string text;
  for (char line[256]; std::fgets(line, sizeof line, pipe);)
    if (std::string(line).starts_with("state-hash ")) text = line;
  pclose(pipe);
  return text;
}

/// Writes a world with all kinds of noise and wandering robots.
std::string WriteNoisyWorld() {
  std::string path = testing::TempDir() + "stage-exactness-noise.world";
  std::ofstream out(path);
  out << "define eye ranger( alwayson 1 sensor( range [0 9] fov 200 samples 40"
         " noise [0.01 0.1 30] ) )\n"
         "model( size [12 12 1] )\n";
  for (int i = 0; i < 8; i++)
    out << "position( alwayson 1 localization \"odom\" pose [" << i % 4 * 2 - 3 << " "
        << i / 4 * 2 - 1 << " 0 " << 40 * i
        << "] ctrl \"wander\" eye() eye( pose [0 0 -0.5 0] ) )\n";
  return path;
}

TEST(ExactnessTest, OtherProcessesGiveTheSame) {
  const std::string world = WriteNoisyWorld();
  const std::string hash = HashFromProgram(world, "--duration 4 --seed 5");
  ASSERT_NE(hash, "");
  EXPECT_EQ(HashFromProgram(world, "--duration 4 --seed 5"), hash);
  EXPECT_EQ(HashFromProgram(world, "--duration 4 --seed 5 --threads 3 --no-batch"), hash);
  EXPECT_EQ(HashFromProgram(world, "--duration 4 --seed 5 --threads 2 --opencl 2>&1"), hash);

  RunOptions options = Plain();
  options.seed = 5;
  const Outcome here = random_world::RunFile(world, 40, options);
  char line[64];
  std::snprintf(line, sizeof line, "state-hash %016" PRIx64 "\n", here.hashes.back());
  EXPECT_EQ(hash, line);
}

TEST(ExactnessTest, OtherSeedsGiveOtherNoise) {
  const std::string world = WriteNoisyWorld();
  RunOptions options = Plain();
  options.seed = 5;
  const Outcome five = random_world::RunFile(world, 3, options);
  options.seed = 6;
  const Outcome six = random_world::RunFile(world, 3, options);
  EXPECT_NE(five.hashes.front(), six.hashes.front()) << "the seeds are part of the state";
  EXPECT_NE(five.hashes.back(), six.hashes.back());
}

}  // namespace
