// SPDX-License-Identifier: GPL-2.0-or-later
//
// sink: on a zone that flags are brought to. Counts those that arrive in all such zones of the
// world, whose property "delivered" points to the count, an unsigned long.

#include "support/set_up.hh"

namespace {

int CountFlag(Stg::Model*, void* delivered) {
  ++*static_cast<unsigned long*>(delivered);
  return 0;
}

}  // namespace

extern "C" int Init(Stg::Model* model, Stg::CtrlArgs*) {
  ctrl::Tell("sink: " + Stg::Printable(model->TokenStr(), 80) + " takes flags");
  auto* delivered =
      ctrl::SharedInWorld<unsigned long>(model->GetWorld(), "delivered", [] { return 0UL; });
  model->AddCallback(Stg::Model::CB_FLAGINCR, CountFlag, delivered);
  model->GetWorld()->SetProperty("delivered", delivered);
  model->Subscribe();
  return 0;
}
