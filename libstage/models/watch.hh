// SPDX-License-Identifier: GPL-2.0-or-later
//
// For code that calls callbacks and goes on with a model afterwards: they may have deleted it.

#ifndef STAGE_MODELS_WATCH_HH
#define STAGE_MODELS_WATCH_HH

#include "models/model.hh"

namespace Stg {

/// Tells whether a model has been deleted since. On the stack, of the thread that has the world.
class Watch {
 public:
  explicit Watch(const Model& model);
  ~Watch();
  Watch(const Watch&) = delete;
  Watch& operator=(const Watch&) = delete;

  bool gone() const { return model_ == nullptr; }

  /// Tells those of a list that watch the model that it goes.
  static void Tell(Watch** list, const Model* model);

 private:
  const Model* model_;
  Watch** list_;  // of the model's world
  Watch* next_;
};

}  // namespace Stg

#endif
