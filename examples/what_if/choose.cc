// SPDX-License-Identifier: GPL-2.0-or-later
//
// choose: the program explained in docs/what-if.md.
//
//   choose examples/what_if/choose.world

#include <algorithm>
#include <cstdio>
#include <numeric>
#include <vector>

#include "stage.hh"

namespace {

// ---- snapshot and restore -----------------------------------------------------------------------

void TryTurns(Stg::World* world, Stg::ModelPosition* robot) {
  Stg::Snapshot now;
  if (!world->Take(&now)) return;  // a message says what can't be kept
  for (const double turn : {-0.5, 0.0, 0.5}) {
    robot->SetSpeed(0.4, 0, turn);
    for (int i = 0; i < 50; i++) world->Update();
    const Stg::Pose pose = robot->GetGlobalPose();
    std::printf("turning by %4.1f it gets to %.2f %.2f\n", turn, pose.x, pose.y);
    world->Restore(now);
  }
}

// ---- fork, score --------------------------------------------------------------------------------

/// Adds up the distance that the robot drives. A scenario ends when the robot stalls.
class Distance : public Stg::Scenario {
 public:
  bool NeedsWorld() const override { return false; }
  bool Watch(const Stg::Sighting* watched, uint32_t, double* score) override {
    *score += watched[0].velocity.x * 0.1;
    return watched[0].stalled;
  }
};

void TryLuck(const Stg::World& world, uint32_t robot) {
  Stg::Snapshot now;
  world.Take(&now);
  Stg::BranchOptions options;
  options.threads = 2;
  options.watched = {robot};
  Stg::Branches branches(world, 100, options);
  for (uint32_t i = 0; i < branches.count(); i++) branches.Restore(i, now, 1000 + i);
  Distance distance;
  branches.Step(200, &distance);
  double min = branches[0].score, max = min;
  for (uint32_t i = 0; i < branches.count(); i++) {
    min = std::min(min, branches[i].score);
    max = std::max(max, branches[i].score);
  }
  std::printf("the other one will have driven %.2f m to %.2f m in 20 s\n", min, max);
}

// ---- choose -------------------------------------------------------------------------------------

/// Scores how far north the robot gets. A collision ends a scenario with a penalty.
class Northward : public Stg::Judge {
 public:
  bool NeedsWorld() const override { return false; }
  bool Watch(const Stg::Sighting* watched, size_t, double* score) override {
    *score = watched[0].pose.y - (watched[0].stalled ? 100 : 0);
    return watched[0].stalled;
  }
};

void Choose(const Stg::World& world, uint32_t robot) {
  Stg::Question question;
  world.Take(&question.now, Stg::Snapshot::kLean);
  question.horizon = 5000000;  // microseconds
  question.candidates.push_back({"go on as now", {}});
  question.candidates.push_back({"stop", {{0, robot, Stg::Command::kStop}}});
  question.candidates.push_back({"ahead", {{0, robot, Stg::Command::kSetSpeed, 0.4, 0, 0.0}}});
  question.candidates.push_back({"left", {{0, robot, Stg::Command::kSetSpeed, 0.4, 0, 0.5}}});
  Stg::ConsequenceEngine::Options options;
  options.watched = {robot};
  Stg::ConsequenceEngine engine(world, options);
  Northward judge;
  const Stg::Decision decision = engine.Choose(question, Stg::Budget(0.5), &judge);
  std::printf("best of %zu: %s\n", question.candidates.size(),
              question.candidates[decision.best].name.c_str());
}

// ---- many worlds --------------------------------------------------------------------------------

/// Drives the robot of each world faster than that of the world before it.
class Faster : public Stg::StepObserver {
 public:
  Faster(Stg::WorldPool* pool, uint32_t robot) : pool_(*pool), robot_(robot) {}
  void BeforeStep(uint32_t id, uint64_t) override {
    Stg::Model* robot = pool_.At(id)->FindModel(robot_);
    dynamic_cast<Stg::ModelPosition*>(robot)->SetSpeed(0.01 * id, 0, 0);
  }

 private:
  Stg::WorldPool& pool_;
  const uint32_t robot_;
};

void DriveManyWorlds(const Stg::World& world, uint32_t robot) {
  Stg::WorldPoolOptions options;
  options.threads = 2;
  std::vector<uint64_t> seeds(50);
  std::iota(seeds.begin(), seeds.end(), 1);
  Stg::WorldPool pool(world, seeds, options);
  Faster faster(&pool, robot);
  pool.Step(pool.All(), 400, &faster);
  Stg::WorldPool::Ids stalled;
  for (const uint32_t id : pool.All())
    if (pool.At(id)->FindModel(robot)->Stalled()) stalled.push_back(id);
  pool.Reset(stalled, std::vector<uint64_t>(stalled.size(), 7));
  std::printf("%zu of %u worlds are back at their start, with seed 7\n", stalled.size(),
              pool.size());
}

}  // namespace

int main(int argc, char** argv) {
  Stg::Init(&argc, &argv);
  Stg::World world;
  if (argc != 2 || !world.Load(argv[1])) return 1;
  for (int i = 0; i < 20; i++) world.Update();
  auto* robot = dynamic_cast<Stg::ModelPosition*>(world.GetModel("mine"));
  const Stg::Model* other = world.GetModel("other");
  if (!robot || !other) return 1;
  std::printf("\n");
  TryTurns(&world, robot);
  TryLuck(world, other->GetId());
  Choose(world, robot->GetId());
  DriveManyWorlds(world, robot->GetId());
  return 0;
}
