// SPDX-License-Identifier: GPL-2.0-or-later
//
// Steps with contacts of outlines need no further memory once they run.

#include <gtest/gtest.h>

#include <algorithm>
#include <climits>
#include <memory>
#include <sstream>
#include <string>

#include "support/counted_allocations.hh"
#include "support/model_testing.hh"
#include "world/engine.hh"

namespace Stg {
namespace {

constexpr int kPeriod = 20;  // steps after which commands repeat

std::string Robot(int i, double x, double y, const std::string& more) {
  return "position( name \"r" + std::to_string(i) + "\" alwayson 1 pose [" + std::to_string(x) +
         " " + std::to_string(y) + " 0 " + std::to_string(47 * i) + "] " + more + " )\n";
}

/// Robots that never meet.
std::string FreeRobots() {
  std::string text;
  for (int i = 0; i < 40; i++)
    text += Robot(i, i % 8 * 3.0, i / 8 * 3.0, i % 2 ? "round 1 size [0.3 0.3 0.3]" : "");
  return text;
}

/// Robots of several shapes that are close together in a room.
std::string Heap(const std::string& more) {
  std::string text =
      "model( pose [0 1.7 0 0] size [3.4 0.2 1] )\nmodel( pose [0 -1.7 0 0] size [3.4 0.2 1] )\n"
      "model( pose [1.7 0 0 0] size [0.2 3.4 1] )\nmodel( pose [-1.7 0 0 0] size [0.2 3.4 1] )\n";
  const char* shapes[] = {"round 1 size [0.3 0.3 0.3] ", "size [0.3 0.2 0.3] ",
                          "size [0.3 0.3 0.3] block( points 6 point[0] [0 0] point[1] [3 0] "
                          "point[2] [3 1] point[3] [1 1] point[4] [1 3] point[5] [0 3] ) "};
  for (int i = 0; i < 36; i++)
    text += Robot(i, i % 6 * 0.5 - 1.25, i / 6 * 0.5 - 1.25, shapes[i % 3] + more);
  return text;
}

/// A heap with things to push between the robots.
std::string Pushing() {
  std::string text = Heap("friction 0.3 mass 5 ");
  for (int i = 0; i < 25; i++)
    text += "model( pushable 1 friction 0.2 mass 0.5 size [0.12 0.1 0.3] pose [" +
            std::to_string(i % 5 * 0.5 - 1) + " " + std::to_string(i / 5 * 0.5 - 1) + " 0 20] )\n";
  return text;
}

/// Drives all robots for a period, in the same way each time.
void Drive(World* world) {
  for (int step = 0; step < kPeriod; step++) {
    for (Model* model : world->host().models)
      if (auto* robot = dynamic_cast<ModelPosition*>(model))
        robot->SetSpeed(step < kPeriod / 2 ? 0.4 : -0.4, 0,
                        (model->GetId() + step) % 7 * 0.1 - 0.3);
    world->Update();
  }
}

/// The least number of allocations in a period. With several threads, each gets memory when it
/// solves its first large island, which depends on the machine, so there are many periods.
long AllocationsOf(const std::string& contacts, const std::string& text, int threads) {
  RunOptions options;
  options.threads = threads;
  options.share_from = 1;
  World world(options);
  std::istringstream content("contacts \"" + contacts + "\"\nresolution 0.1\n" + text);
  EXPECT_TRUE(world.Load(content, "t.world"));
  long least = LONG_MAX;
  for (int period = 0; period < 60; period++) {
    const long before = test::allocations;
    Drive(&world);
    least = std::min(least, test::allocations - before);
  }
  EXPECT_EQ(threads > 1, world.engine().shared_jobs() > 0);
  return least;
}

/// Expects as few allocations as robots need that never touch anything.
void ExpectNone(const std::string& text) {
  InitLibrary();
  for (const int threads : {1, 2}) {
    const long of_world = AllocationsOf("cells", FreeRobots(), threads);
    EXPECT_LE(of_world, 2 * kPeriod);  // of the scheduler
    EXPECT_EQ(AllocationsOf("outlines", text, threads), of_world) << threads;
  }
}

TEST(OutlinesMemory, FreeRobotsNeedNoMoreOnceTheyRun) { ExpectNone(FreeRobots()); }

TEST(OutlinesMemory, AHeapNeedsNoMoreOnceItRuns) { ExpectNone(Heap("")); }

TEST(OutlinesMemory, PushingNeedsNoMoreOnceItRuns) { ExpectNone(Pushing()); }

}  // namespace
}  // namespace Stg
