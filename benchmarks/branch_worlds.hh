// SPDX-License-Identifier: GPL-2.0-or-later
//
// The worlds of programs that measure branches: the first robots of a shipped world, each with
// another controller or none.

#ifndef STAGE_BENCHMARKS_BRANCH_WORLDS_HH
#define STAGE_BENCHMARKS_BRANCH_WORLDS_HH

#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include "stage.hh"

namespace branch_worlds {

constexpr int kRobots = 5;

inline void Require(bool condition, const char* what) {
  if (condition) return;
  std::fprintf(stderr, "error: %s\n", what);
  std::exit(1);
}

inline std::vector<Stg::ModelPosition*> RobotsOf(Stg::World* world) {
  std::vector<Stg::ModelPosition*> robots;
  for (Stg::Model* model : world->GetChildren())
    if (auto* robot = dynamic_cast<Stg::ModelPosition*>(model)) robots.push_back(robot);
  return robots;
}

inline std::string FileOf(const std::string& name) {
  return STAGE_SOURCE_WORLDS "/" + name + ".world";
}

/// The shipped world with only the first robots of its file.
inline std::string TextOf(const std::string& name, int robots, const std::string& controller) {
  std::ifstream in(FileOf(name));
  std::string text, line;
  for (int found = 0; std::getline(in, line);)
    if (!line.starts_with("robot(") || found++ < robots) text += line + "\n";
  const std::string of_file = "ctrl \"disperse\"";
  const std::string wanted = controller.empty() ? "" : "ctrl \"" + controller + "\"";
  return text.replace(text.find(of_file), of_file.size(), wanted);
}

/// `first`: lines that are put before the file.
inline std::unique_ptr<Stg::World> Load(const std::string& name, int robots,
                                        const std::string& controller = "disperse",
                                        const std::string& first = "") {
  Stg::RunOptions options;
  options.listed = false;
  options.threads = 1;
  auto world = std::make_unique<Stg::World>(options);
  std::istringstream text(first + TextOf(name, robots, controller));
  if (!world->Load(text, FileOf(name))) std::exit(1);
  world->SetQuitTime(0);
  return world;
}

inline void Run(Stg::World* world, int steps) {
  for (int i = 0; i < steps; i++) world->Update();
}

/// A world after 50 steps. Without a controller, the robots and their sensors run all the same, and
/// drive along circles.
inline std::unique_ptr<Stg::World> Prepare(const std::string& name, const std::string& controller,
                                           const std::string& first = "") {
  std::unique_ptr<Stg::World> world = Load(name, kRobots, controller, first);
  int number = 0;
  for (Stg::ModelPosition* robot : RobotsOf(world.get())) {
    if (!controller.empty()) break;
    robot->Subscribe();
    for (Stg::Model* sensor : robot->GetChildren()) sensor->Subscribe();
    robot->SetSpeed(0.3, 0, number++ % 2 ? 0.3 : -0.3);
  }
  Run(world.get(), 50);
  return world;
}

}  // namespace branch_worlds

#endif
