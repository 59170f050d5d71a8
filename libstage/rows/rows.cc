// SPDX-License-Identifier: GPL-2.0-or-later

#include "rows/rows.hh"

#include <algorithm>

#include "messages/assert.hh"
#include "models/noise.hh"
#include "rows/row_bridge.hh"

namespace Stg::rows {

namespace {

/// Calls f(column, elements per world) for each column.
template <typename F>
void ForEachColumn(const Scene& scene, Columns* c, F f) {
  const size_t robots = scene.movers.size(), bodies = scene.bodies.size();
  const auto any = [&](auto is) { return std::ranges::any_of(scene.movers, is); };
  const bool odometry = any([](const Mover& m) { return m.has_odometry; });
  const bool noisy = odometry && any([](const Mover& m) { return m.has_noisy_odometry; });
  const bool things = any([](const Mover& m) { return m.is_pushed; });
  const bool steers = any([](const Mover& m) { return m.steers; });
  const bool noise =
      std::ranges::any_of(scene.sensors, [](const Sensor& sensor) { return sensor.noisy; });
  f(&c->seed, 1);
  f(&c->time, 1);
  f(&c->next_update, 1);
  f(&c->last_update, 1);
  f(&c->steps, 1);
  f(&c->extent, 1);
  f(&c->stamps, 1);
  f(&c->pose, robots);
  f(&c->turn, robots);
  f(&c->velocity, robots);
  f(&c->command, robots);
  f(&c->sensed, robots);
  f(&c->mode, robots);
  f(&c->stalled, robots);
  f(&c->watts, robots);
  f(&c->made, scene.outlines ? robots : 0);
  f(&c->hindered, scene.outlines ? robots : 0);
  f(&c->steering, steers ? robots : 0);
  f(&c->before, things ? robots : 0);
  f(&c->stored, scene.packs.size());
  f(&c->dissipated, scene.packs.size());
  f(&c->energy, scene.packs.empty() ? 0 : 1);
  f(&c->estimate, odometry ? robots : 0);
  f(&c->driven, odometry ? robots : 0);
  f(&c->error, odometry ? robots : 0);
  f(&c->noisy_odometry, noisy ? robots : 0);
  f(&c->random, noisy ? robots : 0);
  f(&c->box, bodies);
  f(&c->stamp, bodies);
  f(&c->bits, scene.byte_count);
  f(&c->noise, noise ? scene.sensors.size() : 0);
  f(&c->ranges, scene.ray_count);
  f(&c->brightness, scene.ray_count);
}

/// Calls f(to, from, elements per world) for each column of both.
template <typename F>
void ForEachPair(const Scene& scene, Columns* to, const Columns& from, F f) {
  // The second pass finds the columns of `from` by their order.
  std::vector<const void*> columns;
  ForEachColumn(scene, const_cast<Columns*>(&from),
                [&](auto* column, size_t) { columns.push_back(column); });
  size_t i = 0;
  ForEachColumn(scene, to, [&](auto* column, size_t count) {
    f(column, static_cast<decltype(column)>(const_cast<void*>(columns[i++])), count);
  });
}

}  // namespace

Rows::Rows(std::shared_ptr<const Scene> scene) : scene_(std::move(scene)) { Resize(1); }

Rows::Rows(std::shared_ptr<const Scene> scene, std::span<const uint64_t> seeds)
    : scene_(std::move(scene)), start_(new Rows(scene_)) {
  RowBridge::ReadStart(start_.get());
  Resize(seeds.size());
  for (size_t i = 0; i < seeds.size(); i++) Reset(i, seeds[i]);
}

void Rows::Resize(size_t worlds) {
  ForEachColumn(*scene_, &columns,
                [&](auto* column, size_t count) { column->resize(worlds * count); });
}

size_t Rows::BytesPerWorld() const {
  size_t bytes = 0;
  ForEachColumn(*scene_, const_cast<Columns*>(&columns),
                [&](auto* column, size_t count) { bytes += count * sizeof((*column)[0]); });
  return bytes;
}

void Rows::Copy(size_t to, const Rows& other, size_t from) {
  STAGE_ASSERT(&scene() == &other.scene() && to < size() && from < other.size());
  ForEachPair(*scene_, &columns, other.columns, [&](auto* into, auto* source, size_t count) {
    std::copy_n(source->begin() + static_cast<std::ptrdiff_t>(from * count), count,
                into->begin() + static_cast<std::ptrdiff_t>(to * count));
  });
}

void Rows::Reset(size_t world, uint64_t seed) {
  STAGE_ASSERT(start_ && world < size());
  Copy(world, *start_, 0);
  columns.seed[world] = seed;
  if (!columns.error.empty() || !columns.random.empty()) DrawErrors(world);
  if (!columns.noise.empty()) SeedNoise(world);
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

/// Draws the errors of odometry in the order in which loading draws them.
void Rows::DrawErrors(size_t world) {
  RandomStream random(columns.seed[world]);
  const size_t first = world * scene_->movers.size();
  for (const ErrorSource& source : scene_->error_sources) {
    const Velocity error = DrawOdomError(&random);
    if (source.mover == ErrorSource::kNone) continue;
    const size_t i = first + source.mover;
    if (!scene_->movers[source.mover].errors_given) columns.error[i] = {error.x, error.y, error.a};
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
