// SPDX-License-Identifier: GPL-2.0-or-later

#include "recording/robots.hh"

#include <cctype>
#include <set>
#include <unordered_map>

#include "geometry/trigonometry.hh"
#include "models/actuator.hh"

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

/// Reduces a name to letters, digits and single underscores that do not start with a digit.
std::string RosName(const std::string& token) {
  std::string name;
  for (const char c : token) {
    const bool allowed = std::isalnum(static_cast<unsigned char>(c)) != 0;
    if (allowed || (!name.empty() && name.back() != '_')) name += allowed ? c : '_';
  }
  if (!name.empty() && name.back() == '_') name.pop_back();
  if (name.empty()) return "robot";
  return std::isdigit(static_cast<unsigned char>(name[0])) ? "_" + name : name;
}

/// Returns a name that is not taken yet, and marks it as taken.
std::string FreeName(const std::string& token, std::set<std::string>* taken) {
  const std::string name = RosName(token);
  std::string free = name;
  for (int i = 2; !taken->insert(free).second; i++) free = name + "_" + std::to_string(i);
  return free;
}

/// Numbers rangers if there are several. The first sensor of a ranger has the ranger's name.
void NameScans(const std::string& prefix, std::vector<ScanSource>* scans) {
  std::vector<const ModelRanger*> rangers;
  for (const ScanSource& scan : *scans)
    if (rangers.empty() || rangers.back() != scan.ranger) rangers.push_back(scan.ranger);
  size_t index = 0;
  for (ScanSource& scan : *scans) {
    while (rangers[index] != scan.ranger) index++;
    const std::string number = rangers.size() > 1 ? std::to_string(index) : "";
    const std::string part = scan.sensor > 0 ? "_sensor_" + std::to_string(scan.sensor) : "";
    scan.topic = "/" + prefix + "base_scan" + number + part;
    scan.frame = prefix + "base_scan_link" + number + part;
  }
}

void NameRobot(const std::string& prefix, Robot* robot) {
  robot->topics = "/" + prefix;
  robot->odom_frame = prefix + "odom";
  robot->footprint_frame = prefix + "base_footprint";
  robot->base_frame = prefix + "base_link";
  NameScans(prefix, &robot->scans);
}

/// Models that are not robots always get a prefix. They are named last, so robots keep their names.
void NameAll(std::vector<Robot>* robots) {
  size_t count = 0;
  for (const Robot& robot : *robots) count += robot.position != nullptr;
  std::set<std::string> taken;
  for (const bool drives : {true, false})
    for (Robot& robot : *robots) {
      if (drives != (robot.position != nullptr)) continue;
      const bool only = drives && count == 1;
      NameRobot(only ? "" : FreeName(robot.model->TokenStr(), &taken) + "/", &robot);
    }
}

}  // namespace

std::vector<Robot> RobotsOf(const std::vector<Model*>& models) {
  std::vector<Robot> robots;
  std::unordered_map<const Model*, size_t> places;
  for (Model* model : models) {
    auto* ranger = dynamic_cast<ModelRanger*>(model);
    if (!ranger && !dynamic_cast<ModelPosition*>(model)) continue;
    Model* carrier = CarrierOf(model);
    const auto [place, is_new] = places.try_emplace(carrier, robots.size());
    if (is_new)
      robots.push_back({carrier, dynamic_cast<ModelPosition*>(carrier), "", "", "", "", {}});
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
