// SPDX-License-Identifier: GPL-2.0-or-later

#include "control/ray_layout.hh"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
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

/// Collects the parts of a layout.
class Maker {
 public:
  void AddSensor(const ControllerSensor& sensor, uint32_t first_ray, double horizon);
  void AddSectors();
  std::vector<uint64_t> Words();

  double cosines = 0, sines = 0;

 private:
  std::array<std::vector<row_run_t>, ROW_SECTOR_COUNT> of_sectors_;
  row_layout_t record_{};
  std::vector<row_eye_t> eyes_;
  std::vector<row_sector_t> sectors_;
  std::vector<row_run_t> runs_;
  std::vector<row_turn_t> turns_;
};

void Maker::AddSensor(const ControllerSensor& sensor, uint32_t first_ray, double horizon) {
  const auto count = static_cast<uint32_t>(sensor.bearings.size());
  const auto eye = static_cast<uint32_t>(eyes_.size());
  eyes_.push_back({sensor.pose.x, sensor.pose.y, std::min(sensor.range.max, horizon), first_ray,
                   first_ray + count});
  turns_.resize(std::max<size_t>(turns_.size(), first_ray + count));
  uint32_t front_begin = first_ray, front_end = first_ray, last_sector = ROW_SECTOR_COUNT;
  for (uint32_t i = first_ray; i < first_ray + count; i++) {
    const SineCosine direction = SinCos(sensor.pose.a + sensor.bearings[i - first_ray]);
    turns_[i] = {direction.sine, direction.cosine};
    const uint32_t sector = SectorOf(direction);
    if (sector != last_sector) of_sectors_[sector].push_back({i, i, i, i, eye, 0});
    last_sector = sector;
    of_sectors_[sector].back().end = i + 1;
    if (direction.cosine <= 0) continue;
    if (front_end == first_ray) front_begin = i;
    front_end = i + 1;
  }
  for (std::vector<row_run_t>& runs : of_sectors_)
    for (row_run_t& run : runs) {
      if (run.eye != eye) continue;
      run.front_begin = std::max(run.begin, front_begin);
      run.front_end = std::max(run.front_begin, std::min(run.end, front_end));
    }
}

void Maker::AddSectors() {
  for (uint32_t sector = 0; sector < ROW_SECTOR_COUNT; sector++) {
    record_.sector_map[sector] = ROW_NOT_SEEN;
    if (of_sectors_[sector].empty()) continue;
    const auto first = static_cast<uint32_t>(runs_.size());
    runs_.insert(runs_.end(), of_sectors_[sector].begin(), of_sectors_[sector].end());
    record_.sector_map[sector] = static_cast<row_byte>(sectors_.size());
    sectors_.push_back({sector, first, static_cast<uint32_t>(runs_.size()), 0});
    const SineCosine middle = SinCos(static_cast<double>(sector) * ROW_SECTOR_WIDTH);
    cosines += middle.cosine;
    sines += middle.sine;
  }
}

/// The record and its parts, one after the other.
std::vector<uint64_t> Maker::Words() {
  record_.eye_count = static_cast<uint32_t>(eyes_.size());
  record_.sector_count = static_cast<uint32_t>(sectors_.size());
  std::vector<uint64_t> words(sizeof record_ / sizeof(uint64_t));
  const auto append = [&](const auto& part) {
    const size_t end = words.size(), bytes = part.size() * sizeof(part[0]);
    words.resize(end + bytes / sizeof(uint64_t));
    if (bytes > 0) std::memcpy(words.data() + end, part.data(), bytes);
    return static_cast<uint32_t>(end * sizeof(uint64_t));
  };
  record_.eyes = append(eyes_);
  record_.sectors = append(sectors_);
  record_.runs = append(runs_);
  record_.turns = append(turns_);
  std::memcpy(words.data(), &record_, sizeof record_);
  return words;
}

}  // namespace

RayLayout::RayLayout(const std::vector<ControllerSensor>& sensors,
                     std::span<const uint32_t> first_rays, double horizon) {
  Maker maker;
  for (size_t i = 0; i < sensors.size(); i++) maker.AddSensor(sensors[i], first_rays[i], horizon);
  maker.AddSectors();
  words_ = maker.Words();
  cosines_ = maker.cosines;
  sines_ = maker.sines;
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
