// SPDX-License-Identifier: GPL-2.0-or-later
//
// beliefs [SAMPLES [THREADS [DEVICE]]]: the time of a decision about a belief, and of an update of
// it.
//
// A robot with 16 rays among five others in a hall with pillars, and in a grid of 200 by 200 cells
// with twelve boxes that are elsewhere each time, chooses among 30 plans, 5 s ahead. Another update
// is that of 20 others and of a grid as a lidar sees it: walls and clutter, each time from
// elsewhere.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "stage.hh"
#include "threads/wall_clock.hh"

namespace {

constexpr char kFile[] = "/tmp/stage_beliefs.world";
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

// ---- a grid as a lidar sees it ------------------------------------------------------------------

struct Segment {
  double x0, y0, x1, y1;
};
struct Disc {
  double x, y, radius;
};

/// A room that is turned against the grid, with doors, shelves, pillars and the legs of people.
struct Room {
  std::vector<Segment> walls = {
      {-4.6, -3.5, 3.6, -4.4}, {3.6, -4.4, 4.4, 3.4},   {4.4, 3.4, 1.0, 3.8},
      {0.0, 3.9, -3.8, 4.3},   {-3.8, 4.3, -4.1, 1.4},  {-4.2, 0.4, -4.6, -3.5},
      {1.5, 0.8, 2.7, 0.7},    {2.7, 0.7, 2.75, 1.1},   {-2.6, -1.5, -2.5, -0.4},
      {-1.4, 2.2, -0.4, 2.1},  {-0.4, 2.1, -0.35, 2.6}, {0.5, -3.0, 1.6, -3.1}};
  std::vector<Disc> discs;

  explicit Room(Stg::RandomStream* random) {
    for (int i = 0; i < 30; i++) {
      const Stg::SineCosine turn = Stg::SinCos(6.2831853 * random->Uniform());
      const double away = 1.2 + 2.5 * random->Uniform(), radius = i < 4 ? 0.2 : 0.06;
      discs.push_back({away * turn.cosine, away * turn.sine, radius});
    }
  }
};

/// Nearly a normal distribution with a standard deviation of 1.
double Error(Stg::RandomStream* random) {
  double sum = -6;
  for (int i = 0; i < 12; i++) sum += random->Uniform();
  return sum;
}

/// The distance in a direction to what is nearest.
double Nearest(const Room& room, double x, double y, const Stg::SineCosine& turn) {
  double nearest = 12;
  for (const Segment& wall : room.walls) {
    const double dx = wall.x1 - wall.x0, dy = wall.y1 - wall.y0;
    const double across = turn.cosine * dy - turn.sine * dx;
    const double along = ((wall.x0 - x) * dy - (wall.y0 - y) * dx) / across;
    const double at = ((wall.x0 - x) * turn.sine - (wall.y0 - y) * turn.cosine) / across;
    if (along > 0 && at >= 0 && at <= 1) nearest = std::min(nearest, along);
  }
  for (const Disc& disc : room.discs) {
    const double cx = disc.x - x, cy = disc.y - y;
    const double along = cx * turn.cosine + cy * turn.sine;
    const double left = disc.radius * disc.radius - (cx * cx + cy * cy - along * along);
    if (along > 0 && left > 0) nearest = std::min(nearest, along - std::sqrt(left));
  }
  return nearest;
}

/// Cells that three scans of 720 rays with an error of 1 cm hit, while the robot goes on.
void Scan(const Room& room, double x, Stg::RandomStream* random, std::vector<uint8_t>* cells) {
  std::fill(cells->begin(), cells->end(), uint8_t{0});
  for (int scan = 0; scan < 3; scan++, x += 0.03)
    for (int ray = 0; ray < 720; ray++) {
      const Stg::SineCosine turn = Stg::SinCos(6.2831853 * (ray + random->Uniform()) / 720);
      const double range = Nearest(room, x, 0, turn) + 0.01 * Error(random);
      const auto column = static_cast<int>((x + range * turn.cosine + 5) / 0.05);
      const auto row = static_cast<int>((range * turn.sine + 5) / 0.05);
      if (column >= 0 && column < 200 && row >= 0 && row < 200)
        (*cells)[static_cast<size_t>(row * 200 + column)] = 1;
    }
}

double Median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

/// One of a hundred cells, each by itself.
void Scatter(Stg::RandomStream* random, std::vector<uint8_t>* cells) {
  std::fill(cells->begin(), cells->end(), uint8_t{0});
  for (int i = 0; i < 400; i++) {
    const uint32_t column = random->Choose(200), row = random->Choose(200);
    const bool is_at_robot = column > 80 && column < 120 && row > 80 && row < 120;
    if (!is_at_robot) (*cells)[row * 200 + column] = 1;
  }
}

/// How the grid is filled in a round.
using Fill = std::function<void(int round, std::vector<uint8_t>* cells)>;

/// A belief with some others in a grid, and its engine.
struct Decider {
  Decider(uint64_t count, const Stg::Belief::Options& of_belief,
          const Stg::BeliefEngine::Options& options)
      : others(count), belief(kFile, "robot", of_belief) {
    for (uint64_t id = 0; id < others; id++) belief.SetOther(Other(id, 0));
    engine = std::make_unique<Stg::BeliefEngine>(&belief, options);
  }
  /// Microseconds of an update, or nothing if it fails.
  std::optional<double> Update(int round, const std::vector<uint8_t>& cells) {
    const double start = Stg::threads::WallClock();
    belief.SetRobot(Stg::Pose(0.002 * round, 0, 0, 0), Stg::Velocity(0.3, 0, 0, 0),
                    Stg::Covariance(0.05, 0.05, 0.02));
    for (uint64_t id = 0; id < others; id++) belief.SetOther(Other(id, 0.002 * round));
    if (!belief.SetGrid(cells.data(), cells.size()) || !engine->TakeGrid().empty()) return {};
    return 1e6 * (Stg::threads::WallClock() - start);
  }

  const uint64_t others;
  Stg::Belief belief;
  std::unique_ptr<Stg::BeliefEngine> engine;
};

/// Prints the times of updates with 20 others and such a grid, and of decisions among five.
int MeasureGrid(const char* name, const Stg::Belief::Options& of_belief,
                const Stg::BeliefEngine::Options& options, const Fill& fill) {
  Decider many(20, of_belief, options), few(5, of_belief, options);
  std::vector<uint8_t> cells(200 * 200);
  std::vector<double> updates, decisions, steps, occupied;
  Stg::BeliefQuestion question;
  question.plans = Plans();
  Stg::GoalJudge judge(4, 0, 0.28);
  for (int round = 0; round < 200; round++) {
    fill(round, &cells);
    const std::optional<double> update = many.Update(round, cells);
    if (!update) return 1;
    updates.push_back(*update);
    occupied.push_back(static_cast<double>(std::count(cells.begin(), cells.end(), 1)));
    if (round % 10 != 0) continue;
    if (!few.Update(round, cells)) return 1;
    const Stg::Decision decision = few.engine->Choose(question, Stg::Budget(), &judge);
    if (!decision.error.empty()) {
      std::fprintf(stderr, "%s\n", decision.error.c_str());
      return 1;
    }
    decisions.push_back(1e3 * decision.seconds);
    steps.push_back(1e9 * decision.seconds / static_cast<double>(decision.scenario_steps));
  }
  std::printf(
      "%s, %.0f cells: update with 20 others %.1f us, decision among five %.2f ms, "
      "%.0f ns a step\n",
      name, Median(occupied), Median(updates), Median(decisions), Median(steps));
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  Stg::Init(&argc, &argv);
  std::ofstream(kFile) << kWorld;
  Stg::Belief::Options of_belief;
  of_belief.columns = of_belief.rows = 200;
  of_belief.origin = Stg::Pose(-5, -5, 0, 0);
  Stg::Belief belief(kFile, "robot", of_belief);
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
  const Room room(&random);
  return MeasureGrid("as a lidar sees it", of_belief, options,
                     [&](int round, std::vector<uint8_t>* to) {
                       Scan(room, 0.01 * (round % 60), &random, to);
                     }) |
         MeasureGrid("empty but for one cell", of_belief, options,
                     [&](int round, std::vector<uint8_t>* to) {
                       std::fill(to->begin(), to->end(), uint8_t{0});
                       (*to)[static_cast<size_t>(round)] = 1;
                     }) |
         MeasureGrid("scattered", of_belief, options,
                     [&](int, std::vector<uint8_t>* to) { Scatter(&random, to); });
}
