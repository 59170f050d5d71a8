// SPDX-License-Identifier: GPL-2.0-or-later
//
// ModelGroundSensor: reads a field below a robot, and writes to it. Part of <stage.hh>.

#ifndef STAGE_MODELS_GROUNDSENSOR_HH
#define STAGE_MODELS_GROUNDSENSOR_HH

#include <string>
#include <vector>

#include "models/model.hh"
#include "random/random.hh"

namespace Stg {

class FieldPhase;
class ModelField;

class ModelGroundSensor : public Model {
 public:
  ModelGroundSensor(World* world, Model* parent, const std::string& type);
  ~ModelGroundSensor();

  /// The field that is read and written; null if there is none of that name.
  ModelField* GetField() const;
  /// Name of the field. Empty: the first field of the world.
  const std::string& field_name() const { return field_name_; }

  /// Values at each point, as they were at the beginning of the last update's step. Empty before
  /// the first update and without subscribers. 0 outside of the field.
  const std::vector<double>& GetValues() const { return values_; }
  /// Points in the frame of the sensor.
  const std::vector<point_t>& points() const { return points_; }
  bool is_linear() const { return linear_; }  ///< otherwise the nearest cell counts
  double noise() const { return noise_; }     ///< standard deviation of each value

  // The sensor adds to the field at its own origin, where it is after the moves of a step, whether
  // it has subscribers or not. Sensors do so in the order of creation, after all callbacks of the
  // step. These functions may be called by parallel callbacks of the sensor's own tree.

  /// Adds `amount` once, at the end of the present or next step: see ModelField::Deposit(). Several
  /// amounts are summed. Returns false without an effect if it is not finite.
  bool Deposit(double amount);
  /// Adds `rate` times the length of a step in each step. Returns false without an effect if it is
  /// not finite.
  bool SetDepositRate(double rate);
  double deposit_rate() const { return deposit_rate_; }
  double pending_deposit() const { return pending_; }  ///< amount that is yet to be added

  using Model::Load;
  void Load() override;
  void ExchangeState(StateExchange& exchange) override;

 protected:
  void Reseed(uint64_t seed) override;
  void Shutdown() override;
  void Update() override;
  void Gather(internal::sensing::FanList* fans) override;

 private:
  friend class FieldPhase;

  void LoadPoints();

  std::string field_name_;
  std::vector<point_t> points_;
  std::vector<double> values_;
  bool linear_;
  double noise_, deposit_rate_, pending_;
  RandomStream random_;
  bool seeded_;
};

}  // namespace Stg

#endif
