// SPDX-License-Identifier: GPL-2.0-or-later
//
// The columns that rows of a scene have, with the number of elements of a world in each of them.

#ifndef STAGE_ROWS_EACH_COLUMN_HH
#define STAGE_ROWS_EACH_COLUMN_HH

#include <algorithm>
#include <cstddef>
#include <vector>

#include "rows/rows.hh"

namespace Stg::rows {

/// Calls f(elements per world, column...) for each column, with that column of each of `c`.
template <typename F, typename... C>
void ForEachColumn(const Scene& scene, F f, C*... c) {
  const size_t robots = scene.movers.size(), bodies = scene.bodies.size();
  const auto any = [&](auto is) { return std::ranges::any_of(scene.movers, is); };
  const bool odometry = any([](const Mover& m) { return m.has_odometry; });
  const bool noisy = odometry && any([](const Mover& m) { return m.has_noisy_odometry; });
  const bool things = any([](const Mover& m) { return m.is_pushed; });
  const bool steers = any([](const Mover& m) { return m.steers; });
  const bool noise = scene.HasNoise(), one_rate = scene.HasOneRate();
  f(size_t{1}, &c->seed...);
  f(size_t{1}, &c->reseeding...);
  f(size_t{1}, &c->time...);
  f(scene.rates.size(), &c->next_update...);
  f(scene.rates.size(), &c->last_update...);
  f(one_rate ? 0 : scene.rates.size(), &c->scheduled...);
  f(size_t{1}, &c->steps...);
  f(size_t{1}, &c->extent...);
  f(size_t{1}, &c->stamps...);
  f(robots, &c->pose...);
  f(robots, &c->turn...);
  f(robots, &c->velocity...);
  f(robots, &c->command...);
  f(robots, &c->sensed...);
  f(robots, &c->mode...);
  f(robots, &c->stalled...);
  f(robots, &c->watts...);
  f(scene.outlines ? robots : 0, &c->made...);
  f(scene.outlines ? robots : 0, &c->hindered...);
  f(steers ? robots : 0, &c->steering...);
  f(things ? robots : 0, &c->before...);
  f(scene.packs.size(), &c->stored...);
  f(scene.packs.size(), &c->dissipated...);
  f(size_t{!scene.packs.empty()}, &c->energy...);
  f(odometry ? robots : 0, &c->estimate...);
  f(odometry ? robots : 0, &c->driven...);
  f(odometry ? robots : 0, &c->error...);
  f(noisy ? robots : 0, &c->noisy_odometry...);
  f(noisy || !scene.controls.groups.empty() ? robots : 0, &c->random...);
  f(size_t{scene.controls.memory_count}, &c->memory...);
  f(bodies, &c->box...);
  f(bodies, &c->stamp...);
  f(size_t{scene.byte_count}, &c->bits...);
  f(noise ? scene.sensors.size() : 0, &c->noise...);
  f(scene.varied.size(), &c->varied...);
  f(scene.varies_movers ? robots : 0, &c->properties...);
  f(scene.varies_noise ? scene.sensors.size() : 0, &c->range_noise...);
  f(one_rate ? 0 : scene.sensors.size(), &c->scan...);
  f(one_rate ? 0 : size_t{scene.finders.target_count}, &c->seen...);
  f(size_t{scene.ray_count}, &c->ranges...);
  f(size_t{scene.ray_count}, &c->brightness...);
  f(scene.finders.bumper_lines.size(), &c->bumps...);
  f(size_t{scene.finders.target_count}, &c->found...);
  f(scene.finders.blobfinders.size(), &c->blobs_seen...);
  f(size_t{scene.finders.blob_count}, &c->blobs...);
}

/// Copies the `count` elements of a world.
template <typename T>
void CopyElements(size_t count, const std::vector<T>& from, size_t from_world, std::vector<T>* to,
                  size_t to_world) {
  std::copy_n(from.begin() + static_cast<std::ptrdiff_t>(from_world * count), count,
              to->begin() + static_cast<std::ptrdiff_t>(to_world * count));
}

}  // namespace Stg::rows

#endif
