// SPDX-License-Identifier: GPL-2.0-or-later

#include "world/scheduler.hh"

#include <algorithm>
#include <new>
#include <utility>

#include "messages/assert.hh"

namespace Stg {

void Scheduler::Swap(Scheduler& other) {
  due_.swap(other.due_);  // swapping keeps the addresses of the lists
  std::swap(last_list_, other.last_list_);
  std::swap(last_time_, other.last_time_);
  free_lists_.swap(other.free_lists_);
  cancelled_.swap(other.cancelled_);
}

void Scheduler::Take(usec_t now, std::vector<Event>* events) {
  events->clear();
  RemoveCancelled();
  while (!due_.empty() && due_.begin()->first <= now) {
    List& list = due_.begin()->second;
    if (events->empty())
      std::swap(*events, list);
    else
      events->insert(events->end(), list.begin(), list.end());
    list.clear();
    free_lists_.push_back(std::move(list));
    due_.erase(due_.begin());
  }
  last_list_ = nullptr;
}

Scheduler::List& Scheduler::ListOf(usec_t time) {
  STAGE_ASSERT(last_list_ == nullptr || last_list_ == &due_.at(last_time_));
  if (last_list_ != nullptr && last_time_ == time) return *last_list_;
  const auto [place, is_new] = due_.try_emplace(time);
  if (is_new && !free_lists_.empty()) {
    STAGE_ASSERT(free_lists_.back().empty());
    place->second = std::move(free_lists_.back());
    free_lists_.pop_back();
  }
  last_list_ = &place->second;
  last_time_ = time;
  return *last_list_;
}

void Scheduler::Forget(const Model* model) noexcept {
  if (due_.empty()) return;
  try {
    cancelled_.insert(model->GetId());
  } catch (const std::bad_alloc&) {  // out of memory: removes the events now
    for (auto& [time, list] : due_)
      std::erase_if(list, [&](const Event& event) { return event.model == model; });
  }
}

void Scheduler::Clear() {
  due_.clear();
  cancelled_.clear();
  last_list_ = nullptr;
}

void Scheduler::RemoveCancelled() {
  if (cancelled_.empty()) return;
  for (auto& [time, list] : due_) {
    looked_at_ += list.size();
    std::erase_if(list, [&](const Event& event) {
      return event.model && cancelled_.contains(static_cast<uint32_t>(event.generation >> 32));
    });
  }
  cancelled_.clear();
}

}  // namespace Stg
