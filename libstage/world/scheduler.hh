// SPDX-License-Identifier: GPL-2.0-or-later
//
// What is to happen at which simulated time.

#ifndef STAGE_WORLD_SCHEDULER_HH
#define STAGE_WORLD_SCHEDULER_HH

#include <map>
#include <span>
#include <unordered_set>
#include <vector>

#include "models/model.hh"

namespace Stg {

class Scheduler {
 public:
  struct Event {
    Model* model = nullptr;
    model_callback_t callback = nullptr;  ///< null: the model's update
    void* arg = nullptr;
    /// Whose it is, see UpdateChain; of an update: void if the model has begun a newer one.
    uint64_t chain = 0;
  };

  Scheduler() = default;
  // A copy would go on adding to lists of the original.
  Scheduler(const Scheduler&) = delete;
  Scheduler& operator=(const Scheduler&) = delete;
  void Swap(Scheduler& other);

  void Add(usec_t time, const Event& event) { ListOf(time).push_back(event); }
  /// Adds so many events of one time, all of which have to be filled in before anything else.
  std::span<Event> AddRoom(usec_t time, size_t count) {
    List& list = ListOf(time);
    list.resize(list.size() + count);
    return std::span(list).last(count);
  }

  /// Moves the events whose time is `now` or earlier to *events: by time, and in the order of
  /// adding where times are equal. Events added meanwhile are left for the next call.
  void Take(usec_t now, std::vector<Event>* events);

  /// Drops the events of a model. Done once for all such models, when events are taken.
  void Forget(const Model* model) noexcept;
  /// Does that now: from here on other models may have the numbers of those.
  void DropForgotten();
  void Clear();
  /// How many events were looked at to drop those of models: the work that these have made.
  uint64_t looked_at() const { return looked_at_; }

  /// Calls f(usec_t, const Event&) for all, by time, in the order of adding.
  template <typename F>
  void ForEach(F f) {
    DropForgotten();
    for (const auto& [time, list] : due_)
      for (const Event& event : list) f(time, event);
  }

 private:
  using List = std::vector<Event>;
  List& ListOf(usec_t time);

  // Nearly all models share a few intervals, so there are few distinct times.
  std::map<usec_t, List> due_;
  List* last_list_ = nullptr;  // that was added to, of the time below
  usec_t last_time_ = 0;
  std::vector<List> spare_;                 // for their memory
  std::unordered_set<uint32_t> forgotten_;  // models
  uint64_t looked_at_ = 0;
};

}  // namespace Stg

#endif
