// SPDX-License-Identifier: GPL-2.0-or-later

#ifndef STAGE_WORLD_POPULATE_HH
#define STAGE_WORLD_POPULATE_HH

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "geometry/free_floor.hh"
#include "models/model.hh"

namespace Stg {

/// Everything but the seed that decides where the members of a file's populations are placed.
struct PopulationPlan {
  struct Member {
    uint32_t model;  ///< id
    double radius;   ///< m
  };
  struct Group {
    std::string name;
    int entity;  ///< negative: the population is of a setting
    std::vector<Member> members;
    bounds3d_t area;
    double gap = 0;                ///< m
    std::optional<uint64_t> seed;  ///< null: that of the run
  };
  std::vector<Group> groups;
  double largest = 0, gap = 0;  ///< m, of all members and groups
  std::shared_ptr<const geometry::FreeFloor> floor;

  using Put = std::function<void(uint32_t model, const point_t& place, double heading)>;
  /// Calls put() for each member. Returns the group whose members do not fit, after so many of them
  /// have been placed; otherwise null.
  const Group* Place(uint64_t seed, const Put& put, size_t* placed) const;
  /// True if the model is a member of a group.
  bool Has(uint32_t model) const {
    return std::ranges::any_of(groups, [&](const Group& group) {
      return std::ranges::find(group.members, model, &Member::model) != group.members.end();
    });
  }
};

/// The message for a group of which only so many members could be placed.
std::string NoRoomFor(const PopulationPlan::Group& group, size_t placed);

/// Places the members of the file's populations on free floor. Call it when all models of the file
/// exist and none is rasterized. `made` has the model of each entity, or null. `cell` is the cell
/// size in metres. `floor` is the free floor of an earlier world of the same file; if null, it is
/// computed. Returns null if there are no populations. Throws LoadError if there is not enough free
/// floor.
std::shared_ptr<const PopulationPlan> PlacePopulations(
    const std::vector<Model*>& models, const std::vector<Model*>& made, Worldfile* file,
    double cell, uint64_t seed, std::shared_ptr<const geometry::FreeFloor> floor);

}  // namespace Stg

#endif
