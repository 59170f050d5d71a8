// SPDX-License-Identifier: GPL-2.0-or-later

#include "stage/report.hh"

#include <sys/stat.h>
#include <sys/utsname.h>
#include <unistd.h>

#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <string_view>
#include <thread>

#include "files/whole_file.hh"
#include "messages/report.hh"
#include "stage/option_json.hh"
#include "stage/process.hh"
#include "stage/world_statistics.hh"
#include "world/statistics.hh"

namespace Stg::program {

namespace {

using Json = nlohmann::ordered_json;

/// Returns 0 instead of dividing by 0: JSON has no infinity.
double Ratio(double a, double b) {
  const double ratio = b != 0 ? a / b : 0;
  return std::isfinite(ratio) ? ratio : 0;
}

// ---- process and machine ------------------------------------------------------------------------

/// Prefers the board's name from the device tree: ARMv7 only reports the core's name, and aarch64
/// none at all.
std::string CpuName() {
  std::ifstream tree("/proc/device-tree/model");
  std::string board;
  std::getline(tree, board, '\0');
  return board.empty() ? FromProc("/proc/cpuinfo", "model name") : board;
}

Json Machine() {
  utsname system = {};
  uname(&system);
  return {{"system", std::string(system.sysname) + " " + system.release},
          {"architecture", system.machine},
          {"cpu", CpuName()},
          {"cores", std::thread::hardware_concurrency()}};
}

// ---- world --------------------------------------------------------------------------------------

Json OpenCl(const RunStatistics& run) {
  if (run.device.empty() && run.device_steps == 0) return nullptr;
  return {{"device", run.device},  // empty: it failed during the run
          {"steps_on_device", run.device_steps},
          {"rays_on_device", run.device_rays},
          {"compile_seconds", run.prefilter.compile_seconds},
          {"bytes_sent", run.prefilter.bytes_sent},
          {"bytes_fetched", run.prefilter.bytes_fetched},
          {"memory", run.prefilter.shared_memory ? "shared" : "own"},
          {"bytes_copied", run.prefilter.bytes_copied},
          {"bytes_mapped", run.prefilter.bytes_mapped},
          {"send_ms", run.prefilter.send_seconds * 1e3},
          {"walk_ms", run.prefilter.walk_seconds * 1e3},
          {"fetch_ms", run.prefilter.fetch_seconds * 1e3}};
}

Json PhasesPerStep(const RunStatistics& run) {
  const auto ms = [&run](double seconds) {
    return Ratio(seconds * 1e3, static_cast<double>(run.steps));
  };
  return {{"gather", ms(run.seconds.gather)},       {"prefilter", ms(run.seconds.prefilter)},
          {"trace", ms(run.seconds.trace)},         {"move", ms(run.seconds.move)},
          {"callbacks", ms(run.seconds.callbacks)}, {"energy", ms(run.seconds.energy)},
          {"fields", ms(run.seconds.fields)}};
}

Json Describe(const LoadedWorld& loaded) {
  World* world = loaded.world;
  const RunStatistics& run = world->statistics();
  const ModelCounts counts = CountModels(*world);
  const double simulated = static_cast<double>(world->SimTimeNow()) / 1e6;
  const double rays = static_cast<double>(run.trace.rays);

  return {{"worldfile", loaded.file},
          {"seed", world->seed()},
          {"options", ToJson(world->options())},
          {"robots", counts.robots},
          {"position_models", counts.positions},
          {"models", counts.models},
          {"ray_model", world->GetRayModel() == RayModel::kExact ? "exact" : "cell"},
          {"steps", run.steps},
          {"simulated_seconds", simulated},
          {"load_seconds", run.load_seconds},
          {"wall_seconds", loaded.wall_seconds},
          {"r_acc", Ratio(static_cast<double>(counts.robots) * simulated, loaded.wall_seconds)},
          {"rays", run.trace.rays},
          {"rays_per_second", Ratio(rays, loaded.wall_seconds)},
          {"potential_hits_per_ray", Ratio(static_cast<double>(run.trace.potential_hits), rays)},
          {"resumed_rays", run.trace.resumed},
          {"ranges_from_device", run.trace.ranges_given},
          {"threads", run.threads},
          {"metrics", MetricsOf(*world)},
          {"phases_ms_per_step", PhasesPerStep(run)},
          {"opencl", OpenCl(run)}};
}

// ---- files --------------------------------------------------------------------------------------

[[noreturn]] void Fail(const std::string& name, int error) {
  if (error == EEXIST)
    throw std::runtime_error("--stats: found '" + name +
                             "', which is not a statistics file, expected a new name or earlier "
                             "statistics");
  throw std::runtime_error("can't write the statistics to '" + name + "': " + std::strerror(error));
}

/// True if a file starts like the output of Statistics() and ExplanationJson().
bool IsReport(std::string_view beginning) {
  return beginning.starts_with("{\n  \"program\": \"stage\",");
}

/// True if the name refers to standard output.
bool IsStandardOutput(const std::string& name) {
  for (const char* known : {"-", "/dev/stdout", "/dev/fd/1", "/proc/self/fd/1"})
    if (name == known) return true;
  struct stat named = {}, output = {};
  return stat(name.c_str(), &named) == 0 && fstat(STDOUT_FILENO, &output) == 0 &&
         S_ISREG(named.st_mode) && named.st_dev == output.st_dev && named.st_ino == output.st_ino;
}

}  // namespace

std::string Statistics(const std::vector<LoadedWorld>& worlds) {
  Json json = {{"program", "stage"}, {"version", Version()}};
  double wall_seconds = 0;
  Json list = Json::array();
  for (const LoadedWorld& loaded : worlds) {
    wall_seconds += loaded.wall_seconds;
    list.push_back(Describe(loaded));
  }
  if (list.size() == 1) {
    json.update(list[0]);
  } else {
    json["wall_seconds"] = wall_seconds;
    json["worlds"] = list;
  }
  json["peak_memory_mb"] = PeakMemoryMb();
  json["machine"] = Machine();
  // File names may be invalid UTF-8 or contain control characters; the output is plain ASCII.
  return json.dump(2, ' ', true, Json::error_handler_t::replace) + "\n";
}

std::string DeviceUse(const RunStatistics& run, const RunOptions& options) {
  if (run.device.empty())
    return run.device_steps > 0 ? "the device was lost in the middle of the run"
                                : "no device was used";
  const std::string name = messages::Shortened(run.device);
  if (run.steps == 0 || run.trace.rays == 0)
    return name + " had nothing to do: no rays were traced";
  const std::string part =
      std::to_string(run.device_steps) + " of " + std::to_string(run.steps) + " steps";
  if (options.always_on_device)
    return name + " traced the rays of " + part + ", faster or not; --opencl alone measures that";
  if (2 * run.device_rays >= run.trace.rays)
    return name + " helped: it traced the rays of " + part +
           "; on the other steps, the host was as fast or was being measured";
  return name + " did not help: it traced the rays of " + part +
         ", mostly to measure that; the host's threads were faster, and without --opencl the run "
         "takes less memory";
}

ReportFile::ReportFile(const std::string& name) : name_(name) {
  if (program::IsStandardOutput(name)) return;
  place_ = files::AbsolutePath(name);
  if (const int error = files::TryReplaceFile(place_, IsReport); error != 0) Fail(name, error);
}

void ReportFile::Write(const std::string& text) const {
  if (place_.empty()) {
    PrintWhole(text);
  } else if (const int error = files::ReplaceFile(place_, text, IsReport); error != 0) {
    Fail(name_, error);
  }
}

void PrintUnlessReport(const std::optional<ReportFile>& report, const std::string& text) {
  std::optional<OutputToError> redirected;
  if (report && report->IsStandardOutput()) redirected.emplace();
  PrintWhole(text);
}

std::optional<ReportFile> OpenReport(const Options& options) try {
  if (options.stats_file.empty()) return std::nullopt;
  return ReportFile(options.stats_file);
} catch (const std::runtime_error& error) {
  throw UsageError(error.what());
}

}  // namespace Stg::program
