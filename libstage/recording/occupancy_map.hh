// SPDX-License-Identifier: GPL-2.0-or-later
//
// Maps the scenery of a world.

#ifndef STAGE_RECORDING_OCCUPANCY_MAP_HH
#define STAGE_RECORDING_OCCUPANCY_MAP_HH

#include <cstdint>
#include <optional>
#include <vector>

#include "models/model.hh"
#include "recording/ros_messages.hh"

namespace Stg::recording {

/// The bodies of a world that stand still: not those of robots, of models that can be pushed and of
/// objects that grippers can take, nor anything that these carry.
class Scenery {
 public:
  /// With `height`, the scenery is what a lidar at that height in metres sees. Otherwise it is all
  /// that obstructs robots or is visible to rangers at any height.
  Scenery(const std::vector<Model*>& models, std::optional<double> height);

  /// Smallest upright rectangle around all bodies, and whole pictures with their margins; empty
  /// (the maximum below the minimum) without bodies.
  const Bounds& x() const { return x_; }
  const Bounds& y() const { return y_; }

  /// Marks all cells of `map` that a body overlaps. Its size, resolution and origin must be set. A
  /// hole in a picture stays free. A single outline around a robot is a fence: only the cells that
  /// it passes through are marked.
  void Draw(OccupancyMap* map) const;

  /// Returns a number that changes, in all likelihood, when the scenery does.
  uint64_t Fingerprint() const;

 private:
  using Outline = std::vector<point_t>;  // in global coordinates
  /// Outlines of a model at one height.
  struct Body {
    std::vector<Outline> outlines;
    bool is_fence;
  };
  void Add(const Model& model, std::optional<double> height);
  void Widen(const point_t& corner);

  std::vector<point_t> robots_;
  std::vector<Body> bodies_;
  Bounds x_, y_;
};

/// Returns a map of the scenery at all heights. `cell` is the wanted cell size in metres; it is
/// doubled until there are at most four million cells. The map is empty if there is no scenery.
OccupancyMap MakeOccupancyMap(const std::vector<Model*>& models, double cell);

}  // namespace Stg::recording

#endif
