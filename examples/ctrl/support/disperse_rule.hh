// SPDX-License-Identifier: GPL-2.0-or-later
//
// Drives a robot away from near things, with any range sensors: a laser of any field of view, or a
// ring of single rays. Robots that all follow this rule spread over the whole place and stay
// spread.
//
// Things are local minima of the readings over all directions. A robot thus counts as much as a
// wall, although far fewer rays hit it. If readings were added up ray by ray, walls would press a
// crowd together in the middle. A wall, recognized by its width, counts like a mirror with another
// robot as far behind it. So a robot keeps as much space to a wall as to other robots.
//
// Direction: away from all things within the horizon, each weighted by 1/distance^2. Directions
// that no sensor covers count as average; otherwise a laser that looks ahead would find everything
// ahead. The length of the sum relative to the sum of lengths is the imbalance. It is 0 if things
// are evenly spread (the robot rests) and 1 if all are on one side. Robots with an all-round view
// come to rest. Robots with a few single beams, which others pass unseen, keep shifting a little.
//
// Speed: proportional to the imbalance, to how far ahead the goal is, and to the free path. The
// free path is how far the robot, as a disc, could go straight ahead before touching a point that a
// ray has hit.

#ifndef EXAMPLES_CTRL_SUPPORT_DISPERSE_RULE_HH
#define EXAMPLES_CTRL_SUPPORT_DISPERSE_RULE_HH

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <map>
#include <mutex>
#include <tuple>
#include <vector>

#include "geometry/trigonometry.hh"
#include "set_up.hh"

namespace ctrl {

/// An unlimited free path.
constexpr double kUnlimited = 1000.0;  // m

/// Number of sectors of equal width, counted from straight ahead to the left.
constexpr size_t kSectors = 72;
constexpr double kSectorWidth = 2 * M_PI / kSectors;

/// Unit vector of a sector's centre.
inline const Stg::SineCosine& MiddleOf(size_t sector) {
  static const auto middles = [] {
    std::array<Stg::SineCosine, kSectors> directions{};
    for (size_t i = 0; i < kSectors; i++)
      directions[i] = Stg::SinCos(static_cast<double>(i) * kSectorWidth);
    return directions;
  }();
  return middles[sector];
}

/// Unit vectors of a sensor's rays in the robot's frame, shared by all robots with an equal sensor.
struct RayTable {
  /// A range of consecutive rays in one sector.
  struct RayRange {
    size_t sector, begin, end;
  };

  std::vector<double> cosine, sine;
  std::vector<RayRange> ray_ranges;
  size_t front_begin = 0, front_end = 0;  ///< covers all rays that look ahead, possibly some more

  /// `mount`: heading of the sensor on the robot. `bearings`: headings of its rays. Radians.
  RayTable(double mount, const std::vector<double>& bearings) {
    for (size_t i = 0; i < bearings.size(); i++) {
      const Stg::SineCosine direction = Stg::SinCos(mount + bearings[i]);
      cosine.push_back(direction.cosine);
      sine.push_back(direction.sine);
      const size_t sector = SectorOf(direction);
      if (ray_ranges.empty() || ray_ranges.back().sector != sector)
        ray_ranges.push_back({sector, i, i});
      ray_ranges.back().end = i + 1;
      if (direction.cosine <= 0) continue;
      if (front_end == 0) front_begin = i;
      front_end = i + 1;
    }
  }

  size_t size() const { return cosine.size(); }

  static size_t SectorOf(const Stg::SineCosine& direction) {
    const double turns =
        Stg::ArcTangent(direction.sine, direction.cosine) / (2 * M_PI);  // -0.5 to 0.5
    const double sector = std::floor((turns < 0 ? turns + 1 : turns) * kSectors + 0.5);
    return static_cast<size_t>(sector) % kSectors;
  }
};

/// Returns the table for a kind of sensor, built on first use. Thread-safe.
inline const RayTable* FindRayTable(double mount, double fov, const std::vector<double>& bearings) {
  static std::mutex mutex;
  const std::lock_guard<std::mutex> lock(mutex);
  static std::map<std::tuple<double, double, size_t>, RayTable> tables;
  const double key_fov = std::isnan(fov) ? 0.0 : fov;  // as in the ranger
  const std::tuple<double, double, size_t> key(mount, key_fov, bearings.size());
  return &tables.try_emplace(key, mount, bearings).first->second;
}

/// The nearest reading in a sector.
struct SectorReading {
  bool seen = false;               ///< a ray looks into the sector
  double range = kUnlimited;       ///< m; kUnlimited if nothing is within reach
  const double* from = nullptr;    ///< the readings that contain it, if any
  const double* cosine = nullptr;  ///< unit vectors of these readings
  const double* sine = nullptr;

  Stg::SineCosine Direction() const {
    size_t ray = 0;
    while (from[ray] != range) ray++;
    return {sine[ray], cosine[ray]};
  }
};

/// Readings of all rays of a robot in one update.
struct Surroundings {
  std::array<SectorReading, kSectors> sectors;
  double free_path = kUnlimited;  ///< of the disc's centre, m
};

/// A vector of two doubles, which every x86-64 and AArch64 processor supports.
typedef double Pair __attribute__((vector_size(16)));

inline Pair LoadPair(const double* from) {
  Pair pair;
  std::memcpy(&pair, from, sizeof pair);
  return pair;
}

inline Pair Both(double value) { return Pair{value, value}; }
inline Pair Min(Pair a, Pair b) { return a < b ? a : b; }

/// Returns the minimum of some ranges, at most `most`.
inline double MinimumOf(const double* begin, const double* end, double most) {
  Pair least = Both(most);
  for (; end - begin >= 2; begin += 2) least = Min(LoadPair(begin), least);
  if (begin != end) least = Min(Both(*begin), least);
  return std::min(least[0], least[1]);
}

/// Adds a sensor's table.size() readings. Readings of `cap` and above are ignored.
inline void AddReadings(const RayTable& table, const double* ranges, double cap,
                        Surroundings* seen) {
  for (const RayTable::RayRange& run : table.ray_ranges) {
    SectorReading& reading = seen->sectors[run.sector];
    reading.seen = true;
    const double most = std::min(cap, reading.range);
    const double least = MinimumOf(ranges + run.begin, ranges + run.end, most);
    if (!(least < most)) continue;
    reading.range = least;
    reading.from = ranges + run.begin;
    reading.cosine = table.cosine.data() + run.begin;
    reading.sine = table.sine.data() + run.begin;
  }
}

/// A disc about the robot's origin that moves straight ahead, and a sensor at (x, y).
struct Path {
  double x, y, radius;

  /// Distance ahead of the points that the rays have hit; kUnlimited for points beside the way.
  Pair FreeUpTo(Pair range, Pair cosine, Pair sine) const {
    const Pair ahead = Both(x) + range * cosine;
    const Pair aside = Both(y) + range * sine;
    const auto in_the_way = (ahead > 0.0) & (aside < radius) & (aside > -radius);
    return in_the_way ? ahead : Both(kUnlimited);
  }
};

/// Shortens the free path by a sensor's hits. Not inlined, because GCC 12 would warn of a load that
/// the loop never executes if there is a single reading.
[[gnu::noinline]] inline void LimitFreePath(const RayTable& table, const double* ranges,
                                            const Path& path, Surroundings* seen) {
  const double *cosine = table.cosine.data(), *sine = table.sine.data();
  Pair nearest = Both(seen->free_path);
  size_t i = table.front_begin;
  for (; i + 2 <= table.front_end; i += 2)
    nearest =
        Min(path.FreeUpTo(LoadPair(ranges + i), LoadPair(cosine + i), LoadPair(sine + i)), nearest);
  for (; i < table.front_end; i++)
    nearest = Min(path.FreeUpTo(Both(ranges[i]), Both(cosine[i]), Both(sine[i])), nearest);
  seen->free_path = std::min(nearest[0], nearest[1]);
}

struct DisperseRule {
  double speed = 0.4;       ///< maximum, m/s
  double gain = 1.0;        ///< rad/s per rad of bearing to the goal
  double max_turn = 1.5;    ///< rad/s
  double margin = 0.1;      ///< to keep from everything, m
  double horizon = 5.0;     ///< things further away are ignored, m
  double balanced = 0.1;    ///< rest if the imbalance is less
  double unbalanced = 0.3;  ///< full speed if the imbalance is more
};

/// Computes how strongly the things around a robot repel it.
class Repulsion {
 public:
  Repulsion(const Surroundings& seen, double radius, double horizon)
      : seen_(seen), radius_(radius), horizon_(horizon) {}

  /// Repulsion of the thing in a sector, 1/m^2; 0 if there is none.
  double PushOf(size_t sector) const {
    const double range = At(sector).range;
    if (!(range < horizon_) || !IsNearest(sector)) return 0;
    const double nearest = std::max(range, radius_);
    const double distance = IsWall(sector) ? 2 * nearest : nearest;
    return std::max(0.0, 1 / (distance * distance) - 1 / (horizon_ * horizon_));
  }

 private:
  const SectorReading& At(size_t sector) const { return seen_.sectors[sector % kSectors]; }

  /// True if the sector is a local minimum. The neighbourhood is slightly wider than the 22.5
  /// degrees between the beams of a ring of sixteen. The first of two equal sectors counts.
  bool IsNearest(size_t sector) const {
    constexpr size_t kAside = 5;
    const double range = At(sector).range;
    for (size_t i = 1; i <= kAside; i++) {
      if (!(range < At(sector + kSectors - i).range && range <= At(sector + i).range)) return false;
    }
    return true;
  }

  /// True if the thing is wider than two robots like this one.
  bool IsWall(size_t sector) const {
    const size_t width = 1 + Extent(sector, 1) + Extent(sector, kSectors - 1);
    return static_cast<double>(width) * kSectorWidth * At(sector).range > 4 * radius_;
  }

  /// Number of further sectors, in steps to the left or right, in which the thing is about as near.
  size_t Extent(size_t sector, size_t step) const {
    constexpr double kAboutAsNear = 1.3;
    size_t extent = 0;
    for (size_t i = 1; i < kSectors / 2; i++) {
      const SectorReading& reading = At(sector + i * step);
      if (!reading.seen) continue;
      if (!(reading.range < kAboutAsNear * At(sector).range)) break;
      extent = i;
    }
    return extent;
  }

  const Surroundings& seen_;
  double radius_, horizon_;
};

/// Direction to drive, and its urgency.
struct Goal {
  double x = 0, y = 0;   ///< 1/m^2, in the robot's frame
  double imbalance = 0;  ///< 0 to 1
};

inline Goal FindGoal(const Surroundings& seen, double radius, double horizon) {
  const Repulsion repulsion(seen, radius, horizon);
  Goal goal;
  double total = 0, cosines = 0, sines = 0, count = 0;
  for (size_t i = 0; i < kSectors; i++) {
    if (!seen.sectors[i].seen) continue;
    count++;
    cosines += MiddleOf(i).cosine;
    sines += MiddleOf(i).sine;
    const double push = repulsion.PushOf(i);
    if (push == 0) continue;
    const Stg::SineCosine direction = seen.sectors[i].Direction();
    total += push;
    goal.x -= push * direction.cosine;
    goal.y -= push * direction.sine;
  }
  if (!(total > 0)) return Goal();
  // Unseen directions repel like the average of the others.
  goal.x += total / count * cosines;
  goal.y += total / count * sines;
  goal.imbalance = std::sqrt(goal.x * goal.x + goal.y * goal.y) / total;
  return goal;
}

/// Returns the command for a disc of this radius.
inline Drive Disperse(const Surroundings& seen, double radius, const DisperseRule& rule) {
  const Goal goal = FindGoal(seen, radius, rule.horizon);
  if (!(goal.imbalance > rule.balanced)) return Drive();

  // Moves gently if there is little to gain, so that robots almost at rest do not oscillate.
  const double urge = std::min(1.0, goal.imbalance / rule.unbalanced);
  // Full speed needs a few radii of space, so that the robot stops smoothly.
  const double clearance = (seen.free_path - radius) / (4.0 * radius);
  const double facing = goal.x / std::sqrt(goal.x * goal.x + goal.y * goal.y);
  return Drive{rule.speed * std::max(0.0, std::min(urge, clearance)) * std::max(0.0, facing),
               Stg::constrain(rule.gain * urge * Stg::ArcTangent(goal.y, goal.x), -rule.max_turn,
                              rule.max_turn)};
}

}  // namespace ctrl

#endif
