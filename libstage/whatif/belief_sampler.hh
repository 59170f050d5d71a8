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

class BeliefSampler {
 public:
  /// `robot` and `others` are movers of the scene. The controller of all others is stage/behaviour.
  BeliefSampler(uint32_t robot, std::vector<uint32_t> others)
      : robot_(robot), others_(std::move(others)) {}

  /// Draws a sample into row 0. Samples with equal numbers and seeds have equal random numbers, and
  /// nobody's depend on how many others there are.
  void Draw(const BeliefContent& belief, uint64_t seed, uint32_t number, rows::Rows* to) const;
  /// Why no future can begin in this state: one line; empty if it can.
  std::string WhyNotFree(const BeliefContent& belief, rows::Rows* rows) const;
  bool robot_is_omni(const rows::Rows& rows) const { return rows.scene().movers[robot_].is_omni; }

 private:
  void DrawOther(const BeliefContent& belief, size_t other, RandomStream* random,
                 rows::Rows* to) const;
  double* MemoryOf(uint32_t mover, rows::Rows* rows) const;
  /// True if a mover is in something that stands. Cells inside an area of the grid are no walls of
  /// the scene, which has only outlines.
  static bool IsInObstacle(const BeliefContent& belief, uint32_t mover, rows::Rows* rows);
  bool IsFree(const BeliefContent& belief, uint32_t mover, rows::Rows* rows) const;

  const uint32_t robot_;
  const std::vector<uint32_t> others_;
};

}  // namespace Stg::whatif

#endif
