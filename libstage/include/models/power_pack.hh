// SPDX-License-Identifier: GPL-2.0-or-later
//
// Energy: how models store, draw, transfer and dissipate it. Part of <stage.hh>; C++11.
//
// Once per step, after the callbacks, every running model with a pack (its own or an ancestor's)
// draws watts * 0.1 J from it. Chargers also transfer energy to the models that touch them. The 0.1
// s are independent of the step's length, as in Stage 4.3, for which worlds are tuned. An empty
// pack stops robots (stops_when_empty of ModelPosition) and has no effect on other models.

#ifndef STAGE_MODELS_POWER_PACK_HH
#define STAGE_MODELS_POWER_PACK_HH

#include <cmath>
#include <memory>

#include "geometry/geometry.hh"

namespace Stg {

class Camera;
class EnergyCharts;
class Model;
class RowBridge;
class StateExchange;

/// Totals over the packs of a world. Infinite supplies do not count as stored.
struct EnergyTotals {
  joules_t stored, capacity;   ///< of the present packs
  joules_t dissipated, input;  ///< since loading: by all packs, from infinite supplies

  EnergyTotals() : stored(0), capacity(0), dissipated(0), input(0) {}
};

class PowerPack {
 public:
  /// Creates an empty pack without capacity. The caller owns it and must delete it before the
  /// model's world. (Packs from world files belong to their models.)
  explicit PowerPack(Model* mod);
  ~PowerPack();

  /// Draws nothing; kept for compatibility.
  void Visualize(Camera*) {}
  void Print(const char* prefix) const;

  /// A negative or infinite amount means an infinite supply, which gives without limit and takes
  /// nothing.
  joules_t GetStored() const { return stored_; }
  joules_t GetCapacity() const { return capacity_; }
  joules_t GetDissipated() const { return dissipated_; }
  joules_t RemainingCapacity() const { return IsInfinite() ? 0 : capacity_ - stored_; }
  /// 1 if infinite; NaN without capacity.
  double ProportionRemaining() const { return IsInfinite() ? 1.0 : stored_ / capacity_; }
  /// Not clipped to the capacity. NaN is refused with a message.
  void SetStored(joules_t j);
  /// Energy beyond the capacity is lost; so a negative capacity makes an infinite supply. May be
  /// infinite. NaN is refused with a message.
  void SetCapacity(joules_t cap);

  // Amounts that are not positive, or NaN, are ignored. An infinite amount means all that is stored
  // or fits; if that is infinite too, it is ignored.

  /// Adds as much as fits. The pack counts as charging then.
  void Add(joules_t j);
  /// Removes up to the stored amount.
  void Subtract(joules_t j);
  /// Transfers as much as is stored and fits, up to `amount`.
  void TransferTo(PowerPack* dest, joules_t amount);
  /// Turns up to the stored amount into heat. The second form adds it to the heat map at `p`.
  void Dissipate(joules_t j);
  void Dissipate(joules_t j, const Pose& p);

  /// True while the pack is being charged.
  bool GetCharging() const { return *charging_; }
  void ChargeStart() { *charging_ = true; }
  void ChargeStop() { *charging_ = false; }
  const Model& model() const { return *mod_; }
  void ExchangeState(StateExchange& exchange);
  /// For a charger, which may outlive the pack.
  const std::shared_ptr<bool>& ShareCharging() const { return charging_; }

  /// Totals over the packs of all listed worlds, without infinite supplies; World::energy_totals()
  /// has those of one world.
  static joules_t global_stored, global_capacity;
  /// Energy dissipated by packs, and energy drawn from infinite supplies, since the program
  /// started.
  static joules_t global_dissipated, global_input;

 private:
  friend class RowBridge;
  PowerPack(const PowerPack&);
  PowerPack& operator=(const PowerPack&);

  bool IsInfinite() const { return stored_ < 0 || std::isinf(stored_); }
  void Store(joules_t j);
  joules_t Spend(joules_t j);
  void Count(joules_t EnergyTotals::*total, joules_t* global, joules_t change);

  Model* mod_;
  joules_t stored_, capacity_, dissipated_;
  std::shared_ptr<bool> charging_;
  std::unique_ptr<EnergyCharts> charts_;  // null unless the world has a window
};

}  // namespace Stg

#endif
