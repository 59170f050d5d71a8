// SPDX-License-Identifier: GPL-2.0-or-later
//
// dynamic: puts a hundred small blue boxes at random places on its model. An example of creating
// models at run time.

#include "stage.hh"

namespace {

constexpr int kBoxes = 100;
constexpr double kSide = 0.1;    // m
constexpr double kSpread = 1.0;  // m from the model's origin, along x and y

}  // namespace

extern "C" int Init(Stg::Model* model, Stg::CtrlArgs*) {
  model->DeclareNoState("dynamic");
  for (int i = 0; i < kBoxes; i++) {
    Stg::Model* box = model->GetWorld()->CreateModel(model, "model");
    box->SetPose(Stg::Pose::Random(model->random(), -kSpread, kSpread, -kSpread, kSpread));
    box->SetGeom(Stg::Geom(Stg::Pose(), Stg::Size(kSide, kSide, kSide)));
    box->SetColor(Stg::Color::blue);
  }
  return 0;
}
