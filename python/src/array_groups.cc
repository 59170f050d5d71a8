// SPDX-License-Identifier: GPL-2.0-or-later

#include "array_groups.hh"

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

/// Copies one kind of readings of all sensors of a ranger into `row`, which has `capacity`
/// elements.
void Collect(const ModelRanger* ranger, std::vector<double> ModelRanger::Sensor::*readings,
             double* row, size_t capacity) {
  size_t filled = 0;
  if (ranger)
    for (const ModelRanger::Sensor& sensor : ranger->GetSensors()) {
      const std::vector<double>& from = sensor.*readings;
      const size_t expected = std::min<size_t>(sensor.sample_count, capacity - filled);
      const size_t known = std::min(from.size(), expected);
      if (known > 0) std::memcpy(row + filled, from.data(), known * sizeof(double));
      std::fill(row + filled + known, row + filled + expected, kNaN);
      filled += expected;
    }
  std::fill(row + filled, row + capacity, kNaN);
}

/// The frame of a ranger's sensors, relative to the robot that carries it.
Pose FrameOf(const ModelRanger& ranger) {
  Pose frame = ranger.GetGeom().pose;
  for (const Model* model = &ranger; model->Parent(); model = model->Parent())
    frame = model->GetSensedLocalPose() + frame;
  return frame;
}

}  // namespace

RangerArrays::RangerArrays(const std::vector<Members>& members, size_t index)
    : SensorArrays(members, index), samples(MaxWidth("ranger", SamplesOf)) {}

void RangerArrays::FillRow(size_t world, size_t robot, ModelRanger* ranger) {
  if (ranges.exists())
    Collect(ranger, &ModelRanger::Sensor::ranges, ranges.Row<double>(world, robot), samples);
  if (intensities.exists())
    Collect(ranger, &ModelRanger::Sensor::intensities, intensities.Row<double>(world, robot),
            samples);
  if (!bearings.exists() && !origins.exists()) return;
  for (const Array* array : {&bearings, &origins}) {
    if (!array->exists()) continue;
    double* const row = array->Row<double>(world, robot);
    std::fill(row, row + array->row(), kNaN);
  }
  if (ranger) FillDirections(world, robot, *ranger);
}

/// Fills bearings and origins from the geometry, so they are valid before the first measurement.
void RangerArrays::FillDirections(size_t world, size_t robot, const ModelRanger& ranger) const {
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

FiducialArrays::FiducialArrays(const std::vector<Members>& members, size_t index, size_t max_kept)
    : SensorArrays(members, index), max_count(max_kept) {
  MaxWidth("fiducial finder", [](const ModelFiducial&) { return 0; });
  count.Make<int32_t>({found.size(), found[0].size()});
  id.Make<int32_t>(Shape(max_count));
  for (Array* array : {&range, &bearing, &heading}) array->Make<double>(Shape(max_count));
}

void FiducialArrays::FillRow(size_t world, size_t robot, ModelFiducial* finder) {
  static const std::vector<ModelFiducial::Fiducial> kNone;
  const std::vector<ModelFiducial::Fiducial>& seen = finder ? finder->GetFiducials() : kNone;
  *count.Row<int32_t>(world, robot) = static_cast<int32_t>(seen.size());
  for (size_t i = 0; i < max_count; i++) {
    const bool there = i < seen.size();
    id.Row<int32_t>(world, robot)[i] = there ? seen[i].id : 0;
    range.Row<double>(world, robot)[i] = there ? seen[i].range : kNaN;
    bearing.Row<double>(world, robot)[i] = there ? seen[i].bearing : kNaN;
    heading.Row<double>(world, robot)[i] = there ? seen[i].geom.a : kNaN;
  }
}

// ---- blobs --------------------------------------------------------------------------------------

BlobArrays::BlobArrays(const std::vector<Members>& members, size_t index, size_t max_kept)
    : SensorArrays(members, index), max_count(max_kept) {
  MaxWidth("blobfinder", [](const ModelBlobfinder&) { return 0; });
  count.Make<int32_t>({found.size(), found[0].size()});
  color.Make<double>({found.size(), found[0].size(), max_count, 4});
  box.Make<int32_t>({found.size(), found[0].size(), max_count, 4});
  range.Make<double>(Shape(max_count));
}

void BlobArrays::FillRow(size_t world, size_t robot, ModelBlobfinder* finder) {
  static const std::vector<ModelBlobfinder::Blob> kNone;
  static const ModelBlobfinder::Blob kNoBlob;
  const std::vector<ModelBlobfinder::Blob>& seen = finder ? finder->GetBlobs() : kNone;
  *count.Row<int32_t>(world, robot) = static_cast<int32_t>(seen.size());
  for (size_t i = 0; i < max_count; i++) {
    const bool there = i < seen.size();
    const ModelBlobfinder::Blob& blob = there ? seen[i] : kNoBlob;
    const double colors[] = {blob.color.r, blob.color.g, blob.color.b, blob.color.a};
    const uint32_t sides[] = {blob.left, blob.top, blob.right, blob.bottom};
    for (size_t k = 0; k < 4; k++) {
      color.Row<double>(world, robot)[4 * i + k] = there ? colors[k] : kNaN;
      box.Row<int32_t>(world, robot)[4 * i + k] = static_cast<int32_t>(sides[k]);
    }
    range.Row<double>(world, robot)[i] = there ? blob.range : kNaN;
  }
}

// ---- cameras ------------------------------------------------------------------------------------

CameraArrays::CameraArrays(const std::vector<Members>& members, size_t index)
    : SensorArrays(members, index),
      width_(MaxWidth("camera", [](const ModelCamera& c) { return c.getWidth(); })),
      height_(MaxWidth("camera", [](const ModelCamera& c) { return c.getHeight(); })) {}

void CameraArrays::Make(Array* array) const {
  std::vector<size_t> shape{found.size(), found[0].size(), height_, width_};
  if (array == &depth) return array->Make<float>(shape);
  shape.push_back(3);
  array->Make<uint8_t>(shape);
}

void CameraArrays::FillRow(size_t world, size_t robot, ModelCamera* camera) {
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

BumperArrays::BumperArrays(const std::vector<Members>& members, size_t index)
    : SensorArrays(members, index) {
  hit.Make<bool>(Shape(MaxWidth("bumper", [](const ModelBumper& b) { return b.bumper_count; })));
}

void BumperArrays::FillRow(size_t world, size_t robot, ModelBumper* bumper) {
  bool* const row = hit.Row<bool>(world, robot);
  for (size_t i = 0; i < hit.row(); i++)
    row[i] = bumper && bumper->samples && i < bumper->bumper_count && bumper->samples[i].hit;
}

}  // namespace Stg::python
