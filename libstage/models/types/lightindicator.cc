// SPDX-License-Identifier: GPL-2.0-or-later

#include "models/lightindicator.hh"

#include "models/state_exchange.hh"
#include "models/types/built_in_types.hh"

namespace Stg {

namespace {
constexpr double kDimmed = 0.8;
}  // namespace

ModelType LightIndicatorType() {
  return ModelTypeOf<ModelLightIndicator>("lightindicator")
      .Updates(ModelType::kParallel)
      .Moves(ModelType::kStays);
}

ModelLightIndicator::ModelLightIndicator(World* world_, Model* parent_, const std::string& type_)
    : Model(world_, parent_, type_), LightSource(this, 0), is_on_(false) {}

void ModelLightIndicator::Load() {
  if (LoadCommon()) LoadIntensity(wf, wf_entity);
}

Color ModelLightIndicator::GetShownColor() const {
  if (is_on_) return color;
  return Color(color.r * kDimmed, color.g * kDimmed, color.b * kDimmed, color.a);
}

void ModelLightIndicator::ExchangeState(StateExchange& exchange) {
  Model::ExchangeState(exchange);
  exchange(is_on_);
}

}  // namespace Stg
