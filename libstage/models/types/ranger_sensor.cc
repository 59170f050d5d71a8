// SPDX-License-Identifier: GPL-2.0-or-later
//
// A sensor of a ranger: its properties, its state, and the errors of its readings.

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <cstdio>
#include <limits>
#include <vector>

#include "messages/assert.hh"
#include "models/model_choices.hh"
#include "models/noise.hh"
#include "models/property_checks.hh"
#include "models/ranger.hh"
#include "models/state_choice.hh"
#include "models/state_exchange.hh"
#include "sensing/fan.hh"
#include "worldfile/numbers.hh"
#include "worldfile/worldfile.hh"

namespace Stg {

namespace {

constexpr unsigned kMaxSamples = ModelRanger::kMaxSamples;
constexpr uint32_t kNoDirection = 0xffffffffu;

/// Negative lengths and NaN count as 0; infinity is allowed.
double Magnitude(double value) { return value > 0 ? value : 0.0; }

double FiniteOr0(double value) { return std::isfinite(value) ? value : 0.0; }

RangeNoise NoiseOf(const ModelRanger::Sensor& sensor) {
  return {sensor.range_noise_const, sensor.range_noise, sensor.angle_noise};
}

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
      time_increment(0),
      sample_count(1),
      color(0, 0, 1, 0.15),
      ray_model(RayModel::kDefault),
      table_fov_(std::numeric_limits<double>::quiet_NaN()),
      table_count_(0),
      first_direction_(kNoDirection),
      table_generation_(0),
      seeded_(false),
      pending_(0) {}

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
  LoadTimeIncrement(wf, entity);
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

void ModelRanger::Sensor::LoadTimeIncrement(Worldfile* wf, int entity) {
  time_increment = wf->ReadFloat(entity, "time_increment", time_increment);
  CheckNotNegative(*wf, entity, "time_increment", time_increment);
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

double ModelRanger::Sensor::Duration() const {
  return sample_count > 1 ? Magnitude(time_increment) * (sample_count - 1) : 0;
}

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

void ModelRanger::Sensor::ExchangeState(StateExchange& exchange) {
  StateChoice model_of_rays(&ray_model, RayModel::kExact);
  exchange(pose, size, range, fov, angle_noise, range_noise, range_noise_const, sample_count, color,
           model_of_rays);
  // Hashes of sensors without defects are those of older versions.
  if (!exchange.hashing() || Defects().Any()) exchange(range_step, blind_near, loss, steepest);
  if (!exchange.hashing() || time_increment != 0) exchange(time_increment);
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

/// Copies ranges from index `first` on, and finds intensities.
void ModelRanger::Sensor::Copy(const sensing::DeviceRanges& given, uint32_t first) {
  constexpr uint32_t kAtOnce = 16;
  double* const to = ranges.data() + first;
  double* const intensity = intensities.data() + first;
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

/// Completes the readings when all ranges are known.
void ModelRanger::Sensor::Finish() {
  AddErrors();
  if (response.exists()) FillValues();
}

/// Completes the readings after the last of rays that were cast one by one. Threads that pass on
/// the results of different rays may call it at once.
void ModelRanger::Sensor::FinishRay() {
  std::atomic_ref<uint32_t> pending(pending_);
  if (pending.load(std::memory_order_relaxed) > 0 &&
      pending.fetch_sub(1, std::memory_order_acq_rel) == 1)
    Finish();
}

/// Adds noise and defects to the readings. Rays without a return have no intensity.
void ModelRanger::Sensor::AddErrors() {
  const RangeDefects defects = Defects();
  AddRangeErrors(NoiseOf(*this), defects, range, &random_, ranges.data(), ranges.size());
  if (!defects.Any()) return;
  for (size_t i = 0; i < ranges.size(); i++)
    if (!(ranges[i] < range.max)) intensities[i] = 0;
}

}  // namespace Stg
