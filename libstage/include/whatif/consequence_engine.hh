// SPDX-License-Identifier: GPL-2.0-or-later
//
// ConsequenceEngine: chooses the action whose consequences are best, within a budget. Part of
// <stage.hh>. The name is that of Winfield, Blum and Liu: Towards an Ethical Robot: Internal
// Models, Consequences and Ethical Action Selection, TAROS 2014.

#ifndef STAGE_WHATIF_CONSEQUENCE_ENGINE_HH
#define STAGE_WHATIF_CONSEQUENCE_ENGINE_HH

#include <stddef.h>
#include <stdint.h>

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "geometry/geometry.hh"
#include "whatif/branches.hh"
#include "world/snapshot.hh"

namespace Stg {

class World;

/// An action that one could take. The first of a list had better be "go on as now": it is chosen
/// where nothing is known.
struct Candidate {
  std::string name;
  std::vector<Command> commands;
};

/// Scores what comes of candidates. Its functions are called by several threads at once, each with
/// a world of its own.
class Judge {
 public:
  virtual ~Judge() {}
  /// Before a candidate's first step, for whatever commands can't say.
  virtual void Begin(World& world, size_t candidate);
  /// After each step: adds to the score; more is better. True: nothing that comes later matters.
  virtual bool Score(World& world, size_t candidate, double* score) = 0;
  /// The least and the most that can be added to a score in so many steps. The better these are
  /// known, the earlier candidates are given up that can't win any more. Without bounds at first.
  virtual Bounds Outlook(uint64_t steps) const;
};

/// How long to think. It ends at the first limit that is reached; a limit of 0 is none.
struct Budget {
  double seconds;           ///< of the wall clock
  double joules;            ///< as `meter` says, or else `watts` times the seconds
  uint64_t scenario_steps;  ///< steps, added up over all candidates
  double watts;
  std::function<double()> meter;  ///< joules so far, since some moment

  explicit Budget(double for_seconds = 0)
      : seconds(for_seconds), joules(0), scenario_steps(0), watts(0) {}
};

/// What is known of a candidate.
struct Outcome {
  double score;                     ///< the mean of its samples
  uint64_t steps;                   ///< those of the longest sample
  bool ended;                       ///< all its samples: see Judge::Score()
  bool dominated;                   ///< given up early, as it could not win any more
  std::string error;                ///< of a sample that has failed; such a candidate isn't chosen
  std::vector<Sighting> sightings;  ///< of the first sample: see Branch

  Outcome() : score(0), steps(0), ended(false), dominated(false) {}
};

struct Decision {
  size_t best;              ///< candidate; of equal ones the first
  bool complete;            ///< the budget sufficed for the whole horizon
  uint64_t rounds;          ///< in each of which all that were left made the same number of steps
  uint64_t steps;           ///< that all of them had made in the end, unless they ended before
  uint64_t scenario_steps;  ///< in all
  double seconds, joules;   ///< spent; the only two that Replay() doesn't repeat
  std::vector<Outcome> outcomes;

  Decision()
      : best(0), complete(false), rounds(0), steps(0), scenario_steps(0), seconds(0), joules(0) {}
};

/// What was to be decided.
struct Question {
  Snapshot now;
  std::vector<Candidate> candidates;
  usec_t horizon;  ///< simulated
  /// Samples have the seeds `seed`, `seed` + 1 and so on, the same for all candidates. 0: the first
  /// sample goes on with the random numbers that the world has.
  uint64_t seed;

  Question() : horizon(0), seed(1) {}
};

class ConsequenceEngine {
 public:
  struct Options {
    unsigned threads;               ///< see BranchOptions
    uint32_t samples;               ///< of each candidate, with different random numbers
    uint64_t round;                 ///< steps; the clock is looked at between rounds
    std::vector<uint32_t> watched;  ///< see BranchOptions

    Options() : threads(1), samples(1), round(5) {}
  };

  /// For a world that is loaded; see Branches.
  explicit ConsequenceEngine(const World& prototype, const Options& options = Options());
  ~ConsequenceEngine();
  ConsequenceEngine(const ConsequenceEngine&) = delete;
  ConsequenceEngine& operator=(const ConsequenceEngine&) = delete;

  /// See Branches.
  bool IsReady() const;
  /// The best of the candidates, as far as the budget goes. A first round is made in any case.
  Decision Choose(const Question& question, const Budget& budget, Judge* judge);
  /// The same rounds once more, without a clock: the same decision, to the last bit.
  Decision Replay(const Question& question, const Decision& decision, Judge* judge);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace Stg

#endif
