// SPDX-License-Identifier: GPL-2.0-or-later
//
// Energy: what models draw from, hand over and dissipate. Part of <stage.hh>; C++11.
//
// Once in each step of a world, after the callbacks, every running model that has a pack (its own
// or an ancestor's) takes watts * 0.1 J from it, and hands energy to those that touch it if it
// is a charger. The 0.1 s are those of Stage 4.3, which its worlds are tuned to; they do not depend
// on the length of the step. An empty pack changes nothing for the model that has it.

#ifndef STAGE_MODELS_POWER_PACK_HH
#define STAGE_MODELS_POWER_PACK_HH

#include <cmath>
#include <memory>

#include "geometry/geometry.hh"

namespace Stg {

class Camera;
class EnergyCharts;
class Model;
class StateExchange;

/// Of the packs of a world. Infinite supplies do not count as stored.
struct EnergyTotals {
  joules_t stored, capacity;   ///< of the packs that there are
  joules_t dissipated, input;  ///< since the world was loaded: of all packs, by infinite supplies

  EnergyTotals() : stored(0), capacity(0), dissipated(0), input(0) {}
};

class PowerPack {
 public:
  /// An empty pack without capacity. It belongs to whoever made it and must go before the model's
  /// world does. (Packs from world files belong to their models.)
  explicit PowerPack(Model* mod);
  ~PowerPack();

  /// Draws nothing: the gauge that Stage once had is not used any more.
  void Visualize(Camera*) {}
  void Print(const char* prefix) const;

  /// A negative amount, or an infinite one, means an infinite supply: it can give for ever and
  /// takes nothing.
  joules_t GetStored() const { return stored_; }
  joules_t GetCapacity() const { return capacity_; }
  joules_t GetDissipated() const { return dissipated_; }
  joules_t RemainingCapacity() const { return IsInfinite() ? 0 : capacity_ - stored_; }
  /// 1 if infinite; not a number without any capacity.
  double ProportionRemaining() const { return IsInfinite() ? 1.0 : stored_ / capacity_; }
  /// Not clipped to the capacity. What is not a number is refused with a message.
  void SetStored(joules_t j);
  /// What is stored beyond it is lost; so a negative one makes an infinite supply. May be infinite.
  /// What is not a number is refused with a message.
  void SetCapacity(joules_t cap);

  // Amounts that are not positive, or not numbers, do nothing. An infinite one is as much as there
  // is, or as there is room for; where there is no end to that, it does nothing.

  /// Takes what there is room for; the pack is then charging.
  void Add(joules_t j);
  /// Gives what there is.
  void Subtract(joules_t j);
  /// Moves what there is, what there is room for, `amount` at most.
  void TransferTo(PowerPack* dest, joules_t amount);
  /// Turns into heat what there is. The second form says where, for those who map it.
  void Dissipate(joules_t j);
  void Dissipate(joules_t j, const Pose& p);

  /// While somebody charges it.
  bool GetCharging() const { return *charging_; }
  void ChargeStart() { *charging_ = true; }
  void ChargeStop() { *charging_ = false; }
  const Model& model() const { return *mod_; }
  void ExchangeState(StateExchange& exchange);
  /// For its charger, who may outlive it.
  const std::shared_ptr<bool>& ShareCharging() const { return charging_; }

  /// Over the packs of all listed worlds; World::energy_totals() has those of one. Infinite
  /// supplies do not count.
  static joules_t global_stored, global_capacity;
  /// Since the program began: what packs dissipated, what infinite supplies gave.
  static joules_t global_dissipated, global_input;

 private:
  PowerPack(const PowerPack&);
  PowerPack& operator=(const PowerPack&);

  bool IsInfinite() const { return stored_ < 0 || std::isinf(stored_); }
  void Store(joules_t j);
  joules_t Spend(joules_t j);
  void Count(joules_t EnergyTotals::*total, joules_t* global, joules_t change);

  Model* mod_;
  joules_t stored_, capacity_, dissipated_;
  std::shared_ptr<bool> charging_;
  std::unique_ptr<EnergyCharts> charts_;  // only in worlds with a window
};

}  // namespace Stg

#endif
