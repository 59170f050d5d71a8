// SPDX-License-Identifier: GPL-2.0-or-later
//
// A snapshot of everything visible in a world at one moment, so that it can be drawn while the
// world steps on. Models out of view are left out. No OpenGL here.
//
// Update a scene between two steps of its world. It keeps its memory from frame to frame, so that a
// steady state allocates nothing.

#ifndef STAGE_GUI_DRAW_RENDER_SCENE_HH
#define STAGE_GUI_DRAW_RENDER_SCENE_HH

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "gui/draw/fan_polyline.hh"
#include "gui/draw/primitives.hh"
#include "gui/draw/shape.hh"
#include "gui/view/projection.hh"
#include "gui/view/view_state.hh"
#include "models/model.hh"
#include "models/ranger.hh"

namespace Stg {
class LightSource;
class StripPlotVis;
class World;
}  // namespace Stg

namespace Stg::draw {

/// The selected models, and the one selected last, which may no longer be selected.
struct Selection {
  std::vector<Model*> models;
  Model* last = nullptr;

  bool Has(const Model* model) const;
};

/// Instances of one shape.
struct BodyBatch {
  std::shared_ptr<const Shape> shape;
  std::vector<Instance> solid;   ///< immovable models
  std::vector<Instance> robots;  ///< robots and the models they carry
  std::vector<Instance> translucent;
  std::vector<Instance> footprints;  ///< drawn flat on the floor
  std::vector<Instance> noses;       ///< one per nose of the shape, with its height and colour
};

/// Fans with the same number of tips. Shorter fans are padded by repeating their last tip.
struct FanGroup {
  std::size_t ray_ends = 0;
  std::vector<FanInstance> fans;
};

/// A strip chart. Coordinates are pixels from the lower left corner.
struct Chart {
  float x, y, width, height;
  Rgba color, background;
  float min_value, max_value;
  std::vector<float> values;
  std::string name;
};

/// An active visualizer of a client, called while the frame is drawn.
struct ClientVisual {
  Model* model;
  Visualizer* visualizer;
  Pose frame;
};

/// Content of a frame, in drawing order.
struct Frame {
  std::optional<view::Projection> projection;
  OrthoCamera flat;
  PerspectiveCamera perspective;
  bool is_perspective = false, keep_last = false, checked_floor = true;
  Bounds floor_x, floor_y;  ///< empty: no floor
  Bounds depths;            ///< range of heights visible in the flat view, metres
  double step = 0;          ///< metres between axis numbers

  Painting floor;  ///< axis numbers and occupied cells; drawn over the floor
  std::vector<BodyBatch> bodies;
  std::vector<Vertex> dots;  ///< tops of robots that would be too small to see
  float dot_width = 0;       ///< pixels
  Painting solid;            ///< flags, arrows, boxes
  Painting marks;            ///< selection marks and grids of models; translucent
  std::vector<FanGroup> fans;
  std::vector<RayEnd> ray_ends;
  Painting data;  ///< translucent; occluded by anything higher
  std::vector<ClientVisual> visuals;
  std::vector<point3_t> stalled;  ///< positions of stall icons
  Painting over;                  ///< never occluded: speech, ids, debug view of rays
  std::vector<Chart> charts;
  std::size_t chart_count = 0;  ///< number in use; the rest of `charts` is kept for its memory

  const Camera& camera() const {
    return is_perspective ? static_cast<const Camera&>(perspective) : flat;
  }
};

class RenderScene {
 public:
  /// Copies what a canvas of width x height pixels shows. Call between two steps of the world.
  void Update(World& world, const view::ViewState& view, int width, int height,
              const Selection& selection = Selection());

  const Frame& frame() const { return frame_; }
  /// If true, the world must not step until the scene is drawn: visualizers read the world itself.
  bool has_client_visuals() const { return !frame_.visuals.empty(); }

  // For tests and statistics.
  std::size_t model_count() const { return items_.size(); }
  std::size_t bodies_in_view() const { return bodies_in_view_; }
  std::size_t fans_in_view() const;

 private:
  enum class Kind : uint8_t { kPlain, kPosition, kRanger, kOther };
  static constexpr uint32_t kNone = 0xffffffff;

  struct Item {
    Model* model;
    uint32_t parent;   // index of the parent, or kNone
    uint32_t batch;    // index of its BodyBatch; kNone: no body
    unsigned version;  // version of the body that the shape was made from
    Kind kind;
    bool has_children;
    bool is_leaf;      // without body or children, and not at top level
    bool is_of_robot;  // a robot, or carried by one
    bool is_dot;       // drawn as a dot in this frame, or a small part of such a robot
    // Global pose in this frame, metres and radians; sine and cosine only for items with children.
    double x, y, z, a, sine, cosine;
  };
  struct Job;  // inputs of one update

  static Kind KindOf(const Model& model);
  void Rebuild(World& world);
  void AddTree(Model* model, uint32_t parent);
  void PlaceItem(Item* item);
  void FindShape(Item* item);
  uint32_t BatchOf(const std::shared_ptr<const Shape>& shape);
  void DropUnusedBatches();

  void Begin(const Job& job);
  void Prefetch(std::size_t index) const;
  void UpdateShapes(World& world);
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
  FanGroup& GroupOf(std::size_t ray_ends);
  void AddChart(StripPlotVis& plot);

  const World* world_ = nullptr;
  uint64_t topology_version_ = 0,
           body_version_ = 0;  // change counters of the engine at the last update
  std::vector<Item> items_;    // parents come before their children
  std::vector<const LightSource*> lights_;
  ShapeStore shapes_;
  struct SensorKind {
    double fov;
    Directions directions;
  };
  std::vector<SensorKind> kinds_;
  std::size_t robots_ = 0;  // number of robots with a body
  std::vector<std::size_t>
      items_with_nose_;           // indices of robots large enough for a nose in this frame
  double pixel_ = 0;              // side of a pixel, metres; 0: it depends on the place
  double min_z_ = 0, max_z_ = 1;  // z range of all bodies in the last frame, metres
  std::size_t bodies_in_view_ = 0;
  Frame frame_;
};

}  // namespace Stg::draw

#endif
