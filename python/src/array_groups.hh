// SPDX-License-Identifier: GPL-2.0-or-later
//
// The groups of arrays of a crowd: for robot bodies, for worlds, and for sensors.

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

/// The readings of one sensor of each robot: of sensor number `index` of a type in its tree.
class SensorArrays : public ArrayGroup {
 public:
  /// `max_count`: detections per robot in the arrays of lists. Throws Failure if no robot has such
  /// a sensor.
  SensorArrays(const std::vector<Members>& members, const ModelType* type, size_t index,
               size_t max_count);
  void Find(size_t world, const Members& members) override;
  void Prepare(size_t world) override;
  void Fill(size_t world, const Members& members, size_t begin, size_t end) override;
  /// The array of a reading, or of "time", the times of the sensors' last updates. `*is_new` is set
  /// if it was made by this call and must be filled. Throws Failure if there is no such reading.
  const Array& ArrayOf(const std::string& reading, bool* is_new);

 private:
  struct ReadingArray {
    const Reading* reading;
    ReadingShape space{};  // of a robot's row, fixed when the group is made
    Array array{};
  };
  ReadingShape SpaceFor(const Reading& reading) const;

  const ModelType* const type_;  // registered for good
  const size_t index_, max_count_;
  std::vector<std::vector<Model*>> found_;  // [world][robot]; null: no such sensor
  std::vector<ReadingArray> arrays_;
};

nanobind::dlpack::dtype DtypeOf(const Reading& reading);
/// The type of sensors of this name. Throws Failure if there is none.
const ModelType& SensorTypeOf(const std::string& name);

}  // namespace Stg::python

#endif
