// SPDX-License-Identifier: GPL-2.0-or-later

#include "recording/replay.hh"

#include <algorithm>
#include <cstdlib>
#include <sstream>
#include <stdexcept>
#include <unordered_map>

#include "messages/report.hh"
#include "models/groundsensor.hh"
#include "recording/fields.hh"
#include "recording/robots.hh"
#include "world/engine.hh"
#include "world/world.hh"

namespace Stg::recording {

namespace {

usec_t Microseconds(uint64_t nanoseconds) { return nanoseconds / 1000; }

/// Sets the bearings of a sensor with that many samples.
void SetBearings(ModelRanger::Sensor* sensor) {
  const size_t count = sensor->ranges.size();
  sensor->bearings.assign(count, 0);
  for (size_t i = 0; count > 1 && i < count; i++)
    sensor->bearings[i] =
        sensor->fov * (static_cast<double>(i) / static_cast<double>(count - 1) - 0.5);
}

}  // namespace

struct Replay::Target {
  ModelRanger* ranger;
  uint32_t sensor;
};

Replay::Replay(const std::string& file)
    : name_(file), log_(file), self_(std::make_shared<Replay*>(this)) {
  const auto& about = log_.metadata("stage");
  const auto world = about.find("world");
  if (world == about.end() || log_.attachments().empty() ||
      log_.attachments()[0].first != world->second)
    Fail("found no world file in the log, expected a log that stage --log has written");
  for (const auto& [name, content] : log_.attachments()) files_.push_back({name, content});
  if (const auto seed = about.find("seed"); seed != about.end())
    seed_ = std::strtoull(seed->second.c_str(), nullptr, 10);
  if (const auto settings = about.find("settings"); settings != about.end()) {
    std::istringstream lines(settings->second);
    for (std::string line; std::getline(lines, line);) settings_.push_back(line);
  }
  for (const auto& [id, channel] : log_.channels())
    if (channel.topic == "/stage/poses") poses_channel_ = id;
  FindFirstPoses();
  start_ = Microseconds(log_.chunks().front().start);
  for (const McapReader::Chunk& chunk : log_.chunks())
    end_ = std::max(end_, Microseconds(chunk.end));
}

Replay::~Replay() = default;

void Replay::Fail(const std::string& what) const {
  throw std::runtime_error(messages::Shortened(name_, messages::kMaxDetailBytes) + ": " + what);
}

/// Finds the poses of all models. Later messages contain only models that have moved since.
void Replay::FindFirstPoses() {
  bool found = false, good = true;
  for (const McapReader::Chunk& chunk : log_.chunks()) {
    if (found) break;
    log_.Read(chunk, &records_);
    ForEachRecord(records_.view(), [&](Op op, std::string_view record) {
      if (found || op != Op::kMessage) return;
      const Message message = MessageOf(record);
      found = message.channel == poses_channel_;
      if (found) good = GetModelPoses(message.data, &first_poses_);
    });
  }
  if (!found) Fail("found no poses in the log: the run ended too early, or a topic is missing");
  if (!good) Fail("a message of the topic /stage/poses is damaged");
}

bool Replay::IsAttached() const { return handle_ && world_->engine().epoch == epoch_; }

void Replay::FindTargets() {
  std::unordered_map<std::string, Target> sources;
  for (const Robot& robot : RobotsOf(world_->engine().models))
    for (const ScanSource& scan : robot.scans) sources[scan.topic] = {scan.ranger, scan.sensor};
  for (const auto& [id, channel] : log_.channels()) {
    const auto source = sources.find(channel.topic);
    if (source != sources.end() && channel.type == LaserScanType().name)
      targets_[id] = source->second;
  }
}

/// Finds the fields whose values the log has, and stops all changes by the world itself.
void Replay::FindFields() {
  constexpr usec_t kLeadTime = 2'000'000;  // includes the last readings of slow sensors
  lead_time_ = kLeadTime;
  for (const FieldSource& source : FieldsOf(world_->engine().models))
    for (const auto& [id, channel] : log_.channels()) {
      if (channel.topic != source.topic || channel.type != FieldValuesType().name) continue;
      fields_[id] = source.field;
      lead_time_ = std::max(lead_time_, kLeadTime + source.field->GetLogInterval());
      source.field->SetDiffusion(0);
      source.field->SetEvaporation(0);
    }
  for (Model* model : world_->engine().models)
    if (auto* sensor = dynamic_cast<ModelGroundSensor*>(model)) sensor->SetDepositRate(0);
}

void Replay::Attach(World* world) {
  world_ = world;
  handle_ = WorldHandle(world);
  epoch_ = world->engine().epoch;
  FindTargets();
  FindFields();
  // The window shows sensor data only for models with subscribers.
  for (const auto& [id, target] : targets_) target.ranger->Subscribe();
  for (Model* model : world->engine().models)
    if (auto* position = dynamic_cast<ModelPosition*>(model)) {
      position->Subscribe();
      position->SetVelocity(Velocity());
    }
  SeekTo(start_);
  Arm();
}

void Replay::Arm() {
  world_->CallAfterStep([weak = std::weak_ptr<Replay*>(self_)](World&) {
    if (const std::shared_ptr<Replay*> self = weak.lock()) (*self)->AfterStep();
  });
}

void Replay::AfterStep() {
  ShowUntil(world_->SimTimeNow());
  Arm();
}

void Replay::SeekTo(usec_t time) {
  if (!IsAttached()) return;
  time = std::clamp(time, start_, end_);
  world_->ShowTime(time);
  const auto& chunks = log_.chunks();
  const auto first = std::ranges::find_if(chunks, [&](const McapReader::Chunk& chunk) {
    return Microseconds(chunk.end) + lead_time_ >= time;
  });
  next_chunk_ = static_cast<size_t>(first - chunks.begin());
  records_.Clear();
  at_ = 0;
  ClearScans();
  poses_.clear();
  has_poses_ = false;
  ShowUntil(time);
  world_->NeedRedraw();
  world_->Redraw();
}

void Replay::ClearScans() {
  for (const auto& [id, target] : targets_)
    for (ModelRanger::Sensor& sensor : target.ranger->GetSensorsMutable()) {
      sensor.ranges.clear();
      sensor.intensities.clear();
      sensor.bearings.clear();
    }
}

void Replay::ShowUntil(usec_t time) {
  ReadUntil(time);
  ShowPoses();
}

/// Applies everything logged up to this time. Skips damaged messages: the file is complete, so
/// another program has written them.
void Replay::ReadUntil(usec_t time) {
  for (;;) {
    if (at_ >= records_.size()) {
      if (next_chunk_ >= log_.chunks().size()) return;
      log_.Read(log_.chunks()[next_chunk_++], &records_);
      at_ = 0;
      continue;
    }
    FieldReader head(records_.view().substr(at_));
    const auto op = static_cast<Op>(head.Get<uint8_t>());
    const std::string_view record = head.GetLongText();
    if (op == Op::kMessage) {
      const Message message = MessageOf(record);
      if (Microseconds(message.time) > time) return;
      if (message.channel == poses_channel_) TakePoses(message.data);
      const auto target = targets_.find(message.channel);
      if (target != targets_.end()) TakeScan(message.data, target->second);
      const auto field = fields_.find(message.channel);
      if (field != fields_.end() && GetFieldValues(message.data, &values_))
        field->second->SetValues(values_.data(), values_.size());
    }
    at_ += kRecordHead + record.size();
  }
}

void Replay::TakePoses(std::string_view message) {
  const auto note = [this] {
    before_.clear();
    for (const std::vector<ModelPose>* poses : {&poses_, &first_poses_})
      for (const ModelPose& pose : *poses) before_.try_emplace(pose.model, pose.pose);
  };
  if (has_poses_) note();
  GetModelPoses(message, &poses_);
  if (!has_poses_) note();  // the previous moment is unknown
  has_poses_ = true;
}

void Replay::TakeScan(std::string_view message, const Target& target) {
  ModelRanger::Sensor& sensor = target.ranger->GetSensorsMutable()[target.sensor];
  GetScan(message, &sensor.ranges, &sensor.intensities);
  if (sensor.bearings.size() != sensor.ranges.size()) SetBearings(&sensor);
  Pose place = PoseBefore(*target.ranger);
  place.z = target.ranger->GetGlobalPose().z;
  target.ranger->SetScanPose(place);
}

/// Global pose in the plane at the logged moment before the newest one. A step senses first, then
/// moves, so its scans belong to the poses that were logged at the end of the previous step.
Pose Replay::PoseBefore(const Model& model) const {
  const auto known = before_.find(model.GetId());
  const Pose local = known == before_.end() ? model.GetPose() : known->second;
  return model.Parent() ? PoseBefore(*model.Parent()) + local : local;
}

void Replay::ShowPoses() {
  // Each model is placed once: at its latest pose, or at its first one if it has never moved.
  std::unordered_map<uint32_t, const ModelPose*> now;
  for (const ModelPose& pose : poses_) now[pose.model] = &pose;
  for (const ModelPose& first : first_poses_) {
    const auto moved = now.find(first.model);
    Place(moved == now.end() ? first : *moved->second);
  }
}

/// Skips models that controllers had created: this world does not have them.
void Replay::Place(const ModelPose& pose) {
  Model* model = world_->FindModel(pose.model);
  if (!model) return;
  Model* parent = pose.parent == 0 ? nullptr : world_->FindModel(pose.parent);
  if (model->Parent() != parent) model->SetParent(parent);
  if (model->GetPose() != pose.pose) model->SetPose(pose.pose);
}

}  // namespace Stg::recording
