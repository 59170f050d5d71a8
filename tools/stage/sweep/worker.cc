// SPDX-License-Identifier: GPL-2.0-or-later

#include "stage/sweep/worker.hh"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <optional>
#include <sstream>
#include <stdexcept>

#include "messages/report.hh"
#include "recording/recorder.hh"
#include "stage/interrupt.hh"
#include "stage/sweep/folder.hh"
#include "stage/sweep/lines.hh"
#include "stage/sweep/record.hh"

namespace Stg::program {

namespace {

/// A run that fails however often it is tried.
class BadRun : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

class Worker {
 public:
  explicit Worker(const std::string& folder) : folder_(folder), plan_(folder_.Read()) {
    World::ctrlargs = plan_.controller_args;
  }

  /// Throws BadRun.
  void Check(uint64_t index) {
    Load(RunAt(plan_, index));
    if (world_->GetQuitTime() == 0)
      throw BadRun("found a world without a quit_time, expected a --duration, or runs never end");
  }

  /// Throws BadRun.
  void Run(uint64_t index, int attempt) {
    const RunSpec spec = RunAt(plan_, index);
    Load(spec);
    const std::unique_ptr<recording::Recorder> log = OpenLog(index);
    const double start = WallClock();
    while (!world_->PastQuitTime() && !world_->TestQuit()) world_->Update();
    const double wall_seconds = WallClock() - start;
    if (log) {
      log->Finish();
      folder_.KeepLog(index);
    }
    folder_.WriteRecord(index, RecordOf(plan_, spec, world_.get(), wall_seconds, attempt));
  }

 private:
  /// Loads or resets the world, so that the run starts as in a new process.
  void Load(const RunSpec& spec) {
    // The library does not use the C library's generators, but old controllers do.
    srand48(static_cast<long>(spec.seed));
    srandom(static_cast<unsigned>(spec.seed));
    const RunOptions options = RunOptionsOf(plan_, spec);
    const bool same = world_ && world_->options().settings == options.settings;
    if (!same) {
      world_.reset();
      world_ = std::make_unique<World>(options);
    }
    const bool loaded = same ? world_->Reset(spec.seed) : world_->Load(plan_.world);
    if (loaded) return;
    const std::vector<std::string> messages = world_->LoadMessages();
    world_.reset();
    throw BadRun(messages.empty() ? "the world was not loaded" : messages.back());
  }

  std::unique_ptr<recording::Recorder> OpenLog(uint64_t index) {
    if (!plan_.log) return nullptr;
    recording::LogOptions options = *plan_.log;
    options.file = folder_.StartLog(index);
    auto log = std::make_unique<recording::Recorder>(options);
    log->Attach(world_.get());
    return log;
  }

  SweepFolder folder_;
  Plan plan_;
  std::unique_ptr<World> world_;
};

/// Executes a command line and returns the answer.
std::string Execute(Worker* worker, const std::string& line) try {
  std::istringstream words(line);
  std::string command;
  uint64_t index = 0;
  int attempt = 1;
  words >> command >> index;
  if (command == "run") words >> attempt;
  if (!words || (command != "run" && command != "check"))
    throw std::runtime_error("found the command '" + line + "', expected run or check");
  if (command == "check") {
    worker->Check(index);
    return "ok";
  }
  worker->Run(index, attempt);
  return "done " + std::to_string(index);
} catch (const BadRun& error) {
  return std::string("error ") + messages::Shortened(error.what(), messages::kMaxDetailBytes * 4);
}

}  // namespace

int RunWorker(const std::string& folder) {
  // Programs started by controllers must not inherit the coordinator's files.
  for (const int file : {kCommandsFile, kAnswersFile}) fcntl(file, F_SETFD, FD_CLOEXEC);
  Worker worker(folder);
  LineReader commands(kCommandsFile);
  while (const std::optional<std::string> line = commands.Next()) {
    const std::string answer = Execute(&worker, *line) + "\n";
    std::fflush(stdout);
    if (!WriteWhole(kAnswersFile, answer)) return 1;  // the coordinator has closed its end
  }
  // Skips destructors, since controllers may use models until the process ends.
  std::_Exit(0);
}

}  // namespace Stg::program
