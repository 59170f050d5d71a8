// SPDX-License-Identifier: GPL-2.0-or-later
//
// Detects that a callback has deleted a model, for code that then continues to use it.

#ifndef STAGE_MODELS_DELETION_WATCH_HH
#define STAGE_MODELS_DELETION_WATCH_HH

#include "models/model.hh"

namespace Stg {

/// Tells whether a model has been deleted. Lives on the stack of the thread that has its world.
class DeletionWatch {
 public:
  explicit DeletionWatch(const Model& model);
  ~DeletionWatch();
  DeletionWatch(const DeletionWatch&) = delete;
  DeletionWatch& operator=(const DeletionWatch&) = delete;

  bool gone() const { return model_ == nullptr; }

  /// Notifies the watches of a model in the list that it is being deleted.
  static void Notify(DeletionWatch** list, const Model* model);

 private:
  const Model* model_;
  DeletionWatch** list_;  // list of watches of the model's world
  DeletionWatch* next_;
};

}  // namespace Stg

#endif
