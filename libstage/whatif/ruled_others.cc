// SPDX-License-Identifier: GPL-2.0-or-later

#include "whatif/ruled_others.hh"

#include <algorithm>
#include <stdexcept>

#include "geometry/trigonometry.hh"
#include "models/property_checks.hh"

namespace Stg::whatif {

RuledOthers::Call* RuledOthers::CallOf(BehaviourRule* rule) {
  const auto known = std::ranges::find(calls_, rule, &Call::rule);
  return known != calls_.end() ? &*known : &calls_.emplace_back(Call{rule, {}, {}});
}

/// Adds the others of a sample whom rules move. `seen`: of the robot and of all others.
void RuledOthers::Collect(const Living& of, const Sighting* seen) {
  const double time = static_cast<double>(branches_[of.branch].steps) * interval_;
  for (size_t i = 0; i < of.drawn->others.size(); i++) {
    const DrawnOthers::Drawn& drawn = of.drawn->others[i];
    if (drawn.behaviour->kind != Behaviour::kRule) continue;
    Call* const call = CallOf(drawn.behaviour->rule.get());
    call->moments.push_back({of.sample, time, seen, 1 + i, drawn.id});
    call->targets.push_back({of.branch, drawn.slot.model, seen[1 + i].pose.a});
  }
}

void RuledOthers::Give(const Target& target, const Velocity& velocity) {
  const SineCosine turn = SinCos(target.heading);
  branches_.Give(target.branch,
                 Command(branches_[target.branch].steps, target.model, Command::kSetSpeed,
                         velocity.x * turn.cosine + velocity.y * turn.sine,
                         velocity.y * turn.cosine - velocity.x * turn.sine, velocity.a));
}

void RuledOthers::Move(const std::vector<Living>& living) {
  if (living.empty()) return;
  const size_t others = living.front().drawn->others.size();
  for (Call& call : calls_) {
    call.moments.clear();
    call.targets.clear();
  }
  seen_.clear();
  seen_.reserve(living.size() * (1 + others));
  for (const Living& each : living) {
    const Sighting* const seen = seen_.data() + seen_.size();
    seen_.push_back(each.watched[0]);
    for (const DrawnOthers::Drawn& drawn : each.drawn->others)
      seen_.push_back(each.watched[drawn.slot.place]);
    Collect(each, seen);
  }
  for (const Call& call : calls_) {
    if (call.moments.empty()) continue;
    velocities_.assign(call.moments.size(), Velocity());
    call.rule->Move(call.moments.data(), call.moments.size(), others, velocities_.data());
    for (size_t i = 0; i < velocities_.size(); i++) {
      if (!IsFinite(static_cast<const Pose&>(velocities_[i])))
        throw std::domain_error("a rule moves other " + std::to_string(call.moments[i].id) +
                                " with a velocity that is not finite, expected m/s and rad/s");
      Give(call.targets[i], velocities_[i]);
    }
  }
}

}  // namespace Stg::whatif
