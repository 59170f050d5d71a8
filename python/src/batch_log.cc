// SPDX-License-Identifier: GPL-2.0-or-later
//
// Logs of worlds of a batch. A closed world has no lasting objects, so its recorder looks at a
// World object in the state before and after each step.

#include <algorithm>
#include <utility>

#include "batch.hh"
#include "gil.hh"
#include "run_log.hh"
#include "signals.hh"
#include "world/world.hh"
#include "worlds/pool_access.hh"

namespace Stg::python {

Source& BatchLog::source() const { return *batch_; }

void BatchLog::Complete() {
  if (std::exchange(finished_, true)) return;
  file_.Release();
  Failing([&] { recorder_.Finish(); });
}

std::shared_ptr<BatchLog> Batch::StartLog(uint32_t index, const recording::LogOptions& options) {
  const Use use(this);
  return Failing([&] {
    auto log = std::make_shared<BatchLog>(shared_from_this(), index, options);
    Look(index, [&](World& world) { log->Begin(&world); });
    logs_.push_back(log);
    return log;
  });
}

/// The unfinished logs of these worlds.
Batch::Logs Batch::LogsOf(const Indices& which) {
  std::erase_if(logs_, [](const std::weak_ptr<BatchLog>& log) {
    const std::shared_ptr<BatchLog> known = log.lock();
    return !known || known->finished();
  });
  Logs logs;
  for (const std::weak_ptr<BatchLog>& log : logs_) {
    const std::shared_ptr<BatchLog> known = log.lock();
    if (std::ranges::find(which, known->world()) != which.end() &&
        pool_->Failure(known->world()).empty())
      logs.push_back(known);
  }
  return logs;
}

/// Gives the commands of the present step to the worlds of logs, which must not have ended.
void Batch::GiveCommands(const Logs& logs) {
  Indices worlds;
  for (const std::shared_ptr<BatchLog>& log : logs) {
    bool has_ended = false;
    Look(log->world(), [&](World& world) { has_ended = world.TestQuit(); });
    const bool is_known = std::ranges::find(worlds, log->world()) != worlds.end();
    if (!has_ended && !is_known) worlds.push_back(log->world());
  }
  std::ranges::sort(worlds);
  if (worlds.empty()) return;
  if (device_crowd_) return device_crowd_->Command(worlds);
  pool_->ForEach(worlds, [&](uint32_t id) { crowd_->Command(*this, id); });
}

void Batch::StepLogged(const Indices& which, uint64_t steps) {
  SignalChecks signals;
  for (uint64_t step = 0; step < steps; step++) {
    const Logs logs = LogsOf(which);
    if (logs.empty()) return StepWorlds(which, steps - step);
    GiveCommands(logs);
    for (const std::shared_ptr<BatchLog>& log : logs)
      Look(log->world(), [&](World& world) { log->BeforeStep(&world); });
    StepWorlds(which, 1);
    for (const std::shared_ptr<BatchLog>& log : LogsOf(which))
      Failing([&] { Look(log->world(), [&](World& world) { log->AfterStep(&world); }); });
    signals.Poll();
  }
}

}  // namespace Stg::python
