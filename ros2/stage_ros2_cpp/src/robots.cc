// SPDX-License-Identifier: GPL-2.0-or-later

#include "robots.hh"

#include <algorithm>
#include <cmath>
#include <utility>

namespace stage_ros2_cpp {

using Stg::Model;
using Stg::Pose;

namespace {

/// Models of a robot's tree that are sensors of one kind, in the order of the tree.
struct KindOfSensors {
  std::string name;
  std::vector<Model*> models;
};

std::string KindOf(const Model& model) {
  if (dynamic_cast<const Stg::ModelRanger*>(&model)) return "ranger";
  const Stg::ModelType* const type = Stg::FindSensorType(model);
  return type ? type->name : model.GetModelType();
}

void CollectKinds(Model* tree, std::vector<KindOfSensors>* kinds) {
  const std::string name = KindOf(*tree);
  auto kind = std::find_if(kinds->begin(), kinds->end(),
                           [&](const KindOfSensors& known) { return known.name == name; });
  if (kind == kinds->end()) kind = kinds->insert(kind, KindOfSensors{name, {}});
  kind->models.push_back(tree);
  for (Model* child : tree->GetChildren()) CollectKinds(child, kinds);
}

View ViewOf(const Stg::ModelCamera& camera) {
  const Stg::PerspectiveCamera& lens = camera.getCamera();
  return {static_cast<uint32_t>(camera.getWidth()),
          static_cast<uint32_t>(camera.getHeight()),
          Stg::dtor(lens.horizFov()),
          Stg::dtor(lens.vertFov()),
          lens.nearClip(),
          lens.farClip(),
          -Stg::dtor(camera.getPan()),
          Stg::dtor(camera.getTilt())};
}

/// Makes the plan of one robot.
class Planner {
 public:
  Planner(const Simulation& simulation, const Look& look, Model* robot, RobotPlan* plan)
      : look_(look), step_(simulation.StepTime()), robot_(robot), plan_(plan) {}

  void Plan() {
    plan_->mounts.push_back({Frame(look_.footprint), Frame(look_.base), Planar(Pose())});
    std::vector<KindOfSensors> kinds;
    CollectKinds(robot_, &kinds);
    for (const KindOfSensors& kind : kinds)
      for (size_t i = 0; i < kind.models.size(); i++)
        Add(kind.name, kind.models[i], i, kind.models.size());
  }

 private:
  std::string Frame(const std::string& name) const { return Joined(plan_->prefix, name); }

  void Add(const std::string& kind, Model* model, size_t index, size_t count) {
    const NamingScheme& scheme = *look_.scheme;
    plan_->all_sensors.emplace_back(kind, index);
    if (kind == "ranger") AddRanger(static_cast<Stg::ModelRanger*>(model), index, count);
    if (kind == "camera") AddCamera(static_cast<Stg::ModelCamera*>(model), index, count);
    // These have frames, but no topics.
    if (kind == "fiducial") Mount(scheme.Numbered("fiducials", index, count) + "_link", model);
    if (kind == "blobfinder") Mount(scheme.Numbered("blobs", index, count) + "_link", model);
    if (kind == "radio") Mount(scheme.Numbered("radio_link", index, count), model);
  }

  int64_t IntervalOf(const Model& model) const {
    return std::max(static_cast<int64_t>(model.GetUpdateInterval()), step_);
  }

  void AddRanger(const Stg::ModelRanger* ranger, size_t index, size_t count) {
    const std::string topic = look_.scheme->Numbered("base_scan", index, count);
    const std::string frame = look_.scheme->Numbered(look_.scheme->scan_frame, index, count);
    const Pose geometry = ranger->GetGeom().pose;
    size_t first = 0;
    for (size_t i = 0; i < ranger->GetSensors().size(); i++) {
      const Stg::ModelRanger::Sensor& sensor = ranger->GetSensors()[i];
      const Scanner scanner{index,
                            i,
                            first,
                            sensor.range.min,
                            sensor.Reach(),
                            std::isfinite(sensor.fov) ? sensor.fov : 0,
                            sensor.time_increment,
                            sensor.sample_count};
      first += sensor.sample_count;
      if (sensor.sample_count == 1 && look_.single_beams == "none") continue;
      const Pose origin = Stg::ModelRanger::OriginOf(sensor, geometry, Stg::SinCos(geometry.a));
      plan_->sensors.push_back({Sensor::kScanner, ranger->GetId(), index, IntervalOf(*ranger),
                                Mount(SensorName(frame, i), ranger, origin),
                                Frame(SensorName(topic, i)), scanner, View{}});
    }
  }

  void AddCamera(const Stg::ModelCamera* camera, size_t index, size_t count) {
    const View view = ViewOf(*camera);
    const NamingScheme& scheme = *look_.scheme;
    const std::string name = scheme.Numbered(scheme.camera_frame, index, count);
    Mount(name, camera, Pose(), view.pan, view.tilt);
    const std::string eye = Frame(name) + "_optical";
    // Optical frames have z forwards, x to the right and y down (REP 103).
    plan_->mounts.push_back({Frame(name), eye, {0, 0, 0, -0.5, 0.5, -0.5, 0.5}});
    plan_->sensors.push_back({Sensor::kCamera, camera->GetId(), index, IntervalOf(*camera), eye,
                              scheme.Numbered("", index, count), Scanner{}, view});
  }

  /// A frame at the pose `inner` on a sensor; returns its name.
  std::string Mount(const std::string& name, const Model* sensor, const Pose& inner = Pose(),
                    double pan = 0, double tilt = 0) {
    const std::string base = Frame(look_.base), frame = Frame(name);
    if (IsMoved(*sensor)) {
      plan_->joints.push_back({base, frame, sensor->GetId(), inner, pan, tilt});
    } else {
      const Pose place = Relative(PoseInTree(*sensor, false), PoseInTree(*robot_, false));
      plan_->mounts.push_back({base, frame, Spatial(Composed(place, inner), pan, tilt)});
    }
    return frame;
  }

  /// True if something between the sensor and its robot moves by itself.
  bool IsMoved(const Model& sensor) const {
    for (const Model* m = sensor.Parent(); m && m != robot_; m = m->Parent())
      if (dynamic_cast<const Stg::ModelActuator*>(m) || dynamic_cast<const Stg::ModelPosition*>(m))
        return true;
    return false;
  }

  const Look& look_;
  const int64_t step_;
  Model* const robot_;
  RobotPlan* const plan_;
};

}  // namespace

std::vector<RobotPlan> PlanRobots(const Simulation& simulation, const Look& look) {
  std::vector<std::string> names;
  for (size_t i = 0; i < simulation.size(); i++) names.push_back(simulation.Robot(i)->TokenStr());
  const std::vector<std::string> prefixes = look.scheme->Prefixes(names, look.enforce_prefixes);
  std::vector<RobotPlan> plans;
  for (size_t i = 0; i < simulation.size(); i++) {
    plans.push_back({simulation.Robot(i)->GetId(), names[i], prefixes[i], {}, {}, {}, {}});
    Planner(simulation, look, simulation.Robot(i), &plans.back()).Plan();
  }
  return plans;
}

Transform PoseOf(const Joint& joint, const Model& sensor, const Model& robot) {
  const Pose place = Relative(PoseInTree(sensor, true), PoseInTree(robot, true));
  return Spatial(Composed(place, joint.inner), joint.pan, joint.tilt);
}

}  // namespace stage_ros2_cpp
