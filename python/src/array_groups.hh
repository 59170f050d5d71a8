// SPDX-License-Identifier: GPL-2.0-or-later
//
// The groups of arrays of a crowd: for robot bodies, for worlds, and for sensors.

#ifndef STAGE_PYTHON_ARRAY_GROUPS_HH
#define STAGE_PYTHON_ARRAY_GROUPS_HH

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <limits>
#include <string>
#include <vector>

#include "crowd.hh"
#include "rows/robot_view.hh"
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
  /// Functions that write the row of `robot`, which is null if the robot is gone.
  struct Fills {
    void (*of_model)(const ModelPosition* robot, T* row);
    void (*of_row)(const rows::RobotView* robot, T* row);
    /// The row of mover `index` if rows are elements of a column; null: they are not.
    const void* (*in_column)(const rows::Columns& columns, size_t index) = nullptr;
  };

  /// `width`: elements per robot; 0 means one element without an axis. `runs`: the data is valid
  /// only while the robots update, so keep them subscribed.
  RobotArray(const std::vector<Members>& examples, size_t worlds, size_t width, Fills fills,
             bool runs)
      : fills_(fills), runs_(runs), bytes_(std::max<size_t>(width, 1) * sizeof(T)) {
    std::vector<size_t> shape{worlds, examples[0].robots.size()};
    if (width > 0) shape.push_back(width);
    array.Make<T>(shape);
  }
  void Prepare(size_t, const Members& members) override {
    if (!runs_) return;
    for (ModelPosition* robot : members.robots)
      if (robot) EnsureSubscribed(robot);
  }
  void Fill(size_t world, const Members& members, size_t begin, size_t end) override {
    for (size_t i = begin; i < end; i++) fills_.of_model(members.robots[i], array.Row<T>(world, i));
  }
  const RowPlan& PlanFor(const RowRobots& robots) override {
    return plans_.Get(*robots.scene, [&] {
      RowPlan plan{true, {}};
      for (const ModelPosition* robot : robots.models)
        if (runs_ && robot && !robot->HasSubscribers()) plan.needs.push_back(robot->GetId());
      return plan;
    });
  }
  void FillFromRow(size_t world, const RowOfCrowd& row) override {
    const size_t count = row.robots.movers.size();
    if (fills_.in_column && row.robots.follow_each_other) {
      const size_t first = row.row * row.robots.scene->movers.size() + row.robots.movers[0];
      std::memcpy(array.Row<T>(world, 0), fills_.in_column(row.rows.columns, first),
                  count * bytes_);
      return;
    }
    for (size_t i = 0; i < count; i++) {
      T* const to = array.Row<T>(world, i);
      if (row.robots.movers[i] == RowRobots::kNone) {
        fills_.of_row(nullptr, to);
        continue;
      }
      const rows::RobotView robot(row.rows, row.row, row.robots.movers[i]);
      fills_.of_row(&robot, to);
    }
  }
  void ForgetScenes() override { plans_.Clear(); }

  Array array;

 private:
  const Fills fills_;
  const bool runs_;
  const size_t bytes_;  // of a robot's row
  ByScene<RowPlan> plans_;
};

/// An array with one element per world.
template <typename T>
class WorldArray : public ArrayGroup {
 public:
  /// Writes the element of `world`, which is null if the world is gone.
  using FillNumber = void (*)(World* world, T* number);
  using FillNumberOfRow = void (*)(const RowOfCrowd& row, T* number);

  WorldArray(const std::vector<Members>&, size_t worlds, FillNumber fill, FillNumberOfRow of_row)
      : fill_(fill), of_row_(of_row) {
    array.Make<T>({worlds});
  }
  void Fill(size_t world, const Members& members, size_t begin, size_t) override {
    if (begin > 0) return;
    fill_(members.world, static_cast<T*>(array.data()) + world);
  }
  const RowPlan& PlanFor(const RowRobots&) override { return plan_; }
  void FillFromRow(size_t world, const RowOfCrowd& row) override {
    of_row_(row, static_cast<T*>(array.data()) + world);
  }

  Array array;

 private:
  const FillNumber fill_;
  const FillNumberOfRow of_row_;
  const RowPlan plan_{true, {}};
};

/// The readings of one sensor of each robot: of sensor number `index` of a type in its tree.
class SensorArrays : public ArrayGroup {
 public:
  /// `max_count`: detections per robot in the arrays of lists. Throws Failure if no robot has such
  /// a sensor.
  SensorArrays(const std::vector<Members>& examples, size_t worlds, const ModelType* type,
               size_t index, size_t max_count);
  void Find(size_t world, const Members& members) override;
  void Prepare(size_t world, const Members& members) override;
  void Fill(size_t world, const Members& members, size_t begin, size_t end) override;
  const RowPlan& PlanFor(const RowRobots& robots) override;
  void FillFromRow(size_t world, const RowOfCrowd& row) override;
  std::string WhyNoRoom(const Members& members) const override;
  void ForgetScenes() override { plans_.Clear(); }
  /// The array of a reading, or of "time", the times of the sensors' last updates. `*is_new` is set
  /// if it was made by this call and must be filled. Throws Failure if there is no such reading.
  const Array& ArrayOf(const std::string& reading, bool* is_new);

 private:
  /// How a reading is found in rows.
  enum class InRow { kTime, kRanges, kIntensities, kConstant, kOfFinder };
  struct ReadingArray {
    const Reading* reading;
    InRow in_row;
    ReadingShape space{};  // of a robot's row, fixed when the group is made
    Array array{};
  };
  /// Where the readings of the robots are in rows of a scene.
  struct Plan {
    RowPlan row;
    std::vector<SensorOfRow> sensors;  // by robot
    bool follow_each_other;            // the rays of each sensor are behind those of the last one
  };
  using Sensors = std::vector<Model*>;  // by robot; null: no such sensor
  Sensors SensorsOf(const Members& members) const;
  ReadingShape SpaceFor(const Reading& reading, const std::vector<Sensors>& examples) const;
  const Plan& SensorPlanFor(const RowRobots& robots);
  Plan MakePlan(const RowRobots& robots) const;
  InRow InRowOf(const Reading& reading) const;
  static bool FillRanges(const ReadingArray& of, size_t world, const Plan& plan,
                         const RowOfCrowd& row);
  static void FillFromSensor(const ReadingArray& of, const SensorOfRow& sensor,
                             const RowOfCrowd& row, void* to);
  static void FillFromRays(const ReadingArray& of, const SensorOfRow& sensor, const RowOfCrowd& row,
                           void* to);

  const ModelType* const type_;  // registered for good
  const size_t index_, max_count_, robots_;
  std::vector<Sensors> found_;  // by world; empty for those in rows
  ByScene<Plan> plans_;
  std::vector<ReadingArray> arrays_;
};

/// The n-th model of a type in a tree, in depth-first order from 0; null if there are too few. Each
/// model of the type that is passed decrements `*n`.
Model* FindInTree(const ModelType& type, Model* tree, size_t* n);
/// Enlarges a shape so that a reading of a sensor, which may be null, fits into it.
void MakeRoom(const Reading& reading, const Model* sensor, ReadingShape* space);
nanobind::dlpack::dtype DtypeOf(const Reading& reading);
/// The type of sensors of this name. Throws Failure if there is none.
const ModelType& SensorTypeOf(const std::string& name);

}  // namespace Stg::python

#endif
