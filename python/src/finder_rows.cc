// SPDX-License-Identifier: GPL-2.0-or-later

#include "finder_rows.hh"

#include <algorithm>
#include <limits>
#include <span>
#include <vector>

#include "messages/assert.hh"
#include "models/bumper.hh"
#include "models/types/detections.hh"
#include "rows/row_bridge.hh"

namespace Stg::python {

namespace {

using Blob = ModelBlobfinder::Blob;
using Fiducial = ModelFiducial::Fiducial;
namespace put = Stg::detections;

template <class Detection>
struct ListReading {
  const char* type;
  const char* name;
  void (*real)(const Detection&, double* to);  // one of both is null
  void (*whole)(const Detection&, int32_t* to);
};

constexpr ListReading<Fiducial> kFiducials[] = {{"fiducial", "id", nullptr, put::PutId},
                                                {"fiducial", "range", put::PutRange, nullptr},
                                                {"fiducial", "bearing", put::PutBearing, nullptr},
                                                {"fiducial", "heading", put::PutHeading, nullptr}};
constexpr ListReading<Blob> kBlobs[] = {{"blobfinder", "color", put::PutColor, nullptr},
                                        {"blobfinder", "box", nullptr, put::PutBox},
                                        {"blobfinder", "range", put::PutBlobRange, nullptr}};

template <class Readings>
auto* FindByName(const Readings& readings, const std::string& type, const std::string& name) {
  const auto* const found = std::ranges::find_if(
      readings, [&](const auto& known) { return type == known.type && name == known.name; });
  return found == std::end(readings) ? nullptr : found;
}

bool IsKnown(const std::string& type, const std::string& name) {
  return (type == "bumper" && name == "hit") ||
         (name == "count" && (type == "fiducial" || type == "blobfinder")) ||
         FindByName(kFiducials, type, name) || FindByName(kBlobs, type, name);
}

template <class Detection, typename T>
void PutAll(std::span<const Detection> list, void (*put_one)(const Detection&, T* to), T nothing,
            const ReadingShape& space, void* to) {
  auto* const numbers = static_cast<T*>(to);
  const size_t width = space.Count(1), count = std::min(list.size(), space.lengths[0]);
  for (size_t i = 0; i < count; i++) put_one(list[i], numbers + i * width);
  std::fill(numbers + count * width, numbers + space.Count(), nothing);
}

template <class Detection, class Readings>
void PutList(const Readings& known, const std::string& type, const std::string& name,
             std::span<const Detection> list, const ReadingShape& space, void* to) {
  if (name == "count") {
    *static_cast<int32_t*>(to) = static_cast<int32_t>(list.size());
    return;
  }
  const ListReading<Detection>* const reading = FindByName(known, type, name);
  STAGE_ASSERT(reading);
  if (reading->real)
    PutAll(list, reading->real, std::numeric_limits<double>::quiet_NaN(), space, to);
  else
    PutAll(list, reading->whole, int32_t{0}, space, to);
}

void PutHits(const SensorOfRow& sensor, const RowOfCrowd& row, const ReadingShape& space,
             void* to) {
  const size_t lines = row.robots.scene->finders.bumper_lines.size();
  auto* const hits = static_cast<bool*>(to);
  const size_t count = row.rows.HasReadings(row.row, sensor.rate) ? sensor.count : 0;
  for (size_t i = 0; i < count; i++)
    hits[i] =
        row.rows.columns.bumps[row.row * lines + sensor.first + i].model != rows::Bump::kNobody;
  std::fill(hits + count, hits + space.Count(), false);
}

std::span<const Blob> BlobsOf(const SensorOfRow& sensor, const RowOfCrowd& row) {
  const rows::Finders& finders = row.robots.scene->finders;
  const rows::Columns& c = row.rows.columns;
  return {
      c.blobs.data() + row.row * finders.blob_count + finders.blobfinders[sensor.first].first_blob,
      c.blobs_seen[row.row * finders.blobfinders.size() + sensor.first]};
}

}  // namespace

bool IsFinderOfRows(const ModelType& type) {
  return (type.name == "bumper" || type.name == "fiducial" || type.name == "blobfinder") &&
         std::ranges::all_of(type.readings,
                             [&](const Reading& of) { return IsKnown(type.name, of.name); });
}

void FindInFinders(const rows::Finders& finders, SensorOfRow* sensor) {
  const auto find = [&](const auto& list, auto member) {
    for (uint32_t i = 0; i < list.size(); i++) {
      if (static_cast<const Model*>(list[i].*member) != sensor->model) continue;
      if (sensor->count == 0) sensor->first = i;
      sensor->count++;
    }
  };
  find(finders.bumper_lines, &rows::BumperLine::bumper);
  find(finders.fiducial_finders, &rows::FiducialFinder::model);
  find(finders.blobfinders, &rows::Blobfinder::model);
}

void FillFromFinder(const Reading& reading, const SensorOfRow& sensor, const RowOfCrowd& row,
                    const ReadingShape& space, void* to) {
  const bool has_readings = sensor.count > 0 && row.rows.HasReadings(row.row, sensor.rate);
  const rows::Finders& finders = row.robots.scene->finders;
  if (!has_readings) return CopyReading(reading, nullptr, space, to);
  const std::string& type = FindModelType(*sensor.model)->name;
  if (type == "bumper") return PutHits(sensor, row, space, to);
  if (type == "blobfinder")
    return PutList(kBlobs, type, reading.name, BlobsOf(sensor, row), space, to);
  static thread_local std::vector<Fiducial> fiducials;  // static to reuse its memory
  fiducials.clear();
  RowBridge::ListFiducials(row.rows, row.row, finders.fiducial_finders[sensor.first], &fiducials);
  PutList(kFiducials, type, reading.name, std::span<const Fiducial>(fiducials), space, to);
}

}  // namespace Stg::python
