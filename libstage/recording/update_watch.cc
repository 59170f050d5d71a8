// SPDX-License-Identifier: GPL-2.0-or-later

#include "recording/update_watch.hh"

#include "world/scheduler.hh"

namespace Stg::recording {

void UpdateWatch::Look(Scheduler* scheduler, usec_t now) {
  scheduler->ForEach([&](usec_t time, const Scheduler::Event& event) {
    const Model* model = event.model;
    if (!model || event.callback || time != now + model->GetUpdateInterval() ||
        !model->ExpectsUpdate(event.chain))
      return;
    if (model->GetId() >= last_.size()) last_.resize(model->GetId() + size_t{1});
    last_[model->GetId()] = now;
  });
}

}  // namespace Stg::recording
