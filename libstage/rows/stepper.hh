// SPDX-License-Identifier: GPL-2.0-or-later
//
// Makes steps of one row; part of rows.hh.

#ifndef STAGE_ROWS_STEPPER_HH
#define STAGE_ROWS_STEPPER_HH

#include <cstddef>
#include <cstdint>
#include <vector>

#include "motion/contacts.hh"
#include "rows/rows.hh"
#include "sensing/exact_group.hh"
#include "sensing/first_hits.hh"
#include "sensing/ray_group.hh"

namespace Stg::rows {

inline constexpr uint32_t kMaxCorners = 64;  ///< of a body
inline constexpr uint32_t kMaxBodies = 16;   ///< of a robot

class Rows::Scratch {
 public:
  explicit Scratch(const Scene& scene);

 private:
  friend class Rows::Stepper;
  using Fan = internal::sensing::Fan;

  // Rays.
  internal::sensing::FirstHits first;
  internal::sensing::ExactGroup exact;
  internal::sensing::TraceCounters counters;
  std::vector<Fan> fans;          // by sensor
  std::vector<int32_t> places;    // by ray: number of borders up to the hit
  std::vector<uint64_t> keys;     // by ray: which of several bodies in a cell is hit first
  std::vector<point_t> points;    // corners of all bodies, closed, m
  std::vector<SineCosine> turns;  // by robot: of its heading
  std::vector<internal::sensing::Direction> own_directions;
  std::vector<SineCosine> own_unit_vectors;
  double walked[internal::sensing::WideHits::kCapacity];

  // Moves.
  point_int_t corners[2][kMaxCorners];
  OutlineBox boxes[kMaxBodies];
  uint64_t rows[kMaxBodies][kMaxSide];
  motion::Contacts contacts;
  motion::Columns columns;
  std::vector<Planar> wanted;
  std::vector<uint8_t> asked;
};

class Rows::Stepper {
 public:
  Stepper(Rows* rows, size_t world, Scratch* scratch);
  void Step();

 private:
  static constexpr uint8_t kAsked = 1, kMoved = 2, kInFloor = 4;
  struct RaysOfSensor;

  void Drive(size_t index, double dt);
  Pose EstimateOf(size_t index) const;
  void StoreSensedPose(size_t index);

  void CastRays();
  void PlaceFan(size_t index);
  bool MayHitWalls(const Sensor& sensor, const internal::sensing::Fan& fan) const;
  RaysOfSensor DirectionsOf(size_t index);
  void TraceWalls(size_t index, const RaysOfSensor& rays);
  void TraceWallsInCells(size_t index, const RaysOfSensor& rays, uint32_t begin, uint32_t count);
  void TraceWallsExactly(size_t index, const RaysOfSensor& rays, uint32_t begin,
                         const internal::sensing::RayGroup& group);
  void FollowWall(size_t index, const RaysOfSensor& rays, uint32_t sample, uint32_t hit);
  bool AcceptBody(const internal::sensing::Fan& fan, internal::grid::BodyList bodies, size_t ray);
  void TraceRobots(size_t index, const RaysOfSensor& rays);
  void MeetInCells(size_t index, const RaysOfSensor& rays, const Body& body, uint32_t number);
  void MeetExactly(size_t index, const RaysOfSensor& rays, const Body& body);
  void AddNoise(size_t index);
  void PlaceCorners();
  uint8_t BrightnessOf(const Model& model) const;

  void NoteMotion(size_t index, const Planar& made);
  bool WantedPose(size_t index, Planar* wanted);
  void MoveCells(size_t index);
  void DrawAt(size_t index, const Planar& pose);
  static Pose FrameOf(const Robot& robot, uint32_t node, const Planar& pose);
  bool CornerCells(const Body& body, const Planar& pose, point_int_t* to) const;
  bool Collides(size_t index) const;
  void Commit(size_t index, const Planar& pose);
  bool HasMoved(uint32_t number, const OutlineBox& box, const uint64_t* rows, const Planar& before,
                const Planar& now);
  void WidenExtent(const OutlineBox& box);
  void MoveOutlines();
  void EndMove(size_t index);

  uint64_t* RowsOf(uint32_t body) const { return &c_.rows[word_ + scene_.bodies[body].first_word]; }

  const Scene& scene_;
  Columns& c_;
  Scratch& s_;
  // The world, and its first elements in the columns.
  const size_t world_, robot_, body_, word_, ray_, sensor_;
  const double seconds_;  // of a step
};

}  // namespace Stg::rows

#endif
