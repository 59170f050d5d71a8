// SPDX-License-Identifier: GPL-2.0-or-later
//
// ModelLightIndicator: a lamp switched by a program. Part of <stage.hh>.

#ifndef STAGE_MODELS_LIGHTINDICATOR_HH
#define STAGE_MODELS_LIGHTINDICATOR_HH

#include "models/light.hh"
#include "models/model.hh"

namespace Stg {

/// Light sensors sense it if the world file gives it an intensity.
class ModelLightIndicator : public Model, public LightSource {
 public:
  explicit ModelLightIndicator(World* world, Model* parent, const std::string& type);

  /// Off by default.
  void SetState(bool isOn) { is_on_ = isOn; }
  bool IsOn() const override { return is_on_; }
  /// Its colour, darkened while it is off.
  Color GetShownColor() const override;

  using Model::Load;
  void Load() override;
  void ExchangeState(StateExchange& exchange) override;

 private:
  bool is_on_;
};

}  // namespace Stg

#endif
