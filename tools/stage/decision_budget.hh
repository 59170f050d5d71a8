// SPDX-License-Identifier: GPL-2.0-or-later
//
// Times of decisions about a world, for --budget-ms.

#ifndef STAGE_TOOLS_STAGE_DECISION_BUDGET_HH
#define STAGE_TOOLS_STAGE_DECISION_BUDGET_HH

#include <cstdint>
#include <string>
#include <vector>

#include "stage/budget_search.hh"
#include "world/snapshot.hh"

namespace Stg {
class Model;
class World;
}  // namespace Stg

namespace Stg::program {

/// Decisions of ConsequenceEngine: each candidate is a velocity of a robot.
struct DecisionBudget {
  static constexpr uint32_t kCandidates = 30, kSamples = 10;

  double seconds = 0;        ///< of a decision with kSamples
  bool is_estimate = false;  ///< from fewer samples or scenarios, since the decision takes too long
  Fit samples;               ///< how many for each candidate fit
  double memory_mb = 0;      ///< of the process, after such decisions
  std::string robot;         ///< that gets the commands; empty: none does
  std::string why_no_robot;  ///< if none does
  std::string why_slow;      ///< why the world is not closed, in words that follow "because"
};

/// How decisions are measured.
struct DecisionLimits {
  uint64_t steps;    ///< of the horizon
  double budget;     ///< seconds
  double scenario;   ///< seconds that a scenario takes on one thread
  unsigned threads;  ///< at least 1
  bool shows_progress;
};

/// All robots of a world, by number.
std::vector<Model*> RobotsOf(const World& world);

DecisionBudget MeasureDecisions(const World& world, const Snapshot& now,
                                const DecisionLimits& limits);

}  // namespace Stg::program

#endif
