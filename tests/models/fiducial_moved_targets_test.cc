// SPDX-License-Identifier: GPL-2.0-or-later
//
// Fiducial finders find targets where they are at the moment of the update: also after code of
// clients has moved or changed them within the step or between steps.

#include <cmath>
#include <functional>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "fiducial_testing.hh"
#include "support/random_source.hh"

namespace Stg {
namespace {

/// Numbers of the targets that a finder reports.
using Numbers = std::set<int>;

Numbers Reported(ModelFiducial& finder) {
  finder.GetWorld()->StateHash();  // pending lines of sight are traced now
  Numbers numbers;
  for (const Fiducial& fiducial : finder.GetFiducials()) numbers.insert(fiducial.id);
  return numbers;
}

/// Numbers of the targets within reach of a finder with an all-round view. Bodies do not matter: no
/// target in these tests has one.
Numbers InReach(const ModelFiducial& finder) {
  Numbers numbers;
  const Pose own = finder.GetGlobalPose();
  for (const Model* model : finder.GetWorld()->GetAllModels()) {
    const Pose there = model->GetGlobalPose();
    if (model->vis.fiducial_return != 0 && model->vis.fiducial_key == finder.vis.fiducial_key &&
        std::hypot(there.x - own.x, there.y - own.y) < finder.max_range_anon)
      numbers.insert(model->vis.fiducial_return);
  }
  return numbers;
}

std::string FinderText(const std::string& type, const std::string& name) {
  return type + "( name \"" + name + "\" range_max 3 range_max_id 3 fov 360 ignore_zloc 1 )\n";
}

/// A post without a body. The finder looks through it.
Model* MakeTarget(World* world, int number, double x, double y) {
  Model* const target = world->CreateModel(nullptr, "model");
  target->ClearBlocks();
  target->SetPose(Pose(x, y, 0, 0));
  target->SetFiducialReturn(number);
  return target;
}

struct Change {
  const char* name;
  std::function<void(Model*& target, test::RandomSource& random)> make;
};

const Change kChanges[] = {
    {"pose",
     [](Model*& target, test::RandomSource& random) {
       target->SetPose(Pose(random.Real(-4, 4), random.Real(-4, 4), 0, 0));
     }},
    {"number",
     [](Model*& target, test::RandomSource& random) {
       target->SetFiducialReturn(random.Int(0, 1) * random.Int(100, 999));
     }},
    {"key",
     [](Model*& target, test::RandomSource& random) { target->SetFiducialKey(random.Int(0, 1)); }},
    {"visibility",
     [](Model*& target, test::RandomSource& random) {
       target->vis.fiducial_return = random.Int(0, 1) * random.Int(100, 999);
     }},
    {"parent",
     [](Model*& target, test::RandomSource& random) {
       Model* const carrier = target->GetWorld()->GetModel("carrier");
       target->SetParent(target->Parent() ? nullptr : carrier);
       carrier->SetPose(Pose(random.Real(-4, 4), random.Real(-4, 4), 0, 0));
     }},
    {"existence",
     [](Model*& target, test::RandomSource& random) {
       World* const world = target->GetWorld();
       delete target;
       target = MakeTarget(world, random.Int(100, 999), random.Real(-4, 4), random.Real(-4, 4));
     }},
};

/// A finder that performs an action before it looks.
class MeddlingFinder : public ModelFiducial {
 public:
  using ModelFiducial::ModelFiducial;
  std::function<void()> meddle;
  Numbers expected;  ///< targets within reach when it looks

  void Update() override {
    if (meddle) meddle();
    expected = InReach(*this);
    ModelFiducial::Update();
  }
};

/// A model other than a finder that performs an action when it updates.
class Meddler : public Model {
 public:
  using Model::Model;
  std::function<void()> meddle;

 protected:
  void Update() override {
    if (meddle) meddle();
    Model::Update();
  }
};

[[maybe_unused]] const bool kRegistered =
    RegisterModelType(ModelTypeOf<MeddlingFinder>("meddling_finder")) &&
    RegisterModelType(ModelTypeOf<Meddler>("meddler"));

TEST(FiducialsOfMovedTargets, AreReportedByUpdatesBetweenSteps) {
  test::RandomSource random(3);
  for (const Change& change : kChanges) {
    const auto world = LoadText("model( name \"carrier\" )\n" + FinderText("meddling_finder", "f"));
    world->GetModel("carrier")->ClearBlocks();
    auto* const finder = FindRunning<MeddlingFinder>(*world, "f");
    std::vector<Model*> targets;
    for (int i = 0; i < 8; i++)
      targets.push_back(MakeTarget(world.get(), i + 1, random.Real(-4, 4), random.Real(-4, 4)));
    int differences = 0;
    for (int i = 0; i < 100; i++) {
      const Numbers before = InReach(*finder);
      change.make(targets[static_cast<size_t>(random.Int(0, 7))], random);
      differences += InReach(*finder) != before;
      if (random.OneIn(3))
        Step(*world);
      else
        finder->Update();
      ASSERT_EQ(Reported(*finder), InReach(*finder)) << change.name << ", change " << i;
    }
    EXPECT_GT(differences, 3) << change.name;
  }
}

/// Code that moves the target between the updates of two finders.
enum class Mover { kFinder, kModel, kVelocityCallback, kQueuedCallback };

int CallMeddle(Model*, void* meddle) {
  (*static_cast<std::function<void()>*>(meddle))();
  return 0;
}

struct Outcome {
  Numbers before, own, expected, after;
  bool operator==(const Outcome&) const = default;
};

Outcome StepWithMover(Mover mover, bool batch, int threads) {
  InitLibrary();
  RunOptions options;
  options.batch = batch;
  options.threads = threads;
  options.share_from = 1;
  World world(options);
  std::istringstream text(FinderText("fiducial", "before") + FinderText("meddling_finder", "own") +
                          "meddler( name \"meddler\" pose [0 50 0 0] )\n"
                          "position( name \"driver\" pose [0 -50 0 0] )\n" +
                          FinderText("fiducial", "after"));
  EXPECT_TRUE(world.Load(text, "t.world"));
  Model* const target = MakeTarget(&world, 7, 9, 0);
  MakeTarget(&world, 8, 1, 0);
  std::function<void()> meddle = [&] { target->SetPose(Pose(2, 0, 0, 0)); };
  // Models update in the order in which they are subscribed.
  auto* const before = FindRunning<ModelFiducial>(world, "before");
  auto* const own = FindRunning<MeddlingFinder>(world, "own");
  auto* const meddler = FindRunning<Meddler>(world, "meddler");
  auto* const driver = FindRunning<ModelPosition>(world, "driver");
  auto* const after = Find<ModelFiducial>(world, "after");
  if (mover == Mover::kFinder) own->meddle = meddle;
  if (mover == Mover::kModel) meddler->meddle = meddle;
  if (mover == Mover::kVelocityCallback)
    driver->AddCallback(Model::CB_VELOCITY, CallMeddle, &meddle);
  if (mover == Mover::kQueuedCallback)
    world.Enqueue(0, world.sim_interval, driver, CallMeddle, &meddle);
  driver->SetXSpeed(0.1);
  after->Subscribe();  // its update is queued last
  Step(world);
  return {Reported(*before), Reported(*own), own->expected, Reported(*after)};
}

TEST(FiducialsOfMovedTargets, AreReportedWithinAStepByThoseWhoUpdateLater) {
  for (const Mover mover :
       {Mover::kFinder, Mover::kModel, Mover::kVelocityCallback, Mover::kQueuedCallback})
    for (const bool batch : {false, true})
      for (const int threads : {1, 2}) {
        const Outcome outcome = StepWithMover(mover, batch, threads);
        SCOPED_TRACE(static_cast<int>(mover) * 100 + batch * 10 + threads);
        EXPECT_EQ(outcome.before, Numbers({8}));
        EXPECT_EQ(outcome.own, outcome.expected);
        EXPECT_EQ(outcome.own, mover == Mover::kFinder ? Numbers({7, 8}) : Numbers({8}));
        EXPECT_EQ(outcome.after, Numbers({7, 8}));
      }
}

}  // namespace
}  // namespace Stg
