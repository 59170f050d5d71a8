// SPDX-License-Identifier: GPL-2.0-or-later

#include "worlds/pool_variant.hh"

#include <algorithm>

namespace Stg {

uint32_t PoolVariant::AddWorld() {
  if (free_.empty()) return places_++;
  const uint32_t place = free_.back();
  free_.pop_back();
  return place;
}

void PoolVariant::RemoveWorld(uint32_t place) {
  if (place + 1 == places_)
    places_--;
  else
    free_.push_back(place);
  if (free_.size() < places_) return;
  free_.clear();  // no world is left
  places_ = 0;
}

void PoolVariant::Grow() {
  for (const auto& owned : owned_rows_) {
    if (!owned || owned->size() == places_) continue;
    if (device_) device_->Fetch(owned.get());
    if (device_) device_->Forget(owned.get());
    owned->Resize(places_);
  }
}

rows::Rows* PoolVariant::RowsOf(Subscriptions* subscriptions) {
  if (!subscriptions || !scene->has_rows() || !subscriptions->scene()) return nullptr;
  std::atomic<rows::Rows*>& known = rows_[subscriptions->number()];
  if (rows::Rows* const found = known.load(std::memory_order_acquire)) return found;
  const std::lock_guard lock(making_rows_);
  std::unique_ptr<rows::Rows>& owned = owned_rows_[subscriptions->number()];
  if (owned) return owned.get();
  owned = std::make_unique<rows::Rows>(subscriptions->scene(), std::vector<uint64_t>());
  owned->Resize(places_);
  calls_without_use_[subscriptions->number()] = 0;
  known.store(owned.get(), std::memory_order_release);
  return owned.get();
}

bool PoolVariant::HasSeveralRows() const {
  return std::ranges::count_if(owned_rows_, [](const auto& owned) { return owned != nullptr; }) > 1;
}

bool PoolVariant::FreeRows(const std::array<bool, Subscriptions::kMost>& used) {
  bool keeps_unused = false;
  for (size_t i = 0; i < owned_rows_.size(); i++) {
    if (!owned_rows_[i]) continue;
    calls_without_use_[i] = used[i] ? 0 : calls_without_use_[i] + 1;
    if (used[i]) continue;
    if (calls_without_use_[i] < kMostCallsWithoutUse) {
      keeps_unused = true;
      continue;
    }
    Free(i);
  }
  return keeps_unused;
}

void PoolVariant::FreeAllRows() {
  for (size_t i = 0; i < owned_rows_.size(); i++)
    if (owned_rows_[i]) Free(i);
}

void PoolVariant::Free(size_t i) {
  if (device_) device_->Forget(owned_rows_[i].get());
  owned_rows_[i].reset();
  rows_[i] = nullptr;
  calls_without_use_[i] = 0;
}

}  // namespace Stg
