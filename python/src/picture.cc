// SPDX-License-Identifier: GPL-2.0-or-later

#include "picture.hh"

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "geometry/trigonometry.hh"
#include "models/body.hh"
#include "models/host.hh"
#include "models/position.hh"
#include "models/ranger.hh"
#include "models/robot_marks.hh"
#include "world/world.hh"

namespace Stg::python {

namespace {

using Ink = Canvas::Ink;

constexpr Ink kFloor = {250, 250, 252, 255}, kStalled = {255, 0, 0, 255};
constexpr uint8_t kScanOpacity = 30;

/// Transforms points from a frame to the world.
class Frame {
 public:
  explicit Frame(const Pose& pose) : pose_(pose), turn_(SinCos(pose.a)) {}
  point_t Place(double x, double y) const {
    return {pose_.x + x * turn_.cosine - y * turn_.sine,
            pose_.y + x * turn_.sine + y * turn_.cosine};
  }
  std::vector<point_t> Place(const std::vector<point_t>& points) const {
    std::vector<point_t> placed;
    placed.reserve(points.size());
    for (const point_t& p : points) placed.push_back(Place(p.x, p.y));
    return placed;
  }

 private:
  Pose pose_;
  SineCosine turn_;
};

Pose BodyFrame(const Model& model) { return model.GetGlobalPose() + model.GetGeom().pose; }

/// Drawing layers. Robots and what they carry come last, so that scenery and scans don't cover
/// them.
enum class Layer { kScenery, kRobots };

Layer LayerOf(const Model& model) {
  return dynamic_cast<const ModelPosition*>(model.Root()) ? Layer::kRobots : Layer::kScenery;
}

/// One thing to draw: the blocks of one model that share a height range, the mark of a robot (its
/// nose or a dot), or the scan of a sensor.
struct Item {
  Layer layer;
  double z;  // height of its top, metres
  const Model* model;
  const ModelRanger::Sensor* sensor;  // null: a body, or a mark
  Bounds blocks;                      // height range of the blocks; max below min: a mark
};

bool IsRobot(const Model& model) { return dynamic_cast<const ModelPosition*>(&model) != nullptr; }

std::size_t CountRobots(World& world) {
  const auto& models = world.host().models;
  return static_cast<std::size_t>(std::count_if(models.begin(), models.end(), [](const Model* m) {
    return IsRobot(*m) && !m->body().empty();
  }));
}

void AddBody(const Model& model, std::vector<Item>* items) {
  const double z = BodyFrame(model).z;
  std::vector<Bounds> known;
  for (const auto& block : model.body().blocks()) {
    const Bounds& range = block->z_range();
    const auto same = [&](const Bounds& b) { return b.min == range.min && b.max == range.max; };
    if (std::any_of(known.begin(), known.end(), same)) continue;
    known.push_back(range);
    items->push_back({LayerOf(model), z + range.max, &model, nullptr, range});
  }
}

double TopOf(const Model& model) {
  double top = BodyFrame(model).z + model.GetGeom().size.z;
  for (const Model* child : model.GetChildren()) top = std::max(top, TopOf(*child));
  return top;
}

void AddScans(const ModelRanger& ranger, std::vector<Item>* items) {
  const double z = BodyFrame(ranger).z;
  for (const ModelRanger::Sensor& sensor : ranger.GetSensors())
    if (!sensor.ranges.empty() && sensor.bearings.size() == sensor.ranges.size())
      items->push_back({Layer::kScenery, z + sensor.pose.z, &ranger, &sensor, Bounds(0, 0)});
}

/// All items in drawing order: by layer, then from low to high.
std::vector<Item> ItemsOf(World& world, bool data) {
  std::vector<Item> items;
  for (const Model* model : world.host().models) {
    AddBody(*model, &items);
    const auto* const ranger = dynamic_cast<const ModelRanger*>(model);
    if (data && ranger) AddScans(*ranger, &items);
    const bool is_marked = IsRobot(*model) || model->HasGuiNose();
    if (is_marked && !model->body().empty())
      items.push_back({LayerOf(*model), TopOf(*model), model, nullptr, Bounds(1, 0)});
  }
  const auto lower = [](const Item& a, const Item& b) {
    return a.layer != b.layer ? a.layer < b.layer : a.z < b.z;
  };
  std::stable_sort(items.begin(), items.end(), lower);
  return items;
}

class Drawing {
 public:
  Drawing(const View& view, std::size_t robots, uint8_t* pixels)
      : view_(view), dot_width_(DotWidth(robots)), canvas_(view, pixels) {
    canvas_.Clear(kFloor);
  }

  void Draw(const Item& item) {
    if (item.sensor) return DrawScan(static_cast<const ModelRanger&>(*item.model), *item.sensor);
    if (!IsSeen(*item.model)) return;
    if (item.blocks.max < item.blocks.min) return DrawMark(*item.model);
    DrawBlocks(*item.model, item.blocks);
  }

 private:
  bool IsInside(const Pose& pose, double radius) const {
    const double x = 0.5 * view_.width / view_.scale, y = 0.5 * view_.height / view_.scale;
    return std::fabs(pose.x - view_.x) <= x + radius && std::fabs(pose.y - view_.y) <= y + radius;
  }
  bool IsSeen(const Model& model) const {
    return IsInside(BodyFrame(model), model.body().radius() + 1 / view_.scale);
  }
  bool IsNarrow(const Model& model, double pixels) const {
    return 2 * model.body().radius() * view_.scale < pixels;
  }

  /// Draws blocks as one polygon: an outline inside another one is a hole.
  void DrawBlocks(const Model& model, const Bounds& heights) {
    const Ink ink = Ink::Of(model.GetShownColor());
    if (ink.opacity == 0) return;
    const Frame frame(BodyFrame(model));
    std::vector<std::vector<point_t>> outlines;
    for (const auto& block : model.body().blocks())
      if (block->z_range().min == heights.min && block->z_range().max == heights.max)
        outlines.push_back(frame.Place(block->points()));
    for (const auto& outline : outlines) canvas_.AddOutline(outline);
    canvas_.Fill(ink);
    const Ink edge = model.Stalled() ? kStalled : IsNarrow(model, kEdgeWidth) ? ink : ink.Darker();
    for (const auto& outline : outlines) canvas_.DrawOutline(outline, edge);
  }

  /// Draws the nose of a robot, or a dot if the whole robot is too small in this picture.
  void DrawMark(const Model& model) {
    const Color color = model.GetShownColor();
    if (Ink::Of(color).opacity == 0) return;
    if (IsRobot(model) && IsNarrow(model, dot_width_))
      return DrawDot(BodyFrame(model), model.Stalled() ? kStalled : Ink::Of(color));
    const std::optional<Nose> nose = NoseOf(model.body(), model.GetGeom().pose);
    if (!nose || !model.HasGuiNose() || IsNarrow(model, kNoseWidth)) return;
    canvas_.AddOutline(Frame(model.GetGlobalPose()).Place({nose->begin(), nose->end()}));
    canvas_.Fill(Ink::Of(NoseColor(color)));
  }

  void DrawDot(const Pose& place, const Ink& ink) {
    const double half = 0.5 * dot_width_ / view_.scale;
    canvas_.AddOutline({{place.x - half, place.y - half},
                        {place.x + half, place.y - half},
                        {place.x + half, place.y + half},
                        {place.x - half, place.y + half}});
    canvas_.Fill(ink);
  }

  void DrawScan(const ModelRanger& ranger, const ModelRanger::Sensor& sensor) {
    const Pose base = ranger.SensorFrame(ranger.GetScanPose());
    const Pose origin = ModelRanger::OriginOf(sensor, base, SinCos(base.a));
    // Clamp infinite ranges to a length that still ends outside of the picture.
    const double longest = 2 * (view_.width + view_.height) / view_.scale +
                           std::max(std::fabs(origin.x - view_.x), std::fabs(origin.y - view_.y));
    const double reach = std::min(sensor.Reach(), longest);
    if (!IsInside(origin, reach)) return;
    Ink ink = Ink::Of(sensor.color);
    ink.opacity = kScanOpacity;
    canvas_.AddOutline(ScanOutline(sensor, Frame(origin), reach));
    canvas_.Fill(ink);
  }

  /// The area that the rays have swept; for a single ray, the cone of its field of view.
  static std::vector<point_t> ScanOutline(const ModelRanger::Sensor& sensor, const Frame& frame,
                                          double reach) {
    std::vector<point_t> outline = {frame.Place(0, 0)};
    const auto add_tip = [&](size_t i, double aside) {
      const SineCosine turn = SinCos(sensor.bearings[i] + aside);
      const double length = std::min(sensor.ranges[i], reach);
      outline.push_back(frame.Place(length * turn.cosine, length * turn.sine));
    };
    if (sensor.ranges.size() == 1) {
      const double half = std::min(std::fabs(sensor.fov), 3.0) / 2;
      for (const double aside : {-half, half}) add_tip(0, aside);
    } else {
      for (size_t i = 0; i < sensor.ranges.size(); i++) add_tip(i, 0);
    }
    return outline;
  }

  const View view_;
  const double dot_width_;  // pixels
  Canvas canvas_;
};

}  // namespace

void DrawWorld(World& world, const View& view, bool data, uint8_t* pixels) {
  Drawing drawing(view, CountRobots(world), pixels);
  for (const Item& item : ItemsOf(world, data)) drawing.Draw(item);
}

View FittedView(World& world, int width, int height) {
  constexpr double kMargin = 1.04, kMinSide = 0.1;  // a factor; metres
  Bounds x(HUGE_VAL, -HUGE_VAL), y = x;
  for (const Model* model : world.host().models) {
    const Frame frame(BodyFrame(*model));
    for (const auto& block : model->body().blocks())
      for (const point_t& p : frame.Place(block->points())) {
        x = Bounds(std::min(x.min, p.x), std::max(x.max, p.x));
        y = Bounds(std::min(y.min, p.y), std::max(y.max, p.y));
      }
  }
  if (x.max < x.min) x = y = Bounds(-1, 1);
  return {width, height, (x.min + x.max) / 2, (y.min + y.max) / 2,
          std::min(width / std::max(kMargin * (x.max - x.min), kMinSide),
                   height / std::max(kMargin * (y.max - y.min), kMinSide))};
}

}  // namespace Stg::python
