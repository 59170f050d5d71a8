// SPDX-License-Identifier: GPL-2.0-or-later

#include "rows/rows.hh"

#include <algorithm>

#include "messages/assert.hh"
#include "models/localization.hh"
#include "models/noise.hh"
#include "rows/corner_cells.hh"
#include "rows/each_column.hh"
#include "rows/row_bridge.hh"

namespace Stg::rows {

Rows::Rows(std::shared_ptr<const Scene> scene) : scene_(std::move(scene)) { Resize(1); }

Rows::Rows(std::shared_ptr<const Scene> scene, std::span<const uint64_t> seeds)
    : scene_(std::move(scene)), start_(new Rows(scene_)) {
  RowBridge::ReadStart(start_.get());
  Resize(seeds.size());
  for (size_t i = 0; i < seeds.size(); i++) Reset(i, seeds[i]);
}

usec_t Rows::SensedAt(size_t world, size_t mover) const {
  usec_t latest = 0;
  for (uint32_t rate = 0; rate < scene_->rates.size(); rate++)
    if ((scene_->movers[mover].sensed_at >> rate) & 1)
      latest = std::max(latest, LastUpdate(world, rate));
  return latest;
}

void Rows::Resize(size_t worlds) {
  constexpr size_t kMany = 64;  // few may come back soon, so their memory is kept
  const bool frees = worlds == 0 && size() > kMany;
  ForEachColumn(
      *scene_,
      [&](size_t count, auto* column) {
        column->resize(worlds * count);
        if (frees) column->shrink_to_fit();
      },
      &columns);
}

size_t Rows::BytesPerWorld() const {
  size_t bytes = 0;
  ForEachColumn(
      *scene_, [&](size_t count, auto* column) { bytes += count * sizeof((*column)[0]); },
      &columns);
  return bytes;
}

namespace {

/// True if the movers of both scenes are the same models, and have the same bodies.
bool HaveSameBodies(const Scene& one, const Scene& other) {
  const auto same = [](const Mover& a, const Mover& b) {
    return a.model->GetId() == b.model->GetId() && a.body_count == b.body_count;
  };
  return one.byte_count == other.byte_count && one.bodies.size() == other.bodies.size() &&
         std::ranges::equal(one.movers, other.movers, same);
}

}  // namespace

void Rows::Copy(size_t to, const Rows& other, size_t from) {
  STAGE_ASSERT(&scene() == &other.scene() && to < size() && from < other.size());
  const auto copy = [&](size_t count, auto* into, const auto* source) {
    CopyElements(count, *source, from, into, to);
  };
  ForEachColumn(*scene_, copy, &columns, &other.columns);
}

void Rows::CopyRandomNumbers(size_t to, const Rows& other, size_t from) {
  STAGE_ASSERT(&scene() == &other.scene() && to < size() && from < other.size());
  const Columns& source = other.columns;
  columns.seed[to] = source.seed[from];
  columns.reseeding[to] = source.reseeding[from];
  columns.last_update[to] = source.last_update[from];
  if (!columns.random.empty())
    CopyElements(scene().movers.size(), source.random, from, &columns.random, to);
  if (!columns.noise.empty())
    CopyElements(scene().sensors.size(), source.noise, from, &columns.noise, to);
}

bool Rows::CopyStart(size_t world, const Rows& other) {
  if (!HaveSameBodies(scene(), other.scene())) return false;
  const Columns& from = other.columns;
  Columns& to = columns;
  Reset(world, from.seed[world]);
  CopyElements(scene().varied.size(), from.varied, world, &to.varied, world);
  ApplyVaried(world);
  to.extent[world] = from.extent[world];
  to.stamps[world] = from.stamps[world];
  const size_t movers = scene().movers.size(), bodies = scene().bodies.size();
  const auto copy = [&](size_t count, const auto& source, auto* into) {
    if (!source.empty() && !into->empty()) CopyElements(count, source, world, into, world);
  };
  copy(movers, from.pose, &to.pose);
  copy(movers, from.turn, &to.turn);
  copy(movers, from.command, &to.command);
  copy(movers, from.mode, &to.mode);
  copy(movers, from.before, &to.before);
  if (other.scene().controls.memory_count == scene().controls.memory_count)
    copy(scene().controls.memory_count, from.memory, &to.memory);
  copy(bodies, from.box, &to.box);
  copy(bodies, from.stamp, &to.stamp);
  copy(scene().byte_count, from.bits, &to.bits);
  for (size_t k = 0; k < movers; k++) {
    const size_t i = world * movers + k;
    const bool begins = scene().movers[k].runs && !other.scene().movers[k].runs;
    to.sensed[i] = begins ? to.pose[i] : from.sensed[i];
  }
  return true;
}

void Rows::Reset(size_t world, uint64_t seed, std::span<const double> given) {
  STAGE_ASSERT(start_ && world < size());
  Copy(world, *start_, 0);
  columns.seed[world] = seed;
  columns.extent[world] = scene_->grid.extent();  // what stands may have changed
  if (scene_->populations) PlacePopulations(world);
  if (!columns.error.empty() || !columns.random.empty()) DrawErrors(world);
  if (!columns.noise.empty()) SeedNoise(world);
  if (!scene_->varied.empty()) Vary(world, given);
}

/// Draws the outline of a body; without corners it is not in the grid.
void Rows::SetOutline(size_t world, size_t body, const CornerCells& corners, uint32_t count) {
  OutlineBox& box = columns.box[world * scene_->bodies.size() + body];
  box = OutlineBox();
  if (count == 0) return;
  if (scene_->narrow) return DrawOutline(corners, count, &box, BitsOf<NarrowWord>(world, body));
  WideWord rows[kMaxSide];
  DrawOutline(corners, count, &box, rows);
  std::copy_n(rows, box.height, BitsOf<WideWord>(world, body));
}

/// Places the members of populations as loading does.
void Rows::PlacePopulations(size_t world) {
  columns.extent[world] = scene_->extent_of_others;
  RowBridge::PlacePopulations(*scene_, columns.seed[world], [&](uint32_t mover, const Pose& pose) {
    PlaceMover(world, mover, pose);
  });
}

/// See ModelPosition::StartLocalization().
void Rows::PlaceMover(size_t world, uint32_t number, const Pose& pose) {
  const Mover& mover = scene_->movers[number];
  const size_t i = world * scene_->movers.size() + number;
  columns.pose[i] = columns.sensed[i] = PlanarOf(pose);
  columns.turn[i] = SinCos(pose.a);
  const Placed place{pose.x, pose.y, pose.a, columns.turn[i]};
  for (uint32_t b = mover.first_body; b < mover.first_body + mover.body_count; b++) {
    const Body& body = scene_->bodies[b];
    CornerCells corners;
    const bool fits =
        FindCells(body, mover.FrameOf(body.node, place), scene_->cells_per_metre, &corners);
    SetOutline(world, b, corners, fits ? static_cast<uint32_t>(body.corners.size()) : 0);
    Widen(&columns.extent[world], columns.box[world * scene_->bodies.size() + b]);
  }
  if (!mover.has_odometry) return;
  const Pose estimate = EstimateIn(mover.has_origin ? mover.origin : pose, pose);
  columns.estimate[i] = PlanarOf(estimate + Pose());
}

bool Rows::IsInObstacle(size_t world, uint32_t number) {
  const Mover& mover = scene_->movers[number];
  for (uint32_t b = mover.first_body; b < mover.first_body + mover.body_count; b++) {
    const Body& body = scene_->bodies[b];
    const OutlineBox& box = columns.box[world * scene_->bodies.size() + b];
    const CellMap& map = scene_->blocked[body.blocked];
    if (body.obstacle && (scene_->narrow ? map.Meets(box, BitsOf<NarrowWord>(world, b))
                                         : map.Meets(box, BitsOf<WideWord>(world, b))))
      return true;
  }
  return false;
}

/// Draws the errors of odometry in the order in which loading draws them.
void Rows::DrawErrors(size_t world) {
  RandomStream random(columns.seed[world]);
  const size_t first = world * scene_->movers.size();
  for (size_t i = 0; i < scene_->movers.size(); i++) {
    const Mover& mover = scene_->movers[i];
    if (!mover.robot) continue;
    const Velocity error = DrawOdomError(&random);
    if (!mover.errors_given && !columns.error.empty())
      columns.error[first + i] = {error.x, error.y, error.a};
  }
  if (columns.random.empty()) return;
  for (size_t i = 0; i < scene_->movers.size(); i++)
    columns.random[first + i].Seed(RowBridge::SeedOfMover(*scene_, i, columns.seed[world]));
}

void Rows::SeedNoise(size_t world) {
  const size_t first = world * scene_->sensors.size();
  for (size_t i = 0; i < scene_->sensors.size(); i++)
    columns.noise[first + i].Seed(RowBridge::SeedOfNoise(*scene_, i, columns.seed[world]));
}

}  // namespace Stg::rows
