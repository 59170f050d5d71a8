// SPDX-License-Identifier: GPL-2.0-or-later
//
// What several threads, or an OpenCL device, cost or gain in crowds of robots with mixed sensors,
// actuators and callbacks. All ways to run a crowd take turns, a few steps each, and the
// fastest turn of each counts: what else the machine does only adds to times. Their states have to
// be equal, otherwise the exit status is 1.
//
//   mixtures            some minutes
//   mixtures --short    up to 1000 robots, fewer turns
//   mixtures --opencl   the device too
//   mixtures NAME       only mixtures whose name has that in it

#include <algorithm>
#include <chrono>
#include <cinttypes>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <memory>
#include <set>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "stage.hh"

namespace {

// ---- mixtures -----------------------------------------------------------------------------------

/// Of so many robots one has the callback; 0: none.
struct Controllers {
  int together = 0;  // of CB_UPDATE, by several threads at once
  int in_turn = 0;   // of CB_UPDATE, in its place
  int velocity = 0;  // of CB_VELOCITY, in the midst of the updates
};

struct Mixture {
  std::string name;
  std::vector<std::string> parts;  // a robot has all of them, or its share: see `spread`
  Controllers controllers;
  bool spread = false;  // robot i has part i, i + 1 of them only
  int most = 10000;     // robots: each looks at all others
};

const std::string kRanger = "ranger( sensor( range [0 8] fov 180 samples 16 ) )";
const std::string kNoisy =
    "ranger( sensor( range [0 8] fov 180 samples 16 noise [0.01 0.02 0.5] ) )";
const std::string kFinder = "fiducial( range_max 4 )";
const std::string kBlobs = "blobfinder( image [40 30] range 6 )";
const std::string kBumper =
    "bumper( bcount 2 bpose[0] [0.2 0 0 0] bpose[1] [-0.2 0 0 180] blength 0.3 )";
const std::string kGripper = "gripper( size [0.1 0.2 0.1] pose [0.2 0 -0.2 0] )";
const std::string kWifi = "wifi( model \"simple\" range 4 )";
const std::string kCamera = "camera( resolution [16 12] range [0.2 8] )";
const std::string kArm =
    "actuator( type \"linear\" axis [1 0 0] size [0.1 0.1 0.1] max_speed 0.2 )";

std::vector<Mixture> Mixtures() {
  const std::vector<std::string> cheap = {kRanger, kFinder, kBlobs, kBumper, kGripper, kArm};
  std::vector<std::string> all = cheap;
  all.insert(all.end(), {kNoisy, kWifi, kCamera});
  return {
      {"positions", {}, {1, 0, 0}},
      {"ranger", {kRanger}, {1, 0, 0}},
      {"noisy ranger", {kNoisy}, {1, 0, 0}},
      {"fiducial", {kFinder}, {1, 0, 0}},
      {"blobfinder", {kBlobs}, {1, 0, 0}},
      {"bumper", {kBumper}, {1, 0, 0}},
      {"gripper", {kGripper}, {1, 0, 0}},
      {"wifi", {kWifi}, {1, 0, 0}, false, 1000},
      {"camera", {kCamera}, {1, 0, 0}, false, 1000},
      {"actuator", {kArm}, {1, 0, 0}},
      {"ranger + fiducial", {kRanger, kFinder}, {1, 0, 0}},
      {"ranger + fiducial + arm", {kRanger, kFinder, kArm}, {1, 0, 0}},
      {"all but wifi, camera", cheap, {1, 0, 0}},
      {"two of those each", cheap, {1, 0, 0}, true},
      {"all", all, {1, 0, 0}, false, 1000},
      {"ranger; serial", {kRanger}, {0, 1, 0}},
      {"ranger; alternating", {kRanger}, {2, 2, 0}},
      {"ranger; 1 of 20 serial", {kRanger}, {1, 20, 0}},
      {"callbacks; alternating", {}, {2, 2, 0}},
      {"ranger; velocity", {kRanger}, {1, 0, 1}},
      {"ranger; 1 of 20 velocity", {kRanger}, {1, 0, 20}},
      {"all; serial, velocity", cheap, {1, 7, 9}},
  };
}

std::string TextOf(const Mixture& mixture, int robots) {
  std::ostringstream text;
  const int side = static_cast<int>(std::ceil(std::sqrt(robots)));
  text << "resolution 0.05\n";
  for (int i = 0; i < robots; i++) {
    const int row = i / side;
    text << "position( size [0.4 0.4 0.4] fiducial_return 1 pose [" << 1.5 * (i % side) << " "
         << 1.5 * row << " 0 " << i * 37 % 360 << "]";
    const size_t count = mixture.parts.size();
    for (size_t k = 0; k < (mixture.spread ? 2 : count); k++)
      text << " " << mixture.parts[(static_cast<size_t>(i) + k) % count];
    text << " )\n";
  }
  return text.str();
}

int Wander(Stg::Model* model, void*) {
  const double turn = 0.3 * (static_cast<double>(model->GetWorld()->GetUpdateCount() % 7) - 3);
  static_cast<Stg::ModelPosition*>(model)->SetSpeed(model->Stalled() ? -0.2 : 0.4, 0, turn);
  return 0;
}

int Wave(Stg::Model* model, void*) {
  const bool out = model->GetWorld()->GetUpdateCount() % 8 < 4;
  static_cast<Stg::ModelActuator*>(model)->SetSpeed(out ? 0.2 : -0.2);
  return 0;
}

int Nothing(Stg::Model*, void*) { return 0; }

// ---- ways to run them ---------------------------------------------------------------------------

struct Way {
  std::string name;
  int threads;
  bool opencl;
};

class Crowd {
 public:
  Crowd(const Mixture& mixture, const std::string& text, const Way& way) {
    Stg::World::run_options.threads = way.threads;
    Stg::World::run_options.opencl = way.opencl;
    world_ = std::make_unique<Stg::World>();
    std::istringstream stream(text);
    if (!world_->Load(stream)) std::exit(1);
    int robots = 0;
    for (Stg::Model* robot : world_->GetChildren()) {
      if (!dynamic_cast<Stg::ModelPosition*>(robot)) continue;
      AddCallbacks(robot, robots++, mixture.controllers);
      robot->Subscribe();
      for (Stg::Model* part : robot->GetChildren()) {
        if (dynamic_cast<Stg::ModelActuator*>(part))
          part->AddParallelCallback(Stg::Model::CB_UPDATE, Wave, nullptr);
        part->Subscribe();
      }
    }
  }

  /// Milliseconds for each step.
  double Step(int steps) {
    using Clock = std::chrono::steady_clock;
    const Clock::time_point start = Clock::now();
    for (int i = 0; i < steps; i++) world_->Update();
    return std::chrono::duration<double, std::milli>(Clock::now() - start).count() / steps;
  }
  uint64_t Hash() const { return world_->StateHash(); }

 private:
  static void AddCallbacks(Stg::Model* robot, int number, const Controllers& controllers) {
    const auto falls_to = [&](int every) { return every > 0 && number % every == every - 1; };
    if (falls_to(controllers.in_turn))
      robot->AddCallback(Stg::Model::CB_UPDATE, Wander, nullptr);
    else if (controllers.together > 0)
      robot->AddParallelCallback(Stg::Model::CB_UPDATE, Wander, nullptr);
    if (falls_to(controllers.velocity))
      robot->AddCallback(Stg::Model::CB_VELOCITY, Nothing, nullptr);
  }

  std::unique_ptr<Stg::World> world_;
};

// ---- the table ----------------------------------------------------------------------------------

class Table {
 public:
  Table(std::vector<Way> ways, int turns) : ways_(std::move(ways)), turns_(turns) {
    std::printf("%-26s%8s%12s", "robots with", "robots", "ms a step");
    for (size_t i = 1; i < ways_.size(); i++) std::printf("%12s", ways_[i].name.c_str());
    std::printf("\n");
  }

  void Measure(const Mixture& mixture, int robots) {
    const std::string text = TextOf(mixture, robots);
    std::vector<std::unique_ptr<Crowd>> crowds;
    for (const Way& way : ways_) crowds.push_back(std::make_unique<Crowd>(mixture, text, way));
    constexpr double kTurn = 10;  // milliseconds, at least
    const double first = crowds[0]->Step(2);
    for (size_t i = 1; i < crowds.size(); i++) crowds[i]->Step(2);
    const int steps = std::clamp(static_cast<int>(kTurn / first), 1, 200);
    std::vector<double> took(ways_.size(), 1e9);
    for (int turn = 0; turn < turns_; turn++)
      for (size_t i = 0; i < crowds.size(); i++)
        took[i] = std::min(took[i], crowds[i]->Step(steps));
    Print(mixture, robots, took);
    for (const auto& crowd : crowds) differ_ |= crowd->Hash() != crowds[0]->Hash();
  }

  /// Returns the status to exit with.
  int Finish() const {
    std::printf(
        "\nTimes are those of one thread times the ratio. The worst ratio is %.2f, of %s.\n",
        worst_, worst_name_.c_str());
    std::printf(differ_ ? "STATES DIFFER\n" : "All ways gave the same states.\n");
    return differ_ ? 1 : 0;
  }

 private:
  void Print(const Mixture& mixture, int robots, const std::vector<double>& took) {
    std::printf("%-26s%8d%12.3f", mixture.name.c_str(), robots, took[0]);
    for (size_t i = 1; i < took.size(); i++) {
      const double ratio = took[i] / took[0];
      std::printf("%12.2f", ratio);
      if (ratio <= worst_) continue;
      worst_ = ratio;
      worst_name_ = std::to_string(robots) + " robots with " + mixture.name + ", " + ways_[i].name;
    }
    std::printf("\n");
    std::fflush(stdout);
  }

  std::vector<Way> ways_;
  int turns_;
  double worst_ = 0;
  std::string worst_name_;
  bool differ_ = false;
};

}  // namespace

int main(int argc, char* argv[]) {
  bool is_short = false, opencl = false;
  std::string wanted;
  for (int i = 1; i < argc; i++) {
    const std::string argument = argv[i];
    if (argument == "--short")
      is_short = true;
    else if (argument == "--opencl")
      opencl = true;
    else
      wanted = argument;
  }
  Stg::Init(&argc, &argv);
  const int cores = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  std::vector<Way> ways = {{"1 thread", 1, false}};
  for (const int threads : std::set<int>{2, cores})
    ways.push_back({std::to_string(threads) + " threads", threads, false});
  if (opencl) ways.push_back({"opencl", 0, true});
  Table table(ways, is_short ? 15 : 25);
  for (const Mixture& mixture : Mixtures())
    for (const int robots : {100, 1000, 10000})
      if (robots <= std::min(mixture.most, is_short ? 1000 : 10000) &&
          mixture.name.find(wanted) != std::string::npos)
        table.Measure(mixture, robots);
  return table.Finish();
}
