// SPDX-License-Identifier: GPL-2.0-or-later
//
// Driving away from what is near, with any range sensors: one laser of whatever field of view, or a
// ring of single rays. Robots among others that do the same spread over the whole place, and those
// that are spread stay so.
//
// What is looked at are things: the nearest readings of all round, those that are nearer than what
// is to both sides of them. So a robot counts as much as a wall, although far fewer rays meet it;
// were readings added up ray by ray, walls would press a crowd together in the middle. A wall,
// which is known by its width, counts as if it were a mirror, and another robot stood as far behind
// it: a robot wants as much room to itself at a wall as it has among others.
//
// Where to: away from all things, from each by 1/distance^2, none beyond the horizon. What the
// sensors do not cover counts as average, as nothing is known of it: otherwise a laser that looks
// ahead would find everything to be ahead. The length of the sum, compared to that of its parts, is
// the imbalance: 0 where things are evenly spread (there the robot rests), 1 where all is on one
// side. Robots that see all round come to rest; those with a few single beams only, between which
// others come and go, stay spread but keep changing places a little.
//
// How fast: by the imbalance, by how far the goal is ahead, and by the free path: how far the
// robot, taken to be a disc, could go straight on before the disc touches a point that some ray has
// hit.

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

/// A free path that nothing limits.
constexpr double kFarthest = 1000.0;  // m

/// The surroundings are seen in that many sectors of the same width, from straight ahead to the
/// left.
constexpr size_t kSectors = 72;
constexpr double kSectorWidth = 2 * M_PI / kSectors;

/// Where the middle of a sector is.
inline const Stg::SineCosine& MiddleOf(size_t sector) {
  static const auto middles = [] {
    std::array<Stg::SineCosine, kSectors> directions{};
    for (size_t i = 0; i < kSectors; i++)
      directions[i] = Stg::SinCos(static_cast<double>(i) * kSectorWidth);
    return directions;
  }();
  return middles[sector];
}

/// The directions of a sensor's rays in the robot's frame. The same for all robots with such a
/// sensor, so they share it.
struct RayTable {
  /// Successive rays in one sector.
  struct Run {
    size_t sector, begin, end;
  };

  std::vector<double> cosine, sine;
  std::vector<Run> runs;
  size_t front_begin = 0, front_end = 0;  ///< all rays that look ahead, perhaps some others

  /// `mount`: the heading of the sensor on the robot, `bearings`: those of its rays, in radians.
  RayTable(double mount, const std::vector<double>& bearings) {
    for (size_t i = 0; i < bearings.size(); i++) {
      const Stg::SineCosine direction = Stg::SinCos(mount + bearings[i]);
      cosine.push_back(direction.cosine);
      sine.push_back(direction.sine);
      const size_t sector = SectorOf(direction);
      if (runs.empty() || runs.back().sector != sector) runs.push_back({sector, i, i});
      runs.back().end = i + 1;
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

/// The table of a kind of sensor, made when first asked for. Several threads may ask.
inline const RayTable* FindRayTable(double mount, double fov, const std::vector<double>& bearings) {
  static std::mutex mutex;
  const std::lock_guard<std::mutex> lock(mutex);
  static std::map<std::tuple<double, double, size_t>, RayTable> tables;
  const double key_fov = std::isnan(fov) ? 0.0 : fov;  // as the ranger has it
  const std::tuple<double, double, size_t> key(mount, key_fov, bearings.size());
  return &tables.try_emplace(key, mount, bearings).first->second;
}

/// The nearest reading in a sector.
struct Sight {
  bool seen = false;               ///< some ray looks there
  double range = kFarthest;        ///< m; kFarthest: nothing within reach
  const double* from = nullptr;    ///< the readings among which it is, if it is any
  const double* cosine = nullptr;  ///< of their directions
  const double* sine = nullptr;

  Stg::SineCosine Direction() const {
    size_t ray = 0;
    while (from[ray] != range) ray++;
    return {sine[ray], cosine[ray]};
  }
};

/// What all rays of a robot have seen in one update.
struct Surroundings {
  std::array<Sight, kSectors> sectors;
  double free_path = kFarthest;  ///< m, of the disc's centre
};

/// Two numbers that the processor handles at once: what x86-64 and AArch64 all have.
typedef double Pair __attribute__((vector_size(16)));

inline Pair LoadPair(const double* from) {
  Pair pair;
  std::memcpy(&pair, from, sizeof pair);
  return pair;
}

inline Pair Both(double value) { return Pair{value, value}; }
inline Pair Lesser(Pair a, Pair b) { return a < b ? a : b; }

/// The least of some ranges, or `most` if there is none below.
inline double Least(const double* begin, const double* end, double most) {
  Pair least = Both(most);
  for (; end - begin >= 2; begin += 2) least = Lesser(LoadPair(begin), least);
  if (begin != end) least = Lesser(Both(*begin), least);
  return std::min(least[0], least[1]);
}

/// Adds a sensor's readings; there are table.size() of them. From `cap` on they count as nothing.
inline void AddReadings(const RayTable& table, const double* ranges, double cap,
                        Surroundings* seen) {
  for (const RayTable::Run& run : table.runs) {
    Sight& sight = seen->sectors[run.sector];
    sight.seen = true;
    const double most = std::min(cap, sight.range);
    const double least = Least(ranges + run.begin, ranges + run.end, most);
    if (!(least < most)) continue;
    sight.range = least;
    sight.from = ranges + run.begin;
    sight.cosine = table.cosine.data() + run.begin;
    sight.sine = table.sine.data() + run.begin;
  }
}

/// A disc of some radius about the robot's origin that goes straight on, and a sensor at (x, y).
struct Path {
  double x, y, radius;

  /// How far ahead the points are that the rays have hit; kFarthest for those not in the way.
  Pair FreeUpTo(Pair range, Pair cosine, Pair sine) const {
    const Pair ahead = Both(x) + range * cosine;
    const Pair aside = Both(y) + range * sine;
    const auto in_the_way = (ahead > 0.0) & (aside < radius) & (aside > -radius);
    return in_the_way ? ahead : Both(kFarthest);
  }
};

/// Shortens the free path by what a sensor has hit. (Not inlined: where GCC 12 sees a single
/// reading it warns of a load that the loop never makes.)
[[gnu::noinline]] inline void LimitFreePath(const RayTable& table, const double* ranges,
                                            const Path& path, Surroundings* seen) {
  const double *cosine = table.cosine.data(), *sine = table.sine.data();
  Pair nearest = Both(seen->free_path);
  size_t i = table.front_begin;
  for (; i + 2 <= table.front_end; i += 2)
    nearest = Lesser(path.FreeUpTo(LoadPair(ranges + i), LoadPair(cosine + i), LoadPair(sine + i)),
                     nearest);
  for (; i < table.front_end; i++)
    nearest = Lesser(path.FreeUpTo(Both(ranges[i]), Both(cosine[i]), Both(sine[i])), nearest);
  seen->free_path = std::min(nearest[0], nearest[1]);
}

struct DisperseRule {
  double speed = 0.4;       ///< m/s at most
  double gain = 1.0;        ///< rad/s for each rad that the goal is off
  double max_turn = 1.5;    ///< rad/s
  double margin = 0.1;      ///< m between the robot and anything else
  double horizon = 5.0;     ///< m: what is farther away counts as nothing
  double balanced = 0.1;    ///< rest where the imbalance is less
  double unbalanced = 0.3;  ///< full speed where it is more
};

/// What pushes a robot.
class Things {
 public:
  Things(const Surroundings& seen, double radius, double horizon)
      : seen_(seen), radius_(radius), horizon_(horizon) {}

  /// 1/m^2: how strongly the thing in a sector pushes; 0 if there is none.
  double PushOf(size_t sector) const {
    const double range = At(sector).range;
    if (!(range < horizon_) || !IsNearest(sector)) return 0;
    const double nearest = std::max(range, radius_);
    const double distance = IsWall(sector) ? 2 * nearest : nearest;
    return std::max(0.0, 1 / (distance * distance) - 1 / (horizon_ * horizon_));
  }

 private:
  const Sight& At(size_t sector) const { return seen_.sectors[sector % kSectors]; }

  /// Nearer than all to both sides of it, to a little more than the 22.5 degrees between the beams
  /// of a ring of sixteen. Of two that are equal the first counts.
  bool IsNearest(size_t sector) const {
    constexpr size_t kAside = 5;
    const double range = At(sector).range;
    for (size_t i = 1; i <= kAside; i++) {
      if (!(range < At(sector + kSectors - i).range && range <= At(sector + i).range)) return false;
    }
    return true;
  }

  /// Wider than two robots like this one.
  bool IsWall(size_t sector) const {
    const size_t width = 1 + Extent(sector, 1) + Extent(sector, kSectors - 1);
    return static_cast<double>(width) * kSectorWidth * At(sector).range > 4 * radius_;
  }

  /// How many sectors further, in steps to the left or to the right, the thing is about as near.
  size_t Extent(size_t sector, size_t step) const {
    constexpr double kAboutAsNear = 1.3;
    size_t extent = 0;
    for (size_t i = 1; i < kSectors / 2; i++) {
      const Sight& sight = At(sector + i * step);
      if (!sight.seen) continue;
      if (!(sight.range < kAboutAsNear * At(sector).range)) break;
      extent = i;
    }
    return extent;
  }

  const Surroundings& seen_;
  double radius_, horizon_;
};

/// Where to, and how much there is to it.
struct Goal {
  double x = 0, y = 0;   ///< 1/m^2, in the robot's frame
  double imbalance = 0;  ///< 0 to 1
};

inline Goal FindGoal(const Surroundings& seen, double radius, double horizon) {
  const Things things(seen, radius, horizon);
  Goal goal;
  double total = 0, cosines = 0, sines = 0, count = 0;
  for (size_t i = 0; i < kSectors; i++) {
    if (!seen.sectors[i].seen) continue;
    count++;
    cosines += MiddleOf(i).cosine;
    sines += MiddleOf(i).sine;
    const double push = things.PushOf(i);
    if (push == 0) continue;
    const Stg::SineCosine direction = seen.sectors[i].Direction();
    total += push;
    goal.x -= push * direction.cosine;
    goal.y -= push * direction.sine;
  }
  if (!(total > 0)) return Goal();
  // As if what is not seen pushed like the average of the rest.
  goal.x += total / count * cosines;
  goal.y += total / count * sines;
  goal.imbalance = std::sqrt(goal.x * goal.x + goal.y * goal.y) / total;
  return goal;
}

/// How a disc of that radius is to move.
inline Drive Disperse(const Surroundings& seen, double radius, const DisperseRule& rule) {
  const Goal goal = FindGoal(seen, radius, rule.horizon);
  if (!(goal.imbalance > rule.balanced)) return Drive();

  // Gently where there is little to gain, so that robots that are all but at rest don't rock.
  const double urge = std::min(1.0, goal.imbalance / rule.unbalanced);
  // Full speed from a few radii of room on, so that the robot comes to a gentle halt.
  const double room = (seen.free_path - radius) / (4.0 * radius);
  const double facing = goal.x / std::sqrt(goal.x * goal.x + goal.y * goal.y);
  return Drive{rule.speed * std::max(0.0, std::min(urge, room)) * std::max(0.0, facing),
               Stg::constrain(rule.gain * urge * Stg::ArcTangent(goal.y, goal.x), -rule.max_turn,
                              rule.max_turn)};
}

}  // namespace ctrl

#endif
