// SPDX-License-Identifier: GPL-2.0-or-later

#include "support/crowd.hh"

#include <gtest/gtest.h>

#include <utility>

#include "model_testing.hh"

namespace crowd {

namespace {

Outcome Run(const Crowd& crowd, const Stg::RunOptions& options) {
  Stg::InitLibrary();
  Stg::World::run_options = options;
  const auto world = Stg::LoadText(crowd.world);
  Stg::World::run_options = Stg::RunOptions();
  Robots robots;
  for (Stg::Model* model : world->GetChildren())
    if (auto* robot = dynamic_cast<Stg::ModelPosition*>(model)) robots.push_back(robot);
  Outcome outcome;
  for (int step = 0; step < crowd.steps; step++) {
    for (size_t i = 0; i < robots.size(); i++) robots[i]->SetSpeed(crowd.speed, 0, crowd.turn(i));
    Stg::Step(*world);
    outcome.hashes.push_back(world->StateHash());
    crowd.look(robots, &outcome.sensed);
  }
  outcome.rays = world->statistics().trace.rays;
  return outcome;
}

}  // namespace

Outcome ExpectSameHoweverItIsRun(const Crowd& crowd) {
  Outcome expected = Run(crowd, Stg::RunOptions());
  Stg::RunOptions one_by_one, threads, device;
  one_by_one.batch = false;
  threads.threads = 4;
  threads.share_from = 1;
  device.opencl = device.always_on_device = true;
  const std::pair<const char*, Stg::RunOptions> ways[] = {
      {"one by one", one_by_one}, {"threads", threads}, {"device", device}};
  for (const auto& [name, options] : ways) {
    SCOPED_TRACE(name);
    const Outcome found = Run(crowd, options);
    EXPECT_EQ(found.sensed, expected.sensed);
    EXPECT_EQ(found.hashes, expected.hashes);
    EXPECT_EQ(found.rays, expected.rays);
  }
  return expected;
}

std::string Repeat(int count, const std::function<std::string(int)>& text_of) {
  std::string text;
  for (int i = 0; i < count; i++) text += text_of(i);
  return text;
}

}  // namespace crowd
