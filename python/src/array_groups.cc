// SPDX-License-Identifier: GPL-2.0-or-later

#include "array_groups.hh"

#include <algorithm>
#include <string>

#include "finder_rows.hh"
#include "messages/assert.hh"

namespace Stg::python {

namespace {

ReadingShape ShapeOfTime(const Model&) { return ReadingShape(); }
bool CopyTime(const Model& sensor, size_t, double* to) {
  *to = static_cast<double>(sensor.GetLastUpdate()) / 1e6;
  return sensor.GetLastUpdate() > 0;
}
const Reading kTime = MakeReading("time", "s", "", ShapeOfTime, CopyTime);

}  // namespace

Model* FindInTree(const ModelType& type, Model* tree, size_t* n) {
  if (type.is(*tree) && (*n)-- == 0) return tree;
  for (Model* child : tree->GetChildren())
    if (Model* const found = FindInTree(type, child, n)) return found;
  return nullptr;
}

SensorOfRow FindSensorOfRow(const rows::Scene& scene, const ModelPosition* robot,
                            const ModelType& type, size_t index) {
  SensorOfRow found;
  if (robot) found.model = FindInTree(type, const_cast<ModelPosition*>(robot), &index);
  if (found.model && found.model->HasSubscribers()) found.rate = scene.RateOf(*found.model);
  for (const rows::Sensor& sensor : scene.sensors) {
    if (sensor.ranger != found.model) continue;
    if (found.count == 0) found.first = sensor.first_ray;
    found.count += sensor.rays;
  }
  if (found.model && IsFinderOfRows(type)) FindInFinders(scene.finders, &found);
  return found;
}

void MakeRoom(const Reading& reading, const Model* sensor, ReadingShape* space) {
  if (!sensor) return;
  const ReadingShape shape = reading.shape(*sensor);
  space->axes = shape.axes;
  for (size_t axis = 0; axis < shape.axes; axis++)
    space->lengths[axis] = std::max(space->lengths[axis], shape.lengths[axis]);
}

nanobind::dlpack::dtype DtypeOf(const Reading& reading) {
  const nanobind::dlpack::dtype dtypes[] = {nanobind::dtype<bool>(), nanobind::dtype<uint8_t>(),
                                            nanobind::dtype<int32_t>(), nanobind::dtype<float>(),
                                            nanobind::dtype<double>()};
  return dtypes[reading.element];
}

const ModelType& SensorTypeOf(const std::string& name) {
  for (const ModelType* type : SensorTypes())
    if (type->name == name) return *type;
  throw Failure{Kind::kStage, "there is no type of sensor called " + name};
}

SensorArrays::SensorArrays(const std::vector<Members>& examples, size_t worlds,
                           const ModelType* type, size_t index, size_t max_count)
    : type_(type),
      index_(index),
      max_count_(max_count),
      robots_(examples[0].robots.size()),
      found_(worlds) {
  std::vector<Sensors> sensors;
  for (const Members& members : examples) sensors.push_back(SensorsOf(members));
  const bool any = std::ranges::any_of(sensors, [](const Sensors& of) {
    return std::ranges::any_of(of, [](const Model* sensor) { return sensor != nullptr; });
  });
  if (!any)
    throw Failure{Kind::kGone, "no robot has a " + type->name + " number " + std::to_string(index)};
  arrays_.push_back({&kTime, InRow::kTime});
  for (const Reading& reading : type->readings)
    arrays_.push_back({&reading, InRowOf(reading), SpaceFor(reading, sensors)});
}

/// Readings that are constant are those of the prototype.
SensorArrays::InRow SensorArrays::InRowOf(const Reading& reading) const {
  if (type_->name != "ranger") return InRow::kOfFinder;
  return reading.name == "ranges"        ? InRow::kRanges
         : reading.name == "intensities" ? InRow::kIntensities
                                         : InRow::kConstant;
}

SensorArrays::Sensors SensorArrays::SensorsOf(const Members& members) const {
  Sensors sensors;
  for (ModelPosition* robot : members.robots) {
    size_t n = index_;
    sensors.push_back(robot ? FindInTree(*type_, robot, &n) : nullptr);
  }
  return sensors;
}

std::string SensorArrays::WhyNoRoom(const Members& members) const {
  const std::vector<Sensors> sensors{SensorsOf(members)};
  for (const ReadingArray& of : arrays_) {
    const ReadingShape needed = SpaceFor(*of.reading, sensors);
    for (size_t axis = 0; axis < needed.axes; axis++)
      if (needed.lengths[axis] > of.space.lengths[axis])
        return "the " + of.reading->name + " of its " + type_->name + " need " +
               std::to_string(needed.lengths[axis]) + " places, and the array has " +
               std::to_string(of.space.lengths[axis]);
  }
  return "";
}

void SensorArrays::Find(size_t world, const Members& members) {
  found_[world] = SensorsOf(members);
}

void SensorArrays::Prepare(size_t world, const Members&) {
  for (Model* sensor : found_[world])
    if (sensor) EnsureSubscribed(sensor);
}

void SensorArrays::Fill(size_t world, const Members&, size_t begin, size_t end) {
  for (size_t i = begin; i < end; i++)
    for (const ReadingArray& of : arrays_)
      if (of.array.exists())
        CopyReading(*of.reading, found_[world][i], of.space, of.array.Row(world, i));
}

const RowPlan& SensorArrays::PlanFor(const RowRobots& robots) { return SensorPlanFor(robots).row; }

const SensorArrays::Plan& SensorArrays::SensorPlanFor(const RowRobots& robots) {
  return plans_.Get(*robots.scene, [&] { return MakePlan(robots); });
}

/// Rows have the readings of rangers, bumpers, fiducial finders and blobfinders.
SensorArrays::Plan SensorArrays::MakePlan(const RowRobots& robots) const {
  Plan plan;
  plan.row.possible = type_->name == "ranger" || IsFinderOfRows(*type_);
  for (const ModelPosition* robot : robots.models) {
    plan.sensors.push_back(FindSensorOfRow(*robots.scene, robot, *type_, index_));
    const Model* const model = plan.sensors.back().model;
    if (model && !model->HasSubscribers()) plan.row.needs.push_back(model->GetId());
  }
  const SensorOfRow& first = plan.sensors[0];
  plan.follow_each_other = true;
  for (size_t i = 0; i < plan.sensors.size(); i++) {
    const SensorOfRow& sensor = plan.sensors[i];
    plan.follow_each_other = plan.follow_each_other && sensor.model && sensor.rate == first.rate &&
                             sensor.count == first.count &&
                             sensor.first == first.first + i * first.count;
  }
  return plan;
}

void SensorArrays::FillFromRow(size_t world, const RowOfCrowd& row) {
  const Plan& plan = SensorPlanFor(row.robots);
  for (const ReadingArray& of : arrays_) {
    if (!of.array.exists() || FillRanges(of, world, plan, row)) continue;
    for (size_t i = 0; i < plan.sensors.size(); i++)
      FillFromSensor(of, plan.sensors[i], row, of.array.Row(world, i));
  }
}

/// Copies the ranges of all robots at once. Returns false if that is impossible.
bool SensorArrays::FillRanges(const ReadingArray& of, size_t world, const Plan& plan,
                              const RowOfCrowd& row) {
  const SensorOfRow& first = plan.sensors[0];
  if (of.in_row != InRow::kRanges || !plan.follow_each_other || of.space.Count() != first.count ||
      !row.rows.HasReadings(row.row, first.rate))
    return false;
  const size_t ray = row.row * row.robots.scene->ray_count + first.first;
  std::copy_n(&row.rows.columns.ranges[ray], plan.sensors.size() * first.count,
              static_cast<double*>(of.array.Row(world, 0)));
  return true;
}

void SensorArrays::FillFromSensor(const ReadingArray& of, const SensorOfRow& sensor,
                                  const RowOfCrowd& row, void* to) {
  if (!sensor.model) return CopyReading(*of.reading, nullptr, of.space, to);
  switch (of.in_row) {
    case InRow::kTime: {
      const usec_t time = row.rows.LastUpdate(row.row, sensor.rate);
      *static_cast<double*>(to) = time > 0 ? static_cast<double>(time) / 1e6 : kNaN;
      return;
    }
    case InRow::kRanges:
    case InRow::kIntensities:
      return FillFromRays(of, sensor, row, to);
    case InRow::kConstant:
      return CopyReading(*of.reading, sensor.model, of.space, to);
    case InRow::kOfFinder:
      return FillFromFinder(*of.reading, sensor, row, of.space, to);
  }
}

/// Writes ranges or intensities.
void SensorArrays::FillFromRays(const ReadingArray& of, const SensorOfRow& sensor,
                                const RowOfCrowd& row, void* to) {
  const rows::Columns& columns = row.rows.columns;
  auto* const numbers = static_cast<double*>(to);
  const bool ranges = of.in_row == InRow::kRanges;
  const bool has_readings = row.rows.HasReadings(row.row, sensor.rate);
  const size_t first = row.row * row.robots.scene->ray_count + sensor.first;
  const size_t space = of.space.Count(), known = has_readings ? sensor.count : 0;
  STAGE_ASSERT(known <= space);
  if (ranges) std::copy_n(&columns.ranges[first], known, numbers);
  for (size_t ray = 0; !ranges && ray < known; ray++)
    numbers[ray] = row.robots.scene->brightness[columns.brightness[first + ray]];
  std::fill(numbers + known, numbers + space, kNaN);
}

const Array& SensorArrays::ArrayOf(const std::string& reading, bool* is_new) {
  const auto of = std::ranges::find_if(
      arrays_, [&](const ReadingArray& known) { return known.reading->name == reading; });
  if (of == arrays_.end())
    throw Failure{Kind::kStage, "a " + type_->name + " has no reading called " + reading};
  *is_new = !of->array.exists();
  if (*is_new) {
    std::vector<size_t> shape{found_.size(), robots_};
    shape.insert(shape.end(), of->space.lengths, of->space.lengths + of->space.axes);
    of->array.Make(shape, DtypeOf(*of->reading));
  }
  return of->array;
}

/// The shape into which the arrays of all sensors fit.
ReadingShape SensorArrays::SpaceFor(const Reading& reading,
                                    const std::vector<Sensors>& examples) const {
  ReadingShape space;
  for (const Sensors& sensors : examples)
    for (const Model* sensor : sensors) MakeRoom(reading, sensor, &space);
  if (reading.is_list) space.lengths[0] = max_count_;
  return space;
}

}  // namespace Stg::python
