// SPDX-License-Identifier: GPL-2.0-or-later

#include "models/power_pack.hh"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdio>

#include "models/energy_charts.hh"
#include "models/energy_supply.hh"
#include "models/host.hh"
#include "models/model.hh"
#include "models/state_exchange.hh"
#include "models/warn_about.hh"

namespace Stg {

joules_t PowerPack::global_stored = 0;
joules_t PowerPack::global_capacity = 0;
joules_t PowerPack::global_dissipated = 0;
joules_t PowerPack::global_input = 0;

namespace {

/// Atomic, as several threads may run worlds, or callbacks of one world.
void AddTo(joules_t* total, joules_t change) {
  if (change != 0) std::atomic_ref<joules_t>(*total).fetch_add(change, std::memory_order_relaxed);
}

}  // namespace

void PowerPack::Count(joules_t EnergyTotals::*total, joules_t* global, joules_t change) {
  Host& host = mod_->host();
  AddTo(&(host.energy_totals.*total), change);
  if (host.listed) AddTo(global, change);
}

PowerPack::PowerPack(Model* mod)
    : mod_(mod),
      stored_(0),
      capacity_(0),
      dissipated_(0),
      charging_(std::make_shared<bool>(false)) {
  mod_->host().power_packs++;
  if (mod_->world_base().IsGUI()) charts_ = std::make_unique<EnergyCharts>(mod_);
}

PowerPack::~PowerPack() {
  SetStored(0);
  SetCapacity(0);
  mod_->host().power_packs--;
}

void PowerPack::ExchangeState(StateExchange& exchange) {
  joules_t stored = stored_, capacity = capacity_;
  exchange(stored, capacity, dissipated_, *charging_);
  if (!exchange.restoring() || exchange.failed()) return;
  SetCapacity(capacity);  // through the setters, to update the totals
  Store(stored);
}

void PowerPack::Print(const char* prefix) const {
  std::printf("%sstored %.3f of %.3f joules, dissipated %.3f%s\n", prefix ? prefix : "", stored_,
              capacity_, dissipated_, *charging_ ? ", charging" : "");
}

void PowerPack::Store(joules_t j) {
  Count(&EnergyTotals::stored, &global_stored, Countable(j) - Countable(stored_));
  stored_ = j;
}

void PowerPack::SetStored(joules_t j) {
  if (std::isnan(j))
    WarnAbout(*mod_, "refused an amount of energy that is not a number");
  else
    Store(j);
}

void PowerPack::SetCapacity(joules_t cap) {
  if (std::isnan(cap)) {
    WarnAbout(*mod_, "refused a capacity that is not a number");
    return;
  }
  Count(&EnergyTotals::capacity, &global_capacity, Countable(cap) - Countable(capacity_));
  capacity_ = cap;
  if (stored_ > cap) Store(cap);
}

void PowerPack::Add(joules_t j) {
  if (!(j > 0) || !(RemainingCapacity() > 0)) return;
  const joules_t amount = std::min(RemainingCapacity(), j);
  if (std::isinf(amount)) return;
  Store(stored_ + amount);
  *charging_ = true;
}

void PowerPack::Subtract(joules_t j) {
  if (!(j > 0)) return;
  if (!IsInfinite())
    Store(stored_ - std::min(stored_, j));
  else if (std::isfinite(j))
    Count(&EnergyTotals::input, &global_input, j);
}

void PowerPack::TransferTo(PowerPack* dest, joules_t amount) {
  if (!IsInfinite()) amount = std::min(amount, stored_);
  amount = std::min(amount, dest->RemainingCapacity());
  if (!(amount > 0) || std::isinf(amount)) return;
  Subtract(amount);
  dest->Add(amount);
  mod_->NeedRedraw();
}

joules_t PowerPack::Spend(joules_t j) {
  if (!(j > 0)) return 0;
  const joules_t amount = IsInfinite() ? j : std::min(j, stored_);
  if (std::isinf(amount)) return 0;
  Subtract(amount);
  dissipated_ += amount;
  Count(&EnergyTotals::dissipated, &global_dissipated, amount);
  if (charts_) {
    charts_->output.AppendValue(static_cast<float>(amount));
    charts_->stored.AppendValue(static_cast<float>(stored_));
  }
  return amount;
}

void PowerPack::Dissipate(joules_t j) { Spend(j); }

void PowerPack::Dissipate(joules_t j, const Pose& p) {
  const joules_t amount = Spend(j);
  if (charts_) charts_->dissipation.Accumulate(p.x, p.y, amount);
}

}  // namespace Stg
