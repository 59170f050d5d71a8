// SPDX-License-Identifier: GPL-2.0-or-later

#include "models/blinkenlight.hh"

#include "models/body.hh"
#include "models/types/built_in_types.hh"
#include "worldfile/worldfile.hh"

namespace Stg {

namespace {
constexpr usec_t kMillisecond = 1000;
constexpr double kDimmed = 0.5;
}  // namespace

ModelType BlinkenlightType() {
  return ModelTypeOf<ModelBlinkenlight>("blinkenlight")
      .Updates(ModelType::kParallel)
      .Moves(ModelType::kStays);
}

ModelBlinkenlight::ModelBlinkenlight(World* world_, Model* parent_, const std::string& type_)
    : Model(world_, parent_, type_),
      LightSource(this, 0),
      dutycycle_(1.0),
      period_(1000 * kMillisecond),
      enabled_(true) {
  geom.size = Size(0.02, 0.02, 0.02);
  blockgroup->Fit(geom.size);
  color = Color("green");
}

void ModelBlinkenlight::Load() {
  if (!LoadCommon()) return;
  dutycycle_ = wf->ReadFloat(wf_entity, "dutycycle", dutycycle_);
  if (dutycycle_ < 0)
    wf->Fail(wf_entity, "dutycycle", "found a negative duty cycle, expected 0 or more");
  const int period = wf->ReadInt(wf_entity, "period", static_cast<int>(period_ / kMillisecond));
  if (period < 1) wf->Fail(wf_entity, "period", "found a period below 1 ms, expected 1 or more");
  period_ = static_cast<usec_t>(period) * kMillisecond;
  enabled_ = wf->ReadInt(wf_entity, "enabled", enabled_);
  LoadIntensity(wf, wf_entity);
}

bool ModelBlinkenlight::IsOn() const {
  const double phase = static_cast<double>(world_base().SimTimeNow() % period_);
  const double share_on = dutycycle_ / (1.0 + dutycycle_);
  return enabled_ && phase < static_cast<double>(period_) * share_on;
}

Color ModelBlinkenlight::GetShownColor() const {
  if (IsOn()) return color;
  return Color(color.r * kDimmed, color.g * kDimmed, color.b * kDimmed, color.a);
}

}  // namespace Stg
