// SPDX-License-Identifier: GPL-2.0-or-later
//
// The radio: its range with each propagation model.

#include <cmath>

#include "models/line_in_bodies.hh"
#include "support/crowd.hh"
#include "support/model_testing.hh"

namespace Stg {
namespace {

/// A subscribed radio "a" at the origin, and a radio "b" at (distance, 0).
struct Pair {
  explicit Pair(const std::string& properties, double distance = 10, const std::string& rest = "")
      : world(LoadText("wifi( name \"a\" " + properties + " )\nwifi( name \"b\" pose [" +
                       std::to_string(distance) + " 0 0 0] )\n" + rest)),
        a(FindRunning<ModelWifi>(*world, "a")),
        b(Find<ModelWifi>(*world, "b")) {}
  const std::vector<ModelWifi::Neighbor>& Neighbors(int steps = 1) {
    Step(*world, steps);
    return a->GetNeighbors();
  }
  /// The loss of transmitted power, dB; NaN if there is no link.
  double Loss() {
    const auto& neighbors = Neighbors();
    return neighbors.empty() ? NAN : a->power - neighbors[0].db;
  }
  std::unique_ptr<World> world;
  ModelWifi *a, *b;
};

double LossOf(const std::string& properties, double distance, const std::string& rest = "") {
  return Pair(properties + " power 1000", distance, rest).Loss();
}

std::string Wall(double x, double thickness, const std::string& more = "") {
  return "model( pose [" + std::to_string(x) + " 0 0 0] size [" + std::to_string(thickness) +
         " 2 1] " + more + " )\n";
}

// ---- properties ---------------------------------------------------------------------------------

TEST(Wifi, Defaults) {
  const auto world = LoadText("wifi( name \"a\" )");
  const ModelWifi* wifi = Find<ModelWifi>(*world, "a");
  EXPECT_EQ(wifi->propagation, ModelWifi::PROPAGATION_NONE);
  EXPECT_EQ(wifi->ip, "192.168.0.1");
  EXPECT_EQ(wifi->mac, "00:00:00:00:00");
  EXPECT_EQ(wifi->essid, "any");
  EXPECT_EQ(wifi->power, 45);
  EXPECT_EQ(wifi->sensitivity, -75);
  EXPECT_EQ(wifi->freq, 2450);
  EXPECT_EQ(wifi->range, 0);
  EXPECT_EQ(wifi->plc, 30);
  EXPECT_EQ(wifi->ple, 2.5);
  EXPECT_EQ(wifi->sigma, 5);
  EXPECT_EQ(wifi->wall_factor, 1);
  EXPECT_EQ(wifi->range_db, -50);
  EXPECT_EQ(wifi->GetGeom().size.x, 0);
  EXPECT_FALSE(wifi->vis.obstacle_return);
  EXPECT_FALSE(wifi->vis.blob_return);
  EXPECT_LT(wifi->vis.ranger_return, 0);
}

TEST(Wifi, PropertiesAreRead) {
  const auto world = LoadText(
      "unit_length \"cm\"\nwifi( name \"a\" model \"raytrace\" ip \"10.0.0.7\" mac \"m\" essid "
      "\"e\"\n"
      "  power 1 sensitivity -2 freq 3 range 40 plc 5 ple 6 sigma 7 wall_factor 8 range_db -9 )");
  const ModelWifi* wifi = Find<ModelWifi>(*world, "a");
  EXPECT_EQ(wifi->propagation, ModelWifi::PROPAGATION_RAYTRACE);
  EXPECT_EQ(wifi->ip, "10.0.0.7");
  EXPECT_EQ(wifi->mac, "m");
  EXPECT_EQ(wifi->essid, "e");
  EXPECT_EQ(wifi->power, 1);
  EXPECT_EQ(wifi->sensitivity, -2);
  EXPECT_EQ(wifi->freq, 3);
  EXPECT_DOUBLE_EQ(wifi->range, 0.4);
  EXPECT_EQ(wifi->plc, 5);
  EXPECT_EQ(wifi->ple, 6);
  EXPECT_EQ(wifi->sigma, 7);
  EXPECT_EQ(wifi->wall_factor, 8);
  EXPECT_EQ(wifi->range_db, -9);
}

TEST(Wifi, NamesOfTheModels) {
  const std::pair<const char*, ModelWifi::Propagation> names[] = {
      {"simple", ModelWifi::PROPAGATION_SIMPLE},
      {"friis", ModelWifi::PROPAGATION_FRIIS},
      {"ITU indoor", ModelWifi::PROPAGATION_ITU_INDOOR},
      {"log distance", ModelWifi::PROPAGATION_LOG_DISTANCE},
      {"raytrace", ModelWifi::PROPAGATION_RAYTRACE},
      {"psychic", ModelWifi::PROPAGATION_NONE}};
  for (const auto& [name, value] : names) {
    const auto world = EmptyWorld();
    const LoadOutcome outcome =
        TryToLoad(world.get(), "wifi( name \"a\" model \"" + std::string(name) + "\" )");
    EXPECT_EQ(Find<ModelWifi>(*world, "a")->propagation, value);
    EXPECT_EQ(outcome.errors.find("warning") == std::string::npos,
              value != ModelWifi::PROPAGATION_NONE)
        << outcome.errors;
  }
}

TEST(Wifi, LongNamesAreCut) {
  const auto world = EmptyWorld();
  const LoadOutcome outcome = TryToLoad(
      world.get(), "wifi( name \"a\" essid \"0123456789012345678901234567890123456789\" )");
  EXPECT_EQ(Find<ModelWifi>(*world, "a")->essid, "0123456789012345678901234567890");
  EXPECT_NE(outcome.errors.find("31 characters"), std::string::npos) << outcome.errors;
}

TEST(Wifi, BadPropertiesAreRefused) {
  for (const char* bad : {"freq 0", "freq -1", "range -1", "sigma -1", "power strong"}) {
    const LoadOutcome outcome = TryToLoad("wifi( " + std::string(bad) + " )");
    EXPECT_FALSE(outcome.loaded) << bad;
    EXPECT_EQ(outcome.errors.find("t.world:1:"), 0u) << outcome.errors;
  }
}

// ---- losses -------------------------------------------------------------------------------------

TEST(WifiLoss, Figures) {
  EXPECT_NEAR(LossOf("model \"friis\"", 10), 60.2251, 1e-4);
  EXPECT_NEAR(LossOf("model \"friis\"", 5), 54.2045, 1e-4);
  EXPECT_NEAR(LossOf("model \"ITU indoor\"", 10), 69.7833, 1e-4);
  EXPECT_NEAR(LossOf("model \"ITU indoor\"", 5), 60.7524, 1e-4);
  EXPECT_NEAR(LossOf("model \"log distance\" ple 4 sigma 0", 10), 80.2251, 1e-4);
  EXPECT_NEAR(LossOf("model \"log distance\" ple 4 sigma 0", 5), 68.1839, 1e-4);
  EXPECT_NEAR(LossOf("model \"raytrace\"", 10), 69.7833, 1e-4);
}

TEST(WifiLoss, AgreesWithTheFormulaOverManyDecades) {
  for (const double d : {0.02, 0.3, 1.0, 7.0, 123.0, 54321.0})
    for (const double f : {1e-3, 1.0, 868.0, 5800.0})
      EXPECT_NEAR(LossOf("model \"friis\" freq " + std::to_string(f), d),
                  32.44177 + 20 * std::log10(f) + 20 * std::log10(d / 1000), 1e-9)
          << d << " " << f;
}

TEST(WifiLoss, UsesAtLeastACentimetre) {
  EXPECT_NEAR(LossOf("model \"friis\"", 0), 60.2251 - 60, 1e-4);
  EXPECT_NEAR(LossOf("model \"raytrace\"", 0), 69.7833 - 90, 1e-4);
}

TEST(WifiLoss, ShadowFadingIsNormalAndDrawnAfresh) {
  Pair pair("model \"log distance\" ple 4 power 1000 sigma 3");
  double sum = 0, squares = 0, last = 0;
  const int n = 2000;
  for (int i = 0; i < n; i++) {
    const double error = pair.Loss() - 80.2251;
    EXPECT_NE(error, last);
    last = error;
    sum += error;
    squares += error * error;
  }
  EXPECT_NEAR(sum / n, 0, 0.25);
  EXPECT_NEAR(std::sqrt(squares / n), 3, 0.2);
}

TEST(WifiLoss, ShadowFadingRepeatsAndDependsOnTheSeed) {
  const auto first_loss = [](uint64_t seed) {
    InitLibrary();
    World::run_options.seed = seed;
    const double loss = LossOf("model \"log distance\"", 10);
    World::run_options = RunOptions();
    return loss;
  };
  EXPECT_EQ(first_loss(1), first_loss(1));
  EXPECT_NE(first_loss(1), first_loss(2));
}

// ---- links --------------------------------------------------------------------------------------

TEST(Wifi, SimpleReachesItsRange) {
  Pair pair("model \"simple\" range 10 power -1000");
  const auto& neighbors = pair.Neighbors();
  ASSERT_EQ(neighbors.size(), 1u);
  EXPECT_EQ(neighbors[0].db, 1);
  pair.b->SetPose(Pose(10.01, 0, 0, 0));
  EXPECT_TRUE(pair.Neighbors().empty());
  pair.a->range = 11;
  EXPECT_EQ(pair.Neighbors().size(), 1u);
}

TEST(Wifi, HasNoLinksWithoutModel) {
  Pair pair("range 100 power 1000");
  EXPECT_TRUE(pair.Neighbors().empty());
}

TEST(Wifi, SenderPowerAndReceiverSensitivityDecide) {
  Pair pair("model \"friis\" power 0 sensitivity 0");  // the loss is 60.2
  pair.b->sensitivity = -60.3;
  ASSERT_EQ(pair.Neighbors().size(), 1u);
  EXPECT_NEAR(pair.a->GetNeighbors()[0].db, -60.2251, 1e-4);
  pair.b->sensitivity = -60.1;
  EXPECT_TRUE(pair.Neighbors().empty());
  pair.a->power = 1;
  EXPECT_EQ(pair.Neighbors().size(), 1u);
  // In the opposite direction, the power of the other radio counts.
  pair.b->Subscribe();
  pair.b->propagation = ModelWifi::PROPAGATION_FRIIS;
  pair.b->power = 100;
  Step(*pair.world);
  ASSERT_EQ(pair.b->GetNeighbors().size(), 1u);
  EXPECT_NEAR(pair.b->GetNeighbors()[0].db, 39.7749, 1e-4);
}

TEST(Wifi, NeighborsHaveTheirIdentity) {
  const auto world = LoadText(
      "wifi( name \"a\" model \"friis\" )\n"
      "position( pose [1 2 0 90] size [0.4 0.4 0.2] wifi( pose [0.1 0 0 0] ip \"10.0.0.1\"\n"
      "  mac \"01:02:03:04:05:06\" essid \"their very own network\" freq 868 ) )\n"
      "wifi( name \"c\" pose [0 5 0 0] ip \"10.0.0.2\" )");
  auto* a = FindRunning<ModelWifi>(*world, "a");
  Step(*world);
  ASSERT_EQ(a->GetNeighbors().size(), 2u);
  const ModelWifi::Neighbor& first = a->GetNeighbors()[0];
  ExpectPose(first.pose, 1, 2.1, 0.2, M_PI / 2);
  EXPECT_EQ(first.ip, "10.0.0.1");
  EXPECT_EQ(first.mac, "01:02:03:04:05:06");
  EXPECT_EQ(first.essid, "their very own network");
  EXPECT_EQ(first.freq, 868);
  EXPECT_EQ(a->GetNeighbors()[1].ip, "10.0.0.2");
  // The list shrinks and grows again.
  delete world->GetChildren()[2];
  Step(*world);
  ASSERT_EQ(a->GetNeighbors().size(), 1u);
  EXPECT_EQ(a->GetNeighbors()[0].ip, "10.0.0.2");
}

TEST(Wifi, RadiosOfTheSameTreeAreNotNeighbors) {
  const auto world = LoadText(
      "position( name \"r\" wifi( name \"a\" model \"friis\" ) wifi( name \"b\" pose [1 0 0 0] ) "
      ")");
  auto* a = FindRunning<ModelWifi>(*world, "r.a");
  Step(*world);
  EXPECT_TRUE(a->GetNeighbors().empty());
  Find(*world, "r.b")->SetParent(nullptr);
  Step(*world);
  EXPECT_EQ(a->GetNeighbors().size(), 1u);
}

TEST(Wifi, OnlyWhileSubscribed) {
  Pair pair("model \"friis\"");
  EXPECT_EQ(pair.Neighbors().size(), 1u);
  pair.a->Unsubscribe();
  EXPECT_TRUE(pair.a->GetNeighbors().empty());
  EXPECT_TRUE(pair.Neighbors(3).empty());
  pair.a->Subscribe();
  EXPECT_EQ(pair.Neighbors().size(), 1u);
}

TEST(Wifi, DrawsPowerWhileSubscribed) {
  Pair pair("model \"friis\" joules 5");
  Step(*pair.world, 3);
  EXPECT_NEAR(pair.a->FindPowerPack()->GetDissipated(), 0.75, 1e-9);
}

TEST(Wifi, AFrequencyThatIsNotPositiveMakesNoLinks) {
  Pair pair("model \"friis\" power 1000");
  pair.a->freq = -1;
  EXPECT_TRUE(pair.Neighbors().empty());
}

// ---- obstacles ----------------------------------------------------------------------------------

TEST(WifiWalls, FigureOfTheWall) {
  EXPECT_NEAR(LossOf("model \"raytrace\" wall_factor 10", 10, Wall(5, 0.1)), 169.7833, 1e-4);
  EXPECT_NEAR(LossOf("model \"ITU indoor\" wall_factor 10", 10, Wall(5, 0.1)), 69.7833, 1e-4);
}

TEST(WifiWalls, AddUp) {
  const std::string walls = Wall(2, 0.1) + Wall(5, 0.3) + Wall(7, 0.5) + Wall(13, 1);
  EXPECT_NEAR(LossOf("model \"raytrace\"", 10, walls), 69.7833 + 90, 1e-4);
}

TEST(WifiWalls, OverlappingWallsCountOnce) {
  const std::string walls = Wall(2, 1) + Wall(2.25, 1) + Wall(2.1, 0.2);
  EXPECT_NEAR(LossOf("model \"raytrace\"", 10, walls), 69.7833 + 125, 1e-4);
}

TEST(WifiWalls, MayBreakTheLink) {
  Pair pair("model \"raytrace\" power 0", 10, Wall(5, 0.1));
  pair.b->sensitivity = -79.8;
  EXPECT_EQ(pair.Neighbors().size(), 1u);
  pair.b->sensitivity = -79.7;
  EXPECT_TRUE(pair.Neighbors().empty());
}

TEST(WifiWalls, OnlyBodiesVisibleToRangers) {
  EXPECT_NEAR(LossOf("model \"raytrace\"", 10, Wall(5, 1, "ranger_return -1")), 69.7833, 1e-4);
  EXPECT_NEAR(LossOf("model \"raytrace\"", 10, Wall(5, 1, "obstacle_return 0")), 169.7833, 1e-4);
  EXPECT_NEAR(LossOf("model \"raytrace\"", 10, Wall(5, 1, "ranger_return 0")), 169.7833, 1e-4);
}

TEST(WifiWalls, NotTheRobotsOwnBodies) {
  const auto world = LoadText(
      "define bot position( size [1 1 1] wifi( pose [0 0 -0.5 0] model \"raytrace\" power 1000 ) "
      ")\n"
      "bot( name \"a\" )\nbot( pose [10 0 0 0] )\nbot( pose [5 0 0 30] )");
  auto* wifi = dynamic_cast<ModelWifi*>(Find(*world, "a")->GetChildren()[0]);
  wifi->Subscribe();
  Step(*world);
  ASSERT_EQ(wifi->GetNeighbors().size(), 2u);
  EXPECT_NEAR(1000 - wifi->GetNeighbors()[0].db, 69.7833 + 100 / std::cos(M_PI / 6), 1e-4);
}

TEST(WifiWalls, HeightsCount) {
  const std::string low = "model( pose [5 0 0 0] size [0.5 2 0.2] )\n";
  const auto loss = [&](const std::string& z_a, const std::string& z_b) {
    const auto world =
        LoadText("wifi( name \"a\" pose [0 0 " + z_a +
                 " 0] model \"raytrace\" power 1000 )\nwifi( pose [10 0 " + z_b + " 0] )\n" + low);
    auto* a = FindRunning<ModelWifi>(*world, "a");
    Step(*world);
    return 1000 - a->GetNeighbors().at(0).db - 69.7833;
  };
  EXPECT_NEAR(loss("0.1", "0.1"), 50, 1e-4);
  EXPECT_NEAR(loss("0.3", "0.3"), 0, 1e-4);
  EXPECT_NEAR(loss("0.2", "0.2"), 50, 1e-4);  // ends included, as with rangers
  EXPECT_NEAR(loss("0", "0.4"), 25, 1e-4);    // half of the path is above the wall
  EXPECT_NEAR(loss("1", "0"), 0, 1e-4);
}

TEST(WifiWalls, AlongAnyDirection) {
  for (int degrees = 0; degrees < 360; degrees += 15) {
    const double a = dtor(degrees);
    const auto world =
        LoadText("wifi( name \"a\" pose [3 -4 0 77] model \"raytrace\" power 1000 )\nwifi( pose [" +
                 std::to_string(3 + 10 * std::cos(a)) + " " +
                 std::to_string(-4 + 10 * std::sin(a)) + " 0 0] )\nmodel( pose [" +
                 std::to_string(3 + 5 * std::cos(a)) + " " + std::to_string(-4 + 5 * std::sin(a)) +
                 " 0 " + std::to_string(degrees) + "] size [0.25 1 1] )");
    auto* wifi = FindRunning<ModelWifi>(*world, "a");
    Step(*world);
    EXPECT_NEAR(1000 - wifi->GetNeighbors().at(0).db, 69.7833 + 25, 1e-3) << degrees;
  }
}

// ---- lines in bodies ----------------------------------------------------------------------------

double FractionInside(const std::string& body, const point3_t& from, const point3_t& to) {
  const auto world = LoadText(body);
  LineInBodies line;
  line.Begin(from, to);
  line.AddBodyOf(*world->GetChildren().back());
  return line.FractionInside();
}

TEST(LineInBodies, Rectangles) {
  const std::string box = "model( pose [1 2 0 90] size [2 4 1] origin [0 1 0 0] )";
  // The box extends from -2 to 2 in x and from 1 to 3 in y.
  EXPECT_NEAR(FractionInside(box, point3_t(-4, 2, 0.5), point3_t(4, 2, 0.5)), 0.5, 1e-12);
  EXPECT_NEAR(FractionInside(box, point3_t(0, 2, 0.5), point3_t(8, 2, 0.5)), 0.25, 1e-12);
  EXPECT_NEAR(FractionInside(box, point3_t(-1, 1.5, 0.5), point3_t(1, 2.5, 0.5)), 1, 1e-12);
  EXPECT_NEAR(FractionInside(box, point3_t(-4, 4, 0.5), point3_t(4, 4, 0.5)), 0, 1e-12);
  EXPECT_NEAR(FractionInside(box, point3_t(-4, 2, 1.5), point3_t(4, 2, 1.5)), 0, 1e-12);
  EXPECT_NEAR(FractionInside(box, point3_t(0, 2, -1), point3_t(1, 2, 3)), 0.25, 1e-12);
  EXPECT_EQ(FractionInside(box, point3_t(0, 2, 0), point3_t(0, 2, 1)),
            0);  // no length in the plane
}

TEST(LineInBodies, ReportsTheFirstEntry) {
  const auto world =
      LoadText("model( pose [3 0 0 0] size [2 2 1] ) model( pose [7 0 0 0] size [2 2 1] )");
  LineInBodies line;
  line.Begin(point3_t(0, 0, 0.5), point3_t(10, 0, 0.5));
  EXPECT_EQ(line.FirstInside(), 1);
  for (auto model = world->GetChildren().rbegin(); model != world->GetChildren().rend(); ++model)
    line.AddBodyOf(**model);
  EXPECT_NEAR(line.FirstInside(), 0.2, 1e-12);
  EXPECT_NEAR(line.FractionInside(), 0.4, 1e-12);
  EXPECT_NEAR(line.FirstInside(), 0.2, 1e-12);
}

TEST(LineInBodies, ThroughCorners) {
  const std::string box = "model( size [2 2 1] )";
  EXPECT_NEAR(FractionInside(box, point3_t(-2, -2, 0.5), point3_t(2, 2, 0.5)), 0.5, 1e-12);
  EXPECT_NEAR(FractionInside(box, point3_t(-2, 0, 0.5), point3_t(0, 2, 0.5)), 0, 1e-12);
}

TEST(LineInBodies, HollowShapes) {
  // The body is a U, open at the top, with walls from x = -2 to -1 and from 1 to 2.
  const std::string u =
      "model( size [4 3 1] block( points 8 point[0] [0 0] point[1] [4 0] point[2] [4 3]\n"
      "  point[3] [3 3] point[4] [3 1] point[5] [1 1] point[6] [1 3] point[7] [0 3] z [0 1] ) )";
  EXPECT_NEAR(FractionInside(u, point3_t(-4, 0.5, 0.5), point3_t(4, 0.5, 0.5)), 0.25, 1e-12);
  EXPECT_NEAR(FractionInside(u, point3_t(-4, -1, 0.5), point3_t(4, -1, 0.5)), 0.5, 1e-12);
  EXPECT_NEAR(FractionInside(u, point3_t(0, 0.5, 0.5), point3_t(4, 0.5, 0.5)), 0.25, 1e-12);
}

TEST(LineInBodies, BlocksOfOneBodyThatOverlapCountOnce) {
  const std::string cross =
      "model( size [4 4 2]\n"
      "  block( points 4 point[0] [0 1] point[1] [4 1] point[2] [4 3] point[3] [0 3] z [0 1] )\n"
      "  block( points 4 point[0] [1 0] point[1] [3 0] point[2] [3 4] point[3] [1 4] z [0 2] ) )";
  EXPECT_NEAR(FractionInside(cross, point3_t(-4, 0, 0.5), point3_t(4, 0, 0.5)), 0.5, 1e-12);
  EXPECT_NEAR(FractionInside(cross, point3_t(-4, 0, 1.5), point3_t(4, 0, 1.5)), 0.25, 1e-12);
}

// ---- equal results with any options -------------------------------------------------------------

int Delete(Model*, void* victim) {
  delete static_cast<Model*>(victim);
  return 1;
}

TEST(Wifi, RadiosCanBeDeletedWithPendingRays) {
  Pair pair("model \"raytrace\"", 10, Wall(5, 0.1));
  pair.world->Enqueue(0, 100000, pair.world->GetGround(), Delete, pair.b);
  Step(*pair.world, 2);
  EXPECT_TRUE(pair.a->GetNeighbors().empty());
  pair.world->Enqueue(0, 100000, pair.world->GetGround(), Delete, pair.a);
  Step(*pair.world, 2);
  EXPECT_EQ(pair.world->GetAllModels().size(), 2u);
}

TEST(Wifi, ResultsDoNotDependOnTheMethod) {
  const auto bot_and_wall = [](int i) {
    const int column = i % 7, row = i / 7;
    const std::string x = std::to_string(column * 1.3), y = std::to_string(row * 1.1);
    return "bot( pose [" + x + " " + y + " 0 " + std::to_string(i * 37) + "] )\nwall( pose [" + x +
           "5 " + y + " 0 " + std::to_string(i * 31) + "] )\n";
  };
  const auto look = [](const crowd::Robots& robots, std::vector<double>* links) {
    for (const ModelPosition* robot : robots)
      for (const auto& link : dynamic_cast<ModelWifi*>(robot->GetChildren()[0])->GetNeighbors())
        links->push_back(link.db);
  };
  const crowd::Outcome outcome = crowd::ExpectSameHoweverItIsRun(
      {"define bot position( size [0.3 0.3 0.3] alwayson 1 wifi( pose [0 0 -0.1 0] power 20\n"
       "  model \"raytrace\" alwayson 1 ) wifi( model \"log distance\" power 0 alwayson 1 ) )\n"
       "define wall model( size [0.1 1 1] )\n" +
           crowd::Repeat(40, bot_and_wall),
       10, 0.2, [](size_t) { return 0.3; }, look});
  EXPECT_GT(outcome.sensed.size(), 10 * 100u);
  EXPECT_LT(outcome.sensed.size(), 10 * 40 * 78u);  // walls break some
}

}  // namespace
}  // namespace Stg
