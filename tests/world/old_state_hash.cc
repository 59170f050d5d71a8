// SPDX-License-Identifier: GPL-2.0-or-later
//
// The state hash as it was before it covered all state: runs a world and prints it, as
// `stage --seed N --duration SECONDS --state-hash WORLD` did. Shows that results are what they
// were, although today's hashes are others.

#include <cinttypes>
#include <cstdio>
#include <cstring>
#include <string>
#include <type_traits>

#include "stage.hh"
#include "support/all_models.hh"

namespace Stg {
namespace {

/// FNV-1a over the bytes of numbers; -0 counts as 0.
class Hasher {
 public:
  template <typename... T>
  requires(std::is_arithmetic_v<T>&&...) void Add(T... values) {
    (AddOne(static_cast<double>(values)), ...);
  }
  void Add(const Pose& p) { Add(p.x, p.y, p.z, p.a); }
  uint64_t hash() const { return hash_; }

 private:
  void AddOne(double value) {
    unsigned char bytes[sizeof value];
    if (value == 0) value = 0;
    std::memcpy(bytes, &value, sizeof value);
    for (const unsigned char byte : bytes) hash_ = (hash_ ^ byte) * 0x100000001b3u;
  }
  uint64_t hash_ = 0xcbf29ce484222325u;
};

void AddCommon(Model* model, Hasher* hasher) {
  hasher->Add(model->GetPose());
  const PowerPack* pack = model->FindPowerPack();
  if (pack && &pack->model() == model) hasher->Add(pack->GetStored(), pack->GetDissipated());
  for (Model::Flag* flag : model->flags()) hasher->Add(flag->GetSize());
}

void AddOwn(ModelPosition* robot, Hasher* hasher) { hasher->Add(Pose(robot->GetVelocity())); }

void AddOwn(ModelRanger* ranger, Hasher* hasher) {
  for (const ModelRanger::Sensor& sensor : ranger->GetSensors()) {
    for (const double range : sensor.ranges) hasher->Add(range);
    for (const double intensity : sensor.intensities) hasher->Add(intensity);
  }
}

void AddOwn(ModelFiducial* finder, Hasher* hasher) {
  hasher->Add(finder->GetFiducials().size());
  for (const ModelFiducial::Fiducial& f : finder->GetFiducials()) {
    hasher->Add(f.range, f.bearing);
    hasher->Add(f.geom);
    hasher->Add(f.pose);
    hasher->Add(f.id);
  }
}

void AddOwn(ModelBlobfinder* finder, Hasher* hasher) {
  hasher->Add(finder->GetBlobs().size());
  for (const ModelBlobfinder::Blob& b : finder->GetBlobs())
    hasher->Add(b.color.r, b.color.g, b.color.b, b.color.a, b.range, b.left, b.top, b.right,
                b.bottom);
}

void AddOwn(ModelBumper* bumper, Hasher* hasher) {
  for (uint32_t i = 0; bumper->samples && i < bumper->bumper_count; i++) {
    const ModelBumper::BumperSample& sample = bumper->samples[i];
    hasher->Add(sample.hit != nullptr, sample.hit_point.x, sample.hit_point.y);
  }
}

void AddOwn(ModelGripper* gripper, Hasher* hasher) {
  const ModelGripper::config_t config = gripper->GetConfig();
  hasher->Add(config.paddle_position, config.lift_position, config.close_limit,
              config.gripped != nullptr);
  for (int i = 0; i < 2; i++) hasher->Add(config.beam[i] != nullptr, config.contact[i] != nullptr);
}

void AddOwn(ModelWifi* radio, Hasher* hasher) {
  hasher->Add(radio->GetNeighbors().size());
  for (const ModelWifi::Neighbor& neighbor : radio->GetNeighbors()) {
    hasher->Add(neighbor.pose);
    hasher->Add(neighbor.db);
  }
}

void AddOwn(ModelCamera* camera, Hasher* hasher) {
  if (!camera->FrameDepth()) return;
  const int pixels = camera->getWidth() * camera->getHeight();
  const GLubyte* colors = camera->FrameColor();
  for (int i = 0; i < pixels; i++) hasher->Add(camera->FrameDepth()[i]);
  for (int i = 0; i < pixels; i++, colors += 4)
    hasher->Add(colors[0] * 65536 + colors[1] * 256 + colors[2]);
}

void AddOwn(ModelActuator* actuator, Hasher* hasher) { hasher->Add(actuator->GetVelocity()); }
void AddOwn(ModelLightIndicator* light, Hasher* hasher) { hasher->Add(light->IsOn()); }

template <typename... Type>
void AddOwnOf(Model* model, Hasher* hasher) {
  const auto add = [&](auto* typed) {
    if (typed) AddOwn(typed, hasher);
  };
  (add(dynamic_cast<Type*>(model)), ...);
}

/// In the order of creation, the ground first.
uint64_t OldStateHash(World* world) {
  Hasher hasher;
  for (Model* model : all_models::ByNumber(world)) {
    AddCommon(model, &hasher);
    AddOwnOf<ModelPosition, ModelRanger, ModelFiducial, ModelBlobfinder, ModelBumper, ModelGripper,
             ModelWifi, ModelCamera, ModelActuator, ModelLightIndicator>(model, &hasher);
  }
  return hasher.hash();
}

int Run(int argc, char** argv) {
  RunOptions options;
  double seconds = 0;
  for (int i = 1; i + 1 < argc; i++) {
    if (std::strcmp(argv[i], "--seed") == 0) options.seed = std::stoull(argv[i + 1]);
    if (std::strcmp(argv[i], "--duration") == 0) seconds = std::stod(argv[i + 1]);
  }
  Init(&argc, &argv);
  World world(options);
  if (argc < 2 || !world.Load(argv[argc - 1])) return 1;
  while (static_cast<double>(world.SimTimeNow()) < seconds * 1e6) world.Update();
  std::printf("state-hash %016" PRIx64 "\n", OldStateHash(&world));
  return 0;
}

}  // namespace
}  // namespace Stg

int main(int argc, char** argv) { return Stg::Run(argc, argv); }
