// SPDX-License-Identifier: GPL-2.0-or-later
//
// Worlds of a pool change between rows and World objects in mid-run. Whatever is done with them,
// they equal worlds with which the same is done alone.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
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

int DoNothing(World*, void*) { return 0; }

/// A pool, and a world alone for each of its worlds, with which the same is done.
class Twins {
 public:
  /// Names of some models that stand, for WorldPoolOptions::placed.
  static std::vector<std::string> SomeThings(const std::string& text, RandomSource* random) {
    constexpr double kMostMetres = 0.5;  // rows know no large outlines of what is placed
    std::vector<std::string> names;
    const std::unique_ptr<World> world = LoadText(text, 1);
    for (const Model* model : world->engine().models) {
      const Size size = model->GetGeom().size;
      if (!model->Parent() && model->GetModelType() == "model" && random->OneIn(2) &&
          std::max(size.x, size.y) < kMostMetres)
        names.push_back(model->TokenStr());
    }
    return names;
  }
  /// World i is of the variant with the text number variants[i].
  Twins(const std::vector<std::string>& texts, const std::vector<uint64_t>& seeds,
        const std::vector<uint32_t>& variants, const WorldPoolOptions& options)
      : texts_(texts), variants_(variants) {
    std::vector<std::unique_ptr<World>> prototypes;
    std::vector<const World*> pointers;
    for (const std::string& text : texts) {
      prototypes.push_back(LoadText(text, 1));
      pointers.push_back(prototypes.back().get());
      models_.emplace_back();
      for (const Model* model : prototypes.back()->engine().models)
        models_.back().push_back(model->GetId());
    }
    pool_ = std::make_unique<WorldPool>(pointers, seeds, variants, options);
    for (size_t id = 0; id < seeds.size(); id++)
      alone_.push_back(LoadText(texts[variants[id]], seeds[id]));
    ids_ = pool_->All();
  }
  Twins(const std::string& text, const std::vector<uint64_t>& seeds,
        const WorldPoolOptions& options)
      : Twins(std::vector{text}, seeds, std::vector<uint32_t>(seeds.size()), options) {}

  WorldPool& pool() { return *pool_; }
  const Ids& ids() const { return ids_; }
  /// Ids of all models of a world.
  const std::vector<uint32_t>& models(uint32_t id) const { return models_[variants_[id]]; }
  size_t variants() const { return texts_.size(); }
  uint32_t variant(uint32_t id) const { return variants_[id]; }
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
    alone_[id] = LoadText(texts_[variants_[id]], seed);
  }
  void Reset(const Ids& ids, uint64_t seed, uint32_t variant) {
    pool_->Reset(ids, std::vector(ids.size(), seed), std::vector(ids.size(), variant));
    for (const uint32_t id : ids) {
      variants_[id] = variant;
      alone_[id] = LoadText(texts_[variant], seed);
    }
  }
  /// Restores the state of a world in another one.
  void Copy(uint32_t from, uint32_t to) {
    Snapshot of_pool, of_alone;
    ASSERT_TRUE(pool_->Take(from, &of_pool));
    ASSERT_TRUE(alone_[from]->Take(&of_alone));
    pool_->Restore({to}, of_pool);
    const bool fits = alone_[to]->Restore(of_alone);
    ASSERT_EQ(pool_->Failure(to).empty(), fits) << pool_->Failure(to);
    ASSERT_TRUE(fits || variants_[from] != variants_[to]);
    if (!fits) Reset(to, 1);
  }
  /// Moves or commands the robots of a world: those of a row by its columns.
  void Drive(uint32_t id, RandomSource* random) {
    const PoolRow row = PoolAccess::RowToChange(*pool_, id);
    for (const uint32_t model : models(id)) {
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

  /// Moves some things of a world.
  void PlaceThings(uint32_t id, const std::vector<std::string>& names, RandomSource* random) {
    for (const std::string& name : names) {
      Model* const model = alone_[id]->GetModel(name);
      if (!model || !random->OneIn(2)) continue;
      const double x = random->Real(-2, 2), y = random->Real(-2, 2), a = random->Real(-4, 4);
      ASSERT_TRUE(pool_->Place(id, model->GetId(), x, y, a));
      model->SetPose(Pose(x, y, model->GetPose().z, a));
      rows::Planar place;
      ASSERT_TRUE(PoolAccess::FindPlace(*pool_, id, model->GetId(), &place));
      EXPECT_EQ(place, rows::PlanarOf(model->GetPose()));
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

  std::vector<std::string> texts_;
  std::vector<uint32_t> variants_;
  std::unique_ptr<WorldPool> pool_;
  std::vector<std::unique_ptr<World>> alone_;
  Ids ids_;
  std::vector<std::vector<uint32_t>> models_;  // by variant
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
  size_t rows = 0, worlds = 0, came_back = 0, resets = 0, copies = 0, on_device = 0, moves = 0;
};

Ids SomeOf(const Ids& ids, RandomSource* random) {
  Ids some;
  for (const uint32_t id : ids)
    if (random->OneIn(2)) some.push_back(id);
  return some;
}

/// Resets some worlds, which become worlds of another variant. Returns how many did.
size_t MoveSome(Twins* twins, RandomSource* random) {
  const auto last = static_cast<int>(twins->variants()) - 1;
  const auto variant = static_cast<uint32_t>(random->Int(0, last));
  const Ids some = SomeOf(twins->ids(), random);
  size_t moved = 0;
  for (const uint32_t id : some) moved += twins->variant(id) != variant;
  twins->Reset(some, random->Next(), variant);
  return moved;
}

/// Does something at random with a world, and the same with its twin.
void ActOn(Twins* twins, uint32_t id, RandomSource* random, Happened* happened) {
  WorldPool& pool = twins->pool();
  const std::vector<uint32_t>& models = twins->models(id);
  switch (random->Int(0, 7)) {
    case 0:
      twins->InBoth(id, [](World& world) { world.AddUpdateCallback(DoNothing, nullptr); });
      break;
    case 1:
      twins->InBoth(id, [](World& world) { world.RemoveUpdateCallback(DoNothing, nullptr); });
      break;
    case 2:
      if (twins->variants() > 1 && random->OneIn(2))
        happened->moves += MoveSome(twins, random);
      else
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
    // Devices do not know several update intervals.
    const ClosedWorldKind kind{random.OneIn(2),  random.OneIn(2),
                               random.Int(1, 5), 3,
                               random.OneIn(2),  random.OneIn(on_device ? 6 : 3)};
    const std::string text = ClosedWorld(kind, &random);
    SCOPED_TRACE("seed " + std::to_string(seed) + "\n" + text);
    std::vector<uint64_t> seeds(static_cast<size_t>(random.Int(1, 9)));
    for (uint64_t& of_world : seeds) of_world = random.Next();
    Twins twins(text, seeds, Options());
    ASSERT_EQ(twins.pool().WhyNotClosed(0), "");
    for (const uint32_t id : twins.ids()) {
      if (random.OneIn(2)) twins.Drive(id, &random);
      for (const uint32_t model : twins.models(id))
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
  EXPECT_EQ(happened.on_device > 2 * Worlds(), on_device) << happened.on_device;
}

/// Worlds of one pool that have nothing in common.
class PoolVariants : public testing::TestWithParam<unsigned> {};

TEST_P(PoolVariants, WorldsEqualThoseAloneWhateverIsDoneWithThem) {
  const bool on_device = GetParam() == kOnDevice;
  if (on_device && !device::WhyNone().empty()) GTEST_SKIP() << device::WhyNone();
  InitLibrary();
  Happened happened;
  for (uint64_t seed = 1; seed <= Worlds(); seed++) {
    RandomSource random(seed * 100 + GetParam() + 50);
    std::vector<std::string> texts;
    for (int i = random.Int(2, 5); i > 0; i--) {
      const ClosedWorldKind kind{random.OneIn(on_device ? 6 : 2),
                                 random.OneIn(2),
                                 random.Int(1, 5),
                                 3,
                                 random.OneIn(2),
                                 random.OneIn(3)};
      texts.push_back(ClosedWorld(kind, &random));
      if (random.OneIn(4)) texts.back() += "position( pose [3 3 0 0] gripper() )\n";  // not closed
    }
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::vector<uint64_t> seeds(static_cast<size_t>(random.Int(1, 9)));
    std::vector<uint32_t> variants;
    for (uint64_t& of_world : seeds) {
      of_world = random.Next();
      variants.push_back(static_cast<uint32_t>(random.Next() % texts.size()));
    }
    WorldPoolOptions options;
    options.device_steps = on_device;
    options.threads = on_device ? 2 : GetParam();
    Twins twins(texts, seeds, variants, options);
    for (const uint32_t id : twins.ids()) {
      EXPECT_EQ(twins.pool().Variant(id), twins.variant(id));
      for (const uint32_t model : twins.models(id))
        if (random.OneIn(2)) twins.Subscribe(id, model);
    }
    ASSERT_NO_FATAL_FAILURE(ExpectEqual(&twins));
    ASSERT_NO_FATAL_FAILURE(RunAtRandom(&twins, &random, 25, &happened));
  }
  EXPECT_GT(happened.rows, 100u);
  EXPECT_GT(happened.worlds, 100u);
  EXPECT_GT(happened.came_back, Worlds() / 2);
  EXPECT_GT(happened.moves, Worlds());
  EXPECT_GT(happened.copies, Worlds() / 4);
  EXPECT_EQ(happened.on_device > 2 * Worlds(), on_device) << happened.on_device;
}

std::string Corridor(size_t width) {
  return "resolution 0.02\nmodel( size [9 0.1 1] pose [0 " + std::to_string(width) +
         " 0 0] )\nposition( size [0.3 0.3 0.3] alwayson 1 velocity [0.5 0.3 0 20] "
         "ranger( alwayson 1 sensor( range [0 4] fov 360 samples 12 ) ) )\n";
}

TEST(PoolVariantsSizes, ManyVariantsAndWorldsEqualWorldsAlone) {
  InitLibrary();
  constexpr size_t kVariants = 100;
  std::vector<std::unique_ptr<World>> prototypes;
  std::vector<const World*> pointers;
  for (size_t i = 0; i < kVariants; i++) {
    prototypes.push_back(LoadText(Corridor(1 + i), 7));
    pointers.push_back(prototypes.back().get());
  }
  std::vector<uint64_t> expected;
  for (const auto& world : prototypes) {
    for (int step = 0; step < 20; step++) world->Update();
    expected.push_back(world->StateHash());
  }
  for (const size_t worlds : {1, 99, 1000}) {
    std::vector<uint32_t> variants;
    for (size_t i = 0; i < worlds; i++)
      variants.push_back(static_cast<uint32_t>(i * 7 % kVariants));
    WorldPoolOptions options;
    options.threads = 2;
    WorldPool pool(pointers, std::vector<uint64_t>(worlds, 7), variants, options);
    pool.Step(pool.All(), 20);
    for (uint32_t& variant : variants) variant = static_cast<uint32_t>((variant + 1) % kVariants);
    pool.Reset(pool.All(), std::vector<uint64_t>(worlds, 7), variants);
    pool.Step(pool.All(), 20);
    const std::vector<uint64_t> hashes = pool.StateHashes(pool.All());
    for (size_t i = 0; i < worlds; i++) ASSERT_EQ(hashes[i], expected[variants[i]]) << i;
  }
}

TEST(PoolVariantsSizes, ResizingKeepsWorldsAndMakesOnesOfTheFirstVariant) {
  InitLibrary();
  const auto a = LoadText(Corridor(1), 1), b = LoadText(Corridor(2), 1);
  WorldPool pool({a.get(), b.get()}, {1, 2, 3, 4}, {1, 0, 1});
  EXPECT_EQ(pool.CountVariants(), 2u);
  pool.Step(pool.All(), 5);
  const std::vector<uint64_t> before = pool.StateHashes(pool.All());
  pool.Resize({1, 2});
  pool.Resize({1, 2, 8, 4, 9});
  std::vector<uint32_t> variants;
  for (const uint32_t id : pool.All()) variants.push_back(pool.Variant(id));
  EXPECT_EQ(variants, (std::vector<uint32_t>{1, 0, 0, 0, 0}));
  pool.Step({2, 3, 4}, 5);
  std::vector<uint64_t> after = pool.StateHashes(pool.All());
  EXPECT_EQ(after[0], before[0]);
  EXPECT_EQ(after[1], before[1]);
  EXPECT_EQ(after[3], before[3]);
  WorldPool other(pool, {1, 2});
  EXPECT_EQ(other.Variant(0), 1u);
  other.Step(other.All(), 5);
  EXPECT_EQ(other.StateHashes({0})[0], before[0]);
}

TEST(PoolVariantsSizes, ASnapshotWithMoreModelsFailsInOneLine) {
  InitLibrary();
  const auto one = LoadText(Corridor(1), 1), two = LoadText(Corridor(1) + "position()\n", 1);
  WorldPool pool({one.get(), two.get()}, {1, 2}, {0, 1});
  pool.Step(pool.All(), 3);
  Snapshot snapshot;
  ASSERT_TRUE(pool.Take(1, &snapshot));
  pool.Restore(pool.All(), snapshot);
  EXPECT_EQ(pool.Failure(1), "");
  EXPECT_EQ(pool.Failure(0),
            "stage: cannot restore the snapshot: found a snapshot of another world file");
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

/// Commands the robots of rows in every third step, which may be made at once.
class Driver : public StepObserver {
 public:
  Driver(WorldPool* pool, bool at_once) : pool_(*pool), at_once_(at_once), calls_(pool->size()) {}
  void BeforeStep(uint32_t id, uint64_t step) override {
    calls_[id]++;
    if (step % 3 != 0) return;
    const PoolRow row = PoolAccess::RowToChange(pool_, id);
    const size_t robots = row.rows->scene().movers.size();
    for (size_t k = 0; k < robots; k++) {
      if (!row.rows->scene().movers[k].runs) continue;
      row.rows->columns.mode[row.row * robots + k] = DriveInput::kVelocity;
      row.rows->columns.command[row.row * robots + k] = {0.3, 0, 0.1 * static_cast<double>(step)};
    }
  }
  void AfterStep(uint32_t, uint64_t step) override {
    EXPECT_TRUE(!at_once_ || has_controllers || step % 3 == 2 || step == kSteps - 1) << step;
  }
  uint64_t StepsAtOnce(uint32_t, uint64_t step) override { return at_once_ ? 3 - step % 3 : 1; }

  static constexpr uint64_t kSteps = 14;
  bool has_controllers = false;
  uint64_t CallsOf(uint32_t id) const { return calls_[id]; }

 private:
  WorldPool& pool_;
  const bool at_once_;
  std::vector<uint64_t> calls_;
};

TEST(PoolRowsOfObservers, StepsMadeAtOnceHaveTheResultsOfSingleOnes) {
  InitLibrary();
  for (uint64_t seed = 1; seed <= 2 * Worlds(); seed++) {
    RandomSource random(seed);
    const ClosedWorldKind kind{random.OneIn(2), random.OneIn(2), 4, 3,
                               random.OneIn(3), random.OneIn(3)};
    const std::string text = ClosedWorld(kind, &random);
    SCOPED_TRACE("seed " + std::to_string(seed) + "\n" + text);
    const std::vector<uint64_t> seeds = {1, 2, 3};
    std::vector<std::vector<uint64_t>> hashes;
    for (const bool at_once : {false, true}) {
      const std::unique_ptr<World> prototype = LoadText(text, 1);
      WorldPool pool(*prototype, seeds);
      for (const uint32_t id : pool.All())
        for (const Model* model : prototype->engine().models)
          if (model->GetModelType() != "model") pool.Subscribe(id, model->GetId());
      Driver driver(&pool, at_once);
      driver.has_controllers = !PoolAccess::SceneOf(pool, 0)->controls.groups.empty();
      pool.Step(pool.All(), Driver::kSteps, &driver, Driver::kSteps);
      hashes.push_back(pool.StateHashes(pool.All()));
      EXPECT_EQ(driver.CallsOf(0), at_once && !driver.has_controllers ? 5u : 14u);
    }
    EXPECT_EQ(hashes[0], hashes[1]);
  }
}

TEST_P(PoolRows, WorldsWithThingsAtOtherPlacesStayRows) {
  const bool on_device = GetParam() == kOnDevice;
  if (on_device && !device::WhyNone().empty()) GTEST_SKIP() << device::WhyNone();
  InitLibrary();
  size_t things = 0, steps_on_device = 0;
  for (uint64_t seed = 1; seed <= Worlds(); seed++) {
    RandomSource random(seed * 100 + GetParam());
    const ClosedWorldKind kind{
        !on_device && random.OneIn(2), random.OneIn(2), random.Int(1, 5), 3, random.OneIn(2),
        !on_device && random.OneIn(3)};
    const std::string text = ClosedWorld(kind, &random);
    SCOPED_TRACE("seed " + std::to_string(seed) + "\n" + text);
    WorldPoolOptions options = Options();
    options.placed = Twins::SomeThings(text, &random);
    things += options.placed.size();
    Twins twins(text, {random.Next(), random.Next(), random.Next(), random.Next()}, options);
    for (const uint32_t id : twins.ids()) {
      ASSERT_EQ(twins.pool().WhyNotClosed(id), "");
      for (const uint32_t model : twins.models(id))
        if (random.OneIn(2)) twins.Subscribe(id, model);
    }
    bool copied = false;  // a snapshot may lack where a thing was when its sensors last updated
    for (int round = 0; round < 20; round++) {
      for (const uint32_t id : twins.ids()) {
        if (random.OneIn(2)) twins.PlaceThings(id, options.placed, &random);
        if (random.OneIn(2)) twins.Drive(id, &random);
        if (random.OneIn(20)) twins.Reset(id, random.Next());
      }
      if (round > 10 && random.OneIn(6)) {
        twins.Copy(0, 3);
        copied = true;
      }
      twins.Step(twins.ids(), static_cast<uint64_t>(random.Int(0, 5)), nullptr);
      for (const uint32_t id : twins.ids())
        if (on_device) steps_on_device += twins.pool().WhyNotOnDevice(id).empty();
      ASSERT_GE(twins.rows() + copied, twins.ids().size());
      ASSERT_NO_FATAL_FAILURE(ExpectEqual(&twins)) << "round " << round;
    }
  }
  EXPECT_GT(things, Worlds() / 2);
  EXPECT_EQ(steps_on_device > 100, on_device);
}

TEST(PoolRowsOfThings, AThingThatIsNotListedNeedsAWorldObject) {
  InitLibrary();
  const std::string text = "position( alwayson 1 ) model( name \"box\" pose [2 0 0 0] )\n";
  Twins twins(text, {1, 2}, WorldPoolOptions());
  twins.Step(twins.ids(), 3, nullptr);
  RandomSource random(1);
  const auto place = [&] {
    while (twins.rows() == 2) twins.PlaceThings(1, {"box"}, &random);
  };
  place();
  twins.Step(twins.ids(), 40, nullptr);
  ExpectEqual(&twins);
  EXPECT_EQ(twins.rows(), 1u);
  EXPECT_EQ(twins.pool().WhyNotClosed(0), "");
  EXPECT_NE(twins.pool().WhyNotClosed(1), "");
  EXPECT_FALSE(twins.pool().Place(0, 12345, 0, 0, 0));
  EXPECT_FALSE(twins.pool().Place(0, 2, 0, NAN, 0));
  EXPECT_FALSE(twins.pool().Place(2, 2, 0, 0, 0));
}

/// With contacts of outlines, a row has a thing that senses where it was after loading.
TEST(PoolRowsOfThings, AThingThatSensesAndIsNotListedNeedsAWorldObject) {
  InitLibrary();
  Twins twins(
      "position( ctrl \"stage/goal x=5 y=0\" )\n"
      "model( name \"box\" pose [2 0 0 0] ranger( alwayson 1 sensor( range [0 3] samples 9 ) ) )\n",
      {1, 2, 3}, WorldPoolOptions());
  twins.Step(twins.ids(), 3, nullptr);
  EXPECT_EQ(twins.rows(), 3u);
  RandomSource random(1);
  while (twins.rows() == 3) twins.PlaceThings(1, {"box"}, &random);
  for (int i = 0; i < 60; i++) {
    twins.Step(twins.ids(), 1, nullptr);
    ASSERT_NO_FATAL_FAILURE(ExpectEqual(&twins)) << i;
  }
  EXPECT_EQ(twins.rows(), 2u);
}

TEST(PoolRowsOfPopulations, MembersThatStandAndSenseAreInTheWayWhereTheSeedPutsThem) {
  InitLibrary();
  Twins twins(
      "define box model( size [0.5 0.5 0.5] ranger( alwayson 1 sensor( range [0 3] samples 9 ) ) "
      ")\n"
      "population( name \"boxes\" model \"box\" count 20 area [-4 -4 4 4] )\n"
      "position( pose [-5 0 0 0] ctrl \"stage/goal x=5 y=0\" )\n"
      "position( pose [-5 1 0 0] ctrl \"stage/goal x=5 y=1\" )\n",
      {1, 2, 3, 4}, WorldPoolOptions());
  for (int i = 0; i < 5; i++) {
    twins.Step(twins.ids(), 40, nullptr);
    ExpectEqual(&twins);
    EXPECT_EQ(twins.rows(), 4u);
  }
}

/// A controller of a client. It fails in worlds whose random numbers say so.
class Swerves : public BatchController {
 public:
  std::shared_ptr<const ControllerParameters> Prepare(ControllerSetup* setup) const override {
    if (ModelRanger* const ranger = setup->FindUnusedRanger()) setup->Use(ranger);
    return nullptr;
  }
  size_t memory_size() const override { return 1; }
  void Step(const ControllerBatch& batch) const override {
    for (size_t i = 0; i < batch.worlds * batch.robots; i++) {
      const double* const ranges = batch.RangesOf(i / batch.robots, i % batch.robots, 0);
      batch.memory[i] += batch.random[i].Uniform(0, ranges ? ranges[0] : 0);
      if (batch.random[i].Choose(200) == 0) throw std::runtime_error("swerved too far");
      batch.command[i] = {0.3, 0, batch.memory[i] - 0.2 * batch.time[i / batch.robots]};
    }
  }
};

TEST(PoolRowsOfClients, ControllersOfClientsAreCalledBetweenStepsOfADevice) {
  if (!device::WhyNone().empty()) GTEST_SKIP() << device::WhyNone();
  InitLibrary();
  static const Swerves controller;
  RegisterBatchController("swerves", &controller);
  const auto world = LoadText(
      "contacts \"cells\"\nmodel( pose [1.5 0 0 0] size [0.1 4 1] )\n"
      "define bot position( size [0.3 0.3 0.3] ctrl \"swerves\" localization \"odom\"\n"
      "  ranger( sensor( range [0 3] fov 270 samples 9 ) ) )\n"
      "bot( pose [0 0 0 0] ) bot( pose [0 1 0 90] odom_noise [0.1 0.1 0.1 0.1] )\n",
      1);
  WorldPoolOptions options;
  options.threads = 2;
  WorldPool host(*world, {1, 2, 3, 4, 5, 6, 7, 8, 9}, options);
  options.device_steps = true;
  WorldPool device(*world, {1, 2, 3, 4, 5, 6, 7, 8, 9}, options);
  size_t failed = 0;
  for (int round = 0; round < 12; round++) {
    for (WorldPool* pool : {&host, &device}) pool->Step(pool->All(), 5, nullptr, 5);
    for (uint32_t id = 0; id < 9; id++) {
      ASSERT_EQ(device.Failure(id), host.Failure(id)) << id << " in round " << round;
      failed += !host.Failure(id).empty();
      if (host.Failure(id).empty()) {
        EXPECT_EQ(device.WhyNotOnDevice(id), "");
        ASSERT_EQ(device.StateHashes({id}), host.StateHashes({id})) << id << " in round " << round;
      } else {
        for (WorldPool* pool : {&host, &device}) pool->Reset({id}, {uint64_t{10} * id + 1});
      }
    }
  }
  EXPECT_GT(failed, 2u);
  EXPECT_LT(failed, 60u);
}

INSTANTIATE_TEST_SUITE_P(Threads, PoolVariants, testing::Values(1u, 2u, 4u, kOnDevice));
INSTANTIATE_TEST_SUITE_P(Threads, PoolRows, testing::Values(1u, 2u, 7u, 16u, kOnDevice));

}  // namespace
}  // namespace Stg
