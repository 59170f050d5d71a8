// SPDX-License-Identifier: GPL-2.0-or-later

#include "sensing/fan.hh"

#include <algorithm>
#include <cmath>
#include <utility>

#include "geometry/floor.hh"
#include "geometry/trigonometry.hh"
#include "grid/grid.hh"
#include "messages/assert.hh"

namespace Stg::internal::sensing {

namespace {

constexpr double kQ16 = 65536.0;
constexpr double kQ30 = 1073741824.0;

/// Rounds to the nearest integer, ties away from zero, in any rounding mode.
int32_t Rounded(double value) {
  return value < 0 ? -FloorToInt(0.5 - value) : FloorToInt(value + 0.5);
}

}  // namespace

bool SplitCell(double coordinate, int32_t* cell, uint32_t* fraction) {
  if (!FloorIsWithin(coordinate, grid::kMaxCell)) return false;  // NaN too
  *cell = FloorToInt(coordinate);
  *fraction = static_cast<uint32_t>((coordinate - *cell) * kQ16);
  if (*fraction > 65535) *fraction = 65535;
  return true;
}

SineCosine UnitVectorOf(double bearing) { return SinCos(std::isfinite(bearing) ? bearing : 0.0); }

Direction MakeDirection(const SineCosine& unit_vector) {
  return {Rounded(unit_vector.cosine * kQ30), Rounded(unit_vector.sine * kQ30)};
}

Direction MakeDirection(double bearing) { return MakeDirection(UnitVectorOf(bearing)); }

double SampleBearing(double fov, uint32_t count, uint32_t i) {
  STAGE_ASSERT(i < count);
  if (count < 2 || !std::isfinite(fov)) return 0.0;
  return -fov / 2.0 + i * (fov / (count - 1));
}

DirectionTables::DirectionTables() { Find(0.0, 1); }

void DirectionTables::Trim() {
  // Directions that were in use again one step after Trim() set the new limit.
  if (std::exchange(just_forgotten_, false)) limit_ = std::max(kDefaultLimit, 4 * all_.size());
  if (all_.size() < limit_) return;
  first_.clear();
  first_of_bearings_.clear();
  all_ = {};  // their memory too
  unit_vectors_ = {};
  generation_++;
  just_forgotten_ = true;
  Find(0.0, 1);
}

uint32_t DirectionTables::Find(double fov, uint32_t count) {
  if (count == 1) fov = 0.0;  // all single samples look ahead
  const std::lock_guard<std::mutex> lock(mutex_);
  if (const auto known = first_.find({fov, count}); known != first_.end()) return known->second;
  const uint32_t first = Append(count, [&](uint32_t i) { return SampleBearing(fov, count, i); });
  // Stored last, because any of the above may throw bad_alloc.
  return first_[{fov, count}] = first;
}

uint32_t DirectionTables::Find(const std::vector<double>& bearings) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (const auto known = first_of_bearings_.find(bearings); known != first_of_bearings_.end())
    return known->second;
  const uint32_t first =
      Append(static_cast<uint32_t>(bearings.size()), [&](uint32_t i) { return bearings[i]; });
  return first_of_bearings_[bearings] = first;
}

/// Appends directions and returns the index of the first one.
template <typename BearingOf>
uint32_t DirectionTables::Append(uint32_t count, BearingOf bearing_of) {
  const size_t first = all_.size();
  // There are more unit vectors if memory was exhausted between the two calls of resize().
  STAGE_ASSERT(unit_vectors_.size() >= first && first + count <= UINT32_MAX);
  unit_vectors_.resize(first + count);
  all_.resize(first + count);
  for (uint32_t i = 0; i < count; i++) {
    unit_vectors_[first + i] = UnitVectorOf(bearing_of(i));
    all_[first + i] = MakeDirection(unit_vectors_[first + i]);
  }
  return static_cast<uint32_t>(first);
}

void PlaceFan(Fan* fan, const Pose& origin, double range, double cells_per_metre) {
  STAGE_ASSERT(cells_per_metre > 0);
  fan->x = origin.x;
  fan->y = origin.y;
  fan->z = origin.z;
  fan->range = range;
  fan->legs = 1;
  fan->leg_length = range;
  double cells = range * cells_per_metre;
  if (cells > RAY_LEG_CELLS) {
    fan->legs = std::ceil(cells / RAY_LEG_CELLS);
    cells = std::isinf(fan->legs) ? RAY_LEG_CELLS : cells / fan->legs;
    fan->leg_length = cells / cells_per_metre;
  }
  fan->nothing = !(range > 0) || !std::isfinite(origin.a) || std::isnan(origin.z);
  if (fan->nothing) return;
  STAGE_ASSERT(cells >= 0 && cells <= RAY_LEG_CELLS && fan->legs >= 1);
  fan->leg_cells = cells;
  MoveFan(fan, origin.x, origin.y, SinCos(origin.a), cells_per_metre);
}

void MoveFan(Fan* fan, double x, double y, const SineCosine& heading, double cells_per_metre) {
  FanRecord& record = fan->record;
  uint32_t fx = 0, fy = 0;
  fan->x = x;
  fan->y = y;
  fan->nothing = !SplitCell(x * cells_per_metre, &record.x, &fx) ||
                 !SplitCell(y * cells_per_metre, &record.y, &fy);
  if (fan->nothing) return;
  fan->heading = heading;
  record.fraction = fx | fy << 16;
  record.cosine = Rounded(heading.cosine * fan->leg_cells * kQ16);
  record.sine = Rounded(heading.sine * fan->leg_cells * kQ16);
}

}  // namespace Stg::internal::sensing
