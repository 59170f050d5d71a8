// SPDX-License-Identifier: GPL-2.0-or-later
//
// How the worlds of a pool are stepped on its device.

#include <algorithm>
#include <mutex>
#include <string>
#include <utility>

#include "rows/device_controls.hh"
#include "threads/wall_clock.hh"
#include "worlds/pool_access.hh"
#include "worlds/pool_impl.hh"

namespace Stg {

/// Makes rows of the worlds that have just been loaded, if they are closed.
void WorldPool::Impl::BecomeRows() {
  Ids loaded;
  for (uint32_t id = 0; id < slots.size(); id++)
    if (slots[id].form == Form::kStart) loaded.push_back(id);
  ForEach(loaded, [&](uint32_t id, Thread*) { BecomeRow(id); });
}

/// The rows that all worlds are in; null if some have World objects, have failed or are in other
/// rows. Worlds that have just been loaded become rows.
rows::Rows* WorldPool::Impl::CommonRows() {
  if (forms_changed.load() == forms_of_common) return common;
  common = nullptr;
  BecomeRows();
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

/// The worlds that the device can step, by their rows. Puts the others into `others`.
std::vector<WorldPool::Impl::DeviceGroup> WorldPool::Impl::GroupForDevice(const Ids& ids,
                                                                          Ids* others) {
  BecomeRows();
  std::vector<DeviceGroup> groups;
  for (const uint32_t id : ids) {
    const Slot& slot = slots[id];
    if (!slot.failure.empty() || slot.form != Form::kRow ||
        !device->WhyNot(slot.rows->shared_scene()).empty()) {
      others->push_back(id);
      continue;
    }
    auto group = std::ranges::find(groups, slot.rows, &DeviceGroup::rows);
    if (group == groups.end()) group = groups.insert(group, DeviceGroup{slot.rows, {}, {}});
    group->ids.push_back(id);
    group->places.push_back(slot.place);
  }
  return groups;
}

/// Makes those worlds fail whose newest state was on the device, which has an error.
void WorldPool::Impl::AbandonDevice(const std::string& why) {
  Ids lost;
  for (uint32_t id = 0; id < slots.size(); id++)
    if (slots[id].form == Form::kRow && device->IsAhead(slots[id].rows)) lost.push_back(id);
  device->Abandon();
  Fail(lost, why);
}

/// Steps those worlds that the device can step. Returns the others.
WorldPool::Ids WorldPool::Impl::StepOnDevice(const Ids& ids, uint64_t steps, StepObserver* observer,
                                             uint64_t unit) {
  Ids others;
  const std::vector<DeviceGroup> groups = GroupForDevice(ids, &others);
  if (groups.empty()) return ids;
  Ids here = ids;
  std::erase_if(here, [&, next = others.begin()](uint32_t id) mutable {
    return next != others.end() && *next == id && (++next, true);
  });
  try {
    StepOnDevice(groups, here, steps, observer, unit);
  } catch (const rows::RowDeviceError& error) {
    AbandonDevice(error.what());
    Fail(here, error.what());
  }
  return others;
}

/// Makes rounds of steps of these worlds, which are in these rows.
void WorldPool::Impl::StepOnDevice(std::vector<DeviceGroup> groups, Ids ids, uint64_t steps,
                                   StepObserver* observer, uint64_t unit) {
  for (uint64_t done = 0; done < steps && !ids.empty();) {
    const uint64_t end = done + std::min({StepsOfRound(device_step_seconds, ids.size(), unit),
                                          steps - done, uint64_t{UINT32_MAX}});
    const double start = threads::WallClock();
    const auto count = static_cast<uint32_t>(end - done);
    for (DeviceGroup& group : groups) StepGroup(&group, count);
    device->Finish();
    device_step_seconds = (threads::WallClock() - start) / static_cast<double>(count * ids.size());
    if (observer)
      ForEach(ids, [&](uint32_t id, Thread*) {
        observer->AfterRound(
            id, done, end,
            slots[id].failure.empty() ? StepObserver::kMadeAllSteps : StepObserver::kHasFailed);
      });
    std::erase_if(ids, [&](uint32_t id) { return !slots[id].failure.empty(); });
    done = end;
    if (observer && done < steps) observer->BetweenRounds();
  }
}

/// Steps the worlds of a group. Those whose controllers fail leave it.
void WorldPool::Impl::StepGroup(DeviceGroup* group, uint32_t steps) {
  if (group->ids.empty()) return;
  std::vector<ControlFailure> failures = StepRows(slots[group->ids[0]], group->places, steps, 0);
  for (const ControlFailure& failure : failures) Fail({group->ids[failure.index]}, failure.why);
  if (failures.empty()) return;
  std::erase_if(group->ids, [&](uint32_t id) { return !slots[id].failure.empty(); });
  group->places.clear();
  for (const uint32_t id : group->ids) group->places.push_back(slots[id].place);
}

/// Steps rows at these places, which those of `any` are among. Controllers that are not built in
/// are called by the host, on all threads, after each step.
std::vector<ControlFailure> WorldPool::Impl::StepRows(const Slot& any,
                                                      std::span<const uint32_t> places,
                                                      uint32_t steps, uint32_t unseen) {
  std::vector<ControlFailure> failures;
  rows::DeviceRows* const on_device = device->Send(any.rows);
  device->NoteSteps(any.rows);
  if (!on_device->has_controls_on_host()) {
    const bool is_all = places.size() == on_device->size();
    is_all ? on_device->Step(steps, unseen) : on_device->StepSome(places, steps, unseen);
    return failures;
  }
  for (uint32_t step = 0; step < steps; step++) {
    on_device->StepSome(places, 1);
    on_device->ReadForControls();
    CallControllers(any, places, step, &failures);
    on_device->WriteControls(*any.rows);
  }
  return failures;
}

/// Calls the controllers of all worlds, except for those that have failed.
void WorldPool::Impl::CallControllers(const Slot& any, std::span<const uint32_t> places,
                                      uint32_t step, std::vector<ControlFailure>* failures) {
  constexpr size_t kGrain = 8;
  const rows::DeviceRows& on_device = *device->Send(any.rows);
  std::vector<bool> failed(places.size());
  for (const ControlFailure& failure : *failures) failed[failure.index] = true;
  std::mutex failing;
  workers->Run(places.size(), kGrain, [&](size_t begin, size_t end, unsigned thread) {
    rows::Rows::Scratch* const scratch = ScratchOf(any, &of_threads[thread], *any.rows);
    for (size_t i = begin; i < end; i++) {
      if (failed[i]) continue;
      try {
        on_device.TakeForControls(places[i], any.rows);
        any.rows->RunControls(places[i], scratch);
      } catch (...) {
        const std::lock_guard lock(failing);
        failures->push_back({i, step, DescribeException()});
      }
    }
  });
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
  rows::DeviceRows* const on_device = impl.device->Send(of);
  return on_device->has_controls_on_host() ? nullptr : on_device;
}

std::vector<ControlFailure> PoolAccess::StepOnDevice(WorldPool& pool, uint32_t id,
                                                     std::span<const uint32_t> places,
                                                     uint32_t steps, uint32_t unseen) {
  return pool.impl_->StepRows(pool.impl_->slots[id], places, steps, unseen);
}

bool PoolAccess::HasControlsOnHost(WorldPool& pool) {
  PoolScene& scene = *pool.impl_->variants[0]->scene;
  return scene.has_rows() && !rows::WhyNotControls(*scene.loaded()->scene()).empty();
}

rows::DeviceRows* PoolAccess::OnDevice(WorldPool& pool, rows::Rows* rows) {
  return pool.impl_->device->Send(rows);
}

std::string PoolAccess::WhyNotOnDevice(WorldPool& pool,
                                       const std::shared_ptr<const rows::Scene>& scene) {
  return pool.impl_->device ? pool.impl_->device->WhyNot(scene) : "the pool has no device";
}

std::string PoolAccess::WhyNotOnDevice(WorldPool& pool) {
  return WhyNotOnDevice(pool, pool.impl_->variants[0]->scene->loaded()->scene());
}

void PoolAccess::NoteDeviceSteps(WorldPool& pool) { NoteDeviceSteps(pool, pool.impl_->common); }

void PoolAccess::NoteDeviceSteps(WorldPool& pool, const rows::Rows* rows) {
  pool.impl_->device->NoteSteps(rows);
}

void PoolAccess::ForgetDeviceStates(WorldPool& pool) { pool.impl_->device->ForgetStates(); }

void PoolAccess::AbandonDevice(WorldPool& pool) { pool.impl_->device->Abandon(); }

void PoolAccess::ResetOnDevice(WorldPool& pool, std::span<const uint32_t> ids,
                               std::span<const uint64_t> seeds, OwnValues values) {
  std::vector<std::span<const double>> given;
  for (size_t i = 0; i < ids.size(); i++) {
    pool.impl_->seeds[ids[i]] = seeds[i];
    if (values.data) SetValues(pool, ids[i], values.data + i * values.most, values.most);
    given.push_back(pool.impl_->slots[ids[i]].values);
  }
  OnDevice(pool)->Reset(ids, seeds, given);
  for (const uint32_t id : ids)
    pool.impl_->common->columns.reseeding[pool.impl_->slots[id].place].reset();
  NoteDeviceSteps(pool);
}

void PoolAccess::ResetToVariant(WorldPool& pool, uint32_t variant, const std::vector<uint32_t>& ids,
                                const std::vector<uint64_t>& seeds, OwnValues values) {
  const std::vector<uint32_t> running = pool.impl_->slots[0].subscriptions->models();
  const std::vector<uint32_t> variants(ids.size(), variant);
  pool.impl_->SetVariants(pool.All(), variants);  // places are in the order of the worlds
  if (values.data)
    Reset(pool, ids, seeds, variants, values.data, values.most);
  else
    pool.Reset(ids, seeds, variants);
  pool.ForEach(ids, [&](uint32_t id) { Subscribe(pool, id, running); });
}

std::string PoolAccess::CarryToVariant(WorldPool& pool, uint32_t variant, OwnValues values) {
  WorldPool::Impl& impl = *pool.impl_;
  PoolVariant* const to = impl.variants[variant].get();
  std::string reason;
  Subscriptions* const running =
      FindSubscriptions(pool, variant, impl.slots[0].subscriptions->models(), &reason);
  if (!running) return reason;
  const rows::Rows* const before = impl.NewestRows(impl.slots[0]);
  std::vector<uint32_t> places;
  for (uint32_t id = 0; id < pool.size(); id++) places.push_back(to->AddWorld());
  to->Grow();
  rows::Rows* const after = impl.ToChange(to->RowsOf(running));
  impl.ForEach(pool.All(), [&](uint32_t id, WorldPool::Impl::Thread*) {
    after->CopyAcross(places[id], *before, impl.slots[id].place);
  });
  for (uint32_t id = 0; id < pool.size(); id++) {
    impl.SetVariantOfRow(id, to, places[id], running, after);
    SetValues(pool, id, values.data + id * values.most, values.most);
  }
  for (const auto& each : impl.variants) each->Grow();
  impl.NoteForm();
  return "";
}

}  // namespace Stg
