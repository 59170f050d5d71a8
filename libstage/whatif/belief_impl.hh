// SPDX-License-Identifier: GPL-2.0-or-later
//
// The content of a belief; part of belief.hh.

#ifndef STAGE_WHATIF_BELIEF_IMPL_HH
#define STAGE_WHATIF_BELIEF_IMPL_HH

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "whatif/belief.hh"
#include "world/world.hh"

namespace Stg {

namespace whatif {

/// The Cholesky factor of a covariance, a lower triangle.
struct CovarianceFactor {
  double values[6];  ///< l00, l10, l11, l20, l21, l22

  /// False if the matrix is not symmetric and positive semidefinite.
  bool Set(const Covariance& covariance);
};

struct BeliefContent {
  struct Moving {
    Pose pose;
    Velocity velocity;
    CovarianceFactor pose_errors, velocity_errors;

    /// False, after a message, if a number makes no sense. `whose` is for the message.
    bool Set(const Pose& pose, const Covariance& pose_covariance, const Velocity& velocity,
             const Covariance& velocity_covariance, const std::string& whose);
  };

  /// Name of a model that stands for the other with this number in the world of an engine.
  static std::string NameOf(size_t number) { return "belief.other" + std::to_string(number); }
  static constexpr char kMapName[] = "belief.map";
  bool HasGrid() const { return options.columns > 0; }
  /// True if the grid has an occupied cell at a point in the frame of the world file.
  bool IsOccupied(double x, double y) const;
  /// Makes the world that futures are simulated in, with room for `room` others, which are far
  /// away. Returns null, after a message, if it cannot be loaded.
  std::unique_ptr<World> MakeWorld(uint32_t room) const;
  /// Loads the text of a world, which may name the picture of the grid.
  std::unique_ptr<World> Load(const std::string& content) const;

  std::string MapText() const;
  // Numbers in the units of the file.
  std::string Metres(double value) const;
  std::string Radians(double value) const;

  Belief::Options options;
  std::string file, text, robot_name;
  double unit_length = 1, unit_angle = 1;  // of numbers in the file, m and rad
  bool ready = false;
  Moving robot;
  double delay = 0;
  uint32_t room = 0;
  std::vector<uint8_t> cells;        // of the grid, as SetGrid() has them
  uint64_t version_of_cells = 0;     // another one after each change
  std::vector<TrackedOther> others;  // in the order of their ids
  std::vector<Moving> moving;        // of the others
};

}  // namespace whatif

struct Belief::Impl : whatif::BeliefContent {};

}  // namespace Stg

#endif
