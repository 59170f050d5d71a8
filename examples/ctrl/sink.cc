// SPDX-License-Identifier: GPL-2.0-or-later
//
// sink: on a zone that flags are brought to. Counts those that arrive in all such zones of all
// worlds; the world's property "delivered" points to the count, an unsigned long.

#include <cstdio>

#include "stage.hh"

namespace {

unsigned long delivered = 0;

int CountFlag(Stg::Model*, void*) {
  delivered++;
  return 0;
}

}  // namespace

extern "C" int Init(Stg::Model* model, Stg::CtrlArgs*) {
  std::printf("sink: %s takes flags\n", Stg::Printable(model->TokenStr(), 80).c_str());
  model->AddCallback(Stg::Model::CB_FLAGINCR, CountFlag, nullptr);
  model->GetWorld()->SetProperty("delivered", &delivered);
  model->Subscribe();
  return 0;
}
