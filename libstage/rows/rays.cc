// SPDX-License-Identifier: GPL-2.0-or-later
//
// Readings of a row's rangers. Rays are traced among what stands by the code that also traces the
// rays of worlds; then they are compared with the outlines of the other robots of the row.

#include <algorithm>

#include "messages/assert.hh"
#include "models/noise.hh"
#include "rows/meet.hh"
#include "rows/row_bridge.hh"
#include "rows/stepper.hh"
#include "sensing/exact_visit.hh"

namespace Stg::rows {

namespace sensing = internal::sensing;
namespace grid = internal::grid;

namespace {

bool StopsRangers(Model* candidate, const Model*, const void*) {
  return !(candidate->vis.ranger_return < 0.0);
}

}  // namespace

/// Casts the rays of all sensors that update. If nobody sees the readings, only those of sensors
/// that are needed: noise draws as many random numbers as the readings decide.
void Rows::Stepper::CastRays() {
  if (!scene_.HasOneRate()) KeepScanPoses();
  if (!(due_ & ~unseen_) && !scene_.needs_rays && !scene_.finders.any) return;
  if (scene_.exact) PlaceCorners();
  for (size_t k = 0; k < scene_.sensors.size(); k++) {
    const Sensor& sensor = scene_.sensors[k];
    if (!Casts(sensor)) continue;
    PlaceFan(k);
    const sensing::Fan& fan = s_.fans[k];
    std::fill_n(&c_.ranges[ray_ + sensor.first_ray], sensor.rays, fan.range);
    std::fill_n(&c_.brightness[ray_ + sensor.first_ray], sensor.rays, uint8_t{0});
    std::fill_n(&s_.places[sensor.first_ray], sensor.rays, kNowhere);
    s_.rays[k] = DirectionsOf(k);
    if (!fan.nothing && MayHitWalls(sensor.seen, fan)) AddToGroup(k);
  }
  TraceGroup();
  for (size_t k = 0; k < scene_.sensors.size(); k++) {
    if (!Casts(scene_.sensors[k])) continue;
    if (!s_.fans[k].nothing) TraceRobots(k);
    if (scene_.sensors[k].noisy) AddNoise(k);
  }
}

/// Keeps the poses of rangers, which may be sensed later than those of their robots, or earlier.
void Rows::Stepper::KeepScanPoses() {
  for (size_t k = 0; k < scene_.sensors.size(); k++) {
    const Sensor& sensor = scene_.sensors[k];
    if (!IsDue(sensor.rate)) continue;
    const Placed place =
        scene_.movers[sensor.mover].GlobalPoseOf(sensor.node, PlaceOf(sensor.mover));
    c_.scan[sensor_ + k] = {place.x, place.y, place.a};
  }
}

/// Sets up the fans of all sensors. See ModelRanger::FanOf().
void Rows::Scratch::MakeFans(const Scene& scene) {
  for (const Sensor& sensor : scene.sensors) {
    sensing::Fan fan;
    sensing::PlaceFan(&fan, Pose(0, 0, sensor.z, 0), sensor.reach, scene.cells_per_metre);
    fan.exact = sensor.exact;
    fan.layer = sensor.layer;
    fan.predicate = StopsRangers;
    fan.record.samples = sensor.rays;
    fans.push_back(fan);
  }
}

void Rows::Stepper::PlaceFan(size_t index) {
  const Sensor& sensor = scene_.sensors[index];
  if (!(sensor.reach > 0)) return;  // it casts no rays anywhere
  const RememberedPlaced root{PlaceOf(sensor.mover), &s_.turns};
  const Placed origin =
      (scene_.movers[sensor.mover].FrameOf(sensor.node, root) + sensor.settings->pose).place;
  sensing::MoveFan(&s_.fans[index], origin.x, origin.y, origin.turn, scene_.cells_per_metre);
}

/// False if nothing that stands is within the reach of the rays.
bool Rows::Stepper::MayHitWalls(uint32_t seen, const sensing::Fan& fan) const {
  constexpr int32_t kMargin = 3;  // cells, for rounding and outlines beside their cells
  return !scene_.seen[seen].IsClear(fan.record.x, fan.record.y,
                                    static_cast<int32_t>(fan.leg_cells) + kMargin);
}

/// See ModelRanger::Gather().
RaysOfSensor Rows::Stepper::DirectionsOf(size_t index) {
  const Sensor& sensor = scene_.sensors[index];
  const RangeNoise& noise = NoiseOf(index);
  if (!sensor.turns_noisily || !noise.TurnsRays(sensor.increment))
    return {scene_.directions.all().data() + sensor.first_direction,
            scene_.directions.unit_vectors().data() + sensor.first_direction};
  const std::vector<double>& bearings = sensor.settings->bearings;
  RandomStream* const stream = &c_.noise[sensor_ + index];
  sensing::Direction* const directions = &s_.own_directions[sensor.first_ray];
  SineCosine* const unit_vectors = &s_.own_unit_vectors[sensor.first_ray];
  for (uint32_t i = 0; i < sensor.rays; i++) {
    const double bearing =
        bearings[i] + sensor.increment * noise.angle * 0.5 * UniformError(stream);
    unit_vectors[i] = sensing::UnitVectorOf(bearing);
    directions[i] = sensing::MakeDirection(unit_vectors[i]);
  }
  return {directions, unit_vectors};
}

// ---- what stands --------------------------------------------------------------------------------

/// Adds the rays of a sensor to the group that is traced next.
void Rows::Stepper::AddToGroup(size_t index) {
  const Sensor& sensor = scene_.sensors[index];
  const sensing::Fan& fan = s_.fans[index];
  if (s_.slice_count > 0) {
    const Sensor& first = scene_.sensors[s_.parts[0].sensor];
    if (first.layer != sensor.layer || first.exact != sensor.exact) TraceGroup();
  }
  for (uint32_t begin = 0; begin < sensor.rays;) {
    if (s_.group_rays == sensing::RayGroup::kMaxRays) TraceGroup();
    const uint32_t count =
        std::min(sensor.rays - begin, sensing::RayGroup::kMaxRays - s_.group_rays);
    const RaysOfSensor& rays = s_.rays[index];
    s_.slices[s_.slice_count] = {&fan.record, rays.directions + begin, count, fan.leg_length,
                                 nullptr};
    s_.exact_slices[s_.slice_count] = {&fan, rays.unit_vectors + begin};
    s_.parts[s_.slice_count] = {static_cast<uint32_t>(index), begin};
    s_.slice_count++;
    s_.group_rays += count;
    begin += count;
  }
}

/// Traces the group among what stands.
void Rows::Stepper::TraceGroup() {
  if (s_.slice_count == 0) return;
  const Sensor& first = scene_.sensors[s_.parts[0].sensor];
  const ray_grid_t view = scene_.grid.View(first.layer);
  const ray_mask_t no_mask{};
  const sensing::RayGroup group{.grid = &view,
                                .mask = &no_mask,
                                .slices = s_.slices,
                                .slice_count = s_.slice_count,
                                .count = s_.group_rays,
                                .words_per_ray = 0,
                                .exact = first.exact};
  s_.first.Walk(group, s_.walked);
  if (first.exact) s_.exact.Trace(group, s_.exact_slices, s_.first, s_.walked, &s_.counters);
  for (uint32_t slice = 0, ray = 0; slice < s_.slice_count; ray += s_.slices[slice++].count) {
    if (first.exact)
      StoreExactHits(s_.parts[slice], ray, s_.slices[slice].count);
    else
      StoreHits(s_.parts[slice], ray, s_.slices[slice].count);
  }
  s_.slice_count = s_.group_rays = 0;
}

/// Stores the hits of a part of a sensor's rays; `first` is the first of them in the group.
void Rows::Stepper::StoreHits(const PartOfGroup& part, uint32_t first, uint32_t count) {
  const Sensor& sensor = scene_.sensors[part.sensor];
  const sensing::Fan& fan = s_.fans[part.sensor];
  const size_t at = size_t{sensor.first_ray} + part.begin - first;  // wraps; added to rays
  for (uint32_t i = first; i < first + count;) {
    const uint32_t end = s_.first.EndOfInterval(i);
    const grid::BodyList bodies = s_.first.Bodies(i);
    if (bodies == sensing::FirstHits::kNothing) {
      i = end;
      continue;
    }
    for (; i < end; i++) {
      const uint32_t hit = s_.first.Packed(i);
      if (AcceptBody(fan, bodies, at + i)) {
        c_.ranges[ray_ + at + i] = s_.walked[i];
        s_.places[at + i] = ray_packed_u(hit) + ray_packed_v(hit);
      } else {
        FollowWall(part.sensor, part.begin + i - first, hit);
      }
    }
  }
}

void Rows::Stepper::StoreExactHits(const PartOfGroup& part, uint32_t first, uint32_t count) {
  const size_t at = size_t{scene_.sensors[part.sensor].first_ray} + part.begin;
  for (uint32_t i = 0; i < count; i++) {
    c_.ranges[ray_ + at + i] = s_.walked[first + i];
    const Model* const model = s_.exact.HitModel(first + i);
    if (model == nullptr) continue;
    s_.places[at + i] = 0;
    s_.keys[at + i] = model->GetId();
    c_.brightness[ray_ + at + i] = BrightnessOf(*model);
  }
}

/// Continues a ray behind a cell whose bodies it passes.
void Rows::Stepper::FollowWall(size_t index, uint32_t sample, uint32_t hit) {
  const sensing::Fan& fan = s_.fans[index];
  const size_t number = scene_.sensors[index].first_ray + sample;
  FollowRay(
      fan, s_.rays[index].directions[sample], hit,
      [&](grid::BodyList bodies) { return AcceptBody(fan, bodies, number); },
      &c_.ranges[ray_ + number], &s_.places[number]);
}

/// Stores what the ray hits in a cell with these bodies; false if it passes all of them.
bool Rows::Stepper::AcceptBody(const sensing::Fan& fan, grid::BodyList bodies, size_t ray) {
  return scene_.grid.AnyOf(bodies, [&](grid::BodyId id) {
    const grid::Body& body = scene_.grid.body(id);
    if (sensing::PassesAboveOrBelow(fan, body) || !StopsRangers(body.model, nullptr, nullptr))
      return false;
    s_.keys[ray] = scene_.grid.Stamp(id);
    c_.brightness[ray_ + ray] = BrightnessOf(*body.model);
    return true;
  });
}

uint8_t Rows::Stepper::BrightnessOf(const Model& model) const {
  const std::vector<double>& values = scene_.brightness;
  const auto found = std::ranges::find(values, model.vis.ranger_return);
  STAGE_ASSERT(found != values.end());
  return static_cast<uint8_t>(found - values.begin());
}

// ---- robots -------------------------------------------------------------------------------------

template <class Word>
void Rows::Stepper::MeetInCells(size_t index, uint32_t number) {
  const Sensor& sensor = scene_.sensors[index];
  const sensing::Fan& fan = s_.fans[index];
  const uint64_t key = DrawingOrder(number);
  ForEachMeeting<Word>(fan, s_.rays[index], sensor.rays, number,
                       [&](uint32_t i, const CellRay& ray, int32_t u, int32_t v) {
                         const size_t at = sensor.first_ray + i;
                         const int32_t place = u + v;
                         if (place > s_.places[at] || (place == s_.places[at] && key > s_.keys[at]))
                           return;
                         s_.places[at] = place;
                         s_.keys[at] = key;
                         c_.brightness[ray_ + at] = scene_.bodies[number].brightness;
                         c_.ranges[ray_ + at] = RangeAt(fan, ray, u, v);
                       });
}

void Rows::Stepper::TraceRobots(size_t index) {
  const Sensor& sensor = scene_.sensors[index];
  const sensing::Fan& fan = s_.fans[index];
  for (const uint32_t other : sensor.others) {
    const Body& body = scene_.bodies[other];
    if (IsOutOfReach(fan, body)) continue;
    if (sensor.exact)
      MeetExactly(index, body);
    else if (scene_.narrow)
      MeetInCells<NarrowWord>(index, other);
    else
      MeetInCells<WideWord>(index, other);
  }
}

/// Corners of all bodies in metres, for exact rays.
void Rows::Stepper::PlaceCorners() {
  for (const Body& body : scene_.bodies) {
    const Placed frame = scene_.movers[body.mover].FrameOf(body.node, PlaceOf(body.mover));
    const SineCosine& turn = frame.turn;
    point_t* const points = &s_.points[body.first_point];
    for (size_t i = 0; i < body.corners.size(); i++) {
      const point_t& p = body.corners[i];
      points[i] = point_t(frame.x + p.x * turn.cosine - p.y * turn.sine,
                          frame.y + p.x * turn.sine + p.y * turn.cosine);
    }
    points[body.corners.size()] = points[0];
  }
}

/// See ExactVisit.
void Rows::Stepper::MeetExactly(size_t index, const Body& body) {
  const Sensor& sensor = scene_.sensors[index];
  double* const ranges = &c_.ranges[ray_ + sensor.first_ray];
  const uint64_t key = body.model->GetId();
  ForEachCrossing(
      s_.fans[index], s_.rays[index], sensor.rays, body, [&](uint32_t i) { return ranges[i]; },
      [&](uint32_t i, double along) {
        const size_t ray = sensor.first_ray + i;
        if (!IsNearer(along, key, s_.places[ray] != kNowhere, ranges[i], s_.keys[ray])) return;
        ranges[i] = along;
        s_.places[ray] = 0;
        s_.keys[ray] = key;
        c_.brightness[ray_ + ray] = body.brightness;
      });
}

void Rows::Stepper::AddNoise(size_t index) {
  const Sensor& sensor = scene_.sensors[index];
  const size_t first = ray_ + sensor.first_ray;
  AddRangeErrors(NoiseOf(index), sensor.defects, sensor.settings->range, &c_.noise[sensor_ + index],
                 &c_.ranges[first], sensor.rays);
  if (!sensor.defects.Any()) return;
  for (size_t i = first; i < first + sensor.rays; i++)
    if (!(c_.ranges[i] < sensor.settings->range.max)) c_.brightness[i] = 0;
}

}  // namespace Stg::rows
