// SPDX-License-Identifier: GPL-2.0-or-later
//
// The steps of a world. The order of events in one step:
//   gather     due models update: positions choose their velocities, sensors fill the batch
//   trace      the batch is traced against the bodies as the last step left them
//   finish     what sensors do with what they sensed: grippers grip
//   move       positions and actuators move, in the order of creation
//   callbacks  of the models that updated, in that order; then those of the world
//   energy     running models draw from their power packs, chargers give

#include <algorithm>
#include <cinttypes>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <limits>

#include "messages/report.hh"
#include "models/position.hh"
#include "models/thrown.hh"
#include "world/engine.hh"
#include "world/world.hh"

namespace Stg {

bool World::UpdateAll() {
  bool all_done = true;
  for (World* world : std::vector<World*>(worlds_)) {
    // A callback of one world may delete another.
    const bool alive = std::find(worlds_.begin(), worlds_.end(), world) != worlds_.end();
    if (alive) all_done &= world->Update();
  }
  return all_done;
}

void World::Run() {
  for (World* world : worlds_) {
    if (!world->IsGUI()) continue;
    if (worlds_.size() > 1) {
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
  if (show_clock && updates % std::max(1u, show_clock_interval) == 0) PrintClock();
  ForgetThrower();
  try {
    Step();
  } catch (...) {  // a callback's, or there is too little memory
    engine_->AbandonStep(sim_time);
    throw;
  }
  updates++;
  if (record_trails) UpdateTrails();
  return false;
}

void World::Step() {
  const RandomScope random_numbers(&random_);
  sim_time += sim_interval;
  PhaseSeconds& seconds = engine_->statistics.seconds;
  const double start = WallClock();
  const double traced_before = seconds.prefilter + seconds.trace;
  RunDueEvents();
  FinishRays();
  FinishSensing();
  const double sensed = WallClock();
  MoveModels();
  const double moved = WallClock();
  CallModelCallbacks();
  CallUpdateCallbacks();
  const double called = WallClock();
  UpdateEnergy();

  seconds.gather += sensed - start - (seconds.prefilter + seconds.trace - traced_before);
  seconds.move += moved - sensed;
  seconds.callbacks += called - moved;
  seconds.energy += WallClock() - called;
  engine_->EndStep();
  engine_->statistics.steps++;
}

void World::RunDueEvents() {
  engine_->scheduler.Take(sim_time, &engine_->due);
  // By index: an update may delete models, which strikes out their events.
  for (size_t i = 0; i < engine_->due.size();) {
    const size_t updated = run_options.batch ? engine_->UpdateTogether(i, this) : 0;
    if (updated == 0) RunDueEvent(i);
    i += std::max<size_t>(updated, 1);
  }
  engine_->due.clear();
}

void World::RunDueEvent(size_t index) {
  const Scheduler::Event event = engine_->due[index];
  if (event.callback) {
    engine_->due[index] = Scheduler::Event();  // it is called once, even if it throws
    const RandomScope random_numbers(event.model ? &event.model->random_ : &random_);
    try {
      event.callback(event.model, event.arg);
    } catch (...) {
      NoteThrower("an enqueued callback", nullptr, reinterpret_cast<void (*)()>(event.callback));
      throw;
    }
  } else if (event.model && event.model->ExpectsUpdate(event.chain)) {
    event.model->Update();
  }
  if (!run_options.batch) FinishRays();
}

void World::FinishRays() { engine_->TraceBatch(); }

void World::FinishSensing() {
  // By index: it may delete models, which strikes them out.
  for (size_t i = 0; i < engine_->sensed.size(); i++)
    if (engine_->sensed[i]) engine_->sensed[i]->Sensed();
  engine_->sensed.clear();
}

void World::MoveModels() {
  // By index: a callback of a model may change the list.
  for (size_t i = 0; i < engine_->moving.size();) {
    const size_t moved = engine_->MoveTogether(i);
    if (moved == 0) engine_->moving[i]->Move();
    i += std::max<size_t>(moved, 1);
  }
}

void World::UpdateEnergy() {
  for (Model* model : engine_->energy) model->UpdateCharge();
}

void World::UpdateTrails() {
  for (Model* model : engine_->moving)
    if (updates % model->trail_interval == 0 && dynamic_cast<ModelPosition*>(model))
      model->UpdateTrail();
}

void World::CallModelCallbacks() {
  std::vector<Model*>& due = engine_->update_callbacks_due;
  // By index: a callback may delete models, which strikes them out, and update others.
  for (size_t i = 0; i < due.size();) {
    const size_t called = engine_->CallTogether(i);
    if (called == 0 && due[i]) due[i]->CallCallbacks(Model::CB_UPDATE);
    i += std::max<size_t>(called, 1);
  }
  due.clear();
}

void World::CallUpdateCallbacks() {
  // Those added meanwhile are called from the next step on; those removed are only struck out.
  const size_t count = update_callbacks_.size();
  for (size_t i = 0; i < count; i++) {
    const UpdateCallback entry = update_callbacks_[i];
    if (!entry.function) continue;
    try {
      if (entry.function(this, entry.user) != 0) update_callbacks_[i].function = nullptr;
    } catch (...) {
      NoteThrower("a callback of the world", nullptr, reinterpret_cast<void (*)()>(entry.function));
      throw;
    }
  }
  std::erase_if(update_callbacks_, [](const UpdateCallback& c) { return !c.function; });
}

void World::AddUpdateCallback(world_callback_t cb, void* user) {
  update_callbacks_.push_back({cb, user});
}

int World::RemoveUpdateCallback(world_callback_t cb, void* user) {
  int left = 0;
  bool removed = false;
  for (UpdateCallback& entry : update_callbacks_) {
    if (!entry.function) continue;
    if (!removed && entry.function == cb && entry.user == user) {
      entry.function = nullptr;  // struck out: somebody may be walking along the list
      removed = true;
    } else {
      left++;
    }
  }
  return left;
}

void World::Enqueue(unsigned int, usec_t delay, Model* mod, model_callback_t cb, void* arg) {
  // A sum beyond the end of the clock would wrap and be due at once.
  constexpr usec_t kNever = std::numeric_limits<usec_t>::max();
  engine_->scheduler.Add(delay > kNever - sim_time ? kNever : sim_time + delay,
                         {mod, cb, arg, mod ? Scheduler::FirstChain(mod->GetId()) : 0});
}

void World::ScheduleUpdate(Model* mod, usec_t delay, uint64_t chain) {
  engine_->scheduler.Add(sim_time + delay, {mod, nullptr, nullptr, chain});
}

void World::QueueSensed(Model* mod) { engine_->sensed.push_back(mod); }

void World::QueueUpdateCallbacks(Model* mod) { engine_->update_callbacks_due.push_back(mod); }

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

void World::PrintClock() {
  std::printf("\r[Stage: %s]", ClockString().c_str());
  std::fflush(stdout);
}

}  // namespace Stg
