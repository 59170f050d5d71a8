// SPDX-License-Identifier: GPL-2.0-or-later

#include "whatif/consequence_engine.hh"

#include <algorithm>
#include <limits>

#include "whatif/decider.hh"
#include "world/world.hh"

namespace Stg {

bool Judge::NeedsWorld() const { return true; }
void Judge::Begin(World&, size_t) {}
bool Judge::Score(World&, size_t, double*) { return false; }
bool Judge::Watch(const Sighting*, size_t, double*) { return false; }
void Judge::BeginSample(World& world, const Sample& sample) { Begin(world, sample.candidate); }

bool Judge::ScoreSample(World& world, const Sample& sample, SampleResult* result) {
  return Score(world, sample.candidate, &result->score);
}

bool Judge::WatchSample(const Sighting* watched, const Sample& sample, SampleResult* result) {
  return Watch(watched, sample.candidate, &result->score);
}

void Judge::BeginDecision(const DecisionTask&) {}
bool Judge::ScoresFutures() const { return false; }
void Judge::ScoreFutures(const Future*, size_t, SampleResult*) {}

Bounds Judge::Outlook(uint64_t) const {
  const double any = std::numeric_limits<double>::infinity();
  return Bounds(-any, any);
}

struct ConsequenceEngine::Impl {
  Impl(const World& prototype, const Options& options)
      : interval(std::max<usec_t>(1, prototype.sim_interval)),
        watched(options.watched.size()),
        branches(prototype, 0, whatif::OptionsOfBranches(options)),
        decider(options, &branches) {}

  void Begin(const Question& question, uint32_t branch, const Sample& sample);
  whatif::Decider::Task TaskOf(const Question& question, Judge* judge);

  const usec_t interval;
  const size_t watched;
  Branches branches;
  whatif::Decider decider;
};

whatif::Decider::Task ConsequenceEngine::Impl::TaskOf(const Question& question, Judge* judge) {
  whatif::Decider::Task task;
  task.about.candidates = question.candidates.size();
  task.about.steps = question.horizon / interval;
  task.about.interval = static_cast<double>(interval) * 1e-6;
  task.about.watched = watched;
  task.judge = judge;
  task.begin = [&](uint32_t branch, const Sample& sample) { Begin(question, branch, sample); };
  task.name_of = [&](size_t candidate) { return question.candidates[candidate].name; };
  return task;
}

void ConsequenceEngine::Impl::Begin(const Question& question, uint32_t branch,
                                    const Sample& sample) {
  if (question.seed == 0 && sample.number == 0)
    branches.Restore(branch, question.now);
  else
    branches.Restore(branch, question.now, question.seed + sample.number);
  for (const Command& command : question.candidates[sample.candidate].commands)
    branches.Give(branch, command);
}

ConsequenceEngine::ConsequenceEngine(const World& prototype, const Options& options)
    : impl_(new Impl(prototype, options)) {}

ConsequenceEngine::~ConsequenceEngine() = default;

bool ConsequenceEngine::IsReady() const { return impl_->branches.IsReady(); }

std::string ConsequenceEngine::WhyNotClosed() const { return impl_->branches.WhyNotClosed(); }

uint64_t ConsequenceEngine::steps_in_rows() const { return impl_->branches.steps_in_rows(); }

std::string ConsequenceEngine::StepDevice() const { return impl_->branches.StepDevice(); }

std::string ConsequenceEngine::WhyNotOnDevice() const { return impl_->branches.WhyNotOnDevice(); }

uint64_t ConsequenceEngine::steps_on_device() const { return impl_->branches.steps_on_device(); }

Decision ConsequenceEngine::Choose(const Question& question, const Budget& budget, Judge* judge) {
  return impl_->decider.Choose(impl_->TaskOf(question, judge), budget);
}

Decision ConsequenceEngine::Replay(const Question& question, const Decision& decision,
                                   Judge* judge) {
  return impl_->decider.Replay(impl_->TaskOf(question, judge), decision);
}

}  // namespace Stg
