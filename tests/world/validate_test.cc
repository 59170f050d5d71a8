// SPDX-License-Identifier: GPL-2.0-or-later
//
// World::Validate() finds each kind of corruption, and none in random worlds after any action.
// Assertions stop typical mistakes at the place.

#include <gtest/gtest.h>

#include <cstdlib>
#include <functional>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include "models/body.hh"
#include "stage.hh"
#include "support/failed_assertions.hh"
#include "support/meddler.hh"
#include "support/own_worlds.hh"
#include "support/random_world.hh"
#include "support/sanitized.hh"
#include "world/engine.hh"

namespace Stg {
namespace {

struct Corruption {
  std::string name;
  std::function<void(World*)> make;
  std::string fault;  ///< part of what Validate() says
};

Model* Wall(World* world) { return world->GetModel("wall"); }
Block& BlockOf(Model* model) { return *model->body().blocks()[0]; }
std::vector<grid::CellSet>& CellsOf(Model* model) {
  return const_cast<std::vector<grid::CellSet>&>(BlockOf(model).cells());
}
/// Pointer to a model that does not exist.
Model* Nobody() {
  static char somewhere[sizeof(Model)];
  return reinterpret_cast<Model*>(somewhere);
}

std::vector<Corruption> AllCorruptions() {
  return {
      {"models out of order",
       [](World* w) { std::swap(w->engine().models[1], w->engine().models[2]); },
       "wrong order in the list of models"},
      {"next id", [](World* w) { w->engine().next_model_id = 3; }, "an id that is yet to be given"},
      {"a child twice", [](World* w) { w->GetChildren().push_back(Wall(w)); },
       "a child that is listed twice"},
      {"a child of another",
       [](World* w) { Wall(w)->GetChildren().push_back(w->GetModel("puck")); },
       "another parent than the one it is under"},
      {"no child", [](World* w) { w->GetChildren().pop_back(); }, "models that are no children"},
      {"a deleted child", [](World* w) { w->GetChildren().push_back(Nobody()); },
       "a child that does not exist"},
      {"the ground", [](World* w) { w->ground = Nobody(); }, "a ground that does not exist"},
      {"a mover twice", [](World* w) { w->engine().moving.push_back(w->engine().moving.back()); },
       "wrong order in the list of moving models"},
      {"a mover that is deleted", [](World* w) { w->engine().moving.push_back(Nobody()); },
       "a model that does not exist in the list of moving models"},
      {"energy of a deleted model", [](World* w) { w->engine().energy.push_back(Nobody()); },
       "a model that does not exist in the list of models with energy"},
      {"radios out of order",
       [](World* w) { std::swap(w->engine().radios[0], w->engine().radios[1]); },
       "wrong order in the list of radios"},
      {"a field that is deleted", [](World* w) { w->engine().fields.push_back(nullptr); },
       "list of fields"},
      {"a ground sensor that is deleted",
       [](World* w) { w->engine().ground_sensors.push_back(nullptr); }, "list of ground sensors"},
      {"work for a deleted model", [](World* w) { w->engine().sensed.push_back(Nobody()); },
       "a step's work for a model that is deleted"},
      {"callbacks of a deleted model",
       [](World* w) { w->engine().update_callbacks_due.push_back(Nobody()); },
       "a step's work for a model that is deleted"},
      {"a hidden model that is not",
       [](World* w) { w->engine().hidden_from_rangers.push_back(Wall(w)); },
       "a wrong mark whether it is hidden from rangers"},
      {"an event of a deleted model",
       [](World* w) {
         const std::span<Scheduler::Event> events =
             w->engine().scheduler.AppendUninitialized(1000000, 1);
         events[0] = {Nobody(), nullptr, nullptr, 0};
       },
       "an event of a model that is deleted"},
      {"an event of another model",
       [](World* w) {
         const std::span<Scheduler::Event> events =
             w->engine().scheduler.AppendUninitialized(1000000, 1);
         events[0] = {Wall(w), nullptr, nullptr, UpdateGeneration::First(Wall(w)->GetId() + 1)};
       },
       "an event with another model's chain"},
      {"an update twice",
       [](World* w) {
         Scheduler::Event update;
         w->engine().scheduler.ForEach(
             [&](usec_t, const Scheduler::Event& event) { update = event; });
         w->engine().scheduler.Add(1000000, update);
       },
       "two updates that are due"},
      {"a body erased in the grid",
       [](World* w) {
         w->engine().scene.grid.Rasterize(BlockOf(Wall(w)).body(), CellsOf(Wall(w)), {});
       },
       "cells that are not in the grid"},
      {"cells of a block", [](World* w) { CellsOf(Wall(w))[0].cells = 0; },
       "cells in the grid of no model"},
      {"a tile of a block", [](World* w) { CellsOf(Wall(w)).pop_back(); },
       "cells in the grid of no model"},
      {"a slot", [](World* w) { CellsOf(Wall(w))[0].slot++; }, "a tile in a wrong slot"},
      {"tiles out of order", [](World* w) { std::swap(CellsOf(Wall(w))[0], CellsOf(Wall(w))[1]); },
       "a body whose tiles are not in order"},
      {"a body of nobody",
       [](World* w) {
         grid::Body body;
         body.model = Wall(w);
         w->engine().scene.grid.AddBody(body);
       },
       "a body in the grid of no model"},
      {"another tree",
       [](World* w) {
         grid::Grid& grid = w->engine().scene.grid;
         grid::Body body = grid.body(BlockOf(Wall(w)).body());
         body.tree = w;
         grid.ChangeBody(BlockOf(Wall(w)).body(), body, CellsOf(Wall(w)));
       },
       "a body that is another tree's"},
      {"another model",
       [](World* w) {
         grid::Grid& grid = w->engine().scene.grid;
         grid::Body body = grid.body(BlockOf(Wall(w)).body());
         body.model = w->GetModel("puck");
         grid.ChangeBody(BlockOf(Wall(w)).body(), body, CellsOf(Wall(w)));
       },
       "a body that is another model's"},
      {"corners of a block",
       [](World* w) { const_cast<std::vector<point_t>&>(BlockOf(Wall(w)).points())[0].x += 1; },
       "a body that is rasterized elsewhere"},
      {"the extent", [](World* w) { w->engine().scene.grid.SetExtent(grid::CellBox()); },
       "the grid: some cells lie outside of the extent"},
  };
}

TEST(WorldValidateTest, FindsEachKindOfCorruption) {
  Init(nullptr, nullptr);
  // Never destroyed, because a corrupt world cannot be.
  static auto& worlds = *new std::vector<std::unique_ptr<World>>;
  for (const bool exact : {false, true})
    for (const Corruption& corruption : AllCorruptions()) {
      worlds.push_back(LoadRobotsOfAllTypes(1, exact));
      World& world = *worlds.back();
      for (int i = 0; i < 3; i++) world.Update();
      EXPECT_EQ(world.Validate(), "");
      const test::FailedAssertions ignored;
      corruption.make(&world);
      EXPECT_NE(world.Validate().find(corruption.fault), std::string::npos)
          << corruption.name << ": \"" << world.Validate() << '"';
    }
}

TEST(WorldValidateTest, FindsNoFaultInAnEmptyWorld) {
  World world(OptionsOf(1));
  EXPECT_EQ(world.Validate(), "");
}

TEST(WorldValidateTest, FindsNoFaultAfterAnyChange) {
  Init(nullptr, nullptr);
  SetLogSink([](LogLevel, const std::string&) {});
  constexpr uint64_t kRuns = kSanitized ? 3 : 20;
  for (uint64_t seed = 0; seed < kRuns; seed++) {
    const std::unique_ptr<World> world = LoadRobotsOfAllTypes(seed, seed % 3 == 0);
    for (int step = 0; step < 40; step++) {
      Go(world.get(), seed, step, 1, 10);
      ASSERT_EQ(world->Validate(), "") << "seed " << seed << ", step " << step;
    }
    world->UnLoad();
    EXPECT_EQ(world->Validate(), "") << "unloaded, seed " << seed;
  }
  SetLogSink(nullptr);
}

/// Checks a world at the end of each step, after the driver's changes.
int CheckAtEndOfStep(World* world, void* steps) {
  EXPECT_EQ(world->Validate(), "") << "step " << world->GetUpdateCount();
  ++*static_cast<int*>(steps);
  return 0;
}

TEST(WorldValidateTest, FindsNoFaultInRandomWorldsWithThreads) {
  Init(nullptr, nullptr);
  SetLogSink([](LogLevel, const std::string&) {});
  constexpr uint64_t kWorlds = kSanitized ? 3 : 15;
  for (uint64_t seed = 0; seed < kWorlds; seed++) {
    const random_world::WorldText text(seed);
    RunOptions options = OptionsOf(seed);
    options.threads = 3;
    options.share_from = 1;
    World world(options);
    std::istringstream stream(text.text());
    ASSERT_TRUE(world.Load(stream));
    random_world::Driver driver(seed, text.resolution(), true);
    driver.Attach(&world);
    int steps = 0;
    world.AddUpdateCallback(CheckAtEndOfStep, &steps);
    for (uint64_t i = 0; i < text.steps(); i++) world.Update();
    EXPECT_GT(steps, 0);
    EXPECT_EQ(world.Validate(), "");
  }
  SetLogSink(nullptr);
}

/// A callback with a mistake: it breaks the list of moving models.
int BreakList(Model* model, void*) {
  model->GetWorld()->engine().moving.push_back(model);
  return 1;
}

TEST(WorldValidateTest, BuildsWithAssertionsCheckAfterEachPhaseIfAskedTo) {
  Init(nullptr, nullptr);
  for (const char* const asked : {"1", "0"}) {
    setenv("STAGE_VALIDATE", asked, 1);
    const std::unique_ptr<World> world = LoadRobotsOfAllTypes(1);
    unsetenv("STAGE_VALIDATE");
    world->GetModel("a")->AddCallback(Model::CB_UPDATE, BreakList, nullptr);
    const test::FailedAssertions failed;
    world->Update();
    const bool told = failed.Text().find(
                          "after the phase callbacks: wrong order in the list of "
                          "moving models, model 1 (a)") != std::string::npos;
    EXPECT_EQ(told, test::kAssertions && asked == std::string("1")) << failed.Text();
    world->engine().moving.pop_back();
  }
}

// Typical mistakes in code that uses the lists of a world. In builds with assertions they are
// noticed where they happen, in others by Validate().

/// Checks that an assertion of this file, with this condition, failed if the build has any.
void ExpectFailed(const test::FailedAssertions& failed, const std::string& file,
                  const std::string& condition) {
  if (!test::kAssertions) return;
  const std::string text = failed.Text();
  const size_t line = text.find(file + ":");
  ASSERT_NE(line, std::string::npos) << text;
  const size_t number = line + file.size() + 1;
  EXPECT_GT(std::atoi(text.c_str() + number), 0) << text;
  EXPECT_NE(text.find(condition, number), std::string::npos) << text;
}

TEST(WorldMistakesTest, ModelsMoveInTheWrongOrder) {
  Init(nullptr, nullptr);
  const std::unique_ptr<World> world = LoadRobotsOfAllTypes(1);
  std::vector<Model*>& moving = world->engine().moving;
  ASSERT_GT(moving.size(), 1u);
  std::swap(moving[0], moving[1]);
  EXPECT_NE(world->Validate().find("wrong order in the list of moving models"), std::string::npos);
  const test::FailedAssertions failed;
  world->Update();
  ExpectFailed(failed, "libstage/world/phases/move_phase.cc", "is_sorted(moving");
  std::swap(moving[0], moving[1]);
}

TEST(WorldMistakesTest, AModelIsInsertedWhereAListIsOutOfOrder) {
  Init(nullptr, nullptr);
  const std::unique_ptr<World> world = LoadRobotsOfAllTypes(1);
  const std::vector<Model*>& models = world->engine().models;
  ASSERT_GT(models.size(), 3u);
  std::vector<Model*> list = {models[0], models[2], models[1]};
  const test::FailedAssertions failed;
  Host::Insert(&list, models[3]);
  ExpectFailed(failed, "libstage/models/host.cc", "IsInOrderAround");
}

TEST(WorldMistakesTest, ADeletedModelStaysInTheListOfMovingModels) {
  Init(nullptr, nullptr);
  const std::unique_ptr<World> world = LoadRobotsOfAllTypes(1);
  std::vector<Model*>& moving = world->engine().moving;
  Model* const wall = Wall(world.get());  // it does not leave the list, as it never moves
  world->engine().StartMoving(wall);
  EXPECT_EQ(world->Validate(), "");
  const test::FailedAssertions failed;
  delete wall;
  ExpectFailed(failed, "libstage/world/engine.cc", "binary_search(moving, model->GetId()");
  EXPECT_NE(world->Validate().find("a model that does not exist in the list of moving models"),
            std::string::npos);
  std::erase(moving, wall);
}

TEST(WorldMistakesTest, AnUpdateIsScheduledWithTheGenerationOfAnotherModel) {
  Init(nullptr, nullptr);
  const std::unique_ptr<World> world = LoadRobotsOfAllTypes(1);
  Model* const wall = Wall(world.get());
  const test::FailedAssertions failed;
  world->engine().ScheduleUpdate(wall, 1000000, UpdateGeneration::First(wall->GetId() + 1));
  ExpectFailed(failed, "libstage/world/scheduler.hh",
               "event.generation >> 32 == event.model->GetId()");
  EXPECT_NE(world->Validate().find("an event with another model's chain"), std::string::npos);
}

}  // namespace
}  // namespace Stg
