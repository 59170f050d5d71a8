// SPDX-License-Identifier: GPL-2.0-or-later
//
// Many worlds of the same file, with arrays of all their robots: a pool of worlds for Python.
//
// Closed worlds are rows of the pool; the arrays are filled from the columns. Other worlds have
// World objects.

#ifndef STAGE_PYTHON_BATCH_HH
#define STAGE_PYTHON_BATCH_HH

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "crowd.hh"
#include "device_crowd.hh"
#include "recording/recorder.hh"
#include "rows/varied.hh"
#include "simulation.hh"
#include "source.hh"
#include "world/ray_caster.hh"
#include "worlds/world_pool.hh"

namespace Stg::python {

class BatchLog;

class Batch : public Source, public std::enable_shared_from_this<Batch> {
 public:
  using Indices = WorldPool::Ids;

  /// Creates one world per seed, each as if loaded with that seed, and like one of the prototypes,
  /// which `variants` numbers for each world. `threads` is 1 or more. `device` chooses the OpenCL
  /// device that makes whole steps; none: the host makes them. `placed` are names, see
  /// WorldPoolOptions; so is `branch`. Throws Failure if a world cannot be created, or if there is
  /// no such device.
  Batch(const std::vector<Simulation*>& prototypes, const std::vector<uint64_t>& seeds,
        const std::vector<uint32_t>& variants, unsigned threads,
        const std::optional<std::string>& device, const std::vector<std::string>& placed,
        bool branch);
  /// Creates newly loaded worlds of the same file as those of `other`.
  Batch(Batch* other, const std::vector<uint64_t>& seeds);

  const std::shared_ptr<Crowd>& crowd() { return crowd_; }
  /// The arrays of a batch on a device; otherwise null.
  const std::shared_ptr<DeviceCrowd>& device_crowd() { return device_crowd_; }
  /// Name of the device that makes whole steps, or "".
  std::string device() const { return pool_->StepDevice(); }
  /// Creates the arrays of these robots. Call it once, after the batch is owned by a shared_ptr.
  /// `shares_scene`: all worlds share a scene, so that a device may have their arrays.
  void MakeCrowd(const std::vector<Crowd::Robots>& robots, bool shares_scene);

  /// Makes the world of a prototype, with these robots, the variant with this number, which is the
  /// next one or has no worlds. Throws Failure if the arrays have no room for its robots. `varied`:
  /// numbers of which each world may have its own.
  void SetPrototype(uint32_t variant, Simulation* prototype, const Crowd::Robots& robots,
                    const std::vector<rows::VariedNumber>& varied);

  /// Logs a world from now on, until the log is finished or deleted. Throws Failure.
  std::shared_ptr<BatchLog> StartLog(uint32_t index, const recording::LogOptions& options);
  /// Makes `steps` steps of these worlds; worlds that have failed or ended make none.
  void Step(const Indices& which, uint64_t steps);
  /// A live array that Rollout() records.
  struct Record {
    const char* live;  ///< the array: bytes_per_world bytes per world, contiguous
    char* to;          ///< the record: a copy of the array per moment, contiguous
    size_t bytes_per_world;
  };
  /// For each of `moments` moments: applies that moment's commands, makes `steps` steps, and copies
  /// the live arrays. `commands`: [moment][world][robot][3], or null to keep the current ones.
  /// `recorded`: [moment][world], all false; set to true where a world's arrays were copied. It
  /// stays false from the moment on at which a world fails.
  void Rollout(const double* commands, size_t moments, uint64_t steps,
               const std::vector<Record>& records, bool* recorded);
  /// Resets these worlds, each with its own seed, variant and values; none: with those that it has.
  /// Values need variants.
  void Reset(const Indices& which, const std::optional<std::vector<uint64_t>>& seeds,
             const std::optional<std::vector<uint32_t>>& variants,
             const std::optional<PoolAccess::OwnValues>& values);
  /// Makes all worlds, which are on a device, those of a variant in which more numbers vary; see
  /// PoolAccess::CarryToVariant().
  void CarryToVariant(uint32_t variant, const PoolAccess::OwnValues& values);
  /// The values of each world, and of one.
  std::vector<std::vector<double>> ValuesOfAll();
  std::vector<double> ValuesOf(uint32_t index);
  void Restore(const Indices& which, const Snapshot& from);
  /// See World::Reseed(); with a seed for each world.
  void Reseed(const std::vector<uint64_t>& seeds);
  Snapshot Take(uint32_t index);
  std::vector<uint64_t> StateHashes();
  /// See WorldStates, also for `keys`; throw Failure.
  size_t CountStateWords(const Indices& which, const std::vector<uint64_t>& keys);
  void SaveStates(const Indices& which, const std::vector<uint64_t>& keys, size_t width,
                  uint64_t* to);
  void LoadStates(const Indices& which, const std::vector<uint64_t>& keys, size_t width,
                  const uint64_t* from);
  std::shared_ptr<Simulation> Fork(uint32_t index);
  void Teleport(const double* poses, const bool* which);
  /// For each variant the ids of the models that are placed; none: it lacks the model.
  using PlacedIds = std::vector<std::vector<std::optional<uint32_t>>>;
  /// Moves these models. `poses`: [world][model][3], `which`: [world][model].
  void Place(const PlacedIds& models, const double* poses, const bool* which);
  /// Reads their places: [world][model][3]; NaN: there is no such model.
  void FindPlaces(const PlacedIds& models, double* poses);
  /// Rays from poses in worlds; see CastOptions. `ignored`: for each pose the number of a robot
  /// that its rays pass, or Casting::kNobody.
  struct Cast {
    CastOptions options;
    double range;
    std::vector<double> bearings;
    std::vector<uint32_t> ignored;
  };
  /// `poses`: [world][pose][3]; `ranges`: [world][pose][bearing], NaN: there is no such world.
  void CastRays(const Indices& which, const Cast& cast, const double* poses, double* ranges);
  /// The contacts of worlds, up to `most` of each: two models, their robots' numbers in the crowd,
  /// and point, normal and gap. Elements without a contact are left as they are.
  struct ContactArrays {
    size_t most;
    int64_t* models;  ///< [world][contact][2]
    int64_t* robots;  ///< the same; -1: it belongs to no robot
    double* numbers;  ///< [world][contact][5]
  };
  void FindContacts(const Indices& which, const ContactArrays& to);
  // Batches on a device that reads the memory of CUDA: like the functions above, with a flag for
  // each world or robot. ResetFlagged() returns false if the worlds need their seeds.
  bool ResetFlagged(const rows::RowInput& flags);
  void TeleportFlagged(const rows::RowInput& poses, const rows::RowInput& which);
  /// Calls f(world) with the GIL held.
  template <typename F>
  void With(uint32_t index, F f) {
    const Use use(this);
    Look(index, f);
  }

  size_t size() const { return pool_->size(); }
  unsigned threads() const { return pool_->threads(); }
  size_t variants() const { return pool_->CountVariants(); }
  /// The seed of each world's last load or reset.
  std::vector<uint64_t> Seeds();
  /// The variant of each world.
  std::vector<uint32_t> Variants();
  /// The reason for each failed world, by index.
  std::map<uint32_t, std::string> Failures();
  /// For each world what keeps it from being a row, or "".
  std::vector<std::string> Reasons();
  /// Number of worlds whose state is in a World object.
  size_t CountObjects();
  /// Marks worlds as failed: they make no steps until they are reset or restored.
  void SetFailures(const std::map<uint32_t, std::string>& failures);
  /// Metrics in order of first appearance: a name and one value per world; NaN: no value.
  using Metrics = std::vector<std::pair<std::string, std::vector<double>>>;
  Metrics MetricsOfAll();

  bool is_open() const override { return true; }
  World* WorldAt(size_t index) const override;
  Model* Find(size_t index, const ModelKey& key) const override;
  WorldPool* pool() const override { return pool_.get(); }

 private:
  class Stepper;
  class Recorder;
  class Gatherer;

  void MakeWorlds();
  void StepWorlds(const Indices& which, uint64_t steps);
  void StepLogged(const Indices& which, uint64_t steps);
  using Logs = std::vector<std::shared_ptr<BatchLog>>;
  Logs LogsOf(const Indices& which);
  void GiveCommands(const Logs& logs);
  void StepVariants(const Indices& which, uint64_t steps);
  void Gather(const Indices& which);
  void StoreContacts(uint32_t variant, const std::vector<ContactPoint>& contacts, size_t at,
                     const ContactArrays& to) const;
  int64_t NumberOfRobot(uint32_t variant, const Model& model) const;
  void CastInWorld(uint32_t id, World* world, const Cast& cast, const double* poses,
                   double* ranges) const;
  bool CastInRow(uint32_t id, const rows::Casting& casting, const Cast& cast, const double* poses,
                 double* ranges);
  void Look(uint32_t index, const std::function<void(World& world)>& look) const;

  const std::unique_ptr<WorldPool> pool_;
  std::shared_ptr<Crowd> crowd_;
  std::shared_ptr<DeviceCrowd> device_crowd_;
  std::vector<std::weak_ptr<BatchLog>> logs_;
};

}  // namespace Stg::python

#endif
