// SPDX-License-Identifier: GPL-2.0-or-later
//
// Others whom rules move: asks each rule once in a step for all samples, and gives the commands.

#ifndef STAGE_WHATIF_RULED_OTHERS_HH
#define STAGE_WHATIF_RULED_OTHERS_HH

#include <cstdint>
#include <functional>
#include <vector>

#include "whatif/belief.hh"
#include "whatif/belief_sampler.hh"
#include "whatif/branches.hh"

namespace Stg::whatif {

class RuledOthers {
 public:
  /// A sample that is simulated.
  struct Living {
    uint32_t branch;
    Sample sample;
    const DrawnOthers* drawn;
    const Sighting* watched;  ///< as they are now
  };

  RuledOthers(Branches* branches, double interval) : branches_(*branches), interval_(interval) {}

  /// Gives commands for the next step of the samples.
  void Move(const std::vector<Living>& living);

 private:
  struct Target {
    uint32_t branch, model;
    double heading;
  };
  /// Whom a rule moves in this step.
  struct Call {
    BehaviourRule* rule;
    std::vector<Moment> moments;
    std::vector<Target> targets;
  };

  void Collect(const Living& of, const Sighting* seen);
  Call* CallOf(BehaviourRule* rule);
  void Give(const Target& target, const Velocity& velocity);

  Branches& branches_;
  const double interval_;
  std::vector<Call> calls_;
  std::vector<Sighting> seen_;  // of all samples, in the order of ids
  std::vector<Velocity> velocities_;
};

}  // namespace Stg::whatif

#endif
