// SPDX-License-Identifier: GPL-2.0-or-later

#include "world/callback_phase.hh"

namespace Stg {

namespace {
constexpr size_t kGrain = 8;
}  // namespace

size_t CallbackPhase::Call(Model* const* models, size_t count, sensing::WorkerPool* workers) {
  if (workers->threads() == 1) return 0;
  count = runs_.Find(count, [&] { return FindGroups(models, count); });
  if (count == 0) return 0;
  const size_t groups = group_begins_.size() - 1;
  workers->Run(groups, workers->Grain(groups, kGrain), [&](size_t begin, size_t end, unsigned) {
    for (uint32_t i = group_begins_[begin]; i < group_begins_[end]; i++)
      if (models[i]) models[i]->CallCallbacks(Model::CB_UPDATE);
  });
  return count;
}

/// Goes on until a model's callbacks need to be called alone, or a tree comes again behind others.
size_t CallbackPhase::FindGroups(Model* const* models, size_t count) {
  group_begins_.clear();
  run_++;
  const Model* root = nullptr;  // of the present group
  size_t i = 0;
  for (; i < count; i++) {
    if (!models[i]) continue;
    if (models[i]->serial_update_callbacks_) break;
    if (models[i]->root == root) continue;
    root = models[i]->root;
    if (root->callback_run_ == run_) break;
    models[i]->root->callback_run_ = run_;
    group_begins_.push_back(static_cast<uint32_t>(i));
  }
  group_begins_.push_back(static_cast<uint32_t>(i));
  return i;
}

}  // namespace Stg
