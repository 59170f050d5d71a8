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
  spare_.swap(other.spare_);
  forgotten_.swap(other.forgotten_);
}

void Scheduler::Take(usec_t now, std::vector<Event>* events) {
  events->clear();
  DropForgotten();
  while (!due_.empty() && due_.begin()->first <= now) {
    List& list = due_.begin()->second;
    if (events->empty())
      std::swap(*events, list);
    else
      events->insert(events->end(), list.begin(), list.end());
    list.clear();
    spare_.push_back(std::move(list));
    due_.erase(due_.begin());
  }
  last_list_ = nullptr;
}

Scheduler::List& Scheduler::ListOf(usec_t time) {
  STAGE_ASSERT(last_list_ == nullptr || last_list_ == &due_.at(last_time_));
  if (last_list_ != nullptr && last_time_ == time) return *last_list_;
  const auto [place, is_new] = due_.try_emplace(time);
  if (is_new && !spare_.empty()) {
    STAGE_ASSERT(spare_.back().empty());
    place->second = std::move(spare_.back());
    spare_.pop_back();
  }
  last_list_ = &place->second;
  last_time_ = time;
  return *last_list_;
}

void Scheduler::Forget(const Model* model) noexcept {
  if (due_.empty()) return;
  try {
    forgotten_.insert(model->GetId());
  } catch (const std::bad_alloc&) {  // out of memory: removes the events now
    for (auto& [time, list] : due_)
      std::erase_if(list, [&](const Event& event) { return event.model == model; });
  }
}

void Scheduler::Clear() {
  due_.clear();
  forgotten_.clear();
  last_list_ = nullptr;
}

void Scheduler::DropForgotten() {
  if (forgotten_.empty()) return;
  for (auto& [time, list] : due_) {
    looked_at_ += list.size();
    std::erase_if(list, [&](const Event& event) {
      return event.model && forgotten_.contains(static_cast<uint32_t>(event.chain >> 32));
    });
  }
  forgotten_.clear();
}

}  // namespace Stg
