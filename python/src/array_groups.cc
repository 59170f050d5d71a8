// SPDX-License-Identifier: GPL-2.0-or-later

#include "array_groups.hh"

namespace Stg::python {

namespace {

ReadingShape ShapeOfTime(const Model&) { return ReadingShape(); }
bool CopyTime(const Model& sensor, size_t, double* to) {
  *to = static_cast<double>(sensor.GetLastUpdate()) / 1e6;
  return sensor.GetLastUpdate() > 0;
}
const Reading kTime = MakeReading("time", "s", "", ShapeOfTime, CopyTime);

/// The n-th model of a type in a tree, in depth-first order from 0; null if there are too few. Each
/// model of the type that is passed decrements `*n`.
Model* FindInTree(const ModelType& type, Model* tree, size_t* n) {
  if (type.is(*tree) && (*n)-- == 0) return tree;
  for (Model* child : tree->GetChildren())
    if (Model* const found = FindInTree(type, child, n)) return found;
  return nullptr;
}

}  // namespace

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

SensorArrays::SensorArrays(const std::vector<Members>& members, const ModelType* type, size_t index,
                           size_t max_count)
    : type_(type), index_(index), max_count_(max_count), found_(members.size()) {
  bool any = false;
  for (size_t world = 0; world < members.size(); world++) {
    Find(world, members[world]);
    for (const Model* sensor : found_[world]) any = any || sensor;
  }
  if (!any)
    throw Failure{Kind::kGone, "no robot has a " + type->name + " number " + std::to_string(index)};
  arrays_.push_back({&kTime});
  for (const Reading& reading : type->readings) arrays_.push_back({&reading, SpaceFor(reading)});
}

void SensorArrays::Find(size_t world, const Members& members) {
  found_[world].clear();
  for (ModelPosition* robot : members.robots) {
    size_t n = index_;
    found_[world].push_back(robot ? FindInTree(*type_, robot, &n) : nullptr);
  }
}

void SensorArrays::Prepare(size_t world) {
  for (Model* sensor : found_[world])
    if (sensor) EnsureSubscribed(sensor);
}

void SensorArrays::Fill(size_t world, const Members&, size_t begin, size_t end) {
  for (size_t i = begin; i < end; i++)
    for (const ReadingArray& of : arrays_)
      if (of.array.exists())
        CopyReading(*of.reading, found_[world][i], of.space, of.array.Row(world, i));
}

const Array& SensorArrays::ArrayOf(const std::string& reading, bool* is_new) {
  const auto of = std::ranges::find_if(
      arrays_, [&](const ReadingArray& known) { return known.reading->name == reading; });
  if (of == arrays_.end())
    throw Failure{Kind::kStage, "a " + type_->name + " has no reading called " + reading};
  *is_new = !of->array.exists();
  if (*is_new) {
    std::vector<size_t> shape{found_.size(), found_[0].size()};
    shape.insert(shape.end(), of->space.lengths, of->space.lengths + of->space.axes);
    of->array.Make(shape, DtypeOf(*of->reading));
  }
  return of->array;
}

/// The shape into which the arrays of all sensors fit.
ReadingShape SensorArrays::SpaceFor(const Reading& reading) const {
  ReadingShape space;
  for (const std::vector<Model*>& sensors : found_)
    for (const Model* sensor : sensors) {
      if (!sensor) continue;
      const ReadingShape shape = reading.shape(*sensor);
      space.axes = shape.axes;
      for (size_t axis = 0; axis < shape.axes; axis++)
        space.lengths[axis] = std::max(space.lengths[axis], shape.lengths[axis]);
    }
  if (reading.is_list) space.lengths[0] = max_count_;
  return space;
}

}  // namespace Stg::python
