// SPDX-License-Identifier: GPL-2.0-or-later
//
// Drawing of sensor data: layer, place and colour.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "gui/draw/painter.hh"
#include "gui/draw/render_scene.hh"
#include "gui/draw/screen_writer.hh"
#include "support/mapper.hh"
#include "support/model_testing.hh"

namespace Stg::draw {

namespace {

using view::Show;

constexpr int kWidth = 400, kHeight = 300;

class DataTest : public testing::Test {
 protected:
  DataTest() { view_.options.Set(Show::kData, true); }

  const Frame& Look(const std::string& text, unsigned steps = 2) {
    world_ = LoadText(text);
    Step(*world_, steps);
    scene_.Update(*world_, view_, kWidth, kHeight);
    return scene_.frame();
  }

  view::ViewState view_;
  std::unique_ptr<World> world_;
  RenderScene scene_;
};

size_t CountColor(const std::vector<Vertex>& vertices, const Rgba& color) {
  return static_cast<size_t>(std::count_if(vertices.begin(), vertices.end(),
                                           [&](const Vertex& v) { return v.color == color; }));
}

bool HasLabel(const Painting& painting, const std::string& text) {
  return std::any_of(painting.labels.begin(), painting.labels.end(),
                     [&](const Label& label) { return painting.TextOf(label) == text; });
}

TEST_F(DataTest, WifiRangesLieLightlyOnTheFloor) {
  const Frame& frame = Look(
      "model ( pose [1 2 0.5 0] size [0.2 0.2 0.2]"
      " wifi ( model \"simple\" range 3 alwayson 1 ) )");
  ASSERT_FALSE(frame.floor.triangles.empty());
  double farthest = 0;
  for (const Vertex& v : frame.floor.triangles) {
    EXPECT_EQ(v.z, 0);
    EXPECT_LE(v.color.a, 50);
    farthest = std::max(farthest, std::hypot(double{v.x} - 1, double{v.y} - 2));
  }
  EXPECT_NEAR(farthest, 3, 1e-6);
  EXPECT_GT(CountColor(frame.floor.lines, {0x2e, 0x8b, 0x57, 255}), 70u);
  EXPECT_TRUE(frame.data.triangles.empty());  // nothing above the floor layer
}

TEST_F(DataTest, FieldsLieOnTheFloorAndAreOpaqueWhereTheyAreHighest) {
  world_ = LoadText("field ( name \"f\" size [4 2 0] field_resolution 1 pose [10 0 0 90] )");
  auto* const field = Find<ModelField>(*world_, "f");
  view_.options.Set(Show::kData, false);
  scene_.Update(*world_, view_, kWidth, kHeight);
  EXPECT_TRUE(scene_.frame().floor.triangles.empty()) << "all values are 0";
  field->SetValue(10, 1.5, 8);  // in the east of the field, which is the north of the world
  field->SetValue(10, 0.5, 4);
  field->SetValue(10, -0.5, 4);
  scene_.Update(*world_, view_, kWidth, kHeight);
  const auto& triangles = scene_.frame().floor.triangles;
  ASSERT_EQ(triangles.size(), 2u * 6) << "two equal neighbours are one rectangle";
  for (const Vertex& v : triangles) {
    EXPECT_EQ(v.z, 0);
    const bool strong = v.color.a == 204;
    EXPECT_TRUE(strong || v.color.a == 102) << int{v.color.a};
    EXPECT_GE(v.y, strong ? 0.999 : -1.001);
    EXPECT_LE(v.y, strong ? 2.001 : 1.001);
  }
  view_.options.Set(Show::kFields, false);
  scene_.Update(*world_, view_, kWidth, kHeight);
  EXPECT_TRUE(scene_.frame().floor.triangles.empty());
}

TEST_F(DataTest, LightsThatAreOnGlow) {
  view_.options.Set(Show::kData, false);
  world_ = LoadText(
      "light ( name \"l\" pose [1 2 0 0] size [0.2 0.1 0.3] intensity 1 color \"red\" )\n"
      "position( pose [0 -4 0 90] lightindicator( pose [1 0 0 0] name \"i\" ) )\n"
      "light ( pose [5 5 0 0] intensity 0 )");
  auto* const light = Find<ModelLight>(*world_, "l");
  const auto& triangles = scene_.frame().floor.triangles;
  const auto away = [](const Vertex& v) { return std::hypot(double{v.x} - 1, double{v.y} - 2); };
  const auto look = [&]() -> double {
    scene_.Update(*world_, view_, kWidth, kHeight);
    double radius = 0;
    for (const Vertex& v : triangles) radius = std::max(radius, away(v));
    for (const Vertex& v : triangles) {
      const int opacity = away(v) < 0.001 ? 153 : away(v) > radius - 0.001 ? 0 : 38;
      EXPECT_EQ(v.color, (Rgba{255, 0, 0, static_cast<uint8_t>(opacity)})) << away(v);
      EXPECT_EQ(v.z, 0);
    }
    return radius;
  };
  EXPECT_NEAR(look(), 0.5, 1e-6) << "where it causes 4 W/m2";
  light->SetIntensity(1000);
  EXPECT_NEAR(look(), 2, 1e-6);
  light->SetIntensity(0.0001);
  EXPECT_NEAR(look(), 0.2, 1e-6) << "twice its body";
  view_.options.Set(Show::kLights, false);
  EXPECT_EQ(look(), 0);
  EXPECT_TRUE(triangles.empty());
  view_.options.Set(Show::kLights, true);
  light->SetOn(false);
  EXPECT_EQ(look(), 0);
  EXPECT_TRUE(triangles.empty()) << "neither do lights without an intensity glow";
}

TEST_F(DataTest, LargeFieldsAreDrawnInPatches) {
  world_ = LoadText("field ( name \"f\" size [33 1 0] field_resolution 0.1 )");
  auto* const field = Find<ModelField>(*world_, "f");
  field->SetValue(-16.45, -0.45, 9);  // in a patch of 3 x 3 cells
  scene_.Update(*world_, view_, kWidth, kHeight);
  ASSERT_EQ(scene_.frame().floor.triangles.size(), 6u);
  double east = -99;
  for (const Vertex& v : scene_.frame().floor.triangles) east = std::max<double>(east, v.x);
  EXPECT_NEAR(east, -16.2, 1e-5);
}

TEST_F(DataTest, MessagesComeFromWhereTheirSendersWereMeasured) {
  world_ = LoadText(
      "radio ( name \"a\" pose [1 2 0.5 90] alwayson 1 ) radio ( name \"b\" pose [1 4 0 0] range 3 "
      ")");
  ASSERT_TRUE(Find<ModelRadio>(*world_, "b")->Send("hello", 5));
  Step(*world_);
  scene_.Update(*world_, view_, kWidth, kHeight);
  const auto count = [&] { return CountColor(scene_.frame().data.lines, {255, 140, 0, 255}); };
  EXPECT_EQ(count(), 6u) << "a line, and two for the head of the arrow";
  const auto& lines = scene_.frame().data.lines;
  EXPECT_TRUE(std::ranges::any_of(lines, [](const Vertex& v) {
    return std::fabs(v.x - 1) < 1e-5 && std::fabs(v.y - 4) < 1e-5 && v.z == 0.5;
  }));
  view_.options.Set(Show::kRadio, false);
  scene_.Update(*world_, view_, kWidth, kHeight);
  EXPECT_EQ(count(), 0u);
}

/// Without walls, the level falls to range_db at 5 m. A wall is between 2 m and 3 m ahead.
TEST_F(DataTest, WallsShortenTheRangeOfAWifiThatKnowsThem) {
  const Frame& frame = Look(
      "model ( size [0.2 0.2 0.2] wifi ( model \"raytrace\" power 0 range_db -60.7524 freq 2450"
      " plc 30 wall_factor 0.1 alwayson 1 ) )"
      "model ( pose [2.5 0 0 0] size [1 4 1] )"
      "model ( pose [0 3 0 0] size [4 1 1] ranger_return -1 )");
  ASSERT_EQ(frame.floor.triangles.size(), 3u * 72);
  const auto reach = [&](size_t corner) {
    const Vertex& v = frame.floor.triangles[3 * corner + 1];
    return std::hypot(double{v.x}, double{v.y});
  };
  const double open_loss = 30 * std::log10(5 / 2.0), wall_loss = 10;
  EXPECT_NEAR(reach(0), 2 + 3 * open_loss / (open_loss + wall_loss), 1e-4);
  EXPECT_NEAR(reach(18), 5, 1e-4);  // rangers don't see that wall
  EXPECT_NEAR(reach(36), 5, 1e-4);
}

TEST_F(DataTest, FiducialsAreMarkedAboveTheirBodies) {
  const Frame& frame = Look(
      "position ( size [0.3 0.3 0.3] fiducial ( alwayson 1 pose [0 0 -0.15 0] ) )"
      "model ( pose [2 0 0 0] size [0.5 0.5 0.5] fiducial_return 17 )");
  EXPECT_EQ(CountColor(frame.over.thick_lines, {255, 0, 255, 255}), 8u);
  EXPECT_TRUE(HasLabel(frame.over, "17"));
  EXPECT_FALSE(frame.data.thick_lines.empty());  // the dashed line to the fiducial
}

TEST_F(DataTest, BumpersShowWhetherTheyAreHit) {
  const Frame& frame = Look(
      "position ( size [0.4 0.4 0.3] bumper ( pose [0 0 -0.2 0] noblocks 1 alwayson 1 bcount 2"
      " blength 0.4 bpose[0] [0.3 0 0 0] bpose[1] [-0.3 0 0 180] ) )"
      "model ( pose [0.5 0 0 0] size [0.5 0.2 0.5] )");
  const Rgba red{255, 0, 0, 255}, green{0, 255, 0, 255};
  EXPECT_EQ(CountColor(frame.over.triangles, red), 6u);  // not hidden by what it touches
  EXPECT_EQ(CountColor(frame.over.thick_lines, red), 2u);
  EXPECT_EQ(CountColor(frame.data.triangles, green), 6u);
  EXPECT_EQ(CountColor(frame.data.thick_lines, green), 2u);
  for (const Vertex& v : frame.over.thick_lines) EXPECT_NEAR(double{v.x}, 0.3, 1e-6);
}

/// A device's origin shifts its body, its sensing, and so also its drawing.
TEST_F(DataTest, BumpersAreWhereTheySense) {
  const Frame& frame = Look(
      "position ( pose [1 2 0 90] bumper ( pose [0 0 -0.2 0] origin [0.1 0.2 0 0] noblocks 1"
      " alwayson 1 bcount 1 blength 0.4 bpose[0] [0.3 0 0 0] ) )");
  ASSERT_EQ(frame.data.thick_lines.size(), 2u);
  for (const Vertex& v : frame.data.thick_lines) EXPECT_NEAR(double{v.y}, 2 + 0.1 + 0.3, 1e-6);
  EXPECT_NEAR(double{frame.data.thick_lines[0].x + frame.data.thick_lines[1].x} / 2, 1 - 0.2, 1e-6);
}

constexpr char kShiftedEye[] =
    "position ( name \"robot\" pose [1 2 0 90] ranger ( name \"eye\" origin [0.5 0.2 0.1 45]"
    " alwayson 1 sensor ( pose [0.1 0 0 0] range [0 5] samples 3 fov 90 ) ) )"
    "model ( pose [1 6 0 0] size [9 0.5 2] )";

TEST_F(DataTest, FansBeginWhereTheirRaysDo) {
  const Frame& frame = Look(kShiftedEye);
  const auto* eye = Find<ModelRanger>(*world_, "robot.eye");
  const Pose origin = eye->LocalToGlobal(eye->GetSensors()[0].pose);
  ASSERT_EQ(scene_.fans_in_view(), 1u);
  const auto& fan = frame.fans[0].fans[0];
  EXPECT_NEAR(double{fan.x}, origin.x, 1e-6);
  EXPECT_NEAR(double{fan.y}, origin.y, 1e-6);
  EXPECT_NEAR(double{fan.z}, origin.z + eye->GetSensors()[0].size.z / 2, 1e-6);
  EXPECT_NEAR(normalize(double{fan.a} - origin.a), 0, 1e-6);
}

/// A step senses first, then moves. Pictures must show readings from where the rays began;
/// otherwise they would appear rotated against the walls.
TEST_F(DataTest, ScansLieOnTheWallsWhileTheRobotTurns) {
  struct Case {
    int step, ranger_interval, robot_interval;
  };
  view_.options.Set(Show::kRangerStrikes, true);
  for (const Case& c : {Case{100, 100, 100}, {20, 100, 100}, {20, 250, 40}, {100, 250, 100}}) {
    world_ = LoadText("interval_sim " + std::to_string(c.step) + "\n" +
                      Room("position( name \"r\" pose [1 -2 0 30] update_interval " +
                           std::to_string(c.robot_interval) +
                           " ranger( pose [0.05 0.02 0 5] alwayson 1 update_interval " +
                           std::to_string(c.ranger_interval) +
                           " sensor( pose [0.05 0 0 10] range [0 20] fov 350 samples 36 ) ) )"));
    auto* const robot = FindRunning<ModelPosition>(*world_, "r");
    robot->SetSpeed(0.5, 0, 1.2);
    Mapper strikes, areas;
    for (int time = 0; time < 2000; time += c.step) {
      Step(*world_);
      scene_.Update(*world_, view_, kWidth, kHeight);
      for (const Vertex& v : scene_.frame().data.points)
        strikes.Add(Pose(double{v.x}, double{v.y}, 0, 0), 0, 0);
      for (const FanGroup& group : scene_.frame().fans)
        for (const FanInstance& fan : group.fans)
          for (size_t i = 0; i < group.ray_ends; i++) {
            const RayEnd& tip = scene_.frame().ray_ends[fan.first + i];
            areas.Add(Pose(double{fan.x}, double{fan.y}, 0, double{fan.a}),
                      std::atan2(double{tip.y}, double{tip.x}),
                      std::hypot(double{tip.x}, double{tip.y}));
          }
    }
    const std::string what = "steps of " + std::to_string(c.step) + " ms, updates " +
                             std::to_string(c.ranger_interval) + " and " +
                             std::to_string(c.robot_interval) + " ms";
    strikes.Print("strikes, " + what);
    areas.Print("areas, " + what);
    EXPECT_GT(strikes.points(), 500u) << what;
    EXPECT_GT(areas.points(), 250u) << what;
    EXPECT_LT(strikes.Quantile(1), 0.005) << what;
    EXPECT_LT(areas.Quantile(1), 0.005) << what;
  }
}

TEST_F(DataTest, FiducialsAreMarkedOnTheirTargetsWhileTheFinderTurns) {
  world_ = LoadText(
      "position ( name \"r\" size [0.3 0.3 0.3] fiducial ( alwayson 1 fov 360 ) )"
      "model ( pose [2 0 0 0] size [0.5 0.5 0.5] fiducial_return 17 )");
  FindRunning<ModelPosition>(*world_, "r")->SetSpeed(0, 0, 1.2);
  for (int i = 0; i < 20; i++) {
    Step(*world_);
    scene_.Update(*world_, view_, kWidth, kHeight);
    const std::vector<Vertex>& lines = scene_.frame().over.thick_lines;
    ASSERT_FALSE(lines.empty());
    for (const Vertex& v : lines) {
      EXPECT_NEAR(std::fabs(double{v.x} - 2), 0.25, 1e-5);
      EXPECT_NEAR(std::fabs(double{v.y}), 0.25, 1e-5);
    }
  }
}

TEST_F(DataTest, RaysOfTheClickedRobotBeginWhereTheyAreCast) {
  view_.options.Set(Show::kRays, true);
  view_.options.Set(Show::kData, false);
  world_ = LoadText(kShiftedEye);
  Step(*world_, 2);
  Selection selection;
  selection.last = Find(*world_, "robot");
  scene_.Update(*world_, view_, kWidth, kHeight, selection);
  const auto* eye = Find<ModelRanger>(*world_, "robot.eye");
  const Pose origin = eye->LocalToGlobal(eye->GetSensors()[0].pose);
  const std::vector<Vertex>& lines = scene_.frame().over.lines;
  ASSERT_FALSE(lines.empty());
  EXPECT_NEAR(double{lines[0].x}, origin.x, 1e-3);
  EXPECT_NEAR(double{lines[0].y}, origin.y, 1e-3);
  // The rightmost ray goes straight up, to the wall.
  const double wall = 6 - 0.25;
  EXPECT_NEAR(eye->GetSensors()[0].ranges[0], wall - origin.y, 0.03);
  double highest = 0;
  for (const Vertex& v : lines) highest = std::max(highest, double{v.y});
  EXPECT_NEAR(highest, wall, 0.05);
}

/// With a negative maximum, readings are 0 and are drawn with length 0.
TEST_F(DataTest, NegativeRangesCountAsNothing) {
  for (const Show show : {Show::kRangerFov, Show::kRays}) view_.options.Set(show, true);
  world_ = LoadText(kShiftedEye);
  auto* eye = Find<ModelRanger>(*world_, "robot.eye");
  eye->GetSensorsMutable()[0].range.max = -3;
  Step(*world_, 2);
  EXPECT_EQ(eye->GetSensors()[0].ranges, std::vector<double>(3, 0.0));
  Selection selection;
  selection.last = Find(*world_, "robot");
  scene_.Update(*world_, view_, kWidth, kHeight, selection);
  EXPECT_TRUE(scene_.frame().over.lines.empty());
  const Pose origin = eye->LocalToGlobal(eye->GetSensors()[0].pose);
  for (const Vertex& v : scene_.frame().data.lines) {
    EXPECT_NEAR(double{v.x}, origin.x, 1e-6);
    EXPECT_NEAR(double{v.y}, origin.y, 1e-6);
  }
}

TEST_F(DataTest, TransducersAreNumbered) {
  view_.options.Set(Show::kRangerTransducers, true);
  const Frame& frame = Look(
      "position ( ranger ( pose [0 0 -0.5 0] alwayson 1 sensor ( pose [0.1 0 0 0] size [0.1 0.2 0] "
      ")"
      " sensor ( pose [-0.1 0 0 180] color_rgba [0 1 0 0.2] ) ) )");
  EXPECT_TRUE(HasLabel(frame.over, "0"));
  EXPECT_TRUE(HasLabel(frame.over, "1"));
  EXPECT_EQ(frame.over.points.size(), 2u);
  EXPECT_EQ(CountColor(frame.over.triangles, {0, 255, 0, 255}), 6u);  // large enough to be seen
}

/// In a row of numbers towards the horizon, those that would cover others are omitted.
TEST_F(DataTest, AxisNumbersDoNotCoverEachOther) {
  Font font;
  std::string error;
  if (!font.Open(12, &error)) GTEST_SKIP() << error;
  view_.options.Set(Show::kPerspective, true);
  const Frame& frame = Look("model ( pose [0 0 0 0] ) model ( pose [19 19 0 0] )");
  ScreenWriter all(&font), spaced(&font);
  all.AddLabels(frame.floor, *frame.projection);
  spaced.AddAxisNumbers(frame.floor, *frame.projection);
  constexpr size_t kTimes = 9;  // copies of each number, including its rim
  EXPECT_LT(spaced.vertices().size(), kTimes * all.vertices().size());
  EXPECT_GT(spaced.vertices().size(), kTimes * all.vertices().size() / 4);

  view_.options.Set(Show::kPerspective, false);
  scene_.Update(*world_, view_, kWidth, kHeight);
  all.Clear();
  spaced.Clear();
  all.AddLabels(scene_.frame().floor, *scene_.frame().projection);
  spaced.AddAxisNumbers(scene_.frame().floor, *scene_.frame().projection);
  EXPECT_FALSE(all.vertices().empty());
  EXPECT_EQ(spaced.vertices().size(), kTimes * all.vertices().size());  // from above, all fit
}

/// Labels of visible models are inside the view.
TEST_F(DataTest, LabelsDoNotStickOut) {
  Font font;
  std::string error;
  if (!font.Open(12, &error)) GTEST_SKIP() << error;
  const view::Projection projection = *Look("model ()").projection;
  for (const bool right : {true, false}) {
    double x = 0;
    const auto pixel = [&] { return projection.ToPixels(point3_t(x, 0, 0))->x; };
    while (pixel() > 3 && pixel() < kWidth - 3) x += right ? 0.01 : -0.01;
    for (const Align align : {Align::kLeft, Align::kCentre, Align::kRight}) {
      Painting painting;
      Painter(&painting).Text(point3_t(x, 0, 0), "of some length", align);
      ScreenWriter writer(&font);
      writer.AddLabels(painting, projection);
      ASSERT_FALSE(writer.vertices().empty());
      for (const TextVertex& v : writer.vertices()) {
        EXPECT_GE(v.x, -1);
        EXPECT_LE(v.x, kWidth + 1);
      }
    }
  }
}

/// Values that jump up and down give one line, one pixel wide everywhere.
TEST_F(DataTest, ChartsAreLinesOfEvenWidth) {
  Font none;
  ScreenWriter writer(&none);
  Chart chart{10, 20, 200, 40, {255, 0, 0, 255}, {0, 0, 0, 128}, 0, 1, {0, 1, 0, 1}, "jumps"};
  writer.AddChart(chart);
  double area = 0;
  for (size_t i = 0; i + 2 < writer.vertices().size(); i += 3) {
    const TextVertex *a = &writer.vertices()[i], *b = a + 1, *c = a + 2;
    if (!(a->color == chart.color)) continue;
    area += std::fabs((double{b->x} - double{a->x}) * (double{c->y} - double{a->y}) -
                      (double{c->x} - double{a->x}) * (double{b->y} - double{a->y})) /
            2;
  }
  EXPECT_NEAR(area, 3 * std::hypot(200 / 3.0, 40), 0.01);
}

}  // namespace

}  // namespace Stg::draw
