// SPDX-License-Identifier: GPL-2.0-or-later
//
// A world of a pool develops as it would alone, and a reset one as a newly loaded one, regardless
// of the number of worlds and threads and of failures of other worlds.

#include "worlds/world_pool.hh"

#include <gtest/gtest.h>

#include <atomic>
#include <memory>
#include <numeric>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "stage.hh"
#include "support/all_models.hh"
#include "support/model_testing.hh"
#include "support/own_worlds.hh"
#include "support/sanitized.hh"
#include "support/shipped_worlds.hh"

namespace Stg {
namespace {

using Ids = WorldPool::Ids;

const char kOneRobot[] =
    "resolution 0.1\n"
    "model( pose [1.5 0 0 0] size [0.2 4 0.2] )\n"
    "position( name \"r\" size [0.2 0.2 0.2] localization \"odom\" odom_error [0.1 0 0 0.1]\n"
    "  ranger( alwayson 1 sensor( range [0 2] samples 3 noise [0 0.1 0] ) ) alwayson 1 )\n";

/// The radio keeps the world from being closed, so that its state is in a World object.
const char kRobotWithRadio[] =
    "position( name \"r\" size [0.2 0.2 0.2] alwayson 1 wifi( alwayson 1 ) )\n";

std::unique_ptr<World> LoadOwn(const std::string& text, uint64_t seed = 1) {
  auto world = std::make_unique<World>(OptionsOf(seed));
  std::istringstream content(text);
  EXPECT_TRUE(world->Load(content, "t.world"));
  return world;
}

WorldPoolOptions With(unsigned threads) {
  WorldPoolOptions options;
  options.threads = threads;
  return options;
}

std::vector<uint64_t> SeedsFrom(uint64_t first, size_t count) {
  std::vector<uint64_t> seeds(count);
  std::iota(seeds.begin(), seeds.end(), first);
  return seeds;
}

std::string BytesOf(const World& world) {
  Snapshot snapshot;
  EXPECT_TRUE(world.Take(&snapshot));
  std::ostringstream bytes;
  EXPECT_TRUE(snapshot.Write(bytes));
  return bytes.str();
}

ModelPosition* FirstRobot(const World& world) {
  for (Model* model : world.GetAllModels())
    if (auto* robot = dynamic_cast<ModelPosition*>(model)) return robot;
  return nullptr;
}

void Drive(World* world, uint32_t id, uint64_t step) {
  FirstRobot(*world)->SetSpeed(0.1 * (id % 7), 0, 0.1 * static_cast<double>((id + step) % 5));
}

/// Drives the robot of each world differently.
class Driver : public StepObserver {
 public:
  explicit Driver(WorldPool* pool) : pool_(*pool) {}
  void BeforeStep(uint32_t id, uint64_t step) override { Drive(pool_.At(id), id, step); }

 private:
  WorldPool& pool_;
};

uint64_t HashAlone(const World& prototype, uint32_t id, uint64_t seed, uint64_t steps) {
  World world(OptionsOf(seed));
  EXPECT_TRUE(world.LoadCopy(prototype));
  for (uint64_t step = 0; step < steps; step++) {
    Drive(&world, id, step);
    world.Update();
  }
  return world.StateHash();
}

class WorldPoolTest : public testing::Test {
 protected:
  static void SetUpTestSuite() { InitLibrary(); }
};

// ---- worlds alone -------------------------------------------------------------------------------

/// Compares some worlds of a pool with worlds that are stepped alone.
void ExpectAsAlone(uint32_t count, unsigned threads, uint64_t steps, uint32_t stride) {
  SCOPED_TRACE(std::to_string(count) + " worlds, " + std::to_string(threads) + " threads");
  const std::unique_ptr<World> prototype = LoadOwn(kOneRobot);
  WorldPool pool(*prototype, SeedsFrom(10, count), With(threads));
  ASSERT_TRUE(pool.IsReady());
  EXPECT_EQ(pool.size(), count);
  Driver driver(&pool);
  pool.Step(pool.All(), steps, &driver);
  const std::vector<uint64_t> hashes = pool.StateHashes(pool.All());
  for (uint32_t id = 0; id < count; id += stride)
    ASSERT_EQ(hashes[id], HashAlone(*prototype, id, 10 + id, steps)) << id;
}

TEST_F(WorldPoolTest, WorldsEqualWorldsSteppedAlone) {
  for (const unsigned threads : {1u, 2u, 4u}) {
    for (const uint32_t count : {1u, 2u, 33u}) ExpectAsAlone(count, threads, 20, 1);
    ExpectAsAlone(kSanitized ? 100 : 1000, threads, 10, 17);
  }
}

TEST_F(WorldPoolTest, TenThousandWorldsEqualWorldsSteppedAlone) {
  ExpectAsAlone(kSanitized ? 500 : 10000, 2, 3, 501);
}

TEST_F(WorldPoolTest, ShippedWorldsEqualWorldsSteppedAlone) {
  constexpr uint64_t kSteps = kSanitized ? 5 : 20;
  for (const std::string& file : ShippedWorlds()) {
    SCOPED_TRACE(file);
    WorldPool pool(*LoadFile(file, 1), {4, 5}, With(2));
    pool.Step(pool.All(), kSteps);
    const std::unique_ptr<World> alone = LoadFile(file, 5);
    alone->SetQuitTime(0);
    for (uint64_t step = 0; step < kSteps; step++) alone->Update();
    EXPECT_EQ(pool.StateHashes({1})[0], alone->StateHash());
  }
}

TEST_F(WorldPoolTest, OneDeviceServesAllWorlds) {
  RunOptions options = OptionsOf(1);
  options.opencl = options.always_on_device = true;
  World prototype(options);
  std::istringstream content(kOneRobot);
  ASSERT_TRUE(prototype.Load(content, "t.world"));
  if (prototype.statistics().device.empty()) GTEST_SKIP() << "there is no OpenCL device here";
  WorldPool pool(prototype, SeedsFrom(10, 5), With(2));
  Driver driver(&pool);
  pool.Step(pool.All(), 10, &driver);
  for (uint32_t id = 0; id < pool.size(); id++) {
    EXPECT_EQ(pool.At(id)->statistics().device, prototype.statistics().device);
    EXPECT_GT(pool.At(id)->statistics().device_steps, 0u);
    EXPECT_EQ(pool.StateHashes({id})[0], HashAlone(*LoadOwn(kOneRobot), id, 10 + id, 10));
  }
}

// ---- resets -------------------------------------------------------------------------------------

/// Resets the two worlds of a pool after `steps` steps, and compares them with new worlds.
void ExpectResetsLikeLoads(WorldPool* pool, const std::string& file, const RunOptions& options,
                           uint64_t steps) {
  SCOPED_TRACE(std::to_string(steps) + " steps");
  for (const uint32_t id : pool->All())
    for (Model* model : pool->At(id)->GetAllModels()) model->Subscribe();
  pool->Step(pool->All(), steps);
  pool->Reset(pool->All(), {77 + steps, 5});
  for (const uint32_t id : pool->All()) {
    EXPECT_EQ(pool->Failure(id), "");
    RunOptions own = options;
    own.seed = pool->seeds()[id];
    World fresh(own);
    ASSERT_TRUE(fresh.Load(file));
    EXPECT_EQ(pool->At(id)->StateHash(), fresh.StateHash());
    EXPECT_EQ(BytesOf(*pool->At(id)), BytesOf(fresh));
    EXPECT_EQ(pool->At(id)->seed(), own.seed);
    EXPECT_EQ(pool->At(id)->statistics().steps, 0u);
  }
}

TEST_F(WorldPoolTest, ResetEqualsAFreshLoad) {
  int restarted = 0;
  for (const std::string& file : ShippedWorlds())
    for (const bool controllers : {false, true}) {
      SCOPED_TRACE(file + (controllers ? ", with controllers" : ""));
      RunOptions options = OptionsOf(1);
      options.controllers = controllers;
      World prototype(options);
      ASSERT_TRUE(prototype.Load(file));
      WorldPool pool(prototype, {1, 2}, With(2));
      const uint64_t many = kSanitized || prototype.GetAllModels().size() > 100 ? 10 : 100;
      for (const uint64_t steps : {uint64_t{0}, uint64_t{1}, many})
        ExpectResetsLikeLoads(&pool, file, options, steps);
      restarted += pool.times_made(0) == 1;
    }
  EXPECT_GT(restarted, 10) << "worlds that are reset without being made again";
}

TEST_F(WorldPoolTest, ResetConcernsOnlyTheGivenWorlds) {
  const std::unique_ptr<World> prototype = LoadOwn(kOneRobot);
  WorldPool pool(*prototype, SeedsFrom(10, 4), With(2));
  Driver driver(&pool);
  pool.Step(pool.All(), 5, &driver);
  const std::vector<uint64_t> before = pool.StateHashes(pool.All());
  pool.Reset({3, 1}, {30, 31});
  EXPECT_EQ(pool.seeds(), (std::vector<uint64_t>{10, 31, 12, 30}));
  const std::vector<uint64_t> after = pool.StateHashes(pool.All());
  EXPECT_EQ(after[0], before[0]);
  EXPECT_EQ(after[1], HashAlone(*prototype, 1, 31, 0));
  EXPECT_EQ(after[2], before[2]);
  EXPECT_EQ(after[3], HashAlone(*prototype, 3, 30, 0));
}

// ---- variants -----------------------------------------------------------------------------------

std::string WallAt(int x) {
  return std::string(kOneRobot) + "model( pose [" + std::to_string(x) + " 0 0 0] size [1 1 1] )\n";
}

/// Each world gets another prototype again and again, which is exchanged while no world has it.
TEST_F(WorldPoolTest, PrototypesAreExchanged) {
  for (const unsigned threads : {1u, 4u}) {
    const std::unique_ptr<World> first = LoadOwn(kOneRobot);
    WorldPool pool(*first, {1, 2, 3}, With(threads));
    for (int round = 0; round < 20; round++) {
      const std::unique_ptr<World> own = LoadOwn(round % 3 ? WallAt(2 + round) : kRobotWithRadio);
      const uint32_t variant = 1 + static_cast<uint32_t>(round) % 2;
      ASSERT_TRUE(pool.SetPrototype(variant, *own)) << round;
      ASSERT_EQ(pool.CountVariants(), round == 0 ? 2u : 3u);
      pool.Reset({0, 2}, {10, 20}, {variant, variant});
      Driver driver(&pool);
      pool.Step(pool.All(), 3, &driver);
      EXPECT_EQ(pool.StateHashes({0})[0], HashAlone(*own, 0, 10, 3));
      EXPECT_EQ(pool.StateHashes({2})[0], HashAlone(*own, 2, 20, 3));
    }
    EXPECT_EQ(pool.Variant(1), 0u);
  }
}

TEST_F(WorldPoolTest, PrototypesOfWorldsAreNotExchanged) {
  const std::unique_ptr<World> first = LoadOwn(kOneRobot), other = LoadOwn(WallAt(4));
  WorldPool pool(*first, {1, 2}, With(1));
  EXPECT_EQ(
      ErrorsOf([&] { EXPECT_FALSE(pool.SetPrototype(0, *other)); }),
      "stage: found the variant number 0, which worlds are of, expected one without worlds, or "
      "the next number\n");
  EXPECT_EQ(
      ErrorsOf([&] { EXPECT_FALSE(pool.SetPrototype(2, *other)); }),
      "stage: found the variant number 2, which does not exist, expected one without worlds, or "
      "the next number\n");
  const World empty(OptionsOf(1));
  EXPECT_NE(ErrorsOf([&] { EXPECT_FALSE(pool.SetPrototype(1, empty)); }), "");
  EXPECT_EQ(pool.CountVariants(), 1u);
}

// ---- snapshots ----------------------------------------------------------------------------------

TEST_F(WorldPoolTest, RestoredWorldsContinueLikeTheOneOfTheSnapshot) {
  const std::unique_ptr<World> prototype = LoadOwn(kOneRobot);
  WorldPool pool(*prototype, SeedsFrom(1, 5), With(2));
  pool.Step(pool.All(), 5);
  for (const Snapshot::Keep keep : {Snapshot::kFull, Snapshot::kLean}) {
    Snapshot now;
    ASSERT_TRUE(pool.Take(2, &now, keep));
    pool.Step({0, 2}, 3);
    pool.Restore({0, 4, 2}, now);
    pool.Step({0, 2, 4}, 10);
    EXPECT_EQ(pool.StateHashes({0, 4}), std::vector<uint64_t>(2, pool.StateHashes({2}).front()));
  }
}

int DoNothing(Model*, void*) { return 0; }

TEST_F(WorldPoolTest, WorldsCanBeRestoredAfterAFailedRestore) {
  const std::unique_ptr<World> prototype = LoadOwn(kOneRobot);
  WorldPool pool(*prototype, SeedsFrom(1, 3), With(2));
  pool.Step(pool.All(), 4);
  Snapshot good, of_another_file;
  ASSERT_TRUE(pool.Take(0, &good));
  ASSERT_TRUE(LoadOwn("position( name \"p\" )")->Take(&of_another_file));
  const std::vector<uint64_t> before = pool.StateHashes(pool.All());
  const std::string errors = ErrorsOf([&] { pool.Restore(pool.All(), of_another_file); });
  EXPECT_EQ(errors, "") << "reasons are kept, not reported";
  for (const uint32_t id : pool.All())
    EXPECT_NE(pool.Failure(id).find("cannot restore the snapshot"), std::string::npos);
  EXPECT_EQ(pool.StateHashes(pool.All()), before);
  FirstRobot(*pool.At(1))->AddCallback(Model::CB_UPDATE, DoNothing, nullptr);
  pool.Restore(pool.All(), good);
  EXPECT_EQ(pool.Failure(0), "");
  EXPECT_NE(pool.Failure(1).find("callbacks"), std::string::npos) << pool.Failure(1);
  EXPECT_EQ(pool.StateHashes(pool.All()), (std::vector<uint64_t>{before[0], before[1], before[0]}));
  FirstRobot(*pool.At(1))->RemoveCallback(Model::CB_UPDATE, DoNothing);
  pool.Restore({1}, good);
  pool.Step(pool.All(), 5);
  EXPECT_EQ(pool.StateHashes(pool.All()), std::vector<uint64_t>(3, pool.StateHashes({0})[0]));
}

// ---- failures -----------------------------------------------------------------------------------

int DeleteWorld(World* world, void*) {
  delete world;
  return 0;
}

/// World 1 throws, world 2 quits, a controller deletes world 3, each in its third step.
class Troublemaker : public Driver {
 public:
  explicit Troublemaker(WorldPool* pool) : Driver(pool), pool_(*pool), outcomes(pool->size()) {}

  void BeforeStep(uint32_t id, uint64_t step) override {
    Driver::BeforeStep(id, step);
    if (step != 2) return;
    if (id == 1) throw std::runtime_error("too much");
    if (id == 2) pool_.At(id)->Quit();
    if (id == 3) pool_.At(id)->AddUpdateCallback(DeleteWorld, nullptr);
  }
  void AfterStep(uint32_t, uint64_t) override { steps_made++; }
  void AfterRound(uint32_t id, uint64_t, uint64_t, Outcome outcome) override {
    outcomes[id] = outcome;
  }

 private:
  WorldPool& pool_;

 public:
  std::vector<Outcome> outcomes;
  std::atomic<int> steps_made{0};
};

TEST_F(WorldPoolTest, AFailureConcernsOnlyItsWorld) {
  const std::unique_ptr<World> prototype = LoadOwn(kOneRobot);
  for (const unsigned threads : {1u, 2u, 4u}) {
    WorldPool pool(*prototype, SeedsFrom(10, 6), With(threads));
    Troublemaker troublemaker(&pool);
    pool.Step(pool.All(), 10, &troublemaker);
    EXPECT_EQ(pool.Failure(1), "an exception: too much");
    EXPECT_EQ(pool.Failure(2), "");
    EXPECT_EQ(pool.Failure(3), "a controller has deleted the world");
    EXPECT_EQ(pool.At(1)->UpdateCount(), 2u);
    EXPECT_EQ(pool.At(2)->UpdateCount(), 2u);
    EXPECT_EQ(pool.At(3), nullptr);
    EXPECT_EQ(troublemaker.outcomes[1], StepObserver::kHasFailed);
    EXPECT_EQ(troublemaker.outcomes[2], StepObserver::kHasEnded);
    EXPECT_EQ(troublemaker.outcomes[3], StepObserver::kHasFailed);
    EXPECT_EQ(troublemaker.outcomes[4], StepObserver::kMadeAllSteps);
    EXPECT_EQ(troublemaker.steps_made, 3 * 10 + 3 * 2);
    for (const uint32_t id : {0u, 4u, 5u})
      EXPECT_EQ(pool.StateHashes({id})[0], HashAlone(*prototype, id, 10 + id, 10)) << id;
    EXPECT_EQ(pool.StateHashes({3})[0], 0u);
    pool.Step(pool.All(), 1);
    EXPECT_EQ(pool.At(1)->UpdateCount(), 2u) << "a failed world makes no steps";
    pool.Reset({1, 2, 3}, {11, 12, 13});
    Driver driver(&pool);
    pool.Step({1, 2, 3}, 10, &driver);
    for (const uint32_t id : {1u, 2u, 3u}) {
      EXPECT_EQ(pool.Failure(id), "");
      EXPECT_EQ(pool.StateHashes({id})[0], HashAlone(*prototype, id, 10 + id, 10)) << id;
    }
  }
}

TEST_F(WorldPoolTest, DeletedWorldsAreMadeAgainWhenRestored) {
  WorldPool pool(*LoadOwn(kRobotWithRadio), SeedsFrom(1, 2));
  Snapshot start;
  ASSERT_TRUE(pool.Take(0, &start));
  delete pool.At(1);
  EXPECT_EQ(pool.At(1), nullptr);
  Snapshot none;
  EXPECT_NE(ErrorsOf([&] { EXPECT_FALSE(pool.Take(1, &none)); }).find("no world number 1"),
            std::string::npos);
  pool.Restore(pool.All(), start);
  EXPECT_EQ(pool.times_made(1), 2u);
  EXPECT_EQ(pool.StateHashes({0}), pool.StateHashes({1}));
  pool.At(1)->UnLoad();
  EXPECT_NE(pool.AtOrMake(1)->GetWorldFile(), nullptr);
  EXPECT_EQ(pool.times_made(1), 3u);
}

TEST_F(WorldPoolTest, IsNotReadyWithoutAPrototype) {
  World empty(OptionsOf(1));
  std::unique_ptr<WorldPool> pool;
  const std::string errors =
      ErrorsOf([&] { pool = std::make_unique<WorldPool>(empty, SeedsFrom(1, 2)); });
  EXPECT_NE(errors.find("no loaded world"), std::string::npos) << errors;
  EXPECT_FALSE(pool->IsReady());
  EXPECT_EQ(pool->At(0), nullptr);
  EXPECT_NE(pool->Failure(0), "");
}

// ---- numbers of worlds --------------------------------------------------------------------------

TEST_F(WorldPoolTest, WorldsAreMadeWhenFirstNeeded) {
  const std::unique_ptr<World> prototype = LoadOwn(kRobotWithRadio);
  WorldPool pool(*prototype, SeedsFrom(1, 4));
  const auto made = [&] {
    std::vector<uint64_t> times;
    for (const uint32_t id : pool.All()) times.push_back(pool.times_made(id));
    return times;
  };
  EXPECT_EQ(made(), (std::vector<uint64_t>{0, 0, 0, 0}));
  pool.Step({2}, 1);
  EXPECT_EQ(made(), (std::vector<uint64_t>{0, 0, 1, 0}));
  pool.At(0);
  EXPECT_EQ(made(), (std::vector<uint64_t>{1, 0, 1, 0}));
  pool.Make(pool.All());
  EXPECT_EQ(made(), (std::vector<uint64_t>{1, 1, 1, 1}));
  EXPECT_EQ(pool.At(4), nullptr);
}

TEST_F(WorldPoolTest, ResizeKeepsTheOtherWorlds) {
  const std::unique_ptr<World> prototype = LoadOwn(kOneRobot);
  WorldPool pool(*prototype, SeedsFrom(10, 3), With(2));
  pool.Step(pool.All(), 5);
  const std::vector<uint64_t> before = pool.StateHashes(pool.All());
  pool.Resize(SeedsFrom(20, 5));
  EXPECT_EQ(pool.seeds(), (std::vector<uint64_t>{10, 11, 12, 23, 24}));
  EXPECT_EQ(pool.StateHashes({0, 1, 2}), before);
  EXPECT_EQ(pool.At(4)->seed(), 24u);
  pool.Resize(SeedsFrom(1, 2));
  EXPECT_EQ(pool.size(), 2u);
  EXPECT_EQ(pool.StateHashes(pool.All()), (std::vector<uint64_t>{before[0], before[1]}));
}

TEST_F(WorldPoolTest, PoolsOfTheSameSceneAreIndependent) {
  const std::unique_ptr<World> prototype = LoadOwn(kOneRobot);
  WorldPool pool(*prototype, SeedsFrom(10, 2), With(2));
  pool.Step(pool.All(), 5);
  const WorldPool other(pool, SeedsFrom(10, 3));
  EXPECT_EQ(other.size(), 3u);
  EXPECT_EQ(other.threads(), pool.threads());
  EXPECT_EQ(const_cast<WorldPool&>(other).At(1)->StateHash(), HashAlone(*prototype, 1, 11, 0));
}

// ---- rounds -------------------------------------------------------------------------------------

/// Checks that the worlds have made equal numbers of steps between rounds, which end at multiples
/// of 4 steps.
class Rounds : public StepObserver {
 public:
  explicit Rounds(WorldPool* pool) : pool_(*pool) {}

  void AfterRound(uint32_t, uint64_t first, uint64_t, Outcome outcome) override {
    EXPECT_EQ(first % 4, 0u);
    EXPECT_EQ(outcome, kMadeAllSteps);
  }
  void BetweenRounds() override {
    count++;
    for (const uint32_t id : pool_.All())
      EXPECT_EQ(pool_.At(id)->UpdateCount(), pool_.At(0)->UpdateCount());
    if (count == 3) throw std::runtime_error("interrupted");
  }

  int count = 0;

 private:
  WorldPool& pool_;
};

TEST_F(WorldPoolTest, AllWorldsAreAtTheSameStepBetweenRounds) {
  WorldPool pool(*LoadOwn(kOneRobot), SeedsFrom(1, 5), With(2));
  Rounds rounds(&pool);
  EXPECT_THROW(pool.Step(pool.All(), uint64_t{1} << 60, &rounds, 4), std::runtime_error);
  EXPECT_EQ(rounds.count, 3);
  const uint64_t steps = pool.At(0)->UpdateCount();
  EXPECT_EQ(steps % 4, 0u);
  pool.Step(pool.All(), 3);
  for (const uint32_t id : pool.All()) EXPECT_EQ(pool.At(id)->UpdateCount(), steps + 3);
}

}  // namespace
}  // namespace Stg
