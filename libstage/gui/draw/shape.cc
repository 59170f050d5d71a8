// SPDX-License-Identifier: GPL-2.0-or-later

#include "gui/draw/shape.hh"

#include <GL/glu.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <deque>
#include <optional>

#include "geometry/trigonometry.hh"
#include "models/body.hh"
#include "models/robot_marks.hh"

namespace Stg::draw {

namespace {

constexpr double kSharp = M_PI / 6;  // corners that turn by more than this get a vertical edge

struct TopCorner {
  GLdouble position[3];  // x, y and 0: the tessellator must see a planar contour
  double z;
};

bool SameHeight(const Bounds& a, const Bounds& b) { return a.min == b.min && a.max == b.max; }

/// Triangulates the tops of blocks.
class Tessellator {
 public:
  explicit Tessellator(std::vector<Corner>* triangles)
      : triangles_(*triangles), tess_(gluNewTess()) {
    gluTessProperty(tess_, GLU_TESS_WINDING_RULE, GLU_TESS_WINDING_ODD);
    gluTessNormal(tess_, 0, 0, 1);
    gluTessCallback(tess_, GLU_TESS_VERTEX_DATA, reinterpret_cast<_GLUfuncptr>(&OnVertex));
    gluTessCallback(tess_, GLU_TESS_COMBINE_DATA, reinterpret_cast<_GLUfuncptr>(&OnCombine));
    // With an edge-flag callback, GLU emits independent triangles only.
    gluTessCallback(tess_, GLU_TESS_EDGE_FLAG_DATA, reinterpret_cast<_GLUfuncptr>(&OnEdgeFlag));
  }
  ~Tessellator() { gluDeleteTess(tess_); }
  Tessellator(const Tessellator&) = delete;
  Tessellator& operator=(const Tessellator&) = delete;

  /// Fills all blocks of one height range together: an outline inside another one is a hole.
  void Fill(const BlockGroup& body, const Bounds& z) {
    gluTessBeginPolygon(tess_, this);
    for (const auto& block : body.blocks()) {
      if (!SameHeight(block->z_range(), z)) continue;
      gluTessBeginContour(tess_);
      for (const point_t& p : block->points()) {
        corners_.push_back({{p.x, p.y, 0}, block->z_range().max});
        gluTessVertex(tess_, corners_.back().position, &corners_.back());
      }
      gluTessEndContour(tess_);
    }
    gluTessEndPolygon(tess_);
  }

 private:
  static void OnVertex(void* corner, void* self) {
    const TopCorner& c = *static_cast<TopCorner*>(corner);
    static_cast<Tessellator*>(self)->triangles_.push_back({static_cast<float>(c.position[0]),
                                                           static_cast<float>(c.position[1]),
                                                           static_cast<float>(c.z)});
  }
  static void OnEdgeFlag(GLboolean, void*) {}
  /// Makes a corner where outlines cross.
  static void OnCombine(GLdouble position[3], void* from[4], GLfloat weight[4], void** made,
                        void* self) {
    double z = 0;
    for (size_t i = 0; i < 4; i++)
      if (from[i]) z += double{weight[i]} * static_cast<TopCorner*>(from[i])->z;
    std::deque<TopCorner>& corners = static_cast<Tessellator*>(self)->corners_;
    corners.push_back({{position[0], position[1], 0}, z});
    *made = &corners.back();
  }

  std::vector<Corner>& triangles_;
  GLUtesselator* tess_;
  std::deque<TopCorner> corners_;  // a deque keeps addresses valid while it grows
};

Corner At(const point_t& p, double z) {
  return {static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(z)};
}

bool TurnsSharply(const point_t& a, const point_t& b, const point_t& c) {
  const double turn = std::atan2(c.y - b.y, c.x - b.x) - std::atan2(b.y - a.y, b.x - a.x);
  return std::fabs(normalize(turn)) > kSharp;
}

void AddSides(const Block& block, Shape* shape) {
  const std::vector<point_t>& points = block.points();
  const double low = block.z_range().min, high = block.z_range().max;
  const size_t n = points.size();
  for (size_t i = 0; i < n; i++) {
    const point_t &before = points[(i + n - 1) % n], &from = points[i], &to = points[(i + 1) % n];
    for (const Corner& c :
         {At(from, low), At(to, low), At(to, high), At(from, low), At(to, high), At(from, high)})
      shape->faces.push_back(c);
    shape->edges.push_back(At(from, high));
    shape->edges.push_back(At(to, high));
    if (!TurnsSharply(before, from, to)) continue;
    shape->edges.push_back(At(from, low));
    shape->edges.push_back(At(from, high));
  }
}

/// Transforms corners from the body's frame to the model's.
void Move(std::vector<Corner>* corners, const Pose& frame) {
  const SineCosine turn = SinCos(frame.a);
  for (Corner& c : *corners)
    c = {static_cast<float>(frame.x + c.x * turn.cosine - c.y * turn.sine),
         static_cast<float>(frame.y + c.x * turn.sine + c.y * turn.cosine),
         static_cast<float>(frame.z + c.z)};
}

void Measure(Shape* shape) {
  if (!shape->edges.empty()) shape->top = shape->bottom = shape->edges.front().z;
  for (const std::vector<Corner>* corners : {&shape->faces, &shape->edges})
    for (const Corner& c : *corners) {
      const double reach = std::hypot(double{c.x}, double{c.y});
      shape->reach = std::max(shape->reach, reach);
      shape->radius = std::max(shape->radius, std::hypot(reach, double{c.z}));
      shape->top = std::max(shape->top, double{c.z});
      shape->bottom = std::min(shape->bottom, double{c.z});
    }
}

void AddNose(const BlockGroup& body, const Pose& frame, Shape* shape) {
  const std::optional<Nose> nose = NoseOf(body, frame);
  if (!nose) return;
  for (const point_t& corner : *nose) shape->nose.push_back(At(corner, 0));
}

void Append(std::string* key, double value) {
  key->append(reinterpret_cast<const char*>(&value), sizeof value);
}

std::string KeyOf(const BlockGroup& body, const Pose& frame) {
  std::string key;
  for (const double value : {frame.x, frame.y, frame.z, frame.a}) Append(&key, value);
  for (const auto& block : body.blocks()) {
    Append(&key, static_cast<double>(block->points().size()));
    Append(&key, block->z_range().min);
    Append(&key, block->z_range().max);
    for (const point_t& p : block->points()) {
      Append(&key, p.x);
      Append(&key, p.y);
    }
  }
  return key;
}

}  // namespace

std::shared_ptr<const Shape> MakeShape(const BlockGroup& body, const Pose& frame) {
  static std::atomic<uint64_t> last_id{0};
  auto shape = std::make_shared<Shape>();
  shape->id = ++last_id;
  std::vector<Bounds> heights;
  for (const auto& block : body.blocks()) {
    const Bounds& z = block->z_range();
    if (std::none_of(heights.begin(), heights.end(),
                     [&](const Bounds& known) { return SameHeight(known, z); }))
      heights.push_back(z);
  }
  Tessellator tessellator(&shape->faces);
  for (const Bounds& z : heights) tessellator.Fill(body, z);
  for (const auto& block : body.blocks()) AddSides(*block, shape.get());
  Move(&shape->faces, frame);
  Move(&shape->edges, frame);
  Measure(shape.get());
  AddNose(body, frame, shape.get());
  return shape;
}

std::shared_ptr<const Shape> ShapeStore::Find(const BlockGroup& body, const Pose& frame) {
  std::weak_ptr<const Shape>& entry = shapes_[KeyOf(body, frame)];
  std::shared_ptr<const Shape> shape = entry.lock();
  if (!shape) entry = shape = MakeShape(body, frame);
  return shape;
}

void ShapeStore::Tidy() {
  std::erase_if(shapes_, [](const auto& entry) { return entry.second.expired(); });
}

}  // namespace Stg::draw
