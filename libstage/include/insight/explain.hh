// SPDX-License-Identifier: GPL-2.0-or-later
//
// Describes the contents of a world, which sensors are idle, and what its steps cost. Part of
// <stage.hh>; C++11.
//
// Values per step are averages: a model that updates every second step counts half.

#ifndef STAGE_INSIGHT_EXPLAIN_HH
#define STAGE_INSIGHT_EXPLAIN_HH

#include <stddef.h>
#include <stdint.h>

#include <string>
#include <vector>

#include "geometry/geometry.hh"

namespace Stg {

class World;

/// Sensors of the same type, number of rays or pixels, and update interval.
struct SensorKind {
  std::string type;
  std::string example;      ///< name of the first one
  bool subscribed = false;  ///< sensors without subscribers produce and cost nothing
  size_t models = 0;        ///< number of such sensors; the other fields describe one of them
  size_t parts = 1;   ///< sensors of a ranger, lines of a bumper, beams of a gripper; otherwise 1
  uint64_t rays = 0;  ///< per update
  bool rays_vary = false;       ///< one ray per target in reach, unknown in advance: `rays` is 0
  uint64_t pixels = 0;          ///< of a camera's picture
  usec_t interval = 0;          ///< between updates
  double updates_per_step = 0;  ///< at most 1; counted as if subscribed

  /// Rays per step of all these sensors. Cameras cast none.
  double RaysPerStep() const {
    return static_cast<double>(models) * static_cast<double>(rays) * updates_per_step;
  }
};

/// Models of one type.
struct ModelKind {
  std::string type;
  size_t models = 0;
  size_t running = 0;  ///< of these, models with a subscriber
};

/// A height at which rangers look, in metres.
struct SensedHeight {
  double z = 0;
  size_t sensors = 0;        ///< sensors at this height with a subscriber
  size_t idle_sensors = 0;   ///< sensors at this height without one
  double rays_per_step = 0;  ///< of the sensors with a subscriber
  size_t blocks = 0;         ///< blocks at this height that rangers see
  size_t robots = 0;         ///< robots that rangers see at this height, including what they carry
};

/// Estimated memory in bytes. The overhead of the C++ library is not counted.
struct MemoryCount {
  // Memory in use now.
  uint64_t grid = 0;    ///< cells, and the layers created so far
  uint64_t bodies = 0;  ///< polygons, and lists of the cells that they occupy
  uint64_t models = 0;  ///< the models themselves
  // Memory allocated by the first steps.
  uint64_t layers = 0;    ///< grid layers: one per height at which rangers look
  uint64_t readings = 0;  ///< ranges, intensities and bearings of subscribed rangers
  uint64_t pictures = 0;  ///< of subscribed cameras; rendering takes more, see SensorCost
  uint64_t batch = 0;     ///< the fans of a step, and the list of due events
};

struct SceneSummary {
  // Models.
  std::vector<ModelKind> types;  ///< most frequent first; without the ground
  size_t models = 0;
  size_t robots = 0;                ///< position models with a subscriber
  size_t undriven = 0;              ///< position models without one: they stand still
  size_t with_controller = 0;       ///< models with a controller
  double updates_per_step = 0;      ///< of all models
  double position_updates = 0;      ///< of position models, per step
  double callbacks_per_step = 0;    ///< model callbacks at updates, and world callbacks
  std::vector<SensorKind> sensors;  ///< subscribed first, then by rays per step

  // Bodies.
  size_t bodies = 0;             ///< models that have blocks
  size_t blocks = 0;             ///< polygons with a height interval
  size_t corners = 0;            ///< vertices of all polygons
  Bounds body_heights;           ///< lowest bottom and highest top, metres
  size_t hidden_blocks = 0;      ///< invisible to rangers: negative ranger_return
  size_t overlooked_blocks = 0;  ///< visible to rangers, but at none of the sensed heights
  size_t unseen_bodies = 0;      ///< models with blocks, all of them hidden or overlooked
  std::vector<std::string> unseen_examples;  ///< names of the first few
  std::vector<SensedHeight> heights;         ///< sorted by rays per step, most first
  size_t exact_sensors = 0;                  ///< subscribed ranger sensors with the exact ray model
  size_t looking_everywhere = 0;  ///< subscribed sensors of other types; they see bodies at any
                                  ///< height

  /// Likely mistakes, "FILE:LINE:COLUMN: ...", as in the warnings given when the world was loaded.
  std::vector<std::string> load_warnings;

  // The grid.
  double resolution = 0;        ///< cell size, metres
  bounds3d_t extent;            ///< of everything rasterized, rounded to whole regions, metres
  uint64_t plane_cells = 0;     ///< number of cells in the extent
  uint64_t occupied_cells = 0;  ///< cells with at least one body
  size_t superregions = 0, regions = 0, tiles = 0;  ///< number allocated
  size_t layers = 0;         ///< needed: one for everything, the rest for rangers
  size_t layer_heights = 0;  ///< layers for a single height; one more serves all other heights
  /// Bytes that dense arrays over the extent would take: 4 bytes per cell for its bodies, and one
  /// bit per cell and layer.
  uint64_t dense_bytes = 0;

  // Settings.
  size_t power_packs = 0;
  size_t energy_models = 0;  ///< models that draw energy from packs each step
  size_t fields = 0;         ///< fields that spread or evaporate
  double field_cells = 0;    ///< cells of these fields that are updated, per step
  bool records_trails = false;
  bool has_window = false;
  std::string device;            ///< OpenCL device; empty: none
  unsigned threads = 1;          ///< maximum number used in a step
  bool chooses_threads = false;  ///< each step uses one thread or all, whichever is faster
  usec_t step = 0;               ///< simulated time of a step
  MemoryCount memory;
};

/// Costs of one kind of sensor. Times are nanoseconds of real time, the best of several tries.
struct SensorCost {
  size_t sample = 0;          ///< number of models measured; 0: none
  double update_ns = 0;       ///< per model: gathering its rays, rendering its picture
  double rays = 0;            ///< cast by an update
  double ray_ns = 0;          ///< time per ray, from start to reading, with all threads
  double device_ray_ns = -1;  ///< time per ray with the OpenCL device; negative: not measured
  double read_ns = 0;         ///< reading all ranges of a ranger once
  /// Heap memory that a model allocates at its first update and keeps. 0: unknown or already
  /// allocated.
  uint64_t kept_bytes = 0;
};

struct StepCosts {
  std::vector<SensorCost> sensors;  ///< in the order of SceneSummary::sensors
  double position_ns = 0;           ///< update of a position model
  double move_ns = 0;               ///< step of a moving robot: collision test, erase, rasterize
  double energy_ns = 0;             ///< energy phase, per model
  double field_cell_ns = 0;         ///< update of a cell of a field, with its substeps
  size_t position_sample = 0, move_sample = 0, energy_sample = 0;  ///< models measured; 0: none
  size_t field_sample = 0;                                         ///< cells measured; 0: none
  double device_bytes_per_ray = 0;                                 ///< fetched from the device
  /// Ratio of the average to the best time. About 1 on an otherwise idle machine.
  double busy = 1;
  uint64_t rays = 0;   ///< total number of rays traced
  double seconds = 0;  ///< spent on measuring
};

SceneSummary Summarize(const World& world);

constexpr double kMeasuringSeconds = 0.3;

/// Measures the costs of the parts of a step on samples of the models for about `seconds`. Call it
/// between steps. No callback is called. Afterwards all state is restored: poses, readings, random
/// numbers, clock, statistics. Only the pictures of cameras change until their next update.
StepCosts MeasureStepCosts(World& world, double seconds = kMeasuringSeconds);

}  // namespace Stg

#endif
