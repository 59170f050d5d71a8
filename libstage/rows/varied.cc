// SPDX-License-Identifier: GPL-2.0-or-later
//
// Numbers of properties that differ between the worlds of a scene: what steps read follows from
// them.

#include "rows/varied.hh"

#include <algorithm>
#include <cmath>
#include <span>

#include "messages/assert.hh"
#include "models/floor_friction.hh"
#include "rows/each_column.hh"
#include "rows/rows.hh"
#include "world/phases/contact_phase.hh"

namespace Stg::rows {

/// Gives a world, which has just been reset, the numbers of Scene::varied.
void Rows::Vary(size_t world, std::span<const double> given) {
  const std::vector<Varied>& varied = scene_->varied;
  STAGE_ASSERT(given.empty() || given.size() == varied.size());
  double* const numbers = columns.varied.data() + world * varied.size();
  for (size_t k = 0; k < varied.size(); k++) {
    if (!given.empty() && !std::isnan(given[k]))
      numbers[k] = given[k] * varied[k].unit;
    else
      numbers[k] = UsualNumber(world, k);
  }
  ApplyVaried(world);
}

/// The number that a world has if nothing else is given: that of the prototype, or an error of
/// odometry that was drawn.
double Rows::UsualNumber(size_t world, size_t k) {
  const Varied& varied = scene_->varied[k];
  const double* const drawn =
      varied.number.property == VariedProperty::kOdomError ? Find(world, varied) : nullptr;
  return drawn ? *drawn : start_->columns.varied[k];
}

void Rows::CopyAcross(size_t to, const Rows& other, size_t from) {
  Reset(to, other.columns.seed[from]);  // also what the other scene lacks
  std::vector<size_t> counts;
  ForEachColumn(
      other.scene(), [&](size_t count, const auto*) { counts.push_back(count); }, &other.columns);
  size_t next = 0;
  const auto copy = [&](size_t count, auto* into, const auto* source) {
    if (counts[next++] == count) CopyElements(count, *source, from, into, to);
  };
  ForEachColumn(scene(), copy, &columns, &other.columns);
  const std::vector<Varied>& of_other = other.scene().varied;
  for (size_t k = 0; k < scene_->varied.size(); k++) {
    const auto same = std::ranges::find(of_other, scene_->varied[k].number, &Varied::number);
    const auto place = from * of_other.size() + static_cast<size_t>(same - of_other.begin());
    columns.varied[to * scene_->varied.size() + k] =
        same == of_other.end() ? UsualNumber(to, k) : other.columns.varied[place];
  }
  ApplyVaried(to);
  if (!other.columns.noisy_odometry.empty())  // ApplyVaried() begins its sums anew
    CopyElements(scene().movers.size(), other.columns.noisy_odometry, from, &columns.noisy_odometry,
                 to);
}

/// Sets what steps read to the properties of the scene, except for the numbers that vary.
void Rows::ApplyVaried(size_t world) {
  const Scene& scene = *scene_;
  const size_t count = scene.varied.size();
  const size_t mover = world * scene.movers.size(), sensor = world * scene.sensors.size();
  for (size_t k = 0; k < scene.movers.size() && scene.varies_movers; k++)
    columns.properties[mover + k] = scene.movers[k].properties;
  for (size_t k = 0; k < scene.sensors.size() && scene.varies_noise; k++)
    columns.range_noise[sensor + k] = scene.sensors[k].noise;
  for (size_t k = 0; k < count; k++)
    Apply(world, scene.varied[k], columns.varied[world * count + k]);
  for (size_t k = 0; k < scene.movers.size() && scene.varies_movers; k++) {
    MoverProperties& own = columns.properties[mover + k];
    if (own.floor_friction < 0)
      own.floor_friction = UsualFloorFriction(scene.movers[k].robot != nullptr);
    own.grip = ContactPhase::GripOf(own.mass + scene.movers[k].load, own.floor_friction,
                                    scene.movers[k].robot != nullptr);
  }
}

void Rows::Apply(size_t world, const Varied& varied, double number) {
  if (varied.number.property == VariedProperty::kOdomNoise) {
    if (columns.noisy_odometry.empty()) return;  // without odometry
    NoisyOdometry& odometry = columns.noisy_odometry[world * scene_->movers.size() + varied.mover];
    NoisyOdometry::Noise noise = odometry.noise();
    *noise.Find(varied.number.element) = number;
    odometry = NoisyOdometry(noise);
  } else if (double* const place = Find(world, varied)) {
    *place = number;
  }
}

/// Place of a number that steps read; null: steps do not read it.
double* Rows::Find(size_t world, const Varied& varied) {
  const uint32_t element = varied.number.element;
  if (varied.number.property == VariedProperty::kNoise) {
    if (varied.sensor == Varied::kNone) return nullptr;
    RangeNoise& noise = columns.range_noise[world * scene_->sensors.size() + varied.sensor];
    return element == 0 ? &noise.variance : element == 1 ? &noise.fraction : &noise.angle;
  }
  if (varied.mover == Varied::kNone) return nullptr;
  const size_t mover = world * scene_->movers.size() + varied.mover;
  if (varied.number.property == VariedProperty::kOdomError) {
    if (columns.error.empty()) return nullptr;
    Planar& error = columns.error[mover];
    double* const places[] = {&error.x, &error.y, nullptr, &error.a};
    return places[element];
  }
  return FindIn(&columns.properties[mover], varied.number);
}

double* FindIn(MoverProperties* of, const VariedNumber& number) {
  const auto bound = [&](Bounds* bounds) {
    Bounds& both = bounds[number.element / 2];
    return number.element % 2 == 0 ? &both.min : &both.max;
  };
  switch (number.property) {
    case VariedProperty::kMass:
      return &of->mass;
    case VariedProperty::kFriction:
      return &of->friction;
    case VariedProperty::kFloorFriction:
      return &of->floor_friction;
    case VariedProperty::kWheelSlip:
      return &of->wheel_slip;
    case VariedProperty::kWheelbase:
      return &of->wheelbase;
    case VariedProperty::kSteeringLimit:
      return &of->steering_limit;
    case VariedProperty::kSteeringRate:
      return &of->steering_rate;
    case VariedProperty::kVelocityBounds:
      return bound(of->velocity_bounds);
    case VariedProperty::kAccelerationBounds:
      return bound(of->acceleration_bounds);
    default:
      return nullptr;
  }
}

}  // namespace Stg::rows
