// SPDX-License-Identifier: GPL-2.0-or-later
//
// pose_log: runs a world and records the poses of its robots.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <stdexcept>
#include <string>
#include <vector>

#include "benchmarks/truth/command_line.hh"
#include "stage.hh"

namespace {

const char kHelp[] =
    R"(Usage: pose_log [OPTION]... WORLDFILE

Runs a world and writes down the global pose of each robot (each position model that nothing else
drives about) as lines time,robot,x,y,a,stalled: seconds, name, metres, metres, radians, 0 or 1.

  --output FILE    where to (default: standard output, where controllers may print, too)
  --seconds S      simulated time to run (default 60)
  --every S        simulated time between lines of one robot (default 1); a step that ends later
                   than that, because steps are long, counts when it ends
  --seed N         of all random numbers (default 1)
  --threads N      that trace rays (default 1)
  --nudge M        move every robot's start by M metres along x: how fast do runs drift apart?
  --speed V        no controller needed: every robot drives at V m/s ...
  --turn W         ... and turns at W rad/s (default 0)
  --help           print this and end

Exit status: 0, or 1 if the world can't be loaded or the file not written, or 2 for wrong options.
)";

struct Options : truth::CommonOptions {
  double seconds = 60, every = 1, nudge = 0, speed = 0, turn = 0;
  bool drive = false;
  std::string output;
};

enum Id : int { kSeconds = truth::kOwn, kEvery, kNudge, kSpeed, kTurn, kOutput };

constexpr option kLongOptions[] = {{"seconds", required_argument, nullptr, kSeconds},
                                   {"every", required_argument, nullptr, kEvery},
                                   {"seed", required_argument, nullptr, truth::kSeed},
                                   {"threads", required_argument, nullptr, truth::kThreads},
                                   {"nudge", required_argument, nullptr, kNudge},
                                   {"speed", required_argument, nullptr, kSpeed},
                                   {"turn", required_argument, nullptr, kTurn},
                                   {"output", required_argument, nullptr, kOutput},
                                   {"help", no_argument, nullptr, truth::kHelpWanted},
                                   {nullptr, 0, nullptr, 0}};

using truth::Number;

void Apply(int id, const std::string& value, Options* options) {
  switch (id) {
    case kSeconds:
      options->seconds = Number("--seconds", value, 1e-6, 1e9);
      break;
    case kEvery:
      options->every = Number("--every", value, 1e-6, 1e9);
      break;
    case kNudge:
      options->nudge = Number("--nudge", value, -1e6, 1e6);
      break;
    case kSpeed:
      options->speed = Number("--speed", value, -1e6, 1e6);
      options->drive = true;
      break;
    case kTurn:
      options->turn = Number("--turn", value, -1e6, 1e6);
      options->drive = true;
      break;
    case kOutput:
      options->output = value;
      break;
  }
}

Options ReadOptions(int argc, char* argv[]) {
  Options options;
  truth::ReadCommandLine(argc, argv, kHelp, kLongOptions, &options,
                         [&](int id, const std::string& value) { Apply(id, value, &options); });
  return options;
}

/// Robots that are not mounted on another one, in order of creation.
std::vector<Stg::ModelPosition*> RobotsOf(const Stg::World& world) {
  std::vector<Stg::ModelPosition*> robots;
  for (Stg::Model* model : world.GetAllModels()) {
    auto* robot = dynamic_cast<Stg::ModelPosition*>(model);
    bool carried = false;
    for (const Stg::Model* above = model->Parent(); above; above = above->Parent())
      carried |= dynamic_cast<const Stg::ModelPosition*>(above) != nullptr;
    if (robot && !carried) robots.push_back(robot);
  }
  std::sort(robots.begin(), robots.end(),
            [](const auto* a, const auto* b) { return a->GetId() < b->GetId(); });
  return robots;
}

void SetUp(const Options& options, const std::vector<Stg::ModelPosition*>& robots) {
  for (Stg::ModelPosition* robot : robots) {
    if (options.nudge != 0) {
      Stg::Pose pose = robot->GetGlobalPose();
      pose.x += options.nudge;
      robot->SetGlobalPose(pose);
    }
    if (options.drive) {
      robot->Subscribe();
      robot->SetSpeed(options.speed, 0, options.turn);
    }
  }
}

void Write(FILE* out, Stg::usec_t time, const std::vector<Stg::ModelPosition*>& robots) {
  for (const Stg::ModelPosition* robot : robots) {
    const Stg::Pose pose = robot->GetGlobalPose();
    std::fprintf(out, "%.6f,%s,%.17g,%.17g,%.17g,%d\n", static_cast<double>(time) / 1e6,
                 robot->Token(), pose.x, pose.y, pose.a, robot->Stalled() ? 1 : 0);
  }
}

void Run(const Options& options, Stg::World* world, FILE* out) {
  const std::vector<Stg::ModelPosition*> robots = RobotsOf(*world);
  if (robots.empty()) throw std::runtime_error(options.world + ": found no robot to follow");
  SetUp(options, robots);
  world->SetQuitTime(static_cast<Stg::usec_t>(std::llround(options.seconds * 1e6)));
  const auto every = static_cast<Stg::usec_t>(std::llround(options.every * 1e6));
  std::fputs("time,robot,x,y,a,stalled\n", out);
  Write(out, 0, robots);
  Stg::usec_t next = every;
  while (!world->Update()) {
    if (world->SimTimeNow() < next) continue;
    Write(out, world->SimTimeNow(), robots);
    while (next <= world->SimTimeNow()) next += every;
  }
}

int Main(int argc, char* argv[]) {
  const Options options = ReadOptions(argc, argv);
  Stg::World* world = truth::LoadWorld(argc, argv, options);
  if (!world) return 1;
  FILE* out = options.output.empty() ? stdout : std::fopen(options.output.c_str(), "w");
  if (!out) throw std::runtime_error("can't write the poses to '" + options.output + "'");
  Run(options, world, out);
  if (std::ferror(out) || std::fclose(out) != 0)
    throw std::runtime_error("can't write the poses to '" + options.output + "'");
  return 0;
}

}  // namespace

int main(int argc, char* argv[]) {
  return truth::RunProgram("pose_log", [&] { return Main(argc, argv); });
}
