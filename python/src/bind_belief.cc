// SPDX-License-Identifier: GPL-2.0-or-later
//
// Beliefs of robots that are not in the simulator, and decisions about them: see
// stagesim/belief.py, which checks the arguments.

#include <nanobind/ndarray.h>
#include <nanobind/stl/map.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <atomic>
#include <initializer_list>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <sstream>
#include <thread>
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

/// A belief that several threads may use, one at a time. A function that a decision calls must not
/// use it, as the decision does.
class PyBelief {
 public:
  template <typename... Arguments>
  explicit PyBelief(Arguments&... given) : belief_(given...) {}

  /// Calls f(&belief) without the GIL, see Try().
  template <typename F>
  void Use(F f) {
    Try([&] {
      if (user_ == std::this_thread::get_id())
        throw Failure{Kind::kStage,
                      "a function that decides or moves others cannot use its belief, expected it "
                      "to be changed between decisions"};
      const std::lock_guard lock(mutex_);
      const Mark mark(&user_);
      return f(&belief_);
    });
  }

  Belief belief_;

 private:
  /// Says which thread uses the belief, while the object lives.
  class Mark {
   public:
    explicit Mark(std::atomic<std::thread::id>* of) : of_(*of) { of_ = std::this_thread::get_id(); }
    ~Mark() { of_ = std::thread::id(); }
    Mark(const Mark&) = delete;
    Mark& operator=(const Mark&) = delete;

   private:
    std::atomic<std::thread::id>& of_;
  };

  std::mutex mutex_;
  std::atomic<std::thread::id> user_;
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

/// `sizes`: radius, height and room by kind of others.
std::shared_ptr<PyBelief> MakeBelief(const std::string& file,
                                     const std::optional<std::string>& text,
                                     const std::map<std::string, nb::bytes>& pictures,
                                     const std::string& robot, const Numbers& lengths,
                                     const Numbers& origin, const Table& sizes,
                                     const std::vector<std::string>& bodies, uint32_t rows,
                                     uint32_t columns, bool others_clear_cells) {
  Check(lengths.size() == 2 && origin.size() == 3 && sizes.shape(1) == 3 &&
        sizes.shape(0) == bodies.size());
  Belief::Options options;
  options.resolution = lengths(0);
  options.wall_height = lengths(1);
  options.others_clear_cells = others_clear_cells;
  options.kinds.clear();
  for (size_t i = 0; i < bodies.size(); i++) {
    const double* const size = &sizes(i, 0);
    options.kinds.emplace_back(size[0], size[1], static_cast<uint32_t>(size[2]));
    options.kinds.back().body = bodies[i];
  }
  options.origin = PoseAt(origin.data());
  options.rows = rows;
  options.columns = columns;
  std::map<std::string, std::string> contents;
  for (const auto& [name, content] : pictures)
    contents.emplace(name, std::string(content.c_str(), content.size()));
  options.pictures =
      std::make_shared<const std::map<std::string, std::string>>(std::move(contents));
  std::shared_ptr<PyBelief> made;
  Try([&] {
    if (text) {
      std::istringstream content(*text);
      made = std::make_shared<PyBelief>(content, file, robot, options);
    } else {
      made = std::make_shared<PyBelief>(file, robot, options);
    }
    return made->belief_.IsReady();
  });
  return made;
}

void SetRobot(PyBelief& to, const Numbers& numbers) {
  Check(numbers.size() == 24);
  const double* const at = numbers.data();
  to.Use([&](Belief* belief) {
    return belief->SetRobot(PoseAt(at), VelocityAt(at + 3), CovarianceAt(at + 6),
                            CovarianceAt(at + 15));
  });
}

/// Appends x, y and heading.
void AddPose(const Pose& pose, std::vector<double>* to) {
  to->insert(to->end(), {pose.x, pose.y, pose.a});
}

/// Sightings of futures as arrays: x, y, heading; velocities; stalls.
struct SightingArrays {
  void Add(const Sighting* seen, size_t models) {
    for (size_t i = 0; i < models; i++) {
      AddPose(seen[i].pose, &poses);
      AddPose(seen[i].velocity, &velocities);
      stalled.push_back(seen[i].stalled);
    }
  }

  std::vector<double> poses, velocities;
  std::vector<uint8_t> stalled;
};

/// An array of this shape with the content of a vector, which it keeps. The caller holds the GIL.
template <typename T>
nb::object ArrayOf(std::vector<T> values, std::initializer_list<size_t> shape) {
  auto* const kept = new std::vector<T>(std::move(values));
  const nb::capsule owner(kept, [](void* of) noexcept { delete static_cast<std::vector<T>*>(of); });
  return nb::cast(nb::ndarray<nb::numpy, T>(kept->data(), shape, owner));
}

/// A hypothesis that is a Python function: see stagesim.Behaviour. The Python object of the belief
/// keeps the function, so that the garbage collector sees cycles.
class PyRule : public BehaviourRule {
 public:
  explicit PyRule(nb::handle function) : function_(function) {}

  void Move(const Moment* moments, size_t count, size_t others, Velocity* velocities) override {
    std::vector<double> poses;
    std::vector<int64_t> own(count), samples(count), plans(count);
    std::vector<uint64_t> ids(count);
    std::vector<double> times(count);
    for (size_t i = 0; i < count; i++) {
      for (size_t k = 0; k <= others; k++) AddPose(moments[i].seen[k].pose, &poses);
      own[i] = static_cast<int64_t>(moments[i].own);
      plans[i] = static_cast<int64_t>(moments[i].sample.candidate);
      samples[i] = moments[i].sample.number;
      ids[i] = moments[i].id;
      times[i] = moments[i].time;
    }
    const nb::gil_scoped_acquire gil;
    const nb::object found = function_(
        ArrayOf(std::move(poses), {count, 1 + others, 3}), ArrayOf(std::move(own), {count}),
        ArrayOf(std::move(ids), {count}), ArrayOf(std::move(plans), {count}),
        ArrayOf(std::move(samples), {count}), ArrayOf(std::move(times), {count}));
    const auto table = nb::cast<Table>(found);
    Check(table.shape(0) == count && table.shape(1) == 3);
    for (size_t i = 0; i < count; i++) velocities[i] = VelocityAt(&table(i, 0));
  }

 private:
  const nb::handle function_;
};

/// Replaces all others. `numbers`: pose, velocity and their covariances by other; `behaviours`:
/// number of the other, kind, weight, x, y, speed; `by`: for each of these a controller, a function
/// or None, which the caller keeps until it replaces the others again. If one is refused, nobody is
/// tracked.
void SetOthers(PyBelief& to, const Ids& ids, const Table& numbers, const Ids& kinds,
               const Table& behaviours, const nb::list& by) {
  Check(numbers.shape(0) == ids.size() && numbers.shape(1) == 24 && behaviours.shape(1) == 6 &&
        kinds.size() == ids.size() && by.size() == behaviours.shape(0));
  std::vector<TrackedOther> others;
  std::map<PyObject*, std::shared_ptr<BehaviourRule>> rules;
  for (size_t i = 0; i < ids.size(); i++) {
    const double* const at = numbers.data() + 24 * i;
    TrackedOther& other = others.emplace_back(ids(i));
    other.kind = static_cast<uint32_t>(kinds(i));
    other.pose = PoseAt(at);
    other.velocity = VelocityAt(at + 3);
    other.pose_covariance = CovarianceAt(at + 6);
    other.velocity_covariance = CovarianceAt(at + 15);
  }
  for (size_t k = 0; k < behaviours.shape(0); k++) {
    const double* const at = behaviours.data() + 6 * k;
    const auto i = static_cast<size_t>(at[0]);
    Check(at[0] >= 0 && i < others.size() && at[1] >= 0 && at[1] <= double{Behaviour::kRule});
    Behaviour behaviour(static_cast<Behaviour::Kind>(static_cast<int>(at[1])), at[3], at[4], at[5],
                        at[2]);
    if (behaviour.kind == Behaviour::kController)
      behaviour.controller = nb::cast<std::string>(by[k]);
    if (behaviour.kind == Behaviour::kRule) {
      const nb::object function = by[k];
      std::shared_ptr<BehaviourRule>& rule = rules[function.ptr()];
      if (!rule) rule = std::make_shared<PyRule>(function);
      behaviour.rule = rule;
    }
    others[i].behaviours.push_back(behaviour);
  }
  to.Use([&](Belief* belief) {
    belief->ClearOthers();
    const bool are_set = std::ranges::all_of(
        others, [&](const TrackedOther& other) { return belief->SetOther(other); });
    if (!are_set) belief->ClearOthers();
    return are_set;
  });
}

/// A judge that is a Python function: see ConsequenceEngine.choose.
class PyJudge : public Judge {
 public:
  /// The function must outlive this.
  explicit PyJudge(nb::handle function) : function_(function) {}

  bool NeedsWorld() const override { return false; }
  bool ScoresFutures() const override { return true; }
  void BeginDecision(const DecisionTask& task) override { task_ = task; }
  void ScoreFutures(const Future* futures, size_t count, SampleResult* results) override;

 private:
  const nb::handle function_;
  DecisionTask task_;
};

void PyJudge::ScoreFutures(const Future* futures, size_t count, SampleResult* results) {
  if (count == 0) return;
  // No future ends before the others do.
  const auto steps = static_cast<size_t>(futures[0].steps);
  const size_t models = 1 + task_.other_radii.size();
  SightingArrays seen;
  std::vector<int64_t> plans(count), samples(count);
  for (size_t i = 0; i < count; i++) {
    for (size_t step = 0; step < steps; step++)
      seen.Add(futures[i].sightings + step * task_.watched, models);
    plans[i] = static_cast<int64_t>(futures[i].sample.candidate);
    samples[i] = futures[i].sample.number;
  }
  const nb::gil_scoped_acquire gil;
  const nb::object found = function_(
      ArrayOf(std::move(seen.poses), {count, steps, models, 3}),
      ArrayOf(std::move(seen.velocities), {count, steps, models, 3}),
      ArrayOf(std::move(seen.stalled), {count, steps, models}),
      ArrayOf(std::vector<double>(task_.other_radii), {task_.other_radii.size()}),
      ArrayOf(std::move(plans), {count}), ArrayOf(std::move(samples), {count}), task_.interval);
  const auto table = nb::cast<Table>(found);
  Check(table.shape(0) == count && table.shape(1) == 2);
  for (size_t i = 0; i < count; i++) {
    results[i].score = table(i, 0);
    results[i].collided = table(i, 1) != 0;
  }
}

/// A question as Python asks it.
struct Asked {
  BeliefQuestion question;
  nb::object judge;  // a function; None: that of the goal
  double goal_x, goal_y, radius, penalty, tolerance;
  Budget budget;
};

class PyEngine {
 public:
  PyEngine(std::shared_ptr<PyBelief> belief, const BeliefEngine::Options& options)
      : belief_(std::move(belief)) {
    belief_->Use([&](Belief* of) {
      engine_ = std::make_unique<BeliefEngine>(of, options);
      return engine_->IsReady();
    });
  }
  std::string device() const { return engine_->StepDevice(); }
  size_t watched() const { return engine_->watched(); }

  /// `earlier`: a decision to be repeated; null: a new one.
  Decision Decide(const Asked& asked, const Decision* earlier) {
    Decision decision;
    GoalJudge to_goal(asked.goal_x, asked.goal_y, asked.radius, asked.penalty, asked.tolerance);
    std::unique_ptr<PyJudge> own;
    if (!asked.judge.is_none()) own = std::make_unique<PyJudge>(asked.judge);
    Judge* const judge = own ? static_cast<Judge*>(own.get()) : &to_goal;
    belief_->Use([&](Belief*) {
      decision = earlier ? engine_->Replay(asked.question, *earlier, judge)
                         : engine_->Choose(asked.question, asked.budget, judge);
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
  return std::make_shared<PyEngine>(belief, options);
}

Asked AskedOf(const Plans& plans, const Numbers& numbers, const nb::object& judge, uint64_t steps,
              uint64_t seed) {
  Check(numbers.size() == 10);
  Asked asked{{},         judge,      numbers(0), numbers(1),
              numbers(2), numbers(3), numbers(4), Budget(numbers(7))};
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
    AddPose(sighting.pose, &numbers);
  return numbers;
}

}  // namespace

void BindBelief(nb::module_& module) {
  using namespace nb::literals;
  nb::class_<PyBelief>(module, "Belief")
      .def("set_robot", &SetRobot, "numbers"_a)
      .def("set_others", &SetOthers, "ids"_a, "numbers"_a, "kinds"_a, "behaviours"_a, "by"_a)
      .def(
          "set_grid",
          [](PyBelief& to, const Cells& cells) {
            to.Use([&](Belief* belief) { return belief->SetGrid(cells.data(), cells.size()); });
          },
          "cells"_a)
      .def(
          "set_delay",
          [](PyBelief& to, double seconds) {
            to.Use([&](Belief* belief) { return belief->SetDelay(seconds); });
          },
          "seconds"_a);
  module.def("make_belief", &MakeBelief, "file"_a, "text"_a, "pictures"_a, "robot"_a, "lengths"_a,
             "origin"_a, "sizes"_a, "bodies"_a, "rows"_a, "columns"_a, "others_clear_cells"_a);
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
          [](PyEngine& engine, const Plans& plans, const Numbers& numbers, const nb::object& judge,
             uint64_t steps, uint64_t seed) {
            return engine.Decide(AskedOf(plans, numbers, judge, steps, seed), nullptr);
          },
          "plans"_a, "numbers"_a, "judge"_a.none(), "steps"_a, "seed"_a)
      .def(
          "replay",
          [](PyEngine& engine, const Plans& plans, const Numbers& numbers, const nb::object& judge,
             uint64_t steps, uint64_t seed, const Decision& decision) {
            return engine.Decide(AskedOf(plans, numbers, judge, steps, seed), &decision);
          },
          "plans"_a, "numbers"_a, "judge"_a.none(), "steps"_a, "seed"_a, "decision"_a);
  module.def("make_engine", &MakeEngine, "belief"_a, "samples"_a, "most_samples"_a, "preference"_a,
             "numbers"_a, "threads"_a, "device"_a, "on_device"_a);
}

}  // namespace Stg::python
