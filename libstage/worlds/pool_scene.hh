// SPDX-License-Identifier: GPL-2.0-or-later
//
// The worlds of one or several pools share their scene: how worlds are made, the state to which
// they are reset, and the scenes of their rows.

#ifndef STAGE_WORLDS_POOL_SCENE_HH
#define STAGE_WORLDS_POOL_SCENE_HH

#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "random/fnv1a.hh"
#include "rows/changing_map.hh"
#include "rows/scene.hh"
#include "rows/varied.hh"
#include "world/copy_source.hh"
#include "world/world.hh"
#include "worlds/world_pool.hh"

namespace Stg {

/// Thrown to make a world fail for this reason.
struct WorldFailure {
  std::string why;
};

class PoolScene;

/// The models that clients have subscribed to since loading, in this order. Worlds with the same
/// subscriptions have the same scene.
class Subscriptions {
 public:
  static constexpr unsigned kMost = 64;  ///< of a pool that have scenes

  Subscriptions(PoolScene* source, std::vector<uint32_t> models)
      : source_(*source), models_(std::move(models)) {}
  ~Subscriptions();

  const std::vector<uint32_t>& models() const { return models_; }
  /// Number of the scene, which counts from 0 in the order of creation.
  unsigned number() const { return number_; }
  bool Has(uint32_t model) const;
  /// These and one more. Several threads may call it at once.
  Subscriptions* With(uint32_t model);
  /// The scene of the rows of worlds that were loaded and then subscribed to; null if such worlds
  /// are not closed. The first call makes it. Several threads may call it at once.
  const std::shared_ptr<const rows::Scene>& scene() {
    if (!has_tried_.load(std::memory_order_acquire))
      std::call_once(scene_once_, [this] {
        MakeScene();
        has_tried_.store(true, std::memory_order_release);
      });
    return scene_;
  }
  /// The map of the scene that changes, see WorldPoolOptions; null if there is none.
  rows::ChangingMap* map() { return scene() ? map_.get() : nullptr; }
  /// Why there is no scene, in words that follow "because".
  const std::string& reason();

 private:
  struct Child {
    uint32_t model;
    Subscriptions* with;
    Child* next;
  };
  Subscriptions* Find(uint32_t model) const;
  void MakeScene();

  PoolScene& source_;
  const std::vector<uint32_t> models_;
  unsigned number_ = kMost;
  std::atomic<Child*> children_{nullptr};
  std::once_flag scene_once_;
  std::atomic<bool> has_tried_{false};  // read in each step, faster than the flag before
  std::shared_ptr<const rows::Scene> scene_;
  std::unique_ptr<rows::ChangingMap> map_;
  std::string reason_;
};

class PoolScene {
 public:
  /// `varied`: numbers of which each world may have its own, see RowBridge::CanVary().
  PoolScene(const World& prototype, const WorldPoolOptions& options,
            std::vector<rows::VariedNumber> varied = {});

  bool IsReady() const { return !source_.empty(); }
  const WorldPoolOptions& pool_options() const { return pool_options_; }
  const std::vector<rows::VariedNumber>& varied() const { return varied_; }
  /// Makes a world. Throws WorldFailure. Several threads may call it at once.
  std::unique_ptr<World> Make(uint64_t seed) const;
  /// Makes a world with the seed of the prototype.
  std::unique_ptr<World> Make() const { return Make(options_.seed); }
  /// Lends a world in any state, which is never stepped, until GiveBack(). Throws WorldFailure.
  /// Several threads may call both at once.
  std::unique_ptr<World> Borrow();
  void GiveBack(std::unique_ptr<World> world);
  /// The state to which worlds are reset; null if they must be made again. The first caller finds
  /// it out, in a world of its own.
  const InitialState* initial_state();

  /// The subscriptions of a world that has just been loaded: none.
  Subscriptions* loaded() { return loaded_; }
  /// True if worlds can be rows as long as clients do nothing that prevents it.
  bool has_rows() { return IsReady() && loaded()->scene() != nullptr; }
  /// Why they cannot, in words that follow "because".
  std::string WhyNoRows();
  bool IsRunningAfterLoading(uint32_t model);
  /// Hash of the texts of the files that worlds are loaded from, if has_rows().
  uint64_t HashOfFiles();
  /// The subscriptions of a world, or null if it is not closed.
  Subscriptions* SubscriptionsOf(const World& world);

 private:
  friend class Subscriptions;
  Subscriptions* Add(std::vector<uint32_t> models);
  void NotePlaced(World* world) const;

  const CopySource source_;
  const WorldPoolOptions pool_options_;
  const std::vector<rows::VariedNumber> varied_;
  RunOptions options_;
  std::once_flag initial_state_once_, hash_once_;
  uint64_t hash_of_files_ = kFnv1aStart;
  std::shared_ptr<const InitialState> initial_state_;
  std::mutex lending_;
  std::vector<std::unique_ptr<World>> spares_;
  std::mutex mutex_;
  std::vector<std::unique_ptr<Subscriptions>> all_;  // guarded by mutex_
  std::atomic<unsigned> scenes_{0};                  // number of those asked for
  Subscriptions* const loaded_;                      // the first one
};

/// A world of the scene that is never stepped, for a short while.
class SpareWorld {
 public:
  explicit SpareWorld(PoolScene* of) : of_(*of), world_(of->Borrow()) {}
  ~SpareWorld() { of_.GiveBack(std::move(world_)); }
  SpareWorld(const SpareWorld&) = delete;
  SpareWorld& operator=(const SpareWorld&) = delete;

  World* get() const { return world_.get(); }

 private:
  PoolScene& of_;
  std::unique_ptr<World> world_;
};

}  // namespace Stg

#endif
