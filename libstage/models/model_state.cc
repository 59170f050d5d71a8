// SPDX-License-Identifier: GPL-2.0-or-later
//
// What decides the future of a model of any type.

#include <algorithm>
#include <iterator>

#include "models/block.hh"
#include "models/flag.hh"
#include "models/model.hh"
#include "models/power_pack.hh"
#include "models/state_exchange.hh"
#include "world/world.hh"

namespace Stg {

void Visibility::ExchangeState(StateExchange& exchange) {
  exchange(blob_return, fiducial_key, fiducial_return, gripper_return, obstacle_return,
           ranger_return);
}

void Ancestor::ExchangeState(StateExchange& exchange) {
  exchange.Expect(child_type_counts.size(), "the number of types that children were of");
  for (auto& [child_type, count] : child_type_counts) {
    std::string name = child_type;
    exchange(name, count);
    if (name != child_type) exchange.Fail("found children of other types than there are");
  }
  exchange.Expect(children.size(), "the number of children");
  for (Model* child : children) {
    Model* same = child;
    exchange(same);
    if (same != child) exchange.Fail("found other children than there are");
  }
}

void Model::ExchangeState(StateExchange& exchange) {
  Ancestor::ExchangeState(exchange);
  std::string same_type = type;
  exchange(same_type, token);
  if (same_type != type) exchange.Fail("found a model of another type than there is");

  const Pose pose_before = pose;
  const Geom geom_before = geom;
  exchange(pose, geom, vis, color, mass, friction, map_resolution, boundary);
  exchange(alwayson, used, interval, disabled, stall, stack_children);
  ExchangeSubscriptions(exchange);
  exchange(watts, watts_give, watts_take, say_string, random_);
  const bool other_body = blockgroup->ExchangeState(exchange);
  ExchangeEnergy(exchange);
  ExchangeFlags(exchange);
  ExchangeCallbacks(exchange);
  ExchangeKeptState(exchange);

  if (!exchange.restoring() || exchange.failed()) return;
  blockgroup->RefreshVisibility(!(vis.ranger_return < 0));
  if (other_body || !(pose == pose_before) || !(geom.pose == geom_before.pose)) Map();
}

/// Those who only look on subscribe too. So the hash knows whether there is anybody, and not how
/// many there are.
void Model::ExchangeSubscriptions(StateExchange& exchange) {
  bool running = subs > 0;
  exchange(running);
  if (!exchange.hashing()) exchange(subs);
}

void Model::ExchangeEnergy(StateExchange& exchange) {
  exchange.Expect(power_pack ? 1 : 0, "a model has a power pack");
  if (power_pack) exchange(*power_pack);
  exchange.Expect(charging_.size(), "the number of packs that a model charges");
  for (Charged& charged : charging_) {
    Model* owner = world->FindModel(charged.model);
    exchange(owner);
    if (exchange.restoring() && owner) charged.model = owner->GetId();
  }
}

void Model::ExchangeFlags(StateExchange& exchange) {
  exchange.Expect(flag_list.size(), "the number of flags that a model carries");
  for (Flag* flag : flag_list) {
    Color flag_color = flag->GetColor();
    double size = flag->GetSize();
    exchange(flag_color, size);
    if (!exchange.restoring() || exchange.failed()) continue;
    flag->SetColor(flag_color);
    flag->SetSize(size);
  }
}

/// Functions have other addresses in other processes: which they are, nobody can tell. They are not
/// hashed, so that those who look on make no difference.
void Model::ExchangeCallbacks(StateExchange& exchange) {
  if (exchange.hashing()) return;
  uint64_t count = 0;
  if (callbacks_)
    for (const Callback& entry : callbacks_->all) count += entry.function != nullptr;
  exchange.Expect(count, "the number of a model's callbacks");
  if (count == 0) return;
  for (const Callback& entry : callbacks_->all)
    if (entry.function)
      exchange.Expect(static_cast<uint64_t>(entry.type) * 2 + entry.parallel, "a callback's type");
}

// ---- what controllers remember ------------------------------------------------------------------

void Model::KeepState(const std::string& name, void* data, size_t bytes) {
  AddKeptState({name, data, bytes, nullptr});
}

void Model::KeepState(const std::string& name, StateKeeper* keeper) {
  AddKeptState({name, nullptr, 0, keeper});
}

void Model::AddKeptState(const KeptState& kept) {
  auto last = kept_state_.before_begin();
  while (std::next(last) != kept_state_.end()) ++last;
  kept_state_.insert_after(last, kept);
}

void Model::KeepsNoState(const std::string& name) { KeepState(name, nullptr, 0); }

void Model::ExchangeKeptState(StateExchange& exchange) {
  exchange.Expect(static_cast<uint64_t>(std::distance(kept_state_.begin(), kept_state_.end())),
                  "the number of controllers that keep state with a model");
  for (const KeptState& kept : kept_state_) {
    std::string name = kept.name;
    exchange(name);
    if (name != kept.name) exchange.Fail("found the state of another controller");
    exchange.Expect(kept.bytes, "the size of what a controller keeps");
    auto* bytes = static_cast<unsigned char*>(kept.data);
    for (size_t b = 0; b < kept.bytes; b++) exchange(bytes[b]);
    if (kept.keeper) kept.keeper->ExchangeState(exchange);
  }
}

}  // namespace Stg
