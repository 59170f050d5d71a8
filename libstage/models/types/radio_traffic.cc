// SPDX-License-Identifier: GPL-2.0-or-later

#include "models/types/radio_traffic.hh"

#include <algorithm>
#include <cmath>

#include "geometry/trigonometry.hh"
#include "messages/assert.hh"
#include "models/host.hh"
#include "models/radio.hh"
#include "sensing/scene.hh"
#include "sensing/tracer.hh"

namespace Stg {

namespace {

/// Metres. Smaller ranges are searched like this one.
constexpr double kMinReach = 1e-3;
/// Metres. Beyond all places; larger ranges, such as infinite ones, are searched like this one.
constexpr double kMaxReach = 1e300;
/// Keeps senders at the very end of their range in the search in spite of rounding.
constexpr double kMargin = 1.001;

/// The power of two above the range, and a little more.
double ReachOf(double range) {
  if (!(range > kMinReach)) return kMinReach * kMargin;
  int exponent = 0;
  std::frexp(std::min(range, kMaxReach), &exponent);
  return std::ldexp(kMargin, exponent);
}

/// Bodies that rangers see hide a sender, except for those of both trees.
bool HidesSender(Model* candidate, const Model* sender, const void* receiving_tree) {
  return !(candidate->vis.ranger_return < 0) && !candidate->IsRelated(sender) &&
         candidate->Root() != receiving_tree;
}

}  // namespace

void RadioTraffic::Add(ModelRadio* radio) { InsertByAge(&radios_, radio); }

void RadioTraffic::Remove(const ModelRadio* radio) {
  const auto found = std::ranges::lower_bound(radios_, radio->GetId(), {}, &Model::GetId);
  if (found != radios_.end() && *found == radio) radios_.erase(found);
}

// ---- all receivers ------------------------------------------------------------------------------

size_t RadioTraffic::Begin(usec_t now, Host* host) {
  now_ = now;
  receivers_.clear();
  CollectSenders();
  if (senders_.empty()) return 0;
  for (ModelRadio* radio : radios_)
    if (radio->HasSubscribers()) receivers_.push_back(radio);
  if (receivers_.empty()) return 0;
  IndexSenders();
  PrepareRays(host);
  return receivers_.size();
}

void RadioTraffic::CollectSenders() {
  senders_.clear();
  for (ModelRadio* radio : radios_)
    if (std::ranges::any_of(radio->sending_, [&](const auto& sent) { return sent.due <= now_; }))
      senders_.push_back({radio, radio->GetGlobalPose()});
}

/// The group with this reach, which is made if there is none.
RadioTraffic::Group* RadioTraffic::GroupWith(double reach) {
  const auto found = std::ranges::find(groups_, reach, &Group::reach);
  return found != groups_.end() ? &*found
                                : &groups_.emplace_back(Group{reach, {}, {}, PlaceIndex(reach)});
}

void RadioTraffic::IndexSenders() {
  for (Group& group : groups_) {
    group.senders.clear();
    group.points.clear();
  }
  for (uint32_t i = 0; i < senders_.size(); i++) {
    const Pose& pose = senders_[i].pose;
    if (!std::isfinite(pose.x) || !std::isfinite(pose.y)) continue;  // heard by nobody
    Group* const group = GroupWith(ReachOf(senders_[i].radio->range));
    group->senders.push_back(i);
    group->points.emplace_back(pose.x, pose.y);
  }
  for (Group& group : groups_) group.places.Replace(&group.points);
}

/// Makes what rays need and what must not be made by several threads.
void RadioTraffic::PrepareRays(Host* host) {
  scene_ = &host->scene;
  const auto needs_ray = [](const Sender& sender) { return sender.radio->line_of_sight; };
  if (std::ranges::none_of(senders_, needs_ray)) return;
  ray_ = sensing::Fan();
  ray_.predicate = HidesSender;
  ray_.exact = host->IsExact(RayModel::kDefault);
  if (ray_.exact) host->RasterizeForExactRays();
  ray_.layer = host->scene.grid.EverythingLayer(ray_.exact);
}

void RadioTraffic::End() {
  for (const Sender& sender : senders_)
    std::erase_if(sender.radio->sending_, [&](const auto& sent) { return sent.due <= now_; });
  senders_.clear();
  receivers_.clear();
}

// ---- one receiver -------------------------------------------------------------------------------

void RadioTraffic::Deliver(size_t index) const {
  STAGE_ASSERT(index < receivers_.size());
  ModelRadio& receiver = *receivers_[index];
  static thread_local std::vector<Near> near;  // static to reuse its memory
  const Pose here = receiver.GetGlobalPose();
  FindNear(receiver, here, &near);
  const Near* first = nullptr;
  for (const Near& sender : near) {
    if (receiver.arrived_.size() >= receiver.capacity) return;
    if (!Hears(receiver, here, sender)) continue;
    if (!receiver.collisions)
      Receive(sender, here, &receiver);
    else if (first)
      return;
    else
      first = &sender;
  }
  if (first) Receive(*first, here, &receiver);
}

/// Finds the senders that have the receiver in their range, the nearest first.
void RadioTraffic::FindNear(const ModelRadio& receiver, const Pose& here,
                            std::vector<Near>* near) const {
  near->clear();
  for (const Group& group : groups_)
    group.places.ForEachNear(here.x, here.y, group.reach, [&](uint32_t place, double x, double y) {
      AddIfNear(group.senders[place], x - here.x, y - here.y, receiver, near);
    });
  std::ranges::sort(*near, [](const Near& a, const Near& b) {
    return a.distance != b.distance ? a.distance < b.distance : a.sender < b.sender;
  });
}

void RadioTraffic::AddIfNear(uint32_t sender, double dx, double dy, const ModelRadio& receiver,
                             std::vector<Near>* near) const {
  const double distance = std::sqrt(dx * dx + dy * dy);
  const ModelRadio& radio = *senders_[sender].radio;
  if (distance <= radio.range && !radio.IsRelated(&receiver)) near->push_back({distance, sender});
}

bool RadioTraffic::Hears(const ModelRadio& receiver, const Pose& here, const Near& near) const {
  const ModelRadio& sender = *senders_[near.sender].radio;
  return std::ranges::any_of(sender.sending_,
                             [&](const auto& sent) {
                               return sent.due <= now_ && sent.channel == receiver.channel;
                             }) &&
         !(sender.line_of_sight && IsHidden(receiver, here, near));
}

bool RadioTraffic::IsHidden(const ModelRadio& receiver, const Pose& here, const Near& near) const {
  const auto& [sender, there] = senders_[near.sender];
  sensing::Fan ray = ray_;
  ray.finder = sender;
  ray.arg = receiver.Root();
  const double heading = ArcTangent(here.y - there.y, here.x - there.x);
  sensing::PlaceFan(&ray, Pose(there.x, there.y, there.z, heading), near.distance,
                    scene_->cells_per_metre);
  const SineCosine ahead = sensing::UnitVectorOf(0);
  sensing::TraceCounters counters;
  const sensing::RayHit hit =
      sensing::Tracer(scene_->grid)
          .Trace(ray, scene_->grid.View(ray.layer), {sensing::MakeDirection(ahead), ahead},
                 ray_mask_t{nullptr, 0, 0, 0, 0}, &counters);
  return hit.model != nullptr;
}

/// Passes the messages of a sender on, with what the receiver measures.
void RadioTraffic::Receive(const Near& near, const Pose& here, ModelRadio* receiver) const {
  const auto& [sender, there] = senders_[near.sender];
  const double bearing = ArcTangent(there.y - here.y, there.x - here.x) - here.a;
  for (const ModelRadio::Sending& sent : sender->sending_) {
    if (sent.due > now_ || sent.channel != receiver->channel) continue;
    if (receiver->arrived_.size() >= receiver->capacity) return;
    if (receiver->Loses()) continue;
    ModelRadio::Message& message = receiver->arrived_.emplace_back();
    message.sender = sender->GetId();
    message.size = sent.size;
    message.sent = sent.sent;
    std::ranges::copy(sent.data, message.data);
    message.range = std::max(0.0, near.distance + receiver->Error(receiver->range_noise));
    message.bearing = bearing + receiver->Error(receiver->bearing_noise);
    message.bearing = normalize(message.bearing);
  }
}

}  // namespace Stg
