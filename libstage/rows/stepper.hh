// SPDX-License-Identifier: GPL-2.0-or-later
//
// Makes steps of one row; part of rows.hh.

#ifndef STAGE_ROWS_STEPPER_HH
#define STAGE_ROWS_STEPPER_HH

#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

#include "models/contact_outline.hh"
#include "motion/contacts.hh"
#include "motion/drive_table.hh"
#include "rows/placed.hh"
#include "rows/rows.hh"
#include "sensing/exact_group.hh"
#include "sensing/first_hits.hh"
#include "sensing/ray_group.hh"

namespace Stg::rows {

inline constexpr uint32_t kMaxBodies = 16;  ///< of a robot

/// The directions of a sensor's rays.
struct RaysOfSensor {
  const internal::sensing::Direction* directions;
  const SineCosine* unit_vectors;
};

/// Rays of a sensor in a group, from sample `begin` on.
struct PartOfGroup {
  uint32_t sensor, begin;
};

/// The hit of a ray of a finder.
struct Look {
  double range;
  int32_t place;  ///< number of borders up to the hit
  uint64_t key;   ///< which of several bodies in a cell is hit first
  const Model* model;
};

class Rows::Scratch {
 public:
  explicit Scratch(const Scene& scene);

 private:
  friend class Rows::Stepper;
  using Fan = internal::sensing::Fan;
  void MakeFans(const Scene& scene);
  void MakeLooks(const Finders& finders);

  // Rays.
  internal::sensing::FirstHits first;
  internal::sensing::ExactGroup exact;
  internal::sensing::TraceCounters counters;
  std::vector<Fan> fans;           // by sensor
  std::vector<int32_t> places;     // by ray: number of borders up to the hit
  std::vector<uint64_t> keys;      // by ray: which of several bodies in a cell is hit first
  std::vector<point_t> points;     // corners of all bodies, closed, m
  std::vector<RaysOfSensor> rays;  // by sensor
  TurnMemory turns;                // of sensors
  std::vector<internal::sensing::Direction> own_directions;  // by ray, of sensors that turn noisily
  std::vector<SineCosine> own_unit_vectors;
  // The group of rays that is traced next.
  uint32_t slice_count = 0, group_rays = 0;
  internal::sensing::FanSlice slices[internal::sensing::RayGroup::kMaxRays];
  internal::sensing::ExactGroup::SliceData exact_slices[internal::sensing::RayGroup::kMaxRays];
  PartOfGroup parts[internal::sensing::RayGroup::kMaxRays];
  double walked[internal::sensing::WideHits::kCapacity];

  // Finders: by ray, and fiducials that may be seen.
  std::vector<Look> looks;
  std::vector<internal::sensing::Direction> finder_directions;
  std::vector<SineCosine> finder_unit_vectors;
  std::vector<uint32_t> candidates;
  std::vector<double> blob_ranges;
  std::vector<internal::sensing::HitInterval> blob_intervals;
  std::vector<ModelBlobfinder::Blob> blobs;

  ControlBuffers control;

  // By group of rates: seconds since the last update, and an order.
  std::vector<double> since_update;
  std::vector<std::pair<std::pair<usec_t, uint64_t>, uint32_t>> by_time;

  // Moves.
  CornerCells corners[2];
  OutlineBox boxes[kMaxBodies];
  union {
    NarrowWord narrow[kNarrowSide];
    WideWord wide[kMaxSide];
  } bits[kMaxBodies];
  motion::Contacts contacts;
  motion::Columns columns;
  std::vector<Placed> wanted;
  std::vector<uint8_t> asked;
  // If worlds place walls: those of the last world, and where it had placed them.
  motion::Walls walls;
  std::vector<Planar> walls_at;  // by part
  uint64_t walls_version = 0;    // Scene::map_version
  ContactOutline outline;
};

class Rows::Stepper {
 public:
  Stepper(Rows* rows, size_t world, Scratch* scratch);
  /// Makes a step. Nobody looks at readings before `unseen` further ones have been made.
  void Step(uint64_t unseen);
  void RunControlsAfterStep();
  void Place(size_t index, const Planar& pose);
  void ListContacts(std::vector<ContactPoint>* to);
  void Cast(const Casting& casting, std::span<const Planar> poses, const uint32_t* ignored,
            double* ranges);

 private:
  static constexpr uint8_t kAsked = 1, kMoved = 2, kInFloor = 4;
  void BeginUpdates(uint64_t unseen);
  void KeepOrder();
  bool IsDue(uint32_t rate) const { return (due_ >> rate) & 1; }
  const MoverProperties& PropertiesOf(size_t index) const {
    return c_.properties.empty() ? scene_.movers[index].properties : c_.properties[mover_ + index];
  }
  bool HasNoisyOdometry(size_t index) const {
    return scene_.movers[index].has_noisy_odometry &&
           !(scene_.varies_movers && c_.noisy_odometry[mover_ + index].noise().IsZero());
  }
  const RangeNoise& NoiseOf(size_t index) const {
    return c_.range_noise.empty() ? scene_.sensors[index].noise : c_.range_noise[sensor_ + index];
  }
  void Drive(size_t index, double dt);
  void ObeyVelocity(size_t index);
  void UseVelocity(size_t index, const motion::Driven& driven, bool limits_acceleration);
  Pose EstimateOf(size_t index) const;
  void StoreSensedPose(size_t index);

  void DrawEnergy();

  bool IsUpdatedWithin(uint64_t steps, uint32_t rate) const;
  bool Casts(const Sensor& sensor) const {
    return IsDue(sensor.rate) && (sensor.needed || !((unseen_ >> sensor.rate) & 1));
  }
  void CastRays();
  void KeepScanPoses();
  void PlaceFan(size_t index);
  bool MayHitWalls(uint32_t seen, const internal::sensing::Fan& fan) const;
  RaysOfSensor DirectionsOf(size_t index);
  void AddToGroup(size_t index);
  void TraceGroup();
  void StoreHits(const PartOfGroup& part, uint32_t first, uint32_t count);
  void StoreExactHits(const PartOfGroup& part, uint32_t first, uint32_t count);
  void FollowWall(size_t index, uint32_t sample, uint32_t hit);
  bool AcceptBody(const internal::sensing::Fan& fan, internal::grid::BodyList bodies, size_t ray);
  void TraceRobots(size_t index);
  template <class Word>
  void MeetInCells(size_t index, uint32_t number);
  void MeetExactly(size_t index, const Body& body);
  // In meet.hh.
  uint64_t DrawingOrder(uint32_t body) const;
  template <class Word, typename F>
  void ForEachMeeting(const internal::sensing::Fan& fan, const RaysOfSensor& rays, uint32_t count,
                      uint32_t number, F f) const;
  template <typename Range, typename F>
  void ForEachCrossing(const internal::sensing::Fan& fan, const RaysOfSensor& rays, uint32_t count,
                       const Body& body, Range range, F f) const;
  bool IsOutOfReach(const internal::sensing::Fan& fan, const Body& body) const;
  template <typename Accept>
  bool FollowRay(const internal::sensing::Fan& fan, const internal::sensing::Direction& direction,
                 uint32_t hit, Accept accept, double* range, int32_t* place) const;
  void AddNoise(size_t index);
  void PlaceCorners();
  uint8_t BrightnessOf(const Model& model) const;

  // In controls.cc.
  void RunControls();
  void CallForSome(const ControlGroup& group);
  double* MemoryOf(const ControlGroup& group, size_t i) const;
  void CallController(const ControlGroup& group, std::span<const uint32_t> robots);
  void GatherAllRobots(const BatchController& controller);
  void GatherForControl(const ControlGroup& group, std::span<const uint32_t> robots);
  ControllerBatch BatchOf(const ControlGroup& group, std::span<const uint32_t> robots,
                          const double* time);

  // In finders.cc.
  void FindModels();
  void FindContacts();
  void TouchLine(size_t index);
  const Model* FindTouching(const BumperLine& line, const point_t& start, const SineCosine& along,
                            point_t* where) const;
  void FindFiducials(size_t index);
  Pose PlaceOfTarget(const FiducialTarget& target) const;
  void FindBlobs(size_t index);
  void TraceFinder(const Finder& finder, const internal::sensing::Fan& fan,
                   const RaysOfSensor& rays, uint32_t count);
  void TraceStanding(const internal::sensing::Fan& fan, const RaysOfSensor& rays, uint32_t count);
  void StoreLooks(const internal::sensing::Fan& fan, const RaysOfSensor& rays, uint32_t count,
                  Look* looks);
  bool AcceptModel(const internal::sensing::Fan& fan, internal::grid::BodyList bodies,
                   Look* look) const;
  void LookAtMover(const internal::sensing::Fan& fan, const RaysOfSensor& rays, uint32_t count,
                   uint32_t number);

  void NoteMotion(size_t index, const Planar& made);
  bool FindWanted(size_t index, Placed* wanted);
  void MoveCells(size_t index);
  void DrawAt(size_t index, const Placed& place);
  Placed PlaceOf(size_t mover) const {
    const Planar& pose = c_.pose[mover_ + mover];
    return {pose.x, pose.y, pose.a, c_.turn[mover_ + mover]};
  }
  bool FindCorners(const Body& body, const Placed& place, CornerCells* to) const;
  template <class Word>
  bool Collides(size_t index) const;
  void CommitAt(size_t index, const Placed& place);
  template <class Word>
  void Commit(size_t index, const Placed& place);
  template <class Word>
  bool HasMoved(uint32_t number, uint32_t drawn, const Placed& before, const Placed& now);
  void MoveOutlines();
  void SetContactProperties();
  const motion::Walls& WallsNow();
  void FindWalls();
  void SetPose(size_t index);
  void SetTarget(size_t index);
  Planar NewPose(size_t index) const;
  SineCosine TurnAfter(size_t index, double heading) const;
  void EndMove(size_t index);

  template <class Word>
  Word* BitsOf(uint32_t body) const {
    return reinterpret_cast<Word*>(&c_.bits[byte_ + scene_.bodies[body].first_byte]);
  }
  /// The bits of body `b` of the robot that was drawn last.
  template <class Word>
  Word* DrawnBits(uint32_t b) const {
    if constexpr (std::is_same_v<Word, NarrowWord>)
      return s_.bits[b].narrow;
    else
      return s_.bits[b].wide;
  }

  const Scene& scene_;
  Columns& c_;
  Scratch& s_;
  // The world, and its first elements in the columns.
  const size_t world_, rate_, mover_, body_, byte_, ray_, sensor_, pack_, memory_;
  const double seconds_;  // of a step
  // Groups of rates as bits: those that update in this step, and those of them that will have
  // updated again before anybody looks at their readings.
  uint32_t due_ = 0, unseen_ = 0;
};

}  // namespace Stg::rows

#endif
