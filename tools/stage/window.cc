// SPDX-License-Identifier: GPL-2.0-or-later

#include "stage/window.hh"

#include <cstdio>
#include <cstdlib>

#include "gui/window/factory.hh"
#include "messages/report.hh"
#include "stage/interrupt.hh"
#include "world/gui_loader.hh"

namespace Stg::program {

namespace {

constexpr int kFailure = 1, kSeveralWorlds = 255;

World* running = nullptr;  // read by the signal handler

bool HasDisplay() {
  const char* name = std::getenv("DISPLAY");
  return name && *name;
}

World* WithoutWindow(const std::string& reason) {
  messages::Report(LogLevel::kWarning, "stage: " + reason + "; running headless");
  return nullptr;
}

}  // namespace

World* OpenWindow(const Options& options, ReplayRun* replay) {
  if (options.no_gui || options.worldfiles.empty()) return nullptr;
  std::string message;
  if (!HasDisplay()) return WithoutWindow("no display for a window");
  const auto make = reinterpret_cast<MakeWindow>(FindInGui("stage_make_window", &message));
  if (!make) return WithoutWindow("no window: " + message);
  if (options.worldfiles.size() > 1)
    throw WindowError("found " + std::to_string(options.worldfiles.size()) +
                          " world files, expected one: with a window only a single world can be "
                          "simulated; -g runs them all without",
                      kSeveralWorlds);
  WindowRequest request;
  request.caption = "Stage";
  request.ends_at_quit_time = options.run.duration > 0;
  if (replay) {
    request.log_name = replay->name();
    request.log_start = replay->start();
    request.log_end = replay->end();
    request.seek_to = [replay](World&, double seconds) { replay->SeekTo(seconds); };
  }
  World* world = make(&request, &message);
  if (!world) throw WindowError(message, kFailure);
  return world;
}

void RunWindow(World* world) {
  running = world;
  OnSignal([] { running->QuitAll(); });
  if (!world->Paused()) world->Start();
  World::Run();
}

}  // namespace Stg::program
