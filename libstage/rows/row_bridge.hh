// SPDX-License-Identifier: GPL-2.0-or-later
//
// The way between worlds and rows: makes the scene of a closed world, reads a row from a world, and
// writes a row into a world.

#ifndef STAGE_ROWS_ROW_BRIDGE_HH
#define STAGE_ROWS_ROW_BRIDGE_HH

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "models/fiducial.hh"
#include "rows/rows.hh"
#include "rows/scene.hh"

namespace Stg {

namespace rows {
struct StandingMap;
}

class RowBridge {
 public:
  /// Says what keeps a world from being closed, in words that follow "because"; empty if nothing
  /// does.
  static std::string WhyNotClosed(const World& world);
  /// Takes over a world that has just been loaded, with all subscriptions. Returns null and the
  /// reason if it is not closed.
  /// `varied`: numbers that differ between worlds, for each of which CanVary() is true.
  static std::shared_ptr<const rows::Scene> MakeScene(
      std::unique_ptr<World> prototype, std::string* reason,
      std::span<const rows::VariedNumber> varied = {}) {
    return MakeOwnScene(std::move(prototype), reason, varied);
  }
  /// Like MakeScene(), for a scene that its only owner changes.
  static std::shared_ptr<rows::Scene> MakeOwnScene(std::unique_ptr<World> prototype,
                                                   std::string* reason,
                                                   std::span<const rows::VariedNumber> varied);
  /// Finds the map of rows::ChangingMap in a world that has just been loaded. Returns what keeps
  /// the model from being one, in words that follow "because"; empty if nothing does.
  static std::string FindMap(World* world, const std::string& name, rows::StandingMap* map);

  // The following functions are in varied_bridge.cc.
  /// The property of world files with this name; kNone: rows cannot vary it.
  static rows::VariedProperty FindProperty(const std::string& name);
  /// True if rows can hold a number of a model of this world, which has just been loaded.
  static bool CanVary(const World& world, const rows::VariedNumber& number);
  /// Gives models of a world that has just been loaded other numbers, in the units of its file.
  static void Vary(std::span<const rows::VariedNumber> numbers, std::span<const double> given,
                   World* world);

  /// Reads the state after loading into row 0.
  static void ReadStart(rows::Rows* start);
  /// Reads the state of a world that was made from the same file as the scene. Returns false if the
  /// row cannot hold that state; the row is undefined then. `spare` is another such world, which is
  /// changed: the row is written into it, and the snapshots of both worlds must be equal. With
  /// kMayLack, the world may lack the readings that lean snapshots omit; the row then has undefined
  /// ones until the next step.
  enum Readings { kHasAll, kMayLack };
  static bool Read(World* world, rows::Rows* to, size_t row, World* spare,
                   Readings readings = kHasAll);
  /// Brings a world with the models of the scene into the state of a row. Returns false, after a
  /// message, if the world cannot be restored.
  static bool Write(const rows::Rows& from, size_t row, World* world);

  /// See World::Reseed().
  static void Reseed(rows::Rows* rows, size_t row, uint64_t seed);

  /// Ids of the running models by update interval, in the order of their updates.
  static std::vector<uint32_t> RunningModels(const World& world);

  /// See ModelFiducial::MakeCandidate(). `own` and `there` are global poses.
  static bool MakeCandidate(const rows::FiducialFinder& finder, const Pose& own,
                            const rows::FiducialTarget& target, const Pose& there,
                            ModelFiducial::Fiducial* candidate) {
    return finder.model->MakeCandidate(own, target.model, there, candidate);
  }
  /// See ModelBlobfinder::FindBlobs().
  static void FindBlobs(const rows::Blobfinder& finder, const internal::sensing::RayHits& hits,
                        std::vector<ModelBlobfinder::Blob>* blobs) {
    finder.model->FindBlobs(hits, finder.fov, blobs);
  }
  /// Lists what a fiducial finder of a row has found. The models are those of the prototype.
  static void ListFiducials(const rows::Rows& from, size_t row, const rows::FiducialFinder& finder,
                            std::vector<ModelFiducial::Fiducial>* to);
  /// Calls put(mover, pose) for the members of all populations, with the poses that loading with
  /// that seed gives them. Throws LoadError if they do not fit.
  static void PlacePopulations(const rows::Scene& scene, uint64_t seed,
                               const std::function<void(uint32_t mover, const Pose&)>& put);
  static uint64_t SeedOfMover(const rows::Scene& scene, size_t mover, uint64_t seed);
  static uint64_t SeedOfNoise(const rows::Scene& scene, size_t sensor, uint64_t seed);

 private:
  static double UnitOf(const World& world, const rows::VariedNumber& number);
  static double* FindNumber(Model* model, const rows::VariedNumber& number);
  static double ReadNumber(const World& world, const rows::VariedNumber& number);
  static void WriteNumber(const rows::VariedNumber& number, double value, World* world);
  static void AddVaried(std::span<const rows::VariedNumber> varied, const World& prototype,
                        rows::Scene* scene);
  static void ReadVaried(const World& world, rows::Rows* to, size_t row);
  static void WriteVaried(const rows::Rows& from, size_t row, World* world);
  class SceneMaker;
  class FinderMaker;
  static std::string WhyNotModel(const Model& model);
  static std::string WhyNotRobot(const ModelPosition& robot);
  static std::string WhyNotRanger(const ModelRanger& ranger);
  static std::string WhyNotFinder(const Model& model);
  static std::string WhyNotSchedule(const World& world);
  // The following functions are in control_bridge.cc.
  static std::string WhyNotControls(const World& world);
  static void AddControls(const World& prototype, rows::Scene* scene);
  static rows::Sensor* FindSensor(rows::Scene* scene, const ModelRanger* ranger, uint32_t index);
  template <typename F>
  static bool ForEachControl(const World& world, const rows::Scene& scene, F f);
  static bool ReadControls(const World& world, rows::Rows* to, size_t row);
  static void WriteControls(const rows::Rows& from, size_t row, World* world);
  static void WriteRandom(const RandomStream& random, Model* to);
  // The following functions are in population_bridge.cc.
  static std::string WhyNotPopulations(const World& world);
  static std::shared_ptr<const InitialState> CaptureStart(World* prototype);
  static void AddPopulations(World* prototype, rows::Scene* scene);
  static void WritePopulations(const rows::Rows& from, size_t row, World* world);
  // The following functions are in finder_bridge.cc.
  static void AddFinders(World* prototype, rows::Scene* scene);
  static bool FinishFinders(World* prototype, rows::Scene* scene);
  static bool MakeFinderMaps(const World& prototype, rows::Scene* scene);
  static void ReadBumpers(const World& world, rows::Rows* to, size_t row);
  static void ReadFinders(const World& world, rows::Rows* to, size_t row);
  static void WriteFinders(const rows::Rows& from, size_t row, World* world);
  static void WriteBumpers(const rows::Rows& from, size_t row, World* world);
  static void WriteFiducials(const rows::Rows& from, size_t row, World* world);
  static uint64_t SeedOf(const rows::Scene& scene, const Model& model, uint64_t seed);
  static size_t PlaceOf(const rows::Scene& scene, const Model& model);
  // The following functions are in reseeding_bridge.cc.
  static uint64_t LoadingSeedOf(const rows::Rows& rows, size_t row);
  static std::vector<uint64_t> SeedsOfModels(const rows::Rows& rows, size_t row);
  static uint64_t SeedOfNoise(const rows::Rows& rows, size_t row, size_t sensor);
  static bool IsSeeded(const rows::Rows& rows, size_t row, size_t sensor);
  static RandomStream StreamOf(const rows::Rows& rows, size_t row, size_t sensor);
  static void ReadReseeding(const World& world, rows::Rows* to, size_t row);
  static void WriteRandomNumbers(const rows::Rows& from, size_t row, World* world);
  static void ReadModels(const World& world, rows::Rows* to, size_t row);
  static void ReadRobot(const ModelPosition& model, rows::Rows* to, size_t row, size_t i);
  static bool ReadSensors(const World& world, uint32_t lacking, rows::Rows* to, size_t row);
  static bool ReadReadings(const ModelRanger::Sensor& sensor, const rows::Sensor& of,
                           rows::Rows* to, size_t row);
  static void ReadOrder(const World& world, rows::Rows* to, size_t row);
  static void ReadUpdates(const World& world, uint32_t lacking, rows::Rows* to, size_t row);
  static void ReadSchedule(const World& world, rows::Rows* to, size_t row);
  static uint32_t LackingRates(const World& world, const rows::Rows& to, size_t row);
  /// Calls f(time, model) for the pending updates of running models, in their order.
  static void ForEachUpdate(const World& world, const std::function<void(usec_t, Model*)>& f);
  static bool HasModelsOf(const World& world, const rows::Scene& scene);
  static bool HasMovedWalls(const World& world, const rows::Scene& scene);
  static void ReadGrid(const World& world, rows::Rows* to, size_t row);
  static void WriteMovers(const rows::Rows& from, size_t row, World* world);
  static void WriteRobot(const rows::Rows& from, size_t row, size_t mover, ModelPosition* to);
  static void WriteEnergy(const rows::Rows& from, size_t row, World* world);
  static void WriteSensors(const rows::Rows& from, size_t row, World* world);
  static Pose ScanPose(const rows::Rows& from, size_t row, size_t sensor);
  static void WriteSchedule(const rows::Rows& from, size_t row, World* world);
  static void WriteGrid(const rows::Rows& from, size_t row, World* world);
};

}  // namespace Stg

#endif
