// SPDX-License-Identifier: GPL-2.0-or-later

#include "models/contact_outline.hh"

#include <algorithm>
#include <cmath>

#include "geometry/trigonometry.hh"
#include "models/body.hh"
#include "models/model.hh"

namespace Stg {

namespace {

using motion::Vector;

// A polygon counts as a disc if it has this many corners, all at about one distance from their
// middle, and sides of about one length.
constexpr size_t kMinCornersOfDisc = 12;
constexpr double kMaxUnevenRadius = 0.02, kMaxUnevenSide = 0.1;  // relative

Vector MiddleOf(const std::vector<point_t>& points) {
  Vector sum;
  for (const point_t& p : points) sum = sum + Vector{p.x, p.y};
  return (1.0 / static_cast<double>(points.size())) * sum;
}

bool AreEven(double least, double most, double tolerance) {
  return most > 0 && most - least <= tolerance * most;
}

/// The radius of the smallest circle about `middle` that contains the polygon.
double RadiusOf(const std::vector<point_t>& points, Vector middle) {
  double radius = 0;
  for (const point_t& p : points)
    radius = std::max(radius, motion::Length(Vector{p.x, p.y} - middle));
  return radius;
}

/// True for a regular polygon of many corners, such as a drawing of a round robot.
bool IsRegular(const std::vector<point_t>& points, Vector middle) {
  if (points.size() < kMinCornersOfDisc) return false;
  double least_radius = INFINITY, most_radius = 0, least_side = INFINITY, most_side = 0;
  for (size_t i = 0; i < points.size(); i++) {
    const Vector p{points[i].x, points[i].y};
    const point_t& after = points[i + 1 == points.size() ? 0 : i + 1];
    const double radius = motion::Length(p - middle);
    const double side = motion::Length(Vector{after.x, after.y} - p);
    least_radius = std::min(least_radius, radius);
    most_radius = std::max(most_radius, radius);
    least_side = std::min(least_side, side);
    most_side = std::max(most_side, side);
  }
  return AreEven(least_radius, most_radius, kMaxUnevenRadius) &&
         AreEven(least_side, most_side, kMaxUnevenSide);
}

/// Blocks of one or two equal corners occupy no cell either.
bool IsPoint(const std::vector<point_t>& points) {
  return points.empty() || (points.size() <= 2 && points.front() == points.back());
}

template <typename T>
void AppendBytes(const T& value, std::string* bytes) {
  bytes->append(reinterpret_cast<const char*>(&value), sizeof value);
}

}  // namespace

void ContactOutline::Find(const Model& root, const Pose& at) {
  corners.clear();
  parts.clear();
  AddTree(root, at);
  // Children may be in any order, but results must not depend on it.
  std::ranges::stable_sort(parts, {}, [](const Part& part) { return part.model->GetId(); });
}

void ContactOutline::AddTree(const Model& model, const Pose& global) {
  if (model.vis.obstacle_return && !model.body().empty()) AddBody(model, global);
  for (const Model* child : model.GetChildren())
    AddTree(*child, model.ChildGlobalPose(global, *child));
}

void ContactOutline::AddBody(const Model& model, const Pose& global) {
  const Pose offset = model.GetGeom().pose, frame = global + offset;
  const SineCosine turn = SinCos(frame.a);
  const double lift = global.z + offset.z;
  const auto place = [&](Vector p) {
    corners.push_back(Vector{frame.x, frame.y} + motion::Rotate(p, turn.sine, turn.cosine));
  };
  for (const auto& block : model.body().blocks()) {
    const std::vector<point_t>& points = block->points();
    if (IsPoint(points)) continue;
    const Vector middle = MiddleOf(points);
    const bool round =
        model.round_ == Model::kRoundIfRegular ? IsRegular(points, middle) : model.round_ != 0;
    Part part{&model, corners.size(), 1, 0,
              motion::Interval{block->z_range().min + lift, block->z_range().max + lift}};
    if (round) {
      part.radius = RadiusOf(points, middle);
      place(middle);
    } else {
      part.corner_count = points.size();
      for (const point_t& p : points) place({p.x, p.y});
    }
    parts.push_back(part);
  }
}

double ContactOutline::Bottom() const {
  double bottom = parts.empty() ? 0 : INFINITY;
  for (const Part& part : parts) bottom = std::min(bottom, part.height.bottom);
  return bottom;
}

uint32_t ContactOutline::AddTo(motion::Shapes* shapes) const {
  std::vector<motion::Polygon> polygons;
  std::vector<motion::Disc> discs;
  for (const Part& part : parts) {
    if (part.radius > 0)
      discs.push_back({corners[part.first_corner], part.radius, part.height});
    else
      polygons.push_back({CornersOf(part), part.height});
  }
  return shapes->Add(polygons, discs);
}

void ContactOutline::AddTo(motion::Walls* walls, uint32_t group) const {
  for (const Part& part : parts) {
    const double friction = part.model->GetFriction();
    const std::span<const Vector> polygon = CornersOf(part);
    if (part.radius > 0) {
      // A wall consists of edges, so a disc is drawn with many.
      constexpr int kSides = 64;
      Vector circle[kSides];
      for (int i = 0; i < kSides; i++) {
        const SineCosine at = SinCos(i * (2.0 * M_PI / kSides));
        circle[i] = polygon[0] + part.radius * Vector{at.cosine, at.sine};
      }
      walls->Add(circle, true, part.height, friction, group);
    } else {
      walls->Add(polygon, true, part.height, friction, group);
    }
  }
}

std::string ContactOutline::Key() const {
  std::string key;
  for (const Part& part : parts) {
    AppendBytes(part.corner_count, &key);
    AppendBytes(part.radius, &key);
    AppendBytes(part.height.bottom, &key);
    AppendBytes(part.height.top, &key);
    for (const Vector& corner : CornersOf(part)) {
      AppendBytes(corner.x, &key);
      AppendBytes(corner.y, &key);
    }
  }
  return key;
}

}  // namespace Stg
