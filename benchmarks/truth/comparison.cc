// SPDX-License-Identifier: GPL-2.0-or-later

#include "benchmarks/truth/comparison.hh"

#include <algorithm>
#include <cmath>

namespace truth {

namespace {

using Mode = ComparisonOptions::Mode;

/// Same as the rangers' own function, but written independently so that a mistake there would show.
bool StopsRanger(Stg::Model* candidate, const Stg::Model* finder, const void*) {
  return !candidate->IsRelated(finder) && !(candidate->vis.ranger_return < 0.0);
}

/// Bearing of one of `count` beams over a field of view, including its ends.
Real BearingOf(double fov, unsigned count, unsigned i) {
  return count < 2 ? 0 : Real{fov} * (Real(i) / Real(count - 1) - 0.5L);
}

}  // namespace

Comparison::Comparison(Stg::World* world, const ComparisonOptions& options,
                       std::function<void(const Reading&)> report)
    : world_(world), options_(options), report_(std::move(report)) {
  std::vector<Stg::ModelRanger*> rangers;
  for (Stg::Model* model : world->GetAllModels())
    if (auto* ranger = dynamic_cast<Stg::ModelRanger*>(model)) rangers.push_back(ranger);
  std::sort(rangers.begin(), rangers.end(),
            [](const auto* a, const auto* b) { return a->GetId() < b->GetId(); });
  for (Stg::ModelRanger* ranger : rangers) {
    Watched& watched = watched_.emplace_back();
    watched.ranger = ranger;
    ranger->AddCallback(Stg::Model::CB_UPDATE, NoteUpdate, &watched);
    ranger->Subscribe();
  }
}

int Comparison::NoteUpdate(Stg::Model* model, void* user) {
  Watched* watched = static_cast<Watched*>(user);
  watched->updated = true;
  watched->looked_at = model->GetWorld()->SimTimeNow();
  return 0;
}

bool Comparison::Wanted(const Watched& watched) const {
  return !(options_.once && watched.reported);
}

bool Comparison::HasReportedAll() const {
  return std::all_of(watched_.begin(), watched_.end(), [](const Watched& w) { return w.reported; });
}

bool Comparison::Step(bool compare) {
  if (compare) scene_.Take(*world_);
  for (Watched& watched : watched_) {
    watched.updated = false;
    if (compare && Wanted(watched)) TakeBefore(&watched);
  }
  if (world_->Update()) return true;
  if (!compare) return false;
  for (Watched& watched : watched_) {
    if (!Wanted(watched)) continue;
    if (!watched.updated && options_.mode != Mode::kHeld) continue;
    Report(watched);
    watched.reported = true;
  }
  return false;
}

void Comparison::TakeBefore(Watched* watched) {
  watched->sensors.clear();
  for (const Stg::ModelRanger::Sensor& sensor : watched->ranger->GetSensors()) {
    Before before;
    before.from = ViewpointOf(*watched->ranger, sensor);
    before.fov = sensor.fov;
    before.range = std::max(sensor.range.max, 0.0);
    before.count = sensor.sample_count;
    before.noisy =
        sensor.angle_noise != 0 || sensor.range_noise != 0 || sensor.range_noise_const != 0;
    before.clearance = scene_.Clearance(before.from, before.range);
    if (options_.mode == Mode::kFresh && before.count > 0) {
      // Traces each ray for the model that it hits, which readings do not contain.
      before.seen.resize(before.count);
      Stg::Pose pose = watched->ranger->GetGlobalPose() + watched->ranger->GetGeom().pose;
      pose = pose + sensor.pose;
      pose.z = before.from.z;
      world_->Raytrace(pose, before.range, before.fov, StopsRanger, watched->ranger, nullptr, true,
                       before.seen);
    }
    watched->sensors.push_back(std::move(before));
  }
}

void Comparison::Report(const Watched& watched) {
  const auto& sensors = watched.ranger->GetSensors();
  Reading reading;
  reading.time = world_->SimTimeNow();
  reading.age = reading.time - watched.looked_at;
  reading.ranger = watched.ranger;
  for (size_t i = 0; i < std::min(sensors.size(), watched.sensors.size()); i++) {
    const Before& before = watched.sensors[i];
    // A controller may have changed the sensor, or it has no reading yet.
    if (sensors[i].ranges.size() != before.count) continue;
    if (before.noisy) {
      noisy_readings_ += before.count;
      continue;
    }
    reading.sensor = static_cast<unsigned>(i);
    reading.from = before.from;
    reading.range = before.range;
    reading.clearance = before.clearance;
    if (options_.mode == Mode::kBetween)
      ReportBetween(reading, before, sensors[i]);
    else
      ReportBeams(reading, before, sensors[i]);
  }
}

void Comparison::ReportBeams(const Reading& common, const Before& before,
                             const Stg::ModelRanger::Sensor& sensor) {
  // Far smaller than any relevant error, but greater than the rounding error of a pose: within it,
  // the traced ray is that of the sensor.
  constexpr double kSame = 1e-7;
  Reading reading = common;
  for (unsigned i = 0; i < before.count; i++) {
    const Real bearing = BearingOf(before.fov, before.count, i);
    reading.sample = i;
    reading.bearing = static_cast<double>(bearing);
    reading.value = sensor.ranges[i];
    reading.truth = scene_.Cast(before.from, bearing, before.range);
    reading.seen = nullptr;
    reading.seen_is_known = false;
    if (i < before.seen.size() && std::fabs(before.seen[i].range - reading.value) <= kSame) {
      reading.seen = before.seen[i].mod;
      reading.seen_is_known = true;
    }
    report_(reading);
  }
}

/// Linear interpolation between the two neighbouring beams, as by a user who takes the beams for
/// the whole picture. No hit counts as the maximum range, in readings and truth.
void Comparison::ReportBetween(const Reading& common, const Before& before,
                               const Stg::ModelRanger::Sensor& sensor) {
  if (before.count < 2 || before.fov == 0 || !std::isfinite(before.range)) return;
  Reading reading = common;
  reading.between = true;
  for (unsigned i = 0; i < options_.bearings; i++) {
    const Real bearing = BearingOf(before.fov, options_.bearings, i);
    const Real place = Real(i) * Real(before.count - 1) / Real(std::max(options_.bearings, 2u) - 1);
    const size_t left = std::min(static_cast<size_t>(place), size_t{before.count} - 2);
    const Real fraction = place - Real(left);
    reading.sample = i;
    reading.bearing = static_cast<double>(bearing);
    reading.value = static_cast<double>(sensor.ranges[left] * (1 - fraction) +
                                        sensor.ranges[left + 1] * fraction);
    reading.truth = scene_.Cast(before.from, bearing, before.range);
    report_(reading);
  }
}

}  // namespace truth
