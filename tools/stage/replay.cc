// SPDX-License-Identifier: GPL-2.0-or-later

#include "stage/replay.hh"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <string>

#include "messages/report.hh"

namespace Stg::program {

std::unique_ptr<ReplayRun> ReplayRun::Open(Options* options) {
  if (!options->replay) return nullptr;
  const std::string log = options->worldfiles.front();
  std::unique_ptr<ReplayRun> run(new ReplayRun(log, options->run.duration));
  if (run->replay_.ends_early())
    messages::Warn(messages::Quoted(log) + " ends early, at " +
                   std::to_string(static_cast<double>(run->replay_.end()) / 1e6) +
                   " s; later data are incomplete");
  options->worldfiles = {run->files_->world_file()};
  options->run.settings = run->replay_.settings();
  options->run.seed = run->replay_.seed();
  options->run.controllers = false;
  options->run.opencl = false;  // a replay traces no rays
  return run;
}

void ReplayRun::BeginLoading() {
  if (const char* path = std::getenv("STAGEPATH")) path_before_ = path;
  const std::string before = path_before_ ? ":" + *path_before_ : "";
  setenv("STAGEPATH", (files_->folders() + before).c_str(), 1);
}

void ReplayRun::EndLoading() {
  if (path_before_)
    setenv("STAGEPATH", path_before_->c_str(), 1);
  else
    unsetenv("STAGEPATH");
  files_.reset();
}

void ReplayRun::Attach(World* world) {
  world->SetQuitTime(End());
  replay_.Attach(world);
}

void ReplayRun::SeekTo(double seconds) {
  replay_.SeekTo(static_cast<usec_t>(std::llround(std::max(1e6 * seconds, 0.0))));
}

usec_t ReplayRun::End() const {
  return duration_ > 0 ? std::min(duration_, replay_.end()) : replay_.end();
}

double ReplayRun::end() const { return static_cast<double>(End()) / 1e6; }

}  // namespace Stg::program
