// SPDX-License-Identifier: GPL-2.0-or-later
//
// Branches: many alternative futures of a world, simulated in parallel. Part of <stage.hh>.

#ifndef STAGE_WHATIF_BRANCHES_HH
#define STAGE_WHATIF_BRANCHES_HH

#include <stddef.h>
#include <stdint.h>

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "geometry/geometry.hh"
#include "world/snapshot.hh"

namespace Stg {

class World;

/// A command to a position model in a branch: a call of its function of that name.
///
/// A branch fails with a reason if nobody would obey the command. There is no such model, it is no
/// position, or it has no subscribers and is not told to stand. A number is NaN, a goal is not
/// finite, or a car is told something else than a velocity. A batch controller drives the robot, or
/// another controller gives it another command before each of its models has been updated once.
struct Command {
  enum Kind { kSetSpeed, kGoTo, kSetAcceleration, kStop };

  uint64_t step;   ///< step of the branch before which the command applies; the first is 0
  uint32_t model;  ///< Model::GetId() of the position
  Kind kind;
  double x, y, a;

  Command(uint64_t before_step, uint32_t to, Kind what, double to_x = 0, double to_y = 0,
          double to_a = 0)
      : step(before_step), model(to), kind(what), x(to_x), y(to_y), a(to_a) {}
};

/// Pose, velocity and stall state of a watched model after a step.
struct Sighting {
  Pose pose;          ///< global
  Velocity velocity;  ///< of positions: the commanded velocity in force; otherwise 0
  bool stalled;
};

/// Interface by which a client controls and scores branches. Several threads call it at once for
/// different branches. A call may only use its own world and data of its own branch.
///
/// A scenario that overrides Watch() alone, and NeedsWorld() to return false, makes branches of
/// closed worlds several times as fast: they need no World objects. See Branches::WhyNotClosed().
class Scenario {
 public:
  virtual ~Scenario() {}
  /// True if BeforeStep() and AfterStep() are to be called, which is the default.
  virtual bool NeedsWorld() const;
  /// Called before each step, after the commands, for changes that commands cannot express.
  virtual void BeforeStep(World& world, uint32_t branch);
  /// Called after each step. May change the score. Returns true to end the branch.
  virtual bool AfterStep(World& world, uint32_t branch, double* score);
  /// Called after each step and AfterStep(), with the sightings of the step: one for each of
  /// BranchOptions::watched. May change the score. Returns true to end the branch.
  virtual bool Watch(const Sighting* watched, uint32_t branch, double* score);
};

struct BranchOptions {
  unsigned threads;  ///< worker threads, each with a world; 0: one per processor
  /// Kind of snapshot kept between calls of Branches::Step(). With lean ones, rangers have no
  /// readings at the first Scenario::BeforeStep() of each call.
  Snapshot::Keep keep;
  std::vector<uint32_t> watched;  ///< ids of models that are recorded as sightings
  bool device;                    ///< worlds use the prototype's OpenCL device, if any
  bool rows;  ///< branches of closed worlds need no World objects; false: all have one, for
              ///< comparison
  /// Whole steps of closed worlds are made on an OpenCL device, see WorldPoolOptions, if the
  /// scenario needs no World. If the device fails, the host repeats what it has lost.
  bool device_steps;
  std::string device_choice;  ///< see WorldPoolOptions
  std::string changing_map;   ///< see WorldPoolOptions

  BranchOptions()
      : threads(1), keep(Snapshot::kFull), device(false), rows(true), device_steps(false) {}
};

/// The result of a branch so far.
struct Branch {
  enum State {
    kAlive,
    kEnded,    ///< Scenario::AfterStep() returned true, or the world was asked to quit
    kRetired,  ///< stopped by the client
    kFailed    ///< see `error`
  };
  typedef State Fate [[deprecated("use State")]];
  State state;
  uint64_t steps;  ///< number of steps since the branch was restored
  double score;
  std::string error;                ///< one line
  bool refused;                     ///< it has failed because of a command; see Command
  std::vector<Command> commands;    ///< sorted by step; within a step in the order given
  std::vector<Sighting> sightings;  ///< for each step, one per watched model

  Branch() : state(kRetired), steps(0), score(0), refused(false) {}
};

/// Many alternative futures ("branches") of a world. The result of a branch depends only on its
/// state, seed and commands, not on the number of branches or threads or on other branches.
///
/// A branch of a closed world, see WorldPool, takes about a kilobyte and its readings, and is
/// stepped without a World object. Others are stored as snapshots, and a few worlds, one per
/// thread, step them. So are those of a scenario that needs a World, and those whose state a closed
/// world cannot have. Both ways have equal results.
///
/// Controllers run in branches as in the prototype; they can check World::IsBranch().
class Branches {
 public:
  /// Copies a loaded world, which may be stepped or deleted afterwards. All branches start retired.
  Branches(const World& prototype, uint32_t count, const BranchOptions& options = BranchOptions());
  ~Branches();
  Branches(const Branches&) = delete;
  Branches& operator=(const Branches&) = delete;

  /// False if the world cannot be copied, memory does not suffice, or there is no device as wanted;
  /// a message gives the reason.
  bool IsReady() const;
  uint32_t count() const;
  /// Number of worker threads.
  unsigned threads() const;
  /// Why branches need World objects whatever the scenario, in words that follow "because"; empty
  /// if they do not.
  std::string WhyNotClosed() const;
  /// Number of steps that were made without a World object, since the beginning.
  uint64_t steps_in_rows() const;
  /// Name of the device that makes whole steps; empty if there is none, or if it has failed.
  std::string StepDevice() const;
  /// Why that device cannot step branches, in words that follow "because"; empty if it can. The
  /// host steps them then, with equal results.
  std::string WhyNotOnDevice() const;
  /// Number of steps in rows that were made on the device.
  uint64_t steps_on_device() const;
  /// Changes the number of branches. New branches start retired.
  void Resize(uint32_t count);
  const Branch& operator[](uint32_t branch) const;

  /// Starts a branch from a snapshot of the prototype: alive, with score 0 and no commands.
  void Restore(uint32_t branch, const Snapshot& from);
  /// Like Restore(branch, from), but with a new random seed; see World::Reseed().
  void Restore(uint32_t branch, const Snapshot& from, uint64_t seed);
  /// Adds a command. The branch fails if that step has already been done.
  void Give(uint32_t branch, const Command& command);
  void Retire(uint32_t branch);

  /// Advances all branches that are alive by `steps` steps.
  void Step(uint64_t steps, Scenario* scenario = NULL);
  /// Calls visit() with a world in the state of the branch. Changes and steps made there become
  /// part of the branch. Returns false if the branch has failed or was never restored.
  bool Visit(uint32_t branch, const std::function<void(World&)>& visit);
  /// Current state of the branch. Empty if it has failed or was never restored.
  Snapshot StateOf(uint32_t branch) const;

 private:
  friend class BranchAccess;
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace Stg

#endif
