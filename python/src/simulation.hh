// SPDX-License-Identifier: GPL-2.0-or-later
//
// A world, as Python has it.

#ifndef STAGE_PYTHON_SIMULATION_HH
#define STAGE_PYTHON_SIMULATION_HH

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "source.hh"
#include "stage.hh"
#include "world/beginning.hh"
#include "world/world_handle.hh"

namespace Stg::python {

class Crowd;

/// All of its functions throw Failure. Those that may take long release the GIL; one at a time.
class Simulation : public Source, public std::enable_shared_from_this<Simulation> {
 public:
  /// Not listed: it shares nothing with other worlds.
  explicit Simulation(const RunOptions& options);
  ~Simulation() override;

  void LoadFile(const std::string& path);
  /// As if it were in the file of that path.
  void LoadText(const std::string& text, const std::string& path);
  void Close();

  /// Returns how many steps were made: fewer if a controller wants the world to quit.
  uint64_t Step(uint64_t steps);
  void Reset(uint64_t seed);
  Snapshot Take(bool lean);
  void Restore(const Snapshot& from);
  /// Another world in the same state.
  std::shared_ptr<Simulation> Fork();
  static std::shared_ptr<Simulation> CopyOf(const World& world);
  uint64_t StateHash();

  /// From now on the crowd's arrays follow this world.
  void Follow(const std::shared_ptr<Crowd>& crowd);
  /// Brings them up to date: after whatever may have changed the world.
  void Refresh();

  /// Throws if it is gone.
  World& world() const;
  /// Calls f(world), which may change it, with the GIL.
  template <typename F>
  auto With(F f) {
    const Use use(this);
    return f(world());
  }
  ModelKey KeyOf(const Model& model) const { return {model.GetId(), resets_}; }
  /// That the world file gives; 0: none. Steps go on past it.
  usec_t quit_time() const { return quit_time_; }

  bool is_open() const override { return WorldAt(0) != nullptr; }
  World* WorldAt(size_t index) const override;
  Model* Find(size_t index, const ModelKey& key) const override;
  void LetGo(Crowd* crowd) noexcept override;

 private:
  void Load(const std::function<bool(World&)>& load, const std::string& what);
  void Settle();
  bool StepOnce();
  void Command();

  void LoadAgain(uint64_t seed);

  WorldHandle world_;  // null: closed, or deleted by a controller
  bool closed_ = false;
  std::shared_ptr<const WorldBeginning>
      beginning_;  // what Reset() goes back to, if that is possible
  bool looked_for_beginning_ = false;
  uint32_t loaded_models_ = 0;
  uint32_t resets_ = 0;
  usec_t quit_time_ = 0;
  std::vector<std::weak_ptr<Crowd>> crowds_;
};

}  // namespace Stg::python

#endif
