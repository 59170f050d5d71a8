// SPDX-License-Identifier: GPL-2.0-or-later
//
// lasernoise: on a ranger; multiplies every range of its first sensor by a random number close to
// one, normally distributed. Callbacks are called in the order in which they were registered: to be
// noticed, it has to come before the controllers that use the ranges. Refuses models
// that are no rangers.

#include "support/set_up.hh"

namespace {

constexpr double kDeviation = 0.05;

/// Mean 1. The sum of twelve uniform numbers is close to a normal distribution of variance 1.
double Noise(Stg::RandomStream* random) {
  double sum = 0;
  for (int i = 0; i < 12; i++) sum += random->Uniform();
  return 1.0 + kDeviation * (sum - 6.0);
}

void AddNoise(Stg::ModelRanger* ranger) {
  if (ranger->GetSensors().empty()) return;
  for (double& range : ranger->GetSensorsMutable()[0].ranges) range *= Noise(&ranger->random());
}

}  // namespace

extern "C" int Init(Stg::Model* model, Stg::CtrlArgs*) {
  auto* ranger = dynamic_cast<Stg::ModelRanger*>(model);
  if (!ranger)
    ctrl::GiveUp("lasernoise", *model,
                 // NOLINTNEXTLINE(clang-analyzer-core.CallAndMessage): the model is never null.
                 "found a model of type " + model->GetModelType() + ", expected a ranger");
  ctrl::CallOnUpdate<Stg::ModelRanger, AddNoise>(ranger, ranger);
  ranger->Subscribe();
  return 0;
}
