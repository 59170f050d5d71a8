// SPDX-License-Identifier: GPL-2.0-or-later
//
// The blobfinder: the blobs that it detects.

#include <algorithm>
#include <cmath>

#include "blobfinder_testing.hh"
#include "support/crowd.hh"

namespace Stg {
namespace {

// ---- blobs as in Stage 4.3 ----------------------------------------------------------------------

std::string ReferenceWorld(const std::string& properties, const std::string& green) {
  return "position( name \"r\" size [0.3 0.3 0.22] blobfinder( name \"b\" " + properties +
         " ) )\n"
         "model( color \"red\" pose [3 0 0 0] size [0.4 0.4 0.5] )\n"
         "model( color \"green\" pose [3 1 0 0] size [0.4 0.4 0.5] obstacle_return 0"
         " ranger_return -1 " +
         green +
         " )\n"
         "model( color \"blue\" pose [3 -1 0 0] size [0.2 0.6 0.5] )\n"
         "model( color \"yellow\" pose [3 -1.6 0 0] size [0.2 0.6 0.5] )\n"
         "model( color \"cyan\" pose [0.6 0.3 1 0] size [0.2 0.2 0.1] )\n";
}

std::vector<Blob> ReferenceBlobs(const std::string& properties, const std::string& green) {
  const auto world = LoadText(ReferenceWorld(properties, green));
  const ModelBlobfinder* finder = FindRunning<ModelBlobfinder>(*world, "r.b");
  Step(*world);
  return finder->GetBlobs();
}

TEST(Reference, Defaults) {
  ExpectBlobs(ReferenceBlobs("", ""), {{"yellow", 72, 25, 79, 35, 3.267},
                                       {"blue", 57, 25, 70, 35, 3.064},
                                       {"red", 34, 24, 45, 36, 2.803},
                                       {"green", 20, 25, 21, 35, 3.211},
                                       {"cyan", 0, 3, 18, 57, 0.573}});
}

TEST(Reference, IgnoresModelsWithoutBlobReturn) {
  ExpectBlobs(ReferenceBlobs("", "blob_return 0"), {{"yellow", 72, 25, 79, 35, 3.267},
                                                    {"blue", 57, 25, 70, 35, 3.064},
                                                    {"red", 34, 24, 45, 36, 2.803},
                                                    {"cyan", 0, 3, 19, 57, 0.580}});
}

// The green blob is a side at an oblique angle, so one more ray changes its mean range.
TEST(Reference, ChosenColors) {
  ExpectBlobs(ReferenceBlobs("colors [\"blue\" \"green\"] colors_count 2 image [160 120] fov 90"
                             " pan -20 range 4",
                             ""),
              {{"blue", 67, 53, 86, 67, 3.067}, {"green", 18, 53, 19, 67, 3.202, 0.07}});
}

// ---- the model ----------------------------------------------------------------------------------

TEST(Blobfinder, DefaultsAreThoseOfStage) {
  const auto world = LoadText("blobfinder( name \"b\" )\nblobfinder( name \"c\" pose [1 0 0 0] )");
  const ModelBlobfinder* finder = Find<ModelBlobfinder>(*world, "b");
  EXPECT_EQ(finder->fov, M_PI / 3);
  EXPECT_EQ(finder->pan, 0);
  EXPECT_EQ(finder->range, 12);
  EXPECT_EQ(finder->scan_height, 60u);
  EXPECT_EQ(finder->scan_width, 80u);
  EXPECT_TRUE(finder->GetBlobs().empty());
  EXPECT_EQ(finder->GetGeom().size.x, 0.4);
  EXPECT_EQ(finder->GetGeom().size.y, 0.4);
  EXPECT_EQ(finder->GetGeom().size.z, 1.0);
  Find(*world, "c")->SetPose(Pose());
  EXPECT_FALSE(Find(*world, "c")->HasCollision());
}

TEST(Blobfinder, MayHaveABody) {
  Scene scene(Box("blue"),
              "block( points 4 point[0] [0 0] point[1] [1 0] point[2] [1 1] point[3] [0 1]"
              " z [0 1] )");
  ExpectOneBlob(&scene, "blue");
  EXPECT_TRUE(scene.world
                  ->Raytrace(
                      Pose(-2, 0, 0.5, 0), 5,
                      [](Model*, const Model*, const void*) { return true; }, nullptr, nullptr,
                      true)
                  .mod == scene.finder);
}

TEST(Blobfinder, PropertiesAreRead) {
  const auto world = LoadText(
      "unit_length 0.001\nunit_angle \"radians\"\n"
      "blobfinder( name \"b\" image [7 5] range 3.5 fov 1.5 pan -0.25 )");
  const ModelBlobfinder* finder = Find<ModelBlobfinder>(*world, "b");
  EXPECT_EQ(finder->scan_width, 7u);
  EXPECT_EQ(finder->scan_height, 5u);
  EXPECT_EQ(finder->range, 3.5);  // metres for any unit_length
  EXPECT_EQ(finder->fov, 1.5);
  EXPECT_EQ(finder->pan, -0.25);
}

// A subclass that exposes protected members.
class Probe : public ModelBlobfinder {
 public:
  Probe(World* w, Model* p, const std::string& t) : ModelBlobfinder(w, p, t) {}
  double Watts() const { return watts; }
};

TEST(Blobfinder, TakesTwoWattsWhileItRuns) {
  InitLibrary();
  Model::name_map["probe"] = [](World* w, Model* p, const std::string& t) -> Model* {
    return new Probe(w, p, t);
  };
  const auto world = LoadText("probe( name \"b\" watts 7 )");
  Probe* probe = Find<Probe>(*world, "b");
  EXPECT_EQ(probe->Watts(), 7);
  probe->Subscribe();
  EXPECT_EQ(probe->Watts(), 2);
  probe->Unsubscribe();
  EXPECT_EQ(probe->Watts(), 0);
  Model::name_map.erase("probe");
}

TEST(Blobfinder, SeesNothingWithoutSubscribers) {
  const auto world = LoadText("blobfinder( name \"b\" )\n" + Box("blue"));
  ModelBlobfinder* finder = Find<ModelBlobfinder>(*world, "b");
  Step(*world, 2);
  finder->Update();
  Step(*world);
  EXPECT_TRUE(finder->GetBlobs().empty());
  EXPECT_EQ(world->statistics().trace.rays, 0u);
}

TEST(Blobfinder, DropsItsBlobsAtShutdown) {
  Scene scene(Box("blue"));
  EXPECT_EQ(scene.Blobs().size(), 1u);
  scene.finder->Unsubscribe();
  EXPECT_TRUE(scene.finder->GetBlobs().empty());
  EXPECT_TRUE(scene.Blobs().empty());
  EXPECT_TRUE(scene.Blobs().empty());
  scene.finder->Subscribe();
  EXPECT_EQ(scene.Blobs().size(), 1u);
}

TEST(Blobfinder, DropsPendingRaysAtShutdown) {
  Scene scene(Box("blue"));
  scene.world->Enqueue(
      0, 100000, scene.finder, [](Model* m, void*) { return m->Unsubscribe(), 0; }, nullptr);
  EXPECT_TRUE(scene.Blobs().empty());
}

TEST(Blobfinder, KeepsItsBlobsBetweenUpdates) {
  Scene scene(Box("blue"), "update_interval 300");
  EXPECT_TRUE(scene.Blobs().empty());
  EXPECT_TRUE(scene.Blobs().empty());
  EXPECT_EQ(scene.Blobs().size(), 1u);
  Find(*scene.world, "blue")->SetColor(Color::green);
  EXPECT_EQ(scene.Blobs().at(0).color, Color::blue);
  EXPECT_EQ(scene.Blobs().at(0).color, Color::blue);
  EXPECT_EQ(scene.Blobs().at(0).color, Color::green);
}

TEST(Blobfinder, CallbacksSeeTheNewBlobs) {
  Scene scene(Box("blue"));
  size_t seen = 0;
  scene.finder->AddCallback(
      Model::CB_UPDATE,
      [](Model* m, void* user) {
        *static_cast<size_t*>(user) = static_cast<ModelBlobfinder*>(m)->GetBlobs().size();
        return 0;
      },
      &seen);
  Step(*scene.world);
  EXPECT_EQ(seen, 1u);
  scene.finder->GetBlobsMutable().clear();
  EXPECT_TRUE(scene.finder->GetBlobs().empty());
}

TEST(Blobfinder, CanBeDeletedWithPendingRays) {
  Scene scene(Box("blue") + "blobfinder( name \"c\" alwayson 1 )");
  scene.world->Enqueue(
      0, 100000, scene.finder, [](Model* m, void*) { return delete m, 0; }, nullptr);
  Step(*scene.world);
  EXPECT_EQ(Find<ModelBlobfinder>(*scene.world, "c")->GetBlobs().size(), 1u);
  Step(*scene.world);
  EXPECT_EQ(Find<ModelBlobfinder>(*scene.world, "c")->GetBlobs().size(), 1u);
}

// ---- visibility ---------------------------------------------------------------------------------

TEST(Sight, BlobIsAtThePositionOfTheModel) {
  Scene scene(Box("blue"));
  const Blob blob = scene.Blobs().at(0);
  // The face spans +-atan(1 / 2.5) = +-21.8 degrees; a pixel is 0.75 degrees.
  EXPECT_EQ(blob.left, 11u);
  EXPECT_EQ(blob.right, 69u);
  EXPECT_NEAR(blob.range, 2.58, kCell);
  // The angle is atan(0.3 / 2.58) = 6.6 degrees; a pixel is one degree.
  EXPECT_EQ(blob.top, 24u);
  EXPECT_EQ(blob.bottom, 36u);
}

TEST(Sight, TheLeftOfTheImageIsTheLeft) {
  Scene scene(Neighbours("color \"blue\"", "color \"green\""));
  const std::vector<Blob>& blobs = scene.Blobs();
  ASSERT_EQ(blobs.size(), 2u);
  EXPECT_EQ(blobs[0].color, Color::blue);
  EXPECT_EQ(blobs[1].color, Color::green);
  EXPECT_EQ(blobs[0].right, 80u);
  EXPECT_EQ(blobs[1].left, 0u);
  EXPECT_GT(blobs[0].left, blobs[1].right);
}

TEST(Sight, TouchingBlobsLeaveAGapOfOnePixel) {
  Scene scene(Neighbours("color \"blue\"", "color \"green\""));
  const std::vector<Blob>& blobs = scene.Blobs();
  ASSERT_EQ(blobs.size(), 2u);
  EXPECT_EQ(blobs[0].left - blobs[1].right, 2u);
}

TEST(Sight, GapAlsoBesideUnreportedColors) {
  Scene scene(Neighbours("color \"blue\"", "color \"green\""));
  const unsigned edge = scene.Blobs().at(1).right;
  scene.finder->AddColor(Color::green);
  ASSERT_EQ(scene.Blobs().size(), 1u);
  EXPECT_EQ(scene.finder->GetBlobs()[0].right, edge);
}

TEST(Sight, NeighbourOfOnePixelIsLost) {
  const std::string post = "model( color \"green\" pose [2.45 0 0 0] size [0.06 0.06 1] )\n";
  Scene alone(post, "fov 120");  // 64 mm per pixel at that distance
  ASSERT_EQ(alone.Blobs().size(), 1u);
  EXPECT_EQ(alone.finder->GetBlobs()[0].left, 40u);
  EXPECT_EQ(alone.finder->GetBlobs()[0].right, 40u);
  Scene scene(post + Box("blue"), "fov 120");
  const std::vector<Blob>& blobs = scene.Blobs();
  ASSERT_EQ(blobs.size(), 2u);
  EXPECT_EQ(blobs[0].color, Color::blue);
  EXPECT_EQ(blobs[1].color, Color::blue);
  EXPECT_EQ(blobs[0].left, 41u);
  EXPECT_EQ(blobs[1].right, 39u);
}

TEST(Sight, OpacityMakesNoDifference) {
  Scene scene(Neighbours("color_rgba [0 0 1 1]", "color_rgba [0 0 1 0.5]"));
  ASSERT_EQ(scene.Blobs().size(), 1u);
  EXPECT_EQ(scene.finder->GetBlobs()[0].left, 0u);
  EXPECT_EQ(scene.finder->GetBlobs()[0].right, 80u);
  scene.finder->AddColor(Color(0, 0, 1, 0.2));
  EXPECT_EQ(scene.Blobs().size(), 1u);
}

TEST(Sight, SlightlyDifferentColorsAreDistinct) {
  Scene same(Neighbours("color_rgba [0 0.5 1 1]", "color_rgba [0 0.500009 1 1]"));
  EXPECT_EQ(same.Blobs().size(), 1u);
  Scene other(Neighbours("color_rgba [0 0.5 1 1]", "color_rgba [0 0.50002 1 1]"));
  EXPECT_EQ(other.Blobs().size(), 2u);
}

TEST(Sight, OwnTreeIsTransparent) {
  const auto world = LoadText(
      "position( name \"r\" size [0.4 0.4 0.4] model( pose [0.4 0 -0.4 0] size [0.1 2 1]"
      " color \"yellow\" ) blobfinder( name \"b\" pose [0.1 0 0 0] ) )\n" +
      Box("blue"));
  const ModelBlobfinder* finder = FindRunning<ModelBlobfinder>(*world, "r.b");
  Step(*world);
  ASSERT_EQ(finder->GetBlobs().size(), 1u);
  EXPECT_EQ(finder->GetBlobs()[0].color, Color::blue);
}

TEST(Sight, HeightsMakeNoDifference) {
  for (const char* z : {"-10", "0", "3", "1000"}) {
    Scene scene("model( color \"blue\" pose [3 0 " + std::string(z) + " 0] size [1 2 0.01] )");
    ExpectOneBlob(&scene, "blue");
  }
}

TEST(Sight, OtherReturnsMakeNoDifference) {
  Scene scene(Box("blue", "obstacle_return 0 ranger_return -1 gripper_return 1 fiducial_key 3"));
  ExpectOneBlob(&scene, "blue");
}

TEST(Sight, ModelsWithoutBlobReturnAreTransparent) {
  Scene scene(Box("blue", "blob_return 0") +
              "model( color \"green\" pose [5 0 0 0] size [1 2 1] )");
  ExpectOneBlob(&scene, "green");
  Find(*scene.world, "blue")->SetBlobReturn(true);
  EXPECT_TRUE(std::any_of(scene.Blobs().begin(), scene.Blobs().end(),
                          [](const Blob& b) { return b.color == Color::blue; }));
  Find(*scene.world, "blue")->vis.blob_return = false;
  ExpectOneBlob(&scene, "green");
}

TEST(Sight, TheRangeIsALimit) {
  for (const double range : {2.4, 2.45, 2.55, 2.6, 12.0, kInfinity}) {
    Scene scene(Box("blue"));
    scene.finder->range = range;
    EXPECT_EQ(scene.Blobs().size(), range > 2.5 ? 1u : 0u) << range;
  }
}

TEST(Sight, PanTurnsTheView) {
  Scene scene("model( color \"blue\" pose [0 3 0 0] size [2 1 1] )", "pan 90");
  ExpectOneBlob(&scene, "blue");
  EXPECT_NEAR(scene.finder->GetBlobs()[0].left + scene.finder->GetBlobs()[0].right, 80, 2);
  scene.finder->pan = dtor(90 + 15);
  EXPECT_GT(scene.Blobs().at(0).left + scene.finder->GetBlobs()[0].right, 100u);
}

TEST(Sight, TheFieldOfViewCanBeChangedAtRunTime) {
  Scene scene(Box("blue"));
  EXPECT_EQ(scene.Blobs().at(0).left, 11u);
  scene.finder->fov = dtor(90);
  const Blob blob = scene.Blobs().at(0);
  EXPECT_GE(blob.left, 20u);  // 21.8 out of 45 degrees
  EXPECT_LE(blob.left, 21u);
  EXPECT_EQ(blob.bottom, 34u);  // 6.6 degrees; a pixel is 1.5 degrees
  scene.finder->scan_width = 41;
  EXPECT_LE(scene.Blobs().at(0).right, 40u);
}

TEST(Sight, RaysLeaveTheBodysOffset) {
  // The offset turns the view to the left and moves it to (1, 0).
  Scene scene("model( color \"blue\" pose [1 3 0 0] size [2 1 1] )", "origin [1 0 0 90]");
  ExpectOneBlob(&scene, "blue");
  const Blob blob = scene.finder->GetBlobs()[0];
  EXPECT_NEAR(blob.left + blob.right, 80, 2);
  EXPECT_NEAR(blob.range, 2.58, kCell);
}

TEST(Sight, SeesTheWorldAtTheStartOfTheStep) {
  Scene scene(
      "position( name \"p\" color \"blue\" pose [3 0 0 0] size [1 2 1] velocity_bounds"
      " [-9 9 -9 9 -9 9 -90 90] acceleration_bounds [-99 99 -9 9 -9 9 -90 90] )");
  ModelPosition* target = FindRunning<ModelPosition>(*scene.world, "p");
  target->SetSpeed(2, 0, 0);
  for (int i = 0; i < 5; i++) {
    const double face = target->GetPose().x - 0.5;
    const Blob blob = scene.Blobs().at(0);
    EXPECT_NEAR(blob.range, face * 1.03, 0.02 * face) << i;
  }
  EXPECT_GT(target->GetPose().x, 3.5);
}

// ---- edge cases ---------------------------------------------------------------------------------

TEST(EdgeCases, ImagesOfNoSize) {
  Scene scene(Box("blue"));
  EXPECT_EQ(scene.Blobs().size(), 1u);
  scene.finder->scan_width = 0;
  EXPECT_TRUE(scene.Blobs().empty());
  scene.finder->scan_width = 10;
  scene.finder->scan_height = 0;
  ASSERT_EQ(scene.Blobs().size(), 1u);
  EXPECT_EQ(scene.finder->GetBlobs()[0].top, 0u);
  EXPECT_EQ(scene.finder->GetBlobs()[0].bottom, 0u);
  scene.finder->scan_height = 1;
  EXPECT_LE(scene.Blobs().at(0).bottom, 1u);
}

TEST(EdgeCases, OnePixelLooksAhead) {
  Scene scene(Box("blue"));
  scene.finder->scan_width = 1;
  ASSERT_EQ(scene.Blobs().size(), 1u);
  EXPECT_EQ(scene.finder->GetBlobs()[0].left, 0u);
  EXPECT_EQ(scene.finder->GetBlobs()[0].right, 0u);
  EXPECT_NEAR(scene.finder->GetBlobs()[0].range, 2.5, kCell);
}

TEST(EdgeCases, NearThingsFillTheImageAndNoMore) {
  Scene scene("model( color \"blue\" size [0.2 0.2 1] )");
  ASSERT_EQ(scene.Blobs().size(), 1u);
  EXPECT_EQ(scene.finder->GetBlobs()[0].top, 0u);
  EXPECT_EQ(scene.finder->GetBlobs()[0].bottom, 60u);
}

TEST(EdgeCases, ZeroOrInvalidFieldsOfView) {
  for (const double fov : {0.0, kNaN, kInfinity}) {
    Scene scene(Box("blue"));
    scene.finder->fov = fov;
    ASSERT_EQ(scene.Blobs().size(), 1u) << fov;
    const Blob blob = scene.finder->GetBlobs()[0];
    EXPECT_EQ(blob.left, 0u);
    EXPECT_EQ(blob.right, 80u);
    EXPECT_EQ(blob.top, 0u);
    EXPECT_EQ(blob.bottom, 60u);
    EXPECT_NEAR(blob.range, 2.5, kCell);
  }
}

TEST(EdgeCases, ANegativeFieldOfViewReversesTheRow) {
  Scene scene(Neighbours("color \"blue\"", "color \"green\""), "fov -60");
  const std::vector<Blob>& blobs = scene.Blobs();
  ASSERT_EQ(blobs.size(), 2u);
  EXPECT_EQ(blobs[0].color, Color::green);
  EXPECT_EQ(blobs[0].right, 80u);
  EXPECT_LT(blobs[0].top, blobs[0].bottom);
}

TEST(EdgeCases, AllAround) {
  Scene scene("model( color \"blue\" size [4 4 1] )", "fov 360");
  ASSERT_EQ(scene.Blobs().size(), 1u);
  EXPECT_EQ(scene.finder->GetBlobs()[0].left, 0u);
  EXPECT_EQ(scene.finder->GetBlobs()[0].right, 80u);
}

TEST(EdgeCases, InvalidRanges) {
  for (const double range : {0.0, -1.0, kNaN}) {
    Scene scene("model( color \"blue\" size [0.1 0.1 1] )");
    scene.finder->range = range;
    EXPECT_TRUE(scene.Blobs().empty()) << range;
  }
}

TEST(EdgeCases, InvalidPans) {
  for (const double pan : {kNaN, kInfinity}) {
    Scene scene(Box("blue"));
    scene.finder->pan = pan;
    EXPECT_TRUE(scene.Blobs().empty()) << pan;
  }
}

// ---- ways of tracing ----------------------------------------------------------------------------

TEST(Tracing, ResultsDoNotDependOnTheMethod) {
  const auto robot = [](int i) {
    const char* const colors[] = {"red", "green", "blue", "yellow", "cyan"};
    const int column = i % 8, row = i / 8;
    return std::string("position( color \"") + colors[i % 5] + "\" pose [" +
           std::to_string(column * 1.3) + " " + std::to_string(row * 1.1) + " 0 " +
           std::to_string(i * 77 % 360) +
           "] size [0.4 0.4 0.4] alwayson 1 blobfinder( alwayson 1 ) )\n";
  };
  const auto look = [](const crowd::Robots& robots, std::vector<double>* all) {
    for (const ModelPosition* r : robots)
      for (const Blob& b : dynamic_cast<ModelBlobfinder*>(r->GetChildren()[0])->GetBlobs())
        for (const double value : {b.color.r, b.color.g, b.color.b, double(b.left), double(b.top),
                                   double(b.right), double(b.bottom), b.range})
          all->push_back(value);
  };
  const crowd::Outcome outcome = crowd::ExpectSameHoweverItIsRun(
      {crowd::Repeat(60, robot), 10, 0.5,
       [](size_t i) { return 0.1 * (static_cast<double>(i % 7) - 3); }, look});
  EXPECT_GT(outcome.sensed.size(), 8u * 600);
}

TEST(Tracing, TheStateHashCoversBlobs) {
  Scene scene(Box("blue"));
  Step(*scene.world);
  const uint64_t hash = scene.world->StateHash();
  scene.finder->GetBlobsMutable()[0].left++;
  EXPECT_NE(scene.world->StateHash(), hash);
}

}  // namespace
}  // namespace Stg
