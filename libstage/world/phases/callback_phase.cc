// SPDX-License-Identifier: GPL-2.0-or-later

#include "world/phases/callback_phase.hh"

#include <algorithm>
#include <atomic>

#include "messages/assert.hh"
#include "world/engine.hh"

namespace Stg {

namespace {
constexpr size_t kCallbackGrain = 8;
}  // namespace

void CallbackPhase::Run(WorldEngine* engine) {
  STAGE_ASSERT(engine->stepping);
  std::vector<Model*>& due = engine->update_callbacks_due;
  const auto send_ahead = [engine] { engine->tracer.SendAhead(); };
  // By index: a callback may delete models, which sets their entries to null, and update others.
  for (size_t i = 0; i < due.size();) {
    const size_t called =
        engine->parallel_choice.is_parallel()
            ? CallParallel(due.data() + i, due.size() - i, engine->workers(), send_ahead)
            : 0;
    if (called == 0 && due[i]) due[i]->CallCallbacks(Model::CB_UPDATE);
    i += std::max<size_t>(called, 1);
  }
  due.clear();
}

size_t CallbackPhase::CallParallel(Model* const* models, size_t count, threads::WorkerPool* workers,
                                   const std::function<void()>& beside) {
  if (workers->threads() == 1) return 0;
  count = interval_finder_.Find(count, [&] { return FindGroups(models, count, workers); });
  if (count == 0) return 0;
  STAGE_ASSERT(!group_begins_.empty() && group_begins_.back() <= count);
  STAGE_ASSERT(std::ranges::is_sorted(group_begins_));
  const size_t groups = group_begins_.size() - 1;
  exception_origin_.Begin();
  const auto call = [&](size_t begin, size_t end, unsigned) {
    uint32_t i = group_begins_[begin];
    try {
      for (; i < group_begins_[end]; i++)
        if (models[i]) models[i]->CallCallbacks(Model::CB_UPDATE);
    } catch (...) {
      exception_origin_.Note(i);
      throw;
    }
  };
  try {
    interval_finder_.Do(count, workers->threads(), [&] {
      workers->RunAlongside(beside, groups, workers->Grain(groups, kCallbackGrain), call);
    });
  } catch (...) {
    exception_origin_.Publish();
    throw;
  }
  return count;
}

size_t CallbackPhase::FindGroups(Model* const* models, size_t count, threads::WorkerPool* workers) {
  if (models[0] && models[0]->serial_update_callbacks_) return 0;
  // Tries a few on this thread: among mixed callbacks, the interval usually ends within them.
  const size_t few = std::min(count, threads::WorkerPool::kSerialTests);
  const size_t first = FindGroupsSerially(models, few);
  if (first < few || few == count) return first;
  return FindGroupsParallel(models, count, workers) ? count : FindGroupsSerially(models, count);
}

/// Like FindGroupsSerially(), in parallel. Returns false if not all can be called at the same time.
bool CallbackPhase::FindGroupsParallel(Model* const* models, size_t count,
                                       threads::WorkerPool* workers) {
  begins_group_.resize(count);
  interval_number_++;
  const size_t unfit = workers->FindFirst(count, [&](size_t i) {
    const Model* model = models[i];
    const Model* before = i > 0 ? models[i - 1] : nullptr;
    if (!model || (i > 0 && !before) || model->serial_update_callbacks_) return true;
    begins_group_[i] = !before || model->root != before->root;
    if (!begins_group_[i]) return false;
    std::atomic_ref<uint64_t> interval(model->root->callback_interval_);
    return interval.exchange(interval_number_, std::memory_order_relaxed) ==
           interval_number_;  // the tree came before
  });
  if (unfit < count) return false;
  group_begins_.clear();
  for (uint32_t i = 0; i < count; i++)
    if (begins_group_[i]) group_begins_.push_back(i);
  group_begins_.push_back(static_cast<uint32_t>(count));
  return true;
}

/// Stops at a model whose callbacks must run alone, or whose tree has an earlier group.
size_t CallbackPhase::FindGroupsSerially(Model* const* models, size_t count) {
  group_begins_.clear();
  interval_number_++;
  const Model* root = nullptr;  // of the current group
  size_t i = 0;
  for (; i < count; i++) {
    if (!models[i]) continue;
    if (models[i]->serial_update_callbacks_) break;
    if (models[i]->root == root) continue;
    root = models[i]->root;
    if (root->callback_interval_ == interval_number_) break;
    models[i]->root->callback_interval_ = interval_number_;
    group_begins_.push_back(static_cast<uint32_t>(i));
  }
  group_begins_.push_back(static_cast<uint32_t>(i));
  return i;
}

}  // namespace Stg
