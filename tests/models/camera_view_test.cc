// SPDX-License-Identifier: GPL-2.0-or-later
// The view parameters of a window, without drawing.
#include <gtest/gtest.h>

#include "support/model_testing.hh"

namespace Stg {
namespace {

TEST(CameraViewTest, DepthBufferToMetres) {
  PerspectiveCamera view;
  view.setClip(0.2, 8);
  EXPECT_NEAR(view.realDistance(0), 0.2, 1e-12);
  EXPECT_NEAR(view.realDistance(1), 8, 1e-12);
  EXPECT_NEAR(view.realDistance((1 / 0.2 - 1 / 2.5) / (1 / 0.2 - 1 / 8.0)), 2.5, 1e-12);
}

TEST(CameraViewTest, PerspectiveMoves) {
  PerspectiveCamera view;
  EXPECT_EQ(view.pitch(), 70);
  EXPECT_EQ(view.horizFov(), 70);
  EXPECT_EQ(view.nearClip(), 0.2);
  EXPECT_EQ(view.farClip(), 40);
  view.setPitch(90);
  view.setPose(1, 2, 3);
  view.forward(0.5);  // yaw 0: along +y
  EXPECT_NEAR(view.y(), 2.5, 1e-12);
  view.strafe(0.5);
  EXPECT_NEAR(view.x(), 1.5, 1e-12);
  view.setYaw(90);
  view.forward(1);
  EXPECT_NEAR(view.x(), 0.5, 1e-12);
  view.addPitch(500);
  EXPECT_EQ(view.pitch(), 180);
  view.addPose(0, 0, -10);
  EXPECT_EQ(view.z(), 0.1);
  view.reset();
  EXPECT_EQ(view.pitch(), 70);
  EXPECT_EQ(view.yaw(), 0);
}

TEST(CameraViewTest, OrthoZoomsAndPans) {
  OrthoCamera view;
  EXPECT_EQ(view.scale(), 15);
  view.move(30, 15);
  EXPECT_NEAR(view.x(), 2, 1e-12);
  EXPECT_NEAR(view.y(), 1, 1e-12);
  view.addPitch(200);
  EXPECT_EQ(view.pitch(), 90);
  view.move(0, 1);
  EXPECT_LE(view.y(), 101);
  view.reset();
  EXPECT_EQ(view.pitch(), 0);
  view.setPose(0, 0);
  view.scale(-1, 300, 400, 100, 400);  // around a point 100 pixels right of and above the center
  EXPECT_GT(view.scale(), 16);
  EXPECT_NEAR(view.x() + 100 / view.scale(), 100 / 15.0, 1e-9);
  EXPECT_NEAR(view.y() + 100 / view.scale(), 100 / 15.0, 1e-9);
  view.scale(1e9);
  view.scale(1e9);
  view.scale(1e9);
  view.scale(1e9);
  EXPECT_EQ(view.scale(), 1) << "zooming out has a limit";
}

TEST(CameraViewTest, LoadsAndSaves) {
  const auto world = LoadText(
      "window( pcam_loc [1 2 3] pcam_angle [60 30] center [4 5] rotate [6 7] "
      "scale 8 )");
  Worldfile* file = world->GetWorldFile();
  const int window = 1;
  PerspectiveCamera perspective;
  perspective.Load(file, window);
  EXPECT_EQ(perspective.y(), 2);
  EXPECT_EQ(perspective.pitch(), 60);
  EXPECT_EQ(perspective.yaw(), 30);
  OrthoCamera ortho;
  ortho.Load(file, window);
  EXPECT_EQ(ortho.x(), 4);
  EXPECT_EQ(ortho.pitch(), 6);
  EXPECT_EQ(ortho.scale(), 8);
  perspective.setPitch(45);
  ortho.setScale(20);
  perspective.Save(file, window);
  ortho.Save(file, window);
  PerspectiveCamera again;
  again.Load(file, window);
  EXPECT_EQ(again.pitch(), 45);
  OrthoCamera ortho_again;
  ortho_again.Load(file, window);
  EXPECT_EQ(ortho_again.scale(), 20);
}

TEST(CameraViewTest, OldPitchesAreUnderstood) {
  const auto world = LoadText("window( pcam_angle [4010.70 0] )");
  PerspectiveCamera view;
  view.Load(world->GetWorldFile(), 1);
  EXPECT_NEAR(view.pitch(), 70, 0.01);
}

}  // namespace
}  // namespace Stg
