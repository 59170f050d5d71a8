// SPDX-License-Identifier: GPL-2.0-or-later

#include "models/watch.hh"

#include "messages/assert.hh"
#include "models/host.hh"
#include "world/world.hh"

namespace Stg {

Watch::Watch(const Model& model)
    : model_(&model), list_(&model.GetWorld()->host().watches), next_(*list_) {
  *list_ = this;
}

Watch::~Watch() {
  if (gone()) return;  // already unlinked, and the list may not exist any more
  while (*list_ != this) {
    STAGE_ASSERT(*list_);
    list_ = &(*list_)->next_;
  }
  *list_ = next_;
}

void Watch::Tell(Watch** list, const Model* model) {
  while (Watch* watch = *list) {
    if (watch->model_ == model) {
      watch->model_ = nullptr;
      *list = watch->next_;
    } else {
      list = &watch->next_;
    }
  }
}

}  // namespace Stg
