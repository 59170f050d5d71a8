// SPDX-License-Identifier: GPL-2.0-or-later
//
// Rows against worlds: a row, written into a world, has the hash and the snapshot of a world that
// made the same steps alone.

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <memory>
#include <string>
#include <vector>

#include "geometry/load_error.hh"
#include "rows/row_bridge.hh"
#include "support/closed_world.hh"
#include "support/model_testing.hh"
#include "support/random_source.hh"
#include "support/saved_difference.hh"
#include "world/engine.hh"
#include "world/snapshot.hh"

namespace {

using Stg::test::ClosedWorldKind;
using Stg::test::RandomSource;

/// A world file, and which of its models run.
struct Loaded {
  std::string text;
  uint64_t idle = 0;  ///< see SubscribeToMost()
};

std::unique_ptr<Stg::World> LoadSeeded(const Loaded& loaded, uint64_t seed) {
  Stg::InitLibrary();
  Stg::RunOptions options;
  options.seed = seed;
  options.threads = 1;
  options.listed = false;
  auto world = std::make_unique<Stg::World>(options);
  std::istringstream content(loaded.text);
  EXPECT_TRUE(world->Load(content, "t.world")) << loaded.text;
  Stg::test::SubscribeToMost(world.get(), loaded.idle);
  return world;
}

/// The robot of each mover of the scene, in a world; null for things.
std::vector<Stg::ModelPosition*> RobotsOf(Stg::World* world, const Stg::rows::Scene& scene) {
  std::vector<Stg::ModelPosition*> robots;
  for (const Stg::rows::Mover& mover : scene.movers)
    robots.push_back(dynamic_cast<Stg::ModelPosition*>(world->FindModel(mover.model->GetId())));
  return robots;
}

/// Gives the same random command to a robot of a world and of a row.
void Command(RandomSource* random, Stg::ModelPosition* robot, Stg::rows::Rows* rows, size_t i) {
  const double x = random->Real(-1, 1), y = random->Real(-1, 1), a = random->Real(-2, 2);
  const bool car = rows->scene().movers[i % rows->scene().movers.size()].steers;
  int mode = car ? 1 : random->Int(0, 8);
  if (mode > 2) mode = 1;
  if (mode == 0) robot->SetAcceleration(x, y, a);
  if (mode == 1) robot->SetSpeed(x, y, a);
  if (mode == 2) robot->GoTo(x, y, a);
  rows->columns.mode[i] = static_cast<uint8_t>(mode);
  rows->columns.command[i] = {x, y, a};
}

/// Events in rows, which show that the worlds exercise the code.
struct Events {
  size_t stalls = 0, hits = 0, pushes = 0, empty_packs = 0;
  size_t bumps = 0, fiducials = 0, hidden_fiducials = 0, blobs = 0;
  size_t placed_by_seed = 0, unread_worlds = 0;
  size_t idle_robots = 0, pushed_idle_robots = 0, idle_worlds = 0, several_rates = 0;

  /// Counts robots without subscribers, and those that others have pushed in a step.
  void CountIdle(const Stg::rows::Rows& rows) {
    const Stg::rows::Scene& scene = rows.scene();
    idle_worlds += scene.IsIdle();
    several_rates += !scene.HasOneRate();
    for (size_t i = 0; i < rows.columns.pose.size(); i++) {
      const Stg::rows::Mover& mover = scene.movers[i % scene.movers.size()];
      if (!mover.robot || mover.runs) continue;
      idle_robots++;
      if (!rows.columns.made.empty()) pushed_idle_robots += !rows.columns.made[i].IsZero();
    }
  }
  void Count(const Stg::rows::Rows& rows) {
    CountIdle(rows);
    placed_by_seed += rows.scene().populations != nullptr;
    for (const Stg::rows::Bump& bump : rows.columns.bumps)
      bumps += bump.model != Stg::rows::Bump::kNobody;
    for (const uint8_t found : rows.columns.found) (found ? fiducials : hidden_fiducials)++;
    for (const uint32_t seen : rows.columns.blobs_seen) blobs += seen;
    const Stg::rows::Scene& scene = rows.scene();
    const Stg::rows::Columns& c = rows.columns;
    for (const uint8_t stalled : c.stalled) stalls += stalled;
    for (const uint8_t brightness : c.brightness) hits += brightness > 0;
    for (const double stored : c.stored) empty_packs += stored == 0;
    for (size_t i = 0; i < c.before.size(); i++)
      if (scene.movers[i % scene.movers.size()].is_pushed && c.steps[0] > 0)
        pushes += c.before[i].x != c.pose[i].x;
  }
};

/// Compares rows with worlds that are stepped alone.
class Comparison {
 public:
  Comparison(const Loaded& loaded, std::vector<uint64_t> seeds) : loaded_(loaded), seeds_(seeds) {
    std::string reason;
    scene_ = Stg::RowBridge::MakeScene(LoadSeeded(loaded, 77), &reason);
    EXPECT_TRUE(scene_) << reason << "\n" << loaded.text;
    if (!scene_) return;
    rows_ = std::make_unique<Stg::rows::Rows>(scene_, seeds);
    for (const uint64_t seed : seeds) worlds_.push_back(LoadSeeded(loaded, seed));
    read_ = std::make_unique<Stg::rows::Rows>(scene_, std::vector<uint64_t>{3});
    written_ = LoadSeeded(loaded, 5);
  }

  bool ready() const { return rows_ != nullptr; }

  void Step(RandomSource* random, int steps, Events* events) {
    const auto scratch = rows_->MakeScratch();
    const size_t robots = scene_->movers.size();
    for (int step = 0; step < steps; step++) {
      for (size_t i = 0; i < worlds_.size(); i++) {
        const std::vector<Stg::ModelPosition*> models = RobotsOf(worlds_[i].get(), *scene_);
        for (size_t k = 0; k < robots; k++)
          if (models[k] && random->OneIn(10))
            Command(random, models[k], rows_.get(), i * robots + k);
        worlds_[i]->Update();
        rows_->Step(i, 1, scratch.get());
      }
      events->Count(*rows_);
    }
  }
  void Reset(size_t i, uint64_t seed) {
    seeds_[i] = seed;
    worlds_[i] = LoadSeeded(loaded_, seed);
    rows_->Reset(i, seed);
  }

  /// True if world i can be read into a row, which goes on as the world does. Row i is replaced by
  /// what was read.
  bool ReadBack(size_t i) {
    if (!Stg::RowBridge::Read(worlds_[i].get(), read_.get(), 0, written_.get())) return false;
    rows_->Copy(i, *read_, 0);
    return true;
  }

  /// True if something may have been pushed since it sensed. A World knows the pose of a robot
  /// without subscribers now, and that of a thing before the last step as well, but no earlier one.
  bool MayHaveForgottenPoses(size_t i) const {
    const bool updated_now = rows_->LastUpdate(i, 0) == rows_->columns.time[i];
    return std::ranges::any_of(scene_->movers, [&](const Stg::rows::Mover& m) {
      return m.is_pushed ? !updated_now : m.robot && !m.runs;
    });
  }

  /// Says what differs between row i and world i; empty if nothing does.
  std::string Difference(size_t i) {
    Stg::World& world = *worlds_[i];
    if (!Stg::RowBridge::Write(*rows_, i, written_.get())) return "the row cannot be written";
    if (world.StateHash() == written_->StateHash()) {
      Stg::Snapshot of_world, of_row;
      if (!world.Take(&of_world) || !written_->Take(&of_row)) return "no snapshot";
      return of_world.hash() == of_row.hash()
                 ? ""
                 : "the snapshots differ" + Stg::test::SavedDifference(world, *written_);
    }
    std::string text = "at step " + std::to_string(world.GetUpdateCount()) + ":";
    for (Stg::Model* model : world.engine().models) {
      Stg::Model* const other = written_->FindModel(model->GetId());
      Stg::StateExchange a(world.engine().models), b(written_->engine().models);
      model->ExchangeState(a);
      other->ExchangeState(b);
      if (a.hash() != b.hash())
        text += " " + model->TokenStr() + " " + model->GetPose().String() + " " +
                other->GetPose().String() + (model->Stalled() ? " stalled" : "") +
                (other->Stalled() ? " row stalled" : "");
      if (auto* ranger = dynamic_cast<Stg::ModelRanger*>(model))
        text += RangeDifference(*ranger, static_cast<Stg::ModelRanger&>(*other));
    }
    return text;
  }

 private:
  static std::string RangeDifference(const Stg::ModelRanger& a, const Stg::ModelRanger& b) {
    std::string text;
    for (size_t s = 0; s < a.GetSensors().size(); s++)
      for (size_t i = 0; i < a.GetSensors()[s].ranges.size(); i++) {
        const double x = a.GetSensors()[s].ranges[i], y = b.GetSensors()[s].ranges[i];
        const double p = a.GetSensors()[s].intensities[i], q = b.GetSensors()[s].intensities[i];
        if (x != y || p != q)
          text += " [" + std::to_string(s) + "," + std::to_string(i) + ": " + std::to_string(x) +
                  "/" + std::to_string(y) + " " + std::to_string(p) + "/" + std::to_string(q) + "]";
      }
    return text;
  }

  Loaded loaded_;
  std::vector<uint64_t> seeds_;
  std::shared_ptr<const Stg::rows::Scene> scene_;
  std::unique_ptr<Stg::rows::Rows> rows_, read_;
  std::vector<std::unique_ptr<Stg::World>> worlds_;
  std::unique_ptr<Stg::World> written_;
};

/// Number of random worlds of each kind; more for a long search.
uint64_t Worlds() {
  const char* const wanted = std::getenv("STAGE_RANDOM_WORLDS");
  return wanted ? std::strtoull(wanted, nullptr, 10) : 80;
}

struct Case {
  bool outlines, exact;
};

/// Models without subscribers: none, a quarter of them, or all.
uint64_t RandomIdle(RandomSource* random) {
  if (random->OneIn(10)) return ~uint64_t{0};
  return random->OneIn(2) ? 0 : random->Next() & random->Next();
}

class RandomClosedWorlds : public testing::TestWithParam<Case> {};

TEST_P(RandomClosedWorlds, RowsHaveTheStatesOfWorldsStepByStep) {
  const auto [outlines, exact] = GetParam();
  Events events;
  for (uint64_t seed = 1; seed <= Worlds(); seed++) {
    RandomSource random(seed * 1000 + outlines * 10 + exact);
    const ClosedWorldKind kind{outlines,          exact,         random.Int(0, 8),
                               random.Real(1, 6), seed % 3 == 0, seed % 5 < 2};
    const std::string text = ClosedWorld(kind, &random);
    Comparison comparison({text, RandomIdle(&random)}, {random.Next(), random.Next()});
    if (!comparison.ready()) continue;
    for (size_t i = 0; i < 2; i++) ASSERT_EQ(comparison.Difference(i), "") << seed << "\n" << text;
    for (int round = 0; round < 12; round++) {
      comparison.Step(&random, round < 4 ? 1 : 10, &events);
      for (size_t i = 0; i < 2; i++)
        ASSERT_EQ(comparison.Difference(i), "") << seed << " round " << round << "\n" << text;
      if (round % 3 == 1 && !comparison.ReadBack(round % 2)) {
        ASSERT_TRUE(comparison.MayHaveForgottenPoses(round % 2))
            << seed << " round " << round << "\n"
            << text;
        events.unread_worlds++;
      }
      if (round == 6) comparison.Reset(0, random.Next());
    }
  }
  EXPECT_GT(events.stalls, 1000u);
  EXPECT_GT(events.hits, 10000u);
  EXPECT_GT(events.empty_packs, 100u);
  EXPECT_EQ(events.pushes > 100, outlines) << events.pushes;
  EXPECT_GT(events.bumps, 1000u);
  EXPECT_GT(events.fiducials, 1000u);
  EXPECT_GT(events.hidden_fiducials, 1000u);
  EXPECT_GT(events.blobs, 1000u);
  EXPECT_GT(events.placed_by_seed, 1000u);
  EXPECT_GT(events.idle_robots, 1000u);
  EXPECT_LT(events.unread_worlds, outlines ? 20u : 1u);
  EXPECT_GT(events.idle_worlds, 100u);
  EXPECT_GT(events.several_rates, 100u);
  EXPECT_EQ(events.pushed_idle_robots > 20, outlines) << events.pushed_idle_robots;
}

INSTANTIATE_TEST_SUITE_P(Kinds, RandomClosedWorlds,
                         testing::Values(Case{false, false}, Case{false, true}, Case{true, false},
                                         Case{true, true}));

TEST(Rows, ResetThrowsIfTheMembersOfAPopulationDoNotFit) {
  const Loaded loaded{
      "define bot position( size [0.4 0.4 0.3] )\n"
      "population( name \"bots\" model \"bot\" count 3 area [0 0 0.7 0.7] gap 0.05 )\n"};
  const auto load = [&](uint64_t seed) {
    Stg::RunOptions options;
    options.seed = seed;
    options.listed = false;
    auto world = std::make_unique<Stg::World>(options);
    std::istringstream content(loaded.text);
    return world->Load(content, "t.world") ? std::move(world) : nullptr;
  };
  std::unique_ptr<Stg::rows::Rows> rows;
  size_t failures = 0;
  for (uint64_t seed = 1; seed <= 20; seed++) {
    auto world = load(seed);
    failures += !world;
    if (!rows && world) {
      std::string reason;
      const uint64_t seeds[] = {seed};
      const auto scene = Stg::RowBridge::MakeScene(std::move(world), &reason);
      ASSERT_TRUE(scene) << reason;
      rows = std::make_unique<Stg::rows::Rows>(scene, seeds);
    } else if (rows && world) {
      EXPECT_NO_THROW(rows->Reset(0, seed)) << seed;
    } else if (rows) {
      EXPECT_THROW(rows->Reset(0, seed), Stg::LoadError) << seed;
    }
  }
  EXPECT_GT(failures, 0u);
  EXPECT_LT(failures, 19u);
}

}  // namespace
