// SPDX-License-Identifier: GPL-2.0-or-later
//
// A fan: the rays that one sensor casts in one step. They share their start and length; each has a
// direction relative to the sensor's heading, taken from a table that is made once for each kind of
// sensor. So a fan is one small record, however many rays it has.

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
Direction MakeDirection(const SineCosine& turn);
Direction MakeDirection(double bearing);
/// Sine and cosine of a bearing, of 0 if it is not finite.
SineCosine TurnOf(double bearing);

/// Bearing of sample i of `count` over the field of view `fov`, counter-clockwise, both ends
/// included; a single sample looks straight ahead.
double SampleBearing(double fov, uint32_t count, uint32_t i);

/// The direction tables of all kinds of sensors in use, one behind the other.
class DirectionTables {
 public:
  DirectionTables();
  /// Index of the first direction of the table for this kind of sensor; makes it if need be. For
  /// several threads at once, as long as nobody reads tables.
  uint32_t Find(double fov, uint32_t count);
  /// The same for any bearings, in radians.
  uint32_t Find(const std::vector<double>& bearings);
  /// To be called between steps: if there is far more in tables than sensors use (as they keep
  /// changing), forgets them all. Indices got before are void if the generation has changed.
  void Trim();
  uint64_t generation() const { return generation_; }
  const std::vector<Direction>& all() const { return all_; }
  /// The same in doubles, one for each.
  const std::vector<SineCosine>& turns() const { return turns_; }

  /// A table of one direction: straight ahead.
  static constexpr uint32_t kAhead = 0;

 private:
  template <typename BearingOf>
  uint32_t Append(uint32_t count, BearingOf bearing_of);

  std::mutex mutex_;
  std::map<std::pair<double, uint32_t>, uint32_t> first_;
  std::map<std::vector<double>, uint32_t> first_of_bearings_;
  std::vector<Direction> all_;
  std::vector<SineCosine> turns_;
  uint64_t generation_ = 0;
  static constexpr std::size_t kPlenty = 4000000;  // directions: 96 MB
  std::size_t most_ = kPlenty;                     // before they are forgotten
  bool just_forgotten_ = false;
};

/// What a device needs to know of a fan.
using FanRecord = ray_fan_record_t;

/// How far a ray of a fan of a single leg goes, in Q16 cells.
struct Displacement {
  int x, y;
};
inline Displacement DisplacementOf(const FanRecord& fan, const Direction& d) {
  return {ray_rotate_x(fan.cosine, fan.sine, d.cosine, d.sine),
          ray_rotate_y(fan.cosine, fan.sine, d.cosine, d.sine)};
}
/// At its start.
inline void BeginRay(const ray_grid_t& grid, const FanRecord& fan, const Displacement& way,
                     ray_t* ray) {
  ray_begin(ray, &grid, fan.x, fan.y, static_cast<int>(fan.fraction & 0xffff),
            static_cast<int>(fan.fraction >> 16), way.x, way.y);
}

struct Fan {
  FanRecord record{};
  bool exact = false;   ///< ranges go to outlines, not to cells
  double x = 0, y = 0;  ///< start, metres
  double z = 0;         ///< height of the rays, metres
  SineCosine heading{0, 1};
  double range = 0;       ///< metres, may be infinite
  double leg_length = 0;  ///< metres: a long ray is walked in several legs
  double leg_cells = 0;   ///< the same in cells
  double legs = 1;        ///< whole number; infinite for an infinite range
  bool nothing = false;   ///< casts no ray: no length, or starts outside the grid
  bool z_test = true;
  uint32_t layer = 0;  ///< of the grid: what the rays may stop at is in it
  ray_test_func_t predicate = nullptr;
  const Model* finder = nullptr;
  const void* arg = nullptr;
  RaySink* sink = nullptr;
  uint32_t tag = 0;

  /// One leg: a device can walk it.
  bool single_leg() const { return !nothing && legs == 1; }
};

/// Fills in the start, heading, length and legs of a fan from `origin`, global; its heading need
/// not be normalised. `range` is in metres, not negative and not NaN.
void PlaceFan(Fan* fan, const Pose& origin, double range, double cells_per_metre);

/// Splits a coordinate in cells into its cell and a 16-bit fraction. False if it is out of the
/// grid.
bool SplitCell(double coordinate, int32_t* cell, uint32_t* fraction);

}  // namespace sensing
}  // namespace internal
}  // namespace Stg

namespace Stg {
namespace sensing = internal::sensing;  // for the rooms above: clients see no such header
}

#endif
