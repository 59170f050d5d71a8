// SPDX-License-Identifier: GPL-2.0-or-later

#include "models/ranger.hh"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <limits>
#include <vector>

#include "geometry/trigonometry.hh"
#include "messages/assert.hh"
#include "messages/log.hh"
#include "models/host.hh"
#include "models/model_choices.hh"
#include "models/noise.hh"
#include "models/property_checks.hh"
#include "models/self_masks.hh"
#include "models/state_choice.hh"
#include "models/state_exchange.hh"
#include "models/types/built_in_types.hh"
#include "models/warn_about.hh"
#include "sensing/scene.hh"
#include "worldfile/numbers.hh"
#include "worldfile/worldfile.hh"

namespace Stg {

namespace {

constexpr double kWattsPerSensor = 0.2;
constexpr unsigned kMaxSamples = 1'000'000;
constexpr uint32_t kNoDirection = 0xffffffffu;

/// Rays pass through the ranger's own tree and models with a negative ranger_return, but stop at a
/// ranger_return of 0.
bool StopsRanger(Model* candidate, const Model* finder, const void*) {
  return !candidate->IsRelated(finder) && !(candidate->vis.ranger_return < 0.0);
}

/// Negative lengths and NaN count as 0; infinity is allowed.
double Magnitude(double value) { return value > 0 ? value : 0.0; }

double FiniteOr0(double value) { return std::isfinite(value) ? value : 0.0; }

RangeNoise NoiseOf(const ModelRanger::Sensor& sensor) {
  return {sensor.range_noise_const, sensor.range_noise, sensor.angle_noise};
}

void Describe(const ModelRanger& ranger, SensorExtent* extent) {
  extent->parts = ranger.GetSensors().size();
  for (const ModelRanger::Sensor& sensor : ranger.GetSensors()) extent->rays += sensor.sample_count;
}

ReadingShape SamplesOf(const ModelRanger& ranger) {
  size_t samples = 0;
  for (const ModelRanger::Sensor& sensor : ranger.GetSensors()) samples += sensor.sample_count;
  return ReadingShape(samples);
}

/// Copies one kind of data of all sensors, sensor after sensor; NaN where a sensor has none yet.
template <std::vector<double> ModelRanger::Sensor::*data>
bool CopyData(const ModelRanger& ranger, size_t length, double* to) {
  for (const ModelRanger::Sensor& sensor : ranger.GetSensors()) {
    const std::vector<double>& from = sensor.*data;
    const size_t expected = std::min<size_t>(sensor.sample_count, length);
    const size_t known = std::min(from.size(), expected);
    if (known > 0) std::memcpy(to, from.data(), known * sizeof(double));
    std::fill(to + known, to + expected, std::numeric_limits<double>::quiet_NaN());
    to += expected;
    length -= expected;
  }
  return true;
}

/// Calls put(sensor, origin, sample) for each of the first `length` rays: the origin is a pose in
/// the frame of the root of the ranger's tree. It follows from the geometry, so there is one before
/// the first update.
template <typename F>
void ForEachRay(const ModelRanger& ranger, size_t length, F put) {
  Pose frame = ranger.GetGeom().pose;
  for (const Model* model = &ranger; model->Parent(); model = model->Parent())
    frame = model->GetSensedLocalPose() + frame;
  const SineCosine turn = SinCos(frame.a);
  for (const ModelRanger::Sensor& sensor : ranger.GetSensors()) {
    const Pose origin = ModelRanger::OriginOf(sensor, frame, turn);
    for (uint32_t i = 0; i < sensor.sample_count && length > 0; i++, length--)
      put(sensor, origin, i);
  }
}

bool CopyBearings(const ModelRanger& ranger, size_t length, double* to) {
  ForEachRay(ranger, length, [&](const auto& sensor, const Pose& origin, uint32_t sample) {
    *to++ = normalize(origin.a +
                      sensing::SampleBearing(FiniteOr0(sensor.fov), sensor.sample_count, sample));
  });
  return true;
}

ReadingShape ShapeOfOrigins(const ModelRanger& ranger) {
  return ReadingShape(SamplesOf(ranger).Count(), 2);
}

bool CopyOrigins(const ModelRanger& ranger, size_t length, double* to) {
  ForEachRay(ranger, length, [&](const auto&, const Pose& origin, uint32_t) {
    *to++ = origin.x;
    *to++ = origin.y;
  });
  return true;
}

}  // namespace

ModelType RangerType() {
  return ModelTypeOf<ModelRanger>("ranger")
      .Moves(ModelType::kStays)
      .Updates(ModelType::kParallel | ModelType::kIgnoresOwnTree)
      .Senses(Describe)
      .Measurable()
      .Reads(MakeReading("ranges", "m",
                         "All samples of all sensors, sensor after sensor; the sensor's maximum "
                         "range where nothing was hit. Sample 0 is the rightmost.",
                         SamplesOf, CopyData<&ModelRanger::Sensor::ranges>))
      .Reads(MakeReading("intensities", "",
                         "The ranger_return of the model that was hit; 0: nothing was hit.",
                         SamplesOf, CopyData<&ModelRanger::Sensor::intensities>))
      .Reads(MakeReading("values", "",
                         "The response of the sensor at each range; NaN: it has none.", SamplesOf,
                         CopyData<&ModelRanger::Sensor::values>))
      .Reads(MakeReading("bearings", "rad",
                         "Direction of each ray relative to the robot's heading: -pi to pi, "
                         "counter-clockwise.",
                         SamplesOf, CopyBearings))
      .Reads(MakeReading("origins", "m", "Origin of each ray: x and y in the robot's frame.",
                         ShapeOfOrigins, CopyOrigins));
}

// ---- Sensor -------------------------------------------------------------------------------------

ModelRanger::Sensor::Sensor()
    : size(0.02, 0.02, 0.02),
      range(0.0, 5.0),
      fov(0.1),
      angle_noise(0),
      range_noise(0),
      range_noise_const(0),
      range_step(0),
      blind_near(false),
      loss(0),
      steepest(M_PI / 2),
      sample_count(1),
      color(0, 0, 1, 0.15),
      ray_model(RayModel::kDefault),
      table_fov_(std::numeric_limits<double>::quiet_NaN()),
      table_count_(0),
      first_direction_(kNoDirection),
      table_generation_(0),
      seeded_(false) {}

void ModelRanger::Sensor::Load(Worldfile* wf, int entity) {
  pose.Load(wf, entity, "pose");
  size.Load(wf, entity, "size");
  LoadRange(wf, entity);
  CheckNotNegative(*wf, entity, "range", std::min(range.min, range.max));
  CheckInOrder(*wf, entity, "range", &range, 1);
  WarnIfEqual(wf, entity, "range", range.min, range.max, "it sees nothing");
  fov = wf->ReadAngle(entity, "fov", fov);
  const int samples = wf->ReadInt(entity, "samples", static_cast<int>(sample_count));
  if (samples < 0 || static_cast<unsigned>(samples) > kMaxSamples)
    wf->Fail(entity, "samples",
             "found " + std::to_string(samples) + " samples, expected a number from 0 to " +
                 std::to_string(kMaxSamples));
  sample_count = static_cast<unsigned int>(samples);
  ray_model = ReadRayModel(wf, entity, ray_model);
  wf->ReadTuple(entity, "noise", 0, 3, "lfa", &range_noise_const, &range_noise, &angle_noise);
  CheckNotNegative(*wf, entity, "noise", std::min({range_noise_const, range_noise, angle_noise}));
  LoadDefects(wf, entity);
  response.Load(wf, entity);
  if (!wf->PropertyExists(entity, "color") || !wf->ReadString(entity, "color", "").empty())
    color.Load(wf, entity);
}

void ModelRanger::Sensor::LoadDefects(Worldfile* wf, int entity) {
  range_step = wf->ReadLength(entity, "range_step", range_step);
  CheckNotNegative(*wf, entity, "range_step", range_step);
  blind_near = wf->ReadInt(entity, "blind_near", blind_near) != 0;
  loss = wf->ReadFloat(entity, "loss", loss);
  steepest = wf->ReadAngle(entity, "steepest", steepest);
  if (!(loss >= 0 && loss <= 1))
    wf->Fail(entity, "loss",
             "found a probability of " + worldfile::FloatText(loss) + ", expected 0 to 1");
  if (!(steepest >= 0 && steepest <= M_PI / 2 + 1e-9))
    wf->Fail(entity, "steepest",
             "found " + worldfile::FloatText(rtod(steepest)) +
                 " degrees, expected 0 to 90 from the normal of a surface");
}

/// Reads the only property that may be infinite: range [0 "inf"].
void ModelRanger::Sensor::LoadRange(Worldfile* wf, int entity) {
  const std::string text = wf->ReadElement(entity, "range", 1);
  if (text == "inf" || text == "infinity") {
    wf->ReadTuple(entity, "range", 0, 1, "l", &range.min);
    range.max = std::numeric_limits<double>::infinity();
    return;
  }
  range.Load(wf, entity, "range");
}

std::string ModelRanger::Sensor::String() const {
  char text[256];
  std::snprintf(text, sizeof text, "[ samples %u, range [%.2f %.2f] ]", sample_count, range.min,
                range.max);
  return text;
}

meters_t ModelRanger::Sensor::Reach() const { return Magnitude(range.max); }

void ModelRanger::Sensor::Resize() {
  ranges.resize(sample_count);
  intensities.resize(sample_count);
  const double f = FiniteOr0(fov);
  if (table_fov_ == f && table_count_ == sample_count && bearings.size() == sample_count) return;
  bearings.resize(sample_count);
  for (unsigned int i = 0; i < sample_count; i++)
    bearings[i] = sensing::SampleBearing(f, sample_count, i);
  table_fov_ = f;
  table_count_ = sample_count;
  first_direction_ = kNoDirection;
}

bool ModelRanger::Sensor::HasTable(uint64_t generation) const {
  return first_direction_ != kNoDirection && table_generation_ == generation;
}

/// Makes sure that the tables contain the directions of the sensor's rays.
void ModelRanger::Sensor::FindTable(sensing::DirectionTables* tables) {
  if (HasTable(tables->generation())) return;
  first_direction_ = tables->Find(table_fov_, sample_count);
  table_generation_ = tables->generation();
}

/// Angle between adjacent rays, radians.
double ModelRanger::Sensor::Increment() const {
  return table_fov_ / (sample_count > 1 ? sample_count - 1 : 1);
}

bool ModelRanger::Sensor::IsNoisy() const {
  return NoiseOf(*this).Any(Increment()) || loss > 0 || response.IsNoisy();
}

bool ModelRanger::Sensor::HasAngleNoise() const { return NoiseOf(*this).TurnsRays(Increment()); }

// ---- ModelRanger --------------------------------------------------------------------------------

ModelRanger::ModelRanger(World* world_, Model* parent_, const std::string& type_)
    : Model(world_, parent_, type_) {
  ClearBlocks();
  has_default_block = true;  // no block exists, but the first block added replaces none
  geom.size = Size(0.15, 0.15, 0.2);
  color = Color(0, 0, 0.5);
}

ModelRanger::~ModelRanger() { host().FinishRaysOf(this); }

void ModelRanger::LoadSensor(Worldfile* file, int entity) {
  Sensor sensor;
  sensor.Load(file, entity);
  host().memory.Take(*file, entity, "samples", sensor.sample_count, MemoryBudget::kSample,
                     "samples");
  sensors_.push_back(sensor);
  if (subs > 0) watts = kWattsPerSensor * static_cast<double>(sensors_.size());
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

namespace {

/// Exchanges the numbers like exchange(*numbers), but copies all at once if the processor stores
/// them in the format of snapshots.
void ExchangeNumbers(StateExchange& exchange, std::vector<double>* numbers) {
  if (exchange.hashing() || std::endian::native != std::endian::little) return exchange(*numbers);
  const size_t count = exchange.Count(numbers->size());
  if (exchange.failed()) return;
  if (exchange.restoring()) numbers->resize(count);
  exchange.Plain(numbers->data(), numbers->size() * sizeof(double));
}

}  // namespace

void ModelRanger::Sensor::ExchangeState(StateExchange& exchange) {
  StateChoice model_of_rays(&ray_model, RayModel::kExact);
  exchange(pose, size, range, fov, angle_noise, range_noise, range_noise_const, sample_count, color,
           model_of_rays);
  // Hashes of sensors without defects are those of older versions.
  if (!exchange.hashing() || Defects().Any()) exchange(range_step, blind_near, loss, steepest);
  const bool has_readings = !exchange.omits_readings();  // others are dropped
  if (has_readings)
    for (std::vector<double>* numbers : {&ranges, &intensities, &bearings})
      ExchangeNumbers(exchange, numbers);
  // The curve is that of the world file. Sensors without one have no further state.
  if (has_readings && response.exists()) ExchangeNumbers(exchange, &values);
  exchange(random_, seeded_);
  const auto is_whole = [this](size_t count) { return count == 0 || count == sample_count; };
  if (has_readings && !(is_whole(ranges.size()) && is_whole(intensities.size()) &&
                        is_whole(bearings.size()) && is_whole(values.size())))
    exchange.Fail("found another number of readings than a sensor has");
}

void ModelRanger::ExchangeState(StateExchange& exchange) {
  Model::ExchangeState(exchange);
  exchange.Expect(sensors_.size(), "the number of a ranger's sensors");
  for (Sensor& sensor : sensors_) exchange(sensor);
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

void ModelRanger::Gather(sensing::FanList* fans) {
  const Pose frame = SensorFrame(scan_pose_);
  const SineCosine turn = SinCos(frame.a);
  static thread_local std::vector<double> bearings;  // static to reuse its memory
  for (uint32_t i = 0; i < sensors_.size(); i++) {
    Sensor& sensor = sensors_[i];
    if (sensor.sample_count == 0) continue;
    STAGE_ASSERT(sensors_[i].HasTable(scene().tables.generation()));  // after Preparations()
    const sensing::Fan fan = FanOf(i, frame, turn);
    if (!sensor.HasAngleNoise()) {
      fans->Add(fan, sensor.sample_count);
      continue;
    }
    bearings.clear();
    for (const double bearing : sensor.bearings)
      bearings.push_back(bearing + sensor.Increment() * sensor.angle_noise * 0.5 *
                                       UniformError(&sensor.random_));
    fans->Add(fan, bearings);
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
  if (HasAngleNoise()) return Model::MeasureSpace(fans, masks);
  sensing::BatchSpace space;
  for (const Sensor& sensor : sensors_) {
    if (sensor.sample_count == 0) continue;
    space.fans++;
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
    const sensing::Fan fan = FanOf(i, frame, turn);
    layers_found &= fan.layer != grid::kNoLayer;
    scene().batch.Put(place.fans++, fan, place.rays, sensor.sample_count,
                      root->self_masks_->of[fan.exact].mask);
    place.rays += sensor.sample_count;
  }
  return layers_found;
}

// ---- results ------------------------------------------------------------------------------------

void ModelRanger::PrefetchHits(uint32_t tag) const {
  constexpr size_t kInALine = 64 / sizeof(double);
  if (tag >= sensors_.size()) return;
  for (const std::vector<double>* numbers : {&sensors_[tag].ranges, &sensors_[tag].intensities})
    for (size_t i = 0; i < numbers->size(); i += kInALine)
      __builtin_prefetch(numbers->data() + i, 1);
}

void ModelRanger::ReceiveHits(uint32_t tag, const sensing::RayHits& hits) {
  // A callback may have changed the sensors since the rays were added.
  if (tag >= sensors_.size() || sensors_[tag].ranges.size() != hits.count) return;
  Sensor& sensor = sensors_[tag];
  std::copy(hits.ranges, hits.ranges + hits.count, sensor.ranges.begin());
  sensor.intensities.resize(hits.count);
  double* const intensities = sensor.intensities.data();
  const sensing::HitInterval* hit_interval = hits.intervals;
  for (uint32_t i = 0; i < hits.count; hit_interval++) {
    STAGE_ASSERT(hit_interval->end > i && hit_interval->end <= hits.count);
    const double intensity = hit_interval->model ? hit_interval->model->vis.ranger_return : 0.0;
    // Usually intensities do not change; not writing them saves memory bandwidth.
    for (; i < hit_interval->end; i++)
      if (intensities[i] != intensity) intensities[i] = intensity;
  }
  sensor.AddErrors();
  if (sensor.response.exists()) sensor.FillValues();
}

bool ModelRanger::ReceiveRanges(uint32_t tag, const sensing::DeviceRanges& given) {
  if (tag >= sensors_.size() || sensors_[tag].ranges.size() != given.count) return true;
  if (std::any_of(given.ranges, given.ranges + given.count, [](double r) { return r != r; }))
    return false;
  Sensor& sensor = sensors_[tag];
  sensor.intensities.resize(given.count);
  sensor.Copy(given);
  sensor.AddErrors();
  if (sensor.response.exists()) sensor.FillValues();
  return true;
}

/// Copies ranges and finds intensities.
void ModelRanger::Sensor::Copy(const sensing::DeviceRanges& given) {
  constexpr uint32_t kAtOnce = 16;
  double* const to = ranges.data();
  double* const intensity = intensities.data();
  for (uint32_t begin = 0; begin < given.count; begin += kAtOnce) {
    const uint32_t end = std::min(begin + kAtOnce, given.count);
    bool changed = false;
    for (uint32_t i = begin; i < end; i++) {
      to[i] = std::fabs(given.ranges[i]);
      changed |= intensity[i] != (std::signbit(given.ranges[i]) ? 0.0 : given.ranger_return);
    }
    if (!changed) continue;  // the usual case: not writing them saves memory bandwidth
    for (uint32_t i = begin; i < end; i++)
      intensity[i] = std::signbit(given.ranges[i]) ? 0.0 : given.ranger_return;
  }
}

RangeDefects ModelRanger::Sensor::Defects() const {
  return MakeRangeDefects(blind_near, loss, range_step, steepest, Increment());
}

void ModelRanger::Sensor::FillValues() { response.Fill(ranges, &random_, &values); }

/// Adds noise and defects to the readings. Rays without a return have no intensity.
void ModelRanger::Sensor::AddErrors() {
  const RangeDefects defects = Defects();
  AddRangeErrors(NoiseOf(*this), defects, range, &random_, ranges.data(), ranges.size());
  if (!defects.Any()) return;
  for (size_t i = 0; i < ranges.size(); i++)
    if (!(ranges[i] < range.max)) intensities[i] = 0;
}

}  // namespace Stg
