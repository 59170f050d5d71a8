// SPDX-License-Identifier: GPL-2.0-or-later

#include "recording/robots.hh"

#include <algorithm>
#include <map>
#include <set>
#include <typeinfo>
#include <unordered_map>

#include "geometry/trigonometry.hh"
#include "models/actuator.hh"
#include "recording/ros_names.hh"

namespace Stg::recording {

namespace {

/// Returns the topmost position that carries the model, or else the root of its tree.
Model* CarrierOf(Model* model) {
  Model *carrier = nullptr, *top = model;
  for (Model* m = model; m; m = m->Parent()) {
    if (dynamic_cast<ModelPosition*>(m)) carrier = m;
    top = m;
  }
  return carrier ? carrier : top;
}

bool IsMoved(const Model* sensor, const Model* robot) {
  for (const Model* m = sensor; m && m != robot; m = m->Parent())
    if (dynamic_cast<const ModelActuator*>(m) || dynamic_cast<const ModelPosition*>(m)) return true;
  return false;
}

/// Numbers rangers if there are several.
void NameScans(const std::string& prefix, std::vector<ScanSource>* scans) {
  const NamingScheme& scheme = NamingSchemes().front();
  std::vector<const ModelRanger*> rangers;
  for (const ScanSource& scan : *scans)
    if (rangers.empty() || rangers.back() != scan.ranger) rangers.push_back(scan.ranger);
  size_t index = 0;
  for (ScanSource& scan : *scans) {
    while (rangers[index] != scan.ranger) index++;
    const auto name = [&](const char* base) {
      return Joined(prefix, SensorName(scheme.Numbered(base, index, rangers.size()), scan.sensor));
    };
    scan.topic = "/" + name(kScanTopic);
    scan.frame = name(scheme.scan_frame);
  }
}

/// Numbers sensors of a type if there are several.
void NameSensors(const std::string& prefix, std::vector<SensorSource>* sensors) {
  const NamingScheme& scheme = NamingSchemes().front();
  std::map<const ModelType*, size_t> counts, numbers;
  for (const SensorSource& sensor : *sensors) counts[sensor.type]++;
  for (SensorSource& sensor : *sensors) {
    const std::string name =
        scheme.Numbered(RosName(sensor.type->name), numbers[sensor.type]++, counts[sensor.type]);
    sensor.topic = "/" + Joined(prefix, "readings/" + name);
  }
}

void NameRobot(const std::string& prefix, Robot* robot) {
  robot->topics = "/" + Joined(prefix, "");
  robot->odom_frame = Joined(prefix, kOdometryFrame);
  robot->footprint_frame = Joined(prefix, kFootprintFrame);
  robot->base_frame = Joined(prefix, kBaseFrame);
  NameScans(prefix, &robot->scans);
  NameSensors(prefix, &robot->sensors);
}

/// Models that are not robots always get a prefix. They are named last, so robots keep their names.
void NameAll(std::vector<Robot>* robots) {
  std::set<std::string> taken;
  for (const bool drives : {true, false}) {
    std::vector<Robot*> named;
    std::vector<std::string> tokens;
    for (Robot& robot : *robots) {
      if (drives != (robot.position != nullptr)) continue;
      named.push_back(&robot);
      tokens.push_back(robot.model->TokenStr());
    }
    const auto prefixes = NamingSchemes().front().Prefixes(tokens, !drives, &taken);
    for (size_t i = 0; i < named.size(); i++) NameRobot(prefixes[i], named[i]);
  }
}

/// Returns the type whose readings are logged besides scans, or null. Scans lack what sensors
/// respond, and what types derived from rangers measure.
const ModelType* ReadingsOf(const Model& model, const ModelRanger* ranger) {
  const ModelType* const type = FindSensorType(model);
  if (!ranger || !type || *type->of != typeid(ModelRanger)) return type;
  const auto responds = [](const ModelRanger::Sensor& sensor) { return sensor.response.exists(); };
  return std::ranges::any_of(ranger->GetSensors(), responds) ? type : nullptr;
}

}  // namespace

std::vector<Robot> RobotsOf(const std::vector<Model*>& models) {
  std::vector<Robot> robots;
  std::unordered_map<const Model*, size_t> places;
  for (Model* model : models) {
    auto* ranger = dynamic_cast<ModelRanger*>(model);
    const ModelType* const type = ReadingsOf(*model, ranger);
    const bool is_pushed = model->IsPushable() && !model->Parent();
    if (!ranger && !type && !is_pushed && !dynamic_cast<ModelPosition*>(model)) continue;
    Model* carrier = CarrierOf(model);
    const auto [place, is_new] = places.try_emplace(carrier, robots.size());
    if (is_new)
      robots.push_back({carrier, dynamic_cast<ModelPosition*>(carrier), "", "", "", "", {}, {}});
    if (type) robots[place->second].sensors.push_back({model, type, ""});
    if (!ranger) continue;
    for (uint32_t i = 0; i < ranger->GetSensors().size(); i++)
      robots[place->second].scans.push_back({ranger, i, "", "", IsMoved(ranger, carrier)});
  }
  NameAll(&robots);
  return robots;
}

Pose MountOf(const ScanSource& source, const Model& robot) {
  // Headings and positions are added up along the chain of parents, so that rounding does not
  // depend on where the robot is. A top-level ranger is its own robot.
  Pose below;
  for (const Model* m = source.ranger; m != &robot; m = m->Parent())
    below = m->GetSensedLocalPose() + below;
  const Pose frame = source.ranger->SensorFrame(below);
  const ModelRanger::Sensor& sensor = source.ranger->GetSensors()[source.sensor];
  Pose mount = ModelRanger::OriginOf(sensor, frame, SinCos(frame.a));
  // Heights depend on stacking, so they come from global poses.
  mount.z += source.ranger->GetSensedPose().z - robot.GetSensedPose().z - below.z;
  return mount;
}

}  // namespace Stg::recording
