// SPDX-License-Identifier: GPL-2.0-or-later
//
// Light sensors: inverse square, directional response, shadows, noise and limits of readings.

#include <cmath>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "support/model_testing.hh"
#include "support/random_source.hh"

namespace Stg {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// A world with a subscribed light sensor "s" at the origin.
struct Scene {
  explicit Scene(const std::string& rest, const std::string& properties = "")
      : world(LoadText("lightsensor( name \"s\" " + properties + " )\n" + rest)),
        sensor(FindRunning<ModelLightSensor>(*world, "s")) {}
  const std::vector<double>& Read() {
    Step(*world);
    return sensor->GetIntensities();
  }
  double ReadOne() { return Read().at(0); }
  std::unique_ptr<World> world;
  ModelLightSensor* sensor;
};

std::string LightAt(double x, double y, const std::string& more = "") {
  return "light( pose [" + std::to_string(x) + " " + std::to_string(y) + " 0 0] " + more + " )\n";
}

TEST(LightSensor, HasNoReadingsWithoutSubscribers) {
  const auto world = LoadText("lightsensor( name \"s\" ) light( )");
  auto* sensor = Find<ModelLightSensor>(*world, "s");
  Step(*world);
  EXPECT_TRUE(sensor->GetIntensities().empty());
  sensor->Subscribe();
  Step(*world);
  EXPECT_EQ(sensor->GetIntensities().size(), 1u);
  EXPECT_EQ(sensor->GetColors().size(), 3u);
  sensor->Unsubscribe();
  EXPECT_TRUE(sensor->GetIntensities().empty());
  EXPECT_TRUE(sensor->GetColors().empty());
}

TEST(LightSensor, SensesTheInverseSquareOfTheDistance) {
  for (const double distance : {0.5, 1.0, 2.0, 5.0})
    EXPECT_NEAR(Scene(LightAt(distance, 0, "intensity 3")).ReadOne(), 3 / (distance * distance),
                1e-12);
  EXPECT_NEAR(Scene(LightAt(1, 0) + LightAt(2, 0, "intensity 8")).ReadOne(), 3, 1e-12);
}

// The closed form, for random poses of the robot, of the sensor on it, and of the light.
TEST(LightSensor, HasTheClosedFormInRotatedFrames) {
  test::RandomSource random(1);
  for (int i = 0; i < 200; i++) {
    const int power = random.Int(0, 4);
    const double fov = random.Real(20, 400), axis = random.Real(-180, 180);
    const Pose robot(random.Real(-3, 3), random.Real(-3, 3), 0, random.Real(-M_PI, M_PI));
    const Pose mount(random.Real(-0.2, 0.2), random.Real(-0.2, 0.2), 0, random.Real(-M_PI, M_PI));
    const Pose lamp(random.Real(-3, 3), random.Real(-3, 3), 0, 0);
    const auto world =
        LoadText("position( name \"r\" lightsensor( name \"s\" alwayson 1 fov " +
                 std::to_string(fov) + " cosine_power " + std::to_string(power) + " directions [" +
                 std::to_string(axis) + "] ) ) light( name \"l\" intensity 2 )");
    auto* sensor = Find<ModelLightSensor>(*world, "r.s");
    Find(*world, "r")->SetPose(robot);
    sensor->SetPose(mount);
    Find(*world, "l")->SetPose(lamp);
    Step(*world);

    const double x = robot.x + mount.x * std::cos(robot.a) - mount.y * std::sin(robot.a);
    const double y = robot.y + mount.x * std::sin(robot.a) + mount.y * std::cos(robot.a);
    const double distance = std::hypot(lamp.x - x, lamp.y - y);
    const double angle = std::remainder(
        std::atan2(lamp.y - y, lamp.x - x) - robot.a - mount.a - sensor->directions[0], 2 * M_PI);
    double expected = 2 / (distance * distance);
    if (power > 0) expected *= std::pow(std::max(0.0, std::cos(angle)), power);
    if (std::fabs(angle) > sensor->fov / 2) expected = 0;
    EXPECT_NEAR(sensor->GetIntensities()[0], expected, 1e-9 * (1 + expected)) << i;
  }
}

TEST(LightSensor, HasElementsInSeveralDirections) {
  Scene scene(LightAt(1, 0), "directions [0 60 -60 180] fov 360");
  const std::vector<double> readings = scene.Read();
  ASSERT_EQ(readings.size(), 4u);
  EXPECT_NEAR(readings[0], 1, 1e-12);
  EXPECT_NEAR(readings[1], 0.5, 1e-12);
  EXPECT_NEAR(readings[2], 0.5, 1e-12);
  EXPECT_EQ(readings[3], 0);
}

TEST(LightSensor, IsUniformWithPower0) {
  for (int degrees = -180; degrees <= 180; degrees += 15) {
    Scene scene(LightAt(2, 0, "intensity 4"),
                "cosine_power 0 directions [" + std::to_string(degrees) + "]");
    EXPECT_NEAR(scene.ReadOne(), 1, 1e-12) << degrees;
  }
  EXPECT_NEAR(Scene(LightAt(1, 1), "cosine_power 0 fov 91").ReadOne(), 0.5, 1e-12);
  EXPECT_EQ(Scene(LightAt(1, 1), "cosine_power 0 fov 89").ReadOne(), 0);
}

TEST(LightSensor, SeparatesColours) {
  Scene scene(LightAt(1, 0, "color_rgba [1 0.5 0 1]") + LightAt(0.5, 0, "color \"blue\""));
  scene.Read();
  const std::vector<double>& colors = scene.sensor->GetColors();
  EXPECT_NEAR(scene.sensor->GetIntensities()[0], 5, 1e-12);
  EXPECT_NEAR(colors[0], 1, 1e-12);
  EXPECT_NEAR(colors[1], 0.5, 1e-12);
  EXPECT_NEAR(colors[2], 4, 1e-12);
}

// ---- switching ----------------------------------------------------------------------------------

TEST(LightSensor, SensesLightsThatAreOn) {
  Scene scene(LightAt(1, 0, "name \"l\" on 0"));
  auto* light = Find<ModelLight>(*scene.world, "l");
  EXPECT_EQ(scene.ReadOne(), 0);
  light->SetOn(true);
  EXPECT_EQ(scene.ReadOne(), 1);
  light->SetIntensity(2);
  EXPECT_EQ(scene.ReadOne(), 2);
  light->SetColor(Color("blue"));
  scene.Read();
  EXPECT_EQ(scene.sensor->GetColors(), (std::vector<double>{0, 0, 2}));
  light->SetOn(false);
  EXPECT_EQ(scene.ReadOne(), 0);
  const std::string refused = ErrorsOf([&] { light->SetIntensity(-1); });
  EXPECT_NE(refused.find("refused the intensity"), std::string::npos) << refused;
  EXPECT_EQ(light->GetIntensity(), 2);
}

TEST(LightSensor, SensesBlinkenlightsAndIndicatorsWithAnIntensity) {
  Scene scene("blinkenlight( pose [1 0 0 0] period 400 intensity 2 )\n");
  std::string pattern;
  for (int i = 0; i < 8; i++) pattern += scene.ReadOne() == 2 ? '#' : '.';
  EXPECT_EQ(pattern, "#..##..#");  // the first step is at 100 ms
  EXPECT_EQ(Scene("blinkenlight( pose [1 0 0 0] dutycycle 1e9 )\n").ReadOne(), 0);

  Scene other("lightindicator( name \"l\" pose [1 0 0 0] intensity 3 )\n");
  EXPECT_EQ(other.ReadOne(), 0);
  Find<ModelLightIndicator>(*other.world, "l")->SetState(true);
  EXPECT_EQ(other.ReadOne(), 3);
}

TEST(LightSensor, ForgetsDeletedLights) {
  Scene scene(LightAt(1, 0, "name \"l\"") + LightAt(2, 0, "intensity 4"));
  EXPECT_EQ(scene.ReadOne(), 2);
  delete Find(*scene.world, "l");
  EXPECT_EQ(scene.ReadOne(), 1);
  auto* made = static_cast<ModelLight*>(scene.world->CreateModel(nullptr, "light"));
  made->SetPose(Pose(0, 0.5, 0, 0));
  made->SetIntensity(10);
  scene.sensor->directions = {M_PI / 2};
  EXPECT_NEAR(scene.ReadOne(), 40, 1e-9);
  EXPECT_EQ(scene.world->Validate(), "");
}

TEST(LightSensor, DoesNotSenseTheLightsOfItsRobot) {
  const auto world = LoadText(
      "position( name \"a\" light( pose [0.2 0 0 0] ) lightsensor( name \"s\" alwayson 1 ) )\n"
      "position( pose [2 0 0 0] light( ) )");
  Step(*world);
  EXPECT_NEAR(Find<ModelLightSensor>(*world, "a.s")->GetIntensities()[0], 0.25, 1e-12);
}

// ---- limits -------------------------------------------------------------------------------------

TEST(LightSensor, IsLimited) {
  EXPECT_EQ(Scene(LightAt(3, 0, "intensity 9"), "range 3").ReadOne(), 1);
  EXPECT_EQ(Scene(LightAt(3, 0, "intensity 9"), "range 2.999").ReadOne(), 0);
  EXPECT_EQ(Scene(LightAt(0.5, 0), "saturation 3").ReadOne(), 3);
  EXPECT_EQ(Scene(LightAt(0.1, 0), "least_distance 0.5").ReadOne(), 4);
  EXPECT_EQ(Scene(LightAt(0, 0), "least_distance 0.5").ReadOne(), 4);
  EXPECT_EQ(Scene(LightAt(0, 0), "least_distance 0.5 directions [60]").ReadOne() < 2.0001, true);
  EXPECT_EQ(Scene(LightAt(1, 0), "ambient 0.25").ReadOne(), 1.25);
  EXPECT_EQ(Scene("", "ambient 0.25").ReadOne(), 0.25);
}

TEST(LightSensor, StandsNonsense) {
  for (const double bad : {kNaN, kInfinity, -kInfinity, -1.0}) {
    Scene scene(LightAt(1, 0) + LightAt(0, 0));
    ModelLightSensor& s = *scene.sensor;
    for (double* setting : {&s.range, &s.fov, &s.least_distance, &s.ambient, &s.noise,
                            &s.relative_noise, &s.saturation, &s.directions[0]}) {
      const double before = *setting;
      *setting = bad;
      const double reading = scene.ReadOne();
      EXPECT_TRUE(std::isfinite(reading) && reading >= 0) << reading << ' ' << bad;
      *setting = before;
    }
    s.cosine_power = -5;
    EXPECT_GE(scene.ReadOne(), 1);
    s.directions.clear();
    EXPECT_TRUE(scene.Read().empty());
  }
}

// ---- shadows ------------------------------------------------------------------------------------

bool StopsAll(Model* candidate, const Model* finder, const void*) {
  return !candidate->IsRelated(finder) && candidate->vis.ranger_return >= 0;
}

// Lights have no bodies that rangers see, so nothing but the posts makes shadows.
TEST(LightSensor, IsInTheShadowsThatRaytraceFinds) {
  for (const char* model : {"cell", "exact"}) {
    test::RandomSource random(7);
    std::string text = std::string("ray_model \"") + model + "\"\n";
    for (int i = 0; i < 12; i++)
      text += "model( size [0.3 0.3 " + std::string(i % 3 ? "1" : "0.005") + "] pose [" +
              std::to_string(random.Real(-3, 3)) + " " + std::to_string(random.Real(-3, 3)) +
              " 0 20] )\n";
    Scene scene(text + "light( name \"l\" )\n", "cosine_power 0");
    Model* const light = Find(*scene.world, "l");
    int lit = 0;
    for (int i = 0; i < 500; i++) {
      const Pose lamp(random.Real(-4, 4), random.Real(-4, 4), 0, 0);
      light->SetPose(lamp);
      const double reading = scene.ReadOne();
      const Pose eye(0, 0, 0.01, std::atan2(lamp.y, lamp.x));
      const RaytraceResult ray = scene.world->Raytrace(eye, std::hypot(lamp.x, lamp.y), StopsAll,
                                                       scene.sensor, nullptr, true);
      EXPECT_EQ(reading > 0, ray.mod == nullptr) << model << ' ' << i;
      lit += reading > 0;
    }
    EXPECT_GT(lit, 100);
    EXPECT_LT(lit, 450);
  }
}

TEST(LightSensor, CastsNoShadowsIfToldSo) {
  const std::string wall = "model( pose [1 0 0 0] size [0.1 1 1] )\n";
  EXPECT_EQ(Scene(LightAt(2, 0) + wall).ReadOne(), 0);
  EXPECT_EQ(Scene(LightAt(2, 0) + wall, "shadows 0").ReadOne(), 0.25);
  const std::string glass = "model( pose [1 0 0 0] size [0.1 1 1] ranger_return -1 )\n";
  EXPECT_EQ(Scene(LightAt(2, 0) + glass).ReadOne(), 0.25);
  const std::string low = "model( pose [1 0 0 0] size [0.1 1 0.005] )\n";
  EXPECT_EQ(Scene(LightAt(2, 0) + low).ReadOne(), 0.25);
}

// The robots that carry the sensor and the light do not block it, but a third one does.
TEST(LightSensor, SeesPastTheRobotsAtBothEnds) {
  const auto read = [](const std::string& third) {
    const auto world = LoadText(
        "position( name \"a\" size [0.4 0.4 0.4] lightsensor( name \"s\" pose [-0.1 0 -0.3 0] "
        "alwayson 1 ) )\n"
        "position( size [0.4 0.4 0.4] pose [2 0 0 0] light( pose [-0.1 0 -0.3 0] ) )\n" +
        third);
    Step(*world);
    return Find<ModelLightSensor>(*world, "a.s")->GetIntensities()[0];
  };
  EXPECT_NEAR(read(""), 0.25, 1e-12);
  EXPECT_EQ(read("position( size [0.4 0.4 0.4] pose [1 0 0 0] )"), 0);
}

// ---- noise --------------------------------------------------------------------------------------

struct Moments {
  double mean, deviation;
};

Moments MomentsOf(Scene* scene, int count) {
  double sum = 0, squares = 0;
  for (int i = 0; i < count; i++) {
    const double reading = scene->ReadOne();
    sum += reading;
    squares += reading * reading;
  }
  const double mean = sum / count;
  return {mean, std::sqrt(squares / count - mean * mean)};
}

TEST(LightSensor, HasTheMomentsOfItsNoise) {
  constexpr int kCount = 4000;
  for (const auto& [properties, deviation] :
       {std::pair("noise [0.1 0]", 0.1), std::pair("noise [0 0.05]", 0.2),
        std::pair("noise [0.3 0.1]", 0.5)}) {
    Scene scene(LightAt(0.5, 0), properties);
    const Moments found = MomentsOf(&scene, kCount);
    const double error = 5 * deviation / std::sqrt(kCount);  // five standard errors
    EXPECT_NEAR(found.mean, 4, error) << properties;
    EXPECT_NEAR(found.deviation, deviation, error) << properties;
  }
}

TEST(LightSensor, DrawsNoiseFromItsOwnStream) {
  const auto run = [](const std::string& more) {
    Scene scene(LightAt(1, 0) + more, "noise [0.1 0] cosine_power 0 shadows 0 range 1.5");
    std::vector<double> readings;
    for (int i = 0; i < 5; i++) readings.push_back(scene.ReadOne());
    return readings;
  };
  const std::vector<double> alone = run("");
  EXPECT_EQ(run("lightsensor( name \"t\" alwayson 1 noise [0.1 0.1] )\n"), alone);
  Scene scene(LightAt(1, 0), "noise [0.1 0] cosine_power 0 shadows 0 range 1.5");
  scene.world->Reseed(99);
  EXPECT_NE(scene.ReadOne(), alone[0]);
}

// ---- the file -----------------------------------------------------------------------------------

TEST(LightSensor, BadPropertiesAreRefused) {
  for (const char* bad :
       {"range -1", "fov -1", "least_distance 0", "least_distance -1", "ambient -1", "noise [-1 0]",
        "noise [0 -1]", "noise 1", "saturation -1", "cosine_power -1", "cosine_power 101"}) {
    const LoadOutcome outcome = TryToLoad("lightsensor( " + std::string(bad) + " )");
    EXPECT_FALSE(outcome.loaded) << bad;
    EXPECT_EQ(outcome.errors.find("t.world:1:"), 0u) << bad << ": " << outcome.errors;
    EXPECT_EQ(outcome.errors.find('\n'), outcome.errors.size() - 1) << outcome.errors;
  }
  for (const char* type : {"light", "blinkenlight", "lightindicator"}) {
    const LoadOutcome outcome = TryToLoad(std::string(type) + "( intensity -1 )");
    EXPECT_FALSE(outcome.loaded) << type;
    EXPECT_EQ(outcome.errors.find("t.world:1:"), 0u) << outcome.errors;
  }
}

TEST(Light, Defaults) {
  const auto world = LoadText("light( name \"l\" )");
  const auto* light = Find<ModelLight>(*world, "l");
  EXPECT_TRUE(light->IsOn());
  EXPECT_EQ(light->GetIntensity(), 1);
  EXPECT_EQ(light->GetColor(), Color("yellow"));
  EXPECT_FALSE(light->vis.obstacle_return);
  EXPECT_EQ(light->vis.ranger_return, -1);
  EXPECT_EQ(light->GetGeom().size.x, 0.05);
}

}  // namespace
}  // namespace Stg
