// SPDX-License-Identifier: GPL-2.0-or-later

#ifndef STAGE_MODELS_STATE_CHOICE_HH
#define STAGE_MODELS_STATE_CHOICE_HH

#include <cstdint>

#include "models/state_exchange.hh"

namespace Stg {

/// An enumeration with values from 0 to `last`, for a StateExchange. Restoring fails if a file has
/// another number.
template <typename E>
class StateChoice {
 public:
  StateChoice(E* value, E last) : value_(*value), last_(last) {}

  void ExchangeState(StateExchange& exchange) {
    int32_t number = static_cast<int32_t>(value_);
    exchange(number);
    if (!exchange.restoring() || exchange.failed()) return;
    if (number < 0 || number > static_cast<int32_t>(last_))
      return exchange.Fail("found an invalid enumeration value");
    value_ = static_cast<E>(number);
  }

 private:
  E& value_;
  const E last_;
};

}  // namespace Stg

#endif
