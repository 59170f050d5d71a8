// SPDX-License-Identifier: GPL-2.0-or-later
//
// Readings of a row's bumpers, fiducial finders and blobfinders. They ask which model a ray hits.

#include <algorithm>
#include <cmath>
#include <span>

#include "geometry/trigonometry.hh"
#include "models/bumper.hh"
#include "models/bumper_touch.hh"
#include "models/fiducial.hh"
#include "rows/meet.hh"
#include "rows/row_bridge.hh"
#include "rows/stepper.hh"
#include "sensing/exact_visit.hh"

namespace Stg::rows {

namespace sensing = internal::sensing;
namespace grid = internal::grid;

/// Reserves memory for finders.
void Rows::Scratch::MakeLooks(const Finders& finders) {
  size_t most_rays = 1, targets = 0;
  for (const FiducialFinder& finder : finders.fiducial_finders)
    targets = std::max(targets, finder.targets.size());
  for (const Blobfinder& finder : finders.blobfinders)
    most_rays = std::max(most_rays, size_t{finder.rays});
  looks.resize(std::max(most_rays, targets));
  finder_directions.resize(targets);
  finder_unit_vectors.resize(targets);
  candidates.resize(targets);
  blob_ranges.resize(most_rays);
  blob_intervals.reserve(most_rays);
  blobs.reserve(most_rays);
}

void Rows::Stepper::FindModels() {
  const Finders& finders = scene_.finders;
  if (scene_.outlines && !finders.bumper_lines.empty()) FindContacts();
  for (size_t i = 0; i < finders.bumper_lines.size(); i++)
    if (IsDue(finders.bumper_lines[i].finder.rate)) TouchLine(i);
  for (size_t i = 0; i < finders.fiducial_finders.size(); i++)
    if (IsDue(finders.fiducial_finders[i].finder.rate)) FindFiducials(i);
  for (size_t i = 0; i < finders.blobfinders.size(); i++)
    if (IsDue(finders.blobfinders[i].finder.rate)) FindBlobs(i);
}

// ---- bumpers ------------------------------------------------------------------------------------

/// See ContactPhase::FindContacts().
void Rows::Stepper::FindContacts() {
  for (size_t k = 0; k < scene_.movers.size(); k++)
    if (scene_.movers[k].row != Mover::kNoRow) SetPose(k);
  s_.contacts.FindContacts(scene_.shapes, WallsNow(), s_.columns);
}

/// See ContactPhase::ListContacts().
void Rows::Stepper::ListContacts(std::vector<ContactPoint>* to) {
  to->clear();
  if (!scene_.outlines) return;
  FindContacts();
  const std::span<const motion::Contact> contacts = s_.contacts.contacts();
  std::vector<motion::Contact> sorted(contacts.begin(), contacts.end());
  std::ranges::stable_sort(sorted, {}, &motion::Contact::a);
  const Finders& finders = scene_.finders;
  for (const motion::Contact& contact : sorted) {
    const Model* const other =
        contact.wall ? finders.wall_models[contact.b] : finders.row_models[contact.b];
    to->push_back({const_cast<Model*>(finders.row_models[contact.a]), const_cast<Model*>(other),
                   point_t(contact.point.x, contact.point.y),
                   point_t(contact.normal.x, contact.normal.y), contact.gap});
  }
}

void Rows::FindContacts(size_t world, Scratch* scratch, std::vector<ContactPoint>* to) {
  Stepper(this, world, scratch).ListContacts(to);
}

/// See ModelBumper::AddLine() and ModelBumper::ReceiveHits().
void Rows::Stepper::TouchLine(size_t index) {
  const BumperLine& line = scene_.finders.bumper_lines[index];
  const Finder& finder = line.finder;
  const ModelBumper::BumperConfig& config = line.bumper->bumpers[line.index];
  const Placed frame = scene_.movers[finder.mover].FrameOf(finder.node, PlaceOf(finder.mover));
  const Placed middle = frame + Pose(config.pose.x, config.pose.y, 0, config.pose.a);
  const SineCosine along = SinCos(normalize(middle.a + M_PI / 2));
  const point_t start(middle.x - config.length / 2 * along.cosine,
                      middle.y - config.length / 2 * along.sine);
  sensing::Fan fan = finder.fan;
  if (fan.range > 0) sensing::MoveFan(&fan, start.x, start.y, along, scene_.cells_per_metre);
  const sensing::DirectionTables& tables = scene_.directions;
  TraceFinder(finder, fan,
              {&tables.all()[sensing::DirectionTables::kAhead],
               &tables.unit_vectors()[sensing::DirectionTables::kAhead]},
              1);
  Bump& bump = c_.bumps[world_ * scene_.finders.bumper_lines.size() + index];
  const Look& look = s_.looks[0];
  const Model* touching = look.model;
  point_t where(start.x + look.range * along.cosine, start.y + look.range * along.sine);
  if (!touching && scene_.outlines) touching = FindTouching(line, start, along, &where);
  bump.model = touching ? touching->GetId() : Bump::kNobody;
  if (!touching) return;
  bump.x = where.x;
  bump.y = where.y;
}

/// Finds a contact of outlines at a line. See ModelBumper::FindTouched().
const Model* Rows::Stepper::FindTouching(const BumperLine& line, const point_t& start,
                                         const SineCosine& along, point_t* where) const {
  const uint32_t row = scene_.movers[line.finder.mover].row;
  if (row == Mover::kNoRow) return nullptr;
  const double length = line.bumper->bumpers[line.index].length;
  const Finders& finders = scene_.finders;
  for (const motion::Contact& contact : s_.contacts.contacts()) {
    const bool is_first = contact.a == row;
    if (!is_first && (contact.wall || contact.b != row)) continue;
    const point_t point(contact.point.x, contact.point.y);
    if (!IsAtLine(start, along, length, point)) continue;
    *where = point;
    if (!is_first) return finders.row_models[contact.a];
    return contact.wall ? finders.wall_models[contact.b] : finders.row_models[contact.b];
  }
  return nullptr;
}

// ---- fiducials ----------------------------------------------------------------------------------

Pose Rows::Stepper::PlaceOfTarget(const FiducialTarget& target) const {
  if (target.mover == FiducialTarget::kStands) return target.place;
  const Placed place = scene_.movers[target.mover].GlobalPoseOf(target.node, PlaceOf(target.mover));
  return Pose(place.x, place.y, 0, place.a);
}

/// See ModelFiducial::Gather() and ModelFiducial::ReceiveHits().
void Rows::Stepper::FindFiducials(size_t index) {
  const FiducialFinder& of = scene_.finders.fiducial_finders[index];
  const Finder& finder = of.finder;
  const Mover& mover = scene_.movers[finder.mover];
  const Placed own = mover.GlobalPoseOf(finder.node, PlaceOf(finder.mover));
  uint32_t count = 0;
  for (uint32_t i = 0; i < of.targets.size(); i++) {
    ModelFiducial::Fiducial candidate;
    if (!RowBridge::MakeCandidate(of, Pose(own.x, own.y, 0, own.a), of.targets[i],
                                  PlaceOfTarget(of.targets[i]), &candidate))
      continue;
    if (!c_.seen.empty()) {
      candidate.mod = nullptr;
      candidate.pose.z = of.targets[i].place.z;
      c_.seen[world_ * scene_.finders.target_count + of.first_target + i] = candidate;
    }
    s_.finder_unit_vectors[count] = sensing::UnitVectorOf(candidate.bearing);
    s_.finder_directions[count] = sensing::MakeDirection(s_.finder_unit_vectors[count]);
    s_.candidates[count++] = i;
  }
  uint8_t* const found = c_.found.data() + world_ * scene_.finders.target_count + of.first_target;
  std::fill_n(found, of.targets.size(), uint8_t{0});
  if (count == 0) return;
  const Placed origin = own + mover.nodes[finder.node].frame;
  sensing::Fan fan = finder.fan;
  if (fan.range > 0)
    sensing::MoveFan(&fan, origin.x, origin.y, origin.turn, scene_.cells_per_metre);
  TraceFinder(finder, fan, {s_.finder_directions.data(), s_.finder_unit_vectors.data()}, count);
  for (uint32_t i = 0; i < count; i++) {
    const Model* const hit = s_.looks[i].model;
    found[s_.candidates[i]] =
        hit == of.targets[s_.candidates[i]].model || (!hit && of.model->ignore_zloc);
  }
}

// ---- blobs --------------------------------------------------------------------------------------

/// See ModelBlobfinder::AddFan() and ModelBlobfinder::ReceiveHits().
void Rows::Stepper::FindBlobs(size_t index) {
  const Blobfinder& of = scene_.finders.blobfinders[index];
  const Finder& finder = of.finder;
  const Placed origin = scene_.movers[finder.mover].FrameOf(finder.node, PlaceOf(finder.mover)) +
                        Pose(0, 0, 0, of.model->pan);
  sensing::Fan fan = finder.fan;
  if (fan.range > 0)
    sensing::MoveFan(&fan, origin.x, origin.y, origin.turn, scene_.cells_per_metre);
  TraceFinder(finder, fan,
              {scene_.directions.all().data() + of.first_direction,
               scene_.directions.unit_vectors().data() + of.first_direction},
              of.rays);
  s_.blob_intervals.clear();
  for (uint32_t i = 0; i < of.rays; i++) {
    s_.blob_ranges[i] = s_.looks[i].range;
    Model* const hit = const_cast<Model*>(s_.looks[i].model);
    if (i == 0 || s_.blob_intervals.back().model != hit) s_.blob_intervals.push_back({0, hit});
    s_.blob_intervals.back().end = i + 1;
  }
  RowBridge::FindBlobs(of, {s_.blob_ranges.data(), s_.blob_intervals.data(), of.rays}, &s_.blobs);
  const Finders& finders = scene_.finders;
  c_.blobs_seen[world_ * finders.blobfinders.size() + index] =
      static_cast<uint32_t>(s_.blobs.size());
  std::ranges::copy(s_.blobs, c_.blobs.data() + world_ * finders.blob_count + of.first_blob);
}

// ---- rays ---------------------------------------------------------------------------------------

/// Finds what the rays of a finder hit, for Scratch::looks.
void Rows::Stepper::TraceFinder(const Finder& finder, const sensing::Fan& fan,
                                const RaysOfSensor& rays, uint32_t count) {
  std::fill_n(s_.looks.begin(), count, Look{fan.range, kNowhere, 0, nullptr});
  if (fan.nothing) return;
  if (MayHitWalls(finder.seen, fan)) TraceStanding(fan, rays, count);
  for (const uint32_t other : finder.others) LookAtMover(fan, rays, count, other);
}

/// Traces the rays among what stands.
void Rows::Stepper::TraceStanding(const sensing::Fan& fan, const RaysOfSensor& rays,
                                  uint32_t count) {
  const ray_grid_t view = scene_.grid.View(fan.layer);
  const ray_mask_t no_mask{};
  for (uint32_t begin = 0; begin < count;) {
    const uint32_t part = std::min(count - begin, sensing::RayGroup::kMaxRays);
    const RaysOfSensor rest{rays.directions + begin, rays.unit_vectors + begin};
    const sensing::FanSlice slice{&fan.record, rest.directions, part, fan.leg_length, nullptr};
    const sensing::RayGroup group{.grid = &view,
                                  .mask = &no_mask,
                                  .slices = &slice,
                                  .slice_count = 1,
                                  .count = part,
                                  .words_per_ray = 0,
                                  .exact = fan.exact};
    s_.first.Walk(group, s_.walked);
    const sensing::ExactGroup::SliceData exact{&fan, rest.unit_vectors};
    if (fan.exact) s_.exact.Trace(group, &exact, s_.first, s_.walked, &s_.counters);
    StoreLooks(fan, rest, part, &s_.looks[begin]);
    begin += part;
  }
}

/// Stores the hits of the rays that have been walked.
void Rows::Stepper::StoreLooks(const sensing::Fan& fan, const RaysOfSensor& rays, uint32_t count,
                               Look* looks) {
  for (uint32_t i = 0; i < count; i++) {
    if (fan.exact) {
      if (const Model* const hit = s_.exact.HitModel(i))
        looks[i] = {s_.walked[i], 0, hit->GetId(), hit};
      continue;
    }
    const grid::BodyList bodies = s_.first.Bodies(i);
    if (bodies == sensing::FirstHits::kNothing) continue;
    const uint32_t hit = s_.first.Packed(i);
    if (AcceptModel(fan, bodies, &looks[i])) {
      looks[i].range = s_.walked[i];
      looks[i].place = ray_packed_u(hit) + ray_packed_v(hit);
    } else {
      FollowRay(
          fan, rays.directions[i], hit,
          [&](grid::BodyList list) { return AcceptModel(fan, list, &looks[i]); }, &looks[i].range,
          &looks[i].place);
    }
  }
}

/// Stores the model that a ray hits in a cell with these bodies; false if it passes all of them.
bool Rows::Stepper::AcceptModel(const sensing::Fan& fan, grid::BodyList bodies, Look* look) const {
  return scene_.grid.AnyOf(bodies, [&](grid::BodyId id) {
    const grid::Body& body = scene_.grid.body(id);
    if (sensing::PassesAboveOrBelow(fan, body) || !fan.predicate(body.model, nullptr, nullptr))
      return false;
    look->key = scene_.grid.Stamp(id);
    look->model = body.model;
    return true;
  });
}

/// Stores the hits of rays that meet the body of a mover first.
void Rows::Stepper::LookAtMover(const sensing::Fan& fan, const RaysOfSensor& rays, uint32_t count,
                                uint32_t number) {
  const Body& body = scene_.bodies[number];
  if (IsOutOfReach(fan, body)) return;
  if (fan.exact) {
    const uint64_t key = body.model->GetId();
    return ForEachCrossing(
        fan, rays, count, body, [&](uint32_t i) { return s_.looks[i].range; },
        [&](uint32_t i, double along) {
          Look& look = s_.looks[i];
          if (IsNearer(along, key, look.place != kNowhere, look.range, look.key))
            look = {along, 0, key, body.model};
        });
  }
  const uint64_t key = DrawingOrder(number);
  const auto meet = [&](uint32_t i, const CellRay& ray, int32_t u, int32_t v) {
    Look& look = s_.looks[i];
    if (u + v < look.place || (u + v == look.place && key <= look.key))
      look = {RangeAt(fan, ray, u, v), u + v, key, body.model};
  };
  if (scene_.narrow)
    ForEachMeeting<NarrowWord>(fan, rays, count, number, meet);
  else
    ForEachMeeting<WideWord>(fan, rays, count, number, meet);
}

}  // namespace Stg::rows
