// SPDX-License-Identifier: GPL-2.0-or-later
//
// The type "ranger", and its readings for arrays, logs and plug-ins.

#include <algorithm>
#include <cstring>
#include <limits>
#include <vector>

#include "geometry/trigonometry.hh"
#include "models/ranger.hh"
#include "models/types/built_in_types.hh"
#include "sensing/fan.hh"

namespace Stg {

namespace {

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
    *to++ = normalize(origin.a + sensing::SampleBearing(sensor.fov, sensor.sample_count, sample));
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

}  // namespace Stg
