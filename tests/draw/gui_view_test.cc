// SPDX-License-Identifier: GPL-2.0-or-later
//
// Views of a world: the table of options, the window section, cameras and projection to pixels.

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <sstream>

#include "gui/view/projection.hh"
#include "gui/view/view_state.hh"
#include "random/random.hh"
#include "support/model_testing.hh"
#include "worldfile/worldfile.hh"

namespace Stg::view {

namespace {

std::unique_ptr<Worldfile> FileOf(const std::string& text) {
  auto file = std::make_unique<Worldfile>();
  std::istringstream content(text);
  file->Load(content, "t.world");
  return file;
}

TEST(ViewOptionsTest, HasTheDefaultsOfStage) {
  const ViewOptions options;
  for (const Show on : {Show::kBlocks, Show::kFlags, Show::kClock, Show::kGrid, Show::kStatus,
                        Show::kRanger, Show::kRangerArea, Show::kFiducials, Show::kWifi})
    EXPECT_TRUE(options[on]) << options.all()[static_cast<size_t>(on)].menu_name;
  for (const Show off :
       {Show::kData, Show::kFollow, Show::kFootprints, Show::kPerspective, Show::kOccupancy,
        Show::kBoundingBoxes, Show::kTrailFast, Show::kScreenshots, Show::kRangerStrikes,
        Show::kRangerFov, Show::kOverlay, Show::kRays})
    EXPECT_FALSE(options[off]) << options.all()[static_cast<size_t>(off)].menu_name;
}

TEST(ViewOptionsTest, EveryPropertyIsReadAndWritten) {
  const ViewOptions defaults;
  std::string text = "window (\n";
  for (const Option& option : defaults.all())
    text += "  " + option.property + (option.on ? " 0\n" : " 1\n");
  const std::unique_ptr<Worldfile> file = FileOf(text + ")\n");
  ViewState view;
  ASSERT_TRUE(view.Load(file.get()));
  for (size_t i = 0; i < defaults.all().size(); i++) {
    EXPECT_NE(view.options.all()[i].on, defaults.all()[i].on) << defaults.all()[i].property;
    view.options.Toggle(i);
  }
  view.Save(file.get());
  ViewState again;
  for (size_t i = 0; i < defaults.all().size(); i++) again.options.Toggle(i);
  ASSERT_TRUE(again.Load(file.get()));
  for (size_t i = 0; i < defaults.all().size(); i++)
    EXPECT_EQ(again.options.all()[i].on, defaults.all()[i].on) << defaults.all()[i].property;
}

TEST(ViewOptionsTest, VisualizersShareOptionsByMenuName) {
  ViewOptions options;
  const size_t first = options.Register("graph", "vis_graph", true);
  EXPECT_EQ(options.Register("graph", "other", false), first);
  EXPECT_TRUE(options.IsOn("graph"));
  options.Set(first, false);
  EXPECT_FALSE(options.IsOn("graph"));
  EXPECT_FALSE(options.IsOn("never heard of"));
  EXPECT_EQ(options.all()[first].property, "vis_graph");
}

TEST(ViewOptionsTest, FilterOffersWhatTheWorldHasByName) {
  const auto world = LoadText("position ( name \"r\" ranger ( sensor () ) ) fiducial ()");
  ViewOptions options;
  options.OfferSwitchesFor(*world);
  std::vector<std::string> names;
  for (const size_t i : options.Filter()) names.push_back(options.all()[i].menu_name);
  const std::vector<std::string> expected = {
      "Fiducial FOV", "Fiducials",   "Position coordinates", "Position waypoints", "Ranger",
      "Ranger FOV",   "Ranger area", "Ranger strikes",       "Ranger transducers", "Rasterization"};
  EXPECT_EQ(names, expected);
}

TEST(ViewStateTest, ReadsTheWindowSection) {
  ViewState view;
  const auto file = FileOf(
      "window ( size [635 666] center [1 -2] rotate [30 40] scale 37 pcam_loc [1 2 3]"
      " pcam_angle [60 10] interval 20 screenshot_skip 3 follow_model \"r0\" pcam_on 1 )");
  ASSERT_TRUE(view.Load(file.get()));
  EXPECT_EQ(view.width, 635);
  EXPECT_EQ(view.height, 666);
  EXPECT_EQ(view.flat.x(), 1);
  EXPECT_EQ(view.flat.y(), -2);
  EXPECT_EQ(view.flat.pitch(), 30);
  EXPECT_EQ(view.flat.yaw(), 40);
  EXPECT_EQ(view.flat.scale(), 37);
  EXPECT_EQ(view.perspective.z(), 3);
  EXPECT_EQ(view.perspective.pitch(), 60);
  EXPECT_EQ(view.interval, 20);
  EXPECT_EQ(view.screenshot_skip, 3);
  EXPECT_EQ(view.follow_model, "r0");
  EXPECT_EQ(&view.camera(), &view.perspective);
}

TEST(ViewStateTest, DefaultsWithoutASection) {
  ViewState view;
  EXPECT_FALSE(view.Load(FileOf("model ()").get()));
  EXPECT_EQ(view.flat.scale(), 15);
  EXPECT_EQ(view.perspective.y(), -4);
  EXPECT_EQ(view.perspective.z(), 3);
  EXPECT_EQ(view.perspective.pitch(), 70);
  EXPECT_EQ(view.interval, 40);
}

TEST(ViewStateTest, CorrectsInvalidValues) {
  ViewState view;
  view.Load(FileOf("window ( size [-1 3] interval -5 screenshot_skip 0 )").get());
  EXPECT_EQ(view.width, -1);
  EXPECT_EQ(view.height, ViewState::kMinSize);
  EXPECT_EQ(view.interval, 1);
  EXPECT_EQ(view.screenshot_skip, 1);
}

TEST(ViewStateTest, SavingChangesOnlyExistingProperties) {
  const auto file = FileOf("window ( scale 10 show_data 0 )");
  ViewState view;
  view.Load(file.get());
  view.flat.setScale(20);
  view.flat.setPose(5, 6);
  view.options.Set(Show::kData, true);
  view.Save(file.get());
  EXPECT_EQ(file->ReadFloat(1, "scale", 0), 20);
  EXPECT_EQ(file->ReadInt(1, "show_data", 0), 1);
  EXPECT_FALSE(file->PropertyExists(1, "center"));
  EXPECT_FALSE(file->PropertyExists(1, "show_grid"));
}

TEST(ViewStateTest, FollowingPutsTheCameraOnTheModel) {
  ViewState view;
  view.flat.setYaw(33);
  view.Follow(Pose(3, 4, 0, M_PI / 2));
  EXPECT_EQ(view.flat.x(), 3);
  EXPECT_EQ(view.flat.y(), 4);
  EXPECT_EQ(view.flat.yaw(), 33);
  view.options.Set(Show::kPerspective, true);
  view.Follow(Pose(3, 4, 1, M_PI / 2));
  EXPECT_NEAR(view.perspective.z(), 1.2, 1e-12);
  EXPECT_NEAR(view.perspective.yaw(), 0, 1e-12);  // along +y
}

// ---- pixels -------------------------------------------------------------------------------------

const bounds3d_t kReach(Bounds(-30, 30), Bounds(-30, 30), Bounds(0, 5));

TEST(ProjectionTest, AMapOf16MetresSpans592PixelsAt37) {
  ViewState view;
  view.flat.setScale(37);
  const Projection p(view, 635, 636, kReach);
  const auto left = p.ToPixels({-8, 0, 0}), right = p.ToPixels({8, 0, 0});
  EXPECT_NEAR(right->x - left->x, 592, 1e-6);
  EXPECT_NEAR(p.ToPixels({0, 0, 0})->x, 317.5, 1e-9);
  EXPECT_NEAR(p.ToPixels({0, 1, 0})->y, 318 + 37, 1e-9);  // +y is up
  EXPECT_NEAR(p.PixelAt({0, 0, 0}), 1.0 / 37, 1e-12);
}

TEST(ProjectionTest, TiltedToTheHorizonZIsUp) {
  ViewState view;
  view.flat.setPitch(90);
  const Projection p(view, 400, 300, kReach);
  EXPECT_NEAR(p.ToPixels({0, 0, 2})->y, 150 + 30, 1e-9);
  EXPECT_NEAR(p.ToPixels({0, 5, 0})->y, 150, 1e-9);
  EXPECT_GT(p.ToPixels({0, 5, 0})->z, p.ToPixels({0, -5, 0})->z);  // farther
  EXPECT_FALSE(p.FloorPoint(200, 150).has_value());
}

TEST(ProjectionTest, ThePerspectiveCameraSeesWhatIsAhead) {
  ViewState view;
  view.options.Set(Show::kPerspective, true);
  view.perspective.setPose(0, 0, 1);
  view.perspective.setPitch(90);  // level, along +y
  const Projection p(view, 200, 100, kReach);
  const auto ahead = p.ToPixels({0, 10, 1});
  ASSERT_TRUE(ahead);
  EXPECT_NEAR(ahead->x, 100, 1e-6);
  EXPECT_NEAR(ahead->y, 50, 1e-6);
  EXPECT_FALSE(p.ToPixels({0, -10, 1}));
  EXPECT_TRUE(p.Sees(0, 10, 1, 0.1));
  EXPECT_FALSE(p.Sees(0, -10, 1, 0.1));
  EXPECT_FALSE(p.Sees(0, 50, 1, 0.1));  // beyond the far plane
  // The vertical field of view is 70 degrees.
  EXPECT_NEAR(p.ToPixels({0, 10, 1 + 10 * std::tan(dtor(35))})->y, 100, 1e-6);
  EXPECT_GT(p.ToPixels({1, 10, 1})->x, 100);  // +x is to the right
}

ViewState RandomView(RandomStream* random) {
  ViewState view;
  view.flat.setPose(random->Uniform(-9, 9), random->Uniform(-9, 9));
  view.flat.setScale(random->Uniform(2, 90));
  view.flat.setPitch(random->Uniform(0, 80));
  view.flat.setYaw(random->Uniform(-180, 180));
  view.perspective.setPose(random->Uniform(-9, 9), random->Uniform(-9, 9), random->Uniform(1, 9));
  view.perspective.setPitch(random->Uniform(0, 50));  // below the horizon
  view.perspective.setYaw(random->Uniform(-180, 180));
  return view;
}

TEST(ProjectionTest, FloorPointsRoundTrip) {
  RandomStream random(1);
  for (int i = 0; i < 400; i++) {
    ViewState view = RandomView(&random);
    view.options.Set(Show::kPerspective, i % 2 == 1);
    const int width = 100 + i, height = 300;
    const Projection p(view, width, height, kReach);
    const double x = random.Uniform(0, width), y = random.Uniform(0, height);
    const double z = random.Uniform(0, 0.5);
    const auto floor = p.FloorPoint(x, y, z);
    ASSERT_TRUE(floor) << i;
    const auto back = p.ToPixels({floor->x, floor->y, z});
    ASSERT_TRUE(back) << i;
    EXPECT_NEAR(back->x, x, 1e-5) << i;
    EXPECT_NEAR(height - back->y, y, 1e-5) << i;
  }
}

TEST(ProjectionTest, PointsInThePictureAreNotCulled) {
  RandomStream random(2);
  int in = 0, culled = 0;
  for (int i = 0; i < 4000; i++) {
    ViewState view = RandomView(&random);
    view.options.Set(Show::kPerspective, i % 2 == 1);
    const Projection p(view, 320, 240, kReach);
    const point3_t point(random.Uniform(-30, 30), random.Uniform(-30, 30), random.Uniform(0, 3));
    const auto at = p.ToPixels(point);
    const bool inside =
        at && at->x >= 0 && at->x <= 320 && at->y >= 0 && at->y <= 240 && at->z >= 0 && at->z <= 1;
    in += inside;
    if (inside) {
      EXPECT_TRUE(p.Sees(point.x, point.y, point.z, 1e-6)) << i;
    }
    culled += !p.Sees(point.x, point.y, point.z, 0.5);
    if (!inside) {
      EXPECT_FALSE(p.Sees(point.x, point.y, point.z, -1e-6)) << i;
    }
  }
  EXPECT_GT(in, 200);
  EXPECT_GT(culled, 1000);
}

TEST(ViewStateTest, ShowAllFillsMostOfTheCanvas) {
  ViewState view;
  view.ShowAll(Bounds(-2, 10), Bounds(1, 4), 600, 300);
  const Projection p(view, 600, 300, kReach);
  EXPECT_NEAR(p.ToPixels({-2, 1, 0})->x, 30, 1e-6);
  EXPECT_NEAR(p.ToPixels({10, 1, 0})->x, 570, 1e-6);
}

}  // namespace

}  // namespace Stg::view
