// SPDX-License-Identifier: GPL-2.0-or-later
//
// How the worlds of a pool are stepped on its device.

#include <algorithm>
#include <string>
#include <utility>

#include "threads/wall_clock.hh"
#include "worlds/pool_access.hh"
#include "worlds/pool_impl.hh"

namespace Stg {

/// The rows that all worlds are in; null if some have World objects, have failed or are in other
/// rows. Worlds that have just been loaded become rows.
rows::Rows* WorldPool::Impl::CommonRows() {
  if (forms_changed.load() == forms_of_common) return common;
  common = nullptr;
  Ids loaded;
  for (uint32_t id = 0; id < slots.size(); id++)
    if (slots[id].form == Form::kStart) loaded.push_back(id);
  ForEach(loaded, [&](uint32_t id, Thread*) { BecomeRow(id); });
  forms_of_common = forms_changed.load();
  if (slots.empty()) return nullptr;
  const bool is_common = std::ranges::all_of(slots, [&](const Slot& slot) {
    return slot.form == Form::kRow && slot.rows == slots[0].rows && slot.failure.empty();
  });
  return common = is_common ? slots[0].rows : nullptr;
}

void WorldPool::Impl::Fail(const Ids& ids, const std::string& why) {
  for (const uint32_t id : ids) slots[id].failure = why;
  NoteForm();
}

/// Steps those worlds that the device can step. Returns the others.
WorldPool::Ids WorldPool::Impl::StepOnDevice(const Ids& ids, uint64_t steps, StepObserver* observer,
                                             uint64_t unit) {
  rows::Rows* of = CommonRows();
  Ids here = of ? ids : Ids(), others;
  for (size_t i = 0; !of && i < ids.size(); i++)
    if (slots[ids[i]].failure.empty() && BecomeRow(ids[i])) of = slots[ids[i]].rows;
  if (!of || !device->WhyNot(of->shared_scene()).empty()) return ids;
  if (here.empty())
    for (const uint32_t id : ids) {
      const bool is_here = slots[id].failure.empty() && BecomeRow(id) && slots[id].rows == of;
      (is_here ? here : others).push_back(id);
    }
  try {
    StepOnDevice(of, here, steps, observer, unit);
  } catch (const rows::RowDeviceError& error) {
    device->Abandon();
    Fail(here, error.what());
  }
  return others;
}

/// Makes rounds of steps of these worlds, all of which are in the rows.
void WorldPool::Impl::StepOnDevice(rows::Rows* of, const Ids& ids, uint64_t steps,
                                   StepObserver* observer, uint64_t unit) {
  for (uint64_t done = 0; done < steps;) {
    const uint64_t end = done + std::min({StepsOfRound(device_step_seconds, ids.size(), unit),
                                          steps - done, uint64_t{UINT32_MAX}});
    const double start = threads::WallClock();
    rows::DeviceRows* const on_device = device->Send(of);
    const auto count = static_cast<uint32_t>(end - done);
    ids.size() == slots.size() ? on_device->Step(count) : on_device->StepSome(ids, count);
    device->NoteSteps();
    device->Finish();
    device_step_seconds = (threads::WallClock() - start) / static_cast<double>(count * ids.size());
    if (observer)
      ForEach(ids, [&](uint32_t id, Thread*) {
        observer->AfterRound(id, done, end, StepObserver::kMadeAllSteps);
      });
    done = end;
    if (observer && done < steps) observer->BetweenRounds();
  }
}

std::string WorldPool::WhyNotOnDevice(uint32_t id) const {
  if (!impl_->device) return "the pool has no device";
  std::string reason = impl_->WhyNotClosed(id);
  if (!reason.empty()) return reason;
  const Impl::Slot& slot = impl_->slots[id];
  if (slot.form == Impl::Form::kWorld) return "its World object was needed just now";
  return impl_->device->WhyNot(slot.subscriptions->scene());
}

// ---- access of the library ----------------------------------------------------------------------

rows::DeviceRows* PoolAccess::OnDevice(WorldPool& pool) {
  WorldPool::Impl& impl = *pool.impl_;
  rows::Rows* const of = impl.device ? impl.CommonRows() : nullptr;
  if (!of || !impl.device->WhyNot(of->shared_scene()).empty()) return nullptr;
  return impl.device->Send(of);
}

void PoolAccess::NoteDeviceSteps(WorldPool& pool) { pool.impl_->device->NoteSteps(); }

void PoolAccess::ResetOnDevice(WorldPool& pool, std::span<const uint32_t> ids,
                               std::span<const uint64_t> seeds) {
  for (size_t i = 0; i < ids.size(); i++) pool.impl_->seeds[ids[i]] = seeds[i];
  OnDevice(pool)->Reset(ids, seeds);
  for (const uint32_t id : ids)
    pool.impl_->common->columns.reseeding[pool.impl_->slots[id].place].reset();
  NoteDeviceSteps(pool);
}

}  // namespace Stg
