// SPDX-License-Identifier: GPL-2.0-or-later

#include "stage/run.hh"

#include <cstdlib>
#include <utility>

#include "messages/report.hh"
#include "stage/console.hh"
#include "stage/interrupt.hh"
#include "stage/progress.hh"
#include "stage/snapshots.hh"
#include "stage/window.hh"

namespace Stg::program {

namespace {

bool IsDone(World* world) { return world->PastQuitTime() || world->TestQuit(); }

/// Exits if a controller has deleted its world.
void EndIfDeleted(const LoadedWorld& loaded) {
  if (loaded.handle) return;
  messages::Report(LogLevel::kError, "stage: a callback deleted the world of " + loaded.file);
  std::exit(1);
}

/// Sleeps until the next step is due. Returns false if a signal came.
bool WaitForStep(const World& world, StepPacer* pacer) {
  const double now = WallClock(), period = StepPacer::Period(world.sim_interval, world.speedup);
  if (!(period > 0)) return true;
  if (pacer->has_begun())
    pacer->Stepped(now, period);
  else
    pacer->Restart(now, period);
  return SleepUntil(now + pacer->UntilNext(now, period));
}

/// Makes one step when it is due. Returns true if the world is done.
bool Step(LoadedWorld* loaded) {
  if (!IsDone(loaded->world) && !WaitForStep(*loaded->world, &loaded->pacer)) return false;
  const double start = WallClock();
  const bool done = loaded->world->Update();
  loaded->wall_seconds += WallClock() - start;
  EndIfDeleted(*loaded);
  return done;
}

/// Makes one step in each world. Returns true if all are done; returns early on a signal.
bool Round(std::vector<LoadedWorld>* worlds) {
  bool all_done = true;
  for (LoadedWorld& loaded : *worlds) {
    if (CaughtSignal() != 0) return false;
    all_done &= Step(&loaded);
  }
  return all_done;
}

}  // namespace

int LoadWorlds(const Options& options, std::vector<LoadedWorld>* worlds, World* with_window) {
  for (const std::string& file : options.worldfiles) {
    // Never deleted: controllers may use models until the process ends, and ending it is the
    // fastest way to free a million models.
    World* world = with_window ? std::exchange(with_window, nullptr) : new World;
    worlds->push_back({world, WorldHandle(world), file, 0, {}});
    const bool loaded = world->Load(file);
    EndLine();
    if (!loaded) return World::Exists(world) && world->LoadStatus() != 0 ? world->LoadStatus() : 1;
  }
  return 0;
}

void RunWorlds(const Options& options, std::vector<LoadedWorld>* worlds, PictureRun* pictures,
               SnapshotSaver* saver) {
  if (!pictures && !worlds->empty() && worlds->front().world->IsGUI()) {
    LoadedWorld& only = worlds->front();
    const double start = WallClock();
    RunWindow(only.world);
    EndIfDeleted(only);
    only.wall_seconds = WallClock() - start;
    return;
  }
  if (pictures) pictures->Begin(options);
  Progress progress(options.progress, *worlds);
  const bool ends_with_snapshot = saver && options.run.duration == 0;
  const auto goes_on = [&] {
    if (saver) saver->SaveIfDue(worlds->front().world);
    return !(ends_with_snapshot && saver->IsDone());
  };
  while (CaughtSignal() == 0 && goes_on() && !Round(worlds)) {
    if (pictures) pictures->Make();
    progress.Tick();
  }
  if (pictures) pictures->End(CaughtSignal() != 0);
}

}  // namespace Stg::program
