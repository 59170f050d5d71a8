// SPDX-License-Identifier: GPL-2.0-or-later
//
// lasernoise: multiplies every range of a ranger's first sensor by a random number, normally
// distributed around 1. Callbacks run in the order of registration, so it must precede the
// controllers that use the ranges. Rejects models that are not rangers.

#include "support/set_up.hh"

namespace {

constexpr double kDeviation = 0.05;

/// Random number with mean 1. The sum of twelve uniform numbers is nearly normal with variance 1.
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
  ranger->DeclareNoState("lasernoise");
  ranger->Subscribe();
  return 0;
}
