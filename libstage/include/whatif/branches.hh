// SPDX-License-Identifier: GPL-2.0-or-later
//
// Branches: what a world would come to, many times over. Part of <stage.hh>.

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

/// What a position is told in a branch; the same as ModelPosition's functions of that name.
struct Command {
  enum Kind { kSetSpeed, kGoTo, kSetAcceleration, kStop };

  uint64_t step;   ///< before which step of the branch, the first one being 0
  uint32_t model;  ///< its number: Model::GetId()
  Kind kind;
  double x, y, a;

  Command(uint64_t before_step, uint32_t to, Kind what, double to_x = 0, double to_y = 0,
          double to_a = 0)
      : step(before_step), model(to), kind(what), x(to_x), y(to_y), a(to_a) {}
};

/// Where a model was after a step, and what it was doing.
struct Sighting {
  Pose pose;          ///< global
  Velocity velocity;  ///< of positions: that in force, so the command that was applied; else 0
  bool stalled;
};

/// What one wants of branches. Its functions are called by several threads at once, for different
/// branches, each with a world of its own: they may use that world and what belongs to that branch.
class Scenario {
 public:
  virtual ~Scenario() {}
  /// Before each step, after the commands: for whatever commands can't say.
  virtual void BeforeStep(World& world, uint32_t branch);
  /// After each step: may change the score. True: the branch ends here.
  virtual bool AfterStep(World& world, uint32_t branch, double* score);
};

struct BranchOptions {
  unsigned threads;  ///< that work on branches, each with a world; 0: one for each processor
  /// Between two calls of Branches::Step(). With lean ones the readings of rangers are empty when
  /// Scenario::BeforeStep() is called for the first time in a call.
  Snapshot::Keep keep;
  std::vector<uint32_t> watched;  ///< numbers of models: of these there are sightings
  bool device;                    ///< worlds use the OpenCL device of the prototype, if it has one

  BranchOptions() : threads(1), keep(Snapshot::kFull), device(false) {}
};

/// What has become of a branch.
struct Branch {
  enum Fate {
    kAlive,
    kEnded,    ///< Scenario::AfterStep() said so, or something in it has asked its world to quit
    kRetired,  ///< nobody wants to know any more
    kFailed    ///< see error
  };
  Fate fate;
  uint64_t steps;  ///< since it was restored
  double score;
  std::string error;                ///< one line
  std::vector<Command> commands;    ///< by step; those of the same step in the order of giving
  std::vector<Sighting> sightings;  ///< after each step, of each watched model

  Branch() : fate(kRetired), steps(0), score(0) {}
};

/// Many branches of a world. A branch is a row of bytes; a few worlds, one for each thread, serve
/// them all. What becomes of a branch depends on its state, seed and commands alone: not on the
/// number of branches or threads, nor on what other branches do.
///
/// Controllers run in branches as they do in their world. One that asks World::IsBranch() can tell.
class Branches {
 public:
  /// Of a world that has been loaded; it may move on afterwards, or be deleted. All branches are
  /// retired at first.
  Branches(const World& prototype, uint32_t count, const BranchOptions& options = BranchOptions());
  ~Branches();
  Branches(const Branches&) = delete;
  Branches& operator=(const Branches&) = delete;

  /// Not, if the world can't be copied, or the memory doesn't suffice; a message says why.
  bool IsReady() const;
  uint32_t count() const;
  /// That work on them.
  unsigned threads() const;
  /// More branches, which are retired at first, or fewer.
  void Resize(uint32_t count);
  const Branch& operator[](uint32_t branch) const;

  /// A branch begins at a snapshot of the prototype: alive, with the score 0, and without commands.
  void Restore(uint32_t branch, const Snapshot& from);
  /// The same, with other random numbers from there on; see World::Reseed().
  void Restore(uint32_t branch, const Snapshot& from, uint64_t seed);
  /// For a step that is still to come; others are left out.
  void Give(uint32_t branch, const Command& command);
  void Retire(uint32_t branch);

  /// So many steps of all branches that are alive.
  void Step(uint64_t steps, Scenario* scenario = NULL);
  /// Shows a branch as a world, which may be changed, and stepped: it goes on from there. False if
  /// the branch has failed, or was never restored.
  bool Visit(uint32_t branch, const std::function<void(World&)>& visit);
  /// Its state now. Empty if it has failed, or was never restored.
  Snapshot StateOf(uint32_t branch) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace Stg

#endif
