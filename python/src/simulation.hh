// SPDX-License-Identifier: GPL-2.0-or-later
//
// The world behind stagesim.World.

#ifndef STAGE_PYTHON_SIMULATION_HH
#define STAGE_PYTHON_SIMULATION_HH

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "source.hh"
#include "stage.hh"
#include "world/initial_state.hh"
#include "world/world_handle.hh"

namespace Stg::python {

class Crowd;

/// All functions throw Failure on errors, also if another thread is using the world. Long calls
/// release the GIL.
class Simulation : public Source, public std::enable_shared_from_this<Simulation> {
 public:
  /// Creates a world that is not in the global list of worlds, so that it is independent of others.
  explicit Simulation(std::unique_ptr<World> world);
  ~Simulation() override;

  void LoadFile(const std::string& path);
  /// Loads a world from `text`, as if it were the contents of the file `path`.
  void LoadText(const std::string& text, const std::string& path);
  void Close();

  /// Returns the number of steps made; it is less than `steps` if a controller asks to quit.
  uint64_t Step(uint64_t steps);
  void Reset(uint64_t seed);
  Snapshot Take(bool lean);
  void Restore(const Snapshot& from);
  /// A new world in the same state.
  std::shared_ptr<Simulation> Fork();
  static std::shared_ptr<Simulation> CopyOf(const World& world);
  uint64_t StateHash();

  /// Registers a crowd, whose arrays are then updated with this world.
  void Register(const std::shared_ptr<Crowd>& crowd);
  /// Updates the arrays of all crowds. Call it after every change of the world.
  void Refresh();

  /// The world. Throws Failure if it has been closed or deleted.
  World& world() const;
  /// Calls f(world), which may change the world, with the GIL held.
  template <typename F>
  auto With(F f) {
    const Use use(this);
    return f(world());
  }
  ModelKey KeyOf(const Model& model) const { return {model.GetId(), resets_}; }
  /// The quit time in the world file; 0: none. Step() ignores it.
  usec_t quit_time() const { return quit_time_; }

  bool is_open() const override { return WorldAt(0) != nullptr; }
  World* WorldAt(size_t index) const override;
  Model* Find(size_t index, const ModelKey& key) const override;
  void OnCrowdDestroyed(Crowd* crowd) noexcept override;

 private:
  void Load(const std::function<bool(World&)>& load, const std::string& what);
  void FinishLoading();
  bool StepOnce();
  void Command();

  void Reload(uint64_t seed);

  WorldHandle world_;  // null: closed, or deleted by a controller
  bool closed_ = false;
  std::shared_ptr<const InitialState>
      initial_state_;  // initial state for Reset(); null: load again
  bool tried_initial_state_ = false;
  uint32_t loaded_models_ = 0;
  uint32_t resets_ = 0;
  usec_t quit_time_ = 0;
  std::vector<std::weak_ptr<Crowd>> crowds_;
};

}  // namespace Stg::python

#endif
