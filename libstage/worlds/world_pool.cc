// SPDX-License-Identifier: GPL-2.0-or-later

#include "worlds/world_pool.hh"

#include <algorithm>
#include <numeric>
#include <string>
#include <utility>

#include "messages/assert.hh"
#include "messages/report.hh"
#include "threads/processors.hh"
#include "threads/wall_clock.hh"
#include "worlds/pool_impl.hh"

namespace Stg {

bool StepObserver::TakesPartInSteps() const { return true; }
void StepObserver::BeforeStep(uint32_t, uint64_t) {}
void StepObserver::AfterStep(uint32_t, uint64_t) {}
uint64_t StepObserver::StepsAtOnce(uint32_t, uint64_t) { return 1; }
void StepObserver::AfterRound(uint32_t, uint64_t, uint64_t, Outcome) {}
void StepObserver::BetweenRounds() {}

WorldPool::Impl::Impl(const Scenes& scenes, const std::vector<uint64_t>& with_seeds,
                      const std::vector<uint32_t>& with_variants, unsigned threads,
                      std::shared_ptr<rows::RowDevice> with_device)
    : device(with_device ? std::make_unique<PoolDevice>(std::move(with_device)) : nullptr),
      workers(threads::MakeWorkerPool(threads)),
      of_threads(workers->threads()) {
  for (const std::shared_ptr<PoolScene>& scene : scenes)
    variants.push_back(
        std::make_unique<PoolVariant>(scene, static_cast<uint32_t>(variants.size()), device.get()));
  for (Thread& thread : of_threads) thread.of_variants.resize(variants.size());
  Resize(with_seeds, with_variants);
}

WorldPool::Impl::~Impl() {
  for (const Slot& slot : slots) delete slot.world.get();
}

/// New worlds get the seeds and variants at their ids; without a variant there, the first one.
void WorldPool::Impl::Resize(const std::vector<uint64_t>& with_seeds,
                             const std::vector<uint32_t>& with_variants) {
  const size_t count = with_seeds.size(), before = slots.size();
  for (size_t id = before; id-- > count;) {
    delete slots[id].world.get();
    slots[id].variant->RemoveWorld(slots[id].place);
  }
  seeds.resize(std::min(count, before));
  slots.resize(count);
  for (size_t id = before; id < count; id++) {
    seeds.push_back(with_seeds[id]);
    SetVariant(static_cast<uint32_t>(id), id < with_variants.size() ? with_variants[id] : 0);
  }
  for (const auto& variant : variants) variant->Grow();
  NoteForm();
}

WorldPool::Impl::Scenes WorldPool::Impl::AllScenes() const {
  Scenes scenes;
  for (const auto& variant : variants) scenes.push_back(variant->scene);
  return scenes;
}

std::vector<uint32_t> WorldPool::Impl::AllVariants() const {
  std::vector<uint32_t> of_worlds;
  for (const Slot& slot : slots) of_worlds.push_back(slot.variant->number);
  return of_worlds;
}

/// Replaces a variant without worlds, or adds the next one.
void WorldPool::Impl::SetScene(uint32_t variant, std::shared_ptr<PoolScene> scene) {
  auto made = std::make_unique<PoolVariant>(std::move(scene), variant, device.get());
  if (variant == variants.size()) variants.emplace_back();
  for (Thread& thread : of_threads) {
    for (std::unique_ptr<SpareWorld>& spare : thread.spares) spare.reset();
    thread.spares_of = nullptr;
    thread.of_variants.resize(variants.size());
    thread.of_variants[variant].reset();
  }
  if (variants[variant]) variants[variant]->FreeAllRows();
  if (device) device->ForgetReasons();
  variants[variant] = std::move(made);
  NoteForm();
}

/// Makes a world one of another variant, in the state after loading. PoolVariant::Grow() must
/// follow.
void WorldPool::Impl::SetVariant(uint32_t id, uint32_t variant) {
  STAGE_ASSERT(variant < variants.size());
  Slot& slot = slots[id];
  if (slot.variant) slot.variant->RemoveWorld(slot.place);
  delete slot.world.get();
  slot.world = WorldHandle();
  slot.variant = variants[variant].get();
  slot.place = slot.variant->AddWorld();
  slot.values.clear();
  slot.form = Form::kStart;
  slot.subscriptions = slot.scene()->loaded();
}

/// Makes a world, which is a row, one of another variant, where it has been copied to a row.
void WorldPool::Impl::SetVariantOfRow(uint32_t id, PoolVariant* to, uint32_t place,
                                      Subscriptions* with, rows::Rows* in) {
  Slot& slot = slots[id];
  slot.variant->RemoveWorld(slot.place);
  delete slot.world.get();
  slot.world = WorldHandle();
  slot.variant = to;
  slot.place = place;
  slot.subscriptions = with;
  slot.rows = in;
}

/// Makes worlds those of other variants, in the state after loading.
void WorldPool::Impl::SetVariants(const Ids& ids, const std::vector<uint32_t>& to) {
  STAGE_ASSERT(ids.size() == to.size());
  for (size_t i = 0; i < ids.size(); i++)
    if (to[i] != slots[ids[i]].variant->number) SetVariant(ids[i], to[i]);
  for (const auto& variant : variants) variant->Grow();
}

/// Makes the World object, or makes it again, in the state after loading.
void WorldPool::Impl::MakeWorld(uint32_t id) {
  Slot& slot = slots[id];
  NoteForm();
  delete slot.world.get();
  slot.world = WorldHandle();
  slot.times_made++;
  slot.world = WorldHandle(slot.scene()->Make(seeds[id]).release());
  VaryWorld(id);
}

/// Resets the world by loading it again.
void WorldPool::Impl::Load(uint32_t id) {
  Slot& slot = slots[id];
  slot.failure.clear();
  slot.form = Form::kWorld;
  slot.returns = false;
  MakeWorld(id);
}

/// Makes the World object, or makes it again if it has been unloaded; the world has failed if that
/// fails.
void WorldPool::Impl::TryToMake(uint32_t id) {
  try {
    if (slots[id].form == Form::kWorld) return Load(id);
    BecomeWorld(id);
  } catch (const WorldFailure& failure) {
    slots[id].failure = failure.why;
  } catch (...) {
    slots[id].failure = DescribeException();
  }
  NoteForm();
}

/// The World object, made if this has not been done yet. Throws WorldFailure if there is none.
World* WorldPool::Impl::Require(uint32_t id) {
  World* const world = BecomeWorld(id);
  if (!world) throw WorldFailure{"there is no world number " + std::to_string(id)};
  return world;
}

/// Resets the world to the state after loading with its seed. It is loaded again if it can neither
/// be a row nor be reset.
void WorldPool::Impl::Reset(uint32_t id) {
  Slot& slot = slots[id];
  NoteForm();
  if (slot.scene()->has_rows()) {
    slot.form = Form::kStart;
    slot.subscriptions = slot.scene()->loaded();
    slot.failure.clear();
    return;
  }
  if (!Restart(id)) return Load(id);
  slot.form = Form::kWorld;
  slot.failure.clear();
}

/// False if a World object has clients, which expect callbacks.
bool WorldPool::Impl::CanRestoreRow(uint32_t id) {
  if (!slots[id].scene()->has_rows()) return false;
  const World* const world = slots[id].form == Form::kWorld ? slots[id].world.get() : nullptr;
  return !world || RowBridge::WhyNotClosed(*world).empty();
}

/// Reads a snapshot into a row of a variant, unless it fits only worlds or does not fit.
WorldPool::Impl::Fit WorldPool::Impl::ReadSnapshot(PoolVariant* variant, const Snapshot& from,
                                                   RowBridge::Readings readings, Thread* thread,
                                                   SnapshotRow* to, std::string* error) {
  World *const spare = thread->Spare(*variant, 0), *const compared = thread->Spare(*variant, 1);
  const messages::ErrorTrap errors;
  if (!spare->Restore(from)) {
    *error = errors.Last("the snapshot doesn't fit");
    return Fit::kDoesNotFit;
  }
  Subscriptions* const subscriptions = variant->scene->SubscriptionsOf(*spare);
  if (!variant->RowsOf(subscriptions)) return Fit::kFitsWorlds;
  auto read = std::make_unique<rows::Rows>(subscriptions->scene(), std::vector<uint64_t>());
  read->Resize(1);
  if (!RowBridge::Read(spare, read.get(), 0, compared, readings)) return Fit::kFitsWorlds;
  *to = {subscriptions, std::move(read)};
  return Fit::kFits;
}

void WorldPool::Impl::RestoreRow(uint32_t id, const SnapshotRow& from) {
  Slot& slot = slots[id];
  slot.rows = ToChange(slot.variant->RowsOf(from.subscriptions));
  slot.rows->Copy(slot.place, *from.rows, 0);
  slot.form = Form::kRow;
  slot.subscriptions = from.subscriptions;
  slot.failure.clear();
  NoteForm();
}

/// Restores a snapshot in rows of one variant, unless it fits only worlds or does not fit.
WorldPool::Impl::Fit WorldPool::Impl::RestoreRows(const Ids& ids, const Snapshot& from,
                                                  std::string* error) {
  SnapshotRow read;
  const Fit fit =
      ReadSnapshot(slots[ids[0]].variant, from, RowBridge::kHasAll, &of_threads[0], &read, error);
  if (fit == Fit::kFits) ForEach(ids, [&](uint32_t id, Thread*) { RestoreRow(id, read); });
  return fit;
}

/// Restores a snapshot in a World object. Throws WorldFailure.
void WorldPool::Impl::RestoreWorld(uint32_t id, const Snapshot& from) {
  Slot& slot = slots[id];
  NoteForm();
  if (!slot.world) MakeWorld(id);
  slot.form = Form::kWorld;
  slot.returns = false;
  World* const world = slot.world.get();
  const messages::ErrorTrap errors;
  if (!world || !world->Restore(from)) throw WorldFailure{errors.Last("the snapshot doesn't fit")};
  world->CancelQuit();
  slot.failure.clear();
}

/// Restores a snapshot in worlds of one variant.
void WorldPool::Impl::RestoreVariant(const Ids& ids, const Snapshot& from) {
  Ids as_rows, as_worlds;
  for (const uint32_t id : ids) (CanRestoreRow(id) ? as_rows : as_worlds).push_back(id);
  std::string error;
  const Fit fit = as_rows.empty() ? Fit::kFits : RestoreRows(as_rows, from, &error);
  if (fit == Fit::kFitsWorlds) as_worlds = ids;
  if (fit == Fit::kDoesNotFit) Fail(as_rows, error);
  ForEach(as_worlds, [&](uint32_t id, Thread*) { RestoreWorld(id, from); });
}

/// The number of steps from `step` on that a row may make without a call of the observer. Commands
/// that controllers may replace are given before each step.
uint64_t WorldPool::Impl::StepsAtOnce(StepObserver* observer, uint32_t id, uint64_t step,
                                      uint64_t end) {
  if (!slots[id].rows->scene().controls.groups.empty()) return 1;
  return std::clamp<uint64_t>(observer->StepsAtOnce(id, step), 1, end - step);
}

/// Makes steps first to end - 1, or fewer if the world ends.
StepObserver::Outcome WorldPool::Impl::StepWorld(uint32_t id, uint64_t first, uint64_t end,
                                                 StepObserver* observer, Thread* thread) {
  Slot& slot = slots[id];
  StepObserver* const each = observer && observer->TakesPartInSteps() ? observer : nullptr;
  for (uint64_t step = first; step < end; step++) {
    if (each) each->BeforeStep(id, step);
    if (BecomeRow(id)) {
      const uint64_t steps = each ? StepsAtOnce(each, id, step, end) : end - step;
      RowsToChange(slot)->Step(slot.place, steps, ScratchOf(slot, thread, *slot.rows));
      step += steps - 1;
    } else if (Require(id)->Update()) {
      if (!slot.world) throw WorldFailure{"a controller has deleted the world"};
      return StepObserver::kHasEnded;
    }
    if (each) each->AfterStep(id, step);
  }
  return StepObserver::kMadeAllSteps;
}

/// The number of steps of a round of about 50 ms, which a user who waits for Ctrl-C does not
/// notice. Shorter rounds would be slower, because each world starts a round with cold caches.
uint64_t WorldPool::Impl::StepsOfRound(double seconds_of_step, size_t worlds, uint64_t unit) const {
  constexpr double kSeconds = 0.05;
  if (seconds_of_step <= 0) return unit;
  const double units =
      kSeconds / (seconds_of_step * static_cast<double>(unit) * static_cast<double>(worlds));
  return unit * static_cast<uint64_t>(std::clamp(units, 1.0, 1e9));
}

/// Makes a round, and measures it. Worlds that have ended or failed take no time; if all have, the
/// time per step stays as it is.
void WorldPool::Impl::StepRound(const Ids& ids, uint64_t first, uint64_t end,
                                StepObserver* observer) {
  const double start = threads::WallClock();
  for (Thread& thread : of_threads) thread.steps = 0;
  ForEach(ids, [&](uint32_t id, Thread* thread) {
    const Slot& slot = slots[id];
    if (!slot.failure.empty() || (slot.form == Form::kWorld && !slot.world)) return;
    StepObserver::Outcome outcome = StepObserver::kHasFailed;
    try {
      TakeBackSometimes(id, thread);
      outcome = StepWorld(id, first, end, observer, thread);
    } catch (...) {
      if (observer) observer->AfterRound(id, first, end, outcome);
      throw;
    }
    if (observer) observer->AfterRound(id, first, end, outcome);
    if (outcome == StepObserver::kMadeAllSteps) thread->steps += end - first;
  });
  uint64_t steps = 0;
  for (const Thread& thread : of_threads) steps += thread.steps;
  if (steps > 0) step_seconds = (threads::WallClock() - start) / static_cast<double>(steps);
}

/// The worlds in the order of their variants, the scenes of which stay in caches then.
WorldPool::Ids WorldPool::Impl::ByVariant(const Ids& ids) const {
  if (variants.size() == 1) return ids;
  std::vector<Ids> of_variants(variants.size());
  for (const uint32_t id : ids) of_variants[slots[id].variant->number].push_back(id);
  Ids ordered;
  for (const Ids& some : of_variants) ordered.insert(ordered.end(), some.begin(), some.end());
  return ordered;
}

void WorldPool::Impl::StepOnHost(const Ids& ids, uint64_t steps, StepObserver* observer,
                                 uint64_t unit) {
  for (uint64_t done = 0; done < steps;) {
    const uint64_t end =
        done + std::min(StepsOfRound(step_seconds, ids.size(), unit), steps - done);
    StepRound(ids, done, end, observer);
    done = end;
    if (observer && done < steps) observer->BetweenRounds();
  }
}

namespace {

/// The device that makes whole steps; null if none is wanted, or after a message if there is none.
std::shared_ptr<rows::RowDevice> DeviceFor(const WorldPoolOptions& options) {
  if (!options.device_steps) return nullptr;
  std::string message;
  std::shared_ptr<rows::RowDevice> device = rows::OpenRowDevice(options.device_choice, 0, &message);
  if (!device)
    messages::Report(LogLevel::kError, "stage: worlds can't be stepped on a device: " + message);
  return device;
}

template <class Scenes>
Scenes ScenesOf(const std::vector<const World*>& prototypes, const WorldPoolOptions& options) {
  Scenes scenes;
  for (const World* prototype : prototypes)
    scenes.push_back(std::make_shared<PoolScene>(*prototype, options));
  return scenes;
}

}  // namespace

WorldPool::WorldPool(const World& prototype, const std::vector<uint64_t>& seeds,
                     const WorldPoolOptions& options)
    : WorldPool(std::vector<const World*>{&prototype}, seeds, std::vector<uint32_t>(), options) {}

WorldPool::WorldPool(const std::vector<const World*>& prototypes,
                     const std::vector<uint64_t>& seeds, const std::vector<uint32_t>& variants,
                     const WorldPoolOptions& options)
    : impl_(new Impl(ScenesOf<Impl::Scenes>(prototypes, options), seeds, variants,
                     options.threads > 0 ? options.threads : threads::CountUsableProcessors(),
                     DeviceFor(options))) {}

WorldPool::WorldPool(const WorldPool& other, const std::vector<uint64_t>& seeds)
    : impl_(new Impl(other.impl_->AllScenes(), seeds, other.impl_->AllVariants(), other.threads(),
                     DeviceFor(other.impl_->variants[0]->scene->pool_options()))) {}

WorldPool::~WorldPool() = default;

bool WorldPool::IsReady() const {
  return std::ranges::all_of(impl_->variants, [&](const auto& variant) {
    return variant->scene->IsReady() &&
           (impl_->device || !variant->scene->pool_options().device_steps);
  });
}

uint32_t WorldPool::size() const { return static_cast<uint32_t>(impl_->slots.size()); }

unsigned WorldPool::threads() const { return impl_->workers->threads(); }

WorldPool::Ids WorldPool::All() const {
  Ids all(size());
  std::iota(all.begin(), all.end(), 0u);
  return all;
}

void WorldPool::Resize(const std::vector<uint64_t>& seeds) { impl_->Resize(seeds, {}); }

uint32_t WorldPool::CountVariants() const { return static_cast<uint32_t>(impl_->variants.size()); }

uint32_t WorldPool::Variant(uint32_t id) const { return impl_->slots[id].variant->number; }

bool WorldPool::SetPrototype(uint32_t variant, const World& prototype) {
  return PoolAccess::SetPrototype(*this, variant, prototype, {});
}

bool PoolAccess::SetPrototype(WorldPool& pool, uint32_t variant, const World& prototype,
                              const std::vector<rows::VariedNumber>& varied) {
  WorldPool::Impl& impl = *pool.impl_;
  const bool is_used = std::ranges::any_of(impl.slots, [&](const WorldPool::Impl::Slot& slot) {
    return slot.variant->number == variant;
  });
  if (variant > pool.CountVariants() || is_used) {
    messages::Report(LogLevel::kError,
                     "stage: found the variant number " + std::to_string(variant) +
                         (is_used ? ", which worlds are of" : ", which does not exist") +
                         ", expected one without worlds, or the next number");
    return false;
  }
  auto scene =
      std::make_shared<PoolScene>(prototype, impl.variants[0]->scene->pool_options(), varied);
  if (!scene->IsReady()) return false;
  impl.SetScene(variant, std::move(scene));
  return true;
}

const std::vector<uint64_t>& WorldPool::seeds() const { return impl_->seeds; }

const std::string& WorldPool::Failure(uint32_t id) const { return impl_->slots[id].failure; }

void WorldPool::SetFailure(uint32_t id, const std::string& why) { impl_->Fail({id}, why); }

uint64_t WorldPool::times_made(uint32_t id) const { return impl_->slots[id].times_made; }

World* WorldPool::At(uint32_t id) {
  if (id >= size()) return nullptr;
  if (impl_->slots[id].form != Impl::Form::kWorld) impl_->TryToMake(id);
  impl_->slots[id].returns = false;
  return impl_->slots[id].world.get();
}

World* WorldPool::AtOrMake(uint32_t id) {
  World* const world = At(id);
  if (id >= size() || (world && world->GetWorldFile())) return world;
  impl_->TryToMake(id);
  return impl_->slots[id].world.get();
}

void WorldPool::Make(const Ids& ids) {
  impl_->ForEach(ids, [this](uint32_t id, Impl::Thread*) {
    if (!PoolAccess::SceneOf(*this, id)) AtOrMake(id);
  });
}

void WorldPool::Release(const Ids& ids) {
  impl_->ForEach(ids, [this](uint32_t id, Impl::Thread* thread) {
    impl_->TakeBack(id, thread);
    impl_->slots[id].returns = true;
  });
}

bool WorldPool::Look(uint32_t id, const std::function<void(World& world)>& look) {
  if (id >= size()) return false;
  try {
    impl_->WithWorld(id, impl_->CurrentThread(), look);
    return true;
  } catch (const WorldFailure& failure) {
    SetFailure(id, failure.why);
    return false;
  }
}

void WorldPool::Subscribe(uint32_t id, uint32_t model) {
  impl_->Subscribe(id, std::span(&model, 1));
}

std::string WorldPool::WhyNotClosed(uint32_t id) const { return impl_->WhyNotClosed(id); }

std::string WorldPool::StepDevice() const { return impl_->device ? impl_->device->Name() : ""; }

void WorldPool::Step(const Ids& ids, uint64_t steps, StepObserver* observer, uint64_t unit) {
  STAGE_ASSERT(unit > 0);
  impl_->FreeUnusedRows();
  if (!impl_->device || (observer && observer->TakesPartInSteps()))
    return impl_->StepOnHost(impl_->ByVariant(ids), steps, observer, unit);
  const Ids others = impl_->StepOnDevice(ids, steps, observer, unit);
  if (!others.empty()) impl_->StepOnHost(others, steps, observer, unit);
}

void WorldPool::Reset(const Ids& ids, const std::vector<uint64_t>& seeds) {
  STAGE_ASSERT(ids.size() == seeds.size());
  for (size_t i = 0; i < ids.size(); i++) impl_->seeds[ids[i]] = seeds[i];
  impl_->ForEach(ids, [this](uint32_t id, Impl::Thread*) { impl_->Reset(id); });
}

void WorldPool::Reset(const Ids& ids, const std::vector<uint64_t>& seeds,
                      const std::vector<uint32_t>& variants) {
  impl_->SetVariants(ids, variants);
  Reset(ids, seeds);
}

void WorldPool::Restore(const Ids& ids, const Snapshot& from) {
  std::vector<Ids> of_variants(CountVariants());
  for (const uint32_t id : ids) of_variants[Variant(id)].push_back(id);
  for (const Ids& of_variant : of_variants)
    if (!of_variant.empty()) impl_->RestoreVariant(of_variant, from);
}

bool WorldPool::Take(uint32_t id, Snapshot* to, Snapshot::Keep keep) {
  bool taken = false;
  if (Look(id, [&](const World& world) { taken = world.Take(to, keep); })) return taken;
  messages::Report(LogLevel::kError, "stage: a snapshot can't be taken: there is no world number " +
                                         std::to_string(id));
  return false;
}

std::vector<uint64_t> WorldPool::StateHashes(const Ids& ids) {
  std::vector<uint64_t> hashes(size(), 0);
  impl_->ForEach(impl_->ByVariant(ids), [&](uint32_t id, Impl::Thread* thread) {
    if (impl_->slots[id].form == Impl::Form::kWorld && !impl_->slots[id].world) return;
    impl_->WithWorld(id, thread, [&](const World& world) { hashes[id] = world.StateHash(); });
  });
  std::vector<uint64_t> of_ids;
  for (const uint32_t id : ids) of_ids.push_back(hashes[id]);
  return of_ids;
}

void WorldPool::ForEach(const Ids& ids, const std::function<void(uint32_t id)>& call) {
  impl_->ForEach(ids, [&](uint32_t id, Impl::Thread*) { call(id); });
}

void WorldPool::Run(size_t count, const std::function<void(size_t, unsigned)>& job) {
  impl_->workers->Run(count, 1, [&](size_t begin, size_t end, unsigned thread) {
    const Impl::OnThread on_thread(&impl_->of_threads[thread]);
    for (size_t i = begin; i < end; i++) job(i, thread);
  });
}

}  // namespace Stg
