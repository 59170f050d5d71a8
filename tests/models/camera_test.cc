// SPDX-License-Identifier: GPL-2.0-or-later
// The camera: selected pixels of images of simple scenes.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "support/counted_allocations.hh"
#include "support/model_testing.hh"

namespace Stg {
namespace {

typedef std::array<int, 4> Pixel;
const Pixel kSky{178, 178, 204, 255}, kFloor{255, 255, 255, 255};
const Pixel kRed{255, 0, 0, 255}, kBlue{0, 0, 255, 255}, kGreen{0, 255, 0, 255};
constexpr double kNothing = 8.0;

Pixel ColorAt(const ModelCamera& camera, int x, int y) {
  const GLubyte* p = camera.FrameColor() + 4 * (x + y * camera.getWidth());
  return {p[0], p[1], p[2], p[3]};
}

double DepthAt(const ModelCamera& camera, int x, int y) {
  return static_cast<double>(camera.FrameDepth()[x + y * camera.getWidth()]);
}

void ExpectPixel(const ModelCamera& camera, int x, int y, const Pixel& color, double depth) {
  EXPECT_EQ(ColorAt(camera, x, y), color) << x << ", " << y;
  EXPECT_NEAR(DepthAt(camera, x, y), depth, 1e-5) << x << ", " << y;
}

/// A robot at the origin with a camera, whose eye is at (0.3, 0, 0.42).
std::string Robot(const std::string& camera = "") {
  return "position( name \"r\" size [0.3 0.3 0.22] color \"gray\" camera( pose [0.3 0 0.2 0] "
         "name \"eye\" alwayson 1 " +
         camera + " ) )\n";
}

std::string Box(const std::string& color, const std::string& pose,
                const std::string& size = "0.4 0.4 1") {
  return "model( color \"" + color + "\" size [" + size + "] pose [" + pose + "] )\n";
}

/// A world after a step, with its camera `r.eye`.
struct Scene {
  explicit Scene(const std::string& text, const std::string& name = "r.eye")
      : world(LoadText(text)), camera(*Find<ModelCamera>(*world, name)) {
    Step(*world);
  }
  std::unique_ptr<World> world;
  ModelCamera& camera;
};

/// The column of a point in an image of 32 x 32 pixels with fields of view of 70 and 40 degrees, by
/// the tangent of its angle to the right of the center; below, the row by the angle upwards.
int PixelX(double tangent) {
  return static_cast<int>(std::floor((tangent / std::tan(dtor(35)) + 1) * 16));
}
int PixelY(double tangent) {
  return static_cast<int>(std::floor((tangent / std::tan(dtor(20)) + 1) * 16));
}

// ---- properties

TEST(CameraTest, Defaults) {
  const auto world = LoadText("position( name \"r\" camera( name \"eye\" ) )");
  const ModelCamera& camera = *Find<ModelCamera>(*world, "r.eye");
  EXPECT_EQ(camera.GetModelType(), "camera");
  EXPECT_EQ(camera.getWidth(), 32);
  EXPECT_EQ(camera.getHeight(), 32);
  EXPECT_EQ(camera.getCamera().horizFov(), 70);
  EXPECT_EQ(camera.getCamera().vertFov(), 40);
  EXPECT_EQ(camera.getCamera().nearClip(), 0.2);
  EXPECT_EQ(camera.getCamera().farClip(), 8.0);
  EXPECT_EQ(camera.GetGeom().size.x, 0.1);
  EXPECT_EQ(camera.GetGeom().size.y, 0.07);
  EXPECT_EQ(camera.GetGeom().size.z, 0.05);
  EXPECT_TRUE(camera.GetColor() == Color("black"));
}

TEST(CameraTest, ReadsItsProperties) {
  const auto world = LoadText(
      "unit_angle \"radians\" position( name \"r\" camera( name \"eye\" resolution [64 48] "
      "range [0.1 12.5] fov [90 60] pantilt [10 20] size [0.2 0.2 0.2] ) )");
  const ModelCamera& camera = *Find<ModelCamera>(*world, "r.eye");
  EXPECT_EQ(camera.getWidth(), 64);
  EXPECT_EQ(camera.getHeight(), 48);
  EXPECT_EQ(camera.getCamera().horizFov(), 90) << "degrees, whatever the unit";
  EXPECT_EQ(camera.getCamera().vertFov(), 60);
  EXPECT_EQ(camera.getCamera().nearClip(), 0.1);
  EXPECT_EQ(camera.getCamera().farClip(), 12.5);
  EXPECT_EQ(camera.GetGeom().size.x, 0.2);
}

TEST(CameraTest, RefusesInvalidProperties) {
  const std::vector<std::pair<std::string, std::string>> bad{
      {"resolution [-1 32]", "found -1 by 32 pixels"},
      {"resolution [32 100000]", "found 32 by 100000 pixels"},
      {"range [0 8]", "expected 0 < near < far"},
      {"range [2 2]", "expected 0 < near < far"},
      {"fov [0 40]", "found a field of view of 0.000000"},
      {"fov [70 180]", "found a field of view of 180.000000"}};
  for (const auto& [property, message] : bad) {
    const LoadOutcome outcome = TryToLoad("camera( " + property + " )");
    EXPECT_FALSE(outcome.loaded) << property;
    EXPECT_NE(outcome.errors.find(message), std::string::npos) << outcome.errors;
  }
}

TEST(CameraTest, NoFrameBeforeTheFirstUpdate) {
  const auto world = LoadText(Robot());
  const ModelCamera& camera = *Find<ModelCamera>(*world, "r.eye");
  EXPECT_EQ(camera.FrameDepth(), nullptr);
  EXPECT_EQ(camera.FrameColor(), nullptr);
  Step(*world);
  EXPECT_NE(camera.FrameDepth(), nullptr);
  EXPECT_NE(camera.FrameColor(), nullptr);
}

TEST(CameraTest, NoFrameWithoutPixelsOrSubscribers) {
  for (const char* text :
       {"camera( name \"eye\" resolution [0 10] alwayson 1 )",
        "camera( name \"eye\" resolution [10 0] alwayson 1 )", "camera( name \"eye\" )"}) {
    const Scene scene(text, "eye");
    EXPECT_EQ(scene.camera.FrameDepth(), nullptr) << text;
    EXPECT_EQ(scene.camera.FrameColor(), nullptr) << text;
  }
}

TEST(CameraTest, UpdatesOncePerInterval) {
  const auto world = LoadText(Robot());
  int updates = 0;
  Find(*world, "r.eye")
      ->AddCallback(
          Model::CB_UPDATE,
          [](Model*, void* count) {
            ++*static_cast<int*>(count);
            return 0;
          },
          &updates);
  Step(*world, 10);
  EXPECT_EQ(updates, 10);
}

// ---- reference case

TEST(CameraTest, ReferenceCase) {
  const Scene scene(Robot() + Box("red", "3 0 0 0") + Box("blue", "3 1 0 0"));
  const ModelCamera& camera = scene.camera;
  ExpectPixel(camera, 16, 16, kRed, 2.5);
  const int blue = PixelX(-1.0 / 2.5);
  ASSERT_LT(blue, 16) << "left of red";
  ExpectPixel(camera, blue, 16, kBlue, 2.5);
  ExpectPixel(camera, 31, 16, kSky, kNothing);
  ExpectPixel(camera, 31, 31, kSky, kNothing);
}

TEST(CameraTest, FloorIsWhiteAtItsDistanceAlongTheAxis) {
  const Scene scene(Robot() + Box("red", "3 0 0 0"));
  const double tangent = 31.0 / 32.0 * std::tan(dtor(20));  // of the center of the lowest row
  for (const int x : {0, 10, 31}) ExpectPixel(scene.camera, x, 0, kFloor, 0.42 / tangent);
  // The front of the box is 0.58 m higher than the eye, which is above the image at 2.5 m.
  ExpectPixel(scene.camera, 16, PixelY(0.0), kRed, 2.5);
  ExpectPixel(scene.camera, 16, PixelY(0.56 / 2.5), kRed, 2.5);
  ExpectPixel(scene.camera, 16, PixelY(0.62 / 2.5), kSky, kNothing);
}

TEST(CameraTest, EdgesOfABoxAreExact) {
  const Scene scene(Robot("resolution [700 400]") + Box("red", "3 0 0 0"));
  // The front has y from -0.2 to 0.2 and z from 0 to 1; the eye is 2.5 m away at a height of 0.42
  // m.
  const double half_width = 0.2 / 2.5 / std::tan(dtor(35)) * 350;
  const int left = static_cast<int>(std::lround(350 - half_width));
  const int right = static_cast<int>(std::lround(350 + half_width));
  EXPECT_EQ(ColorAt(scene.camera, left - 1, 205), kSky);
  EXPECT_EQ(ColorAt(scene.camera, left, 205), kRed);
  EXPECT_EQ(ColorAt(scene.camera, right - 1, 205), kRed);
  EXPECT_EQ(ColorAt(scene.camera, right, 205), kSky);
  const int top = static_cast<int>(std::lround(200 + 0.58 / 2.5 / std::tan(dtor(20)) * 200));
  EXPECT_EQ(ColorAt(scene.camera, 350, top - 1), kRed);
  EXPECT_EQ(ColorAt(scene.camera, 350, top), kSky);
  const int bottom = static_cast<int>(std::lround(200 - 0.42 / 2.5 / std::tan(dtor(20)) * 200));
  EXPECT_EQ(ColorAt(scene.camera, 350, bottom), kRed);
  EXPECT_EQ(ColorAt(scene.camera, 350, bottom - 1), kFloor);
}

// ---- direction of view

TEST(CameraTest, LooksAlongItsOwnHeading) {
  // The robot looks along +y, its camera another 90 degrees to the left.
  const Scene scene(
      "position( name \"r\" pose [0 0 0 90] size [0.3 0.3 0.22] camera( name \"eye\" pose "
      "[0 0 0.2 90] alwayson 1 ) )" +
      Box("red", "0 3 0 0") + Box("blue", "-3 0 0 0"));
  ExpectPixel(scene.camera, 16, 16, kBlue, 2.8);
  EXPECT_NEAR(scene.camera.getCamera().yaw(), 90, 1e-9);  // 180 degrees, counted from +y
}

TEST(CameraTest, WorksAtTopLevel) {
  const Scene scene("camera( name \"eye\" pose [0 0 0.4 -90] alwayson 1 )" + Box("red", "0 -3 0 0"),
                    "eye");
  ExpectPixel(scene.camera, 16, 16, kRed, 2.8);
  const PerspectiveCamera& view = scene.camera.getCamera();
  EXPECT_NEAR(view.yaw(), -180, 1e-9);
  EXPECT_EQ(view.pitch(), 90);
  EXPECT_EQ(view.z(), 0.4);
}

TEST(CameraTest, IgnoresItsOrigin) {
  const Scene scene(Robot("origin [-1 0 0 45]") + Box("red", "3 0 0 0"));
  ExpectPixel(scene.camera, 16, 16, kRed, 2.5);
}

TEST(CameraTest, PansToTheRightAndTiltsDown) {
  const std::string boxes = Box("red", "3 0 0 0") + Box("blue", "0.3 -3 0 0");
  const Scene panned(Robot("pantilt [90 0]") + boxes);
  ExpectPixel(panned.camera, 16, 16, kBlue, 2.8);
  EXPECT_NEAR(panned.camera.getCamera().yaw(), -180, 1e-9);

  const Scene tilted(Robot("pantilt [0 45] resolution [31 31]"));
  EXPECT_EQ(tilted.camera.getCamera().pitch(), 45);
  ExpectPixel(tilted.camera, 15, 15, kFloor, 0.42 / std::sin(dtor(45)));

  const Scene up(Robot("pantilt [0 -45]") + boxes);
  for (const int y : {0, 16, 31}) ExpectPixel(up.camera, 16, y, kSky, kNothing);
}

TEST(CameraTest, CanBeTurnedByItsUser) {
  Scene scene(Robot() + Box("blue", "0.3 -3 0 0"));
  ExpectPixel(scene.camera, 16, 16, kSky, kNothing);
  scene.camera.setYaw(90);
  Step(*scene.world);
  ExpectPixel(scene.camera, 16, 16, kBlue, 2.8);
  scene.camera.setPitch(90);
  Step(*scene.world);
  ExpectPixel(scene.camera, 16, 16, kFloor, 0.42);
}

TEST(CameraTest, StraightDownAndBeyond) {
  // From 3 m above, the top of the box fills the center.
  const std::string camera = "camera( name \"eye\" pose [0 0 3 0] alwayson 1 fov [60 60] pantilt ";
  const Scene down(camera + "[0 90] )" + Box("red", "0 0 0 0"), "eye");
  ExpectPixel(down.camera, 16, 16, kRed, 2.0);
  ExpectPixel(down.camera, 2, 2, kFloor, 3.0);
  ExpectPixel(down.camera, 31, 31, kFloor, 3.0);
  // With a tilt beyond the vertical, the upper edge of the image looks backwards.
  const Scene back(camera + "[0 120] )" + Box("red", "-1.5 0 0 0"), "eye");
  EXPECT_EQ(ColorAt(back.camera, 16, 16), kRed);
}

// ---- content of images

TEST(CameraTest, NearerBodiesHideFartherOnesInAnyOrder) {
  for (const bool near_first : {false, true}) {
    const std::string near = Box("green", "1.5 0 0 0", "0.2 0.1 1"), far = Box("red", "3 0 0 0");
    const Scene scene(Robot() + (near_first ? near + far : far + near));
    ExpectPixel(scene.camera, 16, 16, kGreen, 1.1);
    ExpectPixel(scene.camera, PixelX(0.18 / 2.5), 20, kRed, 2.5);
  }
}

TEST(CameraTest, OverlappingFacesBelongToTheOlderModel) {
  const Scene scene(Robot() + Box("green", "3 0 0 0") + Box("red", "3 0 0 0"));
  ExpectPixel(scene.camera, 16, 16, kGreen, 2.5);
}

TEST(CameraTest, ClipsAtItsPlanes) {
  const Scene far(Robot("range [0.2 2.4]") + Box("red", "3 0 0 0"));
  ExpectPixel(far.camera, 16, 16, kSky, 2.4);
  // The front is nearer than the near plane, so the back is seen from inside.
  const Scene near(Robot("range [2.6 8]") + Box("red", "3 0 0 0"));
  ExpectPixel(near.camera, 16, 16, kRed, 2.9);
}

TEST(CameraTest, WallsThatPassTheEyeAreClipped) {
  // A long wall on the right begins behind the camera.
  const Scene scene(Robot("resolution [32 32]") + Box("red", "0 -0.6 0 0", "12 0.2 1"));
  const double tangent = 31.0 / 32.0 * std::tan(dtor(35));
  ExpectPixel(scene.camera, 31, 16, kRed, 0.5 / tangent);
  ExpectPixel(scene.camera, 0, 16, kSky, kNothing);
}

TEST(CameraTest, SeesItsOwnTree) {
  // Looks down on its own robot from behind.
  const Scene scene(
      "position( name \"r\" size [0.3 0.3 0.22] color \"green\" camera( name \"eye\" "
      "pose [-1 0 1 0] pantilt [0 45] alwayson 1 ) )");
  EXPECT_EQ(ColorAt(scene.camera, 16, 16), kGreen);
}

TEST(CameraTest, SeesChildrenInsideAndOutsideOfTheirParent) {
  const Scene scene(Robot() +
                    "model( color \"green\" size [0.2 0.2 0.3] pose [9 0 0 0] model( "
                    "color \"red\" pose [-6 0 -0.3 0] size [0.4 0.4 1] ) )");
  ExpectPixel(scene.camera, 16, 16, kRed, 2.5);
}

TEST(CameraTest, SeesModelsTransparentForRangers) {
  const Scene scene(Robot() +
                    "model( color \"red\" size [0.4 0.4 1] pose [3 0 0 0] ranger_return -1 "
                    "obstacle_return 0 blob_return 0 )");
  ExpectPixel(scene.camera, 16, 16, kRed, 2.5);
}

TEST(CameraTest, SeesFlatZonesOnTheFloor) {
  const Scene scene(Robot("resolution [31 31] pantilt [0 45]") +
                    Box("green", "1 0 0 0", "2 2 0.01") + Box("blue", "-5 0 0 0"));
  ExpectPixel(scene.camera, 15, 15, kGreen, 0.41 / std::sin(dtor(45)));
}

TEST(CameraTest, SeesTheUndersideOfHangingModels) {
  const Scene scene(Robot("resolution [31 31] pantilt [0 -45]") +
                    Box("green", "1.3 0 1.42 0", "1 1 0.2"));
  ExpectPixel(scene.camera, 15, 15, kGreen, std::sqrt(2.0));
}

TEST(CameraTest, SeesABodyFromInside) {
  const std::string box = Box("green", "0 0 0 0", "2 2 2");
  const std::string camera = "camera( name \"eye\" pose [0 0 0.5 0] alwayson 1 pantilt [0 ";
  const Scene ahead(camera + "0] )" + box, "eye");
  ExpectPixel(ahead.camera, 16, 16, kGreen, 1.0);
  const Scene up(camera + "-90] )" + box, "eye");
  ExpectPixel(up.camera, 16, 16, kGreen, 1.5);
}

/// A body of the given blocks, seen from 3 m above its origin.
Scene FromAbove(const std::string& blocks) {
  return Scene(
      "camera( name \"eye\" pose [0 0 3.5 90] pantilt [0 90] fov [60 60] alwayson 1 )\n"
      "model( color \"red\" size [2 2 0.5] " +
          blocks + " )",
      "eye");
}

/// The pixel that shows a point of that body's top.
Pixel TopAt(const Scene& scene, double x, double y) {
  const double scale = 16 / (3 * std::tan(dtor(30)));
  return ColorAt(scene.camera, static_cast<int>(std::floor(16 + x * scale)),
                 static_cast<int>(std::floor(16 + y * scale)));
}

TEST(CameraTest, TopsMayBeConcave) {
  const Scene scene = FromAbove(
      "block( points 8 point[0] [-1 -1] point[1] [1 -1] point[2] [1 1] point[3] [0.5 1] point[4] "
      "[0.5 -0.5] point[5] [-0.5 -0.5] point[6] [-0.5 1] point[7] [-1 1] z [0 1] )");
  for (const double x : {-0.75, 0.75}) EXPECT_EQ(TopAt(scene, x, 0.5), kRed) << x;
  EXPECT_EQ(TopAt(scene, 0, -0.75), kRed);
  EXPECT_EQ(TopAt(scene, 0, 0.2), kFloor);
}

TEST(CameraTest, BlocksOfOneBodyMayOverlapAndDifferInHeight) {
  const std::string square =
      "points 4 point[0] [-1 -1] point[1] [1 -1] point[2] [1 1] point[3] "
      "[-1 1]";
  const std::string small =
      "points 4 point[0] [-0.5 -0.5] point[1] [0.5 -0.5] point[2] [0.5 0.5] "
      "point[3] [-0.5 0.5]";
  const Scene equal = FromAbove("block( " + square + " z [0 1] ) block( " + small + " z [0 1] )");
  EXPECT_EQ(TopAt(equal, 0, 0), kRed);
  EXPECT_NEAR(DepthAt(equal.camera, 16, 16), 3, 1e-5);
  const Scene stepped =
      FromAbove("block( " + square + " z [0 0.5] ) block( " + small + " z [0 1] )");
  EXPECT_NEAR(DepthAt(stepped.camera, 16, 16), 3, 1e-5);
  EXPECT_EQ(TopAt(stepped, 0.7, 0.7), kRed);
  EXPECT_NEAR(DepthAt(stepped.camera, 16 + 7, 16 + 7), 3.25, 1e-5);
}

TEST(CameraTest, ColoursAreRoundedAndCut) {
  const Scene scene(Robot() +
                    "model( size [0.4 0.4 1] pose [3 0 0 0] color_rgba [0.5 2 -1 0.25] )");
  EXPECT_EQ(ColorAt(scene.camera, 16, 16), (Pixel{128, 255, 0, 255}));
}

TEST(CameraTest, PicturesShowTheEndOfTheLastStep) {
  Scene scene(Robot() + "position( name \"m\" color \"red\" size [0.4 0.4 1] pose [3 0 0 0] )");
  ModelPosition& moving = *FindRunning<ModelPosition>(*scene.world, "m");
  moving.SetSpeed(-0.5, 0, 0);
  double last = 3;
  for (int i = 0; i < 5; i++) {
    Step(*scene.world);
    EXPECT_NEAR(DepthAt(scene.camera, 16, 16), last - 0.5, 1e-5);
    last = moving.GetPose().x;
  }
}

// ---- runs

std::string Crowd(int cameras) {
  std::string text;
  for (int i = 0; i < 40; i++)
    text +=
        "position( pose [" + std::to_string(i % 8 - 4) + " " + std::to_string(i / 8 - 2) + " 0 " +
        std::to_string(37 * i) + "] size [0.3 0.3 0.3] velocity [0.1 0 0 5] alwayson 1 " +
        (i < cameras ? "camera( pose [0 0 0.1 0] alwayson 1 resolution [40 30] )" : "") + " )\n";
  return text;
}

TEST(CameraTest, PicturesArePartOfTheStateHashAndRepeat) {
  std::vector<uint64_t> hashes;
  for (const int threads : {1, 4, 1}) {
    World::run_options.threads = threads;
    const auto world = LoadText(Crowd(5));
    Step(*world, 5);
    hashes.push_back(world->StateHash());
  }
  World::run_options.threads = 0;
  EXPECT_EQ(hashes[0], hashes[1]);
  EXPECT_EQ(hashes[0], hashes[2]);

  Scene scene(Robot() + "model( name \"b\" color \"red\" size [0.4 0.4 1] pose [3 0 0 0] )");
  Scene other(Robot() + "model( name \"b\" color \"red\" size [0.4 0.4 1] pose [3 0 0 0] )");
  Find(*other.world, "b")->SetColor(Color("blue"));
  Step(*scene.world);
  Step(*other.world);
  // From now on, only the images differ.
  Find(*other.world, "b")->SetColor(Color("red"));
  EXPECT_NE(scene.world->StateHash(), other.world->StateHash());
}

/// Allocations in ten steps of a world that has run for a while.
long AllocationsIn(const std::string& text) {
  const auto world = LoadText(text);
  Step(*world, 30);
  const long before = test::allocations;
  Step(*world, 10);
  return test::allocations - before;
}

TEST(CameraTest, TakesNoMoreMemoryOnceItRuns) {
  const std::string boxes = Box("red", "3 0 0 0") + Box("blue", "3 1 0 0");
  // The world itself may allocate memory.
  EXPECT_EQ(AllocationsIn(Robot("resolution [160 120]") + boxes),
            AllocationsIn("model( alwayson 1 )" + boxes));
}

}  // namespace
}  // namespace Stg
