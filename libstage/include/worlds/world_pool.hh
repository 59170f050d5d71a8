// SPDX-License-Identifier: GPL-2.0-or-later
//
// WorldPool: many worlds of one scene, side by side. Part of <stage.hh>.

#ifndef STAGE_WORLDS_WORLD_POOL_HH
#define STAGE_WORLDS_WORLD_POOL_HH

#include <stddef.h>
#include <stdint.h>

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "world/snapshot.hh"

namespace Stg {

class World;

struct WorldPoolOptions {
  unsigned
      threads;  ///< threads that work on the worlds, the caller's included; 0: one per processor
  bool device;  ///< the worlds share the prototype's OpenCL device, if it has one
  bool branch;  ///< World::IsBranch() is true for the worlds, and they end only on request
  /// Whole steps of closed worlds are made on an OpenCL device. It needs doubles, and passes a test
  /// when it is opened.
  bool device_steps;
  std::string device_choice;  ///< which device makes them, as after --opencl=; "": the best one
  /// Names of models on the ground that stand, and that Place() moves without World objects. Each
  /// may stand elsewhere in each world.
  std::vector<std::string> placed;
  /// Name of a model that stands, and whose picture a belief changes; "": there is none. See
  /// BeliefEngine.
  std::string changing_map;

  WorldPoolOptions() : threads(1), device(true), branch(false), device_steps(false) {}
};

/// Interface by which a client takes part in WorldPool::Step(). Several threads call it at once for
/// different worlds; a call may only use its own world and data of its own. If a call throws, its
/// world has failed.
class StepObserver {
 public:
  /// The outcome of a round for one world.
  enum Outcome {
    kMadeAllSteps,
    kHasEnded,  ///< it was asked to quit, and makes no further steps
    kHasFailed
  };

  virtual ~StepObserver() {}
  /// False: BeforeStep() and AfterStep() need not be called, so that a device can make several
  /// steps at once.
  virtual bool TakesPartInSteps() const;
  /// Called before each step of a world. `step` counts from 0 in each call of Step().
  virtual void BeforeStep(uint32_t id, uint64_t step);
  /// Called after each step.
  virtual void AfterStep(uint32_t id, uint64_t step);
  /// Number of steps from `step` on that a closed world without controllers may make at once: with
  /// one call of BeforeStep(), before the first, and one of AfterStep(), after the last. Then no
  /// rays are cast for readings that nobody sees. The default is 1.
  virtual uint64_t StepsAtOnce(uint32_t id, uint64_t step);
  /// Called after the last step of a world in a round that consists of the steps `first` to
  /// `end` - 1.
  virtual void AfterRound(uint32_t id, uint64_t first, uint64_t end, Outcome outcome);
  /// Called by the thread that called Step(), between rounds: all worlds have made the same number
  /// of steps. An exception ends Step().
  virtual void BetweenRounds();
};

/// Many worlds, which are copies of a prototype, each with its own seed. A pool may have several
/// prototypes, its variants, such as worlds with other floor plans, settings or numbers of robots.
/// A world is a number, its id, from 0 to size() - 1. The result of a
/// world depends only on its seed and on what is done with it, not on the number of worlds or
/// threads or on other worlds.
///
/// World objects are made only where they are needed. A world is closed if all its models are of
/// types that can be stepped without objects, and if nobody calls back. A closed world takes about
/// a kilobyte, and its steps are several times as fast, with equal bits. WhyNotClosed() tells the
/// reason why a world is not closed.
///
/// Functions with ids work on these worlds, each of which must be listed once, on all threads of
/// the pool. Only one thread may call functions of a pool at a time.
///
/// An error, such as an exception of a controller, concerns only its world, which has failed then:
/// it makes no steps until it is reset or restored. Failure() gives the reason in one line.
class WorldPool {
 public:
  typedef std::vector<uint32_t> Ids;

  /// Creates one world per seed. The prototype must be loaded, and may be stepped, changed or
  /// deleted afterwards: the worlds are as it was after loading, except for the seeds. They use one
  /// thread each, and ignore the quit time of the world file.
  WorldPool(const World& prototype, const std::vector<uint64_t>& seeds,
            const WorldPoolOptions& options = WorldPoolOptions());
  /// Creates worlds of several variants: that of world i is a copy of prototypes[variants[i]], or
  /// of the first one if `variants` is shorter.
  WorldPool(const std::vector<const World*>& prototypes, const std::vector<uint64_t>& seeds,
            const std::vector<uint32_t>& variants,
            const WorldPoolOptions& options = WorldPoolOptions());
  /// Creates other worlds of the same prototypes, with the same options. Those that `other` has as
  /// well are of the same variants there.
  WorldPool(const WorldPool& other, const std::vector<uint64_t>& seeds);
  ~WorldPool();
  WorldPool(const WorldPool&) = delete;
  WorldPool& operator=(const WorldPool&) = delete;

  /// False if the prototype cannot be copied, or there is no device as wanted; a message gives the
  /// reason.
  bool IsReady() const;
  uint32_t size() const;
  unsigned threads() const;
  /// The ids of all worlds.
  Ids All() const;
  /// Changes the number of worlds to seeds.size(). New worlds get the seeds at their ids, and are
  /// of the first variant; the others stay as they are and keep their seeds.
  void Resize(const std::vector<uint64_t>& seeds);

  /// The number of prototypes.
  uint32_t CountVariants() const;
  /// The number of the prototype of a world.
  uint32_t Variant(uint32_t id) const;
  /// Gives a variant that no world is of another prototype, or adds a variant if `variant` is
  /// CountVariants(). Resets then make worlds of it. Returns false with a message, and changes
  /// nothing, if a world is of this variant, if there is no such number, or if the prototype cannot
  /// be copied.
  bool SetPrototype(uint32_t variant, const World& prototype);

  /// Seed of the last load or reset of each world.
  const std::vector<uint64_t>& seeds() const;
  /// Why the world has failed, or "".
  const std::string& Failure(uint32_t id) const;
  /// Makes the world fail for this reason; if it is "", the world has not failed any more.
  void SetFailure(uint32_t id, const std::string& why);
  /// How often the world was made: a change means that there is another World object, perhaps at
  /// the same address.
  uint64_t times_made(uint32_t id) const;

  /// The World object, made if this has not been done yet. Returns null if it has been deleted by a
  /// controller or cannot be made; in the latter case it has failed. It stays valid until the world
  /// is deleted by a controller, or reset, restored, released or made again; client code may change
  /// it as it may change any World between steps, but must not delete it. Several threads may call
  /// it for different worlds.
  World* At(uint32_t id);
  /// Like At(), but also makes a world again that was deleted or unloaded by a controller.
  World* AtOrMake(uint32_t id);
  /// Makes worlds now, instead of when they are first needed.
  void Make(const Ids& ids);
  /// Gives up the World objects of these worlds: those that are closed go on without them.
  void Release(const Ids& ids);
  /// Calls look(world) with the World object, or with a temporary one in the same state. Returns
  /// false, without a call, if the world does not exist. Several threads must not call it at once.
  bool Look(uint32_t id, const std::function<void(World& world)>& look);
  /// Subscribes to a model, unless it has subscribers. Several threads may call it for different
  /// worlds. A reset ends the subscription.
  void Subscribe(uint32_t id, uint32_t model);
  /// Moves a model on the ground to another place, metres and radians, without a collision test.
  /// Closed worlds stay so if it is a robot, can be pushed, or is one of WorldPoolOptions::placed.
  /// Returns false if there is no such model, or if a number is not finite. A reset ends it.
  /// Several threads may call it for different worlds.
  bool Place(uint32_t id, uint32_t model, double x, double y, double heading);
  /// Why the world needs a World object, in words that follow "because"; empty if it needs none.
  std::string WhyNotClosed(uint32_t id) const;
  /// Name of the device that makes whole steps; empty if there is none.
  std::string StepDevice() const;
  /// Why that device cannot step the world, in words that follow "because"; empty if it can. Worlds
  /// that it cannot step are stepped on the host, with equal results.
  std::string WhyNotOnDevice(uint32_t id) const;

  /// Makes `steps` steps of these worlds, except for those that have failed. Those that are asked
  /// to quit have ended and make no further steps. A round takes about 50 ms and at least `unit`
  /// steps; its number of steps is a multiple of `unit`, except perhaps that of the last one.
  void Step(const Ids& ids, uint64_t steps, StepObserver* observer = NULL, uint64_t unit = 1);
  /// Resets these worlds, each to the state after loading with its new seed. Takes about as long as
  /// Restore(). A world that is not closed is made again if loading it depends on the seed or on
  /// code of clients, as with populations or controllers.
  void Reset(const Ids& ids, const std::vector<uint64_t>& seeds);
  /// Does the same, and makes each a world of another variant.
  void Reset(const Ids& ids, const std::vector<uint64_t>& seeds,
             const std::vector<uint32_t>& variants);
  /// Restores a snapshot in each of these worlds; see World::Restore(). A world that the snapshot
  /// does not fit has failed. That of another variant fits if the file of this one has all its
  /// models; the world keeps its variant.
  void Restore(const Ids& ids, const Snapshot& from);
  /// Takes a snapshot of a world; see World::Take(). Returns false with a message, also if there is
  /// no such world.
  bool Take(uint32_t id, Snapshot* to, Snapshot::Keep keep = Snapshot::kFull);
  /// State hash of each of these worlds; 0 if it does not exist.
  std::vector<uint64_t> StateHashes(const Ids& ids);

  /// Calls call(id) for each of these worlds. An exception makes the world fail.
  void ForEach(const Ids& ids, const std::function<void(uint32_t id)>& call);
  /// Calls job(index, thread) for each index below `count`, where thread < threads(). Rethrows the
  /// exception of the first index that threw.
  void Run(size_t count, const std::function<void(size_t index, unsigned thread)>& job);

 private:
  friend class PoolAccess;
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace Stg

#endif
