// SPDX-License-Identifier: GPL-2.0-or-later
//
// Worlds of a pool change between rows and World objects in mid-run. Whatever is done with them,
// they equal worlds with which the same is done alone.

#include <gtest/gtest.h>

#include <cstdlib>
#include <functional>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include "stage.hh"
#include "support/closed_world.hh"
#include "support/device.hh"
#include "support/model_testing.hh"
#include "support/own_worlds.hh"
#include "support/random_source.hh"
#include "support/sanitized.hh"
#include "support/saved_difference.hh"
#include "world/engine.hh"
#include "worlds/pool_access.hh"

namespace Stg {
namespace {

using Ids = WorldPool::Ids;
using test::ClosedWorldKind;
using test::RandomSource;

std::unique_ptr<World> LoadText(const std::string& text, uint64_t seed) {
  auto world = std::make_unique<World>(OptionsOf(seed));
  std::istringstream content(text);
  EXPECT_TRUE(world->Load(content, "t.world")) << text;
  return world;
}

int DoNothing(World*, void*) { return 0; }

/// A pool, and a world alone for each of its worlds, with which the same is done.
class Twins {
 public:
  Twins(const std::string& text, const std::vector<uint64_t>& seeds,
        const WorldPoolOptions& options)
      : text_(text) {
    pool_ = std::make_unique<WorldPool>(*LoadText(text, 1), seeds, options);
    for (const uint64_t seed : seeds) alone_.push_back(LoadText(text, seed));
    ids_ = pool_->All();
    for (const Model* model : alone_[0]->engine().models) models_.push_back(model->GetId());
  }

  WorldPool& pool() { return *pool_; }
  const Ids& ids() const { return ids_; }
  /// Ids of all models, the same in each world.
  const std::vector<uint32_t>& models() const { return models_; }
  size_t rows() const {
    size_t count = 0;
    for (const uint32_t id : ids_) count += !PoolAccess::HasWorld(*pool_, id);
    return count;
  }

  /// Calls act(world) for the world alone and for that of the pool.
  void InBoth(uint32_t id, const std::function<void(World& world)>& act) {
    act(*alone_[id]);
    act(*pool_->At(id));
  }
  void Step(const Ids& ids, uint64_t steps, StepObserver* observer) {
    pool_->Step(ids, steps, observer);
    for (const uint32_t id : ids)
      for (uint64_t i = 0; i < steps; i++) alone_[id]->Update();
  }
  void Subscribe(uint32_t id, uint32_t model) {
    pool_->Subscribe(id, model);
    Model& of_alone = *alone_[id]->FindModel(model);
    if (!of_alone.HasSubscribers()) of_alone.Subscribe();
  }
  void Reset(uint32_t id, uint64_t seed) {
    pool_->Reset({id}, {seed});
    alone_[id] = LoadText(text_, seed);
  }
  /// Restores the state of a world in another one.
  void Copy(uint32_t from, uint32_t to) {
    Snapshot of_pool, of_alone;
    ASSERT_TRUE(pool_->Take(from, &of_pool));
    ASSERT_TRUE(alone_[from]->Take(&of_alone));
    pool_->Restore({to}, of_pool);
    ASSERT_EQ(pool_->Failure(to), "");
    ASSERT_TRUE(alone_[to]->Restore(of_alone));
  }
  /// Moves or commands the robots of a world: those of a row by its columns.
  void Drive(uint32_t id, RandomSource* random) {
    const PoolRow row = PoolAccess::RowToChange(*pool_, id);
    for (const uint32_t model : models_) {
      auto* const robot = dynamic_cast<ModelPosition*>(alone_[id]->FindModel(model));
      if (!robot || !random->OneIn(2)) continue;
      const rows::Planar to{random->Real(-1, 1), random->Real(-1, 1), random->Real(-4, 4)};
      const bool teleports = random->OneIn(4);
      DriveOne(robot, to, teleports);
      if (row)
        DriveRow(row, model, id, to, teleports);
      else
        DriveOne(static_cast<ModelPosition*>(pool_->At(id)->FindModel(model)), to, teleports);
    }
  }

  /// Says what differs between a world of the pool and its twin; empty if nothing does.
  std::string Difference(uint32_t id) {
    if (!pool_->Failure(id).empty()) return pool_->Failure(id);
    if (pool_->StateHashes({id})[0] != alone_[id]->StateHash()) return "the states differ";
    Snapshot of_pool, of_alone;
    if (!pool_->Take(id, &of_pool) || !alone_[id]->Take(&of_alone)) return "no snapshot";
    if (of_pool.hash() == of_alone.hash()) return "";
    std::string text = "the snapshots differ:";
    pool_->Look(id, [&](World& world) { text += test::SavedDifference(*alone_[id], world); });
    return text;
  }

 private:
  static void DriveOne(ModelPosition* robot, const rows::Planar& to, bool teleports) {
    if (teleports)
      robot->SetGlobalPose(Pose(to.x, to.y, robot->GetGlobalPose().z, to.a));
    else if (robot->HasSubscribers())
      robot->SetSpeed(to.x, to.y, to.a);
  }
  void DriveRow(const PoolRow& row, uint32_t model, uint32_t id, const rows::Planar& to,
                bool teleports) {
    const rows::Scene& scene = row.rows->scene();
    for (size_t k = 0; k < scene.movers.size(); k++) {
      if (!scene.movers[k].robot || scene.movers[k].robot->GetId() != model) continue;
      if (teleports) return PoolAccess::Place(*pool_, id, k, to);
      if (!scene.movers[k].runs) return;
      const size_t i = row.row * scene.movers.size() + k;
      row.rows->columns.mode[i] = DriveInput::kVelocity;
      row.rows->columns.command[i] = to;
    }
  }

  std::string text_;
  std::unique_ptr<WorldPool> pool_;
  std::vector<std::unique_ptr<World>> alone_;
  Ids ids_;
  std::vector<uint32_t> models_;
};

/// Counts steps, so that steps are made one by one.
class Counter : public StepObserver {
 public:
  explicit Counter(WorldPool* pool) : pool_(*pool), steps(pool->size()) {}
  void BeforeStep(uint32_t id, uint64_t step) override {
    if (step == asks_in && id % 3 == 0) pool_.At(id);
  }
  void AfterStep(uint32_t id, uint64_t) override { steps[id]++; }

 private:
  WorldPool& pool_;

 public:
  uint64_t asks_in = UINT64_MAX;  ///< in this step it asks for some World objects
  std::vector<uint64_t> steps;
};

/// Counts of events, which show that the tests do what they claim.
struct Happened {
  size_t rows = 0, worlds = 0, came_back = 0, resets = 0, copies = 0, on_device = 0;
};

/// Does something at random with a world, and the same with its twin.
void ActOn(Twins* twins, uint32_t id, RandomSource* random, Happened* happened) {
  WorldPool& pool = twins->pool();
  const std::vector<uint32_t>& models = twins->models();
  switch (random->Int(0, 7)) {
    case 0:
      twins->InBoth(id, [](World& world) { world.AddUpdateCallback(DoNothing, nullptr); });
      break;
    case 1:
      twins->InBoth(id, [](World& world) { world.RemoveUpdateCallback(DoNothing, nullptr); });
      break;
    case 2:
      twins->Reset(id, random->Next());
      happened->resets++;
      break;
    case 3: {
      const auto to = static_cast<uint32_t>(random->Int(0, static_cast<int>(pool.size()) - 1));
      twins->InBoth(to, [](World& world) { world.RemoveUpdateCallback(DoNothing, nullptr); });
      twins->Copy(id, to);
      happened->copies++;
      break;
    }
    case 4:
      twins->Subscribe(id, models[random->Next() % models.size()]);
      break;
    default:
      twins->Drive(id, random);
  }
}

void ExpectEqual(Twins* twins) {
  for (const uint32_t id : twins->ids()) ASSERT_EQ(twins->Difference(id), "") << "world " << id;
}

Ids SomeOf(const Ids& ids, RandomSource* random) {
  Ids some;
  for (const uint32_t id : ids)
    if (random->OneIn(2)) some.push_back(id);
  return some;
}

/// Steps with callbacks, resets, copies, subscriptions, commands and poses at random moments.
void RunAtRandom(Twins* twins, RandomSource* random, int rounds, Happened* happened) {
  WorldPool& pool = twins->pool();
  for (int round = 0; round < rounds; round++) {
    const auto id = static_cast<uint32_t>(random->Int(0, static_cast<int>(pool.size()) - 1));
    ASSERT_NO_FATAL_FAILURE(ActOn(twins, id, random, happened));
    if (random->OneIn(3)) {
      const size_t before = twins->rows();
      pool.Release(twins->ids());
      happened->came_back += twins->rows() - before;
    }
    Counter counter(&pool);
    if (random->OneIn(4)) counter.asks_in = 2;
    const auto steps = static_cast<uint64_t>(random->Int(0, 5));
    Counter* const observer = random->OneIn(2) ? &counter : nullptr;
    if (!observer && !pool.StepDevice().empty())
      for (const uint32_t on : twins->ids()) happened->on_device += pool.WhyNotOnDevice(on).empty();
    twins->Step(random->OneIn(3) ? SomeOf(twins->ids(), random) : twins->ids(), steps, observer);
    happened->rows += twins->rows();
    happened->worlds += pool.size() - twins->rows();
    ASSERT_NO_FATAL_FAILURE(ExpectEqual(twins)) << "round " << round;
  }
}

/// Number of random worlds; more for a long search.
uint64_t Worlds() {
  const char* const wanted = std::getenv("STAGE_RANDOM_WORLDS");
  return wanted ? std::strtoull(wanted, nullptr, 10) : kSanitized ? 8 : 12;
}

/// Threads of a pool; kOnDevice: on two threads, whole steps on an OpenCL device.
constexpr unsigned kOnDevice = 100;

class PoolRows : public testing::TestWithParam<unsigned> {
 protected:
  static WorldPoolOptions Options() {
    WorldPoolOptions options;
    options.device_steps = GetParam() == kOnDevice;
    options.threads = options.device_steps ? 2 : GetParam();
    return options;
  }
};

TEST_P(PoolRows, WorldsEqualThoseAloneWhateverIsDoneWithThem) {
  const bool on_device = GetParam() == kOnDevice;
  if (on_device && !device::WhyNone().empty()) GTEST_SKIP() << device::WhyNone();
  InitLibrary();
  Happened happened;
  for (uint64_t seed = 1; seed <= Worlds(); seed++) {
    RandomSource random(seed * 100 + GetParam());
    // Devices do not know contacts of outlines.
    const bool outlines = random.OneIn(on_device ? 6 : 2);
    const ClosedWorldKind kind{outlines, random.OneIn(2), random.Int(1, 5), 3, random.OneIn(2)};
    const std::string text = ClosedWorld(kind, &random);
    SCOPED_TRACE("seed " + std::to_string(seed) + "\n" + text);
    std::vector<uint64_t> seeds(static_cast<size_t>(random.Int(1, 9)));
    for (uint64_t& of_world : seeds) of_world = random.Next();
    Twins twins(text, seeds, Options());
    ASSERT_EQ(twins.pool().WhyNotClosed(0), "");
    for (const uint32_t id : twins.ids()) {
      if (random.OneIn(2)) twins.Drive(id, &random);
      for (const uint32_t model : twins.models())
        if (random.OneIn(2)) twins.Subscribe(id, model);
    }
    ASSERT_NO_FATAL_FAILURE(ExpectEqual(&twins));
    ASSERT_NO_FATAL_FAILURE(RunAtRandom(&twins, &random, 25, &happened));
  }
  EXPECT_GT(happened.rows, 100u);
  EXPECT_GT(happened.worlds, 100u);
  EXPECT_GT(happened.came_back, 20u);
  EXPECT_GT(happened.resets, 5u);
  EXPECT_GT(happened.copies, 5u);
  EXPECT_EQ(happened.on_device > 100, on_device);
}

TEST(PoolRowsOfPopulations, AWorldWhoseMembersDoNotFitFailsWithTheReason) {
  InitLibrary();
  const char kCrowded[] =
      "define bot position( size [0.4 0.4 0.3] alwayson 1 )\n"
      "population( name \"bots\" model \"bot\" count 3 area [0 0 0.7 0.7] gap 0.05 )\n";
  std::vector<std::unique_ptr<World>> alone;
  std::vector<uint64_t> seeds;
  const World* fitting = nullptr;
  for (uint64_t seed = 1; seed <= 20; seed++) {
    alone.push_back(std::make_unique<World>(OptionsOf(seed)));
    std::istringstream content(kCrowded);
    if (alone.back()->Load(content, "t.world"))
      fitting = alone.back().get();
    else
      alone.back().reset();
    seeds.push_back(seed);
  }
  ASSERT_NE(fitting, nullptr);
  WorldPool pool(*fitting, seeds);
  ASSERT_EQ(pool.WhyNotClosed(0), "");
  pool.Step(pool.All(), 3);
  size_t failures = 0;
  for (const uint32_t id : pool.All()) {
    failures += !alone[id];
    if (alone[id]) {
      for (int i = 0; i < 3; i++) alone[id]->Update();
      EXPECT_EQ(pool.Failure(id), "");
      EXPECT_EQ(pool.StateHashes({id})[0], alone[id]->StateHash());
    } else {
      EXPECT_NE(pool.Failure(id).find("bots"), std::string::npos) << pool.Failure(id);
      EXPECT_FALSE(PoolAccess::RowToRead(pool, id));
      EXPECT_EQ(pool.At(id), nullptr);
    }
  }
  EXPECT_GT(failures, 0u);
  EXPECT_LT(failures, 19u);
}

INSTANTIATE_TEST_SUITE_P(Threads, PoolRows, testing::Values(1u, 2u, 7u, 16u, kOnDevice));

}  // namespace
}  // namespace Stg
