// SPDX-License-Identifier: GPL-2.0-or-later

#include "world/sensor_kinds.hh"

#include <algorithm>
#include <map>
#include <tuple>

#include "models/blobfinder.hh"
#include "models/bumper.hh"
#include "models/camera.hh"
#include "models/fiducial.hh"
#include "models/gripper.hh"
#include "models/ranger.hh"
#include "models/wifi.hh"

namespace Stg {

namespace {

constexpr uint64_t kGripperRays = 4;  // two beams, two contact strips

void DescribeRanger(const ModelRanger& ranger, SensorKind* kind) {
  kind->type = "ranger";
  kind->parts = ranger.GetSensors().size();
  for (const ModelRanger::Sensor& sensor : ranger.GetSensors()) kind->rays += sensor.sample_count;
}

void DescribeCamera(const ModelCamera& camera, SensorKind* kind) {
  kind->type = "camera";
  kind->pixels =
      static_cast<uint64_t>(camera.getWidth()) * static_cast<uint64_t>(camera.getHeight());
}

/// False: the model senses nothing.
bool Describe(const Model& model, SensorKind* kind) {
  if (const auto* ranger = dynamic_cast<const ModelRanger*>(&model)) {
    DescribeRanger(*ranger, kind);
  } else if (const auto* blobfinder = dynamic_cast<const ModelBlobfinder*>(&model)) {
    kind->type = "blobfinder";
    kind->rays = blobfinder->scan_width;
  } else if (const auto* bumper = dynamic_cast<const ModelBumper*>(&model)) {
    kind->type = "bumper";
    kind->parts = kind->rays = bumper->bumper_count;
  } else if (const auto* camera = dynamic_cast<const ModelCamera*>(&model)) {
    DescribeCamera(*camera, kind);
  } else if (dynamic_cast<const ModelFiducial*>(&model)) {
    kind->type = "fiducial";
    kind->rays_vary = true;
  } else if (dynamic_cast<const ModelGripper*>(&model)) {
    kind->type = "gripper";
    kind->parts = kind->rays = kGripperRays;
  } else if (const auto* wifi = dynamic_cast<const ModelWifi*>(&model)) {
    kind->type = "wifi";
    kind->rays_vary = wifi->propagation == ModelWifi::PROPAGATION_RAYTRACE;
  } else {
    return false;
  }
  return true;
}

auto KeyOf(const SensorKind& k) {
  return std::make_tuple(!k.subscribed, k.type, k.parts, k.rays, k.rays_vary, k.pixels, k.interval);
}

bool Before(const SensorGroup& a, const SensorGroup& b) {
  if (a.kind.subscribed != b.kind.subscribed) return a.kind.subscribed;
  const double rays_a = a.kind.RaysPerStep(), rays_b = b.kind.RaysPerStep();
  return rays_a != rays_b ? rays_a > rays_b : KeyOf(a.kind) < KeyOf(b.kind);
}

}  // namespace

double UpdatesPerStep(const Model& model, usec_t step) {
  // An update falls into the first step at or after its time.
  const usec_t interval = model.GetUpdateInterval();
  const usec_t steps = interval / step + (interval % step != 0 ? 1 : 0);
  return 1.0 / static_cast<double>(std::max<usec_t>(1, steps));
}

std::vector<SensorGroup> SortSensors(const std::vector<Model*>& models, usec_t step) {
  std::map<decltype(KeyOf(SensorKind())), SensorGroup> groups;
  for (Model* model : models) {
    SensorKind kind;
    if (!Describe(*model, &kind)) continue;
    kind.subscribed = model->HasSubscribers();
    kind.interval = model->GetUpdateInterval();
    kind.updates_per_step = UpdatesPerStep(*model, step);
    SensorGroup& group = groups[KeyOf(kind)];
    if (group.models.empty()) {
      group.kind = kind;
      group.kind.example = model->TokenStr();
    }
    group.models.push_back(model);
    group.kind.models++;
  }
  std::vector<SensorGroup> sorted;
  for (auto& [key, group] : groups) sorted.push_back(std::move(group));
  std::sort(sorted.begin(), sorted.end(), Before);
  return sorted;
}

}  // namespace Stg
