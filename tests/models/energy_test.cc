// SPDX-License-Identifier: GPL-2.0-or-later
//
// Energy: power packs, their properties in world files, consumption, and charging by contact.

#include <cmath>
#include <limits>

#include "support/model_testing.hh"

namespace Stg {
namespace {

const double kNaN = std::numeric_limits<double>::quiet_NaN();

PowerPack* PackOf(const World& world, const std::string& name) {
  PowerPack* pack = Find(world, name)->FindPowerPack();
  EXPECT_NE(pack, nullptr) << name;
  return pack;
}

/// Stored energy and capacity of a model, joules.
struct Amounts {
  double stored, capacity;
  bool operator==(const Amounts& o) const { return stored == o.stored && capacity == o.capacity; }
};
void PrintTo(const Amounts& a, std::ostream* out) { *out << a.stored << " of " << a.capacity; }

Amounts AmountsFor(const std::string& properties) {
  const auto world = LoadText("model( name \"m\" " + properties + " )");
  PowerPack* pack = PackOf(*world, "m");
  return {pack->GetStored(), pack->GetCapacity()};
}

/// The energy in a model's pack at the beginning and after each step.
std::vector<double> StoredOver(World& world, const std::string& name, int steps) {
  std::vector<double> stored = {PackOf(world, name)->GetStored()};
  for (int i = 0; i < steps; i++) {
    Step(world);
    stored.push_back(PackOf(world, name)->GetStored());
  }
  return stored;
}

using Series = std::vector<double>;

/// A robot with 2 kg, which drives at 0.5 m/s with 11 W.
std::string RobotWith(const std::string& properties) {
  return "position( name \"r\" size [0.3 0.3 0.3] mass 2 alwayson 1 " + properties + " )\n";
}

// ---- robots without energy ----------------------------------------------------------------------

TEST(EmptyPack, StopsItsRobotUnlessTheWorldSaysOtherwise) {
  for (const bool stops : {true, false}) {
    const auto world = LoadText(RobotWith(stops ? "joules 5" : "joules 5 stops_when_empty 0"));
    auto* const robot = Find<ModelPosition>(*world, "r");
    robot->SetSpeed(0.5, 0, 0);
    Step(*world, 5);  // 5 * 1.1 J
    EXPECT_EQ(PackOf(*world, "r")->GetStored(), 0);
    EXPECT_NEAR(robot->GetPose().x, 0.25, 1e-12);
    Step(*world, 5);
    EXPECT_NEAR(robot->GetPose().x, stops ? 0.25 : 0.5, 1e-12);
    EXPECT_EQ(robot->GetVelocity().x, stops ? 0 : 0.5);
    EXPECT_FALSE(robot->Stalled());
  }
}

TEST(EmptyPack, CommandsWaitUntilItIsCharged) {
  const auto world = LoadText(RobotWith("joules_capacity 100"));
  auto* const robot = Find<ModelPosition>(*world, "r");
  robot->SetSpeed(0.5, 0, 0);
  Step(*world, 3);
  robot->SetVelocity(Velocity(0.5, 0, 0, 0));
  EXPECT_TRUE(robot->GetVelocity().IsZero());
  robot->GoTo(1, 0, 0);
  Step(*world, 3);
  EXPECT_EQ(robot->GetPose().x, 0);
  robot->SetSpeed(0.5, 0, 0);
  PackOf(*world, "r")->Add(50);
  Step(*world, 2);
  EXPECT_NEAR(robot->GetPose().x, 0.1, 1e-12);
}

TEST(EmptyPack, ThatOfAParentStopsARobotOnItToo) {
  const auto world =
      LoadText("model( name \"m\" joules_capacity 10 position( name \"r\" alwayson 1 ) )\n");
  auto* const robot = Find<ModelPosition>(*world, "m.r");
  robot->SetSpeed(0.5, 0, 0);
  Step(*world, 2);
  EXPECT_TRUE(robot->GetVelocity().IsZero());
}

TEST(EmptyPack, AnInfiniteSupplyAndNoPackNeverStopARobot) {
  for (const char* energy : {"", "joules -1"}) {
    const auto world = LoadText(RobotWith(energy));
    auto* const robot = Find<ModelPosition>(*world, "r");
    robot->SetSpeed(0.5, 0, 0);
    Step(*world, 2);
    EXPECT_EQ(robot->GetVelocity().x, 0.5) << energy;
  }
}

// ---- packs --------------------------------------------------------------------------------------

class Pack : public testing::Test {
 protected:
  std::unique_ptr<World> world = EmptyWorld();
  PowerPack pack{world->GetGround()}, other{world->GetGround()};
  const double stored0 = PowerPack::global_stored, capacity0 = PowerPack::global_capacity;
  const double dissipated0 = PowerPack::global_dissipated, input0 = PowerPack::global_input;

  void Fill(PowerPack* p, double stored, double capacity) {
    p->SetCapacity(capacity);
    p->SetStored(stored);
  }
  void ExpectTotals(double stored, double capacity, double dissipated, double input) {
    EXPECT_NEAR(PowerPack::global_stored - stored0, stored, 1e-9);
    EXPECT_NEAR(PowerPack::global_capacity - capacity0, capacity, 1e-9);
    EXPECT_NEAR(PowerPack::global_dissipated - dissipated0, dissipated, 1e-9);
    EXPECT_NEAR(PowerPack::global_input - input0, input, 1e-9);
  }
};

TEST_F(Pack, BeginsEmpty) {
  EXPECT_EQ(pack.GetStored(), 0);
  EXPECT_EQ(pack.GetCapacity(), 0);
  EXPECT_EQ(pack.GetDissipated(), 0);
  EXPECT_EQ(pack.RemainingCapacity(), 0);
  EXPECT_TRUE(std::isnan(pack.ProportionRemaining()));
  EXPECT_FALSE(pack.GetCharging());
}

TEST_F(Pack, AcceptsOnlyUpToItsCapacity) {
  Fill(&pack, 4, 10);
  EXPECT_EQ(pack.RemainingCapacity(), 6);
  EXPECT_EQ(pack.ProportionRemaining(), 0.4);
  pack.Add(2);
  EXPECT_EQ(pack.GetStored(), 6);
  EXPECT_TRUE(pack.GetCharging());
  pack.ChargeStop();
  pack.Add(100);
  EXPECT_EQ(pack.GetStored(), 10);
  EXPECT_TRUE(pack.GetCharging());
  pack.ChargeStop();
  pack.Add(1);
  EXPECT_FALSE(pack.GetCharging()) << "it was full";
  pack.ChargeStart();
  EXPECT_TRUE(pack.GetCharging());
  ExpectTotals(10, 10, 0, 0);
}

TEST_F(Pack, GivesAtMostItsStoredEnergy) {
  Fill(&pack, 4, 10);
  pack.Subtract(1);
  EXPECT_EQ(pack.GetStored(), 3);
  pack.Dissipate(2);
  EXPECT_EQ(pack.GetStored(), 1);
  EXPECT_EQ(pack.GetDissipated(), 2);
  pack.Dissipate(5, Pose(1, 2, 0, 0));
  EXPECT_EQ(pack.GetStored(), 0);
  EXPECT_EQ(pack.GetDissipated(), 3);
  pack.Subtract(1);
  EXPECT_EQ(pack.GetStored(), 0);
  ExpectTotals(0, 10, 3, 0);
}

TEST_F(Pack, SetCapacityClampsAndSetStoredDoesNot) {
  Fill(&pack, 8, 10);
  pack.SetCapacity(5);
  EXPECT_EQ(pack.GetStored(), 5);
  pack.SetStored(7);
  EXPECT_EQ(pack.GetStored(), 7);
  pack.Add(1);
  EXPECT_EQ(pack.GetStored(), 7) << "too full to take anything, and nothing is lost";
  ExpectTotals(7, 5, 0, 0);
}

TEST_F(Pack, TransfersWhatBothAllow) {
  Fill(&pack, 5, 10);
  Fill(&other, 1, 3);
  pack.TransferTo(&other, 1.5);
  EXPECT_EQ(pack.GetStored(), 3.5);
  EXPECT_EQ(other.GetStored(), 2.5);
  EXPECT_TRUE(other.GetCharging());
  pack.TransferTo(&other, 10);
  EXPECT_EQ(pack.GetStored(), 3);
  EXPECT_EQ(other.GetStored(), 3);
  other.SetCapacity(100);
  pack.TransferTo(&other, 10);
  EXPECT_EQ(pack.GetStored(), 0);
  EXPECT_EQ(other.GetStored(), 6);
  ExpectTotals(6, 110, 0, 0);
}

TEST_F(Pack, InfinitePacksGiveEndlesslyAndAcceptNothing) {
  Fill(&pack, -1, -1);
  EXPECT_EQ(pack.ProportionRemaining(), 1);
  EXPECT_EQ(pack.RemainingCapacity(), 0);
  pack.Subtract(5);
  pack.Dissipate(2);
  Fill(&other, 0, 4);
  pack.TransferTo(&other, 3);
  EXPECT_EQ(pack.GetStored(), -1);
  EXPECT_EQ(pack.GetDissipated(), 2);
  EXPECT_EQ(other.GetStored(), 3);
  ExpectTotals(3, 4, 2, 10);
  other.TransferTo(&pack, 3);
  pack.SetCapacity(5);
  pack.Add(3);
  EXPECT_EQ(pack.GetStored(), -1);
  EXPECT_EQ(other.GetStored(), 3);
  EXPECT_FALSE(pack.GetCharging());
}

TEST_F(Pack, AmountsThatAreNotPositiveDoNothing) {
  Fill(&pack, 5, 10);
  Fill(&other, 2, 3);
  for (const double amount : {0.0, -2.0, kNaN}) {
    pack.Add(amount);
    pack.Subtract(amount);
    pack.Dissipate(amount);
    pack.TransferTo(&other, amount);
  }
  other.SetStored(8);  // more than the capacity
  pack.TransferTo(&other, 1);
  EXPECT_EQ(pack.GetStored(), 5);
  EXPECT_EQ(other.GetStored(), 8);
  EXPECT_EQ(pack.GetDissipated(), 0);
  EXPECT_FALSE(pack.GetCharging());
  EXPECT_FALSE(other.GetCharging());
}

TEST_F(Pack, DeletionUpdatesTheTotals) {
  {
    PowerPack passing(world->GetGround());
    Fill(&passing, 3, 9);
    ExpectTotals(3, 9, 0, 0);
    passing.Dissipate(1);
  }
  ExpectTotals(0, 0, 1, 0);
}

TEST_F(Pack, Prints) {
  Fill(&pack, 4, 10);
  const std::string text = OutputOf([&] { pack.Print("robot: "); });
  EXPECT_EQ(text.rfind("robot: ", 0), 0u) << text;
  EXPECT_NE(text.find("4.000 of 10.000"), std::string::npos) << text;
  OutputOf([&] { pack.Print(nullptr); });
}

// ---- world files --------------------------------------------------------------------------------

TEST(EnergyProperties, MakePacks) {
  EXPECT_EQ(AmountsFor("joules 5"), (Amounts{5, 5}));
  EXPECT_EQ(AmountsFor("kjoules 5"), (Amounts{5000, 5000}));
  EXPECT_EQ(AmountsFor("joules_capacity 5"), (Amounts{0, 5}));
  EXPECT_EQ(AmountsFor("kjoules_capacity 5"), (Amounts{0, 5000}));
  EXPECT_EQ(AmountsFor("joules -1"), (Amounts{-1, -1}));
}

TEST(EnergyProperties, AreAppliedInAFixedOrder) {
  EXPECT_EQ(AmountsFor("joules 10 joules_capacity 20"), (Amounts{10, 20}));
  EXPECT_EQ(AmountsFor("joules_capacity 20 joules 10"), (Amounts{10, 20}));
  EXPECT_EQ(AmountsFor("joules 10 joules_capacity 5"), (Amounts{5, 5}));
  EXPECT_EQ(AmountsFor("joules 5 kjoules 1"), (Amounts{1000, 1000}));
  EXPECT_EQ(AmountsFor("kjoules_capacity 2 joules 5"), (Amounts{5, 2000}));
  EXPECT_EQ(AmountsFor("joules -1 joules_capacity 5"), (Amounts{-1, 5}));
}

TEST(EnergyProperties, TheNearestPackUpwardsIsFound) {
  const auto world = LoadText(
      "model( name \"a\" joules 1 model( name \"b\" model( name \"c\" joules 2 model( name \"d\" ) "
      ") ) )\n"
      "model( name \"e\" )");
  PowerPack *a = PackOf(*world, "a"), *c = PackOf(*world, "a.b.c");
  EXPECT_NE(a, c);
  EXPECT_EQ(PackOf(*world, "a.b"), a);
  EXPECT_EQ(PackOf(*world, "a.b.c.d"), c);
  EXPECT_EQ(Find(*world, "e")->FindPowerPack(), nullptr);
}

TEST(EnergyProperties, MustBeNumbers) {
  for (const char* property : {"joules \"nan\"", "joules_capacity \"inf\"", "give_watts \"nan\""})
    EXPECT_FALSE(TryToLoad(std::string("model( ") + property + " )").loaded) << property;
}

// ---- consumption --------------------------------------------------------------------------------

TEST(Consumption, RunningModelsDrawUntilNothingIsLeft) {
  const auto world = LoadText("model( name \"m\" watts 10 joules 5 alwayson 1 )");
  EXPECT_EQ(StoredOver(*world, "m", 7), (Series{5, 4, 3, 2, 1, 0, 0, 0}));
  EXPECT_EQ(PackOf(*world, "m")->GetDissipated(), 5);
}

TEST(Consumption, IsTheSameForEachStepWhateverItsLength) {
  for (const char* interval : {"20", "100", "200"}) {
    const auto world = LoadText(std::string("interval_sim ") + interval +
                                " model( name \"m\" watts 10 joules 5 alwayson 1 )");
    EXPECT_EQ(StoredOver(*world, "m", 2), (Series{5, 4, 3})) << interval;
  }
}

TEST(Consumption, OnlyRunningModelsDraw) {
  const auto world = LoadText("model( name \"m\" watts 10 joules 5 )");
  EXPECT_EQ(StoredOver(*world, "m", 1), (Series{5, 5}));
  Find(*world, "m")->Subscribe();
  EXPECT_EQ(StoredOver(*world, "m", 1), (Series{5, 4}));
  Find(*world, "m")->Subscribe();
  Find(*world, "m")->Unsubscribe();
  EXPECT_EQ(StoredOver(*world, "m", 1), (Series{4, 3}));
  Find(*world, "m")->SetWatts(20);
  EXPECT_EQ(StoredOver(*world, "m", 1), (Series{3, 1}));
  Find(*world, "m")->Unsubscribe();
  EXPECT_EQ(StoredOver(*world, "m", 1), (Series{1, 1}));
}

TEST(Consumption, PartsDrawFromTheRobotsPack) {
  // The robot consumes 1 W, its two sensors 0.2 W each, the lamp 7 W.
  const auto world = LoadText(
      "position( name \"r\" joules 10 ranger( name \"l\" sensor( ) sensor( ) ) "
      "model( name \"lamp\" watts 7 alwayson 1 ) )");
  Find(*world, "r")->Subscribe();
  Find(*world, "r.l")->Subscribe();
  Step(*world);
  EXPECT_NEAR(PackOf(*world, "r")->GetStored(), 10 - 0.1 - 0.04 - 0.7, 1e-12);
}

TEST(Consumption, DrivingCosts) {
  // 1 W + 10 W * mass * (|vx| + |vy| + |va|), before bounds; set at the first update.
  const auto world = LoadText("position( name \"r\" joules 100 mass 2 alwayson 1 )");
  Find<ModelPosition>(*world, "r")->SetSpeed(3, 0, -0.5);
  Step(*world);
  EXPECT_NEAR(PackOf(*world, "r")->GetStored(), 100 - 0.1 * (1 + 20 * 3.5), 1e-12);
}

TEST(Consumption, AnEmptyPackThatStopsNothingChangesNothing) {
  const char* robot = "position( name \"r\" mass 5 ranger( name \"l\" sensor( samples 20 ) ) ";
  const auto with = LoadText(std::string(robot) +
                             "joules_capacity 5 stops_when_empty 0 )\n model( pose [2 0 0 0] )");
  const auto without = LoadText(std::string(robot) + ")\n model( pose [2 0 0 0] )");
  for (World* world : {with.get(), without.get()}) {
    FindRunning<ModelPosition>(*world, "r")->SetSpeed(0.5, 0, 0.3);
    FindRunning<ModelRanger>(*world, "r.l");
    Step(*world, 50);
  }
  EXPECT_EQ(Find(*with, "r")->GetPose(), Find(*without, "r")->GetPose());
  EXPECT_EQ(Find<ModelRanger>(*with, "r.l")->GetSensors()[0].ranges,
            Find<ModelRanger>(*without, "r.l")->GetSensors()[0].ranges);
  EXPECT_EQ(PackOf(*with, "r")->GetDissipated(), 0);
}

TEST(Consumption, HappensAfterTheCallbacks) {
  const auto world = LoadText("model( name \"m\" watts 10 joules 5 alwayson 1 )");
  static double seen;
  Find(*world, "m")
      ->AddCallback(
          Model::CB_UPDATE,
          [](Model* mod, void*) {
            seen = mod->FindPowerPack()->GetStored();
            return 0;
          },
          nullptr);
  Step(*world);
  EXPECT_EQ(seen, 5);
  Step(*world);
  EXPECT_EQ(seen, 4);
}

TEST(Consumption, MovedModelsLoseTheirFormerPack) {
  const auto world = LoadText(
      "model( name \"a\" joules 5 model( name \"b\" watts 10 alwayson 1 ) ) model( name \"c\" )");
  Model* b = Find(*world, "a.b");
  Step(*world);
  EXPECT_EQ(PackOf(*world, "a")->GetStored(), 4);
  b->SetParent(Find(*world, "c"));
  Step(*world);
  EXPECT_EQ(b->FindPowerPack(), nullptr);
  EXPECT_EQ(PackOf(*world, "a")->GetStored(), 4);
}

// ---- charging -----------------------------------------------------------------------------------

// A charger of 1 m x 1 m at the origin. The takers in the tests touch its outline.
const char* const kCharger =
    "model( name \"giver\" size [1 1 1] joules -1 give_watts 100 alwayson 1 )\n";

TEST(Charging, ReachesAllTouchingModels) {
  const auto world = LoadText(
      std::string(kCharger) +
      "model( name \"a\" pose [0.5 0 0 0] joules 3 kjoules_capacity 0.03 take_watts 40 watts 10 "
      "alwayson 1 )\n"
      "model( name \"b\" pose [-0.5 0 0 0] joules_capacity 30 take_watts 400 )");
  EXPECT_EQ(StoredOver(*world, "a", 4), (Series{3, 6, 9, 12, 15}));
  EXPECT_TRUE(PackOf(*world, "a")->GetCharging());
  EXPECT_EQ(PackOf(*world, "b")->GetStored(), 30);
  EXPECT_TRUE(PackOf(*world, "b")->GetCharging()) << "full, but touching";
}

TEST(Charging, AddsEnergyPerStepUpToTheCapacity) {
  const auto world =
      LoadText(std::string(kCharger) +
               "model( name \"b\" pose [-0.5 0 0 0] joules_capacity 30 take_watts 400 )");
  EXPECT_EQ(StoredOver(*world, "b", 4), (Series{0, 10, 20, 30, 30}));
}

TEST(Charging, NeedsARunningGiverWithAPack) {
  const char* taker = "model( name \"t\" pose [0.5 0 0 0] joules_capacity 30 take_watts 40 )";
  for (const char* giver : {"model( size [1 1 1] joules -1 give_watts 100 )\n",
                            "model( size [1 1 1] give_watts 100 alwayson 1 )\n",
                            "model( size [1 1 1] joules_capacity 5 give_watts 100 alwayson 1 )\n",
                            "model( size [1 1 1] joules -1 alwayson 1 )\n"}) {
    const auto world = LoadText(std::string(giver) + taker);
    EXPECT_EQ(StoredOver(*world, "t", 2), (Series{0, 0, 0})) << giver;
  }
}

TEST(Charging, NeedsATakerWithTakeWattsAndPack) {
  for (const char* taker :
       {"model( name \"t\" pose [0.5 0 0 0] joules_capacity 30 )",
        "model( name \"t\" joules_capacity 30 model( pose [0.5 0 0 0] size [0.1 0.1 1] ) "
        "take_watts 40 pose [5 0 0 0] )"}) {
    const auto world = LoadText(std::string(kCharger) + taker);
    EXPECT_EQ(StoredOver(*world, "t", 2), (Series{0, 0, 0})) << taker;
    EXPECT_FALSE(PackOf(*world, "t")->GetCharging());
  }
}

TEST(Charging, GoesThroughAChildsContactIntoItsParentsPack) {
  const auto world = LoadText(std::string(kCharger) +
                              "position( name \"t\" pose [2 0 0 0] joules_capacity 30 "
                              "model( pose [-1.5 0 0 0] size [0.1 0.1 1] take_watts 40 ) )");
  EXPECT_EQ(StoredOver(*world, "t", 2), (Series{0, 4, 8}));
}

TEST(Charging, UsesOutlinesAndIgnoresHeights) {
  const char* taker = "size [0.2 0.2 0.2] joules_capacity 30 take_watts 40 )\n";
  const auto world =
      LoadText(std::string(kCharger) + "model( name \"inside\" pose [0 0 0 0] " + taker +
               "model( name \"above\" pose [0.5 0 5 0] " + taker +
               "model( name \"ghost\" pose [0 0.5 0 0] obstacle_return 0 ranger_return -1 " +
               taker + "model( name \"beside\" pose [0.7 0 0 0] " + taker);
  Step(*world);
  EXPECT_EQ(PackOf(*world, "inside")->GetStored(), 0);
  EXPECT_EQ(PackOf(*world, "above")->GetStored(), 4);
  EXPECT_EQ(PackOf(*world, "ghost")->GetStored(), 4);
  EXPECT_EQ(PackOf(*world, "beside")->GetStored(), 0);
}

TEST(Charging, UsesOnlyTheGiversOwnBlocksAndIgnoresRelatives) {
  const auto world = LoadText(
      "model( name \"giver\" size [1 1 1] joules -1 give_watts 100 alwayson 1\n"
      "  model( name \"arm\" pose [2 0 0 0] )\n"
      "  model( name \"relative\" pose [0.5 0 0 0] joules_capacity 30 take_watts 40 ) )\n"
      "model( name \"t\" pose [2.2 0 0 0] joules_capacity 30 take_watts 40 )");
  Step(*world, 2);
  EXPECT_EQ(PackOf(*world, "t")->GetStored(), 0);
  EXPECT_EQ(PackOf(*world, "giver.relative")->GetStored(), 0);
}

TEST(Charging, IsOverWhenContactIsLost) {
  const auto world =
      LoadText(std::string(kCharger) +
               "model( name \"t\" pose [0.5 0 0 0] joules_capacity 30 take_watts 40 )");
  PowerPack* pack = PackOf(*world, "t");
  Step(*world);
  EXPECT_TRUE(pack->GetCharging());
  Find(*world, "t")->SetPose(Pose(3, 0, 0, 0));
  Step(*world);
  EXPECT_FALSE(pack->GetCharging());
  EXPECT_EQ(pack->GetStored(), 4);

  Find(*world, "t")->SetPose(Pose(0.5, 0, 0, 0));
  Step(*world);
  EXPECT_TRUE(pack->GetCharging());
  Find(*world, "giver")->Unsubscribe();
  EXPECT_FALSE(pack->GetCharging()) << "a giver that stops releases the receiver";
}

TEST(Charging, ScarceEnergyIsGivenInOrderOfCreation) {
  const char* giver = "model( name \"giver\" size [1 1 1] joules 5 give_watts 40 alwayson 1 )\n";
  const char* first =
      "model( name \"a\" pose [0.5 0 0 0] size [0.1 0.1 1] joules_capacity 9 take_watts 90 )\n";
  const char* second =
      "model( name \"b\" pose [-0.5 0 0 0] size [0.1 0.1 1] joules_capacity 9 take_watts 90 )\n";
  const auto world = LoadText(std::string(giver) + first + second);
  Step(*world);
  EXPECT_EQ(PackOf(*world, "a")->GetStored(), 4);
  EXPECT_EQ(PackOf(*world, "b")->GetStored(), 1);
  EXPECT_EQ(PackOf(*world, "giver")->GetStored(), 0);
}

TEST(Charging, SurvivesTheDeletionOfEitherSide) {
  for (const char* victim : {"t", "giver"}) {
    const auto world =
        LoadText(std::string(kCharger) +
                 "model( name \"t\" pose [0.5 0 0 0] joules_capacity 30 take_watts 40 )");
    Step(*world);
    delete Find(*world, victim);
    Step(*world, 2);
    if (std::string(victim) == "giver") {
      EXPECT_FALSE(PackOf(*world, "t")->GetCharging());
    }
  }
}

// ---- whole worlds -------------------------------------------------------------------------------

TEST(EnergyTotals, AreCreatedAndDeletedWithTheWorld) {
  InitLibrary();
  const double stored = PowerPack::global_stored, capacity = PowerPack::global_capacity;
  const double dissipated = PowerPack::global_dissipated, input = PowerPack::global_input;
  {
    const auto world = LoadText(
        "model( joules 10 watts 10 alwayson 1 ) model( joules_capacity 7 )\n"
        "model( joules -1 watts 20 alwayson 1 )");
    Step(*world, 3);
    EXPECT_NEAR(PowerPack::global_stored - stored, 7, 1e-9);
    EXPECT_NEAR(PowerPack::global_capacity - capacity, 17, 1e-9);
    EXPECT_NEAR(PowerPack::global_dissipated - dissipated, 9, 1e-9);
    EXPECT_NEAR(PowerPack::global_input - input, 6, 1e-9);
    world->UnLoad();
    EXPECT_NEAR(PowerPack::global_stored, stored, 1e-9);
    EXPECT_NEAR(PowerPack::global_capacity, capacity, 1e-9);
    Step(*world, 2);
  }
}

TEST(EnergyTotals, AreInTheStateHash) {
  const auto a = LoadText("model( name \"m\" joules 5 watts 1 alwayson 1 )");
  const auto b = LoadText("model( name \"m\" joules 5 watts 1 alwayson 1 )");
  EXPECT_EQ(a->StateHash(), b->StateHash());
  Find(*b, "m")->FindPowerPack()->Dissipate(1);
  EXPECT_NE(a->StateHash(), b->StateHash());
}

// ---- windows ------------------------------------------------------------------------------------

/// A world that claims to have a window.
class WorldWithWindow : public World {
 public:
  bool IsGUI() const override { return true; }
  void OfferVisualizer(Visualizer* visualizer, bool on) override {
    offered.push_back(visualizer->GetWorldfileName() + (on ? " on" : " off"));
  }
  std::vector<std::string> offered;
};

TEST(EnergyCharts, AreOfferedToWindows) {
  InitLibrary();
  WorldWithWindow world;
  std::istringstream text("model( name \"m\" joules 5 watts 10 alwayson 1 )");
  ASSERT_TRUE(world.Load(text, "t.world"));
  EXPECT_EQ(world.offered, (std::vector<std::string>{"energy_input off", "energy_stored off",
                                                     "energy_dissipation off"}));
  Step(world, 3);
  EXPECT_EQ(PackOf(world, "m")->GetStored(), 2);
}

TEST(StripPlot, KeepsTheLatestValues) {
  StripPlotVis plot(0, 0, 100, 10, 3, Color::red, Color::blue, "plot", "show_plot");
  EXPECT_TRUE(plot.Values().empty());
  for (const float value : {5.0f, 2.0f, 3.0f, 4.0f, 3.5f}) plot.AppendValue(value);
  EXPECT_EQ(plot.Values(), (std::vector<float>{3, 4, 3.5}));
  EXPECT_EQ(plot.Least(), 2);
  EXPECT_EQ(plot.Greatest(), 5);
  EXPECT_EQ(plot.GetMenuName(), "plot");
  EXPECT_EQ(plot.GetWorldfileName(), "show_plot");
  StripPlotVis none(0, 0, 100, 10, 0, Color(), Color(), "", "");
  none.AppendValue(1);
  EXPECT_TRUE(none.Values().empty());
}

}  // namespace
}  // namespace Stg
