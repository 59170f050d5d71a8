// SPDX-License-Identifier: GPL-2.0-or-later

#include "recording/robots.hh"

#include <cctype>
#include <set>
#include <unordered_map>

#include "geometry/trigonometry.hh"
#include "models/actuator.hh"

namespace Stg::recording {

namespace {

/// The uppermost position that carries it, or else the top of its tree.
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
    if (dynamic_cast<const ModelActuator*>(m)) return true;
  return false;
}

/// Letters, digits and underscores, no digit first; one that nothing has yet.
std::string RosName(const std::string& token, std::set<std::string>* taken) {
  std::string name;
  for (const char c : token) name += std::isalnum(static_cast<unsigned char>(c)) ? c : '_';
  if (name.empty() || std::isdigit(static_cast<unsigned char>(name[0]))) name = "robot_" + name;
  std::string free = name;
  for (int i = 2; !taken->insert(free).second; i++) free = name + "_" + std::to_string(i);
  return free;
}

void NameAll(std::vector<Robot>* robots) {
  std::set<std::string> taken;
  for (Robot& robot : *robots) {
    const std::string name = RosName(robot.model->TokenStr(), &taken);
    const std::string prefix = robots->size() > 1 ? name + "/" : "";
    robot.topics = "/" + prefix;
    robot.odom_frame = prefix + "odom";
    robot.base_frame = prefix + "base_link";
    for (size_t i = 0; i < robot.scans.size(); i++) {
      const std::string number = robot.scans.size() > 1 ? std::to_string(i) : "";
      robot.scans[i].topic = robot.topics + "base_scan" + number;
      robot.scans[i].frame = prefix + "laser" + number;
    }
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
    if (is_new) robots.push_back({carrier, dynamic_cast<ModelPosition*>(carrier), "", "", "", {}});
    if (!ranger) continue;
    for (uint32_t i = 0; i < ranger->GetSensors().size(); i++)
      robots[place->second].scans.push_back({ranger, i, "", "", IsMoved(ranger, carrier)});
  }
  NameAll(&robots);
  return robots;
}

Pose MountOf(const ScanSource& source, const Model& robot) {
  // Headings and places in the plane from link to link: so they don't depend on where the robot is.
  // A top-level ranger is its own robot.
  Pose below;
  for (const Model* m = source.ranger; m != &robot; m = m->Parent()) below = m->GetPose() + below;
  const Pose frame = source.ranger->SensorFrame(below);
  const ModelRanger::Sensor& sensor = source.ranger->GetSensors()[source.sensor];
  Pose mount = ModelRanger::OriginOf(sensor, frame, SinCos(frame.a));
  // Heights depend on what stands on what.
  mount.z += source.ranger->GetGlobalPose().z - robot.GetGlobalPose().z - below.z;
  return mount;
}

}  // namespace Stg::recording
