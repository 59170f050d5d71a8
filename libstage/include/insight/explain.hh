// SPDX-License-Identifier: GPL-2.0-or-later
//
// What a world consists of, what it leaves out because nobody asks for it, and what its steps will
// cost: World::Summary() and World::MeasureStepCosts() fill these in. Part of <stage.hh>; C++11.
//
// "A step" is an average one: a model with an update interval of two steps counts half.

#ifndef STAGE_INSIGHT_EXPLAIN_HH
#define STAGE_INSIGHT_EXPLAIN_HH

#include <stddef.h>
#include <stdint.h>

#include <string>
#include <vector>

#include "geometry/geometry.hh"

namespace Stg {

/// Sensors that are alike: of one type, with equally many rays or pixels, equally often due.
struct SensorKind {
  std::string type;
  std::string example;          ///< the name of the first of them
  bool subscribed = false;      ///< those that are not produce nothing and cost nothing
  size_t models = 0;            ///< of this kind; the numbers that follow are those of one of them
  size_t parts = 1;             ///< a ranger's sensors, a bumper's lines, a gripper's beams; or 1
  uint64_t rays = 0;            ///< in an update
  bool rays_vary = false;       ///< one ray for each target in reach, not known before: `rays` is 0
  uint64_t pixels = 0;          ///< of a camera's picture
  usec_t interval = 0;          ///< between updates
  double updates_per_step = 0;  ///< 1 at most; as if subscribed

  /// Of all of them together. Cameras cast none.
  double RaysPerStep() const {
    return static_cast<double>(models) * static_cast<double>(rays) * updates_per_step;
  }
};

/// Models of one type.
struct ModelKind {
  std::string type;
  size_t models = 0;
  size_t running = 0;  ///< of these: with a subscriber
};

/// A height that rangers look at, metres.
struct SensedHeight {
  double z = 0;
  size_t sensors = 0;        ///< that look there and have a subscriber
  size_t idle_sensors = 0;   ///< that look there and have none
  double rays_per_step = 0;  ///< of the former
  size_t blocks = 0;         ///< that reach this height and that rangers see
  size_t robots = 0;         ///< position models, with what they carry, that rangers see there
};

/// Bytes, counted from what there is; what the C++ library adds for itself is not counted.
struct MemoryCount {
  // There now.
  uint64_t grid = 0;    ///< cells, and the layers made so far
  uint64_t bodies = 0;  ///< polygons, and the lists of cells that they are drawn in
  uint64_t models = 0;  ///< the models themselves
  // Made in the first steps.
  uint64_t layers = 0;    ///< of the grid: one for each height that rangers look at
  uint64_t readings = 0;  ///< ranges, intensities and bearings of subscribed rangers
  uint64_t pictures = 0;  ///< of subscribed cameras; drawing takes more, see SensorCost
  uint64_t batch = 0;     ///< the fans of rays of a step, and the list of what is due
};

struct SceneSummary {
  // Models.
  std::vector<ModelKind> types;  ///< the most frequent first; without the ground
  size_t models = 0;
  size_t robots = 0;                ///< position models that somebody drives: with a subscriber
  size_t undriven = 0;              ///< position models without one: they stand
  size_t with_controller = 0;       ///< models
  double updates_per_step = 0;      ///< of all models
  double position_updates = 0;      ///< of position models, a step
  double callbacks_per_step = 0;    ///< model callbacks at updates, and world callbacks
  std::vector<SensorKind> sensors;  ///< subscribed ones first, most rays a step first

  // Bodies.
  size_t bodies = 0;             ///< models that have blocks
  size_t blocks = 0;             ///< polygons with a height interval
  size_t corners = 0;            ///< of all polygons
  Bounds body_heights;           ///< from the lowest to the highest, metres
  size_t hidden_blocks = 0;      ///< rangers look through them: a negative ranger_return
  size_t overlooked_blocks = 0;  ///< of the others: none of the sensed heights is theirs
  size_t unseen_bodies = 0;      ///< models with blocks, all of them hidden or overlooked
  std::vector<std::string> unseen_examples;  ///< the names of the first few of these
  std::vector<SensedHeight> heights;         ///< of rangers; the most rays first
  size_t exact_sensors = 0;  ///< subscribed, of rangers, whose rays go to the outlines themselves
  size_t looking_everywhere = 0;  ///< subscribed sensors of other types: they look at every body

  /// Likely mistakes: "FILE:LINE:COLUMN: ...", as the warnings when the world was loaded have them.
  std::vector<std::string> doubts;

  // The grid.
  double resolution = 0;                            ///< metres, the side of a cell
  bounds3d_t extent;                                ///< of what is drawn, in whole regions, metres
  uint64_t plane_cells = 0;                         ///< in the extent
  uint64_t occupied_cells = 0;                      ///< in which there is a body
  size_t superregions = 0, regions = 0, tiles = 0;  ///< made
  size_t layers = 0;         ///< that there will be: for everything, and for rangers
  size_t layer_heights = 0;  ///< of these: for one height alone; the last is for any other
  /// What arrays over the whole extent would take that hold what tiles and layers hold: 4 bytes a
  /// cell for who is there, and a bit a cell for each layer.
  uint64_t dense_bytes = 0;

  // The rest.
  size_t power_packs = 0;
  size_t energy_models = 0;  ///< that draw from packs each step
  bool records_trails = false;
  bool has_window = false;
  std::string device;            ///< of OpenCL; empty: none
  unsigned threads = 1;          ///< that a step may use
  bool chooses_threads = false;  ///< a step uses one or all of them, whichever is faster
  usec_t step = 0;               ///< simulated time
  MemoryCount memory;
};

/// What one kind of sensors costs. Times are nanoseconds of real time, the best of several tries.
struct SensorCost {
  size_t sample = 0;          ///< models that were measured; 0: none
  double update_ns = 0;       ///< an update of a model: gathering its rays, taking its picture
  double rays = 0;            ///< that an update cast
  double ray_ns = 0;          ///< a ray, from its start to the reading; with all threads
  double device_ray_ns = -1;  ///< the same with the OpenCL device; negative: not measured
  double read_ns = 0;         ///< of a ranger: looking at each reading of an update once
  /// Of the heap, that a model takes at its first update and keeps. 0: unknown, or it has it
  /// already.
  uint64_t kept_bytes = 0;
};

struct StepCosts {
  std::vector<SensorCost> sensors;  ///< in the order of SceneSummary::sensors
  double position_ns = 0;           ///< an update of a position model
  double move_ns = 0;               ///< a step of a robot that drives: test, erase, draw
  double energy_ns = 0;             ///< a model's share in the energy phase
  size_t position_sample = 0, move_sample = 0, energy_sample = 0;  ///< models; 0: not measured
  double device_bytes_per_ray = 0;                                 ///< fetched
  /// How many times as long as the best try the average one took: about 1 on a machine that has
  /// nothing else to do.
  double busy = 1;
  uint64_t rays = 0;   ///< traced in all
  double seconds = 0;  ///< that measuring took
};

}  // namespace Stg

#endif
