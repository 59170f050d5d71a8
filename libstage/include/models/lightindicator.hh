// SPDX-License-Identifier: GPL-2.0-or-later
//
// ModelLightIndicator: a lamp that a program switches. Part of <stage.hh>.

#ifndef STAGE_MODELS_LIGHTINDICATOR_HH
#define STAGE_MODELS_LIGHTINDICATOR_HH

#include "models/model.hh"

namespace Stg {

class ModelLightIndicator : public Model {
 public:
  explicit ModelLightIndicator(World* world, Model* parent, const std::string& type);

  /// Off at first.
  void SetState(bool isOn) { is_on_ = isOn; }
  bool IsOn() const { return is_on_; }
  /// What to draw the body in: its colour, darkened while it is off.
  Color GetShownColor() const override;
  void ExchangeState(StateExchange& exchange) override;

 private:
  bool is_on_;
};

}  // namespace Stg

#endif
