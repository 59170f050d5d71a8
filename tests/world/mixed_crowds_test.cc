// SPDX-License-Identifier: GPL-2.0-or-later
//
// Crowds with a mixture of all types of sensors, actuators and callbacks: several threads give the
// same results as one, and finding parallel work is cheap.

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "support/all_models.hh"
#include "support/crowd.hh"
#include "support/emulated.hh"
#include "support/model_testing.hh"
#include "support/sanitized.hh"
#include "world/engine.hh"
#include "world/phases/move_phase.hh"

namespace {

/// Devices that robots carry.
const char* const kParts[] = {
    "ranger( sensor( range [0 4] fov 270 samples 16 ) )",
    "ranger( sensor( range [0 4] fov 90 samples 5 noise [0.01 0.05 0.5] ) sensor( samples 2 ) )",
    "ranger( sensor( range [0 3] samples 3 ray_model \"exact\" ) )",
    "fiducial( range_max 5 range_max_id 3 fov 300 )",
    "blobfinder( image [30 20] range 5 )",
    "bumper( bcount 2 bpose[0] [0.2 0.1 0 30] bpose[1] [0.2 -0.1 0 -30] blength 0.2 )",
    "gripper( size [0.2 0.3 0.2] pose [0.25 0 -0.2 0] autosnatch 1 )",
    "wifi( model \"raytrace\" power 20 sensitivity -40 )",
    "wifi( model \"log distance\" power 20 sensitivity -40 )",
    "camera( resolution [16 12] range [0.2 6] )",
    // NOLINTNEXTLINE(bugprone-suspicious-missing-comma)
    "actuator( type \"linear\" axis [1 0 0] size [0.1 0.1 0.1] max_speed 0.2 min_position -0.1 "
    "max_position 0.3 )",
    "actuator( type \"rotational\" axis [0 0 1] size [0.1 0.3 0.1] max_speed 1 ranger( sensor( "
    "samples 4 ) ) )",
    "position( size [0.1 0.1 0.1] pose [0.2 0 0 0] )",
    "blinkenlight( period 250 intensity 0.5 )",
    "lightsensor( range 3 directions [0 90] noise [0.01 0.1] )",
    "model( size [0.1 0.1 0.1] update_interval 200 )",
};
constexpr int kPartCount = std::size(kParts);

/// Robot `i` with these devices, and a thing beside it that can be gripped.
std::string Robot(int i, double spacing, const std::vector<std::string>& parts) {
  const auto number = [](double value) { return std::to_string(value); };
  const int row = i / 12;
  const double x = spacing * (i % 12), y = spacing * row;
  std::string text = "position( size [0.4 0.3 0.3] fiducial_return " + std::to_string(i + 1) +
                     " color \"" + (i % 3 ? "red" : "blue") + "\" pose [" + number(x) + " " +
                     number(y) + " 0 " + std::to_string(i * 37 % 360) + "]";
  if (i % 7 == 0) text += " update_interval 200";
  for (const std::string& part : parts) text += " " + part;
  return text + " )\nmodel( size [0.1 0.1 0.2] gripper_return 1 pose [" + number(x + 0.45) + " " +
         number(y) + " 0 0] )\n";
}

/// Robots with different selections of the devices.
std::string MixedRobots(int count) {
  return crowd::Repeat(count, [](int i) {
    std::vector<std::string> parts;
    for (int k = 0; k < kPartCount; k++)
      if ((i * 5 + k * 3) % 7 < 3) parts.emplace_back(kParts[k]);
    return Robot(i, 0.9, parts);
  });
}

std::vector<Stg::Model*> ModelsOf(Stg::World* world) {
  std::vector<Stg::Model*> models = all_models::InTree(world);
  std::erase(models, world->GetGround());
  return models;
}

// ---- callbacks ----------------------------------------------------------------------------------

int Wander(Stg::Model* model, void*) {
  const double turn = 0.7 * (static_cast<double>(model->GetWorld()->GetUpdateCount() % 7) - 3);
  static_cast<Stg::ModelPosition*>(model)->SetSpeed(model->Stalled() ? -0.3 : 0.6, 0, turn);
  return 0;
}

int Wave(Stg::Model* model, void*) {
  const bool out = model->GetWorld()->GetUpdateCount() % 8 < 4;
  static_cast<Stg::ModelActuator*>(model)->SetSpeed(out ? 0.15 : -0.2);
  return 0;
}

/// Reads other robots, so it must be called in sequence.
int Follow(Stg::Model* model, void* all) {
  double x = 0;
  for (const Stg::Model* other : *static_cast<std::vector<Stg::Model*>*>(all))
    x += other->GetPose().a + (other->Stalled() ? 1 : 0);
  static_cast<Stg::ModelPosition*>(model)->SetSpeed(0.3, 0, x - static_cast<int>(x));
  return 0;
}

/// Moves another robot during the updates; models that update later must see it.
int Push(Stg::Model* model, void* other) {
  if (model->GetWorld()->GetUpdateCount() % 3 == 1)
    static_cast<Stg::Model*>(other)->AddToPose(0.02, -0.01, 0, 0.1);
  return 0;
}

struct Mixture {
  int robots;
  int follow_every, push_every;  // every n-th robot has this callback; 0: none
};

class MixedWorld {
 public:
  MixedWorld(const Mixture& mixture, const std::string& text, const Stg::RunOptions& options) {
    Stg::InitLibrary();
    Stg::World::run_options = options;
    world_ = Stg::LoadText(text);
    Stg::World::run_options = Stg::RunOptions();
    models_ = ModelsOf(world_.get());
    int robots = 0;
    for (Stg::Model* model : models_) {
      if (dynamic_cast<Stg::ModelActuator*>(model)) {
        model->AddParallelCallback(Stg::Model::CB_UPDATE, Wave, nullptr);
      } else if (dynamic_cast<Stg::ModelPosition*>(model)) {
        AddCallbacks(model, robots++, mixture);
      }
      model->Subscribe();
    }
  }

  Stg::World& world() { return *world_; }

 private:
  void AddCallbacks(Stg::Model* robot, int number, const Mixture& mixture) {
    const auto falls_to = [&](int every) { return every > 0 && number % every == every - 1; };
    if (falls_to(mixture.follow_every))
      robot->AddCallback(Stg::Model::CB_UPDATE, Follow, &models_);
    else
      robot->AddParallelCallback(Stg::Model::CB_UPDATE, Wander, nullptr);
    if (falls_to(mixture.push_every))
      robot->AddCallback(Stg::Model::CB_VELOCITY, Push, models_[models_.size() / 2]);
  }

  std::vector<Stg::Model*> models_;
  std::unique_ptr<Stg::World> world_;
};

// ---- equal results with any number of threads ---------------------------------------------------

std::vector<uint64_t> HashesOf(const Mixture& mixture, const std::string& text,
                               const Stg::RunOptions& options) {
  MixedWorld mixed(mixture, text, options);
  std::vector<uint64_t> hashes;
  for (int step = 0; step < 12; step++) {
    mixed.world().Update();
    hashes.push_back(mixed.world().StateHash());
  }
  return hashes;
}

void ExpectSameWithAnyThreads(const Mixture& mixture) {
  const std::string text = "resolution 0.05\n" + MixedRobots(mixture.robots);
  Stg::RunOptions options;
  options.batch = false;
  const std::vector<uint64_t> expected = HashesOf(mixture, text, options);
  options.batch = true;
  EXPECT_EQ(HashesOf(mixture, text, options), expected) << "in a batch";
  for (const int share_from : {1, 16})
    for (const int threads : {2, 3, 4, 8}) {
      options.threads = threads;
      options.share_from = share_from;
      EXPECT_EQ(HashesOf(mixture, text, options), expected)
          << threads << " threads, from " << share_from;
    }
}

TEST(MixedCrowds, AllUpdateAtOnce) { ExpectSameWithAnyThreads({60, 0, 0}); }
TEST(MixedCrowds, WithCallbacksThatLookAtOthers) { ExpectSameWithAnyThreads({60, 5, 0}); }
TEST(MixedCrowds, WithCallbacksAmongTheUpdates) { ExpectSameWithAnyThreads({60, 3, 4}); }
TEST(MixedCrowds, WithCallbacksEverywhere) { ExpectSameWithAnyThreads({30, 2, 1}); }

// ---- cost of finding parallel work --------------------------------------------------------------

struct Work {
  double examined, jobs;  // per step
};

Work MeasureWork(const Mixture& mixture, const std::string& text) {
  Stg::RunOptions options;
  options.threads = 4;
  MixedWorld mixed(mixture, text, options);
  Stg::WorldEngine& engine = mixed.world().engine();
  mixed.world().Update();  // the first step also measures costs
  constexpr int kSteps = 4;
  const uint64_t examined = engine.examined(), jobs = engine.shared_jobs();
  for (int step = 0; step < kSteps; step++) mixed.world().Update();
  return {static_cast<double>(engine.examined() - examined) / kSteps,
          static_cast<double>(engine.shared_jobs() - jobs) / kSteps};
}

/// Work of the best of three worlds. Other programs on the machine can only raise the number of
/// jobs, because the minimum size of a job is measured.
Work WorkOf(const Mixture& mixture, const std::string& text) {
  Work best = MeasureWork(mixture, text);
  for (int i = 0; i < 2; i++) {
    const Work work = MeasureWork(mixture, text);
    best = {std::max(best.examined, work.examined), std::min(best.jobs, work.jobs)};
  }
  return best;
}

std::string Robots(int count, const std::vector<std::string>& parts) {
  return "resolution 0.1\n" + crowd::Repeat(count, [&](int i) { return Robot(i, 1.2, parts); });
}

constexpr int kMany = 1500;
// Max number of parallel jobs per step. The minimum size of a job is measured, and sanitizers and
// emulators lower it, because everything takes longer with them.
const double kMaxJobs = kSanitized || Stg::test::IsEmulated() ? 600 : 150;
const std::string kRanger = "ranger( sensor( range [0 4] fov 270 samples 4 ) )";
const std::string kFinder = "fiducial( range_max 2 )";
const std::string kArm = kParts[10];

TEST(MixedCrowds, ShareUpdatesOfDifferentSensors) {
  // More than 2000 models update, and more than 1000 move and have callbacks. Each is examined once
  // or twice, and threads share a few dozen jobs, mostly moves.
  const Work work = WorkOf({kMany, 0, 0}, Robots(kMany, {kRanger, kFinder}));
  EXPECT_LE(work.examined, 2 * 6 * kMany);
  EXPECT_GT(work.jobs, 4);
  EXPECT_LE(work.jobs, kMaxJobs);
}

TEST(MixedCrowds, MoveArmsInOrder) {
  const Work work = WorkOf({kMany, 0, 0}, Robots(kMany, {kArm}));
  EXPECT_LE(work.examined, 2 * 6 * kMany);
  EXPECT_LE(work.jobs, 40);
}

TEST(MixedCrowds, AlternatingCallbacksStayOnOneThread) {
  const Work work = WorkOf({kMany, 2, 0}, Robots(kMany, {kRanger}));
  EXPECT_LE(work.examined, 2 * 6 * kMany);
  EXPECT_LE(work.jobs, kMaxJobs);
}

TEST(MixedCrowds, UpdatesAmongCallbacksStayOnOneThread) {
  const Work work = WorkOf({kMany, 2, 2}, Robots(kMany, {kRanger}));
  EXPECT_LE(work.examined, 2 * 6 * kMany);
  EXPECT_LE(work.jobs, kMaxJobs);
}

/// Serial callbacks split the updates into intervals, some too short to be worth waking threads.
TEST(MixedCrowds, WakeThreadsOnlyForLongRuns) {
  const Work work = WorkOf({kMany, 12, 12}, Robots(kMany, {kRanger}));
  EXPECT_LE(work.examined, 2 * 6 * kMany);
  EXPECT_LE(work.jobs, kMaxJobs);
}

}  // namespace
