// SPDX-License-Identifier: GPL-2.0-or-later
//
// Numbers of properties that may differ between the worlds of a scene. They change no shape, so
// that a row can hold them.

#ifndef STAGE_ROWS_VARIED_HH
#define STAGE_ROWS_VARIED_HH

#include <cstdint>
#include <limits>

#include "geometry/geometry.hh"
#include "motion/drive.hh"

namespace Stg::rows {

/// The properties of world files that rows can vary.
enum class VariedProperty : uint8_t {
  kMass,
  kFriction,
  kFloorFriction,
  kWheelSlip,
  kVelocityBounds,
  kAccelerationBounds,
  kOdomError,
  kOdomNoise,
  kWheelbase,
  kSteeringLimit,
  kSteeringRate,
  kNoise,
  kNone
};

/// A number of a property of a model.
struct VariedNumber {
  uint32_t model = 0;   ///< id
  uint32_t sensor = 0;  ///< index in its ranger; otherwise 0
  VariedProperty property = VariedProperty::kNone;
  uint32_t element = 0;  ///< among the numbers of the property

  bool operator==(const VariedNumber&) const = default;
};

/// A number that varies in a scene.
struct Varied {
  VariedNumber number;
  double unit;      ///< by which a number of the world file is multiplied
  uint32_t mover;   ///< in Scene::movers; kNone: it is of a sensor, or has no effect
  uint32_t sensor;  ///< in Scene::sensors; kNone: there is none, or it does not run
  static constexpr uint32_t kNone = UINT32_MAX;
};

/// Properties of a mover that a step reads. Those of driving concern robots only.
struct MoverProperties {
  double mass = 0;                          ///< kg, of the root
  double friction = 0, floor_friction = 0;  ///< coefficients
  double grip = 0;                          ///< N, see motion::Columns; follows from the others
  double wheel_slip = 0;
  double wheelbase = 1;
  double steering_limit = std::numeric_limits<double>::infinity();
  double steering_rate = std::numeric_limits<double>::infinity();
  Bounds velocity_bounds[4], acceleration_bounds[4];

  /// Sets what a drive reads. It must not outlive these properties.
  void PutInto(DriveInput* input) const {
    input->wheelbase = wheelbase;
    input->steering_limit = steering_limit;
    input->steering_rate = steering_rate;
    input->velocity_bounds = velocity_bounds;
    input->acceleration_bounds = acceleration_bounds;
  }
};

/// Place of a number of a mover; null: it is not among the properties.
double* FindIn(MoverProperties* of, const VariedNumber& number);

}  // namespace Stg::rows

#endif
