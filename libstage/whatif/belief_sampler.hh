// SPDX-License-Identifier: GPL-2.0-or-later
//
// Draws samples of a belief: states of the closed world that its futures are simulated in.

#ifndef STAGE_WHATIF_BELIEF_SAMPLER_HH
#define STAGE_WHATIF_BELIEF_SAMPLER_HH

#include <cstdint>
#include <string>
#include <vector>

#include "random/random.hh"
#include "rows/rows.hh"
#include "whatif/belief_impl.hh"

namespace Stg::whatif {

/// A mover of the scene that stands for an other.
struct BeliefSlot {
  uint32_t mover;
  uint32_t model;  ///< id
  uint32_t place;  ///< among the watched models
};

/// Whom a sample has drawn, by other in the order of their ids.
struct DrawnOthers {
  struct Drawn {
    uint64_t id;
    const Behaviour* behaviour;
    BeliefSlot slot;
  };
  std::vector<Drawn> others;

  bool HasRules() const;
};

class BeliefSampler {
 public:
  /// The slots of a group of the belief, see BeliefContent::Group.
  struct Group {
    uint32_t kind;
    std::string controller;
    std::vector<BeliefSlot> slots;
  };

  BeliefSampler(const rows::Scene& scene, uint32_t robot, std::vector<Group> groups);

  /// True if others have their slots in the order of their ids.
  bool has_one_group() const { return groups_.size() == 1; }
  /// True if the groups have slots for all others.
  bool Fits(const BeliefContent& belief) const;
  /// Gives each other a slot for each of its behaviours. The belief must fit.
  void Assign(const BeliefContent& belief);
  /// Draws a sample into row 0. Samples with equal numbers and seeds have equal random numbers, and
  /// nobody's depend on how many others there are, except for those of controllers.
  void Draw(const BeliefContent& belief, uint64_t seed, uint32_t number, rows::Rows* to,
            DrawnOthers* drawn) const;
  /// Why no future can begin in this state: one line; empty if it can.
  std::string WhyNotFree(const BeliefContent& belief, rows::Rows* rows) const;
  bool robot_is_omni(const rows::Rows& rows) const { return rows.scene().movers[robot_].is_omni; }

 private:
  static constexpr size_t kNoMemory = SIZE_MAX;

  const Group* Find(uint32_t kind, const std::string& controller) const;
  BeliefSlot DrawOther(const BeliefContent& belief, size_t other, const Behaviour& behaviour,
                       RandomStream* random, rows::Rows* to) const;
  bool Place(const BeliefContent& belief, size_t other, uint32_t mover, RandomStream* random,
             rows::Rows* to) const;
  bool PlaceBesideRobot(const BeliefContent& belief, size_t other, uint32_t mover,
                        rows::Rows* to) const;
  void SetMemory(const Behaviour& behaviour, const Velocity& velocity, double* memory) const;
  /// True if a mover is in something that stands. Cells inside an area of the grid are no walls of
  /// the scene, which has only outlines.
  static bool IsInObstacle(const BeliefContent& belief, uint32_t mover, rows::Rows* rows);
  bool IsFree(const BeliefContent& belief, size_t other, uint32_t mover, rows::Rows* rows) const;
  /// Between the robot and an other who touches the circle inside its outline, m.
  double LeastDistance(const BeliefContent& belief, size_t other, const rows::Rows& rows) const;

  const uint32_t robot_;
  const std::vector<Group> groups_;
  std::vector<size_t>
      memory_;  // by mover: its place in Columns::memory, see kernels/row_behaviour.h
  // By other and group of the belief; UINT32_MAX: it does not need one.
  std::vector<uint32_t> slots_;
  std::vector<const Group*> wanted_;  // by group of the belief
  std::vector<uint32_t> taken_;       // by group of the belief
};

}  // namespace Stg::whatif

#endif
