// SPDX-License-Identifier: GPL-2.0-or-later

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "geometry/load_error.hh"
#include "messages/report.hh"
#include "whatif/belief.hh"
#include "whatif/belief_sampler.hh"
#include "whatif/branches_impl.hh"
#include "whatif/decider.hh"
#include "whatif/ordered_judge.hh"
#include "whatif/ruled_others.hh"
#include "worlds/pool_scene.hh"

namespace Stg {

struct BeliefEngine::Impl {
  /// A sample that has been drawn.
  struct Drawn {
    std::shared_ptr<BranchAccess::Origin> origin;
    whatif::DrawnOthers who;
    /// Places of the robot, of all others, and of the rest among the watched; not set if these are
    /// 0, 1, 2, ...
    std::vector<uint32_t> order;
    std::vector<Sighting> sightings;  // before the first step, if rules move somebody
  };
  /// Everything that depends on the groups of others that there is room for.
  struct Room {
    uint64_t version_of_groups;  // of the belief, when it was last looked at
    std::unique_ptr<World> world;
    std::vector<uint32_t> ids;  // of the robot, and of all others in the order of groups
    std::unique_ptr<Branches> branches;
    std::unique_ptr<whatif::Decider> decider;
    std::unique_ptr<whatif::RuledOthers> ruled;
    Subscriptions* subscriptions = nullptr;
    uint64_t version_of_cells = UINT64_MAX;  // of the belief's that the scene has
    std::unique_ptr<whatif::BeliefSampler> sampler;
    std::vector<Drawn> samples;
    std::string error;
  };

  Impl(Belief* of, const Options& wanted) : belief(*of), options(wanted) {
    if (!belief.IsReady()) return;
    MakeRoom();
    if (!room->error.empty()) messages::Report(LogLevel::kError, "stage: " + room->error);
  }

  void MakeRoom();
  void FillRoom(const std::vector<whatif::BeliefContent::Group>& groups, Room* to) const;
  std::string FindMovers(const std::vector<whatif::BeliefContent::Group>& groups, Room* to) const;
  bool NeedsRoom() const;
  std::string TakeGrid();
  rows::Rows* RowsOf(uint32_t sample);
  std::string WhyNot(const BeliefQuestion& question, const Judge& judge);
  void SetOrder(Drawn* of) const;
  void Draw(const BeliefQuestion& question, uint32_t sample);
  void Begin(const BeliefQuestion& question, uint32_t branch, const Sample& sample, bool records);
  void MoveRuledOthers();
  DecisionTask TaskOf(const BeliefQuestion& question) const;
  template <typename F>
  Decision With(const BeliefQuestion& question, Judge* judge, F decide);
  template <typename F>
  Decision Decide(const BeliefQuestion& question, Judge* judge, F decide);
  const whatif::BeliefContent& believed() const { return *belief.impl_; }
  usec_t interval() const { return std::max<usec_t>(1, room->world->sim_interval); }
  double seconds() const { return static_cast<double>(interval()) * 1e-6; }
  uint64_t StepsOf(double duration) const {
    return static_cast<uint64_t>(std::ceil(duration / seconds() - 1e-9));
  }

  Belief& belief;
  const Options options;
  std::unique_ptr<Room> room;
  uint32_t drawn = 0;                               // samples of this decision
  std::vector<whatif::RuledOthers::Living> living;  // buffer
};

bool BeliefEngine::Impl::NeedsRoom() const {
  if (room->version_of_groups == believed().version_of_groups) return false;
  return !room->error.empty() || !room->sampler->Fits(believed());
}

/// Makes room for all others that the belief has.
void BeliefEngine::Impl::MakeRoom() {
  std::vector<whatif::BeliefContent::Group> groups = believed().groups;
  std::erase_if(groups, [](const auto& group) { return group.used == 0 && !group.is_first(); });
  auto made = std::make_unique<Room>();
  FillRoom(groups, made.get());
  made->version_of_groups = believed().version_of_groups;
  room = std::move(made);
}

void BeliefEngine::Impl::FillRoom(const std::vector<whatif::BeliefContent::Group>& groups,
                                  Room* to) const {
  messages::Collector collector;
  to->world = believed().MakeWorld(groups);
  if (!to->world) {
    to->error = "the world of the belief cannot be loaded" +
                (collector.lines.empty() ? "" : ": " + collector.lines.back());
    return;
  }
  to->ids.push_back(to->world->GetModel(believed().robot_name)->GetId());
  size_t others = 0;
  for (const whatif::BeliefContent::Group& group : groups) others += group.room;
  for (size_t i = 0; i < others; i++)
    to->ids.push_back(to->world->GetModel(whatif::BeliefContent::NameOf(i))->GetId());
  Options with_watched = options;
  with_watched.watched = to->ids;
  with_watched.keep = Snapshot::kLean;
  BranchOptions of_branches = whatif::OptionsOfBranches(with_watched);
  if (believed().HasGrid()) of_branches.changing_map = whatif::BeliefContent::kMapName;
  to->branches = std::make_unique<Branches>(*to->world, 0, of_branches);
  to->decider = std::make_unique<whatif::Decider>(with_watched, to->branches.get());
  to->ruled = std::make_unique<whatif::RuledOthers>(
      to->branches.get(), static_cast<double>(std::max<usec_t>(1, to->world->sim_interval)) * 1e-6);
  to->error = to->branches->IsReady() ? FindMovers(groups, to) : "there is no such device";
}

/// Returns why there are no rows, or "".
std::string BeliefEngine::Impl::FindMovers(const std::vector<whatif::BeliefContent::Group>& groups,
                                           Room* to) const {
  std::string reason;
  WorldPool& pool = BranchAccess::PoolOf(*to->branches);
  std::vector<uint32_t> silent;
  if (to->world->FindModel(to->ids[0])->GetSubscriptionCount() == 0) silent.push_back(to->ids[0]);
  to->subscriptions = PoolAccess::FindSubscriptions(pool, 0, silent, &reason);
  if (!to->subscriptions)
    return "futures cannot be simulated in rows, because " + reason + "; remove that from " +
           believed().file + " or from the hypotheses";
  std::vector<whatif::BeliefSlot> slots;
  const rows::Scene& scene = *to->subscriptions->scene();
  for (uint32_t place = 0; place < to->ids.size(); place++) {
    const std::optional<uint32_t> mover = scene.FindMover(to->ids[place]);
    if (!mover || !scene.movers[*mover].robot)
      return "the robot is a part of another model; take it out of that";
    slots.push_back({*mover, to->ids[place], place});
  }
  std::vector<whatif::BeliefSampler::Group> of_sampler;
  auto next = slots.begin() + 1;
  for (const whatif::BeliefContent::Group& group : groups) {
    of_sampler.push_back({group.kind, group.controller, {next, next + group.room}});
    next += group.room;
  }
  to->sampler =
      std::make_unique<whatif::BeliefSampler>(scene, slots[0].mover, std::move(of_sampler));
  return "";
}

/// Brings the cells of the belief into the scene. Nothing is simulated meanwhile. Returns why that
/// is impossible, or "".
std::string BeliefEngine::Impl::TakeGrid() {
  if (!belief.IsReady()) return "the belief is not ready";
  if (NeedsRoom()) MakeRoom();
  room->version_of_groups = believed().version_of_groups;
  if (!room->error.empty()) return room->error;
  const bool may_have_changed = believed().options.others_clear_cells ||
                                room->version_of_cells != believed().version_of_cells;
  if (!believed().HasGrid() || !may_have_changed) return "";
  belief.impl_->ClearCells();
  try {
    const bool has_changed = room->subscriptions->map()->Set(believed().cells_that_count());
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
    Drawn& added = room->samples.emplace_back();
    added.origin = std::make_shared<BranchAccess::Origin>(std::move(row));
  }
  return room->samples[sample].origin->row.rows.get();
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

/// The robot, the others of a sample, and all other places in their order.
void BeliefEngine::Impl::SetOrder(Drawn* of) const {
  std::vector<bool> is_free(room->ids.size(), true);
  of->order.clear();
  const auto add = [&](uint32_t place) {
    of->order.push_back(place);
    is_free[place] = false;
  };
  add(0);
  for (const whatif::DrawnOthers::Drawn& each : of->who.others) add(each.slot.place);
  for (uint32_t place = 0; place < is_free.size(); place++)
    if (is_free[place]) add(place);
}

void BeliefEngine::Impl::Draw(const BeliefQuestion& question, uint32_t sample) {
  rows::Rows* const row = RowsOf(sample);
  Drawn& to = room->samples[sample];
  room->sampler->Draw(believed(), question.seed, sample, row, &to.who);
  if (!room->sampler->has_one_group()) SetOrder(&to);
  to.sightings.clear();
  if (to.who.HasRules()) BranchAccess::Watch(*room->branches, *row, &to.sightings);
}

/// Starts a future from its sample. All plans of a sample begin together, so it is drawn once.
void BeliefEngine::Impl::Begin(const BeliefQuestion& question, uint32_t branch,
                               const Sample& sample, bool records) {
  if (sample.number >= drawn) {
    Draw(question, sample.number);
    drawn = sample.number + 1;
  }
  BranchAccess::Restore(*room->branches, branch, room->samples[sample.number].origin,
                        records || sample.number == 0);
  uint64_t step = StepsOf(believed().delay);
  const uint64_t hold = std::max<uint64_t>(1, question.hold / interval());
  for (const Velocity& each : question.plans[sample.candidate].commands) {
    room->branches->Give(branch,
                         Command(step, room->ids[0], Command::kSetSpeed, each.x, each.y, each.a));
    step += hold;
  }
}

void BeliefEngine::Impl::MoveRuledOthers() {
  living.clear();
  room->decider->ForEachLiving([&](uint32_t branch, const Sample& sample) {
    const Drawn& from = room->samples[sample.number];
    const std::vector<Sighting>& seen = (*room->branches)[branch].sightings;
    if (!from.who.HasRules()) return;
    living.push_back(
        {branch, sample, &from.who,
         seen.empty() ? from.sightings.data() : seen.data() + seen.size() - room->ids.size()});
  });
  room->ruled->Move(living);
}

DecisionTask BeliefEngine::Impl::TaskOf(const BeliefQuestion& question) const {
  DecisionTask task;
  task.candidates = question.plans.size();
  task.steps = question.horizon / interval();
  task.interval = seconds();
  task.watched = room->ids.size();
  for (size_t i = 0; i < believed().others.size(); i++)
    task.other_radii.push_back(believed().RadiusOf(i));
  return task;
}

template <typename F>
Decision BeliefEngine::Impl::With(const BeliefQuestion& question, Judge* judge, F decide) {
  Decision decision;
  decision.error = WhyNot(question, *judge);
  if (!decision.error.empty()) return decision;
  try {
    return Decide(question, judge, decide);
  } catch (const LoadError& error) {  // of populations, which do not fit with this seed
    decision.error = error.what();
  } catch (const std::domain_error& error) {  // of rules
    decision.error = error.what();
  }
  return decision;
}

template <typename F>
Decision BeliefEngine::Impl::Decide(const BeliefQuestion& question, Judge* judge, F decide) {
  const bool has_rules = std::ranges::any_of(believed().groups, [](const auto& group) {
    return group.controller.empty() && group.used > 0;
  });
  whatif::OrderedJudge ordered(
      judge, room->ids.size(), [this](uint32_t sample) -> const auto& {
        return room->samples[sample].order;
      });
  const bool is_ordered = room->sampler->has_one_group();
  drawn = 0;
  room->sampler->Assign(believed());
  whatif::Decider::Task task;
  task.about = TaskOf(question);
  task.judge = is_ordered ? judge : &ordered;
  task.begin = [&](uint32_t branch, const Sample& sample) {
    Begin(question, branch, sample, judge->ScoresFutures());
  };
  task.name_of = [&](size_t plan) { return question.plans[plan].name; };
  if (has_rules) task.before_step = [this] { MoveRuledOthers(); };
  Decision decision = decide(task);
  if (!is_ordered)
    for (Outcome& outcome : decision.outcomes) ordered.Order(0, &outcome.sightings);
  return decision;
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

}  // namespace Stg
