// SPDX-License-Identifier: GPL-2.0-or-later
//
// Lights: the blinkenlight and the lightindicator.

#include "support/model_testing.hh"

namespace Stg {
namespace {

/// The states of a light, one per step of 100 ms: '#' is on, '.' is off.
std::string Pattern(World& world, const ModelBlinkenlight* light, int steps) {
  std::string pattern;
  for (int i = 0; i < steps; i++) {
    pattern += light->IsOn() ? '#' : '.';
    Step(world);
  }
  return pattern;
}
std::string PatternOf(const std::string& properties, int steps) {
  const auto world = LoadText("blinkenlight( name \"b\" " + properties + " )");
  return Pattern(*world, Find<ModelBlinkenlight>(*world, "b"), steps);
}

TEST(Blinkenlight, Defaults) {
  const auto world = LoadText("blinkenlight( name \"b\" )");
  const auto* light = Find<ModelBlinkenlight>(*world, "b");
  EXPECT_EQ(light->GetColor(), Color("green"));
  EXPECT_EQ(light->GetGeom().size.x, 0.02);
  EXPECT_EQ(light->GetGeom().size.y, 0.02);
  EXPECT_EQ(light->GetGeom().size.z, 0.02);
  EXPECT_EQ(light->GetSubscriptionCount(), 0u);
  EXPECT_EQ(Pattern(*world, light, 22), "#####.....#####.....##");
}

TEST(Blinkenlight, PeriodAndDutyCycle) {
  EXPECT_EQ(PatternOf("period 400", 10), "##..##..##");
  EXPECT_EQ(PatternOf("period 1000 dutycycle 4", 12), "########..##");
  EXPECT_EQ(PatternOf("period 1000 dutycycle 0.25", 12), "##........##");
  EXPECT_EQ(PatternOf("dutycycle 0", 12), "............");
  EXPECT_EQ(PatternOf("dutycycle 1000000000", 12), "############");
}

// Stage 4.3 reads "dutycycle" in place of "enabled".
TEST(Blinkenlight, MayBeDisabled) {
  EXPECT_EQ(PatternOf("enabled 0 dutycycle 4", 12), "............");
  EXPECT_EQ(PatternOf("enabled 1 dutycycle 0.25", 12), "##........##");
}

TEST(Blinkenlight, SubscriptionsChangeNothing) {
  EXPECT_EQ(PatternOf("period 400 alwayson 1", 10), "##..##..##");
  EXPECT_EQ(PatternOf("period 400 alwayson 1 update_interval 1000", 10), "##..##..##");
}

TEST(Blinkenlight, ShowsItsColourDimmedWhileOff) {
  const auto world = LoadText("blinkenlight( name \"b\" color_rgba [0.8 0.4 0.2 0.5] )");
  const auto* light = Find<ModelBlinkenlight>(*world, "b");
  EXPECT_EQ(light->GetShownColor(), Color(0.8, 0.4, 0.2, 0.5));
  Step(*world, 5);
  EXPECT_EQ(light->GetShownColor(), Color(0.4, 0.2, 0.1, 0.5));
  EXPECT_EQ(light->GetColor(), Color(0.8, 0.4, 0.2, 0.5));
}

TEST(Blinkenlight, BadPropertiesAreRefused) {
  for (const char* bad : {"period 0", "period -5", "dutycycle -1"}) {
    const LoadOutcome outcome = TryToLoad("blinkenlight( " + std::string(bad) + " )");
    EXPECT_FALSE(outcome.loaded) << bad;
    EXPECT_EQ(outcome.errors.find("t.world:1:"), 0u) << outcome.errors;
  }
}

TEST(LightIndicator, IsSwitchedByPrograms) {
  const auto world = LoadText("lightindicator( name \"l\" color_rgba [1 0.5 0 0.5] )");
  auto* light = Find<ModelLightIndicator>(*world, "l");
  EXPECT_FALSE(light->IsOn());
  EXPECT_EQ(light->GetShownColor(), Color(0.8, 0.4, 0, 0.5));
  const uint64_t off = world->StateHash();
  light->SetState(true);
  EXPECT_TRUE(light->IsOn());
  EXPECT_EQ(light->GetShownColor(), Color(1, 0.5, 0, 0.5));
  EXPECT_NE(world->StateHash(), off);
  light->SetState(false);
  EXPECT_EQ(light->GetShownColor(), Color(0.8, 0.4, 0, 0.5));
  EXPECT_EQ(light->GetColor(), Color(1, 0.5, 0, 0.5));
}

TEST(LightIndicator, HasTheBodyOfAPlainModel) {
  const auto world = LoadText("lightindicator( name \"l\" )\nmodel( name \"m\" )");
  EXPECT_EQ(Find(*world, "l")->GetGeom().size.x, Find(*world, "m")->GetGeom().size.x);
  EXPECT_EQ(Find(*world, "l")->GetColor(), Color("red"));
  EXPECT_TRUE(Find(*world, "l")->HasCollision());
}

}  // namespace
}  // namespace Stg
