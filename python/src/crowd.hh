// SPDX-License-Identifier: GPL-2.0-or-later
//
// Arrays of the state and the readings of the robots of one or several worlds. Each array is
// created on demand and updated once after each step. NumPy views keep its memory alive.

#ifndef STAGE_PYTHON_CROWD_HH
#define STAGE_PYTHON_CROWD_HH

#include <nanobind/nanobind.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "array.hh"
#include "row_crowd.hh"
#include "source.hh"

namespace Stg {
class ModelPosition;
class ModelRadio;
}  // namespace Stg

namespace Stg::python {

/// The robots of one world; null for a robot that is gone.
struct Members {
  World* world = nullptr;
  uint64_t topology_version = 0;  ///< the world's counter of topology changes at the last lookup
  uint64_t times_made = 0;        ///< WorldPool::times_made() at the last lookup
  std::vector<ModelPosition*> robots;
};

/// A group of arrays that are filled together, such as all arrays of one sensor.
class ArrayGroup {
 public:
  virtual ~ArrayGroup() = default;
  /// Called when the members of a world have changed: looks up the sensors again.
  virtual void Find(size_t /*world*/, const Members&) {}
  /// Called before the arrays of a world are filled, on one thread; it may change the world.
  virtual void Prepare(size_t /*world*/, const Members&) {}
  /// Fills the rows of robots [begin, end) of a world. Several threads may call it at the same time
  /// with disjoint ranges.
  virtual void Fill(size_t world, const Members& members, size_t begin, size_t end) = 0;
  /// How the arrays are filled from rows. Several threads may call it and FillFromRow() at the same
  /// time for different worlds.
  virtual const RowPlan& PlanFor(const RowRobots& robots) = 0;
  virtual void FillFromRow(size_t world, const RowOfCrowd& row) = 0;
  /// Why the arrays have no room for these robots, in words that follow "because"; empty if they
  /// have.
  virtual std::string WhyNoRoom(const Members& /*members*/) const { return ""; }
  /// Forgets what was found out about scenes, before one of them is deleted.
  virtual void ForgetScenes() {}
};

class Crowd : public std::enable_shared_from_this<Crowd> {
 public:
  using Robots = std::vector<ModelKey>;

  /// `robots`: for each variant of the source's pool as many; those that it lacks are kNoRobot.
  /// `single`: arrays have no axis for the worlds.
  Crowd(std::weak_ptr<Source> source, std::vector<Robots> robots, size_t worlds, bool single);
  ~Crowd();

  static constexpr ModelKey kNoRobot{UINT32_MAX, 0};

  size_t size() const { return robots_[0].size(); }
  const std::vector<Robots>& robots() const { return robots_; }
  size_t worlds() const { return members_.size(); }

  // Each call creates and fills its array the first time. Shapes and units: see stagesim.Fleet.

  nb::object BodyArray(const std::string& name);  ///< "pose" and the like
  nb::object StalledArray();
  nb::object CommandArray();  ///< writable
  /// The array of a reading of sensor number `index` of a type, or of "time": see SensorArrays.
  nb::object SensorArray(const std::string& type, size_t index, size_t max_count,
                         const std::string& reading);
  /// One element per world: its time in seconds, and whether it has ended.
  nb::object TimeArray();
  nb::object EndedArray();

  // Only the source calls the functions below. They do not need the GIL, and several threads may
  // call them at the same time for different worlds.

  /// Updates the arrays of a world.
  void Gather(const Source& source, size_t world);
  /// Applies the commands in the array to the robots; called before each step.
  void Command(const Source& source, size_t world);
  /// Moves robots. `poses`: x, y (metres) and heading (radians) per robot. `which`: one flag per
  /// robot to move, or null for all.
  void Teleport(const Source& source, size_t world, const double* poses, const bool* which);
  /// The robots of a world, which must not be in a row; null for those that are gone.
  const std::vector<ModelPosition*>& RobotsOf(const Source& source, size_t world) {
    return MembersOf(&source, world).robots;
  }
  /// Radio number `index` of each of these robots; null for those that have none. Throws Failure if
  /// no robot has one.
  std::vector<ModelRadio*> RadiosOf(const Source& source, size_t world, size_t index);
  /// Replaces the commands of a world: 3 numbers per robot.
  void SetCommands(size_t world, const double* rows);
  /// Sets all commands of a world to 0.
  void ClearCommands(size_t world);

  /// Why the arrays have no room for the robots of `world`, with these ids, in words that follow
  /// "because"; empty if they have.
  std::string WhyNoRoom(const World& world, const Robots& robots) const;
  /// The robots of a variant, which may be the next one. No array may be in use meanwhile.
  void SetRobots(size_t variant, const Robots& robots);

  /// The robots in a scene of the source's rows, which belongs to a variant.
  const RowRobots& RobotsIn(const rows::Scene& scene, size_t variant = 0);

 private:
  class SourceLock;
  /// A NumPy view of the array, which keeps this crowd alive.
  nb::object View(const Array& array, bool writable = false);
  template <typename T, typename... Arguments>
  T& GroupOf(const Source& source, const std::string& name, Arguments... arguments);
  struct Named {
    std::string name;
    std::unique_ptr<ArrayGroup> group;
  };
  const Members& MembersOf(const Source* source, size_t world);
  std::vector<Members> Examples(const Source& source);
  void AddVariants(const WorldPool& pool, std::vector<std::shared_ptr<const World>>* worlds,
                   std::vector<Members>* examples) const;
  void FillGroup(const Source& source, ArrayGroup* group);
  static void FillGroup(ArrayGroup* group, size_t world, const Members& members);
  bool GatherRow(const Source& source, size_t world, std::span<const Named> groups);
  bool CommandRow(const Source& source, size_t world);
  bool TeleportRow(const Source& source, size_t world, const double* poses, const bool* which);

  const std::weak_ptr<Source> source_;
  std::vector<Robots> robots_;  // by variant
  const bool single_;
  std::vector<Members> members_;  // one entry per world
  std::vector<Named> groups_;
  ByScene<RowRobots> row_robots_;
  Array commands_;
};

}  // namespace Stg::python

#endif
