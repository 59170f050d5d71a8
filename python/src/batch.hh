// SPDX-License-Identifier: GPL-2.0-or-later
//
// Many worlds of the same file, with arrays of all their robots.
//
// Each is a world of its own that stays what it is between two calls. The rows of Branches take
// less memory, but each call would bring every row into a world and take it out again, which costs
// about as much as a step or two does, and robots learn by calls of few steps. Copies of a world
// share its scenery, so they are small, too.

#ifndef STAGE_PYTHON_BATCH_HH
#define STAGE_PYTHON_BATCH_HH

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "crowd.hh"
#include "simulation.hh"
#include "source.hh"
#include "threads/worker_pool.hh"

namespace Stg::python {

class Batch : public Source, public std::enable_shared_from_this<Batch> {
 public:
  using Indices = std::vector<uint32_t>;

  /// One world for each seed, as if it had been loaded with that seed. `threads`: 1 or more.
  Batch(Simulation* prototype, const std::vector<uint64_t>& seeds, unsigned threads);
  /// Worlds of the same file as those of another batch, each as if it had just been loaded.
  Batch(Batch* other, const std::vector<uint64_t>& seeds);
  ~Batch() override;

  const std::shared_ptr<Crowd>& crowd() { return crowd_; }
  /// To be called once it is held by a shared pointer, with the robots' numbers.
  void MakeCrowd(const std::vector<uint32_t>& robots);

  /// Makes so many steps of these worlds. Those that have failed or ended stay where they are.
  void Step(const Indices& which, uint64_t steps);
  /// A live array whose rows are written down after some steps.
  struct Record {
    const char* live;  ///< bytes_per_world bytes of each world, one after the other
    char* to;          ///< the same for each moment, one after the other
    size_t bytes_per_world;
  };
  /// For each of `moments` moments: takes that moment's commands, makes some steps, writes down.
  void Rollout(const double* commands, size_t moments, uint64_t steps,
               const std::vector<Record>& records);
  /// Begins anew, each with its seed.
  void Reset(const Indices& which, const std::vector<uint64_t>& seeds);
  void Restore(const Indices& which, const Snapshot& from);
  Snapshot Take(uint32_t index);
  std::vector<uint64_t> StateHashes();
  std::shared_ptr<Simulation> Fork(uint32_t index);
  void Teleport(const double* poses, const bool* which);
  /// Calls f(world) with the GIL.
  template <typename F>
  auto With(uint32_t index, F f) {
    const Use use(this);
    return f(WorldOf(index));
  }

  size_t size() const { return worlds_.size(); }
  unsigned threads() const { return pool_.threads(); }
  /// That each world was loaded with last.
  std::vector<uint64_t> Seeds();
  /// The worlds that have failed, by number, and why.
  std::map<uint32_t, std::string> Failures();
  /// These worlds make no more steps until they are reset or restored.
  void SetFailures(const std::map<uint32_t, std::string>& failures);
  /// Metrics by name, in the order in which they are met: a value for each world, not a number
  /// where it has none.
  using Metrics = std::vector<std::pair<std::string, std::vector<double>>>;
  Metrics MetricsOfAll();

  bool is_open() const override { return true; }
  World* WorldAt(size_t index) const override;
  Model* Find(size_t index, const ModelKey& key) const override;

 private:
  struct Origin;  // what worlds are made from
  Batch(Origin origin, const std::vector<uint64_t>& seeds, unsigned threads);
  static Origin OriginOf(Simulation* prototype);
  static Origin OriginOf(Batch* other);
  void Load(size_t index);
  void BeginAgain(size_t index);
  void FindBeginning(const Indices& which);
  bool StepWorld(size_t index, uint64_t steps);
  void Fail(size_t index, const std::string& why);
  /// Calls f(index, thread) for these worlds on all threads; what one throws is its failure.
  template <typename F>
  void ForEach(const Indices& which, F f);
  /// Goes through rounds of work(index, first, count) for these worlds until `count` things are
  /// done, each of so many steps. It returns whether the world has made them all.
  template <typename F>
  void InRounds(const Indices& which, uint64_t count, uint64_t steps, F work);
  void NoteStepSeconds(double seconds, uint64_t steps);
  Indices All() const;
  World& WorldOf(uint32_t index) const;

  const std::shared_ptr<const WorldImage> image_;
  const RunOptions options_;
  const std::shared_ptr<const World> device_;        // never loaded: it lends worlds its device
  std::shared_ptr<const WorldBeginning> beginning_;  // of all worlds; null: they have to be loaded
  bool looked_for_beginning_ = false;
  std::vector<WorldHandle> worlds_;
  std::vector<uint64_t> seeds_;
  std::vector<std::string> failures_;
  threads::WorkerPool pool_;
  struct alignas(64) Tally {  // a cache line of its own, as its thread writes to it
    size_t going = 0;
  };
  std::vector<Tally> tallies_;  // of each thread: worlds that have made all steps asked for
  std::shared_ptr<Crowd> crowd_;
  double step_seconds_ =
      0;  // that a step of a world has taken lately, all threads together; 0: unknown
};

}  // namespace Stg::python

#endif
