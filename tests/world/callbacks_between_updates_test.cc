// SPDX-License-Identifier: GPL-2.0-or-later
//
// CB_VELOCITY callbacks and enqueued callbacks are called while models update. Sensors that updated
// earlier have sensed the world before the callback, which sees their readings, whether rays are
// traced one by one or in a batch.

#include <gtest/gtest.h>

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "support/model_testing.hh"

namespace {

using namespace Stg;

/// A sensor of each type, then a robot with a callback, then the same sensors again. All sensors
/// look at the target.
const char kWorld[] = R"(
resolution 0.02
model( name "target" size [0.4 2 1] pose [2 0 0 0] color "red" fiducial_return 7
  gripper_return 1 )
define looker model( size [0.05 0.05 0.2] obstacle_return 0 blob_return 0 ranger_return -1
  ranger( name "ranger" alwayson 1 sensor( range [0 4] fov 20 samples 3 ) )
  fiducial( name "fiducial" alwayson 1 range_max 4 range_max_id 4 )
  blobfinder( name "blobfinder" alwayson 1 range 4 image [16 8] colors_count 1 colors [ "red" ] )
  bumper( name "bumper" alwayson 1 bcount 1 bpose[0] [1.8 0 0 0] blength 0.3 ) )
looker( name "before" pose [0 0.5 0 0] )
position( name "between" pose [-2 0 0 0] alwayson 1 )
looker( name "after" pose [0 -0.5 0 0] )
)";

/// The readings of all sensors of a looker.
std::vector<double> Sensed(World* world, const std::string& looker) {
  const auto find = [&](const char* type) { return world->GetModel(looker + "." + type); };
  std::vector<double> all;
  for (const auto& sensor : static_cast<ModelRanger*>(find("ranger"))->GetSensors()) {
    all.insert(all.end(), sensor.ranges.begin(), sensor.ranges.end());
    all.insert(all.end(), sensor.intensities.begin(), sensor.intensities.end());
  }
  for (const auto& seen : static_cast<ModelFiducial*>(find("fiducial"))->GetFiducials())
    all.insert(all.end(), {seen.range, static_cast<double>(seen.id)});
  for (const auto& blob : static_cast<ModelBlobfinder*>(find("blobfinder"))->GetBlobs())
    all.insert(all.end(), {static_cast<double>(blob.left), blob.range, blob.color.r});
  if (const auto* samples = static_cast<ModelBumper*>(find("bumper"))->samples)
    all.push_back(samples[0].hit ? 1 : 0);
  return all;
}

struct Change {
  const char* name;
  std::function<void(Model* target)> make;
};

const Change kChanges[] = {
    {"nothing", [](Model*) {}},
    {"ranger return", [](Model* target) { target->SetRangerReturn(0.25); }},
    {"no ranger return", [](Model* target) { target->SetRangerReturn(-1); }},
    {"fiducial return", [](Model* target) { target->SetFiducialReturn(9); }},
    {"fiducial key", [](Model* target) { target->SetFiducialKey(3); }},
    {"no blob return", [](Model* target) { target->SetBlobReturn(false); }},
    {"color", [](Model* target) { target->SetColor(Color("blue")); }},
    {"visibility", [](Model* target) { target->vis = Visibility(); }},
    {"pose", [](Model* target) { target->SetPose(Pose(2.5, 0, 0, 0)); }},
    {"shape", [](Model* target) { target->ClearBlocks(); }},
    {"existence", [](Model* target) { delete target; }},
};

/// A callback that makes a change, and the readings of the looker "before" at that time.
struct Visit {
  const Change* change;
  std::vector<double> seen;  // readings of "before" as the callback sees them
  static int Do(Model* between, void* user) {
    auto& visit = *static_cast<Visit*>(user);
    World* const world = between->GetWorld();
    if (!visit.seen.empty()) return 1;
    visit.seen = Sensed(world, "before");
    visit.change->make(world->GetModel("target"));
    return 1;
  }
};

struct Outcome {
  std::vector<double> seen, before, after;
  bool operator==(const Outcome&) const = default;
};

Outcome StepOnce(const Change& change, bool timed, bool batch, unsigned threads) {
  RunOptions& options = World::run_options;
  const RunOptions kept = options;
  options.batch = batch;
  options.threads = threads;
  options.share_from = 1;
  Outcome outcome;
  {
    const std::unique_ptr<World> world = LoadText(kWorld);
    Visit visit{&change, {}};
    auto* between = static_cast<ModelPosition*>(world->GetModel("between"));
    if (timed) {
      // An event that is enqueued now comes after the updates of all models in the file.
      world->Enqueue(0, world->sim_interval, between, Visit::Do, &visit);
    } else {
      between->AddCallback(Model::CB_VELOCITY, Visit::Do, &visit);
      between->SetXSpeed(0.1);
    }
    world->Update();
    outcome = {visit.seen, Sensed(world.get(), "before"), Sensed(world.get(), "after")};
  }
  options = kept;
  return outcome;
}

TEST(CallbacksBetweenUpdates, SeeEarlierReadingsAndAffectLaterOnes) {
  for (const bool timed : {false, true}) {
    const Outcome still = StepOnce(kChanges[0], timed, false, 1);
    EXPECT_FALSE(still.seen.empty()) << timed;
    for (const Change& change : kChanges) {
      const Outcome expected = StepOnce(change, timed, false, 1);
      EXPECT_EQ(expected.seen, still.before) << change.name << timed;
      // A deleted model is removed from the lists of models seen.
      if (change.name != std::string("existence")) {
        EXPECT_EQ(expected.before, still.before) << change.name << timed;
      }
      EXPECT_EQ(StepOnce(change, timed, true, 1), expected) << change.name << timed;
      EXPECT_EQ(StepOnce(change, timed, true, 2), expected) << change.name << timed;
    }
  }
}

/// Proves that the test above is meaningful: each change has an effect on later sensors.
TEST(CallbacksBetweenUpdates, AffectLaterReadings) {
  const Outcome still = StepOnce(kChanges[0], false, true, 1);
  EXPECT_EQ(still.before.size(), still.after.size());
  for (const Change& change : kChanges) {
    if (&change == &kChanges[0]) continue;
    EXPECT_NE(StepOnce(change, false, true, 1).after, still.after) << change.name;
  }
}

}  // namespace
