// SPDX-License-Identifier: GPL-2.0-or-later
//
// A copy of what is to be seen of a world at one moment, ready to be drawn while the world moves
// on. What is out of view is left out of it. No OpenGL here.
//
// A scene is brought up to date between two steps of its world. Its memory is kept from frame to
// frame: once the world and the view are as large as they get, nothing is allocated any more.

#ifndef STAGE_GUI_DRAW_SCENE_HH
#define STAGE_GUI_DRAW_SCENE_HH

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "gui/draw/fan_outline.hh"
#include "gui/draw/primitives.hh"
#include "gui/draw/shape.hh"
#include "gui/view/projection.hh"
#include "gui/view/view_state.hh"
#include "models/model.hh"
#include "models/ranger.hh"

namespace Stg {
class StripPlotVis;
class World;
}  // namespace Stg

namespace Stg::draw {

/// The models that are marked, and the one that was marked last, if only in the past.
struct Selection {
  std::vector<Model*> models;
  Model* last = nullptr;

  bool Has(const Model* model) const;
};

/// Models of one shape.
struct BodyBatch {
  std::shared_ptr<const Shape> shape;
  std::vector<Instance> solid;   ///< the scenery
  std::vector<Instance> robots;  ///< robots and what they carry; solid
  std::vector<Instance> translucent;
  std::vector<Instance> footprints;  ///< to be drawn flat, on the floor
  std::vector<Instance> noses;       ///< of the shape's nose, each at its height and in its colour
};

/// Outlines of about the same number of tips: of so many, as the last one may be there several
/// times.
struct FanGroup {
  std::size_t tips = 0;
  std::vector<FanInstance> fans;
};

/// A strip chart, in pixels from the lower left corner.
struct Chart {
  float x, y, width, height;
  Rgba color, background;
  float least, greatest;
  std::vector<float> values;
  std::string name;
};

/// A client's visualizer that is on: to be called when the picture is made.
struct ClientVisual {
  Model* model;
  Visualizer* visualizer;
  Pose frame;
};

/// What there is to draw, in the order of drawing.
struct Frame {
  std::optional<view::Projection> projection;
  OrthoCamera flat;
  PerspectiveCamera perspective;
  bool is_perspective = false, keep_last = false, checked_floor = true;
  Bounds floor_x, floor_y;  ///< empty extents: no floor
  Bounds depths;            ///< heights that the flat view shows
  double step = 0;          ///< metres between axis numbers

  Painting floor;  ///< axis numbers, occupied cells: on the floor, hidden by nothing before them
  std::vector<BodyBatch> bodies;
  std::vector<Vertex> dots;  ///< robots that are too small to be seen otherwise, by their tops
  float dot_width = 0;       ///< pixels
  Painting solid;            ///< flags, arrows, boxes
  Painting marks;            ///< of the selection, and grids of models: translucent
  std::vector<FanGroup> fans;
  std::vector<Tip> tips;
  Painting data;  ///< translucent, behind what is higher
  std::vector<ClientVisual> visuals;
  std::vector<point3_t> stalled;  ///< places of the stall icons
  Painting over;                  ///< hidden by nothing: speech, ids, the picture of rays
  std::vector<Chart> charts;
  std::size_t chart_count = 0;  ///< of `charts`; the rest is kept for its memory

  const Camera& camera() const {
    return is_perspective ? static_cast<const Camera&>(perspective) : flat;
  }
};

class Scene {
 public:
  /// Copies what a canvas of width x height pixels shows. The world must be between two steps.
  void Update(World& world, const view::ViewState& view, int width, int height,
              const Selection& selection = Selection());

  const Frame& frame() const { return frame_; }
  /// If so, the world must not move until the scene is drawn: clients' visualizers look at it.
  bool has_client_visuals() const { return !frame_.visuals.empty(); }

  // For tests and figures.
  std::size_t model_count() const { return items_.size(); }
  std::size_t bodies_in_view() const { return bodies_in_view_; }
  std::size_t fans_in_view() const;

 private:
  enum class Kind : uint8_t { kPlain, kPosition, kRanger, kOther };
  static constexpr uint32_t kNone = 0xffffffff;

  struct Item {
    Model* model;
    uint32_t parent;   // its index, or kNone
    uint32_t batch;    // kNone: no body
    unsigned version;  // of the body that the batch's shape was made of
    Kind kind;
    bool has_children;
    bool is_leaf;      // has neither a body nor children, and is not at top level
    bool is_of_robot;  // it is a robot, or carried by one
    bool is_dot;       // in this frame: it is drawn as a dot, or is a small part of a robot that is
    // Of this frame: the global pose, sine and cosine of its heading if it has children.
    double x, y, z, a, sine, cosine;
  };
  struct Job;  // what one update needs to know

  static Kind KindOf(const Model& model);
  void Rebuild(World& world);
  void AddTree(Model* model, uint32_t parent);
  void PlaceItem(Item* item);
  void FindShape(Item* item);
  uint32_t BatchOf(const std::shared_ptr<const Shape>& shape);
  void DropUnusedBatches();

  void Begin(const Job& job);
  void Fetch(std::size_t index) const;
  void FindNewShapes(World& world);
  void AddBodies(const Job& job);
  void AddBody(const Job& job, Item* item);
  bool AddDot(Item* item, const Shape& shape, const Rgba& color);
  bool IsNarrow(const Item& item, const Shape& shape, double pixels) const;
  void AddNoses(const Job& job);
  double HeightOfNose(std::size_t index) const;
  void AddTrails(const Job& job, const Item& item);
  void AddExtras(const Job& job, const Item& item);
  void AddData(const Job& job);
  void AddVisuals(const Job& job, const Item& item);
  void AddFans(const Job& job, const Item& item);
  void AddFan(const ModelRanger::Sensor& sensor, const Pose& place, double reach);
  const Directions& DirectionsOf(const ModelRanger::Sensor& sensor);
  FanGroup& GroupOf(std::size_t tips);
  void AddChart(StripPlotVis& plot);

  const World* world_ = nullptr;
  uint64_t family_ = 0, bodies_ = 0;  // what the engine's counts of changes were
  std::vector<Item> items_;           // parents before their children
  ShapeStore shapes_;
  struct SensorKind {
    double fov;
    Directions directions;
  };
  std::vector<SensorKind> kinds_;
  std::size_t robots_ = 0;           // with a body
  std::vector<std::size_t> nosed_;   // items of this frame that are large enough for a nose
  double pixel_ = 0;                 // its side in this frame, metres; 0: it depends on the place
  double lowest_ = 0, highest_ = 1;  // of the bodies of the last frame, metres
  std::size_t bodies_in_view_ = 0;
  Frame frame_;
};

}  // namespace Stg::draw

#endif
