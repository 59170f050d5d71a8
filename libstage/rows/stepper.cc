// SPDX-License-Identifier: GPL-2.0-or-later
//
// Steps of a row. The phases are those of World::Step(): commands, rays, sensed poses, moves,
// controllers. Each
// phase computes what models do in that phase, with the same operations in the same order.

#include "rows/stepper.hh"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <span>

#include "geometry/trigonometry.hh"
#include "messages/assert.hh"
#include "models/energy_supply.hh"
#include "models/noise.hh"
#include "models/property_checks.hh"
#include "motion/contacts.hh"
#include "motion/drive_table.hh"
#include "motion/odometry.hh"
#include "rows/clones.hh"
#include "rows/corner_cells.hh"
#include "rows/rows.hh"
#include "sensing/crossing.hh"
#include "sensing/middle.hh"

namespace Stg::rows {

namespace {

constexpr double kSecond = 1e6;  // microseconds

}  // namespace

Rows::Scratch::Scratch(const Scene& scene)
    : first(scene.grid),
      exact(scene.grid),
      control(scene.controls),
      since_update(scene.rates.size()),
      columns(scene.columns) {
  MakeFans(scene);
  MakeLooks(scene.finders);
  places.resize(scene.ray_count);
  keys.resize(scene.ray_count);
  rays.resize(scene.sensors.size());
  own_directions.resize(scene.ray_count);
  own_unit_vectors.resize(scene.ray_count);
  points.resize(scene.point_count);
  contacts.tell = false;
}

std::shared_ptr<Rows::Scratch> Rows::MakeScratch() const {
  return std::make_shared<Scratch>(*scene_);
}

void Rows::Step(size_t world, uint64_t steps, Scratch* scratch, uint64_t unseen) {
  Stepper stepper(this, world, scratch);
  for (uint64_t left = steps; left-- > 0;) stepper.Step(left + unseen);
}

void Rows::Place(size_t world, size_t mover, const Planar& pose, Scratch* scratch) {
  Stepper(this, world, scratch).Place(mover, pose);
}

Rows::Stepper::Stepper(Rows* rows, size_t world, Scratch* scratch)
    : scene_(*rows->scene_),
      c_(rows->columns),
      s_(*scratch),
      world_(world),
      rate_(world * scene_.rates.size()),
      mover_(world * scene_.movers.size()),
      body_(world * scene_.bodies.size()),
      byte_(world * scene_.byte_count),
      ray_(world * scene_.ray_count),
      sensor_(world * scene_.sensors.size()),
      pack_(world * scene_.packs.size()),
      memory_(world * scene_.controls.memory_count),
      seconds_(static_cast<double>(scene_.step) / kSecond) {}

void Rows::Stepper::Step(uint64_t unseen) {
  c_.time[world_] += scene_.step;
  BeginUpdates(unseen);
  if (due_) {
    for (size_t i = 0; i < scene_.movers.size(); i++)
      if (IsDue(scene_.movers[i].rate)) Drive(i, s_.since_update[scene_.movers[i].rate]);
    CastRays();
    if (scene_.finders.any) FindModels();
    for (size_t i = 0; i < scene_.movers.size(); i++)
      if (scene_.movers[i].sensed_at & due_) StoreSensedPose(i);
  }
  if (scene_.outlines)
    MoveOutlines();
  else
    for (size_t i = 0; i < scene_.movers.size(); i++) MoveCells(i);
  if (due_) RunControls();
  DrawEnergy();
  c_.steps[world_]++;
}

/// Finds the groups of rates that update now, and the times of their next updates. See
/// GatherPhase::Run().
void Rows::Stepper::BeginUpdates(uint64_t unseen) {
  const usec_t now = c_.time[world_];
  due_ = unseen_ = 0;
  for (uint32_t k = 0; k < scene_.rates.size(); k++)
    if (c_.next_update[rate_ + k] <= now) due_ |= 1u << k;
  if (!due_) return;
  if (!scene_.HasOneRate()) KeepOrder();
  for (uint32_t k = 0; k < scene_.rates.size(); k++) {
    if (!IsDue(k)) continue;
    const size_t i = rate_ + k;
    s_.since_update[k] = static_cast<double>(now - c_.last_update[i]) / kSecond;
    c_.last_update[i] = now;
    c_.next_update[i] = scene_.rates[k].NextUpdateAfter(now);
    if (IsUpdatedWithin(unseen, k)) unseen_ |= 1u << k;
  }
}

/// Numbers the groups that update now in the order in which they schedule their next updates.
void Rows::Stepper::KeepOrder() {
  s_.by_time.clear();
  for (uint32_t k = 0; k < scene_.rates.size(); k++)
    if (IsDue(k)) s_.by_time.push_back({{c_.next_update[rate_ + k], c_.scheduled[rate_ + k]}, k});
  std::ranges::sort(s_.by_time);
  uint64_t number = (c_.steps[world_] + 1) * scene_.rates.size();
  for (const auto& [when, k] : s_.by_time) c_.scheduled[rate_ + k] = number++;
}

/// True if the next update of a group is in one of the next `steps` steps.
bool Rows::Stepper::IsUpdatedWithin(uint64_t steps, uint32_t rate) const {
  return (c_.next_update[rate_ + rate] - c_.time[world_] - 1) / scene_.step < steps;
}

/// See Model::UpdateCharge() and PowerPack::Spend().
void Rows::Stepper::DrawEnergy() {
  constexpr double kSeconds = 0.1;  // Model::GetEnergyInterval()
  for (const Consumer& consumer : scene_.consumers) {
    const double watts =
        consumer.mover == Consumer::kNone ? consumer.watts : c_.watts[mover_ + consumer.mover];
    if (!(watts > 0)) continue;
    double& stored = c_.stored[pack_ + consumer.pack];
    EnergyTotals& totals = c_.energy[world_];
    const double wanted = watts * kSeconds;
    if (!(wanted > 0)) continue;
    const bool infinite = IsInfiniteSupply(stored);
    const double amount = infinite ? wanted : std::min(wanted, stored);
    if (std::isinf(amount)) continue;
    if (amount > 0 && infinite) totals.input += amount;
    if (amount > 0 && !infinite) {
      const double left = stored - std::min(stored, amount);
      const double change = Countable(left) - Countable(stored);
      if (change != 0) totals.stored += change;
      stored = left;
    }
    c_.dissipated[pack_ + consumer.pack] += amount;
    if (amount != 0) totals.dissipated += amount;
  }
}

// ---- commands -----------------------------------------------------------------------------------

/// See ModelPosition::NextVelocity().
void Rows::Stepper::Drive(size_t index, double dt) {
  const Mover& mover = scene_.movers[index];
  if (!mover.runs) return;
  const size_t i = mover_ + index;
  if (mover.pack != Consumer::kNone && c_.stored[pack_ + mover.pack] == 0) {
    c_.watts[i] = motion::PowerAt(PropertiesOf(index).mass, Velocity());
    c_.velocity[i] = Planar();
    return;
  }
  if (mover.obeys_velocity && c_.mode[i] == DriveInput::kVelocity) return ObeyVelocity(index);
  DriveInput input = mover.drive;
  PropertiesOf(index).PutInto(&input);
  input.mode = static_cast<DriveInput::Mode>(c_.mode[i]);
  input.command = PoseOf(c_.command[i], 0);
  input.velocity = VelocityOf(c_.velocity[i]);
  if (input.mode == DriveInput::kPosition) input.estimate = EstimateOf(index);
  if (mover.steers) input.steering = c_.steering[i];
  input.dt = dt;
  const motion::Driven driven = motion::Drive(mover.function, input);
  if (mover.steers) c_.steering[i] = driven.steering;
  UseVelocity(index, driven, input.limits_acceleration);
}

void Rows::Stepper::UseVelocity(size_t index, const motion::Driven& driven,
                                bool limits_acceleration) {
  const double watts = motion::PowerOf(driven, PropertiesOf(index).mass, limits_acceleration);
  if (std::isfinite(watts)) c_.watts[mover_ + index] = watts;
  c_.velocity[mover_ + index] = PlanarOf(driven.made);
}

/// Drive() for a drive that makes a command of velocity as it is, within bounds.
void Rows::Stepper::ObeyVelocity(size_t index) {
  const Mover& mover = scene_.movers[index];
  const Bounds* const bounds = PropertiesOf(index).velocity_bounds;
  const Planar& command = c_.command[mover_ + index];
  const Velocity wanted(command.x, mover.is_omni ? command.y : 0.0, 0, command.a);
  const auto clipped = [&](double value, const Bounds& b) {
    return value < b.min ? b.min : value > b.max ? b.max : value;
  };
  const Velocity made(clipped(wanted.x, bounds[0]), clipped(wanted.y, bounds[1]), 0,
                      clipped(wanted.a, bounds[3]));
  UseVelocity(index, {wanted, made, 0}, false);
}

/// See ModelPosition::EstimateNow().
Pose Rows::Stepper::EstimateOf(size_t index) const {
  const size_t i = mover_ + index;
  const Mover& mover = scene_.movers[index];
  if (!mover.has_odometry) return PoseOf(c_.sensed[i], mover.z);
  const Pose before = PoseOf(c_.estimate[i], 0), next = before + PoseOf(c_.driven[i], 0);
  return IsFinite(next) ? next : before;
}

/// See ModelPosition::StoreSensedPose().
void Rows::Stepper::StoreSensedPose(size_t index) {
  const size_t i = mover_ + index;
  const Mover& mover = scene_.movers[index];
  c_.sensed[i] = c_.pose[i];
  if (!mover.has_odometry) return;
  if (HasNoisyOdometry(index))
    c_.noisy_odometry[i].Refresh(PoseOf(c_.estimate[i], 0), PoseOf(c_.driven[i], 0));
  c_.estimate[i] = PlanarOf(EstimateOf(index));
  c_.driven[i] = Planar();
}

// ---- moves --------------------------------------------------------------------------------------

/// See ModelPosition::NoteMotion(). `made`: the velocity of the move in the body's frame.
void Rows::Stepper::NoteMotion(size_t index, const Planar& made) {
  const size_t i = mover_ + index;
  const Mover& mover = scene_.movers[index];
  const Planar& velocity = c_.velocity[i];
  bool hindered = false;
  if (scene_.outlines) {
    hindered = !(made == velocity) && !(c_.stalled[i] && made.IsZero());
    c_.hindered[i] = hindered;
    if (hindered) c_.made[i] = made;
  }
  if (!mover.has_odometry) return;
  const Velocity command = VelocityOf(velocity);
  const Velocity actual = hindered ? VelocityOf(made) : c_.stalled[i] ? Velocity() : command;
  const Velocity wheels = motion::WheelVelocity(actual, command, PropertiesOf(index).wheel_slip);
  if (wheels.IsZero()) return;
  Velocity measured = motion::WithOdomError(wheels, VelocityOf(c_.error[i]));
  const Pose before = PoseOf(c_.driven[i], 0);
  if (HasNoisyOdometry(index)) {
    RandomStream* const stream = &c_.random[i];
    const double normal[2] = {NormalError(stream), NormalError(stream)};
    measured = c_.noisy_odometry[i].Measure(measured, seconds_, normal, before);
  }
  const Pose next = before + Pose(measured.x * seconds_, measured.y * seconds_,
                                  measured.z * seconds_, normalize(measured.a * seconds_));
  if (IsFinite(next)) c_.driven[i] = PlanarOf(next);
}

/// See ModelPosition::GetWantedMove(). Returns false if the robot stands.
bool Rows::Stepper::FindWanted(size_t index, Placed* wanted) {
  const size_t i = mover_ + index;
  const Planar& v = c_.velocity[i];
  if (v.IsZero() || !scene_.movers[index].runs) return false;
  *wanted = PlaceOf(index) + Pose(v.x * seconds_, v.y * seconds_, 0, Normalized(v.a * seconds_));
  if (std::isfinite(wanted->x) && std::isfinite(wanted->y) && std::isfinite(wanted->a)) return true;
  c_.stalled[i] = true;
  return false;
}

void Rows::Stepper::MoveCells(size_t index) {
  Placed wanted;
  if (!FindWanted(index, &wanted)) return;
  const size_t i = mover_ + index;
  DrawAt(index, wanted);
  const bool collides = scene_.narrow ? Collides<NarrowWord>(index) : Collides<WideWord>(index);
  c_.stalled[i] = collides;
  if (!collides) CommitAt(index, wanted);
  NoteMotion(index, collides ? Planar() : c_.velocity[i]);
}

/// The cells of a body's corners; false if it exceeds the grid.
inline bool Rows::Stepper::FindCorners(const Body& body, const Placed& place,
                                       CornerCells* to) const {
  const Placed frame = scene_.movers[body.mover].FrameOf(body.node, place);
  return FindCells(body, frame, scene_.cells_per_metre, to);
}

/// Draws the outlines of a robot at a place, for Collides() and Commit(). See
/// Placement::AppendCorners().
STAGE_CLONES void Rows::Stepper::DrawAt(size_t index, const Placed& place) {
  const Mover& mover = scene_.movers[index];
  for (uint32_t b = 0; b < mover.body_count; b++) {
    const Body& body = scene_.bodies[mover.first_body + b];
    const auto count = static_cast<uint32_t>(body.corners.size());
    const Placed frame = mover.FrameOf(body.node, place);
    if (!FindCells(body, frame, scene_.cells_per_metre, &s_.corners[0]))
      s_.boxes[b] = OutlineBox();
    else if (scene_.narrow)
      DrawOutline(s_.corners[0], count, &s_.boxes[b], s_.bits[b].narrow);
    else
      DrawOutline(s_.corners[0], count, &s_.boxes[b], s_.bits[b].wide);
  }
}

/// True if one of the drawn outlines shares a cell with an obstacle. See Placement::Collision().
template <class Word>
bool Rows::Stepper::Collides(size_t index) const {
  const Mover& mover = scene_.movers[index];
  for (uint32_t b = 0; b < mover.body_count; b++) {
    const Body& body = scene_.bodies[mover.first_body + b];
    if (!body.obstacle) continue;
    if (body.height.min < 0) return true;
    const OutlineBox& box = s_.boxes[b];
    if (box.height == 0) continue;
    for (const uint32_t rival : body.rivals)
      if (Overlap(box, DrawnBits<Word>(b), c_.box[body_ + rival], BitsOf<Word>(rival))) return true;
    const CellMap& blocked = scene_.blocked[body.blocked];
    if (!blocked.IsClear(box.x, box.y, std::max(box.width, box.height)) &&
        blocked.Meets(box, DrawnBits<Word>(b)))
      return true;
  }
  return false;
}

void Rows::Stepper::CommitAt(size_t index, const Placed& place) {
  if (scene_.narrow)
    Commit<NarrowWord>(index, place);
  else
    Commit<WideWord>(index, place);
}

/// Moves a robot to where it was drawn. See Placement::Commit().
template <class Word>
void Rows::Stepper::Commit(size_t index, const Placed& place) {
  const Mover& mover = scene_.movers[index];
  const Placed before = PlaceOf(index);
  c_.pose[mover_ + index] = {place.x, place.y, place.a};
  c_.turn[mover_ + index] = place.turn;
  for (uint32_t b = 0; b < mover.body_count; b++) {
    const uint32_t number = mover.first_body + b;
    if (!HasMoved<Word>(number, b, before, place)) continue;
    c_.box[body_ + number] = s_.boxes[b];
    const auto height = static_cast<size_t>(s_.boxes[b].height);
    const size_t rows = std::is_same_v<Word, NarrowWord> ? size_t{kNarrowSide} : height;
    std::memcpy(BitsOf<Word>(number), DrawnBits<Word>(b), rows * sizeof(Word));
    c_.stamp[body_ + number] = ++c_.stamps[world_];
    Widen(&c_.extent[world_], s_.boxes[b]);
  }
}

/// True if a corner of the body is in another cell than before. The body was drawn as number
/// `drawn` of its mover.
template <class Word>
bool Rows::Stepper::HasMoved(uint32_t number, uint32_t drawn, const Placed& before,
                             const Placed& now) {
  const OutlineBox& box = s_.boxes[drawn];
  if (!(box == c_.box[body_ + number])) return true;
  const Word* const rows = DrawnBits<Word>(drawn);
  if (!std::equal(rows, rows + box.height, BitsOf<Word>(number))) return true;
  // Different corners may have the same outline.
  const Body& body = scene_.bodies[number];
  const bool was_in = FindCorners(body, before, &s_.corners[0]);
  const bool is_in = FindCorners(body, now, &s_.corners[1]);
  const size_t count = body.corners.size();
  return was_in != is_in ||
         (is_in && !(std::equal(s_.corners[0].x, s_.corners[0].x + count, s_.corners[1].x) &&
                     std::equal(s_.corners[0].y, s_.corners[0].y + count, s_.corners[1].y)));
}

/// See Model::SetPose().
void Rows::Stepper::Place(size_t index, const Planar& pose) {
  if (c_.pose[mover_ + index] == pose) return;
  const double heading = normalize(pose.a);
  const Placed place{pose.x, pose.y, heading, SinCos(heading)};
  DrawAt(index, place);
  CommitAt(index, place);
}

/// See ContactPhase::Run().
void Rows::Stepper::MoveOutlines() {
  const size_t count = scene_.movers.size();
  s_.wanted.resize(count);
  s_.asked.assign(count, 0);
  if (scene_.varies_movers) SetContactProperties();
  for (size_t k = 0; k < count; k++)
    if (scene_.movers[k].row != Mover::kNoRow) SetTarget(k);
  s_.contacts.Step(scene_.shapes, WallsNow(), &s_.columns);
  for (size_t k = 0; k < count; k++)
    if (scene_.movers[k].row != Mover::kNoRow) EndMove(k);
  for (size_t k = 0; k < count; k++) {
    if (!(s_.asked[k] & kMoved)) continue;
    const Planar now = NewPose(k);
    const Placed place{now.x, now.y, now.a, TurnAfter(k, now.a)};
    DrawAt(k, place);
    CommitAt(k, place);
  }
}

/// Gives the columns of contacts the properties of this world.
void Rows::Stepper::SetContactProperties() {
  for (size_t k = 0; k < scene_.movers.size(); k++) {
    const uint32_t row = scene_.movers[k].row;
    if (row == Mover::kNoRow) continue;
    const MoverProperties& own = PropertiesOf(k);
    s_.columns.grip[row] = own.grip;
    s_.columns.friction[row] = own.friction;
  }
}

/// The walls of this world.
const motion::Walls& Rows::Stepper::WallsNow() {
  const std::vector<WallPart>& parts = scene_.wall_parts;
  if (parts.empty()) return scene_.walls;
  bool known = s_.walls_at.size() == parts.size() && s_.walls_version == scene_.map_version;
  s_.walls_version = scene_.map_version;
  s_.walls_at.resize(parts.size());
  for (size_t i = 0; i + 1 < parts.size(); i++) {
    const Planar& pose = c_.pose[mover_ + parts[i].mover];
    known = known && s_.walls_at[i] == pose;
    s_.walls_at[i] = pose;
  }
  if (!known) FindWalls();
  return s_.walls;
}

/// See ContactPhase::FindWalls().
void Rows::Stepper::FindWalls() {
  s_.walls.Clear();
  for (const WallPart& part : scene_.wall_parts) {
    s_.walls.Append(part.walls);
    if (part.mover == Mover::kNoRow) continue;
    const Mover& mover = scene_.movers[part.mover];
    s_.outline.Find(*mover.model, PoseOf(c_.pose[mover_ + part.mover], mover.z));
    s_.outline.AddTo(&s_.walls, mover.model->GetId());
  }
  s_.walls.Index();
}

/// See ContactPhase::ReadPoses().
void Rows::Stepper::SetPose(size_t k) {
  motion::Columns& columns = s_.columns;
  const uint32_t row = scene_.movers[k].row;
  const Planar& pose = c_.pose[mover_ + k];
  columns.x[row] = columns.target_x[row] = pose.x;
  columns.y[row] = columns.target_y[row] = pose.y;
  columns.heading[row] = columns.target_heading[row] = pose.a;
  columns.turn[row] = 0;
  columns.elevation[row] = scene_.movers[k].z;
  columns.made[row] = 1;
}

/// See ContactPhase::ReadTarget().
void Rows::Stepper::SetTarget(size_t k) {
  SetPose(k);
  const Mover& mover = scene_.movers[k];
  motion::Columns& columns = s_.columns;
  const uint32_t row = mover.row;
  c_.hindered[mover_ + k] = false;
  if (!FindWanted(k, &s_.wanted[k])) return;
  s_.asked[k] = kAsked;
  if (mover.bottom + mover.z < 0) {  // it would be in the floor
    s_.asked[k] |= kInFloor;
    return;
  }
  columns.target_x[row] = s_.wanted[k].x;
  columns.target_y[row] = s_.wanted[k].y;
  columns.target_heading[row] = s_.wanted[k].a;
  columns.turn[row] = c_.velocity[mover_ + k].a * seconds_;
}

Planar Rows::Stepper::NewPose(size_t k) const {
  const uint32_t row = scene_.movers[k].row;
  return {s_.columns.x[row], s_.columns.y[row], s_.columns.heading[row]};
}

/// Sine and cosine of a robot's new heading, which often is the wanted or the present one.
SineCosine Rows::Stepper::TurnAfter(size_t index, double heading) const {
  const auto same = [&](double a) {
    return std::bit_cast<uint64_t>(a) == std::bit_cast<uint64_t>(heading);
  };
  if ((s_.asked[index] & kAsked) && same(s_.wanted[index].a)) return s_.wanted[index].turn;
  if (same(c_.pose[mover_ + index].a)) return c_.turn[mover_ + index];
  return SinCos(heading);
}

/// See ContactPhase::WritePoses(). The pose itself is written when the robot is rasterized.
void Rows::Stepper::EndMove(size_t k) {
  const size_t i = mover_ + k;
  const Mover& mover = scene_.movers[k];
  const Planar before = c_.pose[i], now = NewPose(k);
  if (!(now == before)) s_.asked[k] |= kMoved;
  if (mover.is_pushed) c_.before[i] = before;
  if (!mover.robot) return;
  const Placed& wanted = s_.wanted[k];
  const bool asked = s_.asked[k] & kAsked;
  if (asked)
    c_.stalled[i] = s_.columns.made[mover.row] < motion::kHindered || (s_.asked[k] & kInFloor);
  const Planar made =
      asked && now == Planar{wanted.x, wanted.y, wanted.a}
          ? c_.velocity[i]
          : PlanarOf(motion::VelocityBetween(PoseOf(before, 0), PoseOf(now, 0), seconds_));
  if (made.IsZero() && c_.velocity[i].IsZero())
    c_.hindered[i] = false;
  else
    NoteMotion(k, made);
}

}  // namespace Stg::rows
