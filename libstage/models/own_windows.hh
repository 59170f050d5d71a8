// SPDX-License-Identifier: GPL-2.0-or-later
//
// The windows of a tree of models in the batch of a step: what hides its body from its own rays.

#ifndef STAGE_MODELS_OWN_WINDOWS_HH
#define STAGE_MODELS_OWN_WINDOWS_HH

#include <atomic>
#include <cstdint>

#include "models/model.hh"
#include "sensing/batch.hh"

namespace Stg {

/// One for each drawing of the bodies; each for the batch with its number.
struct Model::OwnWindows {
  struct OfDrawing {
    sensing::Window window;
    uint64_t batch = 0;

    /// True for the one caller, of several threads, that is to make the window for this batch.
    bool Claim(uint64_t number) {
      const std::atomic_ref<uint64_t> made_for(batch);
      return made_for.load(std::memory_order_relaxed) != number &&
             made_for.exchange(number, std::memory_order_relaxed) != number;
    }
  };
  OfDrawing of[2];
};

}  // namespace Stg

#endif
