// SPDX-License-Identifier: GPL-2.0-or-later
//
// The content of a belief; part of belief.hh.

#ifndef STAGE_WHATIF_BELIEF_IMPL_HH
#define STAGE_WHATIF_BELIEF_IMPL_HH

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
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

  /// Others whose models are equal: of one kind and with one controller.
  struct Group {
    uint32_t kind;
    std::string controller;  ///< property `ctrl`; empty for those whom rules move
    uint32_t room, used;     ///< others that it has room for, and that have such a hypothesis

    /// True for the group of the kind that there is from the start.
    bool is_first() const { return controller == kBehaviours; }
  };

  /// Name of a model that stands for an other in the world of an engine. `number`: in the order of
  /// groups.
  static std::string NameOf(size_t number) { return "belief.other" + std::to_string(number); }
  static constexpr char kBehaviours[] = "stage/behaviour";
  static constexpr char kMapName[] = "belief.map";
  bool HasGrid() const { return options.columns > 0; }
  double RadiusOf(size_t other) const { return options.kinds[others[other].kind].radius; }
  /// The property `ctrl` of those who behave so; empty: rules move them.
  static std::string_view ControllerOf(const Behaviour& behaviour);
  /// Index of the group of somebody of this kind with this behaviour; groups.size() if there is
  /// none.
  size_t GroupOf(uint32_t kind, const Behaviour& behaviour) const;
  /// Calls f(group) for each group that somebody needs, once.
  template <typename F>
  void ForEachGroup(const TrackedOther& other, F f) const;
  /// The cells that count, see Belief::Options::others_clear_cells and ClearCells().
  const std::vector<uint8_t>& cells_that_count() const {
    return options.others_clear_cells ? cleared_cells : cells;
  }
  /// Frees the cells near others, if the options say so.
  void ClearCells();
  /// True if the grid has an occupied cell at a point in the frame of the world file.
  bool IsOccupied(double x, double y) const;
  /// Makes groups that somebody needs. Returns false, after a message, if that is impossible.
  bool AddGroups(const TrackedOther& other);
  /// Counts somebody as a member of its groups, or no more, and makes room for it.
  void Count(const TrackedOther& other, bool joins);
  /// Makes the world that futures are simulated in, with room for these groups, who are far away.
  /// Returns null, after a message, if it cannot be loaded.
  std::unique_ptr<World> MakeWorld(const std::vector<Group>& with) const;
  /// Loads the text of a world, which may name the picture of the grid.
  std::unique_ptr<World> Load(const std::string& content) const;

  std::string TextOf(const Group& group, size_t first) const;
  std::string MapText() const;
  void ToCells(double x, double y, double* column, double* row) const;
  // Numbers in the units of the file.
  std::string Metres(double value) const;
  std::string Radians(double value) const;

  Belief::Options options;
  std::string file, text, robot_name;
  double unit_length = 1, unit_angle = 1;  // of numbers in the file, m and rad
  bool ready = false;
  Moving robot;
  double delay = 0;
  std::vector<uint8_t> cells;          // of the grid, as SetGrid() has them
  std::vector<uint8_t> cleared_cells;  // without those near others
  uint64_t version_of_cells = 0;       // another one after each change
  std::vector<Group> groups;           // the first are those that are there from the start, by kind
  uint64_t version_of_groups = 0;      // another one after each change of room, or of being used
  std::vector<TrackedOther> others;    // in the order of their ids
  std::vector<Moving> moving;          // of the others
};

template <typename F>
void BeliefContent::ForEachGroup(const TrackedOther& other, F f) const {
  static const Behaviour goes_on;
  const size_t count = other.behaviours.size();
  if (count == 0) return f(GroupOf(other.kind, goes_on));
  for (size_t i = 0; i < count; i++) {
    const size_t group = GroupOf(other.kind, other.behaviours[i]);
    bool is_new = true;
    for (size_t k = 0; k < i; k++)
      if (GroupOf(other.kind, other.behaviours[k]) == group) is_new = false;
    if (is_new) f(group);
  }
}

}  // namespace whatif

struct Belief::Impl : whatif::BeliefContent {
  Impl(const std::string& world_file, const std::string& name, const Options& wanted);
};

}  // namespace Stg

#endif
