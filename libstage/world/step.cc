// SPDX-License-Identifier: GPL-2.0-or-later
//
// Steps of a world. Order of the phases in a step:
//   messages   radios receive what was sent to them
//   gather     due models update: positions choose their velocities, sensors fill the batch
//   trace      the batch is traced against the bodies as the last step left them
//   finish     sensors act on what they sensed: grippers grip
//   move       positions and actuators move, in the order of creation
//   callbacks  those of the updated models, in the order of update; then batch controllers; then
//              those of the world
//   energy     running models draw from their power packs, chargers give energy
//   fields     ground sensors add to fields, whose values spread and evaporate

#include <algorithm>
#include <cinttypes>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <utility>

#include "messages/assert.hh"
#include "messages/report.hh"
#include "models/exception_origin.hh"
#include "models/position.hh"
#include "models/ranger.hh"
#include "world/around_step.hh"
#include "world/engine.hh"
#include "world/phases/field_phase.hh"
#include "world/world.hh"
#include "world/world_handle.hh"

namespace Stg {

namespace {

/// Makes the calls before a step; see AroundStep.
void CallBeforeStep(const WorldEngine& engine, World* world) {
  for (const auto& call : engine.calls_after_step)
    if (const auto* const around = call.target<AroundStep>()) around->before(*world);
}

}  // namespace

bool World::UpdateAll() {
  bool all_done = true;
  std::vector<WorldHandle> handles;
  for (World* world : ListedWorlds()) handles.emplace_back(world);
  for (const WorldHandle& handle : handles)  // a callback of another world may have deleted it
    if (World* const world = handle.get()) all_done &= world->Update();
  return all_done;
}

void World::Run() {
  const std::vector<World*> worlds = ListedWorlds();
  for (World* world : worlds) {
    if (!world->IsGUI()) continue;
    if (worlds.size() > 1) {
      messages::Report(LogLevel::kError,
                       "stage: with a window, only a single world can be simulated");
      std::exit(255);
    }
    return world->RunEventLoop();
  }
  while (!UpdateAll()) {
  }
}

bool World::Update(void) {
  if (PastQuitTime() || TestQuit()) return true;
  // A callback may delete the world; the engine outlives it here.
  const std::shared_ptr<WorldEngine> engine = engine_;
  if (!engine->calls_after_step.empty() && engine->IsIdle()) CallBeforeStep(*engine, this);
  if (MakeStep(engine)) return true;
  if (!engine->world_deleted && !engine->calls_after_step.empty() && engine->IsIdle())
    CallAfterThisStep();
  return false;
}

void World::CallAfterStep(const std::function<void(World&)>& call) {
  engine_->calls_after_step.push_back(call);
}

void World::CallAfterThisStep() {
  const RandomScope random_numbers(&random_);
  for (const auto& call : std::exchange(engine_->calls_after_step, {})) call(*this);
}

/// Does one step. Returns the result of Update().
bool World::MakeStep(const std::shared_ptr<WorldEngine>& engine) {
  if (engine->stepping || engine->loading) return false;
  engine->RunDeferredDeletes();
  const ScopedValue stepping(&engine->stepping, true);
  engine->CheckFork();
  if (engine->command_without_subscriber.exchange(false)) engine->WarnAboutUnsubscribed();
  if (show_clock && updates % std::max(1u, show_clock_interval) == 0) PrintClock();
  const uint64_t epoch = engine->epoch;
  ClearExceptionOrigin();
  try {
    Step(*engine, epoch);
    engine->EndStep();
  } catch (...) {  // thrown by a callback, or out of memory
    engine->AbandonStep(engine->epoch == epoch ? sim_time : 0);
    throw;
  }
  if (engine->epoch != epoch) return engine->world_deleted;
  engine->statistics.steps++;
  updates++;
  if (record_trails) UpdateTrails();
  return false;
}

/// Reports a fault of the world after a phase of a step, if the user asked for that.
void World::ValidateAfter([[maybe_unused]] const char* phase) const {
#if defined(STAGE_ASSERTIONS) && STAGE_ASSERTIONS
  if (!engine_->validates) return;
  const std::string fault = Validate();
  if (!fault.empty())
    internal::FailAssertion(__FILE__, __LINE__,
                            (std::string("after the phase ") + phase + ": " + fault).c_str());
#endif
}

/// Runs the phases of a step. Returns early if a callback unloads or deletes the world.
void World::Step(WorldEngine& engine, uint64_t epoch) {
  const RandomScope random_numbers(&random_);
  sim_time += sim_interval;
  STAGE_ASSERT(engine.stepping && !engine.loading && engine.epoch == epoch);
  STAGE_ASSERT(engine.due.empty() && engine.sensed.empty());
  engine.steps_begun++;
  engine.contacts_known = false;
  PhaseSeconds& seconds = engine.statistics.seconds;
  const double start = WallClock();
  const double traced_before = engine.tracer.seconds();
  if (!engine.traffic->radios().empty()) engine.DeliverMessages(sim_time);
  engine.gather.Run(this, &engine);
  if (engine.epoch == epoch) ValidateAfter("gather");
  engine.TraceBatch();
  if (engine.epoch == epoch) FinishSensing();
  if (engine.epoch != epoch) return;
  ValidateAfter("sense");
  const double sensed = WallClock();
  engine.move.Run(&engine, static_cast<double>(sim_interval) / 1e6);
  for (ModelRanger* ranger : engine.sweeping_rangers) ranger->NoteMotion();
  if (engine.epoch == epoch) ValidateAfter("move");
  engine.CallContactCallbacks(epoch);
  if (engine.epoch != epoch) return;
  const double moved = WallClock();
  engine.callbacks.Run(&engine);
  if (engine.epoch == epoch) engine.batch_controls.Run(&engine, sim_time);
  if (engine.epoch == epoch) CallUpdateCallbacks();
  if (engine.epoch != epoch) return;
  ValidateAfter("callbacks");
  const double called = WallClock();
  UpdateEnergy();
  ValidateAfter("energy");
  const double supplied = WallClock();
  if (!engine.fields.empty()) FieldPhase::Run(&engine, sim_time, sim_interval);
  const double in_fields = WallClock() - supplied;
  ValidateAfter("fields");
  engine.metrics.Step(*this);

  const double traced = engine.tracer.seconds() - traced_before;
  engine.parallel_choice.Report(called - start - traced);
  engine.ReportStep(called - start);
  seconds.gather += sensed - start - traced;
  seconds.move += moved - sensed;
  seconds.callbacks += called - moved;
  seconds.energy += WallClock() - called - in_fields;
  seconds.fields += in_fields;
}

void World::FinishSensing() {
  std::vector<Model*>& sensed = engine_->sensed;
  // By index: Sensed() may delete models, which sets their entries to null.
  for (size_t i = 0; i < sensed.size(); i++) {
    try {
      if (sensed[i]) sensed[i]->Sensed();
    } catch (...) {
      RecordUpdateException(sensed[i]);
      throw;
    }
  }
  sensed.clear();
}

void World::UpdateEnergy() {
  STAGE_ASSERT(std::ranges::is_sorted(engine_->energy, {}, &Model::GetId));
  for (Model* model : engine_->energy) model->UpdateCharge();
}

void World::UpdateTrails() {
  for (Model* model : engine_->moving)
    if (updates % model->trail_interval == 0 && dynamic_cast<ModelPosition*>(model))
      model->UpdateTrail();
}

void World::CallUpdateCallbacks() {
  // Callbacks added meanwhile run from the next step on; removed ones are only set to null.
  std::vector<WorldEngine::UpdateCallback>& all = engine_->update_callbacks;
  const size_t count = all.size();
  for (size_t i = 0; i < count; i++) {
    const WorldEngine::UpdateCallback entry = all[i];
    if (!entry.function) continue;
    try {
      if (entry.function(this, entry.user) != 0) all[i].function = nullptr;
    } catch (...) {
      RecordExceptionOrigin("a callback of the world", nullptr,
                            reinterpret_cast<void (*)()>(entry.function));
      throw;
    }
  }
  std::erase_if(all, [](const WorldEngine::UpdateCallback& c) { return !c.function; });
}

void World::AddUpdateCallback(world_callback_t cb, void* user) {
  engine_->update_callbacks.push_back({cb, user});
}

int World::RemoveUpdateCallback(world_callback_t cb, void* user) {
  int left = 0;
  bool removed = false;
  for (WorldEngine::UpdateCallback& entry : engine_->update_callbacks) {
    if (!entry.function) continue;
    if (!removed && entry.function == cb && entry.user == user) {
      entry.function = nullptr;  // not erased: a loop may be running over the list
      removed = true;
    } else {
      left++;
    }
  }
  return left;
}

void World::Enqueue(unsigned int, usec_t delay, Model* mod, model_callback_t cb, void* arg) {
  // If the sum overflowed, the callback would be due at once.
  constexpr usec_t kNever = std::numeric_limits<usec_t>::max();
  engine_->scheduler.Add(delay > kNever - sim_time ? kNever : sim_time + delay,
                         {mod, cb, arg, mod ? UpdateGeneration::First(mod->GetId()) : 0});
}

void World::ShowTime(usec_t time) {
  engine_->scheduler.Clear();
  sim_time = time;
}

std::string World::ClockString(void) const {
  const uint64_t milliseconds = sim_time / 1000;
  const uint64_t hours = milliseconds / 3600000;
  char text[128];
  int length = 0;
  if (hours > 0) length = std::snprintf(text, sizeof text, "%" PRIu64 "h", hours);
  std::snprintf(text + length, sizeof text - static_cast<size_t>(length),
                " %" PRIu64 "m %02" PRIu64 "s %03" PRIu64 "msec", milliseconds / 60000 % 60,
                milliseconds / 1000 % 60, milliseconds % 1000);
  return text;
}

void World::PrintClock() { messages::Progress("[Stage: " + ClockString() + "]"); }

}  // namespace Stg
