// SPDX-License-Identifier: GPL-2.0-or-later

#include <algorithm>
#include <cmath>

#include "geometry/load_error.hh"
#include "geometry/trigonometry.hh"
#include "whatif/belief.hh"
#include "whatif/belief_sampler.hh"
#include "whatif/branches_impl.hh"
#include "whatif/decider.hh"
#include "worlds/pool_scene.hh"

namespace Stg {

struct BeliefEngine::Impl {
  /// Everything that depends on the number of others that there is room for.
  struct Room {
    uint32_t others;
    std::unique_ptr<World> world;
    std::vector<uint32_t> ids;  // of the robot, and of all others
    std::unique_ptr<Branches> branches;
    std::unique_ptr<whatif::Decider> decider;
    Subscriptions* subscriptions = nullptr;
    uint64_t version_of_cells = UINT64_MAX;  // of the belief's that the scene has
    std::unique_ptr<whatif::BeliefSampler> sampler;
    std::vector<std::shared_ptr<BranchAccess::Origin>> samples;  // that have been drawn
    std::string error;
  };

  Impl(Belief* of, const Options& wanted) : belief(*of), options(wanted) {
    if (belief.IsReady()) MakeRoom();
  }

  void MakeRoom();
  std::string FindMovers(Room* to) const;
  std::string TakeGrid();
  rows::Rows* RowsOf(uint32_t sample);
  std::string WhyNot(const BeliefQuestion& question, const Judge& judge);
  void Begin(const BeliefQuestion& question, uint32_t branch, const Sample& sample);
  template <typename F>
  Decision With(const BeliefQuestion& question, Judge* judge, F decide);
  void Prepare(GoalJudge* judge, uint64_t steps) const;
  const whatif::BeliefContent& believed() const { return *belief.impl_; }
  usec_t interval() const { return std::max<usec_t>(1, room->world->sim_interval); }
  uint64_t StepsOf(double seconds) const {
    return static_cast<uint64_t>(std::ceil(seconds * 1e6 / static_cast<double>(interval()) - 1e-9));
  }

  Belief& belief;
  const Options options;
  std::unique_ptr<Room> room;
  uint32_t drawn = 0;  // samples of this decision
};

/// Makes room for as many others as the belief has.
void BeliefEngine::Impl::MakeRoom() {
  auto made = std::make_unique<Room>();
  made->others = believed().room;
  made->world = believed().MakeWorld(made->others);
  if (!made->world) {
    made->error = "the world cannot be loaded any more";
    room = std::move(made);
    return;
  }
  made->ids.push_back(made->world->GetModel(believed().robot_name)->GetId());
  for (uint32_t i = 0; i < made->others; i++)
    made->ids.push_back(made->world->GetModel(whatif::BeliefContent::NameOf(i))->GetId());
  Options with_watched = options;
  with_watched.watched = made->ids;
  with_watched.keep = Snapshot::kLean;
  BranchOptions of_branches = whatif::OptionsOfBranches(with_watched);
  if (believed().HasGrid()) of_branches.changing_map = whatif::BeliefContent::kMapName;
  made->branches = std::make_unique<Branches>(*made->world, 0, of_branches);
  made->decider = std::make_unique<whatif::Decider>(with_watched, made->branches.get());
  made->error = made->branches->IsReady() ? FindMovers(made.get()) : "there is no such device";
  room = std::move(made);
}

/// Returns why there are no rows, or "".
std::string BeliefEngine::Impl::FindMovers(Room* to) const {
  std::string reason;
  WorldPool& pool = BranchAccess::PoolOf(*to->branches);
  std::vector<uint32_t> silent;
  if (to->world->FindModel(to->ids[0])->GetSubscriptionCount() == 0) silent.push_back(to->ids[0]);
  to->subscriptions = PoolAccess::FindSubscriptions(pool, 0, silent, &reason);
  if (!to->subscriptions)
    return "futures cannot be simulated in rows, because " + reason + "; remove that from " +
           believed().file;
  std::vector<uint32_t> movers;
  const rows::Scene& scene = *to->subscriptions->scene();
  for (const uint32_t id : to->ids) {
    const std::optional<uint32_t> mover = scene.FindMover(id);
    if (!mover || !scene.movers[*mover].robot)
      return "the robot is a part of another model; take it out of that";
    movers.push_back(*mover);
  }
  to->sampler = std::make_unique<whatif::BeliefSampler>(
      movers[0], std::vector<uint32_t>(movers.begin() + 1, movers.end()));
  return "";
}

/// Brings the cells of the belief into the scene. Nothing is simulated meanwhile. Returns why that
/// is impossible, or "".
std::string BeliefEngine::Impl::TakeGrid() {
  if (!belief.IsReady()) return "the belief is not ready";
  if (room->others < believed().room) MakeRoom();
  if (!room->error.empty()) return room->error;
  if (!believed().HasGrid() || room->version_of_cells == believed().version_of_cells) return "";
  try {
    const bool has_changed = room->subscriptions->map()->Set(believed().cells);
    if (has_changed && !room->branches->StepDevice().empty())
      PoolAccess::ForgetDeviceStates(BranchAccess::PoolOf(*room->branches));
  } catch (const LoadError& error) {
    return error.what();
  }
  room->version_of_cells = believed().version_of_cells;
  return "";
}

/// The row of a sample.
rows::Rows* BeliefEngine::Impl::RowsOf(uint32_t sample) {
  while (room->samples.size() <= sample) {
    SnapshotRow row;
    row.subscriptions = room->subscriptions;
    const uint64_t seed = 1;
    row.rows = std::make_unique<rows::Rows>(room->subscriptions->scene(), std::span(&seed, 1));
    room->samples.push_back(std::make_shared<BranchAccess::Origin>(std::move(row)));
  }
  return room->samples[sample]->row.rows.get();
}

/// Why there can be no decision, or "".
std::string BeliefEngine::Impl::WhyNot(const BeliefQuestion& question, const Judge& judge) {
  if (const std::string error = TakeGrid(); !error.empty()) return error;
  if (judge.NeedsWorld()) return "the judge needs a World, expected one that only watches";
  if (question.plans.empty()) return "there are no plans";
  const bool is_omni = room->sampler->robot_is_omni(*RowsOf(0));
  for (const Plan& plan : question.plans)
    for (const Velocity& each : plan.commands) {
      const std::string in_plan = " in the plan \"" + plan.name + "\"";
      if (!std::isfinite(each.x) || !std::isfinite(each.y) || !std::isfinite(each.a))
        return "found a velocity that is not finite" + in_plan;
      if (each.y != 0 && !is_omni)
        return "found a velocity sideways" + in_plan + ", expected 0: the robot cannot obey it";
    }
  return room->sampler->WhyNotFree(believed(), RowsOf(0));
}

/// Starts a future from its sample. All plans of a sample begin together, so it is drawn once.
void BeliefEngine::Impl::Begin(const BeliefQuestion& question, uint32_t branch,
                               const Sample& sample) {
  rows::Rows* const row = RowsOf(sample.number);
  if (sample.number >= drawn) {
    room->sampler->Draw(believed(), question.seed, sample.number, row);
    drawn = sample.number + 1;
  }
  BranchAccess::Restore(*room->branches, branch, room->samples[sample.number], sample.number == 0);
  uint64_t step = StepsOf(believed().delay);
  const uint64_t hold = std::max<uint64_t>(1, question.hold / interval());
  for (const Velocity& each : question.plans[sample.candidate].commands) {
    room->branches->Give(branch,
                         Command(step, room->ids[0], Command::kSetSpeed, each.x, each.y, each.a));
    step += hold;
  }
}

template <typename F>
Decision BeliefEngine::Impl::With(const BeliefQuestion& question, Judge* judge, F decide) {
  Decision decision;
  decision.error = WhyNot(question, *judge);
  if (!decision.error.empty()) return decision;
  const uint64_t steps = question.horizon / interval();
  if (auto* const to_goal = dynamic_cast<GoalJudge*>(judge)) Prepare(to_goal, steps);
  drawn = 0;
  try {
    return decide({question.plans.size(), steps, judge, [&](uint32_t branch, const Sample& sample) {
                     Begin(question, branch, sample);
                   }});
  } catch (const LoadError& error) {  // of populations, which do not fit with this seed
    decision.error = error.what();
    return decision;
  }
}

void BeliefEngine::Impl::Prepare(GoalJudge* judge, uint64_t steps) const {
  judge->share_ = 1 / static_cast<double>(std::max<uint64_t>(1, steps));
  judge->others_ = believed().others.size();
  judge->other_radius_ = believed().options.other_radius;
}

BeliefEngine::BeliefEngine(Belief* belief, const Options& options)
    : impl_(new Impl(belief, options)) {}

BeliefEngine::~BeliefEngine() = default;

bool BeliefEngine::IsReady() const { return impl_->room && impl_->room->error.empty(); }

std::string BeliefEngine::TakeGrid() { return impl_->TakeGrid(); }

Decision BeliefEngine::Choose(const BeliefQuestion& question, const Budget& budget, Judge* judge) {
  return impl_->With(question, judge, [&](const whatif::Decider::Task& task) {
    return impl_->room->decider->Choose(task, budget);
  });
}

Decision BeliefEngine::Replay(const BeliefQuestion& question, const Decision& decision,
                              Judge* judge) {
  return impl_->With(question, judge, [&](const whatif::Decider::Task& task) {
    return impl_->room->decider->Replay(task, decision);
  });
}

size_t BeliefEngine::watched() const { return IsReady() ? impl_->room->ids.size() : 0; }

std::string BeliefEngine::StepDevice() const {
  return IsReady() ? impl_->room->branches->StepDevice() : "";
}

uint64_t BeliefEngine::steps_on_device() const {
  return IsReady() ? impl_->room->branches->steps_on_device() : 0;
}

// ---- the usual judge ----------------------------------------------------------------------------

GoalJudge::GoalJudge(double x, double y, double radius, double penalty, double tolerance)
    : x_(x), y_(y), radius_(radius), penalty_(penalty), tolerance_(tolerance) {}

bool GoalJudge::WatchSample(const Sighting* watched, const Sample&, SampleResult* result) {
  const Pose& robot = watched[0].pose;
  const double distance = Hypotenuse(x_ - robot.x, y_ - robot.y);
  result->score -= distance * share_;
  // A robot that stands is not stalled if somebody runs into it, but the other one is.
  constexpr double kNear = 0.02;  // m
  const double near = radius_ + other_radius_ + kNear;
  bool touches = watched[0].stalled;
  for (size_t i = 1; i <= others_ && !touches; i++)
    touches = watched[i].stalled &&
              Hypotenuse(watched[i].pose.x - robot.x, watched[i].pose.y - robot.y) < near;
  if (touches) {
    result->collided = true;
    result->score -= penalty_;
  }
  return touches || distance < tolerance_;
}

}  // namespace Stg
