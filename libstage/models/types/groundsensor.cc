// SPDX-License-Identifier: GPL-2.0-or-later

#include "models/groundsensor.hh"

#include <algorithm>
#include <cmath>
#include <string>

#include "geometry/trigonometry.hh"
#include "messages/report.hh"
#include "models/body.hh"
#include "models/field.hh"
#include "models/host.hh"
#include "models/noise.hh"
#include "models/property_checks.hh"
#include "models/state_exchange.hh"
#include "models/types/built_in_types.hh"
#include "worldfile/worldfile.hh"

namespace Stg {

namespace {

constexpr int kMaxGroundPoints = 10000;

void DescribePoints(const ModelGroundSensor& sensor, SensorExtent* extent) {
  extent->parts = sensor.points().size();
}

ReadingShape ShapeOfPoints(const ModelGroundSensor& sensor) {
  return ReadingShape(sensor.points().size());
}

bool CopyGroundValues(const ModelGroundSensor& sensor, size_t length, double* to) {
  if (sensor.GetValues().empty()) return false;
  std::copy_n(sensor.GetValues().begin(), length, to);
  return true;
}

}  // namespace

ModelType GroundSensorType() {
  return ModelTypeOf<ModelGroundSensor>("groundsensor")
      .Moves(ModelType::kStays)
      .Updates(ModelType::kParallel)
      .Senses(DescribePoints)
      .Measurable()
      .Reads(MakeReading("value", "", "Value of the field at each point; 0 outside of the field.",
                         ShapeOfPoints, CopyGroundValues));
}

ModelGroundSensor::ModelGroundSensor(World* world_, Model* parent_, const std::string& type_)
    : Model(world_, parent_, type_),
      points_(1),
      linear_(true),
      noise_(0),
      deposit_rate_(0),
      pending_(0),
      seeded_(false) {
  ClearBlocks();
  geom.size.Zero();
  vis.obstacle_return = false;
  vis.blob_return = false;
  vis.ranger_return = -1.0;
  InsertByAge(&host().ground_sensors, this);
}

ModelGroundSensor::~ModelGroundSensor() { std::erase(host().ground_sensors, this); }

// ---- loading ------------------------------------------------------------------------------------

void ModelGroundSensor::Load() {
  if (!LoadCommon()) return;
  field_name_ = wf->ReadString(wf_entity, "field", field_name_);
  LoadPoints();
  const std::string way =
      wf->ReadString(wf_entity, "interpolation", linear_ ? "linear" : "nearest");
  if (way != "linear" && way != "nearest")
    wf->Fail(wf_entity, "interpolation",
             "found the interpolation " + messages::Quoted(way) +
                 ", expected \"linear\" or \"nearest\"");
  linear_ = way == "linear";
  noise_ = wf->ReadFloat(wf_entity, "noise", noise_);
  CheckNotNegative(*wf, wf_entity, "noise", noise_);
  deposit_rate_ = wf->ReadFloat(wf_entity, "deposit_rate", deposit_rate_);
}

void ModelGroundSensor::LoadPoints() {
  if (!wf->PropertyExists(wf_entity, "points")) return;
  const int count = wf->ReadInt(wf_entity, "points", 1);
  if (count < 1 || count > kMaxGroundPoints)
    wf->Fail(wf_entity, "points",
             "found " + std::to_string(count) + " points, expected a number from 1 to " +
                 std::to_string(kMaxGroundPoints));
  host().memory.Take(*wf, wf_entity, "points", static_cast<size_t>(count), sizeof(point_t),
                     "points of a ground sensor");
  points_.assign(static_cast<size_t>(count), point_t());
  for (size_t i = 0; i < points_.size(); i++)
    wf->ReadTuple(wf_entity, ("point[" + std::to_string(i) + "]").c_str(), 0, 2, "ll",
                  &points_[i].x, &points_[i].y);
  values_.clear();
}

// ---- reading and writing ------------------------------------------------------------------------

ModelField* ModelGroundSensor::GetField() const {
  const std::vector<ModelField*>& fields = host().fields;
  if (field_name_.empty()) return fields.empty() ? nullptr : fields.front();
  const auto found = std::ranges::find_if(
      fields, [this](const ModelField* field) { return field->TokenStr() == field_name_; });
  return found == fields.end() ? nullptr : *found;
}

void ModelGroundSensor::Update() {
  GatherSerially();
  Model::Update();
}

void ModelGroundSensor::Gather(sensing::FanList*) {
  const ModelField* const field = GetField();
  const Pose frame = GetGlobalPose() + geom.pose;
  const SineCosine turn = SinCos(frame.a);
  values_.resize(points_.size());
  for (size_t i = 0; i < points_.size(); i++) {
    const point_t& point = points_[i];
    const double x = frame.x + point.x * turn.cosine - point.y * turn.sine;
    const double y = frame.y + point.x * turn.sine + point.y * turn.cosine;
    if (!field)
      values_[i] = 0;
    else
      values_[i] = linear_ ? field->LinearValue(x, y) : field->NearestValue(x, y);
  }
  if (noise_ == 0) return;
  if (!seeded_) random_.Seed(NoiseSeed(token));
  seeded_ = true;
  for (double& value : values_) value += noise_ * NormalError(&random_);
}

bool ModelGroundSensor::Deposit(double amount) {
  if (!std::isfinite(amount) || !std::isfinite(pending_ + amount)) return false;
  pending_ += amount;
  return true;
}

bool ModelGroundSensor::SetDepositRate(double rate) {
  if (!std::isfinite(rate)) return false;
  deposit_rate_ = rate;
  return true;
}

void ModelGroundSensor::Shutdown() {
  values_.clear();
  Model::Shutdown();
}

void ModelGroundSensor::Reseed(uint64_t seed) {
  Model::Reseed(seed);
  seeded_ = false;
}

void ModelGroundSensor::ExchangeState(StateExchange& exchange) {
  Model::ExchangeState(exchange);
  exchange.Expect(points_.size(), "the number of points of a ground sensor");
  for (point_t& point : points_) exchange(point);
  exchange(field_name_, values_, linear_, noise_, deposit_rate_, pending_, random_, seeded_);
  if (exchange.restoring() && !values_.empty() && values_.size() != points_.size())
    exchange.Fail("found a ground sensor with another number of values than points");
}

}  // namespace Stg
