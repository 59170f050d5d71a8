// SPDX-License-Identifier: GPL-2.0-or-later
//
// Closed worlds as rows of columns. Row i holds what changes in world i; the scene holds the rest.
// A step touches no model: it reads and writes the columns.
//
// The full World remains the truth. RowBridge writes a row into a World, which then has the state
// hash of a World that made the same steps, and reads a row from a World.

#ifndef STAGE_ROWS_ROWS_HH
#define STAGE_ROWS_ROWS_HH

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "models/blobfinder.hh"
#include "models/fiducial.hh"
#include "models/power_pack.hh"
#include "motion/odometry.hh"
#include "random/random.hh"
#include "rows/outline_bits.hh"
#include "rows/planar.hh"
#include "rows/scene.hh"

namespace Stg {
class RowBridge;
}

namespace Stg::rows {

/// A touch at a line of a bumper.
struct Bump {
  static constexpr uint32_t kNobody = UINT32_MAX;
  uint32_t model = kNobody;  ///< id
  double x = 0, y = 0;       ///< m; of the latest touch
};

/// How the random numbers of a world differ from those that follow from its seed, because
/// World::Reseed() has changed it after loading.
struct Reseeding {
  uint64_t loading_seed;              ///< the seed of loading
  std::vector<uint64_t> models;       ///< seeds of all models, in the order of creation
  std::vector<RandomStream> sensors;  ///< streams of the sensors at that time
  // By group of rates.
  std::vector<uint8_t> had_readings;  ///< whether its sensors had readings then
  std::vector<usec_t>
      update;  ///< time of the last update before; noise has its new streams after it
};

/// The columns. All are in the order of the worlds; in a world, of the robots, bodies or rays.
struct Columns {
  // By world.
  std::vector<uint64_t> seed;
  std::vector<std::shared_ptr<const Reseeding>> reseeding;  ///< null: the seed is that of loading
  std::vector<usec_t> time;
  std::vector<uint64_t> steps;
  std::vector<internal::grid::CellBox> extent;  ///< see Grid::extent()
  std::vector<uint64_t> stamps;                 ///< number of rasterizations of bodies so far

  // By group of rates.
  std::vector<usec_t> next_update, last_update;
  std::vector<uint64_t> scheduled;  ///< if there are several: greater numbers update later

  // By mover.
  std::vector<Planar> pose, velocity, command, sensed;
  std::vector<SineCosine> turn;  ///< of the heading
  std::vector<uint8_t> mode;     ///< DriveInput::Mode
  std::vector<uint8_t> stalled;
  std::vector<double> watts;
  std::vector<Planar> made;       ///< contacts of outlines: velocity of the last move
  std::vector<uint8_t> hindered;  ///< contacts of outlines: whether that is not what was wanted
  std::vector<double> steering;   ///< if any robot steers
  std::vector<Planar> before;     ///< if things can be pushed: the pose before the last step
  // If any robot has odometry.
  std::vector<Planar> estimate, driven, error;
  std::vector<NoisyOdometry> noisy_odometry;  ///< if any has random errors
  std::vector<RandomStream> random;           ///< if any has random errors or a controller

  // By power pack, joules; and by world.
  std::vector<double> stored, dissipated;
  std::vector<EnergyTotals> energy;  ///< if there are packs

  // By body.
  std::vector<OutlineBox> box;
  std::vector<uint64_t> stamp;  ///< of the last rasterization since loading; 0: none
  std::vector<std::byte> bits;  ///< rows of words, see Body::first_byte

  std::vector<double> memory;  ///< of controllers, see ControlGroup

  // By sensor: streams of noise, if any sensor has noise.
  std::vector<RandomStream> noise;

  // Numbers that differ between worlds, in SI units, and what steps read instead of the properties
  // of the scene: by mover and by sensor, if any of these varies.
  std::vector<double> varied;
  std::vector<MoverProperties> properties;
  std::vector<RangeNoise> range_noise;

  // If there are several groups of rates: what was sensed earlier than the poses of movers.
  std::vector<Planar> scan;                   ///< by sensor: pose of its ranger
  std::vector<ModelFiducial::Fiducial> seen;  ///< by fiducial finder and target, without a model

  // By ray.
  std::vector<double> ranges;       ///< m
  std::vector<uint8_t> brightness;  ///< index in Scene::brightness of what was hit

  std::vector<Bump> bumps;                   ///< by line of a bumper
  std::vector<uint8_t> found;                ///< by fiducial finder and target: whether it was seen
  std::vector<uint32_t> blobs_seen;          ///< by blobfinder
  std::vector<ModelBlobfinder::Blob> blobs;  ///< by blobfinder, see Blobfinder::max_blobs()
};

/// Rays of the cell model from arbitrary poses, with equal bearings; see RayCaster.
struct Casting {
  static constexpr uint32_t kNobody = UINT32_MAX;
  double z;  ///< m, of the rays; NaN: they hit bodies at any height
  bool robots;
  double range;  ///< m; at most a leg of a ray
  std::vector<internal::sensing::Direction> directions;
  std::vector<SineCosine> unit_vectors;
};

class Rows {
 public:
  /// Makes worlds in the state after loading with these seeds. Throws LoadError like Reset().
  Rows(std::shared_ptr<const Scene> scene, std::span<const uint64_t> seeds);

  size_t size() const { return columns.seed.size(); }
  const Scene& scene() const { return *scene_; }
  const std::shared_ptr<const Scene>& shared_scene() const { return scene_; }
  /// The rows of bits of a body's outline. `Word` is NarrowWord if the scene is narrow, otherwise
  /// WideWord.
  template <class Word>
  Word* BitsOf(size_t world, size_t body) {
    return reinterpret_cast<Word*>(
        &columns.bits[world * scene_->byte_count + scene_->bodies[body].first_byte]);
  }
  /// Place of a group of rates in the columns of these.
  size_t RateIndex(size_t world, uint32_t rate) const {
    return world * scene_->rates.size() + rate;
  }
  /// Time of the last update of a group of rates.
  usec_t LastUpdate(size_t world, uint32_t rate) const {
    return columns.last_update[RateIndex(world, rate)];
  }
  /// True if the world's sensors of a group of rates have readings.
  bool HasReadings(size_t world, uint32_t rate) const { return LastUpdate(world, rate) > 0; }
  /// The properties of a mover in this world.
  const MoverProperties& PropertiesOf(size_t world, size_t mover) const {
    if (columns.properties.empty()) return scene_->movers[mover].properties;
    return columns.properties[world * scene_->movers.size() + mover];
  }
  /// The noise of a sensor in this world.
  const RangeNoise& NoiseOf(size_t world, size_t sensor) const {
    if (columns.range_noise.empty()) return scene_->sensors[sensor].noise;
    return columns.range_noise[world * scene_->sensors.size() + sensor];
  }
  /// True if readings of a sensor need random numbers in this world.
  bool IsNoisy(size_t world, size_t sensor) const {
    const Sensor& of = scene_->sensors[sensor];
    return NoiseOf(world, sensor).Any(of.increment) || of.defects.loss > 0;
  }
  /// Time at which the pose of a running robot was sensed.
  usec_t SensedAt(size_t world, size_t mover) const;

  /// Changes the number of worlds. New ones must be reset, copied or read before they are used.
  void Resize(size_t worlds);
  /// Resets a world to its state after loading with that seed. Throws LoadError if the members of
  /// its populations do not fit with this seed. `given`: the numbers of Scene::varied, in the units
  /// of the world file. NaN, or none at all: that of the prototype.
  void Reset(size_t world, uint64_t seed, std::span<const double> given = {});
  /// Copies the state of a world of rows of the same scene.
  void Copy(size_t to, const Rows& other, size_t from);
  /// Copies the state of a world of rows of the same file, with the same subscriptions, in whose
  /// scene fewer numbers vary.
  void CopyAcross(size_t to, const Rows& other, size_t from);
  /// Copies only what a new seed changes, and what that depends on; see RowBridge::Reseed().
  void CopyRandomNumbers(size_t to, const Rows& other, size_t from);
  /// Copies the state of a world, which has made no step, of rows with fewer subscriptions. Robots
  /// that begin to run sense their present pose. Returns false if the scenes have different bodies.
  bool CopyStart(size_t world, const Rows& other);
  /// Memory of a thread.
  class Scratch;
  std::shared_ptr<Scratch> MakeScratch() const;
  /// Moves a robot to a pose, without a collision test. See Model::SetPose().
  void Place(size_t world, size_t mover, const Planar& pose, Scratch* scratch);
  /// Puts a mover where its world starts, as if loading had put it there.
  void PlaceMover(size_t world, uint32_t mover, const Pose& pose);
  /// True if a mover is in something that stands and is an obstacle.
  bool IsInObstacle(size_t world, uint32_t mover);
  /// Makes steps. Several threads may step different worlds, each with its own scratch. Nobody
  /// looks at the readings of rangers before `unseen` further steps have been made, so rays are
  /// cast only for readings that are not replaced by then.
  void Step(size_t world, uint64_t steps, Scratch* scratch, uint64_t unseen = 0);
  /// Calls the controllers of a world, if its robots updated in the step that it has made without
  /// them.
  void RunControls(size_t world, Scratch* scratch);
  /// The contacts of outlines at the present poses, in the order of World::ForEachContact(). Models
  /// are those of the prototype.
  void FindContacts(size_t world, Scratch* scratch, std::vector<ContactPoint>* to);
  /// True if rows of a scene can cast such rays: those of the cell model that are not too long.
  static bool CanCast(const Scene& scene, RayModel model, double range);
  /// Casts the rays of `casting` from these poses, and stores their ranges one fan after the other.
  /// `ignored`: for each pose a mover that its rays pass, or Casting::kNobody.
  void Cast(size_t world, const Casting& casting, std::span<const Planar> poses,
            const uint32_t* ignored, double* ranges, Scratch* scratch);
  /// Bytes of a world.
  size_t BytesPerWorld() const;

  Columns columns;

 private:
  friend class Stg::RowBridge;
  class Stepper;
  explicit Rows(std::shared_ptr<const Scene> scene);
  void SetOutline(size_t world, size_t body, const CornerCells& corners, uint32_t count);
  void PlacePopulations(size_t world);
  void DrawErrors(size_t world);
  void SeedNoise(size_t world);
  // The following functions are in varied.cc.
  void Vary(size_t world, std::span<const double> given);
  double UsualNumber(size_t world, size_t k);
  void ApplyVaried(size_t world);
  void Apply(size_t world, const Varied& varied, double number);
  double* Find(size_t world, const Varied& varied);

  std::shared_ptr<const Scene> scene_;
  std::unique_ptr<Rows> start_;  ///< one row: the state after loading; null in that one
};

}  // namespace Stg::rows

#endif
