// SPDX-License-Identifier: GPL-2.0-or-later
//
// The work of loading, deleting and stepping is proportional to the number of models. Work is
// counted, because times depend on the machine.

#include <set>

#include "support/model_testing.hh"
#include "support/sanitized.hh"
#include "world/engine.hh"

namespace Stg {
namespace {

constexpr size_t kMany = 4000;

std::string Many(const std::string& type, double distance, const std::string& properties) {
  std::string text;
  for (size_t i = 0; i < kMany; i++) {
    const size_t row = i / 100;
    text += type + "( pose [" + std::to_string(static_cast<double>(i % 100) * distance) + " " +
            std::to_string(static_cast<double>(row) * distance) + " 0 0] " + properties + " )\n";
  }
  return text;
}

void DeleteAll(World* world) {
  const std::vector<Model*> models(world->GetChildren().begin() + 1, world->GetChildren().end());
  for (const Model* model : models) delete model;
}

/// Each body is in a separate superregion.
TEST(Scaling, ScatteredBodiesAreEnteredAFewTimesEach) {
  const auto world = LoadText(Many("model", 30, ""));
  const grid::Grid::Statistics statistics = world->host().scene.grid.statistics();
  EXPECT_GT(statistics.superregions, kMany);
  // The directory grows by doubling, so the total work is 1 + 1/2 + 1/4 + ...
  EXPECT_LT(statistics.entered, 3 * statistics.superregions);
}

TEST(Scaling, DeletedModelsNamesAreSweptTogether) {
  const auto world = LoadText(Many("model", 1, ""));
  const ModelNames& names = world->engine().names;
  EXPECT_GT(names.size(), kMany);
  DeleteAll(world.get());
  EXPECT_LT(names.looked_at(), 4 * kMany);
  // Names of deleted models do not accumulate.
  for (size_t i = 0; i < 2 * kMany; i++) delete new Model(world.get());
  EXPECT_LT(names.size(), 2000u);
  EXPECT_LT(names.looked_at(), 16 * kMany);
}

TEST(Scaling, DeletedModelsEventsAreDroppedTogether) {
  const auto world = LoadText(Many("model", 1, "alwayson 1"));
  DeleteAll(world.get());
  Step(*world, 2);
  EXPECT_LT(world->engine().scheduler.looked_at(), 2 * kMany);
}

TEST(Scaling, DeletedModelsAreRemovedFromLists) {
  const auto world =
      LoadText(Many("model", 1, "fiducial_return 1 fiducial( alwayson 1 range_max 2 )"));
  Step(*world, 2);
  size_t found = 0;
  for (Model* model : world->GetAllModels())
    if (auto* finder = dynamic_cast<ModelFiducial*>(model)) found += finder->GetFiducials().size();
  EXPECT_GT(found, kMany);
  DeleteAll(world.get());
  EXPECT_LT(world->engine().fiducials->looked_at(), 3 * found);
}

// ---- deleted models leave nothing behind --------------------------------------------------------

int Count(Model*, void* calls) {
  ++*static_cast<int*>(calls);
  return 0;
}

/// A new model may have the address of a deleted one, but must not get its events.
TEST(Scaling, NewModelsDoNotGetEventsOfDeletedOnes) {
  const auto world = EmptyWorld();
  int calls = 0;
  std::set<const Model*> places;
  for (int i = 0; i < 50; i++) {
    auto* model = new Model(world.get());
    places.insert(model);
    world->Enqueue(0, 1000, model, Count, &calls);
    model->Subscribe();
    delete model;
  }
  // Check that addresses were reused. AddressSanitizer delays that.
  if (!kSanitized) {
    EXPECT_LT(places.size(), 50u);
  }
  auto* last = new Model(world.get());
  world->Enqueue(0, 1000, last, Count, &calls);
  int updates = 0;
  last->AddCallback(Model::CB_UPDATE, Count, &updates);
  last->Subscribe();
  Step(*world, 5);
  EXPECT_EQ(calls, 1);
  EXPECT_EQ(updates, 5);
}

TEST(Scaling, NamesOfDeletedModelsFindNothing) {
  const auto world = LoadText("model( name \"a\" ) model( name \"a\" )");
  Model* second = Find(*world, "a");
  EXPECT_EQ(Find(*world, "model:2"), second);
  delete second;
  for (const char* name : {"a", "model:2"})
    OutputOf([&] { EXPECT_EQ(world->GetModel(name), nullptr); });
  Model* third = new Model(world.get(), nullptr, "model", "a");
  EXPECT_EQ(world->GetModel("a"), third);
}

TEST(Scaling, FinderDropsOnlyDeletedModels) {
  const auto world = LoadText(
      "fiducial( name \"f\" alwayson 1 pose [0 0 0 0] fov 360 )"
      "model( name \"a\" pose [1 0 0 0] size [0.2 0.2 1] fiducial_return 1 )"
      "model( name \"b\" pose [0 1 0 0] size [0.2 0.2 1] fiducial_return 2 )"
      "model( name \"c\" pose [-1 0 0 0] size [0.2 0.2 1] fiducial_return 3 )");
  Step(*world, 1);
  auto* finder = Find<ModelFiducial>(*world, "f");
  ASSERT_EQ(finder->GetFiducials().size(), 3u);
  delete Find(*world, "b");
  ASSERT_EQ(finder->GetFiducials().size(), 2u);
  EXPECT_EQ(finder->GetFiducials()[1].id, 3);
  delete Find(*world, "c");
  ASSERT_EQ(finder->GetFiducials().size(), 1u);
  Step(*world, 2);
  ASSERT_EQ(finder->GetFiducials().size(), 1u);
  delete Find(*world, "a");
  EXPECT_TRUE(finder->GetFiducials().empty());
}

/// A deleted pack is no longer charged, and a pack forgets its deleted charger.
TEST(Scaling, ChargersAndPacksCanBeDeletedInAnyOrder) {
  const char kPair[] =
      "model( name \"giver\" alwayson 1 joules -1 give_watts 10 size [1 1 1] )"
      "model( name \"taker\" take_watts 5 joules_capacity 1000 pose [0.5 0 0 0] size [1 1 1] )";
  for (const char* victim : {"giver", "taker"}) {
    const auto world = LoadText(kPair);
    Step(*world, 2);
    PowerPack* pack = Find(*world, "taker")->FindPowerPack();
    EXPECT_TRUE(pack->GetCharging());
    delete Find(*world, victim);
    if (victim == std::string("giver")) {
      EXPECT_FALSE(pack->GetCharging());
    }
    Step(*world, 2);
  }
}

}  // namespace
}  // namespace Stg
