// SPDX-License-Identifier: GPL-2.0-or-later
//
// Arrays of what the robots of one or several worlds do and sense. They are filled in once after
// each step, and only those that somebody has asked for. Memory belongs to the arrays: who still
// has one may look at it whatever has become of the robots and their world.

#ifndef STAGE_PYTHON_CROWD_HH
#define STAGE_PYTHON_CROWD_HH

#include <nanobind/nanobind.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "array.hh"
#include "source.hh"

namespace Stg {
class ModelPosition;
}

namespace Stg::python {

/// The robots of one world, as they are now: null where one is gone.
struct Members {
  World* world = nullptr;
  uint64_t family_changes = 0;  ///< that it was looked for at
  std::vector<ModelPosition*> robots;
};

/// What is filled in together: about bodies, or about the sensors of one kind.
class Part {
 public:
  virtual ~Part() = default;
  /// What it reads of these members is to be found anew.
  virtual void Find(size_t /*world*/, const Members&) {}
  /// Before a world's arrays are filled in; may change the world.
  virtual void GetReady(size_t /*world*/) {}
  /// Fills in the rows of the robots from `begin` to `end` - 1 of that world. Different ones may be
  /// filled in by different threads at once.
  virtual void Fill(size_t world, const Members& members, size_t begin, size_t end) = 0;
};

class Crowd : public std::enable_shared_from_this<Crowd> {
 public:
  /// `single`: arrays have no axis for the worlds.
  Crowd(std::weak_ptr<Source> source, std::vector<ModelKey> robots, size_t worlds, bool single);
  ~Crowd();

  size_t size() const { return robots_.size(); }
  const std::vector<ModelKey>& robots() const { return robots_; }
  size_t worlds() const { return members_.size(); }

  // Each of these is made, and filled in, when it is wanted first.

  nb::object PoseArray();
  nb::object VelocityArray();
  nb::object EstimateArray();
  nb::object EstimatedVelocityArray();
  nb::object ActualVelocityArray();
  nb::object SensedPoseArray();
  nb::object SensedTimeArray();
  nb::object StalledArray();
  nb::object EnergyArray();
  nb::object CommandArray();  ///< may be written
  nb::object RangerArray(size_t ranger, const std::string& what);
  nb::object FiducialArray(size_t finder, size_t most, const std::string& what);
  nb::object BlobArray(size_t finder, size_t most, const std::string& what);
  nb::object BumperArray(size_t bumper);
  nb::object CameraArray(size_t camera, const std::string& what);
  /// One number for each world: its time in seconds, or whether it has ended.
  nb::object TimeArray();
  nb::object EndedArray();

  /// To be called when a world is another one: it may lie where the former one lay.
  void Forget(size_t world) { members_[world].world = nullptr; }
  // The source calls these itself. They need no GIL; different threads may do so for different
  // worlds at once.

  /// Brings the arrays of a world up to date.
  void Gather(const Source& source, size_t world);
  /// Gives the robots the commands that stand in the array, before a step.
  void Command(const Source& source, size_t world);
  /// Moves the robots to these poses: x, y, heading for each.
  void Teleport(const Source& source, size_t world, const double* poses, const bool* which);
  /// Three numbers for each robot.
  void SetCommands(size_t world, const double* rows);
  /// Forgets the commands: all are 0.
  void ClearCommands(size_t world);

 private:
  class Hold;
  /// The array as NumPy has it; the crowd lives as long as that does.
  nb::object View(const Array& array, bool writable = false);
  template <typename T>
  nb::object BodyArray(const char* name, size_t width,
                       void (*fill)(const ModelPosition* robot, T* row), bool runs = false);
  template <typename T, typename... Arguments>
  T& PartOf(const Source& source, const std::string& name, Arguments... arguments);
  const Members& Renew(const Source* source, size_t world);
  void GatherPart(const Source& source, Part* part);
  static void GatherPart(Part* part, size_t world, const Members& members);

  struct Named {
    std::string name;
    std::unique_ptr<Part> part;
  };
  const std::weak_ptr<Source> source_;
  const std::vector<ModelKey> robots_;
  const bool single_;
  std::vector<Members> members_;  // of each world
  std::vector<Named> parts_;
  Array commands_;
};

}  // namespace Stg::python

#endif
