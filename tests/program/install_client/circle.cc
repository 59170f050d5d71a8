// SPDX-License-Identifier: GPL-2.0-or-later
//
// A controller built outside the source tree: drives in a circle.

#include <stage.hh>

extern "C" int Init(Stg::Model* model, Stg::CtrlArgs*) {
  auto* position = dynamic_cast<Stg::ModelPosition*>(model);
  if (!position) return 1;
  position->Subscribe();
  position->SetSpeed(0.3, 0, 0.5);
  return 0;
}
