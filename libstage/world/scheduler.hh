// SPDX-License-Identifier: GPL-2.0-or-later
//
// Queue of events, ordered by simulated time.

#ifndef STAGE_WORLD_SCHEDULER_HH
#define STAGE_WORLD_SCHEDULER_HH

#include <map>
#include <span>
#include <unordered_set>
#include <vector>

#include "messages/assert.hh"
#include "models/model.hh"

namespace Stg {

class Scheduler {
 public:
  struct Event {
    Model* model = nullptr;
    model_callback_t callback = nullptr;  ///< null: the model's update
    void* arg = nullptr;
    /// Identifies the model, see UpdateGeneration. An update of an older generation is void.
    uint64_t generation = 0;
  };

  Scheduler() = default;
  // A copy's last_list_ would point into the original.
  Scheduler(const Scheduler&) = delete;
  Scheduler& operator=(const Scheduler&) = delete;
  void Swap(Scheduler& other);

  void Add(usec_t time, const Event& event) {
    STAGE_ASSERT(!event.model || event.generation >> 32 == event.model->GetId());
    ListOf(time).push_back(event);
  }
  /// Appends `count` events of one time. The caller must fill them in before the next call.
  std::span<Event> AppendUninitialized(usec_t time, size_t count) {
    List& list = ListOf(time);
    list.resize(list.size() + count);
    return std::span(list).last(count);
  }

  /// Moves the events with a time up to `now` to *events, sorted by time; events of equal time keep
  /// the order of adding. Events added meanwhile wait for the next call.
  void Take(usec_t now, std::vector<Event>* events);

  /// Marks the events of a model as void. Take() removes those of all marked models in one pass.
  void Forget(const Model* model) noexcept;
  /// Removes them now. Call it before the ids of deleted models are used again.
  void RemoveCancelled();
  void Clear();
  /// Number of events examined in removing void ones; a measure of the work.
  uint64_t looked_at() const { return looked_at_; }

  /// Calls f(usec_t, const Event&) for all events by time, then in the order of adding.
  template <typename F>
  void ForEach(F f) {
    RemoveCancelled();
    for (const auto& [time, list] : due_)
      for (const Event& event : list) f(time, event);
  }

 private:
  using List = std::vector<Event>;
  List& ListOf(usec_t time);

  // The models share a few update intervals, so there are few distinct times.
  std::map<usec_t, List> due_;
  List* last_list_ = nullptr;  // of last_time_: the list that was added to last
  usec_t last_time_ = 0;
  std::vector<List> free_lists_;            // empty lists, kept for their memory
  std::unordered_set<uint32_t> cancelled_;  // ids of models whose events are void
  uint64_t looked_at_ = 0;
};

}  // namespace Stg

#endif
