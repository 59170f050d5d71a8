// SPDX-License-Identifier: GPL-2.0-or-later
//
// beliefs [SAMPLES [THREADS [DEVICE]]]: the time of a decision about a belief, and of an update of
// it.
//
// A robot with 16 rays among five others in a hall with pillars, and in a grid of 200 by 200 cells
// with twelve boxes that are elsewhere each time, chooses among 30 plans, 5 s ahead.

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <string>
#include <vector>

#include "stage.hh"
#include "threads/wall_clock.hh"

namespace {

constexpr char kWorld[] =
    "resolution 0.05\n"
    "position( name \"robot\" alwayson 1 size [0.4 0.4 0.4] drive \"diff\" localization \"gps\"\n"
    "  ranger( alwayson 1 sensor( range [0 5] fov 360 samples 16 ) ) )\n"
    "model( size [12 0.2 1] pose [0 6 0 0] ) model( size [12 0.2 1] pose [0 -6 0 0] )\n"
    "model( size [0.2 12 1] pose [6 0 0 0] ) model( size [0.2 12 1] pose [-6 0 0 0] )\n"
    "model( size [0.5 0.5 1] pose [2 2 0 0] ) model( size [0.5 0.5 1] pose [-2 -2 0 0] )\n";

std::vector<Stg::Plan> Plans() {
  std::vector<Stg::Plan> plans(1);
  plans[0].name = "go on";
  for (const double speed : {0.0, 0.2, 0.4, 0.6})
    for (int turn = -3; turn <= 3; turn++) {
      if (plans.size() == 29) break;
      plans.push_back(Stg::Plan("plan", Stg::Velocity(speed, 0, 0, 0.3 * turn)));
    }
  while (plans.size() < 30) plans.push_back(Stg::Plan("plan", Stg::Velocity(0.5, 0, 0, 0.1)));
  return plans;
}

Stg::TrackedOther Other(uint64_t id, double shift) {
  Stg::TrackedOther other(id);
  const double angle = 1.2 * static_cast<double>(id);
  const Stg::SineCosine turn = Stg::SinCos(angle);
  other.pose = Stg::Pose(3 * turn.cosine + shift, 3 * turn.sine, 0, 0);
  other.velocity = Stg::Velocity(-0.5 * turn.cosine, -0.5 * turn.sine, 0, 0);
  other.pose_covariance = Stg::Covariance(0.1, 0.1, 0.1);
  other.velocity_covariance = Stg::Covariance(0.1, 0.1, 0);
  return other;
}

/// Boxes of 0.3 m at random places, but not where the robot is.
void PutBoxes(Stg::RandomStream* random, std::vector<uint8_t>* cells) {
  std::fill(cells->begin(), cells->end(), uint8_t{0});
  for (int box = 0; box < 12; box++) {
    const uint32_t left = random->Choose(194), low = random->Choose(194);
    if (left > 80 && left < 120 && low > 80 && low < 120) continue;
    for (uint32_t row = low; row < low + 6; row++)
      for (uint32_t column = left; column < left + 6; column++) (*cells)[row * 200 + column] = 1;
  }
}

double Median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

}  // namespace

int main(int argc, char** argv) {
  Stg::Init(&argc, &argv);
  const std::string file = "/tmp/stage_beliefs.world";
  std::ofstream(file) << kWorld;
  Stg::Belief::Options of_belief;
  of_belief.columns = of_belief.rows = 200;
  of_belief.origin = Stg::Pose(-5, -5, 0, 0);
  Stg::Belief belief(file, "robot", of_belief);
  Stg::BeliefEngine::Options options;
  options.samples = argc > 1 ? static_cast<uint32_t>(std::atoi(argv[1])) : 10;
  options.threads = argc > 2 ? static_cast<unsigned>(std::atoi(argv[2])) : 2;
  options.device_steps = argc > 3;
  if (argc > 3) options.device_choice = argv[3];
  for (uint64_t id = 0; id < 5; id++) belief.SetOther(Other(id, 0));
  Stg::BeliefEngine engine(&belief, options);
  if (!engine.IsReady()) return 1;
  Stg::BeliefQuestion question;
  question.plans = Plans();
  std::vector<uint8_t> cells(200 * 200);
  std::vector<double> updates, decisions;
  Stg::RandomStream random(1);
  size_t collisions = 0;
  for (int round = 0; round < 40; round++) {
    PutBoxes(&random, &cells);
    const double start = Stg::threads::WallClock();
    belief.SetRobot(Stg::Pose(0.01 * round, 0, 0, 0), Stg::Velocity(0.3, 0, 0, 0),
                    Stg::Covariance(0.05, 0.05, 0.02));
    for (uint64_t id = 0; id < 5; id++) belief.SetOther(Other(id, 0.01 * round));
    if (!belief.SetGrid(cells.data(), cells.size()) || !engine.TakeGrid().empty()) return 1;
    const double updated = Stg::threads::WallClock();
    question.seed++;
    Stg::GoalJudge judge(4, 0, 0.28);
    const Stg::Decision decision = engine.Choose(question, Stg::Budget(), &judge);
    decisions.push_back(Stg::threads::WallClock() - updated);
    updates.push_back(updated - start);
    if (!decision.error.empty()) {
      std::fprintf(stderr, "%s\n", decision.error.c_str());
      return 1;
    }
    for (const Stg::Outcome& outcome : decision.outcomes)
      collisions +=
          static_cast<size_t>(std::count(outcome.collided.begin(), outcome.collided.end(), 1));
    if (round == 0)
      std::printf("best plan %zu, %llu steps of scenarios, %u samples\n", decision.best,
                  static_cast<unsigned long long>(decision.scenario_steps), decision.samples);
  }
  std::printf("update %.1f us, decision %.2f ms (slowest %.2f), %.1f collisions a decision, %s\n",
              1e6 * Median(updates), 1e3 * Median(decisions),
              1e3 * *std::max_element(decisions.begin(), decisions.end()),
              static_cast<double>(collisions) / 40, engine.StepDevice().c_str());
}
