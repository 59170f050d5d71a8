// SPDX-License-Identifier: GPL-2.0-or-later
//
// Marks of robots in pictures: noses, dots for small robots, and axis numbers drawn over walls but
// not over robots.

#include <gtest/gtest.h>

#include <cmath>
#include <sstream>

#include "gui/draw/render_scene.hh"
#include "gui/draw/renderer.hh"
#include "gui/offscreen/context.hh"
#include "models/body.hh"
#include "models/robot_marks.hh"
#include "support/model_testing.hh"

namespace Stg::draw {

namespace {

using view::Show;

constexpr int kSide = 300;  // pixels

// ---- the shape of noses -------------------------------------------------------------------------

std::optional<Nose> NoseOfRobot(World& world) {
  const Model& robot = *Find<>(world, "r");
  return NoseOf(robot.body(), robot.GetGeom().pose);
}

TEST(NoseTest, PointsAheadAndStaysInTheBody) {
  for (const char* body :
       {"size [0.6 0.4 0.2]", "size [0.4 0.4 0.2] origin [0.1 -0.05 0 0]", "size [0.2 0.9 0.2]",
        "size [2 0.1 0.2]", "size [0.4 0.6 0.2] origin [0 0 0 90]",
        "size [0.5 0.5 0.2] block ( points 4 point[0] [1 0] point[1] [2 1] point[2] [1 2] "
        "point[3] [0 1] z [0 1] )"}) {
    const auto world = LoadText("position ( name \"r\" " + std::string(body) + " )");
    const std::optional<Nose> nose = NoseOfRobot(*world);
    ASSERT_TRUE(nose) << body;
    const auto& [tip, left, right] = *nose;
    EXPECT_GT(tip.x - left.x, 0) << body;
    EXPECT_EQ(left.x, right.x) << body;
    EXPECT_GT(left.y, tip.y) << body;
    EXPECT_NEAR(left.y - tip.y, tip.y - right.y, 1e-12) << body;
    const Model& robot = *Find<>(*world, "r");
    const Geom geom = robot.GetGeom();
    const bool is_across = std::fabs(geom.pose.a) > 1;
    const double half_x = (is_across ? geom.size.y : geom.size.x) / 2;
    const double half_y = (is_across ? geom.size.x : geom.size.y) / 2;
    EXPECT_NEAR(tip.x, geom.pose.x + 0.9 * half_x, 1e-9) << body;
    EXPECT_GT(left.x, geom.pose.x - half_x) << body;
    EXPECT_LT(left.y, geom.pose.y + half_y) << body;
  }
}

TEST(NoseTest, BodiesWithoutACenterHaveNone) {
  const auto world = LoadText("position ( name \"r\" size [0 0 0] )");
  EXPECT_FALSE(NoseOfRobot(*world));
}

TEST(NoseTest, StandsOutFromTheBody) {
  for (const char* name : {"red", "green", "blue", "black", "white", "yellow", "grey", "orange"}) {
    const Color body(name), nose = NoseColor(body);
    const auto lightness = [](const Color& c) { return 0.3 * c.r + 0.6 * c.g + 0.1 * c.b; };
    EXPECT_GT(std::fabs(lightness(body) - lightness(nose)), 0.4) << name;
  }
}

// ---- robots in the scene ------------------------------------------------------------------------

struct Onlooker {
  view::ViewState view;
  RenderScene scene;

  const Frame& Look(World& world) {
    scene.Update(world, view, kSide, kSide);
    return scene.frame();
  }
};

std::vector<Instance> Noses(const Frame& frame) {
  std::vector<Instance> all;
  for (const BodyBatch& batch : frame.bodies)
    all.insert(all.end(), batch.noses.begin(), batch.noses.end());
  return all;
}

size_t Robots(const Frame& frame) {
  size_t count = 0;
  for (const BodyBatch& batch : frame.bodies) count += batch.robots.size();
  return count;
}

TEST(RobotsTest, HaveNosesUnlessTheFileSaysOtherwise) {
  const auto world = LoadText(
      "position ( pose [1 2 0 90] size [1 1 0.5] ) position ( pose [3 0 0 0] gui_nose 0 )"
      "model ( pose [-3 0 0 0] ) model ( pose [-3 3 0 180] gui_nose 1 )");
  Onlooker onlooker;
  const std::vector<Instance> noses = Noses(onlooker.Look(*world));
  ASSERT_EQ(noses.size(), 2u);
  EXPECT_FLOAT_EQ(noses[0].x, 1);
  EXPECT_FLOAT_EQ(noses[0].a, static_cast<float>(M_PI / 2));
  EXPECT_NEAR(double{noses[0].z}, 0.5, 0.01);
  EXPECT_FLOAT_EQ(noses[1].y, 3);
}

TEST(RobotsTest, NosesAreOnTopOfCarriedModels) {
  const auto world = LoadText(
      "position ( pose [-3 0 0 0] size [1 1 0.5] model ( pose [0.2 0 0 0] size [0.3 0.3 0.4] ) )"
      "position ( pose [3 0 0 0] size [1 1 0.5] model ( pose [-1 0 0 0] size [0.3 0.3 0.4] ) )");
  Onlooker onlooker;
  const std::vector<Instance> noses = Noses(onlooker.Look(*world));
  ASSERT_EQ(noses.size(), 2u);
  EXPECT_NEAR(double{noses[0].z}, 0.9, 0.01);
  EXPECT_NEAR(double{noses[1].z}, 0.5, 0.01);
}

TEST(RobotsTest, BecomeDotsWhenTheyAreSmall) {
  const auto world = LoadText(
      "position ( pose [0 0 0 0] size [0.4 0.4 0.2] color \"blue\" "
      "  model ( size [0.1 0.1 0.1] ) model ( pose [0 2 0 0] size [20 20 1] ) )"
      "model ( pose [5 0 0 0] size [0.4 0.4 0.2] )");
  Onlooker onlooker;
  onlooker.view.flat.setScale(10);  // robots of 5.7 pixels
  EXPECT_TRUE(onlooker.Look(*world).dots.empty());
  EXPECT_EQ(Robots(onlooker.scene.frame()), 3u);
  EXPECT_TRUE(Noses(onlooker.scene.frame()).empty());  // too small for one
  onlooker.view.flat.setScale(8);                      // 4.5 pixels
  const Frame& far = onlooker.Look(*world);
  ASSERT_EQ(far.dots.size(), 1u);
  EXPECT_EQ(far.dots[0].color, (Rgba{0, 0, 255, 255}));
  EXPECT_EQ(far.dot_width, 5);
  EXPECT_EQ(Robots(far), 1u);  // the large model that a robot carries
  EXPECT_EQ(onlooker.scene.bodies_in_view(), 4u);
}

std::string Crowd(int side) {
  std::string text;
  for (int x = 0; x < side; x++)
    for (int y = 0; y < side; y++)
      text += "robot ( pose [" + std::to_string(10 * (x - side / 2)) + " " +
              std::to_string(10 * (y - side / 2)) + " 0 0] )\n";
  return "define robot position ( size [0.4 0.4 0.2] color \"red\" model ( size [0.2 0.2 0.2] ) )" +
         text;
}

TEST(RobotsTest, DotsAreSmallerInLargeCrowds) {
  const auto few = LoadText(Crowd(10)), many = LoadText(Crowd(33));
  Onlooker onlooker;
  onlooker.view.flat.setScale(1);
  EXPECT_EQ(onlooker.Look(*few).dot_width, 5);
  EXPECT_EQ(onlooker.Look(*many).dot_width, 3);
}

// ---- pictures -----------------------------------------------------------------------------------

class RobotPicturesTest : public testing::Test {
 protected:
  void SetUp() override {
    std::string error;
    context_ = offscreen::Context::Make(kSide, kSide, &error);
    if (!context_) GTEST_SKIP() << error;
  }
  const offscreen::Image& Draw(World& world) {
    scene_.Update(world, view_, kSide, kSide);
    context_->Bind();
    renderer_.Draw(scene_, Hud());
    context_->Read(&image_);
    return image_;
  }
  static size_t CountRed(const offscreen::Image& image) {
    size_t count = 0;
    for (size_t i = 0; i < image.pixels.size(); i += 4)
      count += image.pixels[i] > 200 && image.pixels[i + 1] < 60 && image.pixels[i + 2] < 60;
    return count;
  }
  static const uint8_t* PixelAt(const offscreen::Image& image, int x, int y) {
    return &image.pixels[static_cast<size_t>(y * kSide + x) * 4];
  }

  std::unique_ptr<offscreen::Context> context_;
  view::ViewState view_;
  RenderScene scene_;
  Renderer renderer_;
  offscreen::Image image_;
};

/// Robots of 0.4 pixels. Drawn as bodies they would be invisible and cost more GPU time.
TEST_F(RobotPicturesTest, CrowdsAreSeenFromFarAndCostLessThanFromNear) {
  const auto world = LoadText(Crowd(33));
  view_.flat.setScale(0.9);
  view_.options.Set(Show::kGrid, false);
  EXPECT_GE(CountRed(Draw(*world)), 4u * 33 * 33);
  EXPECT_LT(renderer_.vertices(), 33u * 33 * 3);
}

TEST_F(RobotPicturesTest, TheNoseIsAtTheFront) {
  const auto world = LoadText("position ( pose [0 0 0 90] size [6 6 1] color \"blue\" )");
  view_.flat.setScale(20);
  view_.options.Set(Show::kGrid, false);
  const offscreen::Image& image = Draw(*world);
  EXPECT_GT(PixelAt(image, 150, 150 - 35)[0], 150);  // bright: nose, ahead
  EXPECT_LT(PixelAt(image, 150, 150 + 35)[0], 50);   // dark: body, behind
}

TEST_F(RobotPicturesTest, AxisNumbersLieOverWallsAndUnderRobots) {
  const auto difference = [&](World& world) {
    view_.options.Set(Show::kGrid, false);
    const std::vector<uint8_t> without = Draw(world).pixels;
    view_.options.Set(Show::kGrid, true);
    const std::vector<uint8_t> with = Draw(world).pixels;
    size_t count = 0;
    for (int y = 100; y < 200; y++)
      for (int x = 100; x < 200; x++) {
        const size_t at = static_cast<size_t>(y * kSide + x) * 4;
        count += !std::equal(&with[at], &with[at] + 4, &without[at]);
      }
    return count;
  };
  view_.flat.setScale(20);
  const auto wall = LoadText("model ( size [10 10 1] color \"black\" )");
  EXPECT_GT(difference(*wall), 100u);
  const auto robot = LoadText("position ( size [10 10 1] color \"black\" )");
  EXPECT_EQ(difference(*robot), 0u);
}

}  // namespace

}  // namespace Stg::draw
