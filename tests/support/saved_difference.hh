// SPDX-License-Identifier: GPL-2.0-or-later
//
// Tells which models of two worlds of the same file have different states in snapshots.

#ifndef STAGE_TESTS_SUPPORT_SAVED_DIFFERENCE_HH
#define STAGE_TESTS_SUPPORT_SAVED_DIFFERENCE_HH

#include <string>
#include <vector>

#include "models/state_exchange.hh"
#include "world/engine.hh"

namespace Stg::test {

/// The names of these models, each after a space.
inline std::string SavedDifference(const World& one, const World& other) {
  std::string text;
  for (Model* model : one.engine().models) {
    std::vector<unsigned char> a, b;
    StateExchange save_a(one.engine().models, &a), save_b(other.engine().models, &b);
    model->ExchangeState(save_a);
    other.FindModel(model->GetId())->ExchangeState(save_b);
    save_a.Finish();
    save_b.Finish();
    if (a != b) text += " " + model->TokenStr();
  }
  return text;
}

}  // namespace Stg::test

#endif
