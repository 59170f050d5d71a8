// SPDX-License-Identifier: GPL-2.0-or-later
//
// The `stage` program: runs world files.

#include <cinttypes>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <memory>
#include <new>
#include <optional>
#include <string>
#include <string_view>

#include "messages/report.hh"
#include "models/exception_origin.hh"
#include "stage.hh"
#include "stage/bag.hh"
#include "stage/budget.hh"
#include "stage/console.hh"
#include "stage/explain.hh"
#include "stage/explain_ray.hh"
#include "stage/help.hh"
#include "stage/interrupt.hh"
#include "stage/live.hh"
#include "stage/map_commands.hh"
#include "stage/options.hh"
#include "stage/pictures.hh"
#include "stage/process.hh"
#include "stage/replay.hh"
#include "stage/report.hh"
#include "stage/run.hh"
#include "stage/snapshots.hh"
#include "stage/sweep/commands.hh"
#include "stage/window.hh"
#include "world/prefilter_loader.hh"

namespace Stg::program {

namespace {

constexpr int kFailure = 1;
constexpr int kBadUsage = 2;

/// With --opencl, reports whether the device was of use.
void ReportDevice(const Options& options, const std::vector<LoadedWorld>& worlds) {
  if (!options.run.opencl) return;
  for (const LoadedWorld& loaded : worlds)
    PrintProgress("[OpenCL: " + DeviceUse(loaded.world->statistics(), options.run) + "]");
}

/// Returns the exit status.
int Finish(const Options& options, const std::optional<ReportFile>& report,
           const std::vector<LoadedWorld>& worlds, std::optional<OutputToError>* redirected) {
  EndClock();
  ReportDevice(options, worlds);
  PrintProgress("[Stage: done]");
  if (options.state_hash)
    for (const LoadedWorld& loaded : worlds)
      std::printf("state-hash %016" PRIx64 "\n", loaded.world->StateHash());
  redirected->reset();
  if (report) report->Write(Statistics(worlds));
  FlushOutput();
  return CaughtSignal() != 0 ? RaiseDefault(CaughtSignal()) : 0;
}

/// Opens the log requested by --log, or returns null. Throws UsageError.
std::unique_ptr<recording::Recorder> OpenLog(const Options& options) try {
  if (options.log.file.empty()) return nullptr;
  return std::make_unique<recording::Recorder>(options.log);
} catch (const std::runtime_error& error) {
  throw UsageError(error.what());
}

int Run(const Options& options, ReplayRun* replay) {
  const std::optional<ReportFile> report = OpenReport(options);
  std::optional<SnapshotSaver> saver = OpenSaver(options);
  const std::unique_ptr<PictureRun> pictures = PictureRun::Open(options);
  const std::unique_ptr<recording::Recorder> log = OpenLog(options);
  // A program may parse a report on standard output, so everything else goes to standard error.
  std::optional<OutputToError> redirected;
  if (report && report->IsStandardOutput()) redirected.emplace();
  PrintProgress(std::string("Stage ") + Version() + " " + options.tags);
  World* const special = pictures ? pictures->MakeWorld() : OpenWindow(options, replay);
  // Never deleted, like the worlds in it: the process ends without tearing them down.
  static std::vector<LoadedWorld>& worlds = *new std::vector<LoadedWorld>;
  if (replay) replay->BeginLoading();
  const int status = LoadWorlds(options, &worlds, special);
  if (replay) replay->EndLoading();
  if (status != 0) return status;
  if (!StartFromSnapshot(options, worlds)) return kFailure;
  CatchSignals();  // only now: while loading there is nothing to finish in order
  if (replay) replay->Attach(worlds.front().world);
  if (log) log->Attach(worlds.front().world);
  RunWorlds(options, &worlds, pictures.get(), saver ? &*saver : nullptr);
  if (log) log->Finish();
  if (saver && CaughtSignal() == 0 && !saver->IsDone()) return saver->ReportEarlyEnd(worlds);
  return Finish(options, report, worlds, &redirected);
}

int Main(int argc, char* argv[]) {
  ReserveStandardStreams();
  if (const std::optional<int> status = RunSweepCommand(argc, argv)) return *status;
  if (const std::optional<int> status = RunBagCommand(argc, argv)) return *status;
  BecomeMapCommand(argc, argv);
  Options options = ParseOptions(argc, argv);
  switch (options.action) {
    case Options::Action::kHelp:
      PrintWhole(HelpText());
      return 0;
    case Options::Action::kVersion:
      PrintWhole(std::string("stage ") + Version() + "\n");
      return 0;
    case Options::Action::kListDevices:
      PrintWhole(messages::PrintableLines(ListDevices(kOpenClPlugin)));
      return 0;
    case Options::Action::kLive:
      ShowLive(options);
    case Options::Action::kExplain:
    case Options::Action::kExplainRay:
    case Options::Action::kBudget:
    case Options::Action::kRun:
      break;
  }
  ShowMessages(options.progress);
  const std::unique_ptr<ReplayRun> replay = ReplayRun::Open(&options);
  World::run_options = options.run;  // before Init(), which seeds the random generators
  // The library does not use the C library's generators, but old controllers do.
  srand48(static_cast<long>(options.run.seed));
  srandom(static_cast<unsigned>(options.run.seed));
  World::ctrlargs = options.controller_args;
  Init(&argc, &argv);
  if (options.action == Options::Action::kExplain) return Explain(options);
  if (options.action == Options::Action::kExplainRay) return ExplainRay(options);
  if (options.action == Options::Action::kBudget) return PrintBudget(options);
  return Run(options, replay.get());
}

const char* AdviceFor(int argc, char* argv[]) {
  const std::string_view command = argc > 1 ? argv[1] : "";
  if (command == "sweep") return "; 'stage sweep --help' explains the options";
  if (command == "merge") return "; 'stage merge --help' explains the options";
  return "; 'stage --help' explains the options";
}

void ReportError(const std::string& text, const char* advice = "") {
  constexpr std::size_t kMaxLength = 250;  // bytes; the text may quote anything
  const std::string shown = messages::Shortened(text, kMaxLength);
  messages::Report(LogLevel::kError, "stage: " + shown + advice);
}

/// Reports the exception being handled. `message` is what() of a std::exception, or null.
void ReportException(const char* message) {
  std::fflush(stdout);
  ReportError(*ExceptionOrigin() ? DescribeThrown() : message ? message : DescribeException());
}

}  // namespace

}  // namespace Stg::program

int main(int argc, char* argv[]) {
  try {
    return Stg::program::Main(argc, argv);
  } catch (const Stg::program::UsageError& error) {
    Stg::program::ReportError(error.what(), Stg::program::AdviceFor(argc, argv));
    return Stg::program::kBadUsage;
  } catch (const Stg::program::WindowError& error) {
    Stg::program::ReportError(error.what());
    return error.status;
  } catch (const std::bad_alloc&) {
    std::fflush(stdout);
    std::fputs("stage: out of memory\n", stderr);
  } catch (const std::exception& error) {
    Stg::program::ReportException(error.what());
  } catch (...) {
    Stg::program::ReportException(nullptr);
  }
  return Stg::program::kFailure;
}
