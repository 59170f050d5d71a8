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

/// Helpers for tests of extremes. The tests verify docs/extremes.md, whose figures they record
/// (--gtest_output=xml:FILE).
namespace Stg::extremes {

inline constexpr double kInfinity = std::numeric_limits<double>::infinity();
inline constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// Coordinates of usable cells are within +-kLastCell.
inline constexpr double kLastCell = (1 << 30) - 1;

/// Tolerances in cells of a reading with respect to the closed form, perpendicular to the face hit.
/// An axis-aligned face may be anywhere in its cells, and the reading is the middle of the path
/// through the cell. A rotated face is a path of cells: its corners may be anywhere in their cells
/// (0.71 of a cell), the path deviates from the line (0.71), and the ray may pass the far corner of
/// a cell (0.71).
inline constexpr double kStraightFace = 1.01, kTurnedFace = 2.2;

/// An empty world with cells of this size in metres.
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

/// Adds a subscribed ranger with one sensor of one sample.
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

/// The maximum absolute error.
class Worst {
 public:
  void Note(double error) { worst_ = std::max(worst_, std::fabs(error)); }
  double value() const { return worst_; }
  /// Records the value as a property of the test, for docs/extremes.md.
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
