// SPDX-License-Identifier: GPL-2.0-or-later
//
// How the worlds of a pool change their form.

#include <algorithm>
#include <cmath>
#include <span>
#include <string>
#include <utility>

#include "geometry/load_error.hh"
#include "models/model.hh"
#include "worlds/pool_access.hh"
#include "worlds/pool_impl.hh"

namespace Stg {

/// Frees rows that no world has used for a while, for example those from before a subscription.
/// Called before each step. Worlds that are reset in every step use some of them only for a moment.
void WorldPool::Impl::FreeUnusedRows() {
  if (forms_changed.load() == forms_of_freeing && !may_have_unused_rows) return;
  forms_of_freeing = forms_changed.load();
  may_have_unused_rows = false;
  std::vector<PoolVariant*> several;
  for (const auto& variant : variants)
    if (variant->HasSeveralRows()) several.push_back(variant.get());
  if (several.empty()) return;
  std::vector<std::array<bool, Subscriptions::kMost>> used(variants.size());
  for (const Slot& slot : slots)
    if (slot.form == Form::kRow) used[slot.variant->number][slot.subscriptions->number()] = true;
  for (PoolVariant* const variant : several)
    if (variant->FreeRows(used[variant->number])) may_have_unused_rows = true;
}

/// Makes a world that has just been loaded a row. Returns whether the world is a row now.
bool WorldPool::Impl::BecomeRow(uint32_t id) {
  Slot& slot = slots[id];
  if (slot.form != Form::kStart) return slot.form == Form::kRow;
  slot.rows = slot.variant->RowsOf(slot.subscriptions);
  if (!slot.rows) return false;
  RowsToChange(slot)->Reset(slot.place, seeds[id], slot.values);
  slot.form = Form::kRow;
  NoteForm();
  return true;
}

/// A row with the state of a world, which has no World object. As long as a world is as it was
/// loaded, it is a row of the thread, which is used for the next such world as well.
PoolRow WorldPool::Impl::RowToRead(uint32_t id, Thread* thread) {
  const Slot& slot = slots[id];
  if (slot.form == Form::kRow) return {NewestRows(slot), slot.place};
  if (slot.form == Form::kWorld || !slot.scene()->has_rows() || !slot.subscriptions->scene())
    return {};
  std::unique_ptr<rows::Rows>& start =
      thread->Of(*slot.variant).starts[slot.subscriptions->number()];
  try {
    if (!start) {
      start = std::make_unique<rows::Rows>(slot.subscriptions->scene(), std::span<uint64_t>());
      start->Resize(1);
    }
    start->Reset(0, seeds[id], slot.values);
  } catch (const LoadError&) {  // a population that does not fit
    return {};                  // so the World cannot be made either, and gives the reason
  }
  return {start.get(), 0};
}

thread_local WorldPool::Impl::Thread* WorldPool::Impl::current = nullptr;

/// The thread of the pool that calls, or the first one, which the caller of the pool is.
WorldPool::Impl::Thread* WorldPool::Impl::CurrentThread() {
  const bool is_own =
      current >= of_threads.data() && current < of_threads.data() + of_threads.size();
  return is_own ? current : &of_threads[0];
}

/// Puts the state of a world into a World object. Throws WorldFailure.
World* WorldPool::Impl::BecomeWorld(uint32_t id) {
  Slot& slot = slots[id];
  if (slot.form == Form::kWorld) return slot.world.get();
  if (slot.form == Form::kRow) {
    const rows::Rows& from = *NewestRows(slot);
    const auto write = [&] { return RowBridge::Write(from, slot.place, slot.world.get()); };
    if (!slot.world || !write()) {
      MakeWorld(id);
      if (!write()) throw WorldFailure{"its state cannot be written into a World"};
    }
  } else {
    if (!Restart(id)) MakeWorld(id);
    for (const uint32_t model : slot.subscriptions->models())
      if (Model* const found = slot.world.get()->FindModel(model)) found->Subscribe();
  }
  slot.form = Form::kWorld;
  slot.returns = false;
  NoteForm();
  return slot.world.get();
}

/// Makes a world a row if it is closed, and deletes its World object. Returns whether it did.
bool WorldPool::Impl::TakeBack(uint32_t id, Thread* thread) {
  Slot& slot = slots[id];
  World* const world = slot.form == Form::kWorld ? slot.world.get() : nullptr;
  if (!world) return false;
  Subscriptions* const subscriptions = slot.scene()->SubscriptionsOf(*world);
  rows::Rows* const into = slot.variant->RowsOf(subscriptions);
  if (!into) return false;
  World* const spare = thread->Spare(*slot.variant, 0);
  if (!RowBridge::Read(world, ToChange(into), slot.place, spare)) return false;
  delete world;
  slot.world = WorldHandle();
  slot.form = Form::kRow;
  slot.subscriptions = subscriptions;
  slot.rows = into;
  NoteForm();
  return true;
}

/// Takes a world back that got its World object for a short while. An attempt may fail, for example
/// right after a subscription, so the intervals between them double.
void WorldPool::Impl::TakeBackSometimes(uint32_t id, Thread* thread) {
  constexpr uint16_t kLongest = 1024;
  Slot& slot = slots[id];
  if (!slot.returns || ++slot.waited < slot.wait) return;
  slot.waited = 0;
  slot.wait = TakeBack(id, thread) ? uint16_t{1} : std::min<uint16_t>(2 * slot.wait, kLongest);
}

/// Memory of a thread for rows with the subscriptions of a world.
rows::Rows::Scratch* WorldPool::Impl::ScratchOf(const Slot& slot, Thread* thread,
                                                const rows::Rows& of) {
  std::shared_ptr<rows::Rows::Scratch>& scratch =
      thread->Of(*slot.variant).scratches[slot.subscriptions->number()];
  if (!scratch) scratch = of.MakeScratch();
  return scratch.get();
}

/// The subscriptions of a world and these models, except for those that have subscribers.
Subscriptions* WorldPool::Impl::WithAll(const Slot& slot, std::span<const uint32_t> models) {
  Subscriptions* subscriptions = slot.subscriptions;
  for (const uint32_t model : models)
    if (!subscriptions->Has(model) && !slot.scene()->IsRunningAfterLoading(model))
      subscriptions = subscriptions->With(model);
  return subscriptions;
}

void WorldPool::Impl::Subscribe(uint32_t id, std::span<const uint32_t> models) {
  Slot& slot = slots[id];
  const bool was_row = slot.form == Form::kRow;
  if (slot.form != Form::kWorld && slot.scene()->has_rows()) {
    Subscriptions* const with = WithAll(slot, models);
    if (with == slot.subscriptions) return;
    const bool is_new = !was_row || NewestRows(slot)->columns.steps[slot.place] == 0;
    rows::Rows* const into = was_row && is_new ? slot.variant->RowsOf(with) : nullptr;
    if (!was_row || (into && ToChange(into)->CopyStart(slot.place, *slot.rows))) {
      slot.subscriptions = with;
      slot.rows = into;
      NoteForm();
      return;
    }
  }
  World* const world = BecomeWorld(id);
  for (const uint32_t model : models) {
    Model* const found = world ? world->FindModel(model) : nullptr;
    if (found && !found->HasSubscribers()) found->Subscribe();
  }
  slot.returns = slot.returns || was_row;
}

std::string WorldPool::Impl::WhyNotClosed(uint32_t id) {
  const Slot& slot = slots[id];
  if (!slot.scene()->has_rows()) return slot.scene()->WhyNoRows();
  if (slot.form != Form::kWorld) return slot.subscriptions->reason();
  const World* const world = slot.world.get();
  if (!world) return "it does not exist";
  std::string reason = RowBridge::WhyNotClosed(*world);
  if (!reason.empty()) return reason;
  if (!slot.returns) return "its World object was asked for and not released";
  return slot.wait > 1 ? "its state is not that of a closed world, as after a change of what stands"
                       : "";
}

// ---- access of the library ----------------------------------------------------------------------

const rows::Scene* PoolAccess::SceneOf(WorldPool& pool, uint32_t id) {
  const WorldPool::Impl::Slot& slot = pool.impl_->slots[id];
  if (slot.form == WorldPool::Impl::Form::kRow) return &slot.rows->scene();
  if (slot.form == WorldPool::Impl::Form::kWorld || !slot.scene()->has_rows()) return nullptr;
  return slot.subscriptions->scene().get();
}

std::string PoolAccess::WhyNoRows(WorldPool& pool, uint32_t variant) {
  PoolScene& scene = *pool.impl_->variants[variant]->scene;
  return scene.has_rows() ? "" : scene.WhyNoRows();
}

SnapshotRow PoolAccess::ReadSnapshot(WorldPool& pool, const Snapshot& from) {
  WorldPool::Impl& impl = *pool.impl_;
  SnapshotRow read;
  std::string error;
  PoolVariant* const variant = impl.variants[0].get();
  if (!variant->scene->has_rows()) return read;
  try {
    impl.ReadSnapshot(variant, from, RowBridge::kMayLack, impl.CurrentThread(), &read, &error);
  } catch (const WorldFailure&) {  // a World object cannot be made
  }
  return read;
}

void PoolAccess::Restore(WorldPool& pool, uint32_t id, const SnapshotRow& from) {
  pool.impl_->RestoreRow(id, from);
}

PoolRow PoolAccess::Enter(WorldPool& pool, uint32_t id, const SnapshotRow& from) {
  WorldPool::Impl::Slot& slot = pool.impl_->slots[id];
  slot.rows = slot.variant->RowsOf(from.subscriptions);
  slot.form = WorldPool::Impl::Form::kRow;
  slot.subscriptions = from.subscriptions;
  slot.failure.clear();
  pool.impl_->NoteForm();
  return {slot.rows, slot.place};
}

void PoolAccess::Reseed(WorldPool& pool, uint32_t id, uint64_t seed) {
  const WorldPool::Impl::Slot& slot = pool.impl_->slots[id];
  RowBridge::Reseed(pool.impl_->RowsToChange(slot), slot.place, seed);
}

void PoolAccess::StepRow(WorldPool& pool, uint32_t id, uint64_t unseen) {
  WorldPool::Impl& impl = *pool.impl_;
  const WorldPool::Impl::Slot& slot = impl.slots[id];
  impl.RowsToChange(slot)->Step(slot.place, 1,
                                impl.ScratchOf(slot, impl.CurrentThread(), *slot.rows), unseen);
}

bool PoolAccess::Take(WorldPool& pool, uint32_t id, Snapshot* to, Snapshot::Keep keep) {
  WorldPool::Impl& impl = *pool.impl_;
  bool taken = false;
  impl.WithWorld(id, impl.CurrentThread(),
                 [&](const World& world) { taken = world.Take(to, keep); });
  return taken;
}

PoolRow PoolAccess::RowToRead(WorldPool& pool, uint32_t id) {
  return pool.impl_->RowToRead(id, pool.impl_->CurrentThread());
}

PoolRow PoolAccess::RowToChange(WorldPool& pool, uint32_t id) {
  if (!pool.impl_->BecomeRow(id)) return {};
  const WorldPool::Impl::Slot& slot = pool.impl_->slots[id];
  return {pool.impl_->RowsToChange(slot), slot.place};
}

void PoolAccess::Subscribe(WorldPool& pool, uint32_t id, std::span<const uint32_t> models) {
  pool.impl_->Subscribe(id, models);
}

void PoolAccess::Place(WorldPool& pool, uint32_t id, size_t mover, const rows::Planar& pose) {
  WorldPool::Impl& impl = *pool.impl_;
  const WorldPool::Impl::Slot& slot = impl.slots[id];
  impl.RowsToChange(slot)->Place(slot.place, mover, pose,
                                 impl.ScratchOf(slot, impl.CurrentThread(), *slot.rows));
}

bool WorldPool::Place(uint32_t id, uint32_t model, double x, double y, double heading) {
  if (id >= size() || !std::isfinite(x) || !std::isfinite(y) || !std::isfinite(heading))
    return false;
  if (const rows::Scene* const scene = PoolAccess::SceneOf(*this, id))
    if (const std::optional<uint32_t> mover = scene->FindMover(model);
        mover && !scene->movers[*mover].is_wall && impl_->BecomeRow(id)) {
      PoolAccess::Place(*this, id, *mover, {x, y, heading});
      return true;
    }
  World* const world = PoolAccess::Borrow(*this, id);
  Model* const found = world ? world->FindModel(model) : nullptr;
  if (!found || found->Parent()) return false;
  found->SetPose(Pose(x, y, found->GetPose().z, heading));
  return true;
}

bool PoolAccess::FindPlace(WorldPool& pool, uint32_t id, uint32_t model, rows::Planar* place) {
  if (const PoolRow row = RowToRead(pool, id)) {
    const rows::Scene& scene = row.rows->scene();
    if (const std::optional<uint32_t> mover = scene.FindMover(model)) {
      *place = row.rows->columns.pose[row.row * scene.movers.size() + *mover];
      return true;
    }
  }
  // All other models stand where they stood after loading.
  const bool is_row = SceneOf(pool, id) != nullptr;
  const std::shared_ptr<const World> example = is_row ? Example(pool, pool.Variant(id)) : nullptr;
  const World* const world = is_row ? example.get() : Borrow(pool, id);
  const Model* const found = world ? world->FindModel(model) : nullptr;
  if (!found || found->Parent()) return false;
  *place = rows::PlanarOf(found->GetPose());
  return true;
}

std::shared_ptr<const World> PoolAccess::Example(const WorldPool& pool, uint32_t variant) {
  PoolScene& of = *pool.impl_->variants[variant]->scene;
  if (!of.has_rows()) return of.Make();
  const std::shared_ptr<const rows::Scene>& scene = of.loaded()->scene();
  return {scene, scene->prototype.get()};
}

World* PoolAccess::Borrow(WorldPool& pool, uint32_t id) {
  if (id >= pool.size()) return nullptr;
  WorldPool::Impl::Slot& slot = pool.impl_->slots[id];
  const bool returns = slot.returns || slot.form != WorldPool::Impl::Form::kWorld;
  World* const world = pool.At(id);
  slot.returns = returns;
  return world;
}

bool PoolAccess::HasWorld(const WorldPool& pool, uint32_t id) {
  return pool.impl_->slots[id].form == WorldPool::Impl::Form::kWorld;
}

// ---- rays and looks -----------------------------------------------------------------------------

bool PoolAccess::Cast(WorldPool& pool, uint32_t id, const rows::Casting& casting,
                      std::span<const rows::Planar> poses, const uint32_t* ignored,
                      double* ranges) {
  WorldPool::Impl& impl = *pool.impl_;
  WorldPool::Impl::Thread* const thread = impl.CurrentThread();
  const PoolRow row = impl.RowToRead(id, thread);
  if (!row) return false;
  const WorldPool::Impl::Slot& slot = impl.slots[id];
  row.rows->Cast(row.row, casting, poses, ignored, ranges, impl.ScratchOf(slot, thread, *row.rows));
  return true;
}

bool PoolAccess::FindContacts(WorldPool& pool, uint32_t id, std::vector<ContactPoint>* to) {
  WorldPool::Impl& impl = *pool.impl_;
  WorldPool::Impl::Thread* const thread = impl.CurrentThread();
  const PoolRow row = impl.RowToRead(id, thread);
  if (!row) return false;
  row.rows->FindContacts(row.row, impl.ScratchOf(impl.slots[id], thread, *row.rows), to);
  return true;
}

bool PoolAccess::Look(WorldPool& pool, uint32_t id, const std::function<void(World& world)>& call) {
  try {
    pool.impl_->WithWorld(id, pool.impl_->CurrentThread(), call);
    return true;
  } catch (const WorldFailure&) {
    return false;
  }
}

// ---- states as words ----------------------------------------------------------------------------

Subscriptions* PoolAccess::SubscriptionsOf(WorldPool& pool, uint32_t id) {
  WorldPool::Impl& impl = *pool.impl_;
  WorldPool::Impl::Slot& slot = impl.slots[id];
  if (!slot.scene()->has_rows()) return nullptr;
  if (slot.form == WorldPool::Impl::Form::kWorld)
    if (!slot.returns || !impl.TakeBack(id, impl.CurrentThread())) return nullptr;
  return slot.subscriptions->scene() ? slot.subscriptions : nullptr;
}

Subscriptions* PoolAccess::FindSubscriptions(WorldPool& pool, uint32_t variant,
                                             std::span<const uint32_t> models,
                                             std::string* reason) {
  PoolVariant& of = *pool.impl_->variants[variant];
  *reason = WhyNoRows(pool, variant);
  if (!reason->empty()) return nullptr;
  Subscriptions* found = of.scene->loaded();
  for (const uint32_t model : models) found = found->With(model);
  if (of.RowsOf(found)) return found;
  *reason = found->reason();
  return nullptr;
}

bool PoolAccess::IsReseeded(const WorldPool& pool, uint32_t id) {
  const WorldPool::Impl::Slot& slot = pool.impl_->slots[id];
  return slot.form == WorldPool::Impl::Form::kRow &&
         slot.rows->columns.reseeding[slot.place] != nullptr;
}

bool PoolAccess::CanEnter(WorldPool& pool, uint32_t id) { return pool.impl_->CanRestoreRow(id); }

PoolRow PoolAccess::Enter(WorldPool& pool, uint32_t id, Subscriptions* subscriptions) {
  WorldPool::Impl& impl = *pool.impl_;
  WorldPool::Impl::Slot& slot = impl.slots[id];
  slot.rows = impl.ToChange(slot.variant->RowsOf(subscriptions));
  slot.form = WorldPool::Impl::Form::kRow;
  slot.subscriptions = subscriptions;
  slot.failure.clear();
  impl.NoteForm();
  return {slot.rows, slot.place};
}

uint64_t PoolAccess::HashOfFiles(WorldPool& pool, uint32_t variant) {
  return pool.impl_->variants[variant]->scene->HashOfFiles();
}

}  // namespace Stg
