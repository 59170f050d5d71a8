// SPDX-License-Identifier: GPL-2.0-or-later

#include "world/scheduler.hh"

#include <algorithm>

namespace Stg {

void Scheduler::Take(usec_t now, std::vector<Event>* events) {
  events->clear();
  while (!due_.empty() && due_.begin()->first <= now) {
    const std::vector<Event>& list = due_.begin()->second;
    events->insert(events->end(), list.begin(), list.end());
    due_.erase(due_.begin());
  }
}

void Scheduler::Forget(const Model* model) {
  for (auto& [time, list] : due_)
    std::erase_if(list, [&](const Event& event) { return event.model == model; });
}

}  // namespace Stg
