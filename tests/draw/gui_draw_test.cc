// SPDX-License-Identifier: GPL-2.0-or-later
//
// Copying a world into a scene for drawing.

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <cstdlib>
#include <new>

#include "gui/draw/performance_overlay.hh"
#include "gui/draw/render_scene.hh"
#include "models/body.hh"
#include "support/model_testing.hh"

// Counts allocations.
#pragma GCC diagnostic ignored "-Wmismatched-new-delete"

namespace {
std::atomic<size_t> allocations{0};
}

void* operator new(size_t bytes) {
  allocations++;
  if (void* memory = std::malloc(bytes ? bytes : 1)) return memory;
  throw std::bad_alloc();
}
void* operator new(size_t bytes, const std::nothrow_t&) noexcept {
  allocations++;
  return std::malloc(bytes ? bytes : 1);
}
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, size_t) noexcept { std::free(memory); }

namespace Stg::draw {

namespace {

using view::Show;

constexpr int kWidth = 400, kHeight = 300;  // at 15 pixels per metre: 26.7 x 20 m

struct Onlooker {
  view::ViewState view;
  RenderScene scene;
  Selection selection;

  const Frame& Look(World& world) {
    scene.Update(world, view, kWidth, kHeight, selection);
    return scene.frame();
  }
};

size_t Solid(const Frame& frame) {
  size_t count = 0;
  for (const BodyBatch& batch : frame.bodies) count += batch.solid.size() + batch.robots.size();
  return count;
}

std::vector<Instance> Instances(const Frame& frame) {
  std::vector<Instance> all;
  for (const BodyBatch& batch : frame.bodies)
    for (const auto* list : {&batch.solid, &batch.robots})
      all.insert(all.end(), list->begin(), list->end());
  return all;
}

double AreaOfTops(const Shape& shape) {
  double area = 0;
  for (size_t i = 0; i + 2 < shape.faces.size(); i += 3) {
    const Corner &a = shape.faces[i], &b = shape.faces[i + 1], &c = shape.faces[i + 2];
    area += std::fabs((b.x - a.x) * (c.y - a.y) - (c.x - a.x) * (b.y - a.y)) / 2;
  }
  return area;
}

// ---- bodies -------------------------------------------------------------------------------------

TEST(SceneTest, EqualBodiesShareAShape) {
  const auto world = LoadText(
      "model ( pose [1 2 0 90] size [1 1 1] ) model ( pose [-3 0 0.5 0] size [1 1 1] color "
      "\"blue\" )"
      "model ( pose [5 5 0 0] size [2 1 1] )");
  Onlooker onlooker;
  const Frame& frame = onlooker.Look(*world);
  ASSERT_EQ(frame.bodies.size(), 2u);
  ASSERT_EQ(frame.bodies[0].solid.size(), 2u);
  const Instance &first = frame.bodies[0].solid[0], &second = frame.bodies[0].solid[1];
  EXPECT_FLOAT_EQ(first.x, 1);
  EXPECT_FLOAT_EQ(first.y, 2);
  EXPECT_FLOAT_EQ(first.a, static_cast<float>(M_PI / 2));
  EXPECT_EQ(first.color, (Rgba{255, 0, 0, 255}));
  EXPECT_FLOAT_EQ(second.z, 0.5);
  EXPECT_EQ(second.color, (Rgba{0, 0, 255, 255}));
  EXPECT_NEAR(AreaOfTops(*frame.bodies[1].shape), 2, 1e-6);
}

TEST(SceneTest, OmitsModelsOutOfView) {
  const auto world = LoadText("model ( pose [0 0 0 0] ) model ( pose [100 0 0 0] )");
  Onlooker onlooker;
  EXPECT_EQ(Solid(onlooker.Look(*world)), 1u);
  onlooker.view.flat.setPose(100, 0);
  const Frame& there = onlooker.Look(*world);
  ASSERT_EQ(Solid(there), 1u);
  EXPECT_FLOAT_EQ(Instances(there)[0].x, 100);
  onlooker.view.flat.setScale(1);
  onlooker.view.flat.setPose(50, 0);
  EXPECT_EQ(Solid(onlooker.Look(*world)), 2u);
}

TEST(SceneTest, BodiesCanBeHiddenOrTransparent) {
  const auto world = LoadText(
      "model ( color_rgba [1 0 0 0.5] ) model ( color_rgba [1 0 0 0] pose [2 0 0 0] )"
      "model ( pose [4 0 0 0] )");
  Onlooker onlooker;
  const Frame& frame = onlooker.Look(*world);
  EXPECT_EQ(Solid(frame), 1u);
  ASSERT_EQ(frame.bodies[0].translucent.size(), 1u);
  EXPECT_EQ(frame.bodies[0].translucent[0].color.a, 128);
  onlooker.view.options.Set(Show::kBlocks, false);
  EXPECT_EQ(Solid(onlooker.Look(*world)), 0u);
}

TEST(SceneTest, ChildrenAreWhereTheirGlobalPosesAre) {
  const auto world = LoadText(
      "position ( name \"r\" pose [1 2 0.25 30] size [1 1 0.5]"
      "  model ( name \"c\" pose [0.3 0.4 0.1 45] size [0.2 0.2 0.2]"
      "    model ( name \"d\" pose [0.1 0 0 10] size [0.1 0.1 0.3] ) ) )");
  Onlooker onlooker;
  const std::vector<Instance> all = Instances(onlooker.Look(*world));
  ASSERT_EQ(all.size(), 3u);
  for (const char* name : {"r", "r.c", "r.c.d"}) {
    const Pose pose = Find<>(*world, name)->GetGlobalPose();
    const bool found = std::any_of(all.begin(), all.end(), [&](const Instance& i) {
      return std::fabs(i.x - pose.x) < 1e-5 && std::fabs(i.y - pose.y) < 1e-5 &&
             std::fabs(i.z - pose.z) < 1e-5 && std::fabs(i.a - pose.a) < 1e-5;
    });
    EXPECT_TRUE(found) << name;
  }
}

TEST(SceneTest, TowersAreInThePictureFromTheFirstFrame) {
  const auto world = LoadText("model ( size [1 1 500] ) model ( pose [0 0 300 0] )");
  Onlooker onlooker;
  const Frame& frame = onlooker.Look(*world);
  EXPECT_EQ(Solid(frame), 2u);
  const auto top = frame.projection->ToPixels({0, 0, 500});
  ASSERT_TRUE(top);
  EXPECT_GE(top->z, 0);
}

TEST(SceneTest, NewAndDeletedModelsAreNoticed) {
  const auto world = LoadText("model ()");
  Onlooker onlooker;
  EXPECT_EQ(Solid(onlooker.Look(*world)), 1u);
  Model* made = world->CreateModel(nullptr, "model");
  EXPECT_EQ(Solid(onlooker.Look(*world)), 2u);
  delete made;
  EXPECT_EQ(Solid(onlooker.Look(*world)), 1u);
}

TEST(SceneTest, ChangedBodiesGetNewShapes) {
  const auto world = LoadText("model ( name \"m\" size [1 1 1] )");
  Onlooker onlooker;
  EXPECT_NEAR(AreaOfTops(*onlooker.Look(*world).bodies[0].shape), 1, 1e-6);
  Find<>(*world, "m")->SetGeom(Geom(Pose(), Size(2, 3, 1)));
  double area = 0;
  for (const BodyBatch& batch : onlooker.Look(*world).bodies)
    if (!batch.solid.empty()) area += AreaOfTops(*batch.shape);
  EXPECT_NEAR(area, 6, 1e-6);
  size_t kept = 0;
  for (const BodyBatch& batch : onlooker.scene.frame().bodies) kept += batch.shape != nullptr;
  EXPECT_EQ(kept, 1u);
}

TEST(ShapeTest, BlocksOfDifferentHeightsAreEachFilled) {
  const auto world = LoadText(
      "model ( size [4 4 2]"
      " block ( points 4 point[0] [0 0] point[1] [4 0] point[2] [4 4] point[3] [0 4] z [0 1] )"
      " block ( points 4 point[0] [1 1] point[1] [3 1] point[2] [3 3] point[3] [1 3] z [1 2] ) )");
  Onlooker onlooker;
  EXPECT_NEAR(AreaOfTops(*onlooker.Look(*world).bodies[0].shape), 16 + 4, 1e-5);
}

/// A model like a picture frame: an outline inside another.
TEST(ShapeTest, HolesAreNotFilled) {
  const auto world = LoadText(
      "model ( size [4 4 1]"
      " block ( points 4 point[0] [0 0] point[1] [4 0] point[2] [4 4] point[3] [0 4] z [0 1] )"
      " block ( points 4 point[0] [1 1] point[1] [3 1] point[2] [3 3] point[3] [1 3] z [0 1] ) )");
  Onlooker onlooker;
  const Shape& shape = *onlooker.Look(*world).bodies[0].shape;
  EXPECT_NEAR(AreaOfTops(shape), 12, 1e-5);
  EXPECT_NEAR(shape.top, 1, 1e-6);
  EXPECT_NEAR(shape.radius, std::sqrt(4 + 4 + 1), 1e-6);
  EXPECT_EQ(shape.edges.size(), 2u * (8 + 8));  // edges of tops, and vertical ones
}

// ---- data ---------------------------------------------------------------------------------------

const char kRangers[] =
    "define eye ranger ( pose [0 0 -0.5 0] sensor ( range [0 5] fov 180 samples 7 pose [0 0 0.1 0] "
    ") )"
    "position ( name \"a\" eye ( name \"e\" ) ) position ( name \"b\" pose [2 0 0 180] eye () )"
    "position ( name \"far\" pose [200 0 0 0] eye () )";

TEST(SceneTest, FansAreOfSubscribedRangersInView) {
  const auto world = LoadText(kRangers);
  auto* eye = Find<ModelRanger>(*world, "a.e");
  eye->Subscribe();
  Find<>(*world, "far.ranger:0")->Subscribe();
  Onlooker onlooker;
  onlooker.view.options.Set(Show::kData, true);
  onlooker.Look(*world);
  EXPECT_EQ(onlooker.scene.fans_in_view(), 0u);  // the clock has not started
  Step(*world, 3);
  const Frame& frame = onlooker.Look(*world);
  ASSERT_EQ(onlooker.scene.fans_in_view(), 1u);
  const ModelRanger::Sensor& sensor = eye->GetSensors()[0];
  ASSERT_LT(sensor.ranges[3], 5);  // the other robot
  ASSERT_EQ(frame.ray_ends.size(), frame.fans[0].ray_ends);
  ASSERT_GE(frame.ray_ends.size(), 7u);  // none lies on a line between others, so none is omitted
  for (size_t i = 0; i < 7; i++) {
    EXPECT_NEAR(frame.ray_ends[i].x, sensor.ranges[i] * std::cos(sensor.bearings[i]), 1e-5);
    EXPECT_NEAR(frame.ray_ends[i].y, sensor.ranges[i] * std::sin(sensor.bearings[i]), 1e-5);
  }
  for (size_t i = 7; i < frame.ray_ends.size(); i++)
    EXPECT_EQ(frame.ray_ends[i].y, frame.ray_ends[6].y);
  onlooker.view.options.Set(Show::kRangerArea, false);
  onlooker.Look(*world);
  EXPECT_EQ(onlooker.scene.fans_in_view(), 0u);
}

TEST(SceneTest, SelectedOnlyHidesTheOthersData) {
  const auto world = LoadText(kRangers);
  for (const char* name : {"a.e", "b.ranger:0"}) Find<>(*world, name)->Subscribe();
  Step(*world, 3);
  Onlooker onlooker;
  onlooker.view.options.Set(Show::kData, true);
  onlooker.Look(*world);
  EXPECT_EQ(onlooker.scene.fans_in_view(), 2u);
  onlooker.view.options.Set(Show::kSelectedOnly, true);
  onlooker.Look(*world);
  EXPECT_EQ(onlooker.scene.fans_in_view(), 0u);
  onlooker.selection.last = Find<>(*world, "b");
  onlooker.Look(*world);
  ASSERT_EQ(onlooker.scene.fans_in_view(), 1u);
  EXPECT_FLOAT_EQ(onlooker.scene.frame().fans[0].fans[0].x, 2);
  onlooker.selection.models = {Find<>(*world, "a")};
  onlooker.Look(*world);
  EXPECT_FLOAT_EQ(onlooker.scene.frame().fans[0].fans[0].x, 0);
}

TEST(SceneTest, RaysOfTheSelectedRobotShowHitsAndLeaps) {
  const auto world = LoadText(kRangers);
  Find<>(*world, "a.e")->Subscribe();
  Step(*world, 3);
  Onlooker onlooker;
  onlooker.view.options.Set(Show::kRays, true);
  EXPECT_TRUE(onlooker.Look(*world).over.empty());
  onlooker.selection.last = Find<>(*world, "a");
  const Frame& frame = onlooker.Look(*world);
  EXPECT_GE(frame.over.lines.size(), 2u * 7);
  EXPECT_GE(frame.over.points.size(), 7u);
  const bool stopped =
      std::any_of(frame.over.triangles.begin(), frame.over.triangles.end(), [](const Vertex& v) {
        return v.color == Rgba{220, 0, 0, 255};
      });
  EXPECT_TRUE(stopped);
}

TEST(SceneTest, DrawsFullRaysOfUnsubscribedSensors) {
  const auto world = LoadText(kRangers);
  Step(*world, 3);
  ASSERT_TRUE(Find<ModelRanger>(*world, "b.ranger:0")->GetSensors()[0].ranges.empty());
  Onlooker onlooker;
  onlooker.view.options.Set(Show::kRays, true);
  onlooker.selection.last = Find<>(*world, "b");
  const Frame& frame = onlooker.Look(*world);
  EXPECT_GE(frame.over.lines.size(), 2u * 7);
  double farthest = 0;
  for (const Vertex& v : frame.over.lines)
    farthest = std::max(farthest, std::hypot(double{v.x} - 2, double{v.y}));
  EXPECT_GT(farthest, 2.5) << "behind the other robot";
}

// ---- trails -------------------------------------------------------------------------------------

TEST(SceneTest, FootprintsGetFainterWithAge) {
  const auto world =
      LoadText("position ( name \"r\" trail_length 4 trail_interval 1 velocity [1 0 0 0] )");
  world->RecordTrails(true);
  Find<>(*world, "r")->Subscribe();
  Onlooker onlooker;
  onlooker.view.options.Set(Show::kFootprints, true);
  onlooker.view.options.Set(Show::kTrailArrows, true);
  const auto footprints = [](const Frame& frame) { return frame.bodies[0].footprints; };
  EXPECT_TRUE(footprints(onlooker.Look(*world)).empty());  // unused items are not drawn
  Find<ModelPosition>(*world, "r")->SetXSpeed(1);
  Step(*world, 2);
  EXPECT_EQ(footprints(onlooker.Look(*world)).size(), 2u);
  Step(*world, 8);
  const std::vector<Instance> prints = footprints(onlooker.Look(*world));
  ASSERT_EQ(prints.size(), 4u);
  for (size_t i = 1; i < prints.size(); i++) {
    EXPECT_GT(prints[i].x, prints[i - 1].x);
    EXPECT_EQ(prints[i].z, 0);
    EXPECT_GT(prints[i].color.a, prints[i - 1].color.a);
  }
  EXPECT_EQ(prints.back().color.a, ColorByte(4 * 0.5 / 5));
  EXPECT_EQ(onlooker.scene.frame().solid.lines.size(), 4u * 3 * 2);  // arrows
}

// ---- flags and speech of models -----------------------------------------------------------------

TEST(SceneTest, SpeechFlagsAndStallIcons) {
  const auto world = LoadText("position ( name \"r\" say \"hello\" size [1 1 0.5] )");
  Model* robot = Find<>(*world, "r");
  Model::Flag red(Color::red, 0.5), blue(Color::blue, 0.25);
  robot->PushFlag(&red);
  robot->PushFlag(&blue);
  robot->SetStall(true);
  Onlooker onlooker;
  const Frame& frame = onlooker.Look(*world);
  ASSERT_EQ(frame.over.labels.size(), 1u);
  EXPECT_EQ(frame.over.TextOf(frame.over.labels[0]), "hello");
  EXPECT_EQ(frame.over.labels[0].kind, LabelKind::kBubble);
  ASSERT_EQ(frame.solid.lines.size(), 2u * 2 * 12);
  EXPECT_EQ(frame.solid.lines.front().color, (Rgba{255, 0, 0, 255}));  // the lowest flag
  EXPECT_FLOAT_EQ(frame.solid.lines.front().z, 1.0f);
  EXPECT_EQ(frame.solid.lines.back().color, (Rgba{0, 0, 255, 255}));
  ASSERT_EQ(frame.stalled.size(), 1u);
  EXPECT_NEAR(frame.stalled[0].z, 0.5 + 0.3 + 0.25, 1e-9);
  onlooker.view.options.Set(Show::kStatus, false);
  onlooker.view.options.Set(Show::kFlags, false);
  onlooker.Look(*world);
  EXPECT_TRUE(frame.over.labels.empty());
  EXPECT_TRUE(frame.stalled.empty());
  EXPECT_TRUE(frame.solid.lines.empty());
}

TEST(SceneTest, SelectedModelsAreMarkedAndNamed) {
  const auto world = LoadText("position ( name \"r1\" pose [3.7 -2.92 0 153.86] size [1 2 1] )");
  Onlooker onlooker;
  onlooker.selection.models = {Find<>(*world, "r1")};
  const Frame& frame = onlooker.Look(*world);
  ASSERT_EQ(frame.marks.triangles.size(), 6u);
  float reach = 0;
  for (const Vertex& v : frame.marks.triangles)
    reach = std::max(reach, std::hypot(v.x - 3.7f, v.y + 2.92f));
  EXPECT_NEAR(reach, 1.6 * std::hypot(0.5, 1.0), 1e-4);
  ASSERT_EQ(frame.over.labels.size(), 1u);
  EXPECT_EQ(frame.over.TextOf(frame.over.labels[0]), "r1 [3.70 -2.92 0.00 153.86]");
}

TEST(SceneTest, TheGroundHasNoBox) {
  const auto world = LoadText("model ()");
  Onlooker onlooker;
  onlooker.view.options.Set(Show::kBoundingBoxes, true);
  EXPECT_EQ(onlooker.Look(*world).solid.thick_lines.size(), 2u * 12);
}

TEST(SceneTest, AxisNumbersFollowTheScale) {
  const auto world = LoadText("model ()");
  Onlooker onlooker;
  const auto numbers = [&] {
    const Frame& frame = onlooker.Look(*world);
    std::vector<std::string> texts;
    for (const Label& label : frame.floor.labels) texts.emplace_back(frame.floor.TextOf(label));
    return texts;
  };
  const std::vector<std::string> at_15 = numbers();  // every 5 m, as 2 m are only 30 pixels
  EXPECT_NE(std::find(at_15.begin(), at_15.end(), "-5"), at_15.end());
  EXPECT_EQ(std::find(at_15.begin(), at_15.end(), "4"), at_15.end());
  onlooker.view.flat.setScale(60);
  const std::vector<std::string> at_60 = numbers();
  EXPECT_NE(std::find(at_60.begin(), at_60.end(), "1"), at_60.end());
  onlooker.view.options.Set(Show::kGrid, false);
  EXPECT_TRUE(numbers().empty());
}

TEST(SceneTest, OccupiedCellsCanBeSeen) {
  const auto world = LoadText("resolution 0.1 model ( size [1 1 1] )");
  Onlooker onlooker;
  onlooker.view.options.Set(Show::kOccupancy, true);
  const Frame& frame = onlooker.Look(*world);
  EXPECT_EQ(frame.floor.triangles.size() % 6, 0u);
  EXPECT_NEAR(static_cast<double>(frame.floor.triangles.size()) / 6, 40, 6);  // its outline
}

// ---- cost ---------------------------------------------------------------------------------------

TEST(SceneTest, SteadyFramesAllocateNothing) {
  std::string text(kRangers);
  for (int i = 0; i < 50; i++)
    text += "position ( pose [" + std::to_string(i % 10 - 5) + " " + std::to_string(i / 10 - 5) +
            " 0 0] eye () say \"x\" )";
  const auto world = LoadText(text);
  for (Model* model : world->GetAllModels())
    if (model != world->GetGround()) model->Subscribe();
  world->RecordTrails(true);
  Onlooker onlooker;
  for (const Show show : {Show::kData, Show::kFootprints, Show::kTrailArrows, Show::kRangerStrikes,
                          Show::kBoundingBoxes})
    onlooker.view.options.Set(show, true);
  Step(*world, 300);
  onlooker.Look(*world);
  onlooker.Look(*world);
  const size_t before = allocations;
  onlooker.Look(*world);
  EXPECT_EQ(allocations - before, 0u);
}

TEST(FiguresTest, ReportsAtOnceAndThenOncePerPeriod) {
  const auto world = LoadText("position ( name \"r\" ranger ( sensor () name \"e\" ) )");
  Find<>(*world, "r")->Subscribe();
  Find<>(*world, "r.e")->Subscribe();
  Step(*world, 5);
  PerformanceOverlay figures;
  figures.Update(*world, 100.0);
  ASSERT_FALSE(figures.lines().empty());
  EXPECT_NE(figures.lines()[0].find("1 robots, r_ACC"), std::string::npos) << figures.lines()[0];
  for (int i = 1; i <= 10; i++) {
    Step(*world);
    figures.Update(*world, 100.0 + i * 0.05);
  }
  EXPECT_NEAR(figures.frames_per_second(), 20, 0.01);
  EXPECT_NEAR(figures.speed(), 2.0, 0.01);  // one simulated second in half a second
}

}  // namespace

}  // namespace Stg::draw
