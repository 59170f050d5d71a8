// SPDX-License-Identifier: GPL-2.0-or-later

#include "device_plan.hh"

#include <algorithm>

#include "array_groups.hh"
#include "failure.hh"
#include "models/position.hh"

namespace Stg::python {

namespace {

/// Makes a plan element by element.
class Planner {
 public:
  explicit Planner(std::vector<size_t> shape, double fill = kNaN) {
    plan_.shape = std::move(shape);
    plan_.fill.assign(plan_.Count(), fill);
  }

  /// Lets an element come from a place in a column.
  void Add(uint32_t kind, uint32_t column, size_t element, size_t place, bool of_readings = false) {
    PartFor(kind, column, of_readings)
        ->entries.push_back({static_cast<uint32_t>(element), static_cast<uint32_t>(place)});
  }
  void Fill(size_t element, double value) { plan_.fill[element] = value; }
  void Need(const Model* model) {
    if (!model->HasSubscribers()) plan_.needs.push_back(model->GetId());
  }
  /// Sets the values that bytes stand for.
  void SetValues(const std::vector<double>& values) {
    for (rows::RowPart& part : plan_.parts)
      if (part.array.kind == ROW_LOOKED_UP) part.values = values;
  }
  DevicePlan Take(uint32_t elements) {
    for (rows::RowPart& part : plan_.parts) part.array.elements = elements;
    return std::move(plan_);
  }
  DevicePlan Take() { return Take(static_cast<uint32_t>(plan_.Count())); }

 private:
  rows::RowPart* PartFor(uint32_t kind, uint32_t column, bool of_readings) {
    for (rows::RowPart& part : plan_.parts)
      if (part.array.kind == kind && part.array.column == column) return &part;
    rows::RowPart part;
    part.array.kind = kind;
    part.array.column = column;
    part.array.of_readings = of_readings;
    plan_.parts.push_back(std::move(part));
    return &plan_.parts.back();
  }

  DevicePlan plan_;
};

/// A robot that exists, while an array is planned.
struct Robot {
  const rows::Mover& mover;
  const ModelPosition& model;
  size_t number, place;  ///< in the crowd, and among the movers

  /// Adds three numbers from a column.
  void AddPlane(Planner* planner, uint32_t kind, uint32_t column) const {
    for (size_t i = 0; i < 3; i++) planner->Add(kind, column, 3 * number + i, 3 * place + i);
  }
};

template <typename F>
void ForEachRobot(const RowRobots& robots, F f) {
  for (size_t i = 0; i < robots.movers.size(); i++)
    if (robots.movers[i] != RowRobots::kNone)
      f(Robot{robots.scene->movers[robots.movers[i]], *robots.models[i], i, robots.movers[i]});
}

// See RobotView.

void PlanPose(const Robot& robot, Planner* planner) {
  robot.AddPlane(planner, ROW_NUMBERS, ROW_POSE);
}

void PlanVelocity(const Robot& robot, Planner* planner) {
  robot.AddPlane(planner, ROW_NUMBERS, ROW_VELOCITY);
}

void PlanActualVelocity(const Robot& robot, Planner* planner) {
  if (robot.mover.runs) return robot.AddPlane(planner, ROW_ACTUAL, ROW_VELOCITY);
  for (size_t i = 0; i < 3; i++) planner->Fill(3 * robot.number + i, 0);
}

void PlanEstimate(const Robot& robot, Planner* planner) {
  planner->Need(&robot.model);
  robot.AddPlane(planner, ROW_NUMBERS, robot.mover.has_odometry ? ROW_ESTIMATE : ROW_SENSED);
}

void PlanSensedPose(const Robot& robot, Planner* planner) {
  planner->Need(&robot.model);
  robot.AddPlane(planner, ROW_NUMBERS, ROW_SENSED);
}

void PlanSensedTime(const Robot& robot, Planner* planner) {
  planner->Need(&robot.model);
  planner->Add(ROW_SECONDS, ROW_LAST_UPDATE, robot.number, 0);
}

void PlanEnergy(const Robot& robot, const RowRobots& robots, Planner* planner) {
  const PowerPack* const pack = robot.model.FindPowerPack();
  for (size_t k = 0; k < robots.scene->packs.size(); k++)
    if (robots.scene->packs[k].pack == pack) planner->Add(ROW_NUMBERS, ROW_STORED, robot.number, k);
}

struct PlaneArray {
  const char* name;
  void (*plan)(const Robot& robot, Planner* planner);
};
constexpr PlaneArray kPlaneArrays[] = {
    {"pose", PlanPose},
    {"velocity", PlanVelocity},
    {"actual_velocity", PlanActualVelocity},
    {"estimate", PlanEstimate},
    {"sensed_pose", PlanSensedPose},
};

}  // namespace

DevicePlan PlanBody(const std::string& name, const RowRobots& robots) {
  const size_t count = robots.movers.size();
  for (const PlaneArray& known : kPlaneArrays) {
    if (name != known.name) continue;
    Planner planner({count, 3});
    ForEachRobot(robots, [&](const Robot& robot) { known.plan(robot, &planner); });
    return planner.Take();
  }
  Planner planner({count});
  if (name == "sensed_time") {
    ForEachRobot(robots, [&](const Robot& robot) { PlanSensedTime(robot, &planner); });
  } else if (name == "energy") {
    ForEachRobot(robots, [&](const Robot& robot) { PlanEnergy(robot, robots, &planner); });
  } else {
    throw Failure{Kind::kStage, "a batch on a device has no array called " + name +
                                    "; a batch without device= has it"};
  }
  return planner.Take();
}

DevicePlan PlanStalled(const RowRobots& robots) {
  Planner planner({robots.movers.size()}, 0);
  ForEachRobot(robots, [&](const Robot& robot) {
    planner.Add(ROW_FLAGS, ROW_STALLED, robot.number, robot.place);
  });
  return planner.Take();
}

DevicePlan PlanTime(const RowRobots&) {
  Planner planner({});
  planner.Add(ROW_SECONDS, ROW_TIME, 0, 0);
  return planner.Take();
}

DevicePlan PlanEnded(const RowRobots&) { return Planner({}, 0).Take(); }

DevicePlan PlanCommands(const RowRobots& robots) {
  Planner planner({robots.movers.size(), 3}, 0);
  ForEachRobot(robots, [&](const Robot& robot) {
    planner.Need(&robot.model);
    planner.Add(ROW_COMMANDS, ROW_COMMAND, robot.number, robot.place);
  });
  return planner.Take(static_cast<uint32_t>(robots.movers.size()));
}

namespace {

std::vector<SensorOfRow> FindRangers(const ModelType& type, size_t index, const RowRobots& robots) {
  std::vector<SensorOfRow> rangers;
  for (const ModelPosition* robot : robots.models)
    rangers.push_back(FindSensorOfRow(*robots.scene, robot, type, index));
  if (std::ranges::none_of(rangers, [](const SensorOfRow& of) { return of.model != nullptr; }))
    throw Failure{Kind::kGone, "no robot has a " + type.name + " number " + std::to_string(index)};
  return rangers;
}

/// Plans the times of the last updates.
DevicePlan PlanTimes(const std::vector<SensorOfRow>& rangers) {
  Planner planner({rangers.size()});
  for (size_t i = 0; i < rangers.size(); i++) {
    if (!rangers[i].model) continue;
    planner.Need(rangers[i].model);
    planner.Add(ROW_SECONDS, ROW_LAST_UPDATE, i, 0, true);
  }
  return planner.Take();
}

/// Plans a reading whose numbers do not change.
void FillReading(const Reading& reading, const ReadingShape& space,
                 const std::vector<SensorOfRow>& rangers, Planner* planner) {
  std::vector<double> numbers(space.Count());
  for (size_t i = 0; i < rangers.size(); i++) {
    CopyReading(reading, rangers[i].model, space, numbers.data());
    for (size_t k = 0; k < numbers.size(); k++) planner->Fill(i * numbers.size() + k, numbers[k]);
  }
}

void AddRays(bool ranges, size_t space, const std::vector<SensorOfRow>& rangers, Planner* planner) {
  for (size_t i = 0; i < rangers.size(); i++)
    for (size_t k = 0; k < rangers[i].count; k++)
      planner->Add(ranges ? ROW_NUMBERS : ROW_LOOKED_UP, ranges ? ROW_RANGES : ROW_BRIGHTNESS,
                   i * space + k, rangers[i].first + k, true);
}

}  // namespace

DevicePlan PlanReading(const ModelType& type, size_t index, const std::string& name,
                       const RowRobots& robots) {
  if (type.name != "ranger")
    throw Failure{Kind::kStage, "a batch on a device has no arrays of the sensor " + type.name +
                                    "; a batch without device= has them"};
  const std::vector<SensorOfRow> rangers = FindRangers(type, index, robots);
  if (name == "time") return PlanTimes(rangers);
  const auto reading = std::ranges::find(type.readings, name, &Reading::name);
  if (reading == type.readings.end() || reading->element != Reading::kDouble)
    throw Failure{Kind::kStage, "a " + type.name + " has no reading called " + name};
  ReadingShape space;
  for (const SensorOfRow& of : rangers) MakeRoom(*reading, of.model, &space);
  std::vector<size_t> shape{rangers.size()};
  shape.insert(shape.end(), space.lengths, space.lengths + space.axes);
  Planner planner(std::move(shape));
  for (const SensorOfRow& of : rangers)
    if (of.model) planner.Need(of.model);
  if (name == "ranges" || name == "intensities")
    AddRays(name == "ranges", space.Count(), rangers, &planner);
  else
    FillReading(*reading, space, rangers, &planner);
  planner.SetValues(robots.scene->brightness);
  return planner.Take();
}

}  // namespace Stg::python
