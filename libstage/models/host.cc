// SPDX-License-Identifier: GPL-2.0-or-later

#include "models/host.hh"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>

#include "messages/assert.hh"
#include "messages/report.hh"

namespace Stg {

namespace {
bool IsBefore(const Model* model, uint32_t id) { return model->GetId() < id; }

/// True if the two models before this place of a list and the two from it on are in the order of
/// creation.
[[maybe_unused]] bool IsInOrderAround(const std::vector<Model*>& list,
                                      std::vector<Model*>::const_iterator place) {
  const auto first = place - std::min<std::ptrdiff_t>(place - list.begin(), 2);
  const auto last = place + std::min<std::ptrdiff_t>(list.end() - place, 2);
  return std::adjacent_find(first, last, [](const Model* before, const Model* after) {
           return before->GetId() >= after->GetId();
         }) == last;
}
}  // namespace

Model* Host::FindModel(uint32_t id) const {
  const auto found = std::lower_bound(models.begin(), models.end(), id, IsBefore);
  return found != models.end() && (*found)->GetId() == id ? *found : nullptr;
}

Model* Host::GetModel(const std::string& name) const {
  if (Model* found = names.Find(name, *this)) return found;
  messages::Warn("there is no model called " + messages::Quoted(name));
  return nullptr;
}

/// Leaves the state unchanged because any observer may call it: thin outlines stay as they are, and
/// bodies that are not rasterized stay so.
void Host::RasterizeForExactRays() {
  if (scene.exact_rasterization) return;
  TraceBatch();
  scene.exact_rasterization = true;
  try {
    for (Model* model : models) {
      placement.Propose(*model, false);
      placement.AddExactRasterizations();
    }
  } catch (...) {  // out of memory: everything is rasterized again the next time
    scene.exact_rasterization = false;
    throw;
  }
}

int32_t Host::MetersToPixels(meters_t x) const {
  // Values outside the range of cell numbers become the first or last cell.
  constexpr double kFirst = std::numeric_limits<int32_t>::min();
  constexpr double kLast = std::numeric_limits<int32_t>::max();
  const double cell = std::floor(x * scene.cells_per_metre);
  return static_cast<int32_t>(std::isnan(cell) ? kFirst : constrain(cell, kFirst, kLast));
}

void Host::FinishRaysOf(const Model* finder) {
  // Traces the whole batch, so that readings of other sensors are not lost.
  const auto& fans = scene.batch.fans();
  if (std::ranges::any_of(fans, [&](const sensing::Fan& fan) { return fan.finder == finder; }))
    TraceBatch();
}

void Host::NoteOutlineChange(Model* root) {
  contacts_known = false;
  constexpr size_t kMany = 1000;  // then all outlines are found again
  if (contacts_changed || contact_model != ContactModel::kOutlines) {
    contacts_changed = true;
  } else if (changed_outlines.size() == kMany) {
    contacts_changed = true;
    changed_outlines.clear();
  } else if (changed_outlines.empty() || changed_outlines.back() != root) {
    changed_outlines.push_back(root);
  }
}

void Host::Insert(std::vector<Model*>* list, Model* model) {
  const auto place = std::lower_bound(list->begin(), list->end(), model->GetId(), IsBefore);
  STAGE_ASSERT(place == list->end() || *place == model || (*place)->GetId() > model->GetId());
  STAGE_ASSERT(IsInOrderAround(*list, place));
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
