// SPDX-License-Identifier: GPL-2.0-or-later

#include "control/ray_layout.hh"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <mutex>

#include "geometry/trigonometry.hh"

namespace Stg::control {

namespace {

constexpr double kPi = 3.14159265358979323846;

uint32_t SectorOf(const SineCosine& direction) {
  const double turns = ArcTangent(direction.sine, direction.cosine) / (2 * kPi);  // -0.5 to 0.5
  const double sector = std::floor((turns < 0 ? turns + 1 : turns) * ROW_SECTOR_COUNT + 0.5);
  return static_cast<uint32_t>(sector) % ROW_SECTOR_COUNT;
}

}  // namespace

RayLayout::RayLayout(const std::vector<ControllerSensor>& sensors,
                     std::span<const uint32_t> first_rays, double horizon) {
  std::array<std::vector<row_run_t>, ROW_SECTOR_COUNT> of_sectors;
  for (size_t i = 0; i < sensors.size(); i++)
    AddSensor(sensors[i], first_rays[i], horizon, of_sectors.data());
  for (uint32_t sector = 0; sector < ROW_SECTOR_COUNT; sector++) {
    if (of_sectors[sector].empty()) continue;
    const auto first = static_cast<uint32_t>(runs.size());
    runs.insert(runs.end(), of_sectors[sector].begin(), of_sectors[sector].end());
    sectors.push_back({sector, first, static_cast<uint32_t>(runs.size()), 0});
    const SineCosine middle = SinCos(static_cast<double>(sector) * ROW_SECTOR_WIDTH);
    cosines += middle.cosine;
    sines += middle.sine;
  }
}

void RayLayout::AddSensor(const ControllerSensor& sensor, uint32_t first_ray, double horizon,
                          std::vector<row_run_t>* of_sectors) {
  const auto count = static_cast<uint32_t>(sensor.bearings.size());
  const auto eye = static_cast<uint32_t>(eyes.size());
  eyes.push_back({sensor.pose.x, sensor.pose.y, std::min(sensor.range.max, horizon), first_ray,
                  first_ray + count});
  directions.resize(std::max<size_t>(directions.size(), first_ray + count));
  uint32_t front_begin = first_ray, front_end = first_ray, last_sector = ROW_SECTOR_COUNT;
  for (uint32_t i = first_ray; i < first_ray + count; i++) {
    const SineCosine direction = SinCos(sensor.pose.a + sensor.bearings[i - first_ray]);
    directions[i] = {direction.sine, direction.cosine};
    const uint32_t sector = SectorOf(direction);
    if (sector != last_sector) of_sectors[sector].push_back({i, i, i, i, eye, 0});
    last_sector = sector;
    of_sectors[sector].back().end = i + 1;
    if (direction.cosine <= 0) continue;
    if (front_end == first_ray) front_begin = i;
    front_end = i + 1;
  }
  for (uint32_t sector = 0; sector < ROW_SECTOR_COUNT; sector++)
    for (row_run_t& run : of_sectors[sector]) {
      if (run.eye != eye) continue;
      run.front_begin = std::max(run.begin, front_begin);
      run.front_end = std::max(run.front_begin, std::min(run.end, front_end));
    }
}

std::shared_ptr<const RayLayout> FindRayLayout(const std::vector<ControllerSensor>& sensors,
                                               double horizon) {
  static std::mutex mutex;
  static std::map<std::vector<double>, std::weak_ptr<const RayLayout>> known;
  std::vector<double> key = {horizon};
  std::vector<uint32_t> first_rays;
  uint32_t rays = 0;
  for (const ControllerSensor& sensor : sensors) {
    first_rays.push_back(rays);
    rays += static_cast<uint32_t>(sensor.bearings.size());
    for (const double number : {sensor.pose.x, sensor.pose.y, sensor.pose.a, sensor.range.max})
      key.push_back(number);
    key.push_back(static_cast<double>(sensor.bearings.size()));
    if (!sensor.bearings.empty()) key.push_back(sensor.bearings.back());
  }
  const std::lock_guard lock(mutex);
  std::weak_ptr<const RayLayout>& held = known[key];
  std::shared_ptr<const RayLayout> layout = held.lock();
  if (layout) return layout;
  layout = std::make_shared<RayLayout>(sensors, first_rays, horizon);
  held = layout;
  return layout;
}

}  // namespace Stg::control
