// SPDX-License-Identifier: GPL-2.0-or-later

#include "models/lightsensor.hh"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

#include "geometry/trigonometry.hh"
#include "messages/assert.hh"
#include "messages/log.hh"
#include "models/body.hh"
#include "models/host.hh"
#include "models/noise.hh"
#include "models/property_checks.hh"
#include "models/state_exchange.hh"
#include "models/types/built_in_types.hh"
#include "models/types/light_index.hh"
#include "sensing/scene.hh"
#include "worldfile/worldfile.hh"

namespace Stg {

namespace {

constexpr size_t kMaxElements = 1000;
constexpr double kMaxIrradiance = 1e100;  // W/m2; keeps readings finite

/// Rays pass through the sensor's tree, the tree of the light, which is `light`, and models that
/// are invisible to rangers.
bool StopsLight(Model* candidate, const Model* sensor, const void* light) {
  return !candidate->IsRelated(sensor) && candidate->Root() != light &&
         !(candidate->vis.ranger_return < 0.0);
}

/// Negative, infinite and NaN settings count as 0.
double Setting(double value) { return value > 0 && std::isfinite(value) ? value : 0.0; }

/// `base` to a power that is not negative. The C library's pow() differs between processors.
double WholePower(double base, int exponent) {
  double power = 1.0;
  for (double square = base; exponent > 0; exponent >>= 1, square *= square)
    if (exponent & 1) power *= square;
  return power;
}

void Describe(const ModelLightSensor& sensor, SensorExtent* extent) {
  extent->parts = sensor.directions.size();
  extent->rays_vary = sensor.shadows;
}

ReadingShape ShapeOfIntensities(const ModelLightSensor& sensor) {
  return ReadingShape(sensor.directions.size());
}

ReadingShape ShapeOfColors(const ModelLightSensor& sensor) {
  return ReadingShape(sensor.directions.size(), 3);
}

template <size_t width>
bool CopyNumbers(const std::vector<double>& from, size_t length, double* to) {
  if (from.size() < length * width) return false;
  std::copy_n(from.begin(), length * width, to);
  return true;
}

bool CopyIntensities(const ModelLightSensor& sensor, size_t length, double* to) {
  return CopyNumbers<1>(sensor.GetIntensities(), length, to);
}

bool CopyColors(const ModelLightSensor& sensor, size_t length, double* to) {
  return CopyNumbers<3>(sensor.GetColors(), length, to);
}

bool CopyDirections(const ModelLightSensor& sensor, size_t length, double* to) {
  return CopyNumbers<1>(sensor.directions, length, to);
}

}  // namespace

ModelType LightSensorType() {
  return ModelTypeOf<ModelLightSensor>("lightsensor")
      .Moves(ModelType::kStays)
      .Updates(ModelType::kParallel | ModelType::kIgnoresOwnTree | ModelType::kReadsLightIndex)
      .Senses(Describe)
      .Measurable()
      .Reads(MakeReading("intensity", "W/m2", "The light that falls on each element.",
                         ShapeOfIntensities, CopyIntensities))
      .Reads(MakeReading("color", "W/m2",
                         "The red, green and blue light that falls on each element.", ShapeOfColors,
                         CopyColors))
      .Reads(MakeReading("direction", "rad",
                         "Axis of each element relative to the heading of the sensor.",
                         ShapeOfIntensities, CopyDirections));
}

ModelLightSensor::ModelLightSensor(World* world_, Model* parent_, const std::string& type_)
    : Model(world_, parent_, type_),
      directions(1, 0.0),
      range(20.0),
      fov(2 * M_PI),
      cosine_power(1),
      shadows(true),
      least_distance(0.01),
      ambient(0),
      noise(0),
      relative_noise(0),
      saturation(std::numeric_limits<double>::infinity()),
      seeded_(false),
      rays_out_(0) {
  ClearBlocks();
  geom.size = Size(0.02, 0.02, 0.02);
  color = Color("orange");
}

ModelLightSensor::~ModelLightSensor() { host().FinishRaysOf(this); }

// ---- world file ---------------------------------------------------------------------------------

void ModelLightSensor::Load() {
  if (!LoadCommon()) return;
  LoadDirections();
  LoadSettings();
}

void ModelLightSensor::LoadDirections() {
  const size_t count = wf->TupleLength(wf_entity, "directions");
  if (!wf->PropertyExists(wf_entity, "directions")) return;
  if (count < 1 || count > kMaxElements)
    wf->Fail(wf_entity, "directions",
             "found " + std::to_string(count) + " directions, expected 1 to " +
                 std::to_string(kMaxElements));
  directions.resize(count);
  for (size_t i = 0; i < count; i++)
    wf->ReadTuple(wf_entity, "directions", static_cast<unsigned>(i), 1, "a", &directions[i]);
  intensities_.clear();
  colors_.clear();
}

void ModelLightSensor::LoadSettings() {
  range = wf->ReadLength(wf_entity, "range", range);
  fov = wf->ReadAngle(wf_entity, "fov", fov);
  least_distance = wf->ReadLength(wf_entity, "least_distance", least_distance);
  ambient = wf->ReadFloat(wf_entity, "ambient", ambient);
  wf->ReadTuple(wf_entity, "noise", 0, 2, "ff", &noise, &relative_noise);
  saturation = wf->ReadFloat(wf_entity, "saturation", saturation);
  CheckNotNegative(*wf, wf_entity, "range", range);
  CheckNotNegative(*wf, wf_entity, "fov", fov);
  CheckNotNegative(*wf, wf_entity, "ambient", ambient);
  CheckNotNegative(*wf, wf_entity, "noise", std::min(noise, relative_noise));
  CheckNotNegative(*wf, wf_entity, "saturation", saturation);
  if (!(least_distance > 0))
    wf->Fail(wf_entity, "least_distance",
             "found a distance that is not positive, expected one above 0");
  cosine_power = wf->ReadInt(wf_entity, "cosine_power", cosine_power);
  if (cosine_power < 0 || cosine_power > kMaxCosinePower)
    wf->Fail(wf_entity, "cosine_power",
             "found " + std::to_string(cosine_power) + ", expected a whole number from 0 to " +
                 std::to_string(kMaxCosinePower));
  shadows = wf->ReadInt(wf_entity, "shadows", shadows);
}

void ModelLightSensor::Print(char* prefix) const {
  std::printf("%s%s light:", prefix ? prefix : "", Printable(token).c_str());
  for (const double intensity : intensities_) std::printf(" %.4g", intensity);
  std::printf("\n");
}

// ---- state --------------------------------------------------------------------------------------

void ModelLightSensor::ExchangeState(StateExchange& exchange) {
  Model::ExchangeState(exchange);
  exchange(directions, range, fov, cosine_power, shadows, least_distance, ambient, noise,
           relative_noise, saturation, intensities_, colors_, random_, seeded_);
  if (!exchange.restoring() || exchange.failed()) return;
  const size_t known = intensities_.size();
  if (colors_.size() != 3 * known || (known != 0 && known != directions.size()))
    exchange.Fail("found another number of readings than a light sensor has");
}

void ModelLightSensor::Reseed(uint64_t seed) {
  Model::Reseed(seed);
  if (noise != 0 || relative_noise != 0) seeded_ = false;  // others draw no random numbers
}

void ModelLightSensor::Shutdown() {
  intensities_.clear();
  colors_.clear();
  beams_.clear();
  Model::Shutdown();
}

// ---- sensing ------------------------------------------------------------------------------------

unsigned ModelLightSensor::Preparations() {
  return shadows && host().IsExact(RayModel::kDefault) ? kExactRays : 0;
}

void ModelLightSensor::Update() {
  if (subs == 0) return;
  host().lights->Refresh();
  GatherSerially();
  Model::Update();
}

void ModelLightSensor::Gather(sensing::FanList* fans) {
  frame_ = GetGlobalPose() + geom.pose;
  beams_.clear();
  rays_out_.store(0, std::memory_order_relaxed);
  CollectBeams(fans);
  if (rays_out_.load(std::memory_order_relaxed) == 0) MakeReadings();
}

/// Finds the lights within range, and adds rays if they may be in a shadow.
void ModelLightSensor::CollectBeams(sensing::FanList* fans) {
  const LightIndex& index = *host().lights;
  const double nearest = Setting(least_distance);
  for (const uint32_t i : index.Near(frame_.x, frame_.y, range)) {
    const LightIndex::Light& light = index.light(i);
    if (light.root == root) continue;
    const double dx = light.place.x - frame_.x, dy = light.place.y - frame_.y;
    const double distance = Hypotenuse(dx, dy);
    const double counted = std::max(distance, nearest);
    if (!(distance <= range) || !(counted > 0)) continue;
    const bool has_direction = distance > 0;
    const SineCosine ahead = has_direction ? SineCosine{dy / distance, dx / distance}
                                           : SinCos(std::isfinite(frame_.a) ? frame_.a : 0.0);
    beams_.push_back({ahead.cosine, ahead.sine,
                      std::min(light.intensity / (counted * counted), kMaxIrradiance), light.red,
                      light.green, light.blue, true});
    if (shadows && has_direction)
      AddRay(static_cast<uint32_t>(beams_.size() - 1), distance, light.root, fans);
  }
}

void ModelLightSensor::AddRay(uint32_t beam, double distance, const void* tree,
                              sensing::FanList* fans) {
  const Beam& towards = beams_[beam];
  sensing::Fan fan;
  fan.predicate = StopsLight;
  fan.finder = this;
  fan.arg = tree;
  fan.sink = this;
  fan.tag = beam;
  fan.exact = host().IsExact(RayModel::kDefault);
  const Pose origin(frame_.x, frame_.y, frame_.z + geom.size.z / 2.0,
                    ArcTangent(towards.y, towards.x));
  sensing::PlaceFan(&fan, origin, distance, scene().cells_per_metre);
  if (!fan.nothing) fan.layer = scene().grid.FindRangerLayer(fan.z, fan.z_test, fan.exact);
  fan.record.first_direction = sensing::DirectionTables::kAhead;
  fans->Add(fan, 1);
  rays_out_.fetch_add(1, std::memory_order_relaxed);
}

void ModelLightSensor::ReceiveHits(uint32_t tag, const sensing::RayHits& hits) {
  // The sensor may have been shut down since the rays were added.
  if (tag >= beams_.size()) return;
  STAGE_ASSERT(hits.count == 1);
  beams_[tag].lit = !hits.intervals[0].model;
  if (rays_out_.fetch_sub(1, std::memory_order_acq_rel) == 1) MakeReadings();
}

// ---- readings -----------------------------------------------------------------------------------

/// The directional response of all elements.
struct ModelLightSensor::Response {
  explicit Response(const ModelLightSensor& sensor)
      : power(std::clamp(sensor.cosine_power, 0, kMaxCosinePower)),
        // Rounding must not exclude the direction opposite to the axis.
        least_cosine(sensor.fov >= 2 * M_PI ? -2.0 : SinCos(Setting(sensor.fov) / 2.0).cosine) {}

  /// `cosine`: of the angle between the axis and the direction of the light.
  double To(double cosine) const {
    if (cosine < least_cosine) return 0.0;
    if (power == 0) return 1.0;
    return cosine > 0 ? WholePower(std::min(cosine, 1.0), power) : 0.0;
  }

  const int power;
  const double least_cosine;
};

void ModelLightSensor::MakeReadings() {
  if ((noise != 0 || relative_noise != 0) && !seeded_) {
    random_.Seed(NoiseSeed(token));
    seeded_ = true;
  }
  intensities_.resize(directions.size());
  colors_.resize(3 * directions.size());
  const Response response(*this);
  for (size_t i = 0; i < directions.size(); i++) Measure(i, response);
}

void ModelLightSensor::Measure(size_t element, const Response& response) {
  const SineCosine axis = sensing::UnitVectorOf(frame_.a + directions[element]);
  double sum = 0, red = 0, green = 0, blue = 0;
  for (const Beam& beam : beams_) {
    if (!beam.lit) continue;
    const double part = beam.irradiance * response.To(beam.x * axis.cosine + beam.y * axis.sine);
    sum += part;
    red += part * beam.red;
    green += part * beam.green;
    blue += part * beam.blue;
  }
  const double floor = Setting(ambient);
  intensities_[element] = Noisy(floor + sum);
  double* const channels = &colors_[3 * element];
  channels[0] = Noisy(floor + red);
  channels[1] = Noisy(floor + green);
  channels[2] = Noisy(floor + blue);
}

/// The reading with noise, limited to the range of readings.
double ModelLightSensor::Noisy(double reading) {
  const double constant = Setting(noise), relative = Setting(relative_noise) * reading;
  if (constant > 0 || relative > 0)
    reading += std::sqrt(constant * constant + relative * relative) * NormalError(&random_);
  return std::clamp(reading, 0.0, saturation > 0 ? saturation : 0.0);
}

}  // namespace Stg
