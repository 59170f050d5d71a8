// SPDX-License-Identifier: GPL-2.0-or-later

#include "support/overlaps.hh"

#include <algorithm>
#include <cmath>

#include "models/body.hh"

namespace test {
namespace {

using Stg::Model;
using Stg::point_t;

// Outlines count as apart if they overlap by less, in metres.
constexpr double kRounding = 1e-9;
constexpr uint64_t kRoom = UINT64_MAX;  // key of the room

double Twist(point_t a, point_t b, point_t p) {
  return (b.x - a.x) * (p.y - a.y) - (b.y - a.y) * (p.x - a.x);
}

double Distance(point_t a, point_t b) {
  return std::sqrt((a.x - b.x) * (a.x - b.x) + (a.y - b.y) * (a.y - b.y));
}

double DistanceToSegment(point_t p, point_t a, point_t b) {
  const double ex = b.x - a.x, ey = b.y - a.y, square = ex * ex + ey * ey;
  const double t =
      square > 0 ? std::clamp(((p.x - a.x) * ex + (p.y - a.y) * ey) / square, 0.0, 1.0) : 0.0;
  return Distance(p, point_t(a.x + t * ex, a.y + t * ey));
}

/// Whether p and q are on different sides of the line, each farther than rounding.
bool Parts(point_t a, point_t b, point_t p, point_t q) {
  const double length = Distance(a, b);
  if (length == 0) return false;
  const double low = Twist(a, b, p) / length, high = Twist(a, b, q) / length;
  return std::min(low, high) < -kRounding && std::max(low, high) > kRounding;
}

bool Cross(point_t a, point_t b, point_t p, point_t q) {
  return Parts(a, b, p, q) && Parts(p, q, a, b);
}

/// Calls f(from, to) for each edge of a closed polygon until it returns true. Returns whether it
/// did.
template <typename F>
bool AnyEdge(const std::vector<point_t>& corners, F f) {
  for (size_t i = 0; i < corners.size(); i++)
    if (f(corners[i], corners[i + 1 == corners.size() ? 0 : i + 1])) return true;
  return false;
}

bool AnyCross(const std::vector<point_t>& a, const std::vector<point_t>& b) {
  return AnyEdge(a, [&](point_t from, point_t to) {
    return AnyEdge(b, [&](point_t p, point_t q) { return Cross(from, to, p, q); });
  });
}

/// Whether the point is in a polygon, by the number of edges that a ray along x crosses.
bool Contains(const std::vector<point_t>& polygon, point_t p) {
  bool inside = false;
  AnyEdge(polygon, [&](point_t a, point_t b) {
    if ((a.y > p.y) != (b.y > p.y) && p.x < a.x + (b.x - a.x) * ((p.y - a.y) / (b.y - a.y)))
      inside = !inside;
    return false;
  });
  return inside;
}

double DistanceToEdges(const std::vector<point_t>& polygon, point_t p) {
  double least = INFINITY;
  AnyEdge(polygon, [&](point_t a, point_t b) {
    least = std::min(least, DistanceToSegment(p, a, b));
    return false;
  });
  return least;
}

bool IsDeepInside(const std::vector<point_t>& polygon, point_t p) {
  return Contains(polygon, p) && DistanceToEdges(polygon, p) > kRounding;
}

/// Whether no two edges cross or touch, other than neighbours at their common corner.
bool IsSimple(const std::vector<point_t>& p) {
  const size_t n = p.size();
  if (n < 3) return false;
  for (size_t i = 0; i < n; i++)
    for (size_t k = i + 2; k < n; k++) {
      if (i == 0 && k + 1 == n) continue;
      const point_t a = p[i], b = p[i + 1], c = p[k], d = p[(k + 1) % n];
      const double least = std::min({DistanceToSegment(a, c, d), DistanceToSegment(b, c, d),
                                     DistanceToSegment(c, a, b), DistanceToSegment(d, a, b)});
      if (least < kRounding || Cross(a, b, c, d)) return false;
    }
  return true;
}

bool MovesItself(const Model& model) {
  return dynamic_cast<const Stg::ModelPosition*>(&model) != nullptr ||
         dynamic_cast<const Stg::ModelActuator*>(&model) != nullptr ||
         dynamic_cast<const Stg::ModelGripper*>(&model) != nullptr;
}

template <typename F>
bool AnyInTree(const Model& model, F f) {
  return f(model) || std::ranges::any_of(model.GetChildren(),
                                         [&](const Model* child) { return AnyInTree(*child, f); });
}

bool IsDisc(const Model& model) { return std::string(model.TokenStr()).ends_with("_round"); }

}  // namespace

PlacedOutlines::PlacedOutlines(const Stg::World& world, const std::vector<point_t>& room) {
  for (const Model* root : world.GetChildren()) {
    const bool mover = root->IsPushable() || AnyInTree(*root, MovesItself);
    const bool loose =
        AnyInTree(*root, [&](const Model& m) { return &m != root && MovesItself(m); });
    movers_ += mover;
    AddTree(*root, *root, mover, loose);
  }
  if (!room.empty()) AddRoom(room);
  for (size_t i = 0; i < outlines_.size(); i++)
    for (size_t k = 0; k < i; k++) Compare(outlines_[i], outlines_[k]);
  std::ranges::sort(overlaps_);
}

void PlacedOutlines::AddRoom(const std::vector<point_t>& room) {
  Outline outline{};
  outline.key = kRoom;
  outline.simple = true;
  outline.top = 1;
  outline.corners = room;
  outline.middle = room[0];
  for (const point_t& p : room) outline.reach = std::max(outline.reach, Distance(p, room[0]));
  outlines_.push_back(outline);
}

void PlacedOutlines::AddTree(const Model& model, const Model& root, bool mover, bool loose) {
  std::string& state = states_[root.GetId()];
  state += std::to_string(model.GetId()) + " ";
  names_[model.GetId()] = model.TokenStr();
  if (const auto* gripper = dynamic_cast<const Stg::ModelGripper*>(&model)) {
    const auto config = const_cast<Stg::ModelGripper*>(gripper)->GetConfig();
    state += std::to_string(config.paddle_position) + " " + std::to_string(config.lift_position);
  }
  if (model.vis.obstacle_return) AddBody(model, root, mover, loose);
  for (const Model* child : model.GetChildren()) AddTree(*child, root, mover, loose);
}

void PlacedOutlines::AddBody(const Model& model, const Model& root, bool mover, bool loose) {
  const Stg::Pose frame = model.GetGlobalPose() + model.GetGeom().pose;
  uint64_t number = 0;
  for (const auto& block : model.body().blocks()) {
    number++;
    if (block->points().empty()) continue;
    Outline outline{};
    // Models that move on their own robot are stopped if all outlines of their tree come nearer to
    // something than they were, so that such trees count as a whole.
    outline.key = loose ? uint64_t{root.GetId()} << 32 : (uint64_t{model.GetId()} << 32) + number;
    outline.root = root.GetId();
    outline.mover = mover;
    outline.has_side = mover && &model == &root && !loose;
    outline.bottom = block->z_range().min + frame.z;
    outline.top = block->z_range().max + frame.z;
    point_t sum(0, 0);
    const double cosine = std::cos(frame.a), sine = std::sin(frame.a);
    for (const point_t& p : block->points()) {
      outline.corners.emplace_back(frame.x + cosine * p.x - sine * p.y,
                                   frame.y + sine * p.x + cosine * p.y);
      sum.x += outline.corners.back().x - frame.x;
      sum.y += outline.corners.back().y - frame.y;
    }
    const double count = static_cast<double>(outline.corners.size());
    outline.middle = point_t(frame.x + sum.x / count, frame.y + sum.y / count);
    for (const point_t& p : outline.corners)
      outline.reach = std::max(outline.reach, Distance(p, outline.middle));
    outline.simple = IsSimple(outline.corners);
    // A disc that stands is a polygon of 64 corners.
    if (IsDisc(model)) outline.radius = outline.reach * (mover ? 1.0 : std::cos(M_PI / 64));
    outlines_.push_back(outline);
  }
}

/// False for outlines of one tree, of two walls, and at different heights.
bool PlacedOutlines::MayMeet(const Outline& a, const Outline& b) {
  if (a.root == b.root || (!a.mover && !b.mover)) return false;
  return a.bottom <= b.top && b.bottom <= a.top;
}

bool PlacedOutlines::MayTouch(const Outline& a, const Outline& b) {
  return Distance(a.middle, b.middle) < a.reach + b.reach;
}

/// Walls are hollow, and so are polygons that intersect themselves.
bool PlacedOutlines::Overlap(const Outline& a, const Outline& b) {
  if (a.radius > 0 && b.radius > 0) {
    const double distance = Distance(a.middle, b.middle);
    if (distance > a.radius + b.radius - kRounding) return false;
    return (a.mover && b.mover) ||
           distance > std::fabs(a.radius - b.radius) + a.reach * 2e-3 + b.reach * 2e-3;
  }
  if (a.radius > 0) return Overlap(b, a);
  if (b.radius > 0) {
    if (!b.mover) {  // its edge alone
      double most = 0;
      for (const point_t& p : a.corners) most = std::max(most, Distance(p, b.middle));
      if (most < b.radius * (1 + 2e-3)) return false;
    }
    if (DistanceToEdges(a.corners, b.middle) < b.radius - kRounding) return true;
    return a.mover && a.simple && Contains(a.corners, b.middle);
  }
  if (AnyCross(a.corners, b.corners)) return true;
  return (a.mover && a.simple && IsDeepInside(a.corners, b.corners[0])) ||
         (b.mover && b.simple && IsDeepInside(b.corners, a.corners[0]));
}

void PlacedOutlines::Compare(const Outline& a, const Outline& b) {
  if (!MayMeet(a, b)) return;
  const Pair pair(std::min(a.key, b.key), std::max(a.key, b.key));
  const bool near = MayTouch(a, b);
  if (near && Overlap(a, b)) {
    overlaps_.push_back(pair);
    return;
  }
  const Outline &mover = a.mover ? a : b, &wall = a.mover ? b : a;
  if (wall.mover || wall.radius > 0 || !wall.simple || !mover.has_side) return;
  const point_t place = mover.radius > 0 ? mover.middle : mover.corners[0];
  if (DistanceToEdges(wall.corners, place) < kRounding) return;  // on its outline
  insides_[pair] = near && Contains(wall.corners, place);
}

std::string PlacedOutlines::FaultsSince(const PlacedOutlines& before) const {
  std::map<uint64_t, uint32_t> root_of;
  for (const Outline& outline : outlines_) root_of[outline.key] = outline.root;
  const auto is_changed = [&](uint64_t key) {
    if (key == kRoom) return false;
    const uint32_t root = root_of[key];
    const auto old = before.states_.find(root);
    return old == before.states_.end() || old->second != states_.at(root);
  };
  const auto name_of = [&](uint64_t key) {
    return key == kRoom ? "the room" : names_.at(key >> 32);
  };
  const auto text_of = [&](const Pair& pair) {
    return name_of(pair.first) + " and " + name_of(pair.second) + "; ";
  };
  std::string faults;
  for (const Pair& pair : overlaps_)
    if (!std::ranges::binary_search(before.overlaps_, pair) && !is_changed(pair.first) &&
        !is_changed(pair.second))
      faults += "overlap of " + text_of(pair);
  for (const auto& [pair, inside] : insides_) {
    const auto old = before.insides_.find(pair);
    if (old != before.insides_.end() && old->second != inside)
      faults += "a passed wall: " + text_of(pair);
  }
  return faults;
}

}  // namespace test
