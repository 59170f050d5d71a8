// SPDX-License-Identifier: GPL-2.0-or-later

#include "models/host.hh"

#include <algorithm>
#include <utility>

#include "messages/assert.hh"

namespace Stg {

namespace {
bool IsBefore(const Model* model, uint32_t id) { return model->GetId() < id; }
}  // namespace

Model* Host::FindModel(uint32_t id) const {
  const auto found = std::lower_bound(models.begin(), models.end(), id, IsBefore);
  return found != models.end() && (*found)->GetId() == id ? *found : nullptr;
}

void Host::FinishRaysOf(const Model* finder) {
  // Traces the whole batch, so that readings of other sensors are not lost.
  const auto& fans = scene.batch.fans();
  if (std::ranges::any_of(fans, [&](const sensing::Fan& fan) { return fan.finder == finder; }))
    TraceBatch();
}

void Host::Insert(std::vector<Model*>* list, Model* model) {
  const auto place = std::lower_bound(list->begin(), list->end(), model->GetId(), IsBefore);
  STAGE_ASSERT(place == list->end() || *place == model || (*place)->GetId() > model->GetId());
  if (place == list->end() || *place != model) list->insert(place, model);
}

void Host::Erase(std::vector<Model*>* list, const Model* model) {
  const auto place = std::lower_bound(list->begin(), list->end(), model->GetId(), IsBefore);
  if (place != list->end() && *place == model) list->erase(place);
}

void Host::DeferDelete(std::forward_list<std::shared_ptr<void>> data) noexcept {
  kept_data_.splice_after(kept_data_.before_begin(), data);  // does not allocate
}

void Host::RunDeferredDeletes() {
  if (!IsIdle()) return;
  // Swaps first, because freeing the data may add more.
  const std::forward_list<std::shared_ptr<void>> gone = std::exchange(kept_data_, {});
}

}  // namespace Stg
