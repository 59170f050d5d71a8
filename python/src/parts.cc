// SPDX-License-Identifier: GPL-2.0-or-later

#include "parts.hh"

#include <cmath>
#include <cstring>

#include "sensing/fan.hh"

namespace Stg::python {

namespace {

size_t SamplesOf(const ModelRanger& ranger) {
  size_t samples = 0;
  for (const ModelRanger::Sensor& sensor : ranger.GetSensors()) samples += sensor.sample_count;
  return samples;
}

/// Copies one kind of readings of all sensors of a ranger into `row`, which has `room` elements.
void Collect(const ModelRanger* ranger, std::vector<double> ModelRanger::Sensor::*readings,
             double* row, size_t room) {
  size_t filled = 0;
  if (ranger)
    for (const ModelRanger::Sensor& sensor : ranger->GetSensors()) {
      const std::vector<double>& from = sensor.*readings;
      const size_t expected = std::min<size_t>(sensor.sample_count, room - filled);
      const size_t known = std::min(from.size(), expected);
      if (known > 0) std::memcpy(row + filled, from.data(), known * sizeof(double));
      std::fill(row + filled + known, row + filled + expected, kUnknown);
      filled += expected;
    }
  std::fill(row + filled, row + room, kUnknown);
}

/// The frame of a ranger's sensors, relative to the robot that carries it.
Pose FrameOf(const ModelRanger& ranger) {
  Pose frame = ranger.GetGeom().pose;
  for (const Model* model = &ranger; model->Parent(); model = model->Parent())
    frame = model->GetSensedLocalPose() + frame;
  return frame;
}

}  // namespace

RangerPart::RangerPart(const std::vector<Members>& members, size_t index)
    : SensorPart(members, index), samples(Widest("ranger", SamplesOf)) {}

void RangerPart::FillRow(size_t world, size_t robot, ModelRanger* ranger) {
  if (ranges.exists())
    Collect(ranger, &ModelRanger::Sensor::ranges, ranges.Row<double>(world, robot), samples);
  if (intensities.exists())
    Collect(ranger, &ModelRanger::Sensor::intensities, intensities.Row<double>(world, robot),
            samples);
  if (!bearings.exists() && !origins.exists()) return;
  for (const Array* array : {&bearings, &origins}) {
    if (!array->exists()) continue;
    double* const row = array->Row<double>(world, robot);
    std::fill(row, row + array->row(), kUnknown);
  }
  if (ranger) FillDirections(world, robot, *ranger);
}

/// Fills bearings and origins from the geometry, so they are valid before the first measurement.
void RangerPart::FillDirections(size_t world, size_t robot, const ModelRanger& ranger) const {
  const Pose frame = FrameOf(ranger);
  const SineCosine turn = SinCos(frame.a);
  size_t ray = 0;
  for (const ModelRanger::Sensor& sensor : ranger.GetSensors()) {
    const Pose origin = ModelRanger::OriginOf(sensor, frame, turn);
    for (uint32_t i = 0; i < sensor.sample_count && ray < samples; i++, ray++) {
      if (bearings.exists())
        bearings.Row<double>(world, robot)[ray] =
            normalize(origin.a + sensing::SampleBearing(std::isfinite(sensor.fov) ? sensor.fov : 0,
                                                        sensor.sample_count, i));
      if (!origins.exists()) continue;
      double* const point = origins.Row<double>(world, robot) + 2 * ray;
      point[0] = origin.x;
      point[1] = origin.y;
    }
  }
}

// ---- fiducials ----------------------------------------------------------------------------------

FiducialPart::FiducialPart(const std::vector<Members>& members, size_t index, size_t most_kept)
    : SensorPart(members, index), most(most_kept) {
  Widest("fiducial finder", [](const ModelFiducial&) { return 0; });
  count.Make<int32_t>({found.size(), found[0].size()});
  id.Make<int32_t>(Shape(most));
  for (Array* array : {&range, &bearing, &heading}) array->Make<double>(Shape(most));
}

void FiducialPart::FillRow(size_t world, size_t robot, ModelFiducial* finder) {
  static const std::vector<ModelFiducial::Fiducial> kNone;
  const std::vector<ModelFiducial::Fiducial>& seen = finder ? finder->GetFiducials() : kNone;
  *count.Row<int32_t>(world, robot) = static_cast<int32_t>(seen.size());
  for (size_t i = 0; i < most; i++) {
    const bool there = i < seen.size();
    id.Row<int32_t>(world, robot)[i] = there ? seen[i].id : 0;
    range.Row<double>(world, robot)[i] = there ? seen[i].range : kUnknown;
    bearing.Row<double>(world, robot)[i] = there ? seen[i].bearing : kUnknown;
    heading.Row<double>(world, robot)[i] = there ? seen[i].geom.a : kUnknown;
  }
}

// ---- blobs --------------------------------------------------------------------------------------

BlobPart::BlobPart(const std::vector<Members>& members, size_t index, size_t most_kept)
    : SensorPart(members, index), most(most_kept) {
  Widest("blobfinder", [](const ModelBlobfinder&) { return 0; });
  count.Make<int32_t>({found.size(), found[0].size()});
  color.Make<double>({found.size(), found[0].size(), most, 4});
  box.Make<int32_t>({found.size(), found[0].size(), most, 4});
  range.Make<double>(Shape(most));
}

void BlobPart::FillRow(size_t world, size_t robot, ModelBlobfinder* finder) {
  static const std::vector<ModelBlobfinder::Blob> kNone;
  static const ModelBlobfinder::Blob kNoBlob;
  const std::vector<ModelBlobfinder::Blob>& seen = finder ? finder->GetBlobs() : kNone;
  *count.Row<int32_t>(world, robot) = static_cast<int32_t>(seen.size());
  for (size_t i = 0; i < most; i++) {
    const bool there = i < seen.size();
    const ModelBlobfinder::Blob& blob = there ? seen[i] : kNoBlob;
    const double colors[] = {blob.color.r, blob.color.g, blob.color.b, blob.color.a};
    const uint32_t sides[] = {blob.left, blob.top, blob.right, blob.bottom};
    for (size_t k = 0; k < 4; k++) {
      color.Row<double>(world, robot)[4 * i + k] = there ? colors[k] : kUnknown;
      box.Row<int32_t>(world, robot)[4 * i + k] = static_cast<int32_t>(sides[k]);
    }
    range.Row<double>(world, robot)[i] = there ? blob.range : kUnknown;
  }
}

// ---- cameras ------------------------------------------------------------------------------------

CameraPart::CameraPart(const std::vector<Members>& members, size_t index)
    : SensorPart(members, index),
      width_(Widest("camera", [](const ModelCamera& c) { return c.getWidth(); })),
      height_(Widest("camera", [](const ModelCamera& c) { return c.getHeight(); })) {}

void CameraPart::Make(Array* array) const {
  std::vector<size_t> shape{found.size(), found[0].size(), height_, width_};
  if (array == &depth) return array->Make<float>(shape);
  shape.push_back(3);
  array->Make<uint8_t>(shape);
}

void CameraPart::FillRow(size_t world, size_t robot, ModelCamera* camera) {
  const size_t width = camera ? std::min<size_t>(camera->getWidth(), width_) : 0;
  const size_t height = camera ? std::min<size_t>(camera->getHeight(), height_) : 0;
  const auto from = [&](size_t row) {  // first pixel of a row; the camera's rows are bottom up
    return (static_cast<size_t>(camera->getHeight()) - 1 - row) *
           static_cast<size_t>(camera->getWidth());
  };
  if (depth.exists()) {
    float* const to = depth.Row<float>(world, robot);
    std::fill(to, to + depth.row(), std::numeric_limits<float>::quiet_NaN());
    if (camera && camera->FrameDepth())
      for (size_t row = 0; row < height; row++)
        std::copy_n(camera->FrameDepth() + from(row), width, to + row * width_);
  }
  if (!color.exists()) return;
  uint8_t* const to = color.Row<uint8_t>(world, robot);
  std::fill(to, to + color.row(), uint8_t{0});
  if (!camera || !camera->FrameColor()) return;
  for (size_t row = 0; row < height; row++) {
    const GLubyte* pixel = camera->FrameColor() + 4 * from(row);
    uint8_t* out = to + 3 * row * width_;
    for (size_t i = 0; i < width; i++, pixel += 4, out += 3) std::copy_n(pixel, 3, out);
  }
}

// ---- bumpers ------------------------------------------------------------------------------------

BumperPart::BumperPart(const std::vector<Members>& members, size_t index)
    : SensorPart(members, index) {
  hit.Make<bool>(Shape(Widest("bumper", [](const ModelBumper& b) { return b.bumper_count; })));
}

void BumperPart::FillRow(size_t world, size_t robot, ModelBumper* bumper) {
  bool* const row = hit.Row<bool>(world, robot);
  for (size_t i = 0; i < hit.row(); i++)
    row[i] = bumper && bumper->samples && i < bumper->bumper_count && bumper->samples[i].hit;
}

}  // namespace Stg::python
