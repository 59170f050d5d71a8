// SPDX-License-Identifier: GPL-2.0-or-later
//
// sink: a zone that flags are brought to. Counts the flags that arrive in all such zones of the
// world. Their property "delivered" points to the count, an unsigned long.

#include "support/set_up.hh"

namespace {

/// Number of flags delivered to all sinks of a world.
struct Delivered : Stg::StateKeeper {
  unsigned long count = 0;

  void ExchangeState(Stg::StateExchange& exchange) override {
    uint64_t flags = count;
    exchange(flags);
    count = static_cast<unsigned long>(flags);
  }
  bool FitsAlways() const override { return true; }
};

int CountFlag(Stg::Model*, void* delivered) {
  static_cast<Delivered*>(delivered)->count++;
  return 0;
}

}  // namespace

extern "C" int Init(Stg::Model* model, Stg::CtrlArgs*) {
  auto* delivered =
      ctrl::SharedInWorld<Delivered>(model->GetWorld(), "sinks", [] { return Delivered(); });
  model->KeepState("sink", delivered);
  model->AddCallback(Stg::Model::CB_FLAGINCR, CountFlag, delivered);
  model->GetWorld()->SetProperty("delivered", &delivered->count);
  model->Subscribe();
  return 0;
}
