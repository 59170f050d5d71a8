// SPDX-License-Identifier: GPL-2.0-or-later
//
// ConsequenceEngine: chooses the action with the best simulated consequences within a budget. Part
// of <stage.hh>. Named after Winfield, Blum and Liu: Towards an Ethical Robot: Internal Models,
// Consequences and Ethical Action Selection, TAROS 2014.

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

/// A possible action. Put the default action ("continue as now") first in the list: it is chosen if
/// nothing is known.
struct Candidate {
  std::string name;
  std::vector<Command> commands;
};

/// A sample of a candidate: one possible future after its commands.
struct Sample {
  size_t candidate;
  uint32_t number;  ///< 0, 1, ...: samples with the same number have the same random numbers
};

/// The result of a sample so far.
struct SampleResult {
  double score;   ///< higher is better
  bool collided;  ///< Outcome::CollisionRisk() is the share of these samples

  SampleResult() : score(0), collided(false) {}
};

/// The subject of a decision.
struct DecisionTask {
  size_t candidates;
  uint64_t steps;   ///< of the horizon
  double interval;  ///< s, duration of a step
  size_t watched;   ///< number of sightings of each step
  /// Radii of the others of a belief, in metres and in the order of their ids: sightings 1, 2, ...
  /// of each step are theirs. ConsequenceEngine leaves it empty.
  std::vector<double> other_radii;

  DecisionTask() : candidates(0), steps(0), interval(0), watched(0) {}
};

/// All sightings of a sample from its beginning on.
struct Future {
  Sample sample;
  const Sighting* sightings;  ///< DecisionTask::watched for each step
  uint64_t steps;
};

/// Scores the consequences of candidates. Several threads call its functions at once, each with a
/// world of its own. A judge that overrides Watch() instead of Score(), and NeedsWorld() to return
/// false, makes decisions about closed worlds several times as fast; see Scenario.
///
/// Override either the functions with the number of a candidate, or those with a Sample, which can
/// also tell samples apart and report collisions, or ScoreFutures(), which sees all samples at
/// once.
class Judge {
 public:
  virtual ~Judge() {}
  /// True if Begin() and Score() are to be called, which is the default.
  virtual bool NeedsWorld() const;
  /// Called before a candidate's first step, for changes that commands cannot express.
  virtual void Begin(World& world, size_t candidate);
  /// Called after each step. Changes the score; higher is better. Returns true to end the sample.
  virtual bool Score(World& world, size_t candidate, double* score);
  /// Called after each step and Score(), with the sightings of the step: one for each of
  /// ConsequenceEngine::Options::watched. Changes the score, and returns true to end the sample.
  virtual bool Watch(const Sighting* watched, size_t candidate, double* score);
  /// These are called instead of the functions above, which they call by default.
  virtual void BeginSample(World& world, const Sample& sample);
  virtual bool ScoreSample(World& world, const Sample& sample, SampleResult* result);
  virtual bool WatchSample(const Sighting* watched, const Sample& sample, SampleResult* result);
  /// Called before the first step of a decision.
  virtual void BeginDecision(const DecisionTask& task);
  /// True if ScoreFutures() is to be called. All sightings are kept until then, which takes 72
  /// bytes for each of them.
  virtual bool ScoresFutures() const;
  /// Changes the results of samples that have been simulated: of all that the decision has, or that
  /// it has added to tell candidates apart. Only the thread that decides calls it.
  virtual void ScoreFutures(const Future* futures, size_t count, SampleResult* results);
  /// Bounds of what `steps` more steps can add to a score. Tight bounds allow candidates that
  /// cannot win to be dropped early. The default is unbounded.
  virtual Bounds Outlook(uint64_t steps) const;
};

/// Limits of a decision's cost; the first one reached ends it. A limit of 0 means no limit.
struct Budget {
  double seconds;           ///< wall-clock time
  double joules;            ///< measured by `meter`, or else `watts` times the seconds
  uint64_t scenario_steps;  ///< summed over all samples of all candidates
  double watts;
  std::function<double()> meter;  ///< returns joules consumed since an arbitrary start

  explicit Budget(double for_seconds = 0)
      : seconds(for_seconds), joules(0), scenario_steps(0), watts(0) {}
};

/// An interval that contains a quantity with the wanted confidence.
struct Interval {
  double low, high;
};

/// The result of a candidate: the distribution of its samples.
struct Outcome {
  double score;                     ///< mean over its samples
  uint64_t steps;                   ///< of its longest sample
  bool ended;                       ///< all samples have ended: see Judge::Score()
  bool dominated;                   ///< dropped early because it could not win any more
  std::string error;                ///< of a failed sample; such a candidate is not chosen
  std::vector<Sighting> sightings;  ///< of the first sample: see Branch
  std::vector<double> scores;       ///< by sample
  std::vector<uint8_t> collided;    ///< by sample: see SampleResult

  Outcome() : score(0), steps(0), ended(false), dominated(false) {}

  /// Least score of a sample.
  double Worst() const;
  /// The score that a share `q` (0 to 1) of the samples does not exceed: the least score for 0, the
  /// greatest for 1, and linear in between. NaN without samples.
  double Quantile(double q) const;
  /// Standard deviation of the scores, with n - 1; 0 for one sample.
  double Deviation() const;
  /// Share of the samples that collided, 0 to 1.
  double CollisionRisk() const;
  /// Wilson's score interval of the probability of a collision, `errors` standard errors wide on
  /// either side: 1.96 for a confidence of 95 %. (Wilson: Probable Inference, the Law of
  /// Succession, and Statistical Inference, JASA 1927.)
  Interval CollisionInterval(double errors = 1.96) const;
};

/// How candidates are compared.
struct Preference {
  enum Kind {
    kMean,     ///< of the scores
    kWorst,    ///< least score
    kQuantile  ///< see Outcome::Quantile()
  };

  Kind kind;
  double quantile;  ///< for kQuantile, 0 to 1
  /// Candidates with a greater share of collisions are chosen only if all have one; then the one
  /// with the least share is. 1: no limit.
  double max_risk;

  Preference(Kind by = kMean, double q = 0.1) : kind(by), quantile(q), max_risk(1) {}

  /// The number that is compared; greater is better.
  double ValueOf(const Outcome& outcome) const;
};

struct Decision {
  /// Why the decision has ended.
  enum Reason {
    kHorizon,    ///< all samples that were asked for have reached the horizon
    kToldApart,  ///< so have enough samples to tell the best candidate from the others
    kBudget      ///< the budget did not suffice for that
  };

  size_t best;    ///< index of the best candidate; the first if several are equal
  bool complete;  ///< the whole horizon was simulated
  Reason reason;
  uint32_t samples;         ///< of the best candidate
  uint64_t rounds;          ///< in a round, all remaining candidates make equally many steps
  uint64_t steps;           ///< per sample, unless it ended earlier
  uint64_t scenario_steps;  ///< summed over all samples
  double seconds, joules;   ///< spent; the only results that Replay() does not reproduce
  std::vector<Outcome> outcomes;
  /// Why there was no decision, in one line; empty if there was one. Nobody would obey a command of
  /// a candidate, see Command, or all candidates have failed; see also BeliefEngine.
  std::string error;

  Decision()
      : best(0),
        complete(false),
        reason(kHorizon),
        samples(0),
        rounds(0),
        steps(0),
        scenario_steps(0),
        seconds(0),
        joules(0) {}
};

/// A decision to be made.
struct Question {
  Snapshot now;
  std::vector<Candidate> candidates;
  usec_t horizon;  ///< simulated time to look ahead
  /// Sample i has the seed `seed` + i, for all candidates alike. With 0, the first sample continues
  /// the world's own random numbers.
  uint64_t seed;

  Question() : horizon(0), seed(1) {}
};

class ConsequenceEngine {
 public:
  struct Options {
    unsigned threads;  ///< see BranchOptions
    uint32_t samples;  ///< samples per candidate, with different random numbers
    /// If greater than `samples`: their number is doubled, up to this, until the best candidate can
    /// be told apart from the others, or the budget is spent.
    uint32_t most_samples;
    /// The best candidate is told apart from another one if the mean difference of samples with the
    /// same numbers is greater than `errors` standard errors (Student's correction for few samples
    /// is added), less `indifference`: a difference of scores that does not matter. If Preference
    /// is kQuantile, the order statistics that many standard errors away are compared instead; with
    /// kWorst, nothing is told apart.
    double errors, indifference;
    Preference preference;
    uint64_t round;                 ///< steps per round; the budget is checked between rounds
    std::vector<uint32_t> watched;  ///< see BranchOptions
    /// See BranchOptions. With kFull, readings of rangers are made in each step; otherwise only if
    /// somebody sees them.
    Snapshot::Keep keep;
    bool rows;                  ///< see BranchOptions
    bool device_steps;          ///< see BranchOptions
    std::string device_choice;  ///< see BranchOptions

    Options()
        : threads(1),
          samples(1),
          most_samples(0),
          errors(2),
          indifference(0),
          round(5),
          keep(Snapshot::kLean),
          rows(true),
          device_steps(false) {}
  };

  /// Copies a loaded world; see Branches.
  explicit ConsequenceEngine(const World& prototype, const Options& options = Options());
  ~ConsequenceEngine();
  ConsequenceEngine(const ConsequenceEngine&) = delete;
  ConsequenceEngine& operator=(const ConsequenceEngine&) = delete;

  /// See Branches::IsReady().
  bool IsReady() const;
  /// See Branches::WhyNotClosed().
  std::string WhyNotClosed() const;
  /// See Branches::steps_in_rows().
  uint64_t steps_in_rows() const;
  /// See Branches::StepDevice().
  std::string StepDevice() const;
  /// See Branches::WhyNotOnDevice().
  std::string WhyNotOnDevice() const;
  /// See Branches::steps_on_device().
  uint64_t steps_on_device() const;
  /// Returns the best candidate found within the budget. At least one round is always simulated.
  Decision Choose(const Question& question, const Budget& budget, Judge* judge);
  /// Repeats the rounds of `decision` without a budget. Reproduces the decision exactly.
  Decision Replay(const Question& question, const Decision& decision, Judge* judge);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace Stg

#endif
