// SPDX-License-Identifier: GPL-2.0-or-later
//
// The state of a model of any type: everything that decides its future.

#include <algorithm>
#include <cmath>
#include <iterator>
#include <memory>
#include <utility>

#include "models/body.hh"
#include "models/flag.hh"
#include "models/host.hh"
#include "models/model.hh"
#include "models/power_pack.hh"
#include "models/property_checks.hh"
#include "models/state_exchange.hh"

namespace Stg {

namespace {

constexpr uint32_t kNobody = 0xffffffffu;  // not a model id

}  // namespace

void Visibility::ExchangeState(StateExchange& exchange) {
  exchange(blob_return, fiducial_key, fiducial_return, gripper_return, obstacle_return,
           ranger_return);
}

void Ancestor::ExchangeState(StateExchange& exchange) {
  ExchangeTypeCounts(exchange);
  std::vector<Model*> in_order = children;
  exchange(in_order);
  if (!exchange.restoring() || exchange.failed()) return;
  for (Model* child : in_order)
    if (!child || &child->ParentOrWorld() != this)
      return exchange.Fail("found other children than there are");
  children = std::move(in_order);
}

void Ancestor::ExchangeTypeCounts(StateExchange& exchange) {
  const size_t types = exchange.Count(child_type_counts.size());
  if (exchange.restoring()) return RestoreTypeCounts(types, exchange);
  for (auto& [child_type, count] : child_type_counts) {
    std::string name = child_type;
    exchange(name, count);
  }
}

/// Changes only what differs, since that is little in most cases.
void Ancestor::RestoreTypeCounts(size_t types, StateExchange& exchange) {
  auto present = child_type_counts.begin();
  std::string name;
  for (size_t i = 0; i < types && !exchange.failed(); i++) {
    unsigned int count = 0;
    exchange(name, count);
    while (present != child_type_counts.end() && present->first < name)
      present = child_type_counts.erase(present);
    if (present == child_type_counts.end() || present->first != name)
      present = child_type_counts.emplace_hint(present, name, count);
    present->second = count;
    ++present;
  }
  child_type_counts.erase(present, child_type_counts.end());
}

void Model::ExchangeState(StateExchange& exchange) {
  Ancestor::ExchangeState(exchange);
  std::string same_type = type;
  exchange(same_type, token);
  if (same_type != type) exchange.Fail("found a model of a different type");

  const Pose pose_before = pose;
  const Geom geom_before = geom;
  const double stand_before = StandOnZ();
  const bool obstacle_before = vis.obstacle_return;
  const double friction_before = friction, mass_before = mass;
  exchange(pose, geom, vis, color, mass, friction, map_resolution, boundary);
  exchange(alwayson, used, interval, disabled, stall, stack_children);
  // The time of the last update does not affect the future; it is the time of the readings.
  if (!exchange.hashing() && !exchange.omits_readings()) exchange(updated_at_);
  ExchangeSubscriptions(exchange);
  exchange(watts, watts_give, watts_take, say_string, random_);
  const bool other_body = blockgroup->ExchangeState(exchange);
  ExchangeContacts(exchange);
  ExchangeEnergy(exchange);
  ExchangeFlags(exchange);
  ExchangeCallbacks(exchange);
  ExchangeKeptState(exchange);

  ExchangeLoadFlags(exchange);

  if (!exchange.restoring() || exchange.failed()) return;
  if (!IsFinite(pose) || !IsFinite(geom.pose))
    return exchange.Fail("found a pose that is not finite");
  blockgroup->RefreshVisibility(!(vis.ranger_return < 0));
  RegisterIfHidden();
  if (vis.obstacle_return != obstacle_before || friction != friction_before || mass != mass_before)
    host().contacts_changed = true;
  if (other_body || !(pose == pose_before) || !(geom.pose == geom_before.pose) ||
      StandOnZ() != stand_before)
    Map();
}

/// Observers subscribe too, so only whether there are subscribers is hashed, not their number.
void Model::ExchangeSubscriptions(StateExchange& exchange) {
  bool running = subs > 0;
  exchange(running);
  if (!exchange.hashing()) exchange(subs);
}

/// Construction flags; needed only to continue loading or editing the model.
void Model::ExchangeLoadFlags(StateExchange& exchange) {
  if (!exchange.hashing()) exchange(has_default_block, loaded_, shares_name_);
}

void Model::ExchangeEnergy(StateExchange& exchange) {
  exchange.Expect(power_pack ? 1 : 0, "a model has a power pack");
  if (power_pack) exchange(*power_pack);
  const size_t count = exchange.Count(charging_.size());
  if (exchange.restoring())
    charging_.assign(count, Charged{std::make_shared<bool>(false), kNobody});
  for (Charged& charged : charging_) {
    Model* owner = host().FindModel(charged.model);
    exchange(owner);
    if (exchange.restoring() && owner && owner->power_pack)
      charged = {owner->power_pack->ShareCharging(), owner->GetId()};
  }
}

void Model::ExchangeFlags(StateExchange& exchange) {
  const size_t count = exchange.Count(flag_list.size());
  if (exchange.restoring() && !exchange.failed()) SetFlagCount(count);
  for (Flag* flag : flag_list) {
    Color flag_color = flag->GetColor();
    double size = flag->GetSize();
    exchange(flag_color, size);
    if (!exchange.restoring() || exchange.failed()) continue;
    flag->SetColor(flag_color);
    flag->SetSize(size);
  }
}

/// Sets the number of flags. Keeps removed ones: their creators may hold pointers to them.
void Model::SetFlagCount(uint64_t count) {
  std::vector<Flag*>& spare = host().spare_flags;
  for (; flag_list.size() > count; flag_list.pop_back()) spare.push_back(flag_list.back());
  while (flag_list.size() < count) {
    if (spare.empty()) spare.push_back(&host().own_flags.emplace_back(Color(), 0));
    flag_list.push_back(spare.back());
    spare.pop_back();
  }
}

/// Function addresses differ between processes, so only the types of callbacks are saved. They are
/// not hashed: observers must not change the hash.
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

// ---- state of controllers -----------------------------------------------------------------------

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

bool Model::DeclaresState() const {
  return std::distance(kept_state_.begin(), kept_state_.end()) >= controllers_;
}

void Model::DeclareNoState(const std::string& name) { KeepState(name, nullptr, 0); }

void Model::ExchangeKeptState(StateExchange& exchange) {
  exchange.Expect(static_cast<uint64_t>(std::distance(kept_state_.begin(), kept_state_.end())),
                  "the number of controllers that keep state with a model");
  for (const KeptState& kept : kept_state_) {
    std::string name = kept.name;
    exchange(name);
    if (name != kept.name) exchange.Fail("found the state of another controller");
    exchange.Expect(kept.bytes, "the size of what a controller keeps");
    exchange.Plain(kept.data, kept.bytes);
    if (kept.keeper) kept.keeper->ExchangeState(exchange);
  }
}

}  // namespace Stg
