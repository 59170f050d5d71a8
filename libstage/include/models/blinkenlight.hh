// SPDX-License-Identifier: GPL-2.0-or-later
//
// ModelBlinkenlight: a small light that blinks by the simulated clock. Part of <stage.hh>.

#ifndef STAGE_MODELS_BLINKENLIGHT_HH
#define STAGE_MODELS_BLINKENLIGHT_HH

#include "models/model.hh"

namespace Stg {

/// It needs no subscription to blink.
class ModelBlinkenlight : public Model {
 public:
  ModelBlinkenlight(World* world, Model* parent, const std::string& type);

  bool IsOn() const;
  /// What to draw the body in: its colour, at half the brightness while it is off.
  Color GetShownColor() const override;

  using Model::Load;
  void Load() override;

 private:
  double dutycycle_;  // time on / time off
  usec_t period_;     // of both together
  bool enabled_;
};

}  // namespace Stg

#endif
