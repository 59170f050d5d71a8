// SPDX-License-Identifier: GPL-2.0-or-later
//
// ModelBlinkenlight: a small light that blinks by the simulated clock. Part of <stage.hh>.

#ifndef STAGE_MODELS_BLINKENLIGHT_HH
#define STAGE_MODELS_BLINKENLIGHT_HH

#include "models/light.hh"
#include "models/model.hh"

namespace Stg {

/// Blinks even without subscribers. Light sensors sense it if the world file gives it an intensity.
class ModelBlinkenlight : public Model, public LightSource {
 public:
  ModelBlinkenlight(World* world, Model* parent, const std::string& type);

  bool IsOn() const override;
  /// Its colour, at half the brightness while it is off.
  Color GetShownColor() const override;

  using Model::Load;
  void Load() override;

 private:
  double dutycycle_;  // time on / time off
  usec_t period_;     // on and off together
  bool enabled_;
};

}  // namespace Stg

#endif
