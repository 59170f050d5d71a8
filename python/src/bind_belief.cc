// SPDX-License-Identifier: GPL-2.0-or-later
//
// Beliefs of robots that are not in the simulator, and decisions about them: see
// stagesim/belief.py, which checks the arguments.

#include <nanobind/ndarray.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <memory>
#include <mutex>
#include <vector>

#include "bindings.hh"
#include "failure.hh"
#include "gil.hh"
#include "whatif/belief.hh"

namespace Stg::python {

namespace {

using Numbers = nb::ndarray<const double, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using Table = nb::ndarray<const double, nb::ndim<2>, nb::c_contig, nb::device::cpu>;
using Ids = nb::ndarray<const uint64_t, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using Cells = nb::ndarray<const uint8_t, nb::ndim<2>, nb::c_contig, nb::device::cpu>;
using Plans = nb::ndarray<const double, nb::shape<-1, -1, 3>, nb::c_contig, nb::device::cpu>;

/// Calls f() without the GIL, and logs its messages. If it returns false, they become an exception.
template <typename F>
void Try(F f) {
  Logged([&] {
    const GilRelease released;
    const ErrorCollector collector;
    if (!f()) throw Failure{Kind::kStage, collector.Last("the belief cannot be changed")};
  });
}

/// A belief that several threads may use, one at a time.
class PyBelief {
 public:
  PyBelief(const std::string& file, const std::string& robot, const Belief::Options& options)
      : belief_(file, robot, options) {}

  template <typename F>
  void Change(F f) {
    Try([&] {
      const std::lock_guard lock(mutex_);
      return f(&belief_);
    });
  }

  Belief belief_;
  std::mutex mutex_;
};

Pose PoseAt(const double* numbers) { return Pose(numbers[0], numbers[1], 0, numbers[2]); }
Velocity VelocityAt(const double* numbers) {
  return Velocity(numbers[0], numbers[1], 0, numbers[2]);
}
Covariance CovarianceAt(const double* numbers) {
  Covariance covariance;
  std::copy(numbers, numbers + 9, covariance.values);
  return covariance;
}

/// Throws ValueError unless the tables have a row for each id, or the length is as wanted.
void Check(bool is_right) {
  if (!is_right) throw nb::value_error("found an array of another shape");
}

std::shared_ptr<PyBelief> MakeBelief(const std::string& file, const std::string& robot,
                                     const Numbers& lengths, const Numbers& origin, uint32_t room,
                                     uint32_t rows, uint32_t columns) {
  Check(lengths.size() == 4 && origin.size() == 3);
  Belief::Options options;
  options.other_radius = lengths(0);
  options.other_height = lengths(1);
  options.resolution = lengths(2);
  options.wall_height = lengths(3);
  options.origin = PoseAt(origin.data());
  options.room = room;
  options.rows = rows;
  options.columns = columns;
  std::shared_ptr<PyBelief> made;
  Try([&] {
    made = std::make_shared<PyBelief>(file, robot, options);
    return made->belief_.IsReady();
  });
  return made;
}

void SetRobot(PyBelief& to, const Numbers& numbers) {
  Check(numbers.size() == 24);
  const double* const at = numbers.data();
  to.Change([&](Belief* belief) {
    return belief->SetRobot(PoseAt(at), VelocityAt(at + 3), CovarianceAt(at + 6),
                            CovarianceAt(at + 15));
  });
}

/// Replaces all others. `numbers`: pose, velocity and their covariances by other; `behaviours`:
/// number of the other, kind, weight, x, y, speed. If one is refused, the others stay forgotten.
void SetOthers(PyBelief& to, const Ids& ids, const Table& numbers, const Table& behaviours) {
  Check(numbers.shape(0) == ids.size() && numbers.shape(1) == 24 && behaviours.shape(1) == 6);
  std::vector<TrackedOther> others;
  for (size_t i = 0; i < ids.size(); i++) {
    const double* const at = numbers.data() + 24 * i;
    TrackedOther& other = others.emplace_back(ids(i));
    other.pose = PoseAt(at);
    other.velocity = VelocityAt(at + 3);
    other.pose_covariance = CovarianceAt(at + 6);
    other.velocity_covariance = CovarianceAt(at + 15);
  }
  for (size_t k = 0; k < behaviours.shape(0); k++) {
    const double* const at = behaviours.data() + 6 * k;
    const auto i = static_cast<size_t>(at[0]);
    Check(at[0] >= 0 && i < others.size() && at[1] >= 0 && at[1] < 5);
    Behaviour behaviour(static_cast<Behaviour::Kind>(static_cast<int>(at[1])), at[3], at[4], at[5],
                        at[2]);
    others[i].behaviours.push_back(behaviour);
  }
  to.Change([&](Belief* belief) {
    belief->ClearOthers();
    return std::ranges::all_of(others,
                               [&](const TrackedOther& other) { return belief->SetOther(other); });
  });
}

/// A question as Python asks it.
struct Asked {
  BeliefQuestion question;
  double goal_x, goal_y, radius, penalty, tolerance;
  Budget budget;
};

class PyEngine {
 public:
  PyEngine(std::shared_ptr<PyBelief> belief, const BeliefEngine::Options& options)
      : belief_(std::move(belief)) {
    const std::lock_guard lock(belief_->mutex_);
    engine_ = std::make_unique<BeliefEngine>(&belief_->belief_, options);
  }
  bool IsReady() const { return engine_->IsReady(); }
  std::string device() const { return engine_->StepDevice(); }
  size_t watched() const { return engine_->watched(); }

  /// `earlier`: a decision to be repeated; null: a new one.
  Decision Decide(const Asked& asked, const Decision* earlier) {
    Decision decision;
    Try([&] {
      const std::lock_guard lock(belief_->mutex_);
      GoalJudge judge(asked.goal_x, asked.goal_y, asked.radius, asked.penalty, asked.tolerance);
      decision = earlier ? engine_->Replay(asked.question, *earlier, &judge)
                         : engine_->Choose(asked.question, asked.budget, &judge);
      return true;
    });
    if (!decision.error.empty()) throw Failure{Kind::kStage, decision.error};
    return decision;
  }

 private:
  std::shared_ptr<PyBelief> belief_;
  std::unique_ptr<BeliefEngine> engine_;
};

std::shared_ptr<PyEngine> MakeEngine(const std::shared_ptr<PyBelief>& belief, uint32_t samples,
                                     uint32_t most_samples, int preference, const Numbers& numbers,
                                     unsigned threads, const std::string& device, bool on_device) {
  Check(numbers.size() == 4);
  BeliefEngine::Options options;
  options.samples = samples;
  options.most_samples = most_samples;
  options.preference.kind = static_cast<Preference::Kind>(preference);
  options.preference.quantile = numbers(0);
  options.preference.max_risk = numbers(1);
  options.indifference = numbers(2);
  options.errors = numbers(3);
  options.threads = threads;
  options.device_steps = on_device;
  options.device_choice = device;
  std::shared_ptr<PyEngine> made;
  Try([&] {
    made = std::make_shared<PyEngine>(belief, options);
    return made->IsReady();
  });
  return made;
}

Asked AskedOf(const Plans& plans, const Numbers& numbers, uint64_t steps, uint64_t seed) {
  Check(numbers.size() == 10);
  Asked asked{{}, numbers(0), numbers(1), numbers(2), numbers(3), numbers(4), Budget(numbers(7))};
  asked.question.horizon = static_cast<usec_t>(numbers(5) * 1e6 + 0.5);
  asked.question.hold = static_cast<usec_t>(numbers(6) * 1e6 + 0.5);
  asked.question.seed = seed;
  asked.budget.joules = numbers(8);
  asked.budget.watts = numbers(9);
  asked.budget.scenario_steps = steps;
  for (size_t i = 0; i < plans.shape(0); i++) {
    Plan plan("number " + std::to_string(i));
    plan.commands.clear();
    for (size_t k = 0; k < plans.shape(1); k++)
      plan.commands.push_back(VelocityAt(&plans(i, k, 0)));
    asked.question.plans.push_back(std::move(plan));
  }
  return asked;
}

/// Poses that the first sample of a candidate has seen: x, y, heading by step and watched model.
std::vector<double> FutureOf(const Decision& decision, size_t plan) {
  std::vector<double> numbers;
  for (const Sighting& sighting : decision.outcomes.at(plan).sightings)
    numbers.insert(numbers.end(), {sighting.pose.x, sighting.pose.y, sighting.pose.a});
  return numbers;
}

}  // namespace

void BindBelief(nb::module_& module) {
  using namespace nb::literals;
  nb::class_<PyBelief>(module, "Belief")
      .def("set_robot", &SetRobot, "numbers"_a)
      .def("set_others", &SetOthers, "ids"_a, "numbers"_a, "behaviours"_a)
      .def(
          "set_grid",
          [](PyBelief& to, const Cells& cells) {
            to.Change([&](Belief* belief) { return belief->SetGrid(cells.data(), cells.size()); });
          },
          "cells"_a)
      .def(
          "set_delay",
          [](PyBelief& to, double seconds) {
            to.Change([&](Belief* belief) { return belief->SetDelay(seconds); });
          },
          "seconds"_a);
  module.def("make_belief", &MakeBelief, "file"_a, "robot"_a, "lengths"_a, "origin"_a, "room"_a,
             "rows"_a, "columns"_a);
  nb::class_<Decision>(module, "Decision")
      .def_ro("best", &Decision::best)
      .def_ro("samples", &Decision::samples)
      .def_ro("scenario_steps", &Decision::scenario_steps)
      .def_ro("seconds", &Decision::seconds)
      .def_ro("joules", &Decision::joules)
      .def_ro("complete", &Decision::complete)
      .def_prop_ro("reason", [](const Decision& of) { return static_cast<int>(of.reason); })
      .def_prop_ro("scores",
                   [](const Decision& of) {
                     std::vector<std::vector<double>> all;
                     for (const Outcome& outcome : of.outcomes) all.push_back(outcome.scores);
                     return all;
                   })
      .def_prop_ro("collided",
                   [](const Decision& of) {
                     std::vector<std::vector<uint8_t>> all;
                     for (const Outcome& outcome : of.outcomes) all.push_back(outcome.collided);
                     return all;
                   })
      .def_prop_ro("intervals",
                   [](const Decision& of) {
                     std::vector<std::pair<double, double>> all;
                     for (const Outcome& outcome : of.outcomes) {
                       const Interval found = outcome.CollisionInterval();
                       all.emplace_back(found.low, found.high);
                     }
                     return all;
                   })
      .def("future", &FutureOf, "plan"_a);
  nb::class_<PyEngine>(module, "ConsequenceEngine")
      .def_prop_ro("device", &PyEngine::device)
      .def_prop_ro("watched", &PyEngine::watched)
      .def(
          "choose",
          [](PyEngine& engine, const Plans& plans, const Numbers& numbers, uint64_t steps,
             uint64_t seed) {
            return engine.Decide(AskedOf(plans, numbers, steps, seed), nullptr);
          },
          "plans"_a, "numbers"_a, "steps"_a, "seed"_a)
      .def(
          "replay",
          [](PyEngine& engine, const Plans& plans, const Numbers& numbers, uint64_t steps,
             uint64_t seed, const Decision& decision) {
            return engine.Decide(AskedOf(plans, numbers, steps, seed), &decision);
          },
          "plans"_a, "numbers"_a, "steps"_a, "seed"_a, "decision"_a);
  module.def("make_engine", &MakeEngine, "belief"_a, "samples"_a, "most_samples"_a, "preference"_a,
             "numbers"_a, "threads"_a, "device"_a, "on_device"_a);
}

}  // namespace Stg::python
