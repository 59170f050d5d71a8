// SPDX-License-Identifier: GPL-2.0-or-later

#include "recording/activity.hh"

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

#include "geometry/rotated.hh"
#include "geometry/trigonometry.hh"
#include "models/power_pack.hh"
#include "whatif/command_check.hh"
#include "world/engine.hh"

namespace Stg::recording {

// ---- commands -----------------------------------------------------------------------------------

void Activity::BeforeStep(const ModelPosition& position) {
  next_.emplace();
  next_->mode = CommandCheck::CommandOf(position, &next_->goal);
}

void Activity::AfterStep(const ModelPosition& position, usec_t now) {
  if (!next_ || position.GetLastUpdate() != now) return;
  obeyed_ = *next_;
  obeyed_at_ = now;
}

void Activity::WriteCommand(const Robot& robot, usec_t now, LogWriter* log) {
  if (obeyed_at_ == written_at_) return;
  written_at_ = obeyed_at_;
  Buffer message;
  const auto write = [&](const char* topic, MessageType (*type)()) {
    log->Add(log->Channel(robot.topics + topic, type), now, message);
  };
  switch (obeyed_.mode) {
    case ModelPosition::CONTROL_VELOCITY:
      PutTwist(obeyed_.goal, robot.base_frame, obeyed_at_, &message);
      return write("cmd_vel", TwistType);
    case ModelPosition::CONTROL_ACCELERATION:
      PutTwist(obeyed_.goal, robot.base_frame, obeyed_at_, &message);
      return write("cmd_accel", AccelerationType);
    case ModelPosition::CONTROL_POSITION:
      PutPose(obeyed_.goal, robot.odom_frame, obeyed_at_, &message);
      return write("cmd_pose", PoseType);
  }
}

// ---- contacts -----------------------------------------------------------------------------------

TouchesByModel FindTouches(World* world) {
  TouchesByModel touches;
  world->engine().ForEachContact(nullptr, [&](const ContactPoint& contact) {
    touches.emplace(contact.a->GetId(), contact);
    ContactPoint other = contact;
    std::swap(other.a, other.b);
    other.normal = point_t(-contact.normal.x, -contact.normal.y);
    touches.emplace(contact.b->GetId(), other);
  });
  return touches;
}

namespace {

/// Adds the contacts of a model and its children, in the frame of `robot`.
void AddTouches(const Model& model, const Pose& robot, const TouchesByModel& all,
                std::vector<Touch>* to) {
  const auto [begin, end] = all.equal_range(model.GetId());
  for (auto at = begin; at != end; ++at) {
    const ContactPoint& contact = at->second;
    const SineCosine back = SinCos(-robot.a);
    const point_t place =
        Rotated(point_t(contact.point.x - robot.x, contact.point.y - robot.y), back);
    const double heading = ArcTangent(contact.normal.y, contact.normal.x) - robot.a;
    to->push_back({place.x, place.y, normalize(heading), contact.b->TokenStr()});
  }
  for (const Model* child : model.GetChildren()) AddTouches(*child, robot, all, to);
}

}  // namespace

void Activity::WriteContacts(const Robot& robot, const TouchesByModel& all, usec_t now,
                             LogWriter* log) {
  std::vector<Touch> touches;
  if (!all.empty()) AddTouches(*robot.model, robot.model->GetGlobalPose(), all, &touches);
  if (touches.empty() && !touched_) return;
  touched_ = !touches.empty();
  // The order of a multimap is unspecified.
  std::ranges::sort(touches, [](const Touch& a, const Touch& b) {
    return std::tie(a.x, a.y, a.heading, a.thing) < std::tie(b.x, b.y, b.heading, b.thing);
  });
  const std::string topic = robot.topics + "contacts";
  Buffer message;
  PutContacts(touches, topic.substr(1), robot.footprint_frame, now, &message);
  log->Add(log->Channel(topic, ContactsType), now, message);
}

// ---- energy -------------------------------------------------------------------------------------

namespace {

/// The share of a full charge, from 0 to 1. An infinite supply is always full.
double ShareOf(const PowerPack& pack) {
  const double share = pack.ProportionRemaining();
  return std::isnan(share) ? 0 : share;
}

BatteryStatus StatusOf(const PowerPack& pack, double before) {
  const double stored = pack.GetStored();
  if (stored < 0 || std::isinf(stored) || stored >= pack.GetCapacity()) return BatteryStatus::kFull;
  if (stored == before) return BatteryStatus::kNotCharging;
  return stored > before ? BatteryStatus::kCharging : BatteryStatus::kDischarging;
}

}  // namespace

void Activity::WriteBattery(const Robot& robot, usec_t now, LogWriter* log) {
  const PowerPack* const pack = robot.model->FindPowerPack();
  if (!pack) return;
  const double before = battery_ ? battery_->stored : pack->GetStored();
  const Battery present = {pack->GetStored(), ShareOf(*pack), StatusOf(*pack, before)};
  const bool is_known =
      battery_ && battery_->share == present.share && battery_->status == present.status;
  battery_ = present;
  if (is_known) return;
  Buffer message;
  PutBattery(present.share, present.status, now, &message);
  log->Add(log->Channel(robot.topics + "battery", BatteryType), now, message);
}

}  // namespace Stg::recording
