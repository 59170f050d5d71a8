// SPDX-License-Identifier: GPL-2.0-or-later
//
// Model types: the properties of the built-in types, and types from plug-ins, such as that of
// examples/model.

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <thread>

#include "examples/model/sonar_ring.hh"
#include "models/model_type_names.hh"
#include "support/model_testing.hh"

namespace Stg {
namespace {

const std::vector<double>& RangesOf(World& world, const std::string& name) {
  Model* const model = world.GetModel(name);
  EXPECT_EQ(model->GetModelType(), "sonar_ring");
  return static_cast<SonarRing*>(model)->ranges();
}

/// Driving robots, each with a sonar ring and a ranger, so that parallel and serial updates
/// alternate.
std::string CrowdText(int robots) {
  std::string text = "plugins \"sonar_ring\"\n";
  for (int i = 0; i < robots; i++)
    text += "position( name \"r" + std::to_string(i) + "\" pose [" + std::to_string(i % 8) + ' ' +
            std::to_string(i / 8) + " 0 " + std::to_string(37 * i) +
            "] size [0.3 0.3 0.3] velocity [0.4 0 0 20] alwayson 1\n"
            "  sonar_ring( alwayson 1 count 6 reach 3 )\n"
            "  ranger( alwayson 1 sensor( samples 8 range [0 3] fov 360 ) ) )\n";
  return text;
}

uint64_t HashOfCrowd(const RunOptions& options) {
  InitLibrary();
  World world(options);
  std::istringstream content(CrowdText(40));
  EXPECT_TRUE(world.Load(content, "t.world"));
  Step(world, 20);
  return world.StateHash();
}

// ---- built-in types -----------------------------------------------------------------------------

TEST(ModelTypes, BuiltInTypesAreRegistered) {
  const auto world = EmptyWorld();
  for (const std::string type :
       {"actuator", "blinkenlight", "blobfinder", "bumper", "camera", "fiducial", "field",
        "gripper", "groundsensor", "light", "lightindicator", "lightsensor", "model", "position",
        "ranger", "wifi"}) {
    const Model* const model = world->CreateModel(nullptr, type);
    ASSERT_NE(model, nullptr) << type;
    const ModelType* const known = FindModelType(*model);
    ASSERT_NE(known, nullptr) << type;
    EXPECT_EQ(known->name, type);
    EXPECT_GE(known->size, sizeof(Model));
    EXPECT_EQ(FindCreator(type), known->create);
  }
}

class Derived : public ModelBlobfinder {
 public:
  using ModelBlobfinder::ModelBlobfinder;
};

TEST(ModelTypes, OfDerivedClassesAreThoseOfTheirBase) {
  const auto world = EmptyWorld();
  const Derived derived(world.get(), nullptr, "derived");
  EXPECT_EQ(FindModelType(derived), nullptr);  // unknown: its updates may do anything
  ASSERT_NE(FindNearestModelType(derived), nullptr);
  EXPECT_EQ(FindNearestModelType(derived)->name, "blobfinder");
}

// ---- types of plug-ins --------------------------------------------------------------------------

TEST(ModelTypes, ComeWithThePluginsOfAWorld) {
  const char* const source = std::getenv("STAGE_SOURCE_DIR");
  ASSERT_NE(source, nullptr);
  const auto world = EmptyWorld();
  ASSERT_TRUE(world->Load(std::string(source) + "/examples/model/sonar.world"));
  Step(*world, 3);
  const std::vector<double> ranges = RangesOf(*world, "robot.ring");
  ASSERT_EQ(ranges.size(), 12u);
  constexpr double kCell = 0.02;
  EXPECT_NEAR(ranges[0], 2.95, 2 * kCell);
  EXPECT_NEAR(ranges[6], 2.95, 2 * kCell);
  // The wall is at the side; the edges of the cones see nothing nearer.
  EXPECT_NEAR(ranges[3], 1.95, 2 * kCell);
  EXPECT_NEAR(ranges[9], 1.95, 2 * kCell);
}

TEST(ModelTypes, OfPluginsShareAWorldWithOthersOnAnyNumberOfThreads) {
  RunOptions options;
  options.threads = 1;
  const uint64_t alone = HashOfCrowd(options);
  for (const int threads : {2, 4}) {
    options.threads = threads;
    options.share_from = 1;
    EXPECT_EQ(HashOfCrowd(options), alone) << threads << " threads";
  }
  options.batch = false;
  EXPECT_EQ(HashOfCrowd(options), alone) << "ray by ray";
}

TEST(ModelTypes, PluginTypesAreExplainedAndMeasured) {
  const auto world = LoadText(CrowdText(3));
  Step(*world, 2);
  const uint64_t hash = world->StateHash();
  const SceneSummary summary = Summarize(*world);
  const auto ring = std::find_if(summary.sensors.begin(), summary.sensors.end(),
                                 [](const SensorKind& kind) { return kind.type == "sonar_ring"; });
  ASSERT_NE(ring, summary.sensors.end());
  EXPECT_EQ(ring->models, 3u);
  EXPECT_EQ(ring->parts, 6u);
  EXPECT_EQ(ring->rays, 18u);
  const StepCosts costs = MeasureStepCosts(*world, 0.02);
  EXPECT_EQ(costs.sensors.size(), 2u);
  EXPECT_EQ(world->StateHash(), hash);
}

TEST(ModelTypes, FailToLoadInOneLine) {
  const LoadOutcome missing = TryToLoad("plugins \"nowhere\"\nmodel( )\n");
  EXPECT_FALSE(missing.loaded);
  EXPECT_EQ(missing.status, 255);
  EXPECT_EQ(missing.errors.find("t.world:1:9: plug-in \"nowhere\" can't be loaded: there is no"),
            0u)
      << missing.errors;
  EXPECT_EQ(std::count(missing.errors.begin(), missing.errors.end(), '\n'), 1);

  InitLibrary();
  RunOptions options;
  options.controllers = false;
  World world(options);
  const LoadOutcome careful = TryToLoad(&world, "plugins \"nowhere\"\nelsewhere( )\n");
  EXPECT_FALSE(careful.loaded);
  EXPECT_NE(careful.errors.find("the world's plug-ins are ignored"), std::string::npos)
      << careful.errors;
}

TEST(ModelTypes, KeepTheirNames) {
  InitLibrary();
  const creator_t ranger = FindCreator("ranger");
  EXPECT_NE(ErrorsOf([] {
              EXPECT_FALSE(RegisterModelType(ModelTypeOf<Derived>("ranger")));
            }).find("\"ranger\" is registered already"),
            std::string::npos);
  EXPECT_EQ(FindCreator("ranger"), ranger);
}

TEST(ModelTypes, AreRegisteredWhileWorldsLoad) {
  InitLibrary();
  std::atomic<bool> done{false};
  std::thread registrar([&] {
    for (int i = 0; i < 200; i++)
      EXPECT_TRUE(RegisterModelType(ModelTypeOf<Model>("made_up_" + std::to_string(i))));
    done = true;
  });
  std::vector<std::thread> loaders;
  for (int i = 0; i < 3; i++)
    loaders.emplace_back([&] {
      do {
        World world;
        std::istringstream content(CrowdText(2));
        EXPECT_TRUE(world.Load(content, "t.world"));
        EXPECT_FALSE(world.Update());
      } while (!done);
    });
  registrar.join();
  for (std::thread& loader : loaders) loader.join();
  EXPECT_NE(FindCreator("made_up_199"), nullptr);
}

}  // namespace
}  // namespace Stg
