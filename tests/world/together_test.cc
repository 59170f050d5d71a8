// SPDX-License-Identifier: GPL-2.0-or-later
//
// Parallel updates, moves and callbacks, in special cases. Random worlds are compared in
// exactness_test.cc.

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <span>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "support/crowd.hh"
#include "support/model_testing.hh"
#include "threads/worker_pool.hh"
#include "world/engine.hh"
#include "world/phases/move_phase.hh"

namespace {

using Stg::TileColoring;
using Stg::grid::CellBox;

// ---- colors
// --------------------------------------------------------------------------------------

TEST(TileColoringTest, BoxesThatShareATileGetIncreasingColors) {
  TileColoring coloring;
  coloring.Clear();
  EXPECT_EQ(coloring.ColorOf({0, 0, 1, 1}), 0u);
  EXPECT_EQ(coloring.ColorOf({1, 1, 2, 2}), 1u);
  EXPECT_EQ(coloring.ColorOf({2, 2, 3, 3}), 2u);
  EXPECT_EQ(coloring.ColorOf({0, 0, 0, 0}), 1u);
}

TEST(TileColoringTest, OtherBoxesGetTheFirstColor) {
  TileColoring coloring;
  coloring.Clear();
  for (int i = 0; i < 1000; i++)
    EXPECT_EQ(coloring.ColorOf({3 * i, -7 * i, 3 * i + 2, -7 * i + 2}), 0u);
  coloring.Clear();
  for (int i = 0; i < 5000; i++)  // far apart
    EXPECT_EQ(coloring.ColorOf({90 * i - 70000, 50 * i, 90 * i - 70000, 50 * i}), 0u);
  for (int i = 0; i < 5000; i++)
    EXPECT_EQ(coloring.ColorOf({90 * i - 70000, 50 * i - 1, 90 * i - 69999, 50 * i}), 1u);
}

TEST(TileColoringTest, ColorsAreDisjointAndKeepTheOrder) {
  Stg::RandomStream random(3);
  TileColoring coloring;
  for (int round = 0; round < 5; round++) {
    coloring.Clear();
    std::map<std::pair<int, int>, uint32_t> last_color;
    for (int i = 0; i < 500; i++) {
      const int x = static_cast<int>(random.Uniform(-20, 20));
      const int y = static_cast<int>(random.Uniform(-20, 20));
      const bool large = i % 50 == 0;
      const CellBox box{x, y, x + (large ? 21 : i % 3), y + (large ? 11 : i % 4)};
      const uint32_t color = coloring.ColorOf(box);
      for (int tx = box.min_x; tx <= box.max_x; tx++) {
        for (int ty = box.min_y; ty <= box.max_y; ty++) {
          const auto [place, is_new] = last_color.try_emplace({tx, ty}, color);
          if (is_new) continue;
          EXPECT_GT(color, place->second);
          place->second = color;
        }
      }
    }
  }
}

TEST(TileColoringTest, AreForgottenByClear) {
  TileColoring coloring;
  for (int round = 0; round < 3; round++) {
    coloring.Clear();
    EXPECT_EQ(coloring.ColorOf({5, 5, 5, 5}), 0u);
  }
}

bool Overlap(const CellBox& a, const CellBox& b) {
  return a.min_x <= b.max_x && b.min_x <= a.max_x && a.min_y <= b.max_y && b.min_y <= a.max_y;
}

/// TileOwnership names the boxes that share a tile with others, in several rounds.
TEST(TileOwnershipTest, NamesExactlyTheBoxesThatShareTiles) {
  Stg::RandomStream random(5);
  Stg::grid::Grid grid;
  const Stg::grid::BodyId body = grid.AddBody({.z_max = 1});
  // Regions are 8 x 8 tiles. Only regions with x < 40 exist.
  for (int x = -40; x < 40; x += 8)
    for (int y = -40; y < 48; y += 8) {
      Stg::grid::CellSet set{.x = x, .y = y, .cells = 1};
      grid.Rasterize(body, {}, std::span(&set, 1));
    }
  Stg::TileOwnership ownership;
  for (int round = 0; round < 20; round++) {
    std::vector<CellBox> boxes;
    for (int i = 0; i < 120; i++) {
      const int x = static_cast<int>(random.Uniform(-40, 36));
      const int y = static_cast<int>(random.Uniform(-40, 36));
      boxes.push_back({x, y, x + i % 3, y + i % 4});
    }
    boxes.push_back({38, 38, 41, 39});  // extends beyond the existing regions
    std::vector<std::atomic<bool>> named(boxes.size());
    std::vector<char> known(boxes.size());
    ownership.Begin(grid);
    Stg::threads::WorkerPool workers(4);
    workers.Run(boxes.size(), 1, [&](size_t begin, size_t end, unsigned) {
      for (size_t i = begin; i < end; i++)
        known[i] = ownership.Claim(grid, boxes[i], i, [&](size_t other) {
          named[i] = true;
          named[other] = true;
        });
    });
    for (size_t i = 0; i < boxes.size(); i++) {
      bool shares = false;
      for (size_t k = 0; k < boxes.size(); k++) shares |= k != i && Overlap(boxes[i], boxes[k]);
      EXPECT_EQ(named[i], shares) << round << " " << i;
      EXPECT_EQ(known[i] != 0, i + 1 < boxes.size());
    }
  }
}

// ---- moves --------------------------------------------------------------------------------------

/// Robots collide with each other, and sometimes leave the existing regions of the grid.
int RowOf(int i) { return i / 15; }

crowd::Crowd Crowded(const std::string& extras, int robots, double cell, double spacing) {
  crowd::Crowd crowd;
  crowd.world =
      "resolution " + std::to_string(cell) + "\n" + extras + crowd::Repeat(robots, [&](int i) {
        return "position( size [0.3 0.2 0.3] pose [" + std::to_string(spacing * (i % 15) - 3) +
               " " + std::to_string(spacing * RowOf(i) - 3) + " 0 " + std::to_string(i * 37 % 360) +
               "] alwayson 1 ranger( alwayson 1 size [0.1 0.1 0.1] pose [0 0 0 0] sensor( range [0 "
               "3] fov 270 "
               "samples 7 pose [0 0 -0.15 0] ) ) )\n";
      });
  crowd.steps = 25;
  crowd.speed = 0.9;
  crowd.turn = [](size_t i) { return 0.3 * (static_cast<double>(i % 5) - 2); };
  crowd.look = [](const crowd::Robots& seen, std::vector<double>* sensed) {
    for (const Stg::ModelPosition* robot : seen) {
      sensed->push_back(robot->GetPose().x);
      sensed->push_back(robot->Stalled());
    }
  };
  return crowd;
}

double StallsOf(const crowd::Outcome& outcome) {
  double stalls = 0;
  for (size_t i = 1; i < outcome.sensed.size(); i += 2) stalls += outcome.sensed[i];
  return stalls;
}

TEST(MovesTogether, InACrowd) {
  EXPECT_GT(StallsOf(crowd::ExpectSameHoweverItIsRun(Crowded("", 150, 0.02, 0.45))), 100);
  EXPECT_GT(StallsOf(crowd::ExpectSameHoweverItIsRun(Crowded("", 150, 0.1, 0.5))), 100);
}

/// With so many robots, several threads also schedule the next updates, with one interval or two.
TEST(MovesTogether, ManyRobots) {
  for (const char* extras :
       {"", "position( alwayson 1 update_interval 200 pose [-9 -9 0 0] size [0.1 0.1 0.1] )\n"}) {
    crowd::Crowd crowd = Crowded(extras, 4100, 0.1, 0.5);
    crowd.steps = 4;
    crowd::ExpectSameHoweverItIsRun(crowd);
  }
}

TEST(MovesTogether, WithLargeBodiesAmongThem) {
  const std::string large =
      "position( size [9 9 0.2] pose [0 0 0 10] block( points 3 point[0] [0 0] point[1] [1 0] "
      "point[2] [0 0.05] z [0 1] ) )\n";
  crowd::ExpectSameHoweverItIsRun(Crowded(large, 100, 0.02, 0.6));
}

TEST(MovesTogether, WithRobotsOnRobots) {
  const std::string tower =
      "position( size [0.5 0.5 0.2] pose [5 5 0 0] position( size [0.3 0.3 0.2] ) )\n";
  crowd::ExpectSameHoweverItIsRun(Crowded(tower, 100, 0.05, 0.6));
}

TEST(MovesTogether, OutlinesForExactRays) {
  crowd::ExpectSameHoweverItIsRun(Crowded("ray_model \"exact\"\n", 80, 0.05, 0.5));
}

/// Robots drive with an edge on a border of regions (64 cells), so that cells on the other side, in
/// otherwise empty regions, are rasterized, too.
TEST(MovesTogether, OutlinesForExactRaysOnBordersOfRegions) {
  Stg::World::run_options.threads = 4;
  Stg::World::run_options.share_from = 1;
  const auto world =
      Stg::LoadText("resolution 0.0625\nray_model \"exact\"\n" + crowd::Repeat(40, [](int i) {
                      return "position( name \"r" + std::to_string(i) +
                             "\" size [0.5 0.5 0.3] velocity_bounds [-100 100 0 0 0 0 0 0] pose [" +
                             std::to_string(8 * i + 0.25) +
                             " 0 0 90] ranger( sensor( range [0 3] samples 3 ) ) )\n";
                    }));
  Stg::World::run_options = Stg::RunOptions();
  for (int i = 0; i < 40; i++) {
    const std::string name = "r" + std::to_string(i);
    Stg::FindRunning<Stg::ModelRanger>(*world, name + ".ranger:0");
    Stg::FindRunning<Stg::ModelPosition>(*world, name)->SetSpeed(70, 0, 0);
  }
  const Stg::grid::Grid& grid = world->host().scene.grid;
  for (int step = 0; step < 10; step++) {
    Stg::Step(*world);
    // Region 0 must stay empty: cells without a region would be there.
    for (Stg::grid::LayerIndex layer = 0; layer < grid.layer_count(); layer++)
      ASSERT_EQ(grid.occupancy(layer).tile_maps()[0], 0u) << step;
    ASSERT_NE(grid.OutlinesIn(grid.FindTileSlot(-1, static_cast<int>(112 * step + 112))), 0u);
  }
}

TEST(MovesTogether, OutlinesForExactRaysLieInTheCellsOfTheirPlacement) {
  const auto world = Stg::LoadText(
      "resolution 0.1\nray_model \"exact\"\nposition( name \"robot\" size [0.5 0.3 0.3] ranger( "
      "name "
      "\"lidar\" sensor( range [0 3] samples 3 ) ) )\n");
  Stg::FindRunning<Stg::ModelRanger>(*world, "robot.lidar");
  Stg::Step(*world);
  Stg::Model* const robot = world->GetModel("robot");
  Stg::RandomStream random(3);
  for (int i = 0; i < 2000; i++) {
    const auto tenths = [&] { return static_cast<int>(random.Uniform(-30, 30)) * 0.1; };
    const double turn = i % 3 == 0 ? M_PI / 2 * (i % 4) : random.Uniform(-4, 4);
    robot->SetGlobalPose(Stg::Pose(tenths() + 0.05 * (i % 2), tenths(), 0, turn));
    Stg::Placement placement;
    placement.Propose(*robot, true);
    const CellBox box = placement.Cells();
    Stg::grid::Rasterizations rasterizations;
    robot->body().AppendRasterizations(&rasterizations, true);
    ASSERT_EQ(rasterizations.of_bodies.size(), 1u);
    rasterizations.ForEachCell([&](Stg::grid::CellRef cell) {
      int32_t x, y;
      world->host().scene.grid.Coordinates(cell, &x, &y);
      ASSERT_TRUE(x >= box.min_x && x <= box.max_x && y >= box.min_y && y <= box.max_y) << i;
    });
  }
}

TEST(MovesTogether, TransparentBodies) {
  const std::string ghosts = crowd::Repeat(10, [](int i) {
    return "position( size [0.3 0.3 0.3] ranger_return -1 pose [" + std::to_string(0.4 * i - 3) +
           " -3.5 0 0] )\n";
  });
  crowd::ExpectSameHoweverItIsRun(Crowded(ghosts, 80, 0.05, 0.5));
}

void ExpectSameOfFastRobots(const std::string& extras) {
  crowd::Crowd crowd = Crowded(extras, 100, 0.05, 0.6);
  crowd.speed = 80;  // 160 cells per step, so that tiles and regions appear and disappear
  crowd.world = "define fast position( velocity_bounds [-100 100 0 0 0 0 -90 90] )\n" + crowd.world;
  for (size_t at; (at = crowd.world.find("\nposition(")) != std::string::npos;)
    crowd.world.replace(at, 10, "\nfast(");
  crowd::ExpectSameHoweverItIsRun(crowd);
}

TEST(MovesTogether, FastRobotsThatLeaveTheirRegions) {
  ExpectSameOfFastRobots("");
  ExpectSameOfFastRobots("ray_model \"exact\"\n");
}

// ---- callbacks ----------------------------------------------------------------------------------

struct Log {
  std::vector<int> calls;
};

int Note(Stg::Model*, void* user) {
  const auto& [log, number] = *static_cast<std::pair<Log*, int>*>(user);
  log->calls.push_back(number);
  return 0;
}

constexpr const char* kTwoRangers =
    "position( size [0.3 0.3 0.3] ranger( sensor( samples 3 ) ) ranger( sensor( samples 2 ) ) )\n";

/// A world with robots with two rangers each, which runs on four threads.
std::unique_ptr<Stg::World> RobotsWithTwoRangers(int count) {
  Stg::World::run_options.threads = 4;
  Stg::World::run_options.share_from = 1;
  std::unique_ptr<Stg::World> world =
      Stg::LoadText(crowd::Repeat(count, [](int) { return std::string(kTwoRangers); }));
  Stg::World::run_options = Stg::RunOptions();
  return world;
}

std::vector<Stg::Model*> RangersOf(const Stg::World& world) {
  std::vector<Stg::Model*> rangers;
  for (Stg::Model* robot : world.GetChildren())
    for (Stg::Model* child : robot->GetChildren()) rangers.push_back(child);
  return rangers;
}

TEST(CallbacksTogether, OfATreeAreCalledInTheirOrder) {
  const auto world = RobotsWithTwoRangers(200);
  std::vector<Log> logs(200);
  std::vector<std::pair<Log*, int>> entries(400);
  const std::vector<Stg::Model*> rangers = RangersOf(*world);
  ASSERT_EQ(rangers.size(), 400u);
  for (size_t i = 0; i < rangers.size(); i++) {
    entries[i] = {&logs[i / 2], static_cast<int>(i % 2)};
    rangers[i]->AddParallelCallback(Stg::Model::CB_UPDATE, Note, &entries[i]);
    rangers[i]->Subscribe();
  }
  for (int step = 0; step < 5; step++) world->Update();
  for (const Log& log : logs)
    EXPECT_EQ(log.calls, (std::vector<int>{0, 1, 0, 1, 0, 1, 0, 1, 0, 1}));
}

TEST(CallbacksTogether, SerialCallbacksKeepTheirOrder) {
  for (const int robots : {60, 2100}) {
    const auto world = RobotsWithTwoRangers(robots);
    const std::vector<Stg::Model*> rangers = RangersOf(*world);
    Log all;
    std::vector<Log> own(rangers.size());
    std::vector<std::pair<Log*, int>> entries(rangers.size());
    for (size_t i = 0; i < rangers.size(); i++) {
      const bool parallel = i % 7 < 4;
      entries[i] = {parallel ? &own[i] : &all, static_cast<int>(i)};
      if (parallel)
        rangers[i]->AddParallelCallback(Stg::Model::CB_UPDATE, Note, &entries[i]);
      else if (i % 7 < 6)  // some have none
        rangers[i]->AddCallback(Stg::Model::CB_UPDATE, Note, &entries[i]);
      rangers[i]->Subscribe();
    }
    world->Update();
    world->Update();
    std::vector<int> expected;
    for (size_t i = 0; i < rangers.size(); i++) {
      if (i % 7 >= 4 && i % 7 < 6) expected.push_back(static_cast<int>(i));
      EXPECT_EQ(own[i].calls.size(), i % 7 < 4 ? 2u : 0u);
    }
    const std::vector<int> once = expected;
    expected.insert(expected.end(), once.begin(), once.end());
    EXPECT_EQ(all.calls, expected);
  }
}

TEST(CallbacksTogether, UseSeveralThreads) {
  const auto world = RobotsWithTwoRangers(200);
  static std::mutex mutex;
  static std::set<std::thread::id> threads;
  for (Stg::Model* ranger : RangersOf(*world)) {
    ranger->AddParallelCallback(
        Stg::Model::CB_UPDATE,
        [](Stg::Model*, void*) {
          std::this_thread::sleep_for(std::chrono::microseconds(100));
          const std::lock_guard<std::mutex> lock(mutex);
          threads.insert(std::this_thread::get_id());
          return 0;
        },
        nullptr);
    ranger->Subscribe();
  }
  world->Update();
  EXPECT_GT(threads.size(), 1u);
}

TEST(CallbacksTogether, OneThatReturnsNonZeroIsRemoved) {
  const auto world = RobotsWithTwoRangers(100);
  static std::atomic<int> calls{0};
  for (Stg::Model* ranger : RangersOf(*world)) {
    ranger->AddParallelCallback(
        Stg::Model::CB_UPDATE,
        [](Stg::Model*, void*) {
          calls++;
          return 1;
        },
        nullptr);
    ranger->Subscribe();
  }
  for (int step = 0; step < 3; step++) world->Update();
  EXPECT_EQ(calls, 200);
}

// ---- updates ------------------------------------------------------------------------------------

/// A ranger class that counts its updates.
class CountingRanger : public Stg::ModelRanger {
 public:
  explicit CountingRanger(Stg::World* its_world) : ModelRanger(its_world, nullptr, "ranger") {}
  int updates = 0;

 protected:
  void Update() override {
    updates++;
    ModelRanger::Update();
  }
};

TEST(UpdatesTogether, DerivedClassesKeepTheirOwnUpdate) {
  const auto world = RobotsWithTwoRangers(10);
  for (Stg::Model* ranger : RangersOf(*world)) ranger->Subscribe();
  auto* mine = new CountingRanger(world.get());
  mine->Subscribe();
  for (int step = 0; step < 4; step++) world->Update();
  EXPECT_EQ(mine->updates, 4);
}

TEST(UpdatesTogether, VelocityCallbacksAreCalledInOrder) {
  const auto world = RobotsWithTwoRangers(30);
  Log log;
  std::vector<std::pair<Log*, int>> entries(30);
  int number = 0;
  for (Stg::Model* robot : world->GetChildren()) {
    if (robot == world->GetGround()) continue;
    entries[static_cast<size_t>(number)] = {&log, number};
    if (number % 3 == 0)
      robot->AddCallback(Stg::Model::CB_VELOCITY, Note, &entries[static_cast<size_t>(number)]);
    robot->Subscribe();
    number++;
  }
  world->Update();
  EXPECT_EQ(log.calls, (std::vector<int>{0, 3, 6, 9, 12, 15, 18, 21, 24, 27}));
}

}  // namespace
