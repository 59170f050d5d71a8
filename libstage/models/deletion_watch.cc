// SPDX-License-Identifier: GPL-2.0-or-later

#include "models/deletion_watch.hh"

#include "messages/assert.hh"
#include "models/host.hh"

namespace Stg {

DeletionWatch::DeletionWatch(const Model& model)
    : model_(&model), list_(&model.host().watches), next_(*list_) {
  *list_ = this;
}

DeletionWatch::~DeletionWatch() {
  if (gone()) return;  // already unlinked, and the list may not exist any more
  while (*list_ != this) {
    STAGE_ASSERT(*list_);
    list_ = &(*list_)->next_;
  }
  *list_ = next_;
}

void DeletionWatch::Notify(DeletionWatch** list, const Model* model) {
  while (DeletionWatch* watch = *list) {
    if (watch->model_ == model) {
      watch->model_ = nullptr;
      *list = watch->next_;
    } else {
      list = &watch->next_;
    }
  }
}

}  // namespace Stg
