// SPDX-License-Identifier: GPL-2.0-or-later
//
// Branches of closed worlds have equal results with and without World objects, whatever is done
// with them.

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <bit>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <memory>
#include <regex>
#include <stdexcept>
#include <string>
#include <vector>

#include "rows/device_rows.hh"
#include "stage.hh"
#include "support/closed_world.hh"
#include "support/device.hh"
#include "support/host_row_device.hh"
#include "support/model_testing.hh"
#include "support/own_worlds.hh"
#include "support/random_source.hh"
#include "support/sanitized.hh"
#include "world/engine.hh"

namespace Stg {
namespace {

using test::ClosedWorldKind;
using test::RandomSource;

std::unique_ptr<World> LoadEndless(const std::string& text, uint64_t seed) {
  auto world = LoadText(text, seed);
  world->SetQuitTime(0);
  return world;
}

std::vector<uint32_t> IdsOf(const World& world) {
  std::vector<uint32_t> ids;
  for (const Model* model : world.engine().models) ids.push_back(model->GetId());
  return ids;
}

/// Commands that robots of a world obey, as far as their kinds are concerned.
std::vector<Command> ObeyedIn(const World& world) {
  std::vector<Command> commands;
  for (const Model* model : world.engine().models)
    for (const auto kind :
         {Command::kSetSpeed, Command::kGoTo, Command::kSetAcceleration, Command::kStop})
      if (model->GetModelType() == "position") commands.push_back({0, model->GetId(), kind, 1});
  BranchOptions options;
  options.rows = false;
  Branches branches(world, static_cast<uint32_t>(commands.size()), options);
  Snapshot now;
  EXPECT_TRUE(world.Take(&now));
  for (uint32_t i = 0; i < branches.count(); i++) {
    branches.Restore(i, now);
    branches.Give(i, commands[i]);
  }
  branches.Step(1);
  std::vector<Command> obeyed;
  for (uint32_t i = 0; i < branches.count(); i++)
    if (!branches[i].refused) obeyed.push_back(commands[i]);
  return obeyed;
}

/// A command that a robot obeys, if there is one, and now and then one that is refused.
Command RandomCommand(RandomSource* random, const std::vector<uint32_t>& models,
                      const std::vector<Command>& obeyed, uint64_t step) {
  const bool is_any = obeyed.empty() || random->OneIn(60);
  const Command::Kind kind = random->Pick<Command::Kind>(
      {Command::kSetSpeed, Command::kGoTo, Command::kSetAcceleration, Command::kStop});
  Command command = is_any ? Command(step, random->OneIn(20) ? 4000 : random->Pick(models), kind)
                           : random->Pick(obeyed);
  command.step = step;
  command.x = random->Real(-1, 1);
  command.y = random->Real(-1, 1);
  command.a = random->Real(-2, 2);
  if (random->OneIn(150)) command.y = std::numeric_limits<double>::quiet_NaN();
  if (random->OneIn(50) && command.kind != Command::kGoTo)
    command.x = std::numeric_limits<double>::infinity();
  return command;
}

/// Scores by all poses, and ends some branches. `needs_world`: it also looks at the World.
class Scorer : public Scenario {
 public:
  Scorer(size_t watched, bool needs_world) : watched_(watched), needs_world_(needs_world) {}

  bool NeedsWorld() const override { return needs_world_; }
  bool AfterStep(World& world, uint32_t branch, double* score) override {
    *score += static_cast<double>(world.UpdateCount() % 7 * branch);
    return world.UpdateCount() % 31 == 30 && branch % 4 == 1;
  }
  bool Watch(const Sighting* watched, uint32_t branch, double* score) override {
    if (branch % 19 == 18 && *score > 40) throw std::runtime_error("too good");
    size_t stalled = 0;
    for (size_t i = 0; i < watched_; i++) {
      *score += watched[i].pose.x + watched[i].pose.a * watched[i].velocity.x;
      stalled += watched[i].stalled;
    }
    return stalled > 0 && branch % 2 == 1;
  }

 private:
  const size_t watched_;
  const bool needs_world_;
};

/// Numbers of events, which show that the test does what it claims.
struct Happened {
  uint64_t steps_in_rows = 0, steps_on_device = 0, steps = 0;
  size_t restless = 0, ended = 0, failed = 0, refused = 0, chained = 0, visits = 0, stalls = 0,
         reseeded = 0;
};

/// Branches with rows, and the same without.
class Pair {
 public:
  Pair(const World& world, uint32_t count, BranchOptions options) : watched_(options.watched) {
    with_ = std::make_unique<Branches>(world, count, options);
    EXPECT_EQ(with_->StepDevice().empty(), !options.device_steps);
    options.rows = options.device_steps = false;
    options.threads = 1;
    without_ = std::make_unique<Branches>(world, count, options);
    EXPECT_EQ(with_->WhyNotClosed(), "");
    EXPECT_NE(without_->WhyNotClosed(), "");
  }

  uint32_t count() const { return with_->count(); }
  const Branch& operator[](uint32_t branch) const { return (*with_)[branch]; }
  uint64_t steps_in_rows() const { return with_->steps_in_rows(); }
  uint64_t steps_on_device() const { return with_->steps_on_device(); }
  /// Number of steps of all branches since they were restored.
  uint64_t steps() const {
    uint64_t sum = 0;
    for (uint32_t i = 0; i < count(); i++) sum += (*with_)[i].steps;
    return sum;
  }
  template <typename F>
  void InBoth(F act) {
    act(with_.get());
    act(without_.get());
  }
  /// Restores a branch from the state of another.
  void Chain(uint32_t from, uint32_t to, uint64_t seed) {
    InBoth([&](Branches* branches) {
      const Snapshot state = branches->StateOf(from);
      if (!state.empty()) branches->Restore(to, state, seed);
    });
  }

  /// Says what differs; empty if nothing does.
  std::string Difference(uint32_t i) const {
    const Branch &a = (*with_)[i], &b = (*without_)[i];
    if (a.state != b.state) return "the state: " + a.error + " / " + b.error;
    if (a.error != b.error) return "the error: " + a.error + " / " + b.error;
    if (a.refused != b.refused) return "whether a command was refused: " + a.error;
    if (a.steps != b.steps) return "the number of steps";
    if (a.sightings.size() != b.sightings.size()) return "the number of sightings";
    for (size_t s = 0; s < a.sightings.size(); s++)
      if (!IsSame(a.sightings[s], b.sightings[s]))
        return "sighting " + std::to_string(s) + " of " + std::to_string(watched_.size()) +
               " models";
    if (std::memcmp(&a.score, &b.score, sizeof a.score) != 0) return "the score";
    const Snapshot of_a = with_->StateOf(i), of_b = without_->StateOf(i);
    if (of_a.empty() != of_b.empty() || of_a.hash() != of_b.hash()) return "the state hash";
    return "";
  }

 private:
  static bool IsSame(const Sighting& a, const Sighting& b) {
    const double x[] = {a.pose.x,     a.pose.y,     a.pose.z,     a.pose.a,
                        a.velocity.x, a.velocity.y, a.velocity.z, a.velocity.a};
    const double y[] = {b.pose.x,     b.pose.y,     b.pose.z,     b.pose.a,
                        b.velocity.x, b.velocity.y, b.velocity.z, b.velocity.a};
    return std::equal(x, x + 8, y) && a.stalled == b.stalled;
  }

  const std::vector<uint32_t> watched_;
  std::unique_ptr<Branches> with_, without_;
};

/// Changes the world of a branch.
void Meddle(RandomSource* random, Pair* pair, uint32_t branch,
            const std::vector<uint32_t>& models) {
  const uint64_t number = random->Next();
  const uint32_t id = random->Pick(models);
  pair->InBoth([&](Branches* branches) {
    branches->Visit(branch, [&](World& world) {
      if (number % 3 == 0) world.Update();
      Model* const model = world.FindModel(id);
      if (number % 5 == 0 && model)
        model->SetPose(Pose(0.1 * static_cast<double>(number % 40) - 2, 1, 0, 1));
      if (number % 7 == 0) world.CreateModel(world.GetGround(), "model");
      if (number % 11 == 0) world.Reseed(number);
    });
  });
}

/// Does something with one or all branches.
void Act(RandomSource* random, Pair* pair, const std::vector<Snapshot>& snapshots,
         const std::vector<uint32_t>& models, Happened* happened) {
  const auto some = [&] { return static_cast<uint32_t>(random->Next() % pair->count()); };
  const uint32_t one = some();
  switch (random->Int(0, 7)) {
    case 0:
      happened->visits++;
      return Meddle(random, pair, one, models);
    case 1:
      happened->chained++;
      return pair->Chain(some(), one, random->Next());
    case 2:
      return pair->InBoth([&](Branches* branches) { branches->Retire(one); });
    case 3: {
      const auto count = static_cast<uint32_t>(random->Int(1, 40));
      return pair->InBoth([&](Branches* branches) { branches->Resize(count); });
    }
    default:
      for (uint32_t i = 0; i < pair->count(); i++) {
        if (random->OneIn(3)) continue;
        const Snapshot& from = random->Pick(snapshots);
        const uint64_t seed = random->Next();
        const bool reseeds = random->OneIn(2);
        happened->reseeded += reseeds;
        pair->InBoth([&](Branches* branches) {
          reseeds ? branches->Restore(i, from, seed) : branches->Restore(i, from);
        });
      }
  }
}

void GiveCommands(RandomSource* random, Pair* pair, const std::vector<uint32_t>& models,
                  const std::vector<Command>& obeyed) {
  for (uint32_t i = 0; i < pair->count(); i++)
    for (int k = random->Int(0, 4); k > 0; k--) {
      const Command command = RandomCommand(
          random, models, obeyed, (*pair)[i].steps + static_cast<uint64_t>(random->Int(0, 12)));
      pair->InBoth([&](Branches* branches) { branches->Give(i, command); });
    }
}

void CountEvents(const Pair& pair, Happened* happened) {
  for (uint32_t i = 0; i < pair.count(); i++) {
    happened->ended += pair[i].state == Branch::kEnded;
    happened->failed += pair[i].state == Branch::kFailed;
    happened->refused += pair[i].refused;
    for (const Sighting& sighting : pair[i].sightings) happened->stalls += sighting.stalled;
  }
}

/// A controller of a client that uses everything it gets, and now and then fails.
class Restless : public BatchController {
 public:
  std::shared_ptr<const ControllerParameters> Prepare(ControllerSetup* setup) const override {
    if (ModelRanger* const ranger = setup->FindUnusedRanger()) setup->Use(ranger);
    return nullptr;
  }
  static inline bool fails = true;

  size_t memory_size() const override { return 2; }
  bool needs_poses() const override { return true; }
  void Step(const ControllerBatch& batch) const override {
    for (size_t i = 0; i < batch.worlds * batch.robots; i++) Drive(batch, i);
  }

 private:
  static void Drive(const ControllerBatch& batch, size_t i) {
    const size_t world = i / batch.robots, robot = i % batch.robots;
    double* const memory = batch.memory + 2 * i;
    memory[0] += batch.time[world] + batch.random[i].Uniform(0, 0.1);
    for (size_t k = 0; k < batch.all_robots; k++)
      memory[1] += batch.all_poses[world * batch.all_robots + k].x;
    double nearest = 9;
    for (size_t s = 0; s < batch.robot[robot]->sensors.size(); s++)
      if (const double* const ranges = batch.RangesOf(world, robot, s))
        for (size_t k = 0; k < batch.robot[robot]->sensors[s].bearings.size(); k++)
          nearest = std::min(nearest, ranges[k]);
    if (batch.random[i].Choose(150) == 0 && fails) throw std::runtime_error("restless");
    if (batch.random[i].Choose(4) == 0) return;
    batch.command[i] = {batch.stalled[i] ? -0.2 : 0.1 * nearest + 0.01 * batch.estimate[i].x,
                        0.1 * batch.velocity[i].x, 0.3 * batch.sensed[i].a + memory[1] * 0.01};
  }
};

/// Gives the robots of a world file that have built-in controllers another one.
std::string WithRestless(const std::string& text) {
  return std::regex_replace(text, std::regex("stage/[^\"]*"), "restless");
}

/// Snapshots of a world at several times, taken while its robots drive.
std::vector<Snapshot> SnapshotsOf(World* world, RandomSource* random) {
  std::vector<Snapshot> snapshots;
  const std::vector<uint32_t> models = IdsOf(*world);
  Restless::fails = false;
  for (int i = 0; i < 4; i++) {
    Snapshot snapshot;
    EXPECT_TRUE(world->Take(&snapshot, random->OneIn(2) ? Snapshot::kLean : Snapshot::kFull));
    snapshots.push_back(snapshot);
    if (i == 2 && random->OneIn(2)) world->Reseed(random->Next());
    for (int k = random->Int(1, 6); k > 0; k--) {
      auto* const robot = dynamic_cast<ModelPosition*>(world->FindModel(random->Pick(models)));
      if (robot) robot->SetSpeed(random->Real(-1, 1), random->Real(-1, 1), random->Real(-2, 2));
      world->Update();
    }
  }
  Restless::fails = true;
  return snapshots;
}

void RunAtRandom(RandomSource* random, World* world, bool on_device, Happened* happened) {
  BranchOptions options;
  options.device_steps = on_device;
  options.threads = static_cast<unsigned>(random->Pick<int>({1, 2, 5}));
  options.keep = random->OneIn(2) ? Snapshot::kFull : Snapshot::kLean;
  const std::vector<uint32_t> models = IdsOf(*world);
  const std::vector<Command> obeyed = ObeyedIn(*world);
  options.watched = random->OneIn(3) ? std::vector<uint32_t>() : models;
  if (!options.watched.empty() || random->OneIn(3)) options.watched.push_back(4000);  // no such one
  Pair pair(*world, static_cast<uint32_t>(random->Pick<int>({1, 3, 33})), options);
  const std::vector<Snapshot> snapshots = SnapshotsOf(world, random);
  Scorer watcher(options.watched.size(), false), looker(options.watched.size(), true);
  for (int round = 0; round < 12; round++) {
    Act(random, &pair, snapshots, models, happened);
    if (random->OneIn(2)) GiveCommands(random, &pair, models, obeyed);
    Scenario* const scenario =
        random->Pick<Scenario*>({nullptr, nullptr, &watcher, &watcher, &watcher, &looker});
    const auto steps = static_cast<uint64_t>(random->Int(0, 9));
    const uint64_t before = pair.steps();
    pair.InBoth([&](Branches* branches) { branches->Step(steps, scenario); });
    happened->steps += pair.steps() - before;
    CountEvents(pair, happened);
    for (uint32_t i = 0; i < pair.count(); i++)
      ASSERT_EQ(pair.Difference(i), "") << "branch " << i << " in round " << round;
  }
  happened->steps_in_rows += pair.steps_in_rows();
  happened->steps_on_device += pair.steps_on_device();
}

/// Number of random worlds; more for a long search.
uint64_t Worlds() {
  const char* const wanted = std::getenv("STAGE_RANDOM_WORLDS");
  return wanted ? std::strtoull(wanted, nullptr, 10) : kSanitized ? 24 : 36;
}

void SubscribeToRobotsAndRangers(World* world) {
  for (Model* model : world->engine().models)
    if (model->GetModelType() == "position" || model->GetModelType() == "ranger")
      model->Subscribe();
}

/// Whether a device steps the rows.
class BranchesInRowsTest : public testing::TestWithParam<bool> {
 protected:
  void SetUp() override {
    if (GetParam() && !device::WhyNone().empty()) GTEST_SKIP() << device::WhyNone();
  }
};
INSTANTIATE_TEST_SUITE_P(HostAndDevice, BranchesInRowsTest, testing::Bool());

TEST_P(BranchesInRowsTest, EqualThoseWithWorlds) {
  InitLibrary();
  static const Restless controller;
  RegisterBatchController("restless", &controller);
  Happened happened;
  // Once, used worlds kept bearings of other snapshots, and rows had moved things in two places.
  std::vector<uint64_t> seeds = {716, 2138};
  for (uint64_t seed = 1; seed <= Worlds(); seed++) seeds.push_back(seed);
  for (const uint64_t seed : seeds) {
    RandomSource random(seed + (GetParam() ? 1000 : 0));
    const ClosedWorldKind kind{
        random.OneIn(GetParam() ? 6 : 2), random.OneIn(3), random.Int(1, 5), 3, random.OneIn(3),
        random.OneIn(GetParam() ? 9 : 3)};
    std::string text = ClosedWorld(kind, &random);
    if (GetParam() && random.OneIn(2)) text = WithRestless(text);
    SCOPED_TRACE("seed " + std::to_string(seed) + "\n" + text);
    const std::unique_ptr<World> world = LoadEndless(text, random.Next());
    happened.restless += text.find("restless") != std::string::npos;
    const uint64_t idle = random.OneIn(2) ? 0 : random.Next() & random.Next();
    if (GetParam() && !random.OneIn(5))
      SubscribeToRobotsAndRangers(world.get());  // other sensors keep a world from devices
    else
      test::SubscribeToMost(world.get(), idle);
    ASSERT_NO_FATAL_FAILURE(RunAtRandom(&random, world.get(), GetParam(), &happened));
  }
  const size_t scale = kSanitized ? 2000 : 1;  // a few worlds at least do each of it once
  EXPECT_GT(happened.steps, 10000u / scale);
  EXPECT_GT(happened.steps_in_rows, happened.steps * 7 / 10) << "of " << happened.steps;
  EXPECT_LT(happened.steps_in_rows, happened.steps);
  EXPECT_EQ(happened.steps_on_device > happened.steps_in_rows / 2, GetParam())
      << happened.steps_on_device << " of " << happened.steps_in_rows;
  EXPECT_GT(happened.ended, 100u / scale);
  EXPECT_GT(happened.failed - happened.refused, 20u / scale);
  EXPECT_GT(happened.refused, 20u / scale);
  EXPECT_GT(happened.chained, 20u / scale);
  EXPECT_GT(happened.visits, 20u / scale);
  EXPECT_GT(happened.stalls, 1000u / scale);
  EXPECT_GT(happened.reseeded, 200u / scale);
  EXPECT_EQ(happened.restless > (kSanitized ? 0 : 5), GetParam()) << happened.restless;
}

// ---- numbers of branches ------------------------------------------------------------------------

const char kTwoRobots[] =
    "resolution 0.05\ncontacts \"cells\"\n"
    "define bot position( alwayson 1 size [0.3 0.3 0.3] localization \"odom\" odom_noise [0.1 0.1 "
    "0.1 0.1]\n"
    "  ranger( alwayson 1 sensor( range [0 3] fov 270 samples 7 noise [0.01 0.01 0] ) )\n"
    "  ranger( alwayson 1 sensor( range [0 3] fov 90 samples 5 ) ) )\n"
    "bot( name \"a\" ) bot( name \"b\" pose [1 0 0 90] )\n"
    "model( pose [2 -1 0 0] size [0.4 4 1] )\n";

/// Runs branches with commands and seeds that depend on their numbers, and returns their results.
std::vector<uint64_t> ResultsOf(const World& world, uint32_t count, BranchOptions options) {
  Snapshot now;
  EXPECT_TRUE(world.Take(&now, Snapshot::kLean));
  Branches branches(world, count, options);
  const uint32_t robot = options.watched[0];
  for (uint32_t i = 0; i < count; i++) {
    branches.Restore(i, now, i);
    branches.Give(i, Command(2, robot, Command::kSetSpeed, 0.1 * (i % 5), 0, 0.1 * (i % 9)));
    branches.Give(i, Command(9, robot, Command::kGoTo, 0.2 * (i % 3), 1, 0));
  }
  Scorer scorer(options.watched.size(), false);
  for (int round = 0; round < 3; round++) branches.Step(5, &scorer);
  std::vector<uint64_t> results;
  for (uint32_t i = 0; i < count; i++) {
    results.push_back(branches.StateOf(i).hash());
    results.push_back(std::bit_cast<uint64_t>(branches[i].score));
    results.push_back(branches[i].steps);
  }
  EXPECT_EQ(branches.steps_in_rows() > 0, options.rows);
  EXPECT_EQ(branches.steps_on_device(), options.device_steps ? branches.steps_in_rows() : 0);
  return results;
}

TEST(BranchesInRows, GoOnWithTheSameResultsWhenTheDeviceIsLostAtAnyTime) {
  InitLibrary();
  static const Restless controller;
  RegisterBatchController("restless", &controller);
  std::atomic<size_t> warnings = 0;  // threads warn side by side
  SetLogSink([&](LogLevel, const std::string& line) {
    warnings += line.find("branches go on without the device, because the device is lost") !=
                std::string::npos;
  });
  Happened happened;
  for (uint64_t seed = 1; seed <= Worlds(); seed++) {
    RandomSource random(seed + 2000);
    rows::ReplaceRowDevices([&] {
      return std::make_unique<test::LostRowDevice>(std::make_shared<int>(random.Int(0, 300)));
    });
    const ClosedWorldKind kind{false, random.OneIn(3), random.Int(1, 5),
                               3,     random.OneIn(3), random.OneIn(3)};
    const std::string text = WithRestless(ClosedWorld(kind, &random));
    SCOPED_TRACE("seed " + std::to_string(seed) + "\n" + text);
    const std::unique_ptr<World> world = LoadEndless(text, random.Next());
    SubscribeToRobotsAndRangers(world.get());
    ASSERT_NO_FATAL_FAILURE(RunAtRandom(&random, world.get(), true, &happened));
  }
  rows::ReplaceRowDevices(nullptr);
  SetLogSink(nullptr);
  const size_t scale = kSanitized ? 10 : 1;
  EXPECT_GT(warnings.load(), Worlds() / 2);
  EXPECT_LE(warnings.load(), Worlds());
  EXPECT_GT(happened.steps_on_device, 1000u / scale);
  EXPECT_GT(happened.steps_in_rows - happened.steps_on_device, 1000u / scale);
}

TEST_P(BranchesInRowsTest, DoNotDependOnTheNumbersOfBranchesAndThreads) {
  InitLibrary();
  const std::unique_ptr<World> world = LoadEndless(kTwoRobots, 3);
  for (int i = 0; i < 4; i++) world->Update();
  for (const Snapshot::Keep keep : {Snapshot::kLean, Snapshot::kFull}) {
    BranchOptions options;
    options.keep = keep;
    options.watched = {world->GetModel("a")->GetId(), world->GetModel("b")->GetId()};
    options.rows = false;
    const uint32_t most = kSanitized ? 100 : 1000;
    const std::vector<uint64_t> expected = ResultsOf(*world, most, options);
    options.rows = true;
    options.device_steps = GetParam();
    for (const unsigned threads : {1u, 2u, 7u})
      for (const uint32_t count : {1u, 33u, most}) {
        options.threads = threads;
        const std::vector<uint64_t> results = ResultsOf(*world, count, options);
        EXPECT_TRUE(std::equal(results.begin(), results.end(), expected.begin()))
            << count << " branches on " << threads << " threads";
      }
  }
}

/// Ends branches one after the other.
class EndsEachAtItsStep : public Scenario {
 public:
  bool NeedsWorld() const override { return false; }
  bool Watch(const Sighting*, uint32_t branch, double* score) override {
    *score += 1;
    return *score > branch;
  }
};

TEST_P(BranchesInRowsTest, ThatEndHaveTheReadingsOfTheirLastStep) {
  InitLibrary();
  const std::unique_ptr<World> world = LoadEndless(
      "contacts \"cells\"\nmodel( pose [1 0 0 0] size [0.1 3 1] )\n"
      "position( name \"a\" alwayson 1 size [0.3 0.3 0.3] velocity [0.3 0 0 20]\n"
      "  ranger( alwayson 1 sensor( range [0 3] fov 270 samples 7 ) ) )\n",
      3);
  Snapshot now;
  ASSERT_TRUE(world->Take(&now));
  BranchOptions options;
  options.device_steps = GetParam();
  Branches branches(*world, 9, options);
  for (uint32_t i = 0; i < 9; i++) branches.Restore(i, now);
  EndsEachAtItsStep scenario;
  branches.Step(20, &scenario);
  for (uint32_t i = 0; i < 9; i++) {
    world->Update();
    Snapshot expected;
    ASSERT_TRUE(world->Take(&expected));
    EXPECT_EQ(branches[i].steps, i + 1);
    EXPECT_EQ(branches.StateOf(i).hash(), expected.hash()) << i;
  }
  EXPECT_EQ(branches.steps_on_device(), GetParam() ? 45u : 0u);
}

/// Scores progress to the right, of which a step can add at most 0.1 m.
class Rightward : public Judge {
 public:
  bool NeedsWorld() const override { return false; }
  bool Watch(const Sighting* watched, size_t, double* score) override {
    *score = watched[0].pose.x;
    return watched[0].stalled;
  }
  Bounds Outlook(uint64_t steps) const override {
    return Bounds(-0.1 * static_cast<double>(steps), 0.1 * static_cast<double>(steps));
  }
};

TEST(BranchesInRows, ADecisionOnADeviceIsThatOfTheHost) {
  if (!device::WhyNone().empty()) GTEST_SKIP() << device::WhyNone();
  InitLibrary();
  const std::unique_ptr<World> world = LoadEndless(kTwoRobots, 3);
  Question question;
  question.horizon = 4000000;
  ASSERT_TRUE(world->Take(&question.now, Snapshot::kLean));
  const uint32_t robot = world->GetModel("a")->GetId();
  for (int i = 0; i < 12; i++)
    question.candidates.push_back(
        {"", {{0, robot, Command::kSetSpeed, 0.1 * (i % 6), 0, 0.3 * (i / 4) - 0.3}}});
  ConsequenceEngine::Options options;
  options.watched = {robot};
  options.samples = 3;
  ConsequenceEngine host(*world, options);
  options.device_steps = true;
  ConsequenceEngine device(*world, options);
  ASSERT_TRUE(device.IsReady());
  EXPECT_EQ(device.WhyNotOnDevice(), "");
  EXPECT_NE(device.StepDevice(), "");
  Rightward judge;
  for (int time = 0; time < 3; time++) {
    const Decision expected = host.Choose(question, Budget(), &judge);
    const Decision decision = device.Choose(question, Budget(), &judge);
    EXPECT_EQ(decision.best, expected.best);
    size_t dominated = 0;
    for (size_t i = 0; i < 12; i++) {
      EXPECT_EQ(decision.outcomes[i].score, expected.outcomes[i].score) << i;
      EXPECT_EQ(decision.outcomes[i].steps, expected.outcomes[i].steps) << i;
      EXPECT_EQ(decision.outcomes[i].dominated, expected.outcomes[i].dominated) << i;
      dominated += decision.outcomes[i].dominated;
    }
    EXPECT_GT(dominated, 0u);
    EXPECT_GT(decision.best, 0u);
  }
  EXPECT_EQ(device.steps_on_device(), device.steps_in_rows());
  EXPECT_EQ(host.steps_on_device(), 0u);
}

TEST(BranchesInRows, TellWhyTheyCannotBe) {
  InitLibrary();
  const std::unique_ptr<World> world = LoadEndless("wifi( name \"w\" alwayson 1 )\n", 1);
  Branches branches(*world, 1);
  EXPECT_EQ(branches.WhyNotClosed(),
            "\"w\" is a wifi with subscribers (without them it may stand there)");
  Snapshot now;
  ASSERT_TRUE(world->Take(&now));
  branches.Restore(0, now);
  branches.Step(3);
  EXPECT_EQ(branches[0].steps, 3u);
  EXPECT_EQ(branches.steps_in_rows(), 0u);
}

TEST(BranchesInRows, AWorldIsNeededForACommandToStandToARobotThatStands) {
  InitLibrary();
  const std::unique_ptr<World> world = LoadEndless("position( name \"idle\" )\n", 1);
  Branches branches(*world, 2);
  Snapshot now;
  ASSERT_TRUE(world->Take(&now));
  for (const uint32_t i : {0u, 1u}) branches.Restore(i, now);
  branches.Give(0, Command(2, world->GetModel("idle")->GetId(), Command::kStop));
  branches.Step(5);
  EXPECT_EQ(branches.steps_in_rows(), 2u + 5u);
  EXPECT_EQ(branches[0].steps, 5u);
}

}  // namespace
}  // namespace Stg
