// SPDX-License-Identifier: GPL-2.0-or-later
//
// Lights: the blinkenlight and the lightindicator.

#include <sstream>
#include <utility>

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

// ---- seen by other sensors ----------------------------------------------------------------------

/// The colour of the only blob that a blobfinder at the origin sees.
std::string ColorSeen(World& world, const ModelBlobfinder* finder) {
  Step(world);
  if (finder->GetBlobs().size() != 1) return "none";
  const Color seen = finder->GetBlobs()[0].color;
  std::ostringstream text;
  text << seen.r << ' ' << seen.g << ' ' << seen.b;
  return text.str();
}

// The blobfinder of Stage 4.3 sees lights in their colour, whether they are on or not.
TEST(Lights, AreSeenByBlobfindersAsTheyAre) {
  for (const auto& [type, off] :
       {std::pair("light", "0.5 0.25 0"), std::pair("lightindicator", "0.8 0.4 0")}) {
    const auto world = LoadText("blobfinder( name \"b\" )\n" + std::string(type) +
                                "( name \"l\" pose [2 0 0 0] size [0.2 0.2 0.5] "
                                "color_rgba [1 0.5 0 1] )");
    const auto* finder = FindRunning<ModelBlobfinder>(*world, "b");
    auto* light = Find(*world, "l");
    const auto set = [&](bool on) {
      if (auto* lamp = dynamic_cast<ModelLight*>(light)) lamp->SetOn(on);
      if (auto* lamp = dynamic_cast<ModelLightIndicator*>(light)) lamp->SetState(on);
    };
    set(false);
    EXPECT_EQ(ColorSeen(*world, finder), off) << type;
    set(true);
    EXPECT_EQ(ColorSeen(*world, finder), "1 0.5 0") << type;
  }
}

TEST(Lights, BlinkInBlobfinders) {
  const auto world = LoadText(
      "blobfinder( name \"b\" colors_count 1 colors [\"red\"] )\n"
      "blinkenlight( pose [2 0 0 0] size [0.2 0.2 0.5] color \"red\" period 400 )");
  const auto* finder = FindRunning<ModelBlobfinder>(*world, "b");
  std::string pattern;
  for (int i = 0; i < 8; i++) pattern += ColorSeen(*world, finder) == "1 0 0" ? '#' : '.';
  EXPECT_EQ(pattern, "#..##..#");
}

TEST(Lights, AreSeenByCamerasAsTheyAre) {
  const auto world = LoadText(
      "camera( name \"c\" resolution [9 9] )\n"
      "lightindicator( name \"l\" pose [2 0 -0.5 0] size [1 1 1] color_rgba [1 0.5 0 1] )");
  const auto* camera = FindRunning<ModelCamera>(*world, "c");
  const auto red = [&] {
    Step(*world);
    return static_cast<int>(camera->FrameColor()[(4 * 9 + 4) * 4]);
  };
  const int off = red();
  Find<ModelLightIndicator>(*world, "l")->SetState(true);
  const int on = red();
  EXPECT_GT(on, 0);
  EXPECT_NEAR(off, 0.8 * on, 1);
}

}  // namespace
}  // namespace Stg
