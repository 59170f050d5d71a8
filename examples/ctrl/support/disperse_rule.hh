// SPDX-License-Identifier: GPL-2.0-or-later
//
// Driving to where there is most room, with any range sensors: one laser of whatever field of view,
// or a ring of single rays. A robot among others that do the same goes on until it is as far from
// them as from the walls, so that together they spread over the whole place.
//
// Where to: the sum over all rays of (reading - mean reading) times the ray's direction. Taking the
// mean off makes a blind area count as average, as nothing is known of it: otherwise a laser that
// looks ahead would find everything to be ahead. For an even ring the mean makes no difference.
// The length of the sum, compared to that of all readings put end to end, is the imbalance: 0 where
// all directions are alike (there the robot rests), 1 where only one is open.
//
// How fast: by the imbalance, by how far the goal is ahead, and by the free path: how far the
// robot, taken to be a disc, could go straight on before the disc touches a point that some ray has
// hit.

#ifndef EXAMPLES_CTRL_SUPPORT_DISPERSE_RULE_HH
#define EXAMPLES_CTRL_SUPPORT_DISPERSE_RULE_HH

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <tuple>
#include <vector>

#include "geometry/trigonometry.hh"
#include "set_up.hh"

namespace ctrl {

/// A free path that nothing limits.
constexpr double kFarthest = 1000.0;  // m

/// The directions of a sensor's rays in the robot's frame. The same for all robots with such a
/// sensor, so they share it.
struct RayTable {
  std::vector<double> cosine, sine;
  double cosine_sum = 0, sine_sum = 0;
  size_t front_begin = 0, front_end = 0;  ///< all rays that look ahead, perhaps some others

  /// `mount`: the heading of the sensor on the robot, `bearings`: those of its rays, in radians.
  RayTable(double mount, const std::vector<double>& bearings) {
    for (size_t i = 0; i < bearings.size(); i++) {
      const Stg::SineCosine direction = Stg::SinCos(mount + bearings[i]);
      cosine.push_back(direction.cosine);
      sine.push_back(direction.sine);
      cosine_sum += direction.cosine;
      sine_sum += direction.sine;
      if (direction.cosine <= 0) continue;
      if (front_end == 0) front_begin = i;
      front_end = i + 1;
    }
  }

  size_t size() const { return cosine.size(); }
};

/// The table of a kind of sensor, made when first asked for.
inline const RayTable* FindRayTable(double mount, double fov, const std::vector<double>& bearings) {
  static std::map<std::tuple<double, double, size_t>, RayTable> tables;
  const double key_fov = std::isnan(fov) ? 0.0 : fov;  // as the ranger has it
  const std::tuple<double, double, size_t> key(mount, key_fov, bearings.size());
  return &tables.try_emplace(key, mount, bearings).first->second;
}

/// What all rays of a robot have seen in one update.
struct Surroundings {
  double x = 0, y = 0;  ///< m: the sum of readings times directions
  double length = 0;    ///< m: the sum of readings
  double cosine_sum = 0, sine_sum = 0;
  double rays = 0;
  double free_path = kFarthest;  ///< m, of the disc's centre
};

/// Two numbers that the processor handles at once: what x86-64 and AArch64 all have. Sums are kept
/// in a fixed number of such lanes, so that the order of additions is the same everywhere.
typedef double Pair __attribute__((vector_size(16)));

inline Pair LoadPair(const double* from) {
  Pair pair;
  std::memcpy(&pair, from, sizeof pair);
  return pair;
}

inline Pair Both(double value) { return Pair{value, value}; }
inline Pair Lesser(Pair a, Pair b) { return a < b ? a : b; }

/// Sums of readings in the making.
struct ReadingSums {
  Pair x{}, y{}, length{};

  void Add(Pair range, Pair cosine, Pair sine) {
    x += range * cosine;
    y += range * sine;
    length += range;
  }
  void AddTo(Surroundings* seen) const {
    seen->x += x[0] + x[1];
    seen->y += y[0] + y[1];
    seen->length += length[0] + length[1];
  }
};

/// Adds a sensor's readings; there are table.size() of them. What is longer than `cap` is cut.
inline void AddReadings(const RayTable& table, const double* ranges, double cap,
                        Surroundings* seen) {
  const double *cosine = table.cosine.data(), *sine = table.sine.data();
  const size_t count = table.size();
  ReadingSums even, odd;  // two, as an addition has to wait for the one before
  size_t i = 0;
  for (; i + 4 <= count; i += 4) {
    even.Add(Lesser(LoadPair(ranges + i), Both(cap)), LoadPair(cosine + i), LoadPair(sine + i));
    odd.Add(Lesser(LoadPair(ranges + i + 2), Both(cap)), LoadPair(cosine + i + 2),
            LoadPair(sine + i + 2));
  }
  for (; i < count; i++)
    even.Add(Pair{ranges[i] < cap ? ranges[i] : cap, 0}, Both(cosine[i]), Both(sine[i]));
  even.AddTo(seen);
  odd.AddTo(seen);
  seen->cosine_sum += table.cosine_sum;
  seen->sine_sum += table.sine_sum;
  seen->rays += static_cast<double>(count);
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
  double speed = 0.4;     ///< m/s at most
  double gain = 1.0;      ///< rad/s for each rad that the goal is off
  double max_turn = 1.5;  ///< rad/s
  double margin = 0.1;    ///< m between the robot and anything else
  /// m: readings count as no more. A shorter horizon draws robots less to the middle of large
  /// rooms, a longer one lets them know sooner of each other. Of 2, 3, 5 and 8 m, with 36 robots
  /// in 20 x 20 m that start in a corner, 5 m leaves them farthest apart.
  double horizon = 5.0;
  double balanced = 0.01;   ///< rest where the imbalance is less
  double unbalanced = 0.1;  ///< full speed where it is more
};

/// How a disc of that radius is to move.
inline Drive Disperse(const Surroundings& seen, double radius, const DisperseRule& rule) {
  if (!(seen.length > 0)) return Drive();
  const double mean = seen.length / seen.rays;
  const double x = seen.x - mean * seen.cosine_sum;
  const double y = seen.y - mean * seen.sine_sum;
  const double distance = std::sqrt(x * x + y * y);
  const double imbalance = distance / seen.length;
  if (!(imbalance > rule.balanced)) return Drive();

  // Full speed from a few radii of room on, so that the robot comes to a gentle halt.
  const double room = (seen.free_path - radius) / (4.0 * radius);
  const double share = std::min({1.0, room, imbalance / rule.unbalanced});
  const double facing = x / distance;  // the cosine of the angle to the goal
  return Drive{rule.speed * std::max(0.0, share) * std::max(0.0, facing),
               Stg::constrain(rule.gain * std::atan2(y, x), -rule.max_turn, rule.max_turn)};
}

}  // namespace ctrl

#endif
