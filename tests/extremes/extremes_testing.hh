// SPDX-License-Identifier: GPL-2.0-or-later
#ifndef STAGE_TESTS_EXTREMES_TESTING_HH
#define STAGE_TESTS_EXTREMES_TESTING_HH

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "support/device.hh"
#include "support/model_testing.hh"

/// What the tests of the extremes share. What they hold is promised in docs/extremes.md; figures
/// there are those that the tests record ("--gtest_output=xml:FILE" writes them down).
namespace Stg::extremes {

inline constexpr double kInfinity = std::numeric_limits<double>::infinity();
inline constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// The cells that may be used are those within +-kLastCell.
inline constexpr double kLastCell = (1 << 30) - 1;

/// How far, in cells, a reading may be from the closed form, measured across the face that is hit.
/// A face along an axis lies anywhere in its cells, and the middle of the way through such a cell
/// is read. A turned face is a path of cells: its corners lie anywhere in theirs (0.71 of a cell),
/// the path steps along the line (0.71), and the way through a cell may be at its far corner
/// (0.71).
inline constexpr double kStraightFace = 1.01, kTurnedFace = 2.2;

/// Cells that are so large, metres.
inline std::unique_ptr<World> WorldOfCells(double metres) {
  InitLibrary();
  return std::make_unique<World>("extremes", 1.0 / metres);
}

inline Model* AddBox(World* world, const Size& size, const Pose& pose) {
  Model* model = world->CreateModel(nullptr, "model");
  model->SetGeom(Geom(Pose(), size));
  model->SetPose(pose);
  return model;
}

inline bool Anything(Model*, const Model*, const void*) { return true; }

inline RaytraceResult LookFrom(World* world, const Pose& from, double range) {
  return world->Raytrace(from, range, Anything, nullptr, nullptr, false);
}

/// A ranger with a single sensor of a single sample, subscribed.
inline ModelRanger* AddRanger(World* world, const Pose& pose, double range) {
  auto* ranger = dynamic_cast<ModelRanger*>(world->CreateModel(nullptr, "ranger"));
  ranger->SetPose(pose);
  ModelRanger::Sensor sensor;
  sensor.size = Size(0, 0, 0);
  sensor.range.max = range;
  ranger->GetSensorsMutable().push_back(sensor);
  ranger->Subscribe();
  return ranger;
}

inline bool IsFinite(const Pose& p) {
  return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z) && std::isfinite(p.a);
}

/// The largest of what it is told.
class Worst {
 public:
  void Note(double error) { worst_ = std::max(worst_, std::fabs(error)); }
  double value() const { return worst_; }
  /// For docs/extremes.md.
  void Record(const char* name) const {
    char text[32];
    std::snprintf(text, sizeof text, "%.3g", worst_);
    testing::Test::RecordProperty(name, text);
  }

 private:
  double worst_ = 0;
};

}  // namespace Stg::extremes

#endif
