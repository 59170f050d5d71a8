// SPDX-License-Identifier: GPL-2.0-or-later
//
// Numbers of properties that differ between the worlds of a scene: how models have them.

#include <algorithm>
#include <bit>
#include <cmath>
#include <memory>
#include <string>

#include "messages/assert.hh"
#include "rows/model_kinds.hh"
#include "rows/row_bridge.hh"
#include "world/engine.hh"
#include "worldfile/worldfile.hh"

namespace Stg {

using rows::VariedNumber;
using rows::VariedProperty;

namespace {

/// A property: its name, and for each of its numbers the kind of its unit: l: length, a: angle, f:
/// none.
struct PropertyInFile {
  const char* name;
  VariedProperty property;
  const char* units;
};

constexpr PropertyInFile kVariedProperties[] = {
    {"mass", VariedProperty::kMass, "f"},
    {"friction", VariedProperty::kFriction, "f"},
    {"floor_friction", VariedProperty::kFloorFriction, "f"},
    {"wheel_slip", VariedProperty::kWheelSlip, "f"},
    {"velocity_bounds", VariedProperty::kVelocityBounds, "llllllaa"},
    {"acceleration_bounds", VariedProperty::kAccelerationBounds, "llllllaa"},
    {"odom_error", VariedProperty::kOdomError, "llla"},
    {"odom_noise", VariedProperty::kOdomNoise, "llaa"},
    {"wheelbase", VariedProperty::kWheelbase, "l"},
    {"steering_limit", VariedProperty::kSteeringLimit, "a"},
    {"steering_rate", VariedProperty::kSteeringRate, "a"},
    {"noise", VariedProperty::kNoise, "lfa"},
};

const PropertyInFile& InFile(VariedProperty property) {
  return *std::ranges::find(kVariedProperties, property, &PropertyInFile::property);
}

bool ConcernsContacts(VariedProperty property) {
  return property == VariedProperty::kMass || property == VariedProperty::kFriction ||
         property == VariedProperty::kFloorFriction;
}

}  // namespace

VariedProperty RowBridge::FindProperty(const std::string& name) {
  const auto found = std::ranges::find(kVariedProperties, name, &PropertyInFile::name);
  return found == std::end(kVariedProperties) ? VariedProperty::kNone : found->property;
}

bool RowBridge::CanVary(const World& world, const VariedNumber& number) {
  const Model* const model = world.FindModel(number.model);
  if (!model || number.property == VariedProperty::kNone ||
      number.element >= std::string(InFile(number.property).units).size())
    return false;
  if (number.property == VariedProperty::kNoise)
    return rows::IsOfType(*model, "ranger") &&
           number.sensor < static_cast<const ModelRanger*>(model)->sensors_.size();
  if (number.sensor > 0) return false;
  const bool in_contacts = ConcernsContacts(number.property);
  const bool has_no_effect =
      in_contacts && !rows::IsRobot(*model) && world.engine_->contact_model == ContactModel::kCells;
  if (has_no_effect) return true;
  return !model->Parent() && (rows::IsRobot(*model) || (in_contacts && rows::IsPushed(*model)));
}

double RowBridge::UnitOf(const World& world, const VariedNumber& number) {
  const char kind = InFile(number.property).units[number.element];
  return kind == 'l' ? world.wf->unit_length : kind == 'a' ? world.wf->unit_angle : 1.0;
}

/// The place of a number in a model; null: the number belongs to noisy odometry.
double* RowBridge::FindNumber(Model* model, const VariedNumber& number) {
  const uint32_t element = number.element;
  const auto bound = [&](Bounds* bounds) {
    Bounds& both = bounds[element / 2];
    return element % 2 == 0 ? &both.min : &both.max;
  };
  if (number.property == VariedProperty::kMass) return &model->mass;
  if (number.property == VariedProperty::kFriction) return &model->friction;
  if (number.property == VariedProperty::kFloorFriction) return &model->floor_friction_;
  if (number.property == VariedProperty::kNoise) {
    ModelRanger::Sensor& sensor = static_cast<ModelRanger*>(model)->sensors_[number.sensor];
    double* const places[] = {&sensor.range_noise_const, &sensor.range_noise, &sensor.angle_noise};
    return places[element];
  }
  auto& robot = static_cast<ModelPosition&>(*model);
  Velocity& error = robot.integration_error;
  double* const errors[] = {&error.x, &error.y, &error.z, &error.a};
  switch (number.property) {
    case VariedProperty::kWheelSlip:
      return &robot.wheel_slip_;
    case VariedProperty::kWheelbase:
      return &robot.wheelbase;
    case VariedProperty::kSteeringLimit:
      return &robot.steering_limit_;
    case VariedProperty::kSteeringRate:
      return &robot.steering_rate_;
    case VariedProperty::kVelocityBounds:
      return bound(robot.velocity_bounds);
    case VariedProperty::kAccelerationBounds:
      return bound(robot.acceleration_bounds);
    case VariedProperty::kOdomError:
      return errors[element];
    default:
      return nullptr;
  }
}

double RowBridge::ReadNumber(const World& world, const VariedNumber& number) {
  Model* const model = world.FindModel(number.model);
  if (const double* const place = FindNumber(model, number)) return *place;
  const auto& odometry = static_cast<const ModelPosition&>(*model).noisy_odometry_;
  NoisyOdometry::Noise noise = odometry ? odometry->noise() : NoisyOdometry::Noise();
  return *noise.Find(number.element);
}

void RowBridge::WriteNumber(const VariedNumber& number, double value, World* world) {
  Model* const model = world->FindModel(number.model);
  const auto bits = [](double of) { return std::bit_cast<uint64_t>(of); };
  if (bits(ReadNumber(*world, number)) == bits(value)) return;
  if (ConcernsContacts(number.property)) world->engine_->contacts_changed = true;
  if (double* const place = FindNumber(model, number)) {
    *place = value;
    return;
  }
  auto& odometry = static_cast<ModelPosition&>(*model).noisy_odometry_;
  NoisyOdometry::Noise noise = odometry ? odometry->noise() : NoisyOdometry::Noise();
  *noise.Find(number.element) = value;
  odometry = noise.IsZero() ? nullptr : std::make_unique<NoisyOdometry>(noise);
}

void RowBridge::Vary(std::span<const VariedNumber> numbers, std::span<const double> given,
                     World* world) {
  STAGE_ASSERT(numbers.size() == given.size());
  for (size_t k = 0; k < numbers.size(); k++)
    if (!std::isnan(given[k]))
      WriteNumber(numbers[k], given[k] * UnitOf(*world, numbers[k]), world);
}

/// Lists the numbers that vary, and notes what follows from that for movers and sensors.
void RowBridge::AddVaried(std::span<const VariedNumber> varied, const World& prototype,
                          rows::Scene* scene) {
  for (const VariedNumber& number : varied) {
    rows::Varied entry{number, UnitOf(prototype, number), rows::Varied::kNone, rows::Varied::kNone};
    for (uint32_t k = 0; k < scene->movers.size(); k++) {
      rows::Mover& mover = scene->movers[k];
      if (mover.model->GetId() != number.model) continue;
      entry.mover = k;
      scene->varies_movers = true;
      if (number.property == VariedProperty::kOdomNoise && mover.runs)
        mover.has_noisy_odometry = true;
    }
    for (uint32_t k = 0; k < scene->sensors.size(); k++) {
      rows::Sensor& sensor = scene->sensors[k];
      if (number.property != VariedProperty::kNoise || sensor.ranger->GetId() != number.model ||
          sensor.index != number.sensor)
        continue;
      entry.sensor = k;
      scene->varies_noise = scene->needs_rays = true;
      sensor.noisy = sensor.needed = true;
      sensor.turns_noisily = sensor.turns_noisily || number.element == 2;
    }
    scene->varied.push_back(entry);
  }
}

void RowBridge::ReadVaried(const World& world, rows::Rows* to, size_t row) {
  const std::vector<rows::Varied>& varied = to->scene().varied;
  for (size_t k = 0; k < varied.size(); k++)
    to->columns.varied[row * varied.size() + k] = ReadNumber(world, varied[k].number);
  if (!varied.empty()) to->ApplyVaried(row);
}

void RowBridge::WriteVaried(const rows::Rows& from, size_t row, World* world) {
  const std::vector<rows::Varied>& varied = from.scene().varied;
  for (size_t k = 0; k < varied.size(); k++)
    WriteNumber(varied[k].number, from.columns.varied[row * varied.size() + k], world);
}

}  // namespace Stg
