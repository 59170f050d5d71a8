// SPDX-License-Identifier: GPL-2.0-or-later

#include "models/types/radio_traffic.hh"

#include <algorithm>
#include <cmath>
#include <limits>

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

bool RadioTraffic::Place::operator<(const Place& o) const {
  if (reach != o.reach) return reach < o.reach;
  if (strip != o.strip) return strip < o.strip;
  if (y != o.y) return y < o.y;
  return sender < o.sender;
}

void RadioTraffic::Add(ModelRadio* radio) {
  radios_.insert(std::ranges::upper_bound(radios_, radio->GetId(), {}, &Model::GetId), radio);
}

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
  SortPlaces();
  PrepareRays(host);
  return receivers_.size();
}

void RadioTraffic::CollectSenders() {
  senders_.clear();
  for (ModelRadio* radio : radios_)
    if (std::ranges::any_of(radio->sending_, [&](const auto& sent) { return sent.due <= now_; }))
      senders_.push_back({radio, radio->GetGlobalPose()});
}

void RadioTraffic::SortPlaces() {
  places_.clear();
  for (uint32_t i = 0; i < senders_.size(); i++) {
    const double reach = ReachOf(senders_[i].radio->range);
    const Pose& pose = senders_[i].pose;
    places_.push_back({reach, std::floor(pose.x / reach), pose.y, pose.x, i});
  }
  std::sort(places_.begin(), places_.end());
  groups_.clear();
  for (size_t i = 0; i < places_.size(); i++) {
    if (groups_.empty() || places_[i].reach != groups_.back().reach)
      groups_.push_back({places_[i].reach, i, i});
    groups_.back().end = i + 1;
  }
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
  for (const Group& group : groups_) SearchGroup(group, receiver, here, near);
  std::ranges::sort(*near, [](const Near& a, const Near& b) {
    return a.distance != b.distance ? a.distance < b.distance : a.sender < b.sender;
  });
}

void RadioTraffic::SearchGroup(const Group& group, const ModelRadio& receiver, const Pose& here,
                               std::vector<Near>* near) const {
  const auto begin = places_.begin() + static_cast<std::ptrdiff_t>(group.begin);
  const auto end = places_.begin() + static_cast<std::ptrdiff_t>(group.end);
  const double reach = group.reach, low = here.y - reach, high = here.y + reach;
  const double last_strip = std::floor((here.x + reach) / reach);
  double strip = std::floor((here.x - reach) / reach);
  for (auto place = begin; strip <= last_strip;) {
    place = std::lower_bound(place, end, Place{reach, strip, low, 0, 0});
    for (; place != end && place->strip == strip && place->y <= high; ++place)
      AddIfNear(*place, receiver, here, near);
    // The next strip with senders. nextafter() because adding 1 does not change very large numbers.
    strip = std::nextafter(strip, std::numeric_limits<double>::infinity());
    place = std::lower_bound(place, end, Place{reach, strip, -HUGE_VAL, 0, 0});
    if (place == end) return;
    strip = place->strip;
  }
}

void RadioTraffic::AddIfNear(const Place& place, const ModelRadio& receiver, const Pose& here,
                             std::vector<Near>* near) const {
  const double dx = place.x - here.x, dy = place.y - here.y;
  const double distance = std::sqrt(dx * dx + dy * dy);
  const ModelRadio& sender = *senders_[place.sender].radio;
  if (distance <= sender.range && !sender.IsRelated(&receiver))
    near->push_back({distance, place.sender});
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
