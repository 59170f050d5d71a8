// SPDX-License-Identifier: GPL-2.0-or-later
//
// Everything about a closed world that does not change while it runs, shared by all rows: robots,
// their bodies and sensors, and the cells and walls of what stands.
//
// A world is closed if a step can be made without its objects: all models are of types that rows
// know, and nobody calls back. RowBridge makes scenes and names what keeps a world from being
// closed.

#ifndef STAGE_ROWS_SCENE_HH
#define STAGE_ROWS_SCENE_HH

#include <algorithm>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <vector>

#include "geometry/geometry.hh"
#include "grid/grid.hh"
#include "messages/assert.hh"
#include "models/noise.hh"
#include "models/position.hh"
#include "models/ranger.hh"
#include "motion/columns.hh"
#include "motion/walls.hh"
#include "rows/cell_map.hh"
#include "rows/controls.hh"
#include "rows/finders.hh"
#include "rows/varied.hh"
#include "sensing/fan.hh"
#include "world/world.hh"

namespace Stg {
struct InitialState;
struct PopulationPlan;
}  // namespace Stg

namespace Stg::rows {

/// A model in the tree of a mover.
struct Node {
  uint32_t parent;  ///< index in Mover::nodes; the root is its own parent
  Pose local;       ///< in the frame of the parent, raised by its height if it stacks its children
  Pose frame;       ///< Geom::pose
};

/// A polygon of a mover.
struct Body {
  uint32_t mover, node;
  std::vector<point_t> corners;              ///< in the frame of the node
  std::vector<double> corners_x, corners_y;  ///< the same, padded for vectors
  Bounds height;                             ///< m, global
  bool obstacle;
  uint8_t brightness;  ///< index in Scene::brightness
  const Model* model;  ///< of the prototype
  uint32_t block;      ///< index among the model's blocks
  uint64_t loading_stamp;
  double radius;                 ///< m: no corner is further from the robot's origin
  uint32_t blocked;              ///< index in Scene::blocked
  uint32_t rows;                 ///< most rows of cells that it can cover
  uint32_t first_byte;           ///< of its bits among those of a world
  uint32_t first_point;          ///< of its corners among those of a world
  std::vector<uint32_t> rivals;  ///< bodies of other robots that it may run into
};

/// The running models with one update interval, which update together.
struct RateGroup {
  static constexpr uint32_t kMost = 32;  ///< groups of a scene: sets of them are bits
  std::vector<const Model*> models;      ///< of the prototype, in the order of their updates

  /// Time of the next update; never if there are no models.
  usec_t NextUpdateAfter(usec_t now) const {
    return models.empty() ? std::numeric_limits<usec_t>::max() : models[0]->NextUpdateAfter(now);
  }
};

/// A sensor of a ranger.
struct Sensor {
  uint32_t mover, node;
  uint32_t rate;                        ///< in Scene::rates
  const ModelRanger* ranger;            ///< of the prototype
  const ModelRanger::Sensor* settings;  ///< of the prototype
  uint32_t index;                       ///< in the ranger
  double reach;                         ///< m
  double z;                             ///< m, of the rays
  RangeNoise noise;                     ///< in worlds whose noise does not vary
  RangeDefects defects;
  bool exact;
  bool noisy, turns_noisily;  ///< readings have errors, in some worlds if their noise varies
  bool needed;         ///< its readings change a step: they have noise, or a controller reads them
  double increment;    ///< rad
  uint64_t name_hash;  ///< see Model::NoiseSeed()
  uint32_t first_ray, rays;  ///< among those of a world
  uint32_t first_direction;  ///< in Scene::directions
  internal::grid::LayerIndex layer;
  uint32_t seen;                 ///< index in Scene::seen
  std::vector<uint32_t> others;  ///< bodies of other robots that its rays may hit
};

/// Walls in contacts of outlines: some that are the same in all worlds, followed by those of a
/// mover that stands wherever its world places it.
struct WallPart {
  motion::Walls walls;
  uint32_t mover;  ///< Mover::kNoRow: none follows
};

/// A tree of models that moves as a whole: a robot, a thing that robots push, or one that is only
/// placed. A tree that stands but has sensors is one, too.
struct Mover {
  static constexpr uint32_t kNoRow = UINT32_MAX;
  const Model* model;          ///< of the prototype
  const ModelPosition* robot;  ///< the same model; null: a thing
  bool runs;                   ///< a robot with subscribers; others neither drive nor sense
  uint32_t rate = 0;           ///< in Scene::rates, if it runs
  uint32_t sensed_at = ~0u;    ///< groups of rates, as bits, in whose updates its pose is sensed
  double z;                    ///< m
  std::vector<Node> nodes;
  uint32_t first_body, body_count;
  DriveInput drive;  ///< what does not change
  DriveFunction function;
  MoverProperties properties;  ///< in worlds whose properties do not vary
  double load;                 ///< kg, what it carries
  bool has_odometry;           ///< localization "odom", and the robot runs
  bool has_noisy_odometry;     ///< in some worlds, if its noise varies
  bool errors_given, steers;
  bool is_omni;
  bool obeys_velocity;  ///< makes a command of velocity as it is, within velocity bounds
  uint32_t pack;   ///< in Scene::packs, if it stops when this is empty; otherwise Consumer::kNone
  bool is_pushed;  ///< a thing that can be pushed
  uint32_t row;    ///< in the columns of contacts of outlines; kNoRow: it stands
  double bottom;   ///< m, of its outline for contacts, above the pose
  bool is_wall = false;  ///< it stands at the same place in all worlds, and is among Scene::walls
  bool has_origin;       ///< localization_origin
  Pose origin;

  /// The global pose of a node while the robot is at `pose`, and the frame of its bodies. `P` is a
  /// class of poses.
  template <class P>
  P GlobalPoseOf(uint32_t node, const P& pose) const {
    return node == 0 ? pose : GlobalPoseOf(nodes[node].parent, pose) + nodes[node].local;
  }
  template <class P>
  P FrameOf(uint32_t node, const P& pose) const {
    return GlobalPoseOf(node, pose) + nodes[node].frame;
  }
};

/// A power pack of a model of a mover.
struct Pack {
  const Model* model;     ///< of the prototype
  const PowerPack* pack;  ///< of that model
};

/// A running model that draws energy, in the order of drawing.
struct Consumer {
  static constexpr uint32_t kNone = UINT32_MAX;
  uint32_t pack;
  uint32_t mover;  ///< the robot whose power it is; kNone: `watts`
  double watts;
};

struct Scene {
  /// The world that the scene was made from, in its state after loading.
  std::unique_ptr<World> prototype;
  std::shared_ptr<const InitialState> initial_state;

  double cells_per_metre = 50;
  usec_t step = 0;            ///< duration of a step, microseconds
  bool narrow = true;         ///< all outlines are narrow
  bool outlines = true;       ///< contacts of outlines, otherwise of cells
  std::vector<Mover> movers;  ///< in the order of creation
  std::vector<Body> bodies;
  std::vector<Sensor> sensors;
  Finders finders;
  Controls controls;
  bool exact = false;                                       ///< some rays are of the exact model
  bool needs_rays = false;                                  ///< some sensors are needed
  uint32_t ray_count = 0, byte_count = 0, point_count = 0;  ///< of a world
  std::vector<double> brightness;                           ///< values of ranger_return; 0: nothing
  std::vector<Pack> packs;
  std::vector<Consumer> consumers;
  std::vector<RateGroup> rates;  ///< by interval; at least one, which may have no models
  std::vector<Varied> varied;    ///< numbers that differ between worlds
  bool varies_movers = false, varies_noise = false;  ///< some of movers, of sensors that run

  // If the file has populations.
  std::shared_ptr<const PopulationPlan> populations;  ///< otherwise null
  internal::grid::CellBox extent_of_others;           ///< extent of the grid without members

  // Everything that stands.
  internal::grid::Grid grid;
  std::vector<CellMap> blocked;  ///< obstacles in the height of a body
  std::vector<CellMap> seen;     ///< bodies in the layer of a sensor
  internal::sensing::DirectionTables directions;
  motion::Shapes shapes;
  motion::Walls walls;
  std::vector<WallPart> wall_parts;  ///< if worlds place walls: all walls, in their order
  motion::Columns columns;           ///< of the robots
  uint64_t map_version = 0;          ///< number of changes of what stands, see ChangingMap

  /// A seed with which the members of populations fit.
  uint64_t SomeSeed() const { return prototype->seed(); }
  bool HasNoise() const { return std::ranges::any_of(sensors, &Sensor::noisy); }
  bool HasOneRate() const { return rates.size() == 1; }
  bool IsIdle() const { return rates[0].models.empty(); }
  /// The number of the mover with this model as its root; none: there is no such mover.
  std::optional<uint32_t> FindMover(uint32_t model) const {
    const auto found = std::ranges::lower_bound(
        movers, model, {}, [](const Mover& mover) { return mover.model->GetId(); });
    if (found == movers.end() || found->model->GetId() != model) return std::nullopt;
    return static_cast<uint32_t>(found - movers.begin());
  }
  /// The group of a running model of the prototype.
  uint32_t RateOf(const Model& model) const {
    const auto group = std::ranges::find_if(rates, [&](const RateGroup& known) {
      return known.models[0]->GetUpdateInterval() == model.GetUpdateInterval();
    });
    STAGE_ASSERT(group != rates.end());
    return static_cast<uint32_t>(group - rates.begin());
  }
};

}  // namespace Stg::rows

#endif
