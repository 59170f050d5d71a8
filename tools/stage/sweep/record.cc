// SPDX-License-Identifier: GPL-2.0-or-later

#include "stage/sweep/record.hh"

#include <sys/wait.h>

#include <algorithm>
#include <cinttypes>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "messages/report.hh"
#include "stage/sweep/json_text.hh"
#include "stage/world_statistics.hh"
#include "world/statistics.hh"

namespace Stg::program {

namespace {

using Json = nlohmann::ordered_json;

Json Begin(const RunSpec& spec, const char* status) {
  Json set = Json::object();
  for (const auto& [name, value] : spec.set) set[name] = value;
  return {{"index", spec.index},
          {"set", set},
          {"run", spec.run},
          {"seed", spec.seed},
          {"status", status}};
}

std::string Line(Json* record, const Plan& plan, const RunSpec& spec, int attempts) {
  (*record)["attempts"] = attempts;
  (*record)["replay"] = ReplayCommand(plan, spec);
  return ToJsonText(*record, -1) + "\n";
}

std::string Text(const Json& record, const char* name) {
  const auto found = record.find(name);
  return found == record.end() ? "nothing" : messages::Shortened(ToJsonText(*found, -1));
}

/// Checks an object of numbers by name, such as the metrics. A null stands for a missing value.
void CheckNumbers(const Json& record, const char* name) {
  const auto found = record.find(name);
  if (found == record.end()) return;
  const bool good = found->is_object() && std::ranges::all_of(*found, [](const Json& value) {
                      return value.is_number() || value.is_null();
                    });
  if (!good)
    throw std::runtime_error(std::string("found other ") + name +
                             " than numbers, expected numbers");
}

std::string SignalName(int signal) {
#ifdef __GLIBC__
  if (const char* const name = sigabbrev_np(signal)) return std::string("SIG") + name;
#endif
  return "signal " + std::to_string(signal);
}

}  // namespace

std::string RecordOf(const Plan& plan, const RunSpec& spec, World* world, double wall_seconds,
                     int attempt, const OwnMetrics& own) {
  const RunStatistics& run = world->statistics();
  const EnergyTotals& energy = world->energy_totals();
  const double simulated = static_cast<double>(world->SimTimeNow()) / 1e6;
  const size_t robots = CountModels(*world).robots;
  char hash[20];
  std::snprintf(hash, sizeof hash, "%016" PRIx64, world->StateHash());

  Json record = Begin(spec, "done");
  record["state_hash"] = hash;
  record["steps"] = run.steps;
  record["simulated_seconds"] = simulated;
  record["rays"] = run.trace.rays;
  record["robots"] = robots;
  record["energy"] = {
      {"stored", energy.stored}, {"dissipated", energy.dissipated}, {"input", energy.input}};
  record["metrics"] = MetricsOf(*world);
  for (const auto& [name, value] : own) record["metrics"][name] = value ? Json(*value) : Json();
  const double r_acc =
      wall_seconds > 0 ? static_cast<double>(robots) * simulated / wall_seconds : 0;
  record["timing"] = {
      {"load_seconds", run.load_seconds}, {"wall_seconds", wall_seconds}, {"r_acc", r_acc}};
  return Line(&record, plan, spec, attempt);
}

std::string FailureRecordOf(const Plan& plan, const RunSpec& spec, const WorkerExit& worker_exit,
                            int attempts) {
  Json record = Begin(spec, "failed");
  record["reason"] = Describe(worker_exit);
  if (WIFSIGNALED(worker_exit.wait_status))
    record["signal"] = SignalName(WTERMSIG(worker_exit.wait_status));
  else
    record["exit_status"] = WEXITSTATUS(worker_exit.wait_status);
  record["lines"] = worker_exit.lines;
  return Line(&record, plan, spec, attempts);
}

void CheckRecord(const Json& record, const Plan& plan, uint64_t index) {
  if (!record.is_object()) throw std::runtime_error("found no record of a run");
  const RunSpec spec = RunAt(plan, index);
  const Json expected = Begin(spec, "");
  for (const char* name : {"index", "set", "run", "seed"})
    if (!record.contains(name) || record.at(name) != expected.at(name))
      throw std::runtime_error(std::string("found the ") + name + " " + Text(record, name) +
                               " where the plan has " + Text(expected, name));
  const bool done = Text(record, "status") == "\"done\"",
             failed = Text(record, "status") == "\"failed\"";
  if (!done && !failed)
    throw std::runtime_error("found the status " + Text(record, "status") +
                             ", expected \"done\" or \"failed\"");
  for (const char* name : {"energy", "metrics", "timing"}) CheckNumbers(record, name);
  for (const char* name : {"steps", "simulated_seconds", "rays"})
    if (done && (!record.contains(name) || !record.at(name).is_number()))
      throw std::runtime_error(std::string("found no number as ") + name);
  if (done && (!record.contains("state_hash") || !record.at("state_hash").is_string()))
    throw std::runtime_error("found no state_hash");
  if (failed && !record.value("lines", Json()).is_array())
    throw std::runtime_error("found no lines of a failed run");
}

std::string Describe(const WorkerExit& worker_exit) {
  if (!worker_exit.reason.empty()) return worker_exit.reason;
  if (WIFSIGNALED(worker_exit.wait_status)) return SignalName(WTERMSIG(worker_exit.wait_status));
  return "exit status " + std::to_string(WEXITSTATUS(worker_exit.wait_status));
}

}  // namespace Stg::program
