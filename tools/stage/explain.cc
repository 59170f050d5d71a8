// SPDX-License-Identifier: GPL-2.0-or-later

#include "stage/explain.hh"

#include <cmath>
#include <cstdio>
#include <optional>

#include "messages/report.hh"
#include "stage/process.hh"
#include "stage/report.hh"
#include "stage/run.hh"
#include "worlds/why_not_closed.hh"

namespace Stg::program {

namespace {

/// Warns of options that only affect a run.
void WarnOfIdleOptions(const Options& options) {
  std::string names;
  const auto add = [&names](bool given, const char* name) {
    if (given) names += (names.empty() ? "" : ", ") + std::string(name);
  };
  add(options.run.clock, "--clock");
  add(options.state_hash, "--state-hash");
  add(options.progress.value_or(false), "--progress");
  if (!names.empty())
    messages::Report(LogLevel::kWarning, "stage: --explain takes no step: ignored " + names);
}

double StepsLeft(const World& world) {
  return std::ceil(static_cast<double>(world.GetQuitTime()) /
                   static_cast<double>(world.sim_interval));
}

/// Loads the worlds one by one. Returns 0, or the exit status of the first failure.
int LoadAll(const Options& options, std::vector<Explanation>* explanations) {
  // Never deleted, as in a run.
  static std::vector<LoadedWorld>& worlds = *new std::vector<LoadedWorld>;
  for (const std::string& file : options.worldfiles) {
    Explanation e;
    e.file = file;
    e.memory.before = MemoryMb();
    Options one = options;
    one.worldfiles = {file};
    if (const int status = LoadWorlds(one, &worlds); status != 0) return status;
    e.world = worlds.back().world;
    e.memory.after = MemoryMb();
    e.memory.peak = PeakMemoryMb();
    explanations->push_back(e);
  }
  return 0;
}

void Complete(const RunOptions& options, Explanation* e) {
  e->steps = StepsLeft(*e->world);
  e->scene = Summarize(*e->world);
  if (e->scene.exact_sensors > 0) {  // done here as in the first step
    e->world->RasterizeForExactRays();
    e->scene = Summarize(*e->world);
    e->memory.after = MemoryMb();
  }
  e->costs = MeasureStepCosts(*e->world);
  e->estimate = MakeEstimate(e->scene, e->costs, e->memory, options);
  e->why_not_closed = WhyNotClosed(*e->world);
}

}  // namespace

int Explain(const Options& options) {
  const std::optional<ReportFile> report = OpenReport(options);
  WarnOfIdleOptions(options);

  std::vector<Explanation> worlds;
  {
    // Messages of loading and of controllers are not part of the explanation.
    const OutputToError redirected;
    if (const int status = LoadAll(options, &worlds); status != 0) return status;
    for (Explanation& world : worlds) Complete(options.run, &world);
  }
  const std::string json = ExplanationJson(worlds, options.run);
  std::string text;
  for (const Explanation& world : worlds) text += ExplanationText(world);
  if (!options.explain_as_json)
    PrintUnlessReport(report, text);
  else if (!report || !report->IsStandardOutput())
    PrintWhole(json);
  if (report) report->Write(json);
  return 0;
}

}  // namespace Stg::program
