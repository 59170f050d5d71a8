// SPDX-License-Identifier: GPL-2.0-or-later
//
// A fan: the rays that one sensor casts in one step. They share a start and a length; their
// directions relative to the sensor's heading come from a table per kind of sensor. So a fan is one
// small record, however many rays it has.

#ifndef STAGE_SENSING_FAN_HH
#define STAGE_SENSING_FAN_HH

#include <cstdint>
#include <map>
#include <mutex>
#include <utility>
#include <vector>

#include "geometry/geometry.hh"
#include "geometry/trigonometry.hh"
#include "grid/ray_model.hh"
#include "kernels/ray_walk.h"
#include "kernels/records.h"
#include "sensing/ray_hit.hh"

namespace Stg {

namespace internal {
namespace sensing {

/// A direction relative to a sensor's heading.
using Direction = ray_direction_t;
Direction MakeDirection(const SineCosine& unit_vector);
Direction MakeDirection(double bearing);
/// Sine and cosine of a bearing in radians; those of 0 if it is not finite.
SineCosine UnitVectorOf(double bearing);

/// Bearing, in radians, of sample i of `count` over the field of view `fov`. Samples run
/// counter-clockwise and include both ends; a single sample points straight ahead, as do all if
/// `fov` is not finite.
double SampleBearing(double fov, uint32_t count, uint32_t i);

/// The direction tables of all kinds of sensors in use, concatenated.
class DirectionTables {
 public:
  DirectionTables();
  /// Index of the first direction of this kind of sensor; makes the table if needed. Several
  /// threads may call it at once, as long as none reads the tables.
  uint32_t Find(double fov, uint32_t count);
  /// Like Find(fov, count), for arbitrary bearings in radians.
  uint32_t Find(const std::vector<double>& bearings);
  /// Call between steps. Forgets all tables if they hold far more than the sensors use, because
  /// bearings keep changing. Indices are void when generation() has changed.
  void Trim();
  uint64_t generation() const { return generation_; }
  const std::vector<Direction>& all() const { return all_; }
  /// Directions in doubles, with the same indices.
  const std::vector<SineCosine>& unit_vectors() const { return unit_vectors_; }

  /// Index of a table with one direction, straight ahead.
  static constexpr uint32_t kAhead = 0;

 private:
  template <typename BearingOf>
  uint32_t Append(uint32_t count, BearingOf bearing_of);

  std::mutex mutex_;
  std::map<std::pair<double, uint32_t>, uint32_t> first_;
  std::map<std::vector<double>, uint32_t> first_of_bearings_;
  std::vector<Direction> all_;
  std::vector<SineCosine> unit_vectors_;
  uint64_t generation_ = 0;
  static constexpr std::size_t kDefaultLimit = 4000000;  // number of directions: 96 MB
  std::size_t limit_ = kDefaultLimit;                    // limit before all are forgotten
  bool just_forgotten_ = false;
};

/// The data of a fan that a device needs.
using FanRecord = ray_fan_record_t;

/// Vector from start to end of a ray with a single leg, in Q16 cells.
struct Displacement {
  int x, y;
};
inline Displacement DisplacementOf(const FanRecord& fan, const Direction& d) {
  return {ray_rotate_x(fan.cosine, fan.sine, d.cosine, d.sine),
          ray_rotate_y(fan.cosine, fan.sine, d.cosine, d.sine)};
}
/// Prepares a walk from the start of the fan.
inline void BeginRay(const ray_grid_t& grid, const FanRecord& fan, const Displacement& way,
                     ray_t* ray) {
  ray_begin(ray, &grid, fan.x, fan.y, static_cast<int>(fan.fraction & 0xffff),
            static_cast<int>(fan.fraction >> 16), way.x, way.y);
}

struct Fan {
  FanRecord record{};
  bool exact = false;   ///< ranges refer to outlines instead of cells
  double x = 0, y = 0;  ///< start, metres
  double z = 0;         ///< height of the rays, metres
  SineCosine heading{0, 1};
  double range = 0;       ///< metres, may be infinite
  double leg_length = 0;  ///< metres; a long ray is walked in several legs
  double leg_cells = 0;   ///< length of a leg in cells
  double legs = 1;        ///< whole number; infinite for an infinite range
  bool nothing = false;   ///< casts no rays: zero length, or start outside of the grid
  bool z_test = true;
  uint32_t layer = 0;  ///< layer of the grid with what the rays may hit
  ray_test_func_t predicate = nullptr;
  const Model* finder = nullptr;
  const void* arg = nullptr;
  RaySink* sink = nullptr;
  uint32_t tag = 0;
  /// The finder's tree, if the predicate accepts all that rangers see but this tree: then a device
  /// can find the ranges. Otherwise null.
  const void* sees_all_but = nullptr;

  /// True if a device can walk it.
  bool single_leg() const { return !nothing && legs == 1; }
};

/// Sets start, heading, length and legs from `origin`, a global pose whose angle need not be
/// normalized. `range` is in metres, neither negative nor NaN.
void PlaceFan(Fan* fan, const Pose& origin, double range, double cells_per_metre);
/// Moves a fan that was placed inside of the grid to another start and heading.
void MoveFan(Fan* fan, double x, double y, const SineCosine& heading, double cells_per_metre);

/// Splits a coordinate in cells into cell and 16-bit fraction. Returns false outside of the grid.
bool SplitCell(double coordinate, int32_t* cell, uint32_t* fraction);

}  // namespace sensing
}  // namespace internal
}  // namespace Stg

namespace Stg {
namespace sensing = internal::sensing;  // for internal modules: clients do not see this header
}

#endif
