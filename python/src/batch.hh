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
#include <functional>
#include <memory>
#include <string>
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
  Batch(std::shared_ptr<Simulation> prototype, const std::vector<uint64_t>& seeds,
        unsigned threads);
  ~Batch() override;

  const std::shared_ptr<Crowd>& crowd() { return crowd_; }
  /// To be called once it is held by a shared pointer, with the robots' numbers.
  void MakeCrowd(const std::vector<uint32_t>& robots);

  /// So many steps of these worlds, those that have failed or ended aside.
  void Step(const Indices& which, uint64_t steps);
  /// What is written down after some steps: the rows of a live array.
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

  size_t size() const { return worlds_.size(); }
  /// That each world was loaded with last.
  const std::vector<uint64_t>& seeds() const { return seeds_; }
  unsigned threads() const { return pool_.threads(); }
  /// Why the world has failed; empty: it has not.
  const std::string& failure(size_t index) const { return failures_[index]; }

  bool is_open() const override { return true; }
  World* WorldAt(size_t index) const override;
  Model* Find(size_t index, const ModelKey& key) const override;

 private:
  void Load(size_t index);
  bool StepWorld(size_t index, uint64_t steps);
  void Fail(size_t index, const std::string& why);
  /// Calls f(index) for these worlds on all threads; what one throws is its failure.
  template <typename F>
  void ForEach(const Indices& which, F f);
  /// Goes through rounds of work(index, first, count) for these worlds until `count` things are
  /// done, each of so many steps.
  template <typename F>
  void InRounds(const Indices& which, uint64_t count, uint64_t steps, F work);
  /// Of these worlds, those that still make steps.
  size_t CountGoing(const Indices& which) const;
  Indices All() const;
  World& WorldOf(uint32_t index) const;

  const std::shared_ptr<Simulation> prototype_;
  const std::shared_ptr<const WorldImage> image_;
  RunOptions options_;
  std::vector<World*> worlds_;
  std::vector<uint64_t> seeds_;
  std::vector<std::string> failures_;
  threads::WorkerPool pool_;
  std::shared_ptr<Crowd> crowd_;
  double step_seconds_ =
      0;  // that a step of a world has taken lately, all threads together; 0: unknown
};

}  // namespace Stg::python

#endif
