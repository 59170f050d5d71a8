// SPDX-License-Identifier: GPL-2.0-or-later
//
// The controller that follows trails, and the world that shows it.

#include <cmath>
#include <memory>
#include <string>

#include "support/model_testing.hh"
#include "support/shipped_worlds.hh"

namespace Stg {
namespace {

std::string Ant(const std::string& arguments) {
  return "position( name \"ant\" pose [-3 -0.5 0 0] size [0.12 0.08 0.05] ctrl \"trail " +
         arguments +
         "\"\n  groundsensor( pose [0.1 0 0 0] points 2 point[0] [0 0.06] point[1] [0 -0.06] ) )\n";
}

/// Lays a trail with the shape of half a wave and returns how far from it an ant gets.
double FarthestFromTrail(const std::string& arguments, bool with_trail) {
  const auto world = LoadText("field( name \"f\" size [8 4 0] )\n" + Ant(arguments));
  const auto wave = [](double x) { return -0.5 + 0.4 * (1 - std::cos(x + 3)); };
  auto* const field = Find<ModelField>(*world, "f");
  for (double x = -3.2; with_trail && x < 3.9; x += 0.01)
    for (double aside = -0.12; aside < 0.13; aside += 0.02)
      field->SetValue(x, wave(x) + aside, 1 - std::fabs(aside) / 0.15);
  double farthest = 0;
  const Model* const ant = Find(*world, "ant");
  for (int i = 0; i < 250; i++) {
    Step(*world);
    if (ant->GetPose().x < 2.5)
      farthest = std::max(farthest, std::fabs(ant->GetPose().y - wave(ant->GetPose().x)));
  }
  EXPECT_TRUE(!with_trail || ant->GetPose().x > 1) << ant->GetPose().x;
  return farthest;
}

TEST(Trail, IsFollowed) {
  EXPECT_LT(FarthestFromTrail("noise=0", true), 0.15);
  EXPECT_LT(FarthestFromTrail("noise=0.2", true), 0.15);
  EXPECT_GT(FarthestFromTrail("noise=0", false), 0.5);
}

TEST(Trail, MistakesAreReported) {
  EXPECT_NE(TryToLoad(Ant("noise=2")).errors.find("noise=2"), std::string::npos);
  EXPECT_NE(TryToLoad("position( ctrl \"trail\" groundsensor() )\n")
                .errors.find("found no ground sensor with two points"),
            std::string::npos);
  EXPECT_NE(TryToLoad("groundsensor( ctrl \"trail\" )\n").errors.find("expected a position"),
            std::string::npos);
}

/// How much more ants of the world smell than there is on average.
double Concentration(const std::string& setting) {
  InitLibrary();
  RunOptions options;
  options.settings = {setting};
  World world(options);
  EXPECT_TRUE(world.Load(SourceFile("worlds/trail.world")));
  Step(world, 300);
  double smelt = 0;
  int count = 0;
  for (int i = 0; i < 300; i++) {
    Step(world);
    for (const Model* model : world.GetAllModels())
      if (const auto* const nose = dynamic_cast<const ModelGroundSensor*>(model))
        for (const double value : nose->GetValues()) {
          smelt += value;
          count++;
        }
  }
  const double area = 64;
  return smelt / count / (Find<ModelField>(world, "pheromone")->Integral() / area);
}

TEST(Trail, AntsOfTheWorldStayOnTrails) {
  const double following = Concentration("ant.ctrl=trail noise=0.3");
  const double wandering = Concentration("ant.ctrl=trail noise=1");
  EXPECT_GT(following, 1.5);
  EXPECT_GT(following, 1.2 * wandering);
}

}  // namespace
}  // namespace Stg
