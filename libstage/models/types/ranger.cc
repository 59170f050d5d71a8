// SPDX-License-Identifier: GPL-2.0-or-later

#include "models/ranger.hh"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "geometry/trigonometry.hh"
#include "messages/assert.hh"
#include "messages/log.hh"
#include "models/host.hh"
#include "models/noise.hh"
#include "models/position.hh"
#include "models/scan_path.hh"
#include "models/self_masks.hh"
#include "models/state_exchange.hh"
#include "models/warn_about.hh"
#include "sensing/scene.hh"
#include "worldfile/numbers.hh"
#include "worldfile/worldfile.hh"

namespace Stg {

namespace {

constexpr double kWattsPerSensor = 0.2;

/// Rays pass through the ranger's own tree and models with a negative ranger_return, but stop at a
/// ranger_return of 0.
bool StopsRanger(Model* candidate, const Model* finder, const void*) {
  return !candidate->IsRelated(finder) && !(candidate->vis.ranger_return < 0.0);
}

}  // namespace

ModelRanger::ModelRanger(World* world_, Model* parent_, const std::string& type_)
    : Model(world_, parent_, type_) {
  ClearBlocks();
  has_default_block = true;  // no block exists, but the first block added replaces none
  geom.size = Size(0.15, 0.15, 0.2);
  color = Color(0, 0, 0.5);
}

ModelRanger::~ModelRanger() {
  host().FinishRaysOf(this);
  std::erase(host().sweeping_rangers, this);
}

void ModelRanger::LoadSensor(Worldfile* file, int entity) {
  Sensor sensor;
  sensor.Load(file, entity);
  host().memory.Take(*file, entity, "samples", sensor.sample_count, MemoryBudget::kSample,
                     "samples");
  if (sensor.Duration() > 0) ExpectSweep(*file, entity, sensor);
  sensors_.push_back(sensor);
  if (subs > 0) watts = kWattsPerSensor * static_cast<double>(sensors_.size());
}

/// Checks a scan that takes time, and has the way of the robot noted from now on.
void ModelRanger::ExpectSweep(const Worldfile& file, int entity, const Sensor& sensor) {
  const double between = static_cast<double>(GetUpdateInterval()) / 1e6;
  if (sensor.Duration() > between)
    file.Fail(entity, "time_increment",
              "found a scan that takes " + worldfile::FloatText(sensor.Duration()) +
                  " s, expected at most the update_interval of the ranger, " +
                  worldfile::FloatText(between) + " s");
  if (StepsOfSweep(sensor) > ScanPath::kMostSteps)
    file.Fail(entity, "time_increment",
              "found a scan of more than " + std::to_string(ScanPath::kMostSteps) +
                  " steps of the world, expected less: a longer interval_sim, or a quicker scan");
  if (path_) return;
  path_ = std::make_unique<ScanPath>();
  host().sweeping_rangers.push_back(this);
}

/// Number of steps during a scan, of which the first may have begun before it.
size_t ModelRanger::StepsOfSweep(const Sensor& sensor) const {
  return static_cast<size_t>(std::min(std::ceil(sensor.Duration() / StepSeconds()), 1e9));
}

double ModelRanger::StepSeconds() const {
  return static_cast<double>(world_base().sim_interval) / 1e6;
}

void ModelRanger::NoteMotion() {
  const auto* const robot = dynamic_cast<const ModelPosition*>(root);
  size_t steps = 0;
  for (const Sensor& sensor : sensors_) steps = std::max(steps, StepsOfSweep(sensor));
  path_->Note(robot ? robot->GetActualVelocity() : Velocity(),
              std::min(steps, ScanPath::kMostSteps));
}

void ModelRanger::Print(char* prefix) const {
  std::printf("%s%s\n", prefix ? prefix : "", Printable(token).c_str());
  for (const Sensor& sensor : sensors_) {
    std::printf("  ranges");
    for (const double r : sensor.ranges) std::printf(" %.2f", r);
    std::printf("\n  intensities");
    for (const double i : sensor.intensities) std::printf(" %.2f", i);
    std::printf("\n");
  }
}

void ModelRanger::ExchangeState(StateExchange& exchange) {
  Model::ExchangeState(exchange);
  exchange.Expect(sensors_.size(), "the number of a ranger's sensors");
  for (Sensor& sensor : sensors_) exchange(sensor);
  if (path_) exchange(*path_);
  // The pose has no influence on the future. It is kept and left out together with the readings.
  if (!exchange.hashing() && !exchange.omits_readings()) exchange(scan_pose_, has_scan_pose_);
}

void ModelRanger::SetScanPose(const Pose& global) {
  scan_pose_ = global;
  has_scan_pose_ = true;
}

void ModelRanger::Reseed(uint64_t seed) {
  Model::Reseed(seed);
  for (Sensor& sensor : sensors_)
    if (sensor.IsNoisy()) sensor.seeded_ = false;  // other sensors draw no random numbers
}

void ModelRanger::DropReadings() {
  Model::DropReadings();
  for (Sensor& sensor : sensors_) {
    sensor.ranges.clear();
    sensor.intensities.clear();
    sensor.bearings.clear();
    sensor.values.clear();
  }
  scan_pose_ = Pose();
  has_scan_pose_ = false;
}

void ModelRanger::Startup() {
  watts = kWattsPerSensor * static_cast<double>(sensors_.size());
  Model::Startup();
}

void ModelRanger::Shutdown() {
  watts = 0;
  Model::Shutdown();
}

void ModelRanger::Update() {
  GatherSerially();
  Model::Update();
}

/// Adds the fans, if rays of some sensor have errors of their headings.
void ModelRanger::Gather(sensing::FanList* fans) {
  const Pose frame = SensorFrame(scan_pose_);
  const SineCosine turn = SinCos(frame.a);
  static thread_local std::vector<double> bearings;  // static to reuse its memory
  for (uint32_t i = 0; i < sensors_.size(); i++) {
    Sensor& sensor = sensors_[i];
    if (sensor.sample_count == 0) continue;
    STAGE_ASSERT(sensors_[i].HasTable(scene().tables.generation()));  // after Preparations()
    if (!sensor.HasAngleNoise() && !IsSkewed(sensor)) {
      fans->Add(FanOf(i, frame, turn), sensor.sample_count);
      continue;
    }
    bearings = sensor.bearings;
    if (sensor.HasAngleNoise())
      for (double& bearing : bearings)
        bearing += sensor.Increment() * sensor.angle_noise * 0.5 * UniformError(&sensor.random_);
    if (!IsSkewed(sensor)) {
      fans->Add(FanOf(i, frame, turn), bearings);
      continue;
    }
    for (uint32_t ray = 0; ray < sensor.sample_count; ray++)
      fans->Add(FanOfRay(i, ray), std::span(bearings).subspan(ray, 1));
  }
}

Pose ModelRanger::OriginOf(const Sensor& sensor, const Pose& frame, const SineCosine& turn) {
  const Pose& p = sensor.pose;
  return Pose(frame.x + p.x * turn.cosine - p.y * turn.sine,
              frame.y + p.x * turn.sine + p.y * turn.cosine, frame.z + p.z + sensor.size.z / 2.0,
              normalize(frame.a + p.a));
}

sensing::Fan ModelRanger::FanOf(uint32_t index, const Pose& frame, const SineCosine& turn) const {
  STAGE_ASSERT(index < sensors_.size());
  const Sensor& sensor = sensors_[index];
  sensing::Fan fan;
  fan.predicate = StopsRanger;
  fan.sees_all_but = root;
  fan.finder = this;
  fan.sink = const_cast<ModelRanger*>(this);
  fan.tag = index;
  fan.record.first_direction = sensor.first_direction_;
  fan.exact = host().IsExact(sensor.ray_model);
  sensing::PlaceFan(&fan, OriginOf(sensor, frame, turn), sensor.Reach(), scene().cells_per_metre);
  if (!fan.nothing) fan.layer = scene().grid.FindRangerLayer(fan.z, fan.z_test, fan.exact);
  return fan;
}

/// The fan of a single ray of a scan that takes time, from where the robot was then.
sensing::Fan ModelRanger::FanOfRay(uint32_t index, uint32_t ray) const {
  const Sensor& sensor = sensors_[index];
  const double ago = (sensor.sample_count - 1 - ray) * sensor.time_increment;
  Pose place = path_->Before(ago) + place_on_root_;
  place.z = scan_pose_.z;
  const Pose frame = SensorFrame(place);
  sensing::Fan fan = FanOf(index, frame, SinCos(frame.a));
  fan.record.first_direction += ray;
  fan.tag = TagOfRay(index, ray);
  return fan;
}

uint32_t ModelRanger::TagOfRay(uint32_t index, uint32_t ray) const {
  uint32_t tag = static_cast<uint32_t>(sensors_.size()) + ray;
  for (uint32_t i = 0; i < index; i++) tag += sensors_[i].sample_count;
  return tag;
}

bool ModelRanger::IsSkewed(const Sensor& sensor) const { return moves_ && sensor.Duration() > 0; }

/// Finds the way of the robot during the scan that ends now.
void ModelRanger::FollowPath() {
  moves_ = path_ && !path_->IsStill();
  if (!moves_) return;
  path_->StartAt(root->GetGlobalPose(), StepSeconds());
  place_on_root_ = Pose();
  for (const Model* model = this; model->Parent(); model = model->Parent())
    place_on_root_ = model->GetPose() + place_on_root_;
}

/// Prepares a sensor for casting rays. Only touches the sensor itself.
void ModelRanger::Prepare(Sensor* sensor, uint32_t index) {
  if (sensor->sample_count > kMaxSamples) {
    WarnAbout(*this,
              "found %u samples of sensor %u, expected a number from 0 to %u; using that many",
              sensor->sample_count, index, kMaxSamples);
    sensor->sample_count = kMaxSamples;
  }
  sensor->Resize();
  if (sensor->seeded_ || sensor->sample_count == 0) return;
  sensor->random_.Seed(NoiseSeed(token + "/" + std::to_string(index)));
  sensor->seeded_ = true;
}

unsigned ModelRanger::Preparations() {
  unsigned needs = 0;
  for (uint32_t i = 0; i < sensors_.size(); i++) {
    Sensor& sensor = sensors_[i];
    Prepare(&sensor, i);
    if (sensor.sample_count == 0) continue;
    if (!sensor.HasTable(scene().tables.generation())) needs |= kNeedsPreparation;
    if (host().IsExact(sensor.ray_model)) needs |= kExactRays;
  }
  return needs;
}

void ModelRanger::FinishPreparation() {
  for (Sensor& sensor : sensors_)
    if (sensor.sample_count > 0) sensor.FindTable(&scene().tables);
}

bool ModelRanger::HasAngleNoise() const {
  return std::any_of(sensors_.begin(), sensors_.end(),
                     [](const Sensor& sensor) { return sensor.HasAngleNoise(); });
}

/// The first part of each update: notes the pose, which Gather() and FillSpace() use afterwards.
sensing::BatchSpace ModelRanger::MeasureSpace(sensing::FanList* fans, PendingSelfMasks* masks) {
  SetScanPose(GetGlobalPose());
  FollowPath();
  for (Sensor& sensor : sensors_) sensor.pending_ = IsSkewed(sensor) ? sensor.sample_count : 0;
  if (HasAngleNoise()) return Model::MeasureSpace(fans, masks);
  sensing::BatchSpace space;
  for (const Sensor& sensor : sensors_) {
    if (sensor.sample_count == 0) continue;
    space.fans += IsSkewed(sensor) ? sensor.sample_count : 1;
    space.rays += sensor.sample_count;
    space.words += masks->Reserve(*this, host().IsExact(sensor.ray_model));
  }
  return space;
}

bool ModelRanger::FillSpace(sensing::BatchSpace place, const sensing::FanList& fans,
                            size_t first_fan, size_t count) {
  if (count > 0) return Model::FillSpace(place, fans, first_fan, count);
  bool layers_found = true;
  const Pose frame = SensorFrame(scan_pose_);
  const SineCosine turn = SinCos(frame.a);
  for (uint32_t i = 0; i < sensors_.size(); i++) {
    const Sensor& sensor = sensors_[i];
    if (sensor.sample_count == 0) continue;
    STAGE_ASSERT(sensors_[i].HasTable(scene().tables.generation()));  // after Preparations()
    const sensing::SelfMask& mask = root->self_masks_->of[host().IsExact(sensor.ray_model)].mask;
    const uint32_t samples = IsSkewed(sensor) ? 1 : sensor.sample_count;
    for (uint32_t ray = 0; ray < sensor.sample_count; ray += samples) {
      const sensing::Fan fan = IsSkewed(sensor) ? FanOfRay(i, ray) : FanOf(i, frame, turn);
      layers_found &= fan.layer != grid::kNoLayer;
      scene().batch.Put(place.fans++, fan, place.rays, samples, mask);
      place.rays += samples;
    }
  }
  return layers_found;
}

// ---- results ------------------------------------------------------------------------------------

/// Finds the sensor of a tag, and the first of the rays with results. Null if a callback has
/// changed the sensors since the rays were added.
ModelRanger::Sensor* ModelRanger::FindRays(uint32_t tag, uint32_t count, uint32_t* first) {
  *first = 0;
  if (tag < sensors_.size()) return sensors_[tag].ranges.size() == count ? &sensors_[tag] : nullptr;
  *first = tag - static_cast<uint32_t>(sensors_.size());
  for (Sensor& sensor : sensors_) {
    if (*first < sensor.ranges.size()) return count == 1 ? &sensor : nullptr;
    *first -= static_cast<uint32_t>(sensor.ranges.size());
  }
  return nullptr;
}

void ModelRanger::CompleteReadings(Sensor* sensor, uint32_t tag) {
  if (tag < sensors_.size())
    sensor->Finish();
  else
    sensor->FinishRay();
}

void ModelRanger::PrefetchHits(uint32_t tag) const {
  constexpr size_t kInALine = 64 / sizeof(double);
  if (tag >= sensors_.size()) return;
  for (const std::vector<double>* numbers : {&sensors_[tag].ranges, &sensors_[tag].intensities})
    for (size_t i = 0; i < numbers->size(); i += kInALine)
      __builtin_prefetch(numbers->data() + i, 1);
}

void ModelRanger::ReceiveHits(uint32_t tag, const sensing::RayHits& hits) {
  uint32_t first;
  Sensor* const sensor = FindRays(tag, hits.count, &first);
  if (!sensor) return;
  std::copy(hits.ranges, hits.ranges + hits.count, sensor->ranges.begin() + first);
  sensor->intensities.resize(sensor->ranges.size());
  double* const intensities = sensor->intensities.data() + first;
  const sensing::HitInterval* hit_interval = hits.intervals;
  for (uint32_t i = 0; i < hits.count; hit_interval++) {
    STAGE_ASSERT(hit_interval->end > i && hit_interval->end <= hits.count);
    const double intensity = hit_interval->model ? hit_interval->model->vis.ranger_return : 0.0;
    // Usually intensities do not change; not writing them saves memory bandwidth.
    for (; i < hit_interval->end; i++)
      if (intensities[i] != intensity) intensities[i] = intensity;
  }
  CompleteReadings(sensor, tag);
}

bool ModelRanger::ReceiveRanges(uint32_t tag, const sensing::DeviceRanges& given) {
  uint32_t first;
  Sensor* const sensor = FindRays(tag, given.count, &first);
  if (!sensor) return true;
  if (std::any_of(given.ranges, given.ranges + given.count, [](double r) { return r != r; }))
    return false;
  sensor->intensities.resize(sensor->ranges.size());
  sensor->Copy(given, first);
  CompleteReadings(sensor, tag);
  return true;
}

}  // namespace Stg
