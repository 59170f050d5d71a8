// SPDX-License-Identifier: GPL-2.0-or-later

#include "models/light.hh"

#include <cmath>

#include "models/body.hh"
#include "models/host.hh"
#include "models/property_checks.hh"
#include "models/state_exchange.hh"
#include "models/types/built_in_types.hh"
#include "models/types/light_index.hh"
#include "models/warn_about.hh"
#include "worldfile/worldfile.hh"

namespace Stg {

// ---- LightSource --------------------------------------------------------------------------------

LightSource::LightSource(Model* model, double intensity) : intensity_(intensity), model_(model) {
  model_->host().lights->Add(this);
}

LightSource::~LightSource() { model_->host().lights->Remove(this); }

void LightSource::LoadIntensity(Worldfile* wf, int entity) {
  intensity_ = wf->ReadFloat(entity, "intensity", intensity_);
  CheckNotNegative(*wf, entity, "intensity", intensity_);
}

// ---- ModelLight ---------------------------------------------------------------------------------

namespace {
constexpr double kDimmedWhileOff = 0.5;
constexpr double kUsualIntensity = 1.0;
}  // namespace

ModelType LightType() {
  return ModelTypeOf<ModelLight>("light").Updates(ModelType::kParallel).Moves(ModelType::kStays);
}

ModelLight::ModelLight(World* world_, Model* parent_, const std::string& type_)
    : Model(world_, parent_, type_), LightSource(this, kUsualIntensity), is_on_(true) {
  geom.size = Size(0.05, 0.05, 0.05);
  blockgroup->Fit(geom.size);
  color = Color("yellow");
  vis.obstacle_return = false;
  vis.ranger_return = -1.0;
}

void ModelLight::Load() {
  if (!LoadCommon()) return;
  LoadIntensity(wf, wf_entity);
  is_on_ = wf->ReadInt(wf_entity, "on", is_on_);
}

void ModelLight::SetIntensity(double intensity) {
  if (!std::isfinite(intensity) || intensity < 0)
    return WarnAbout(*this, "refused the intensity %f, expected 0 or more", intensity);
  intensity_ = intensity;
}

Color ModelLight::GetShownColor() const {
  if (is_on_) return color;
  return Color(color.r * kDimmedWhileOff, color.g * kDimmedWhileOff, color.b * kDimmedWhileOff,
               color.a);
}

void ModelLight::ExchangeState(StateExchange& exchange) {
  Model::ExchangeState(exchange);
  exchange(intensity_, is_on_);
  if (exchange.restoring() && !(std::isfinite(intensity_) && intensity_ >= 0)) {
    intensity_ = kUsualIntensity;
    exchange.Fail("found a light's intensity that is negative or not finite");
  }
}

}  // namespace Stg
