// SPDX-License-Identifier: GPL-2.0-or-later
//
// A world's future depends only on its state and not on its history: loaded from a file, reset
// after another run, restored from a snapshot, branched, or copied from a running world. In each
// case, state hashes and snapshots equal those of a fresh world at every step.
//
// The worlds are random. They span several superregions of the grid, and in each step models are
// created, deleted, teleported, resized and reparented.

#include <gtest/gtest.h>

#include <functional>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include "stage.hh"
#include "support/meddler.hh"
#include "support/model_testing.hh"
#include "support/own_worlds.hh"
#include "support/random_source.hh"
#include "support/sanitized.hh"
#include "world/ray_caster.hh"

namespace Stg {
namespace {

constexpr int kSteps = 20;
constexpr double kReach = 14;  // metres: superregions are 4 to 10 metres wide

/// Robots with devices of all types around the origin, some of which will leave it.
std::string WideWorld(uint64_t seed) {
  test::RandomSource random(seed);
  std::ostringstream text;
  text << "resolution " << random.Pick(std::vector<double>{0.004, 0.005, 0.01}) << "\n";
  if (random.OneIn(3)) text << "ray_model \"exact\"\n";
  const char* const one_sensor = random.OneIn(2) ? " ray_model \"exact\"" : "";
  text << "define robot position( size [0.4 0.4 0.3] joules 1000 alwayson 1 fiducial_return 1\n"
          "  ranger( alwayson 1 sensor( range [0 6] fov 180 samples 9 noise [0.01 0.01 0]\n"
          "      response [0 9 2 3 4 0] response_noise [0.1 0.1] )\n"
          "    sensor( range [0 3] fov 90 samples 3"
       << one_sensor
       << " ) )\n"
          "  blobfinder( alwayson 1 image [10 5] )\n"
          "  fiducial( alwayson 1 range_max 6 )\n"
          "  bumper( alwayson 1 bcount 1 bpose[0] [0.2 0 0 0] blength 0.4 )\n"
          "  camera( alwayson 1 resolution [8 6] range [0.2 30] )\n"
          "  gripper( pose [0.25 0 -0.3 0] alwayson 1 )\n"
          "  actuator( alwayson 1 size [0.1 0.1 0.1] max_speed 1 )\n"
          "  wifi( alwayson 1 model \"simple\" range 5 )\n"
          "  radio( alwayson 1 range 5 line_of_sight 1 delay 1 loss 0.1 range_noise 0.1 )\n"
          "  light() lightsensor( alwayson 1 noise [0.1 0.1] )\n"
          "  lightindicator() )\n"
          "model( name \"wall\" pose [0 2 0 0] size [3 0.2 1] )\n"
          "model( name \"puck\" pose [-1 0 0 0] size [0.1 0.1 0.2] gripper_return 1 )\n"
          "blinkenlight( intensity 1 pose [1 1 0 0] size [0.1 0.1 0.1] )\n";
  for (const std::string name : {"a", "b", "c"})
    text << "robot( name \"" << name << "\" pose [" << random.Real(-4, 4) << " "
         << random.Real(-4, 4) << " 0 " << random.Int(-180, 180) << "] velocity ["
         << random.Real(0, 4) << " 0 0 " << random.Real(-30, 30) << "] )\n";
  return text.str();
}

std::unique_ptr<World> Load(const std::string& text, RunOptions options) {
  auto world = std::make_unique<World>(options);
  std::istringstream content(text);
  EXPECT_TRUE(world->Load(content, "wide.world"));
  return world;
}

/// The state of a world after a step.
struct State {
  uint64_t hash;
  Snapshot snapshot;
};

State StateOf(const World& world) {
  EXPECT_EQ(world.Validate(), "");
  State state{world.StateHash(), Snapshot()};
  EXPECT_TRUE(world.Take(&state.snapshot));
  return state;
}

/// A run of a random world with its states, and the various ways to reach them.
class History {
 public:
  explicit History(uint64_t seed) : seed_(seed), text_(WideWorld(seed)) {
    const std::unique_ptr<World> fresh = NewWorld(seed);
    states_.push_back(StateOf(*fresh));
    for (int step = 0; step < kSteps; step++) {
      Go(fresh.get(), seed, step, 1, kReach);
      states_.push_back(StateOf(*fresh));
    }
  }

  std::unique_ptr<World> NewWorld(uint64_t seed) const { return Load(text_, OptionsOf(seed)); }
  /// A world of the same file with another history.
  std::unique_ptr<World> WorldWithAPast() const {
    std::unique_ptr<World> world = NewWorld(seed_ + 1);
    Go(world.get(), seed_ + 99, 0, 12, kReach);
    Look(world.get());
    return world;
  }
  /// Uses functions that must not change the world, such as ray casting.
  static void Look(World* world) {
    double range = 0;
    const Pose pose(1, 2, 0, 0);
    CastOptions options;
    options.ray_model = RayModel::kExact;
    EXPECT_TRUE(RayCaster(world, options).Cast(&pose, 1, {0.0}, 9, &range));
  }
  /// Steps from `step` to the end and compares states. Describes the first difference; empty: none.
  std::string Follow(World* world, int step, bool looks = false) const {
    if (world->StateHash() != states_[At(step)].hash) return Differs(step);
    for (; step < kSteps; step++) {
      Go(world, seed_, step, 1, kReach);
      if (looks) Look(world);
      const State state = StateOf(*world);
      if (state.hash != states_[At(step + 1)].hash) return Differs(step + 1);
      if (state.snapshot.hash() != states_[At(step + 1)].snapshot.hash())
        return "another snapshot after step " + std::to_string(step + 1);
    }
    return "";
  }
  std::string RestoreAndFollow(World* world, int step, const Snapshot& from) const {
    if (!world->Restore(from)) return "refused to restore step " + std::to_string(step);
    return Follow(world, step);
  }

  static size_t At(int step) { return static_cast<size_t>(step); }
  static std::string Differs(int step) { return "another hash after step " + std::to_string(step); }
  const Snapshot& snapshot(int step) const { return states_[At(step)].snapshot; }
  uint64_t seed() const { return seed_; }
  const std::string& text() const { return text_; }

 private:
  uint64_t seed_;
  std::string text_;
  std::vector<State> states_;
};

Snapshot FromBytes(const Snapshot& snapshot) {
  std::stringstream bytes;
  Snapshot read;
  EXPECT_TRUE(snapshot.Write(bytes) && read.Read(bytes));
  return read;
}

class HistoriesTest : public testing::Test {
 protected:
  static void SetUpTestSuite() { Init(nullptr, nullptr); }
  /// Calls come_by(run), which returns an error or an empty text, for random runs.
  static void Compare(const std::function<std::string(const History&)>& come_by) {
    constexpr uint64_t kRuns = kSanitized ? 4 : 10;
    SetLogSink([](LogLevel, const std::string&) {});  // discards messages about refused changes
    for (uint64_t seed = 0; seed < kRuns; seed++) EXPECT_EQ(come_by(History(seed)), "") << seed;
    SetLogSink(nullptr);
  }
};

TEST_F(HistoriesTest, SharedByThreads) {
  Compare([](const History& run) {
    RunOptions options = OptionsOf(run.seed());
    options.threads = 3;
    options.share_from = 1;
    return run.Follow(Load(run.text(), options).get(), 0);
  });
}

TEST_F(HistoriesTest, DoNotDependOnObservers) {
  Compare([](const History& run) {
    const std::unique_ptr<World> world = run.NewWorld(run.seed());
    History::Look(world.get());
    return run.Follow(world.get(), 0, true);
  });
}

TEST_F(HistoriesTest, Reset) {
  Compare([](const History& run) {
    const std::unique_ptr<World> world = run.WorldWithAPast();
    if (!world->Reset(run.seed())) return std::string("refused to reset");
    return run.Follow(world.get(), 0);
  });
}

TEST_F(HistoriesTest, CopiedFromARunningWorld) {
  Compare([](const History& run) {
    World copy(OptionsOf(run.seed()));
    if (!copy.LoadCopy(*run.WorldWithAPast())) return std::string("refused to copy");
    return run.Follow(&copy, 0);
  });
}

TEST_F(HistoriesTest, RestoredIntoItself) {
  for (const Snapshot::Keep keep : {Snapshot::kFull, Snapshot::kLean})
    Compare([keep](const History& run) {
      const std::unique_ptr<World> world = run.NewWorld(run.seed());
      test::RandomSource random(run.seed());
      for (int step = 0; step < kSteps; step++) {
        Snapshot snapshot;
        EXPECT_TRUE(world->Take(&snapshot, keep));
        Go(world.get(), run.seed() + 7, step, random.Int(1, 4), kReach);  // diverges
        if (!world->Restore(snapshot)) return "refused to restore step " + std::to_string(step);
        Go(world.get(), run.seed(), step, 1, kReach);
        if (StateOf(*world).snapshot.hash() != run.snapshot(step + 1).hash())
          return History::Differs(step + 1);
      }
      return std::string();
    });
}

TEST_F(HistoriesTest, RestoredFromEachStepIntoAnotherWorld) {
  Compare([](const History& run) {
    const std::unique_ptr<World> other = run.WorldWithAPast(), fresh = run.NewWorld(run.seed() + 2);
    const auto copy = std::make_unique<World>(OptionsOf(run.seed() + 3));
    EXPECT_TRUE(copy->LoadCopy(*other));
    for (int step = 0; step <= kSteps; step += 3)
      for (World* world : {other.get(), fresh.get(), copy.get()}) {
        std::string wrong = run.RestoreAndFollow(world, step, run.snapshot(step));
        if (wrong.empty()) wrong = run.RestoreAndFollow(world, step, FromBytes(run.snapshot(step)));
        if (!wrong.empty()) return wrong + ", restored at " + std::to_string(step);
      }
    return std::string();
  });
}

/// Repeats in a branch the changes of the run from some step on, and records the states.
class Meddling : public Scenario {
 public:
  Meddling(const History& run, int first_step) : run_(run), step_(first_step) {}
  bool AfterStep(World& world, uint32_t, double*) override {
    Meddle(&world, run_.seed(), step_++, kReach);
    if (wrong_.empty() && StateOf(world).snapshot.hash() != run_.snapshot(step_).hash())
      wrong_ = History::Differs(step_);
    return false;
  }
  const std::string& wrong() const { return wrong_; }

 private:
  const History& run_;
  int step_;
  std::string wrong_;
};

TEST_F(HistoriesTest, BranchedOff) {
  Compare([](const History& run) {
    const std::unique_ptr<World> prototype = run.WorldWithAPast();
    Branches branches(*prototype, 3);
    for (uint32_t round = 0; round < 6; round++) {  // each branch is used several times
      const uint32_t branch = round % branches.count();
      const int step = static_cast<int>(round) * 3;
      branches.Restore(branch, run.snapshot(step));
      Meddling meddling(run, step);
      branches.Step(static_cast<uint64_t>(kSteps - step), &meddling);
      branches.Retire(branch);
      if (!meddling.wrong().empty()) return meddling.wrong();
      if (branches[branch].state == Branch::kFailed) return branches[branch].error;
    }
    return std::string();
  });
}

// ---- the floor that cameras see -----------------------------------------------------------------

/// A robot drives into a superregion that was empty before; the camera behind it sees the floor
/// there. Superregions are 20.48 m wide.
constexpr char kLeaving[] =
    "resolution 0.02\n"
    "position( name \"r\" pose [19 1 0 0] size [.4 .4 .4] alwayson 1 )\n"
    "position( pose [15 1 0 0] size [.4 .4 .4] camera( name \"eye\" pose [0 0 5 0] alwayson 1\n"
    "  pantilt [0 40] resolution [16 16] range [0.2 100] ) )\n";
constexpr int kThere = 30;  // steps of 0.1 s

void Leave(World* world) {
  static_cast<ModelPosition*>(world->GetModel("r"))->SetSpeed(1, 0, 0);
  Step(*world, kThere);
}

std::vector<GLubyte> PictureOf(World* world) {
  const auto* camera = static_cast<const ModelCamera*>(world->GetModel("position:1.eye"));
  const auto bytes =
      static_cast<size_t>(camera->getWidth()) * static_cast<size_t>(camera->getHeight()) * 4;
  return {camera->FrameColor(), camera->FrameColor() + bytes};
}

TEST_F(HistoriesTest, TheFloorGrowsAgainWhenARobotLeavesItAgain) {
  const std::unique_ptr<World> fresh = Load(kLeaving, OptionsOf(1)),
                               world = Load(kLeaving, OptionsOf(1));
  Leave(fresh.get());
  EXPECT_DOUBLE_EQ(fresh->GetExtent().x.max, 40.96);
  Snapshot start;
  ASSERT_TRUE(world->Take(&start));
  for (int run = 0; run < 4; run++) {
    Leave(world.get());
    EXPECT_EQ(world->StateHash(), fresh->StateHash()) << run;
    EXPECT_EQ(PictureOf(world.get()), PictureOf(fresh.get())) << run;
    if (run % 2 == 0) {
      ASSERT_TRUE(world->Restore(start));
    } else {
      ASSERT_TRUE(world->Reset(1));
    }
    EXPECT_DOUBLE_EQ(world->GetExtent().x.max, 20.48) << run;
    Step(*world, 1);
    EXPECT_NE(PictureOf(world.get()), PictureOf(fresh.get())) << "the floor ends at 20.48 m";
    ASSERT_TRUE(world->Restore(start));
  }
}

/// A move into an empty superregion is proposed, but a post stops it before.
TEST_F(HistoriesTest, FloorDoesNotGrowByARejectedMove) {
  std::string text =
      "resolution 0.02 contacts \"cells\"\n"
      "position( name \"r\" pose [20.2 0 0 0] size [.4 .4 .4] alwayson 1 )\n"
      "model( pose [20.45 .2 0 0] size [.04 .04 .4] )\n";
  for (int i = 0; i < 20; i++)
    text += "position( pose [" + std::to_string(i % 10) + " " + std::to_string(i / 10) +
            " 0 0] size [.4 .4 .4] alwayson 1 )\n";
  std::vector<uint64_t> hashes;
  for (const int threads : {1, 3}) {
    RunOptions options = OptionsOf(1);
    options.threads = threads;
    options.share_from = 1;
    const std::unique_ptr<World> world = Load(text, options);
    auto* const robot = static_cast<ModelPosition*>(world->GetModel("r"));
    robot->SetSpeed(1, 0, 0);
    Step(*world, 3);
    EXPECT_TRUE(robot->Stalled());
    EXPECT_DOUBLE_EQ(world->GetExtent().x.max, 20.48) << threads << " threads";
    hashes.push_back(world->StateHash());
  }
  EXPECT_EQ(hashes[0], hashes[1]);
}

}  // namespace
}  // namespace Stg
