// SPDX-License-Identifier: GPL-2.0-or-later
//
// The groups of arrays of a crowd: one for robot bodies, one for worlds, one per type of sensor.

#ifndef STAGE_PYTHON_ARRAY_GROUPS_HH
#define STAGE_PYTHON_ARRAY_GROUPS_HH

#include <algorithm>
#include <cstddef>
#include <limits>
#include <string>
#include <vector>

#include "crowd.hh"
#include "stage.hh"

namespace Stg::python {

inline constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// Subscribes to a model unless it has a subscriber, so that it updates and has readings. If it has
/// one already, reading it does not change the simulation.
inline void EnsureSubscribed(Model* model) {
  if (!model->HasSubscribers()) model->Subscribe();
}

/// An array with a row per robot, filled by a function.
template <typename T>
class RobotArray : public ArrayGroup {
 public:
  /// Writes the row of `robot`, which is null if the robot is gone.
  using FillRow = void (*)(const ModelPosition* robot, T* row);

  /// `width`: elements per robot; 0 means one element without an axis. `runs`: the data is valid
  /// only while the robots update, so keep them subscribed.
  RobotArray(const std::vector<Members>& members, size_t width, FillRow fill, bool runs)
      : fill_(fill), members_(members), runs_(runs) {
    std::vector<size_t> shape{members.size(), members[0].robots.size()};
    if (width > 0) shape.push_back(width);
    array.Make<T>(shape);
  }
  void Prepare(size_t world) override {
    if (!runs_) return;
    for (ModelPosition* robot : members_[world].robots)
      if (robot) EnsureSubscribed(robot);
  }
  void Fill(size_t world, const Members& members, size_t begin, size_t end) override {
    for (size_t i = begin; i < end; i++) fill_(members.robots[i], array.Row<T>(world, i));
  }

  Array array;

 private:
  const FillRow fill_;
  const std::vector<Members>& members_;  // owned by the crowd
  const bool runs_;
};

/// An array with one element per world.
template <typename T>
class WorldArray : public ArrayGroup {
 public:
  /// Writes the element of `world`, which is null if the world is gone.
  using FillNumber = void (*)(World* world, T* number);

  WorldArray(const std::vector<Members>& members, FillNumber fill) : fill_(fill) {
    array.Make<T>({members.size()});
  }
  void Fill(size_t world, const Members& members, size_t begin, size_t) override {
    if (begin > 0) return;
    fill_(members.world, static_cast<T*>(array.data()) + world);
  }

  Array array;

 private:
  const FillNumber fill_;
};

/// The n-th model of type T in a tree, in depth-first order from 0; null if there are too few. Each
/// model of type T that is passed decrements `*n`.
template <typename T>
T* FindInTree(Model* tree, size_t* n) {
  if (T* const found = dynamic_cast<T*>(tree))
    if ((*n)-- == 0) return found;
  for (Model* child : tree->GetChildren())
    if (T* const found = FindInTree<T>(child, n)) return found;
  return nullptr;
}

/// The arrays of one sensor of each robot: the sensor number `index` of type T in the robot's tree.
template <typename T>
class SensorArrays : public ArrayGroup {
 public:
  SensorArrays(const std::vector<Members>& members, size_t index)
      : found(members.size()), index_(index) {
    time.Make<double>({members.size(), members[0].robots.size()});
    for (size_t world = 0; world < members.size(); world++) Find(world, members[world]);
  }
  void Find(size_t world, const Members& members) final {
    found[world].clear();
    for (ModelPosition* robot : members.robots) {
      size_t n = index_;
      found[world].push_back(robot ? FindInTree<T>(robot, &n) : nullptr);
    }
  }
  /// The maximum of width(sensor). Throws Failure if no robot has such a sensor.
  template <typename F>
  size_t MaxWidth(const char* type, F width) const {
    size_t widest = 0;
    bool any = false;
    for (const std::vector<T*>& sensors : found)
      for (T* sensor : sensors) {
        if (!sensor) continue;
        any = true;
        widest = std::max<size_t>(widest, width(*sensor));
      }
    if (!any)
      throw Failure{Kind::kGone,
                    "no robot has a " + std::string(type) + " number " + std::to_string(index_)};
    return widest;
  }
  std::vector<size_t> Shape(size_t width) const { return {found.size(), found[0].size(), width}; }
  void Prepare(size_t world) final {
    for (T* sensor : found[world])
      if (sensor) EnsureSubscribed(sensor);
  }
  void Fill(size_t world, const Members&, size_t begin, size_t end) final {
    for (size_t i = begin; i < end; i++) {
      const T* const sensor = found[world][i];
      const usec_t updated = sensor ? sensor->GetLastUpdate() : 0;
      *time.template Row<double>(world, i) =
          updated > 0 ? static_cast<double>(updated) / 1e6 : kNaN;
      FillRow(world, i, found[world][i]);
    }
  }
  /// Writes the row of a robot; `sensor` is null if the robot has none.
  virtual void FillRow(size_t world, size_t robot, T* sensor) = 0;

  std::vector<std::vector<T*>> found;  ///< [world][robot]; null: no such sensor
  Array time;                          ///< time of the sensor's last update, seconds; NaN: none yet

 private:
  const size_t index_;
};

/// All samples of a ranger, sensor after sensor; NaN where there is no reading.
class RangerArrays : public SensorArrays<ModelRanger> {
 public:
  RangerArrays(const std::vector<Members>& members, size_t index);
  void FillRow(size_t world, size_t robot, ModelRanger* ranger) override;
  const size_t samples;
  Array ranges, intensities, bearings, origins;

 private:
  void FillDirections(size_t world, size_t robot, const ModelRanger& ranger) const;
};

/// The first `max_count` fiducials that a finder sees, in the order of creation; `count` may be
/// larger.
class FiducialArrays : public SensorArrays<ModelFiducial> {
 public:
  FiducialArrays(const std::vector<Members>& members, size_t index, size_t max_count);
  void FillRow(size_t world, size_t robot, ModelFiducial* finder) override;
  const size_t max_count;
  Array count, id, range, bearing, heading;
};

class BlobArrays : public SensorArrays<ModelBlobfinder> {
 public:
  BlobArrays(const std::vector<Members>& members, size_t index, size_t max_count);
  void FillRow(size_t world, size_t robot, ModelBlobfinder* finder) override;
  const size_t max_count;
  Array count, color, box, range;
};

/// Camera images, the top row first. An image smaller than the largest one is stored in the top
/// left corner.
class CameraArrays : public SensorArrays<ModelCamera> {
 public:
  CameraArrays(const std::vector<Members>& members, size_t index);
  /// Allocates `color` or `depth`.
  void Make(Array* array) const;
  void FillRow(size_t world, size_t robot, ModelCamera* camera) override;
  Array color, depth;

 private:
  size_t width_, height_;
};

class BumperArrays : public SensorArrays<ModelBumper> {
 public:
  BumperArrays(const std::vector<Members>& members, size_t index);
  void FillRow(size_t world, size_t robot, ModelBumper* bumper) override;
  Array hit;
};

}  // namespace Stg::python

#endif
